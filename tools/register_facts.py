# SPDX-License-Identifier: MIT
"""register_facts: data of the STM32G474RE from crate stm32-metapac, fetched once by cargo and pinned by its hash. Used
by tools/check_registers. Starts cargo; keeps the crate in the folder that it is given.

The crate is data that its authors extracted from the manufacturer's files and reviewed register by register; nothing of
it is compiled or built in. Its tables of constants are read as text (rust_literal).
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import tarfile
from functools import cached_property
from pathlib import Path
from typing import Any

from rust_literal import read_static

CRATE, VERSION = "stm32-metapac", "21.0.0"
NAME = f"{CRATE}-{VERSION}"
SHA256 = "e74b78632cea498cfb28386a29f8bfae7476d6570a78733eb5fecbee66c2f4ce"
CHIP = "stm32g474re"
_TIMEOUT_S = 300  # an old cargo reads the index of all crates first
_MANIFEST = f"""\
[package]
name = "facts"
version = "0.0.0"
[dependencies]
{CRATE} = "={VERSION}"
"""


class FactsError(Exception):
    """There are no facts to compare with: the text says why and what to do."""


def fetch(cache: Path) -> Path:
    """The crate in the folder `cache`, downloaded when it is not there; its hash is checked every time."""
    path = cache / f"{NAME}.crate"
    if not path.exists():
        try:
            part = path.with_suffix(".part")
            shutil.copyfile(_downloaded(cache / "cargo"), part)
            part.replace(path)
        except (OSError, subprocess.SubprocessError) as error:
            raise FactsError(
                f"cargo cannot fetch {NAME}: {error}; with cargo and a network once, or put {path.name} into {cache}"
            ) from error
    found = hashlib.sha256(path.read_bytes()).hexdigest()
    if found != SHA256:
        raise FactsError(f"{path} has SHA-256 {found} instead of {SHA256}: remove it")
    return path


def _downloaded(project: Path) -> Path:
    """The crate in the cache of cargo, which gets it for a package that depends on it."""
    (project / "src").mkdir(parents=True, exist_ok=True)
    (project / "Cargo.toml").write_text(_MANIFEST, encoding="utf-8")
    (project / "src" / "lib.rs").touch()
    done = subprocess.run(
        ["cargo", "fetch", "--quiet"],
        cwd=project,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=_TIMEOUT_S,
        check=False,
    )
    if done.returncode != 0:
        raise OSError(" ".join(done.stderr.split()))
    home = Path(os.environ.get("CARGO_HOME") or Path.home() / ".cargo")
    found = sorted(home.glob(f"registry/cache/*/{NAME}.crate"))
    if not found:
        raise OSError(f"no such file in {home}/registry/cache")
    return found[0]


class Facts:
    """Registers, pins, interrupts and memories of the chip."""

    def __init__(self, crate: Path) -> None:
        self._crate = crate
        self._blocks: dict[str, dict[str, Any]] = {}

    @cached_property
    def _texts(self) -> dict[str, str]:
        wanted = re.compile(rf"{NAME}/src/(chips/({CHIP}/metadata|metadata_\d+)|registers/\w+)\.rs")
        with tarfile.open(self._crate) as archive:
            return {
                member.name.removeprefix(f"{NAME}/src/"): file.read().decode()
                for member in archive
                if wanted.fullmatch(member.name) and (file := archive.extractfile(member))
            }

    @cached_property
    def _chip(self) -> str:
        return self._texts[f"chips/{CHIP}/metadata.rs"]

    @cached_property
    def _tables(self) -> str:
        (name,) = re.findall(r'include!\("\.\./(metadata_\d+\.rs)"\)', self._chip)
        return self._texts[f"chips/{name}"]

    @cached_property
    def peripherals(self) -> dict[str, dict[str, Any]]:
        """By name."""
        return {p["name"]: p for p in read_static(self._tables, "PERIPHERALS")}

    @cached_property
    def interrupts(self) -> dict[str, int]:
        """Numbers by name."""
        return {i["name"]: i["number"] for i in read_static(self._tables, "INTERRUPTS")}

    @cached_property
    def memory(self) -> dict[str, dict[str, Any]]:
        """Regions by name, in dual-bank mode."""
        return {r["name"]: r for r in read_static(self._chip, "METADATA")["memory"][1]}

    def pin_function(self, pin: str, peripheral: str, signal: str) -> int | None:
        """Number of the alternate function; None when the pin cannot have it."""
        for entry in self.peripherals[peripheral]["pins"]:
            if (entry["pin"], entry["signal"]) == (pin, signal):
                number: int | None = entry["af"]
                return number
        return None

    def registers(self, peripheral: str) -> dict[str, Any]:
        """The register tables of a peripheral's kind, with the block of this peripheral under "block"."""
        if peripheral not in self._blocks:
            kind = self.peripherals[peripheral]["registers"]
            tables = read_static(
                self._texts[f"registers/{kind['kind']}_{kind['version']}.rs"], "REGISTERS"
            )
            plain = kind["block"].replace("_", "").lower()
            (block,) = (b for b in tables["blocks"] if b["name"].replace("_", "").lower() == plain)
            self._blocks[peripheral] = {**tables, "block": block}
        return self._blocks[peripheral]
