#!/usr/bin/env bash
# Makes what is handed out: `tools/release.sh FOLDER` writes the archive of the program, the list of what it is made of (CycloneDX, an SBOM) where
# `cargo cyclonedx` is installed, and their checksums. The same commit, compiler and system shall give the same bytes, in whatever folder they are built.
set -euo pipefail
cd "$(dirname "$0")/.."
mkdir -p "$1"
out=$(cd "$1" && pwd)
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -n 1)
host=$(rustc -vV | sed -n 's/^host: //p')
name=teachtree-$version-$host
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH

# Names of folders of this machine are in panic messages, of Rust and of C.
here=$PWD
cargo_home=${CARGO_HOME:-$HOME/.cargo}
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$here/target} CARGO_INCREMENTAL=0
export RUSTFLAGS="--remap-path-prefix=$here=/teachtree --remap-path-prefix=$cargo_home=/cargo --remap-path-prefix=$CARGO_TARGET_DIR=/target"
export CFLAGS="-ffile-prefix-map=$cargo_home=/cargo -ffile-prefix-map=$CARGO_TARGET_DIR=/target"
cargo build --profile dist --locked --bin teachtree

files=$(mktemp -d)
trap 'rm -rf "$files"' EXIT
mkdir "$files/$name"
cp "$CARGO_TARGET_DIR/dist/teachtree" README.md CHANGELOG.md LICENSE-APACHE LICENSE-MIT SECURITY.md "$files/$name"
tar --sort=name --mtime="@$SOURCE_DATE_EPOCH" --owner=0 --group=0 --numeric-owner --mode=u+rwX,go+rX,go-w -C "$files" -cf - "$name" | gzip -9n > "$out/$name.tar.gz"
if cargo cyclonedx --version >/dev/null 2>&1; then
    cargo cyclonedx --format json --target "$host" --override-filename "$name" --quiet
    sed "s|path+file://$here|path+file:///teachtree|g" "$name.json" > "$out/$name.cdx.json"
    rm "$name.json"
    rm -f ./*/"$name.json" ./crates/*/"$name.json"
else
    echo "cargo cyclonedx is not installed: no list of what the program is made of" >&2
fi
cd "$out"
rm -f "$name.sha256"
sha256sum "$name".* | tee "$name.sha256"
