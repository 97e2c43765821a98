# SPDX-License-Identifier: MIT
"""`make deb` and `make container`: in a clean root of Debian, without other files of this project. Run by pytest;
starts `make`, which writes build/, lintian, mmdebstrap, buildah and `hodograph`, and writes to temporary folders. Makes
container images, and removes them.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from subprocesses import run

ROOT = Path(__file__).resolve().parents[2]
ALPHA = ROOT / "examples/alpha.toml"
HANGS_S = 1700.0
pytestmark = pytest.mark.long

# As a user without rights, in an empty folder of its own.
IN_THE_ROOT = """\
set -eu
useradd --create-home user
su user -c 'cd && hodograph demo --no-browser --json > demo.json && ls hodograph-demo/report.html'
su user -c 'cd && hodograph simulate /tmp/examples/alpha.toml --json > simulate.json'
su user -c 'cd && cp -r /usr/share/hodograph/examples/embed . && cd embed && make'
su user -c 'cd && embed/setpoints /tmp/alpha.hdgp > setpoints.txt'
su user -c 'cd && cmake -S embed -B cmake && cmake --build cmake && cmake/setpoints /tmp/alpha.hdgp > cmake.txt'
zcat /usr/share/man/man1/hodograph.1.gz | grep -q 'hodograph scan'
zcat /usr/share/man/man1/hodograph-hub.1.gz | grep -q bitrate
grep -q -- --assign /usr/share/bash-completion/completions/hodograph
ls /usr/share/zsh/vendor-completions/_hodograph /usr/share/fish/vendor_completions.d/hodograph.fish
ldd /home/user/embed/setpoints | grep libhodograph > /home/user/linked.txt
mkdir /tmp/results
cp /home/user/*.json /home/user/*.txt /tmp/results
apt-get purge --yes --quiet hodograph libhodograph-dev
! ls -d /usr/lib/hodograph /usr/include/hodograph* /usr/share/hodograph 2>/dev/null
"""


def output(*command: object, cwd: Path = ROOT) -> str:
    return run(*command, cwd=cwd, limit_s=HANGS_S).stdout


def codename() -> str:
    """The packages are for the Debian that they were made on."""
    lines = Path("/etc/os-release").read_text(encoding="utf-8").splitlines()
    (name,) = [line.partition("=")[2] for line in lines if line.startswith("VERSION_CODENAME=")]
    return name


def make(*words: object) -> None:
    hidden = ("MAKEFLAGS", "MFLAGS", "MAKELEVEL")
    environment = {name: text for name, text in os.environ.items() if name not in hidden}
    environment["STORAGE_DRIVER"] = "vfs"  # containers: works on every file system
    subprocess.run(
        ["make", "--no-print-directory", *map(str, words)],
        cwd=ROOT,
        env=environment,
        check=True,
        timeout=HANGS_S,
        stdin=subprocess.DEVNULL,
    )


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("packages")
    make("deb", f"DIST={folder}")
    assert len(list(folder.glob("*.deb"))) == 3
    return folder


@pytest.mark.timeout(3600)
def test_the_same_bytes_again(packages: Path, tmp_path: Path) -> None:
    make("deb", f"DIST={tmp_path}")
    names = sorted(file.name for file in packages.glob("*.deb"))
    assert names == sorted(file.name for file in tmp_path.glob("*.deb"))
    for name in names:
        assert (tmp_path / name).read_bytes() == (packages / name).read_bytes(), name


@pytest.mark.timeout(3600)
def test_lintian_has_nothing_to_say(packages: Path) -> None:
    """What it finds in files of others has an override with its reason."""
    output(sys.executable, ROOT / "tools/packages.py", "clean-root")
    words = ("--allow-root", "--tag-display-limit", "0")
    assert output("lintian", *words, *sorted(packages.glob("*.deb"))).splitlines() == []


@pytest.mark.timeout(3600)
def test_in_a_clean_root(packages: Path, tmp_path: Path) -> None:
    """Installed by apt, without compiler for the host tools, used without rights, and away again without a trace."""
    output(sys.executable, ROOT / "tools/packages.py", "clean-root")
    image, trace = tmp_path / "alpha.hdgp", tmp_path / "alpha.csv"
    output(sys.executable, "-m", "hodograph", "compile", ALPHA, "-o", image)
    output(sys.executable, "-m", "hodograph", "simulate", ALPHA, "--trace", trace)
    simulated = json.loads(output(sys.executable, "-m", "hodograph", "simulate", ALPHA, "--json"))
    script = tmp_path / "script.sh"
    script.write_text(IN_THE_ROOT, encoding="utf-8")
    script.chmod(0o755)
    hooks = [f"copy-in {file} /tmp" for file in (*packages.glob("*.deb"), image, script)]
    hooks.append(f"copy-in {ROOT / 'examples'} /tmp")
    hooks.append("chroot $1 apt-get update")
    hooks.append(
        "chroot $1 sh -c 'apt-get install --yes --no-install-recommends /tmp/hodograph_*.deb'"
    )
    hooks.append("chroot $1 sh -c '! command -v gcc && ! test -e /usr/include/hodograph.h'")
    tools = "gcc libc6-dev make cmake pkg-config"
    hooks.append(
        f"chroot $1 sh -c 'apt-get install --yes --no-install-recommends {tools} /tmp/lib*.deb'"
    )
    hooks += ["chroot $1 /tmp/script.sh", f"copy-out /tmp/results {tmp_path}"]
    options = [f"--customize-hook={hook}" for hook in hooks]
    output("mmdebstrap", "--variant=apt", *options, codename(), "/dev/null", cwd=tmp_path)

    results = tmp_path / "results"
    assert json.loads((results / "demo.json").read_text())["ticks"] > 1000
    there = json.loads((results / "simulate.json").read_text())
    assert there["setpoints_sha256"] == simulated["setpoints_sha256"]
    rows = [line.split(",") for line in trace.read_text(encoding="utf-8").splitlines()]
    x, y = rows[0].index("x_set_counts"), rows[0].index("y_set_counts")
    expected = [f"{row[x]} {row[y]}" for row in rows[1:]]
    assert (results / "setpoints.txt").read_text().splitlines() == expected
    assert (results / "cmake.txt").read_text().splitlines() == expected
    linked = (results / "linked.txt").read_text()
    assert re.search(r"libhodograph\.so\.\d+ => (/usr)?/lib/", linked)


@pytest.mark.timeout(3600)
def test_container(packages: Path, tmp_path: Path) -> None:
    """Built on a base of its own, without a registry and in a store of its own; it runs the demo, not as root."""
    buildah = [
        "buildah",
        "--storage-driver",
        "vfs",
        "--root",
        tmp_path / "a",
        "--runroot",
        tmp_path / "b",
    ]
    word = f"BUILDAH={' '.join(map(str, buildah))}"
    make("container-base", word)
    make("container", "-o", "deb", "BASE=localhost/hodograph-base", f"DIST={packages}", word)
    container = output(*buildah, "from", "localhost/hodograph").strip()
    try:
        inside = [*buildah, "run", "--isolation", "chroot", container, "--"]
        assert output(*inside, "id", "-u").strip() == "1000"
        demo = json.loads(output(*inside, "hodograph", "demo", "--no-browser", "--json"))
        simulated = json.loads(
            output(sys.executable, "-m", "hodograph", "simulate", ALPHA, "--json")
        )
        assert demo["setpoints_sha256"] == simulated["setpoints_sha256"]
    finally:
        output(*buildah, "rm", "--all")
        output(*buildah, "rmi", "--all", "--force")
