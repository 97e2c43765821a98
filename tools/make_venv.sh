#!/bin/bash
# SPDX-License-Identifier: MIT
# make_venv.sh VENV LOCK: makes the virtual environment when it is missing or broken, installs the locked
# requirements and leaves VENV/.ready with the path of the tree it was made for. Run by the Makefile and by
# packaging/packaging.mk. Needs the network; writes VENV and the lock file .venv.lock.
set -euo pipefail
venv=$1 lock=$2
exec 9>".venv.lock"
flock 9
# Another make may have done it while this one waited.
if [ "$venv/.ready" -nt "$lock" ] && [ "$(cat "$venv/.ready")" = "$PWD" ]; then
    exit 0
fi
if ! "$venv/bin/python" -m pip --version >/dev/null 2>&1 ||
    ! grep -qsF "$PWD/$venv" "$venv/bin/activate"; then
    rm -rf "$venv"
    "${PYTHON:-python3}" -m venv "$venv"
fi
echo "installing the locked Python requirements into $venv" >&2
"$venv/bin/python" -m pip install --quiet --disable-pip-version-check --require-hashes --no-deps -r "$lock"
printf '%s\n' "$PWD" >"$venv/.ready"
