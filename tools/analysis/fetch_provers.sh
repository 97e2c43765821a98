#!/bin/bash
# SPDX-License-Identifier: MIT
# fetch_provers.sh LOCK OUT: puts Frama-C and CBMC under OUT, as OUT/bin/{frama-c,cbmc,goto-cc,goto-instrument}.
#
# apt downloads each package of LOCK from its Debian release, under Debian's signature, and its hash is compared with
# that of LOCK. Where the release has a newer one by now (Debian replaces packages of stable releases every few months),
# that is taken, and this says so. The archive is the one this machine's apt has Debian from, or $DEBIAN_MIRROR.
#
# Run by `make proofs` (tests/proofs/proofs.mk). Writes below OUT only, and needs the network; nothing is installed.
# Frama-C asks findlib for packages that are linked into it already; empty descriptions satisfy it.
set -euo pipefail
lock=$1 out=$2
# shellcheck disable=SC2016  # apt fills in these fields
archive=${DEBIAN_MIRROR:-$(apt-get indextargets --format '$(ORIGIN)|$(LABEL)|$(REPO_URI)' 'Created-By: Packages' |
    awk -F '|' '!found && ($1 == "Debian" && $2 == "Debian" || $3 ~ /\/debian\/?$/) { print $3; found = 1 }')}
if [ -z "$archive" ]; then
    echo "fetch_provers: apt has no Debian archive here: set DEBIAN_MIRROR to the address of one" >&2
    exit 1
fi
mkdir -p "$out"
out=$(cd "$out" && pwd)
rm -rf "${out:?}"/{root,bin,stubs,debs}
mkdir -p "$out"/{root,bin,debs}

# apt_of SUITE COMMAND...: apt-get with an archive and a state of its own.
apt_of() {
    local state=$out/apt/$1
    mkdir -p "$state"/{lists,cache/archives}/partial "$state/etc/preferences.d"
    touch "$state/status"
    echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $archive $1 main" > "$state/etc/sources.list"
    apt-get -qq -o Dir::State="$state" -o Dir::State::status="$state/status" -o Dir::Cache="$state/cache" \
        -o Dir::Etc="$state/etc" -o Dir::Etc::sourceparts=/dev/null -o APT::Architecture=amd64 \
        -o Acquire::Languages=none -o APT::Sandbox::User="$(id -un)" "${@:2}"
}

# fetch SUITE PACKAGE: into debs/; apt checks the signature.
fetch() {
    [ -e "$out/apt/$1/updated" ] || apt_of "$1" update
    touch "$out/apt/$1/updated"
    (cd "$out/debs" && apt_of "$1" download "$2")
}

while read -r hash suite locked; do
    package=${locked%%_*}
    fetch "$suite" "$package"
    file=$(ls "$out/debs/${package}"_*.deb)
    if ! echo "$hash  $file" | sha256sum --check --status; then
        echo "fetch_provers: $suite has ${file##*/} instead of $locked, $(sha256sum < "$file" | cut -d' ' -f1): bring $lock up to date"
    fi
    dpkg-deb -x "$file" "$out/root"
done < <(grep -v '^#' "$lock")
rm -rf "${out:?}"/{apt,debs}

for name in findlib unix str dynlink threads bigarray bytes ocamlgraph zarith stdlib-shims seq biniou easy-format why3 result ppx_import ppx_deriving; do
    mkdir -p "$out/stubs/$name"
    echo 'version = "0"' > "$out/stubs/$name/META"
done
for part in eq ord show; do
    printf 'package "%s" (\n  version = "0"\n)\n' $part >> "$out/stubs/ppx_deriving/META"
done
echo "path = \"$out/stubs:$out/root/usr/lib/frama-c/plugins:$out/root/usr/lib/ocaml\"" > "$out/findlib.conf"

cat > "$out/bin/frama-c" <<END
#!/bin/sh
export FRAMAC_SHARE=$out/root/usr/share/frama-c FRAMAC_LIB=$out/root/usr/lib/frama-c
export FRAMAC_PLUGIN=$out/root/usr/lib/frama-c/plugins OCAMLFIND_CONF=$out/findlib.conf
exec $out/root/usr/bin/frama-c -no-autoload-plugins -load-module eva,scope,inout,callgraph,from,server,variadic "\$@"
END
for program in cbmc goto-cc goto-instrument; do
    cat > "$out/bin/$program" <<END
#!/bin/sh
lib=$out/root/usr/lib
exec \$lib/x86_64-linux-gnu/ld-linux-x86-64.so.2 --library-path \$lib/x86_64-linux-gnu:\$lib $out/root/usr/bin/$program "\$@"
END
done
chmod +x "$out"/bin/*
