#!/usr/bin/env bash
# Runs the program for pre-commit: `tools/hook.sh fmt FILE…`. The first run installs it beside this clone, which pre-commit keeps.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
"$here/tools/install.sh" "$here/target/hook"
exec "$here/target/hook/bin/teachtree" "$@"
