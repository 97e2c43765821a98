#!/bin/bash
# SPDX-License-Identifier: MIT
# fetch_unity.sh PYTHON LOCK OUT: puts unity.c, unity.h, unity_internals.h and the licence of Unity into OUT. pip of
# PYTHON downloads the package that LOCK pins by its hash. Run by the Makefile before the C tests are compiled. Writes
# OUT and a temporary folder; installs nothing.
set -euo pipefail
python=$1 lock=$2 out=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$python" -m pip download --quiet --no-deps --require-hashes --no-binary :all: --no-build-isolation -r "$lock" -d "$work"
tar -xzf "$work"/pytest_unity-*.tar.gz -C "$work"
mkdir -p "$out"
cp "$work"/pytest_unity-*/vendor/unity/LICENSE.txt "$work"/pytest_unity-*/vendor/unity/src/*.[ch] "$out"/
touch "$out"/*
