#!/usr/bin/env bash
# Builds the Python wheel that is handed out: `tools/build_wheel.sh FOLDER`. It contains the library and the program `teachtree`, needs no compiler where it is
# installed, and takes Python 3.11 or newer. On Linux, Zig links it against glibc 2.17 (manylinux2014), and auditwheel confirms that.
set -euo pipefail
cd "$(dirname "$0")/.."
mkdir -p "$1"
out=$(cd "$1" && pwd)
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target} CARGO_INCREMENTAL=0

# The tools stay in the target folder, with fixed versions.
tools=$CARGO_TARGET_DIR/wheel-tools
python=$(command -v python3 || command -v python)
"$python" -m venv "$tools"
programs=$tools/bin
[ -d "$programs" ] || programs=$tools/Scripts
"$programs/pip" install --quiet maturin==1.16.0 ziglang==0.15.2 auditwheel==6.8.2
PATH="$programs:$PATH"

platform=()
[ "$(uname -s)" != Linux ] || platform=(--zig --compatibility manylinux2014)
rm -f "$out"/teachtree-*.whl
maturin build --manifest-path python/Cargo.toml --profile dist --locked --compression-level 9 --out "$out" "${platform[@]}"

wheel=$(echo "$out"/teachtree-*.whl)
if [ "$(uname -s)" = Linux ]; then
    auditwheel show "$wheel" | tee "$out/audit.txt"
    grep -q 'manylinux_2_17_x86_64\|manylinux_2_17_aarch64' "$out/audit.txt" || { echo "$wheel needs a newer glibc than 2.17" >&2; exit 1; }
    rm "$out/audit.txt"
fi
size=$(stat -c %s "$wheel" 2>/dev/null || stat -f %z "$wheel")
[ "$size" -le 15000000 ] || { echo "$wheel has $size bytes, more than 15 MB" >&2; exit 1; }
echo "$wheel: $size bytes"
