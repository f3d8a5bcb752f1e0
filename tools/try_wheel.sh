#!/usr/bin/env bash
# Installs a wheel on a bare Debian, which has Python but no compiler, and runs the demo: `tools/try_wheel.sh WHEEL`.
# It needs root, debootstrap and a Debian mirror. Without them it prints why the trial is skipped and succeeds.
set -euo pipefail
wheel=$(realpath "$1")
skip() {
    echo "skipped: $*"
    exit 0
}
[ "$(id -u)" = 0 ] || skip "only root can unpack and enter a Debian root"
command -v debootstrap >/dev/null || skip "debootstrap is not installed"
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
mirror=${DEBIAN_MIRROR:-http://deb.debian.org/debian}
debootstrap --variant=minbase --include=python3,python3-venv bookworm "$root" "$mirror" >"$root.log" 2>&1 || {
    tail -n 3 "$root.log"
    skip "no Debian root from $mirror"
}
rm -f "$root.log"
cp "$wheel" "$root/opt/"
# No network is used from here on: `--no-index`.
chroot "$root" /bin/sh -euc "
    for compiler in cc gcc clang rustc; do
        if command -v \$compiler; then exit 1; fi
    done
    python3 -m venv /opt/venv
    /opt/venv/bin/pip install --quiet --no-index '/opt/$(basename "$wheel")'
    cd /opt
    /opt/venv/bin/teachtree demo
    test -s teachtree-demo/report.html
    /opt/venv/bin/python -c 'import teachtree; print(teachtree.analyze(\"teachtree-demo/demonstration.csv\"))'
"
echo "holds: $(basename "$wheel") runs on a bare Debian 12"
