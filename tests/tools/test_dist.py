# SPDX-License-Identifier: MIT
"""The source distribution and the wheel: complete, the same bytes twice, and enough to run a program. Run by pytest;
starts `pip` and Python, and writes to temporary folders.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from dist.make_release import build_environment, make_release
from dist.programs import PROGRAMS, programs_for

ROOT = Path(__file__).resolve().parents[2]
HANGS_S = 600.0


def unpacked(wheel: Path, folder: Path) -> dict[str, str]:
    """Installs a wheel into an empty folder; the environment of a user who has nothing else."""
    target = folder / "site"
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    subprocess.run([*pip, "--target", str(target), str(wheel)], check=True, timeout=HANGS_S)
    return {"PATH": str(folder), "HOME": str(folder), "PYTHONPATH": str(target)}


def python(environment: dict[str, str], folder: Path, *words: str) -> str:
    done = subprocess.run(
        [sys.executable, *words],
        env=environment,
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=HANGS_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(autouse=True)
def bytecode(monkeypatch: pytest.MonkeyPatch) -> None:
    """Python writes bytecode beside the sources that a build imports, as on the computer of a user."""
    monkeypatch.delenv("PYTHONDONTWRITEBYTECODE", raising=False)


def test_the_wheel_alone_runs_the_demo(tmp_path: Path) -> None:
    """Built once for all that is to be seen in it: a build takes long."""
    source, wheel = make_release(tmp_path / "dist", None)
    check_source(source)
    check_wheel(wheel)
    environment = unpacked(wheel, tmp_path)
    check_share(Path(environment["PYTHONPATH"]))
    check_module(Path(environment["PYTHONPATH"]))
    where = "import hodograph.bus.processes as p; print(p.find_program('hodograph-hub'))"
    found = python(environment, tmp_path, "-c", where)
    assert found.startswith(environment["PYTHONPATH"])
    demo = python(environment, tmp_path, "-m", "hodograph", "demo", "--no-browser", "--json")
    assert json.loads(demo)["ticks"] > 1000
    assert (tmp_path / "hodograph-demo/report.html").exists()


def test_the_linker_of_another_platform_stays() -> None:
    """`make wheels` names one for each platform; without, none that searches folders of this computer."""
    given = {"LDSHARED": "zig cc -target aarch64-linux-gnu -shared", "HODOGRAPH_BUILT_BY_MAKE": "1"}
    built = build_environment(7, given)
    assert built["LDSHARED"] == given["LDSHARED"]
    assert built["HODOGRAPH_BUILT_BY_MAKE"] == ""
    assert "-L" not in build_environment(7, {})["LDSHARED"]


def test_other_systems_get_no_programs() -> None:
    """They need Linux; the native module does not."""
    assert programs_for("linux") == PROGRAMS
    assert [programs_for(platform) for platform in ("darwin", "win32")] == [{}, {}]


def check_wheel(wheel: Path) -> None:
    """All programs may be executed, and no path of this computer is in it."""
    with zipfile.ZipFile(wheel) as archive:
        for name in PROGRAMS:
            mode = archive.getinfo(f"hodograph/bin/{name}").external_attr >> 16
            assert mode & 0o111 == 0o111, name
        for name in archive.namelist():
            data = archive.read(name)
            assert str(ROOT).encode() not in data, name
            assert b"hodograph-dist-" not in data, name


def check_share(site: Path) -> None:
    """Man page and completion of all shells, as `make share` writes them."""
    for name in (
        "man/man1/hodograph.1",
        "bash-completion/completions/hodograph",
        "zsh/site-functions/_hodograph",
        "fish/vendor_completions.d/hodograph.fish",
    ):
        assert (site / "share" / name).stat().st_size > 5000, name


def check_module(site: Path) -> None:
    """The native module searches no folder of the computer that linked it."""
    (module,) = site.glob("hodograph/native/*.so")
    found = subprocess.run(["readelf", "-d", module], check=True, capture_output=True, text=True)
    assert "(NEEDED)" in found.stdout
    assert "PATH)" not in found.stdout


def check_source(source: Path) -> None:
    """It has all that the package is built from, and names neither a user nor a time of this computer."""
    with tarfile.open(source) as archive:
        members = archive.getmembers()
    assert {(m.uid, m.gid, m.uname, m.gname) for m in members} == {(0, 0, "", "")}
    assert len({m.mtime for m in members}) == 1
    names = {m.name.partition("/")[2] for m in members}
    assert {"firmware/core/program.c", "sim/hub/main.c", "LICENSE", "CHANGELOG.md"} <= names
    assert not [name for name in names if name.endswith(".pyc")]


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """What setup.py needs, in a folder into which it may write."""
    folder = tmp_path / "tree"
    folder.mkdir()
    for name in (
        "pyproject.toml",
        "README.md",
        "LICENSE",
        "host_tools",
        "tools",
        "firmware",
        "sim",
    ):
        (folder / name).symlink_to(ROOT / name)
    (folder / "setup.py").write_bytes((ROOT / "setup.py").read_bytes())
    return folder


def refused(tree: Path, code: str, **variables: str) -> str:
    """The lines that a build prints; `code` goes before setup.py."""
    program = f"import runpy; {code}; runpy.run_path('setup.py', run_name='__main__')"
    done = subprocess.run(
        [sys.executable, "-c", program, "build"],
        cwd=tree,
        env=os.environ | {"HODOGRAPH_BUILT_BY_MAKE": ""} | variables,
        capture_output=True,
        text=True,
        timeout=HANGS_S,
        check=False,
    )
    assert done.returncode == 1
    assert not (tree / "build/lib").exists()
    lines = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
    assert "copying" not in done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    (line,) = lines
    return line


def test_without_a_compiler_one_line_says_so(tree: Path) -> None:
    line = refused(tree, "pass", CC="no-such-compiler -O2")
    assert line.startswith("error: no C compiler: no-such-compiler was not found; install one (")
    assert line.endswith("or set CC, or install the wheel of hodograph, which is compiled")


def test_without_the_header_of_python_one_line_says_so(tree: Path) -> None:
    """As on Debian without python3-dev."""
    elsewhere = "import sysconfig; sysconfig.get_path = lambda *_, **__: '/no/include'"
    line = refused(tree, elsewhere)
    assert line.startswith("error: no C header of Python: /no/include/Python.h was not found; ")


@pytest.mark.long
def test_the_same_bytes_twice(tmp_path: Path) -> None:
    first, second = (make_release(tmp_path / name, None) for name in ("a", "b"))
    assert [file.read_bytes() for file in first] == [file.read_bytes() for file in second]


@pytest.mark.long
def test_a_compiler_that_fails_leaves_no_wheel(tmp_path: Path) -> None:
    environment = os.environ | {"CC": "false"}
    script = str(ROOT / "tools/dist/make_release.py")
    made = subprocess.run(
        [sys.executable, script, str(tmp_path)],
        env=environment,
        capture_output=True,
        text=True,
        timeout=HANGS_S,
        check=False,
    )
    assert made.returncode != 0
    assert not list(tmp_path.glob("*.whl"))
