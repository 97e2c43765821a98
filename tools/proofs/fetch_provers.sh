#!/bin/bash
# SPDX-License-Identifier: MIT
# fetch_provers.sh LOCK OUT: puts Frama-C and CBMC under OUT, as OUT/bin/{frama-c,cbmc,goto-cc,goto-instrument}.
#
# Nothing is installed. Frama-C asks findlib for packages that are linked into it already; empty descriptions satisfy it.
set -euo pipefail
lock=$1 out=$2
archive=${DEBIAN_MIRROR:-https://deb.debian.org/debian}
mkdir -p "$out"
out=$(cd "$out" && pwd)
rm -rf "${out:?}"/{root,bin,stubs}
mkdir -p "$out"/{root,bin,debs}
while read -r hash path; do
    file=$out/debs/${path##*/}
    if ! echo "$hash  $file" | sha256sum --check --status 2>/dev/null; then
        python3 -c 'import sys, urllib.request; urllib.request.urlretrieve(*sys.argv[1:])' "$archive/$path" "$file" || {
            echo "fetch_provers: $archive has no $path any more: take the newer version's hash and name from its index into $lock" >&2
            exit 1
        }
        echo "$hash  $file" | sha256sum --check --quiet
    fi
    dpkg-deb -x "$file" "$out/root"
done < <(grep -v '^#' "$lock")

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
rm -rf "$out/debs"
