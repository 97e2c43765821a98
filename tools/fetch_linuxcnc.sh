#!/bin/bash
# SPDX-License-Identifier: MIT
# fetch_linuxcnc.sh OUT: unpacks the interpreter of LinuxCNC and the programs that come with it from Debian's packages
# into OUT/root. Nothing is installed; the packages are those that the machine's apt would install.
# Run by tests/support/linuxcnc.py. Needs the network; writes OUT and a temporary folder.
set -euo pipefail
out=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
command -v apt-get dpkg > /dev/null || { echo "fetch_linuxcnc: needs apt-get and dpkg of Debian" >&2; exit 1; }
chmod 755 "$work"
boost=$(apt-cache depends linuxcnc-uspace | sed -n 's/.*Depends: \(libboost-python[0-9.]*\)$/\1/p' | head -1)
(cd "$work" && apt-get -qq -o APT::Sandbox::User=root download linuxcnc-uspace "$boost")
rm -rf "$out"
mkdir -p "$out/root"
for package in "$work"/*.deb; do dpkg -x "$package" "$out/root"; done
test -x "$out/root/usr/bin/rs274"
touch "$out/.ready"
