#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""make_release.py: the source distribution and the wheel, the same bytes from the same commit: `make dist`.

    make_release.py OUT [--platform TAG]

Run by `make dist` and `make wheels`. Used by dist/debian. Starts git and the build of the package (setup.py); writes to
OUT and to a temporary folder.

The wheel is built from the unpacked source distribution, so that it has nothing that the distribution lacks. Times in
both are SOURCE_DATE_EPOCH, or that of the last commit. `--platform` names the platform of the wheel, for compilers
($CC, $AR) that build for another platform than this computer's.
"""

from __future__ import annotations

import argparse
import gzip
import hashlib
import os
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
_BUILD = "from setuptools.build_meta import {what}; {what}({out!r})"


def epoch_s() -> int:
    """The time that all files get."""
    given = os.environ.get("SOURCE_DATE_EPOCH")
    if given:
        return int(given)
    command = ["git", "-C", str(ROOT), "log", "-1", "--format=%ct"]
    return int(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def build_environment(time_s: int, given: Mapping[str, str]) -> dict[str, str]:
    """Environment of the build backend. $LDSHARED stays as it is given: it links for another platform."""
    return {
        # Python's own link command may name folders of this computer, which the module would then search.
        "LDSHARED": f"{sysconfig.get_config_var('CC') or 'cc'} -shared",
        **given,
        "SOURCE_DATE_EPOCH": str(time_s),
        "HODOGRAPH_BUILT_BY_MAKE": "",
    }


def backend(what: str, tree: Path, out: Path, time_s: int) -> None:
    """Calls build_sdist or build_wheel of the build backend in a tree; raises CalledProcessError."""
    environment = build_environment(time_s, os.environ)
    command = [sys.executable, "-c", _BUILD.format(what=what, out=str(out))]
    subprocess.run(command, check=True, cwd=tree, env=environment, stdout=subprocess.DEVNULL)


def checked_out(folder: Path) -> Path:
    """A copy of the files that git knows, as they are now."""
    listed = subprocess.run(
        ["git", "-C", str(ROOT), "ls-files", "-co", "--exclude-standard", "-z"],
        check=True,
        capture_output=True,
    ).stdout
    tree = folder / "tree"
    for name in filter(None, listed.decode().split("\0")):
        source = ROOT / name
        if not source.exists():
            continue  # removed, and not yet committed
        target = tree / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.is_symlink():
            target.symlink_to(source.readlink())
        else:
            target.write_bytes(source.read_bytes())
            target.chmod(source.stat().st_mode)
    return tree


def make_share(tree: Path) -> None:
    """Man page and shell completion into a tree, from which setup.py installs them; a clone is without them."""
    command = [sys.executable, str(ROOT / "tools/make_share.py"), str(tree / "packaging/share")]
    subprocess.run(command, check=True)


def normalised(archive: Path, target: Path, time_s: int) -> Path:
    """The archive with its members in order, without owners, with one time."""
    with (
        tarfile.open(archive) as source,
        target.open("wb") as raw,
        gzip.GzipFile(filename="", fileobj=raw, mode="wb", mtime=time_s) as packed,
        tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as made,
    ):
        for member in sorted(source.getmembers(), key=lambda member: member.name):
            member.mtime, member.uid, member.gid = time_s, 0, 0
            member.uname = member.gname = ""
            member.mode = 0o755 if member.isdir() or member.mode & 0o100 else 0o644
            member.pax_headers = {}
            made.addfile(member, source.extractfile(member) if member.isfile() else None)
    return target


def put(file: Path, out: Path) -> Path:
    """A copy of a file in `out`, there as a whole or not at all: `make wheels` makes several releases at a time."""
    target = out / file.name
    with tempfile.NamedTemporaryFile(dir=out, prefix=f".{file.name}.", delete=False) as part:
        part.write(file.read_bytes())
    Path(part.name).chmod(0o644)
    return Path(part.name).replace(target)


def make_release(out: Path, platform: str | None) -> list[Path]:
    """Source distribution and wheel in `out`."""
    out.mkdir(parents=True, exist_ok=True)
    time_s = epoch_s()
    with tempfile.TemporaryDirectory(prefix="hodograph-dist-") as folder:
        work = Path(folder)
        checkout = checked_out(work)
        make_share(checkout)
        backend("build_sdist", checkout, work, time_s)
        made = next(work.glob("hodograph-*.tar.gz"))
        source = normalised(made, work / f"normalised-{made.name}", time_s).replace(made)
        with tarfile.open(source) as archive:
            archive.extractall(work / "source", filter="data")
        (tree,) = (work / "source").iterdir()
        if platform is not None:
            with (tree / "setup.cfg").open("a", encoding="ascii") as settings:
                settings.write(f"\n[bdist_wheel]\nplat_name = {platform}\n")
        backend("build_wheel", tree, work, time_s)
        wheel = next(work.glob("hodograph-*.whl"))
        return [put(source, out), put(wheel, out)]


def main() -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--platform", metavar="TAG", help="as in manylinux2014_aarch64")
    options = parser.parse_args()
    for file in make_release(options.out.resolve(), options.platform):
        data = file.read_bytes()
        print(f"{hashlib.sha256(data).hexdigest()}  {file.name}  {len(data) / 1e6:.2f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
