#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""debian.py: the Debian packages hodograph, libhodographN and libhodograph-dev: `make deb`.

    debian.py --build BUILD OUT

Run by `make deb`. Starts processes; writes packages to OUT, all else to a temporary folder.

Programs and library are those of `make build`, the Python packages those of `make runtime`. The host tools come with
the Python packages that they need, at the locked versions and with the locked hashes, in a virtual environment in
/usr/lib/hodograph: Debian's own packages of these are other versions, or not there. So the package works with one
version of Python, that of this computer's .venv.
debhelper makes the packages.
"""

from __future__ import annotations

import argparse
import email.utils
import os
import shutil
import subprocess
import sys
import tempfile
from importlib.metadata import Distribution, distributions
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from dist.library import ROOT, Abi, filled, version
from dist.make_release import epoch_s, make_release
from dist.runtime import PYTHON, SITE, pip_install

PARTS = ROOT / "packaging/debian"
HOME = Path("usr/lib/hodograph")
LAUNCHER = f"""\
#!/bin/sh
exec /{HOME}/bin/python3 -P -m hodograph "$@"
"""
COPYRIGHT = """\
Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: hodograph
"""
BRINGS = """\
Comment: The package hodograph also has the Python packages below, as their authors distribute them. The text of each
 licence lies beside the package, in the folder that "Files" names, with those of the libraries that it brings.
"""
OWN = """\

Files: *
Copyright: 2026 The Hodograph authors
License: MIT

"""
COMMON_LICENSES = {
    "Apache": "Apache-2.0",
    "LGPL": "LGPL-3",
    "Lesser General Public": "LGPL-3",
    "MPL": "MPL-2.0",
    "Mozilla": "MPL-2.0",
}
"""Words in the name of a licence: its file in Debian's /usr/share/common-licenses."""


class PackageError(Exception):
    """Something is not as a package needs it; the message says what."""


def run(*command: object, cwd: Path = ROOT) -> None:
    """Raises PackageError where a command fails; its own words come before."""
    done = subprocess.run(list(map(str, command)), cwd=cwd, check=False, stdout=subprocess.DEVNULL)
    if done.returncode != 0:
        raise PackageError(f"{command[0]} failed with status {done.returncode}")


def output(*command: str) -> str:
    """First line of what a command prints."""
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def check_python() -> None:
    """The packages of .venv have to serve the Python of the system."""
    system = output("/usr/bin/python3", "-c", "import sys; print(*sys.version_info[:2], sep='.')")
    if f"python{system}" != PYTHON:
        raise PackageError(
            f".venv has {PYTHON}, the system Python {system}: make distclean, then make deb PYTHON=/usr/bin/python3"
        )


def stage_python(build: Path, stage: Path, work: Path) -> None:
    """The virtual environment with the host tools, and the command that starts it."""
    home = stage / HOME
    shutil.copytree(
        build / "runtime", home, symlinks=True, ignore=lambda *_: {".ready", "__pycache__"}
    )
    _, wheel = make_release(work / "wheel", None)
    site = home / SITE
    pip_install(site, "--no-index", wheel)
    shutil.rmtree(site / "bin")
    shutil.rmtree(site / "hodograph/bin")  # the same programs are in /usr/bin
    share = site / "share"  # of the wheel's data files
    (share / "zsh/site-functions").rename(share / "zsh/vendor-completions")
    shutil.copytree(share, stage / "usr/share", dirs_exist_ok=True)
    shutil.rmtree(share)
    (information,) = site.glob("hodograph-*.dist-info")
    forget_origin(information)
    command = stage / "usr/bin/hodograph"
    command.write_text(LAUNCHER, encoding="utf-8")
    command.chmod(0o755)


def forget_origin(information: Path) -> None:
    """Takes where the wheel lay on this computer out of the information that pip leaves about it."""
    name = "direct_url.json"
    (information / name).unlink()
    record = information / "RECORD"
    lines = record.read_bytes().splitlines(keepends=True)
    origin = f"{information.name}/{name},".encode()
    record.write_bytes(b"".join(line for line in lines if not line.startswith(origin)))


def set_times(folder: Path, time_s: int) -> None:
    """One time for all files: dpkg-deb keeps those that are older than SOURCE_DATE_EPOCH."""
    for path in [folder, *folder.rglob("*")]:
        os.utime(path, (time_s, time_s), follow_symlinks=False)


def licence_name(package: Distribution) -> str:
    """SPDX expression, or what the package says in its own words."""
    metadata = package.metadata
    classifiers = [
        word.rpartition(" :: ")[2]
        for word in metadata.get_all("Classifier") or []
        if word.startswith("License ::")
    ]
    for field in ("License-Expression", "License"):
        words = str(metadata[field]) if field in metadata else ""
        if words.strip() and (field == "License-Expression" or not classifiers):
            return words.strip().splitlines()[0]
    return " and ".join(classifiers) or "see its files"


def copyright_text(site: Path) -> str:
    """debian/copyright in Debian's machine-readable form: our own licence, then each Python package's."""
    text = COPYRIGHT + BRINGS + OWN
    used = {}
    for package in sorted(distributions(path=[str(site)]), key=lambda one: one.name.lower()):
        if package.name == "hodograph":
            continue
        name = licence_name(package)
        label = name.replace(" ", "-")
        used[label] = name
        tops = {file.parts[0] for file in package.files or []} - {"..", "bin"}
        names = [
            f"{HOME / SITE / top}{'/*' if (site / top).is_dir() else ''}" for top in sorted(tops)
        ]
        text += "Files: " + "\n ".join(names) + "\n"
        text += f"Copyright: the authors of {package.name} {package.version}\nLicense: {label}\n\n"
    text += own_licence()
    for label, name in sorted(used.items()):
        if label != "MIT":
            text += f"\nLicense: {label}\n {name}: see the files of the package.\n"
            files = {file for word, file in COMMON_LICENSES.items() if word in name}
            text += "".join(f" See also /usr/share/common-licenses/{file}.\n" for file in files)
    return text


def own_licence() -> str:
    """The text of ours, in Debian's form."""
    licence = (ROOT / "LICENSE").read_text(encoding="utf-8").strip()
    body = "\n".join(f" {line}" if line else " ." for line in licence.splitlines())
    return f"License: MIT\n{body}\n"


def make_sources(source: Path, stage: Path, time_s: int) -> None:
    """The folder debian/."""
    abi = Abi.read().number
    debian = source / "debian"
    shutil.copytree(PARTS, debian)
    major, minor = sys.version_info[:2]
    bounds = f"python3 (>= {major}.{minor}~), python3 (<< {major}.{minor + 1})"
    control = (debian / "control").read_text(encoding="utf-8")
    control = filled(control, {"ABI": str(abi), "PYTHON": bounds})
    (debian / "control").write_text(control, encoding="utf-8")
    (debian / "libhodograph.install").rename(debian / f"libhodograph{abi}.install")
    date = email.utils.formatdate(time_s)
    (debian / "changelog").write_text(
        f"hodograph ({version()}) unstable; urgency=medium\n\n  * See CHANGELOG.md.\n\n"
        f" -- The Hodograph authors <maintainers@hodograph.example>  {date}\n",
        encoding="utf-8",
    )
    site = stage / HOME / SITE
    (debian / "hodograph.copyright").write_text(copyright_text(site), encoding="utf-8")
    (debian / "copyright").write_text(COPYRIGHT + OWN + own_licence(), encoding="utf-8")


def make_packages(build: Path, out: Path) -> list[Path]:
    """All packages, in `out`; raises PackageError."""
    check_python()
    time_s = epoch_s()
    os.environ["SOURCE_DATE_EPOCH"] = str(time_s)
    with tempfile.TemporaryDirectory(prefix="hodograph-deb-") as folder:
        work = Path(folder)
        source = work / f"hodograph-{version()}"
        stage = source / "stage"
        libraries = f"/usr/lib/{output('dpkg-architecture', '-qDEB_HOST_MULTIARCH')}"
        script = Path(__file__).with_name("install.py")
        words = ("--build", build, "--prefix", "/usr", "--libdir", libraries, "--destdir", stage)
        run(sys.executable, script, "install", *words)
        stage_python(build, stage, work)
        set_times(stage, time_s)
        make_sources(source, stage, time_s)
        run("dpkg-buildpackage", "-b", "-us", "-uc", cwd=source)
        out.mkdir(parents=True, exist_ok=True)
        return [
            Path(shutil.copy(package, out / package.name)) for package in sorted(work.glob("*.deb"))
        ]


def main() -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--build", type=Path, required=True)
    parser.add_argument("out", type=Path)
    options = parser.parse_args()
    try:
        packages = make_packages(options.build.resolve(), options.out.resolve())
    except PackageError as error:
        print(f"debian.py: {error}", file=sys.stderr)
        return 1
    for package in packages:
        print(f"{package}  {package.stat().st_size / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
