#!/usr/bin/env bash
# Installs the program as FOLDER/bin/teachtree, for the pre-commit hook and the GitHub action: `tools/install.sh FOLDER`.
# It takes the wheel of this version from the repository's release, where the release has one for this system; else it builds the program.
# TEACHTREE_RELEASE names another page or folder with wheels.
set -euo pipefail
mkdir -p "$1/bin"
folder=$(cd "$1" && pwd)
cd "$(dirname "$0")/.."
[ ! -x "$folder/bin/teachtree" ] || exit 0
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -n 1)

# The address of this repository: the action's, or that of a clone.
if [ -n "${GITHUB_ACTION_REPOSITORY:-}" ]; then
    repository=$GITHUB_SERVER_URL/$GITHUB_ACTION_REPOSITORY
else
    repository=$(git config --get remote.origin.url 2>/dev/null | sed -e 's|^git@\([^:]*\):|https://\1/|' -e 's|\.git$||' || true)
fi
release=${TEACHTREE_RELEASE:-$repository/releases/expanded_assets/v$version}

python=$(command -v python3 || command -v python || true)
if [ -n "$python" ] && "$python" -m venv "$folder/venv" 2>/dev/null; then
    programs=$folder/venv/bin
    [ -d "$programs" ] || programs=$folder/venv/Scripts
    if "$programs/pip" install --quiet --no-index --find-links "$release" "teachtree==$version" 2>"$folder/pip.log"; then
        printf '#!/bin/sh\nexec "%s/teachtree" "$@"\n' "$programs" >"$folder/bin/teachtree"
        chmod +x "$folder/bin/teachtree"
        exit 0
    fi
    rm -rf "$folder/venv"
fi
echo "no wheel of teachtree $version for this system at $release: building it, which takes minutes" >&2
cargo install --path . --locked --root "$folder"
