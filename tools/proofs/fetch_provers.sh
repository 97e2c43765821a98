#!/bin/bash
# SPDX-License-Identifier: MIT
# fetch_provers.sh LOCK OUT: puts Frama-C and CBMC under OUT, as OUT/bin/{frama-c,cbmc,goto-cc,goto-instrument}.
#
# A package is the one of LOCK, by its hash. When the mirror has replaced it by a newer one (which Debian does to stable
# releases every few months), apt takes that, under Debian's signature, and this says so.
#
# Nothing is installed. Frama-C asks findlib for packages that are linked into it already; empty descriptions satisfy it.
set -euo pipefail
lock=$1 out=$2
archive=${DEBIAN_MIRROR:-https://deb.debian.org/debian}
mkdir -p "$out"
out=$(cd "$out" && pwd)
rm -rf "${out:?}"/{root,bin,stubs,debs}
mkdir -p "$out"/{root,bin,debs}

# pinned HASH PATH FILE: the very file of the lock; false when the mirror does not have it.
pinned() {
    python3 -c 'import sys, urllib.request; urllib.request.urlretrieve(*sys.argv[1:])' "$archive/$2" "$3" 2>/dev/null || return 1
    echo "$1  $3" | sha256sum --check --status
}

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

# newest SUITE PACKAGE: into debs/, signature and hash looked at by apt.
newest() {
    [ -e "$out/apt/$1/updated" ] || apt_of "$1" update
    touch "$out/apt/$1/updated"
    (cd "$out/debs" && apt_of "$1" download "$2")
}

while read -r hash suite path; do
    file=$out/debs/${path##*/}
    package=${path##*/}
    package=${package%%_*}
    if ! pinned "$hash" "$path" "$file"; then
        rm -f "$file"
        newest "$suite" "$package"
        file=$(ls "$out/debs/${package}"_*.deb)
        echo "fetch_provers: the mirror has no ${path##*/} of the hash locked; took ${file##*/} of $suite, $(sha256sum < "$file" | cut -d' ' -f1): bring $lock up to date"
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
