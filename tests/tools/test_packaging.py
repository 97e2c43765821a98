# SPDX-License-Identifier: MIT
"""What packages are made of: locked requirements of the host tools, list of components, manifests of the modules. Run
by pytest; starts `make`, which writes build/, and Python; writes to temporary folders.
"""

from __future__ import annotations

import json
import os
import subprocess
from importlib.metadata import requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from dist.debian import forget_origin
from dist.library import make_library, version
from dist.requirements import lock_text, package_dependencies, read_lock, runtime_requirements

ROOT = Path(__file__).resolve().parents[2]
TOOLS = ROOT / "build/stamps/packaging/bin"
HANGS_S = 800.0


def names() -> set[str]:
    return {canonicalize_name(entry.name) for entry in runtime_requirements()}


def test_all_that_the_package_needs_and_nothing_of_the_tests() -> None:
    wanted = names()
    assert package_dependencies() <= wanted
    assert not wanted & {"pytest", "ruff", "mypy", "casadi", "distributed", "setuptools", "pip"}


def test_nothing_is_missing() -> None:
    """By what the installed packages themselves say that they need."""
    wanted = names()
    for name in wanted:
        for text in requires(name) or []:
            needed = Requirement(text)
            if needed.marker is None or needed.marker.evaluate({"extra": ""}):
                assert canonicalize_name(needed.name) in wanted, f"{name} needs {text}"


def test_every_entry_has_hashes() -> None:
    entries = runtime_requirements()
    again = read_lock(lock_text(entries))
    assert [(one.name, one.version) for one in again] == [(e.name, e.version) for e in entries]
    assert all(any("--hash=sha256:" in line for line in entry.lines) for entry in entries)


def test_a_lock_of_another_form_is_refused() -> None:
    with pytest.raises(ValueError, match="NAME==VERSION"):
        read_lock("numpy>=2\n    # via scipy\n")


def make(*words: str) -> None:
    hidden = ("MAKEFLAGS", "MFLAGS", "MAKELEVEL")
    environment = {name: text for name, text in os.environ.items() if name not in hidden}
    command = ["make", "--no-print-directory", *words]
    subprocess.run(command, cwd=ROOT, env=environment, check=True, timeout=HANGS_S)


VALID = """
import sys
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
error = JsonStrictValidator(SchemaVersion.V1_6).validate_str(open(sys.argv[1]).read())
sys.exit(str(error) if error else 0)
"""


@pytest.mark.long
def test_list_of_components(tmp_path: Path) -> None:
    """Valid by the schema, the same twice, and it has each package with version and licence, and our programs."""
    for folder in ("a", "b"):
        make("sbom", f"DIST={tmp_path / folder}")
    first, second = (tmp_path / name / f"hodograph-{version()}.cdx.json" for name in ("a", "b"))
    assert first.read_bytes() == second.read_bytes()
    subprocess.run([TOOLS / "python", "-c", VALID, first], check=True)
    document = json.loads(first.read_text(encoding="utf-8"))
    found = {canonicalize_name(one["name"]): one for one in document["components"]}
    for entry in runtime_requirements():
        assert found[canonicalize_name(entry.name)]["version"] == entry.version
    assert all(one.get("licenses") for one in found.values())
    assert {"libhodograph", "hodograph-controller", "hodograph-drive", "hodograph-hub"} <= set(
        found
    )
    assert str(ROOT) not in first.read_text(encoding="utf-8")


def test_the_place_of_the_wheel_is_forgotten(tmp_path: Path) -> None:
    """pip writes it into two files; with it, no two Debian packages would be the same."""
    information = tmp_path / "hodograph-1.dist-info"
    information.mkdir()
    (information / "direct_url.json").write_text('{"url": "file:///tmp/x"}')
    first, last = b"hodograph/__init__.py,sha256=a,1\r\n", b"hodograph-1.dist-info/RECORD,,\r\n"
    reported = b"hodograph-1.dist-info/direct_url.json,sha256=b,24\r\n"
    (information / "RECORD").write_bytes(first + reported + last)
    forget_origin(information)
    assert (information / "RECORD").read_bytes() == first + last
    assert [file.name for file in information.iterdir()] == ["RECORD"]


PLATFORMIO = """
import sys
from platformio.package.manifest.parser import ManifestParserFactory
from platformio.package.manifest.schema import ManifestSchema
# The list of licences is on the network.
ManifestSchema.load_spdx_licenses = staticmethod(lambda: {"licenses": [{"licenseId": "MIT"}]})
for name in ("library.json", "library.properties"):
    parsed = ManifestParserFactory.new_from_file(f"{sys.argv[1]}/{name}").as_dict()
    print(ManifestSchema().load_manifest(parsed)["version"])
"""
KCONFIG = """
import sys
import kconfiglib
tree = kconfiglib.Kconfig(sys.argv[1], warn_to_stderr=False)
tree.syms["CPU_HAS_FPU"].set_value("y")
tree.syms["HODOGRAPH"].set_value("y")
print(*(tree.syms["HODOGRAPH_KERNEL_" + name].str_value for name in ("FLOAT", "DOUBLE")))
print(*tree.warnings)
"""


@pytest.mark.long
def test_manifests_by_the_tools_of_their_formats(tmp_path: Path) -> None:
    """PlatformIO reads both manifests and finds them valid; Kconfig is read as Zephyr does."""
    make(str((TOOLS.parent / ".ready").relative_to(ROOT)))
    make_library(tmp_path)
    reported = subprocess.run(
        [TOOLS / "python", "-c", PLATFORMIO, tmp_path],
        check=True,
        capture_output=True,
        text=True,
        env=os.environ | {"PLATFORMIO_CORE_DIR": str(tmp_path / "platformio")},
    )
    assert reported.stdout.split() == [version()] * 2
    (tmp_path / "Kconfig").write_text(
        f'config CPU_HAS_FPU\n\tbool "stands in"\n\nsource "{tmp_path}/zephyr/Kconfig"\n'
    )
    words = [TOOLS / "python", "-c", KCONFIG, tmp_path / "Kconfig"]
    read = subprocess.run(words, check=True, capture_output=True, text=True)
    assert read.stdout.splitlines() == ["y n", ""]
