#!/usr/bin/env bash
# Tests the grammar with the tree-sitter CLI of the version in package.json: the program that TREE_SITTER names, else `tree-sitter`, else from npm.
#
# `src/parser.c` is the one of `grammar.js`, the queries compile, the cases of `test/corpus` have their trees, every rule file and every block of the
# language reference parses, and every fixture that the compiler refuses for its syntax has an ERROR or MISSING node.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
version=$(sed -n 's/.*"tree-sitter-cli": "\(.*\)".*/\1/p' "$here/package.json")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export XDG_CACHE_HOME="$work/cache" XDG_CONFIG_HOME="$work/config"

is_pinned() { [ "$("$@" --version 2>/dev/null | cut -d ' ' -f 2)" = "$version" ]; }
cli=("${TREE_SITTER:-tree-sitter}")
is_pinned "${cli[@]}" || {
    cli=(npx --yes "tree-sitter-cli@$version")
    is_pinned timeout 120 "${cli[@]}" || {
        echo "skipped: the tree-sitter CLI $version is neither installed nor available from npm"
        exit 0
    }
}
fail() {
    echo "$1" >&2
    exit 1
}

# All in a copy, because the CLI writes into the folder of the grammar.
grammar="$work/grammar"
mkdir "$grammar"
cp -R "$here"/{grammar.js,tree-sitter.json,queries,test} "$grammar"
cd "$grammar"
"${cli[@]}" generate
cmp src/parser.c "$here/src/parser.c" || fail "src/parser.c is not the parser of grammar.js: run \`npx tree-sitter-cli@$version generate\`"
"${cli[@]}" test --grammar-path .

# Files that parse, and files that do not: a fixture begins with the code of its one error. Units are tokens here, so that an unknown one is an ERROR.
awk '/^```rules/ { file = sprintf("%s/block-%03d.rules", work, ++blocks); next } /^```/ { file = "" } file { print > file }' \
    work="$work" "$root/grammar/README.md"
find "$root" \( -name target -o -name node_modules -o -name '.*' \) -prune -o -name '*.rules' -print | sort >"$work/all"
ls "$work"/block-*.rules >>"$work/all"
while read -r file; do
    case $(head -n 1 "$file") in
        '// E10'* | '// E207:'* | '// Twenty different mistakes'*) echo "$file" ;;
    esac
done <"$work/all" >"$work/refused"
[ "$(wc -l <"$work/all")" -gt 150 ] && [ "$(wc -l <"$work/refused")" -gt 20 ] || fail "the search for rule files has gone wrong"

"${cli[@]}" parse --quiet --grammar-path . --paths "$work/all" 2>"$work/stderr" | grep -E '\((ERROR|MISSING) ' >"$work/faults" || true
awk -F '\t' '{ sub(/ +$/, "", $1); print $1 }' "$work/faults" | sort >"$work/found"
sort -o "$work/refused" "$work/refused"
{
    comm -13 "$work/refused" "$work/found" | sed 's/$/: the grammar refuses it, the compiler does not/'
    comm -23 "$work/refused" "$work/found" | sed 's/$/: the compiler refuses its syntax, the grammar does not/'
} >"$work/wrong"
if [ -s "$work/wrong" ]; then
    cat "$work/wrong" >&2
    fail "$(wc -l <"$work/wrong") of $(wc -l <"$work/all") files parse otherwise than expected"
fi

# A query that names an unknown node or word is an error.
for query in queries/*.scm; do
    "${cli[@]}" query --grammar-path . --quiet "$query" "$root/rules/bimanual.rules" >"$work/matches" 2>&1 || {
        cat "$work/matches" >&2
        fail "$query does not fit the grammar"
    }
done
echo "$(wc -l <"$work/all") rule files parse as expected, $(wc -l <"$work/refused") of them with a fault"
