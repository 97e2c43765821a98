#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""library.py: the core as a library of its own: the folder that all its packages are built from.

    library.py OUT

Run by `make library`. Used by dist/. Writes to OUT only.

In this tree the core is one part of many: its headers are included as "core/NAME.h", and its names meet no other code.
A library lies beside other code. So here it has one header `hodograph.h`, the rest in a folder `hodograph`, and the
prefix `hodograph_` before every name that the linker sees. `hodograph/names.h` adds the prefix, so the sources keep
their names.

OUT is a Zephyr module, a PlatformIO library and an Arduino library; `make install` compiles it too. This script uses
the standard library only.
"""

from __future__ import annotations

import argparse
import re
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PARTS = ROOT / "packaging/library"
PREFIX = "hodograph_"
_INCLUDE = re.compile(r'#include "core/(\w+\.h)"')
_GUARD = re.compile(r"^#define HODOGRAPH_CORE_\w+_H\n", re.MULTILINE)
_NOT_DECLARED = re.compile(r"\s*(static|typedef|enum\b[^()]*$|struct \w+\s*$)")

NAMES_HEAD = """\
/* SPDX-License-Identifier: MIT */
/* The version of this library, and the prefix that its names have for the linker. */
#ifndef HODOGRAPH_NAMES_H
#define HODOGRAPH_NAMES_H

#define HODOGRAPH_VERSION       "{version}"
#define HODOGRAPH_VERSION_MAJOR {major}
#define HODOGRAPH_VERSION_MINOR {minor}
#define HODOGRAPH_VERSION_PATCH {patch}
#define HODOGRAPH_ABI           {abi} /* number in the SONAME of the shared library */

"""

# Behind the declarations of a header: what a shared library exports when all else is hidden (-fvisibility=hidden).
EXPORTS = """\
#ifdef HODOGRAPH_BUILD_SHARED
{lines}#endif

"""


def version() -> str:
    """Version of the release, from the one place that says it."""
    text = (ROOT / "host_tools/hodograph/__init__.py").read_text(encoding="utf-8")
    (found,) = re.findall(r'^__version__ = "([^"]+)"$', text, re.MULTILINE)
    return str(found)


@dataclass(frozen=True)
class Abi:
    """What packaging/library/abi.txt says."""

    number: int
    functions: list[str]
    sizes: dict[str, int]
    """Bytes of each public struct."""

    @staticmethod
    def read(file: Path = PARTS / "abi.txt") -> Abi:
        """Raises ValueError at a line of another form."""
        number, functions, sizes = None, [], {}
        for line in file.read_text(encoding="utf-8").splitlines():
            match line.partition("#")[0].split():
                case []:
                    pass
                case ["abi", word]:
                    number = int(word)
                case ["function", name]:
                    functions.append(name)
                case ["struct", name, size]:
                    sizes[name] = int(size)
                case _:
                    raise ValueError(f"{file}: {line!r} is neither abi, nor function, nor struct")
        if number is None:
            raise ValueError(f"{file}: no line with abi")
        return Abi(number, functions, sizes)


def declared(header: str) -> list[str]:
    """Names of the functions and objects with external linkage that a header of the core declares."""
    text = re.sub(r"/\*.*?\*/", " ", header, flags=re.DOTALL)
    text = re.sub(r"^\s*#(?:.*\\\n)*.*$", "", text, flags=re.MULTILINE)
    while "{" in text:
        text = re.sub(r"\{[^{}]*\}", ";", text)
    names = []
    for statement in text.split(";"):
        found = re.search(r"(\w+)\s*\(", statement) or re.search(
            r"extern .*?(\w+)(\[|$)", statement
        )
        if found and not _NOT_DECLARED.match(statement):
            names.append(found[1])
    return names


def rewritten(text: str, exported: list[str]) -> str:
    """A file of the core as the library has it."""
    text = text.replace('#include "core/hodograph.h"', "#include <hodograph.h>")
    text = _INCLUDE.sub(r'#include "hodograph/\1"', text)
    text = _GUARD.sub(lambda guard: guard[0] + '\n#include "hodograph/names.h"\n', text, count=1)
    if exported:
        line = 'extern __typeof__({0}) {0} __attribute__((visibility("default")));\n'
        body, end, _ = text.rpartition("#endif")
        text = body + EXPORTS.format(lines="".join(map(line.format, exported))) + end + "\n"
    return text


def names_header(names: list[str], abi: int) -> str:
    """hodograph/names.h."""
    major, minor, patch = (int(word) for word in re.findall(r"\d+", version())[:3])
    head = NAMES_HEAD.format(version=version(), major=major, minor=minor, patch=patch, abi=abi)
    return head + "".join(f"#define {name} {PREFIX}{name}\n" for name in names) + "\n#endif\n"


def image_header(image: bytes) -> str:
    """The image of a program as C."""
    rows = "".join(
        "    " + " ".join(f"{byte}," for byte in image[at : at + 20]) + "\n"
        for at in range(0, len(image), 20)
    )
    return f"/* SPDX-License-Identifier: MIT */\nstatic const uint8_t program_image[] = {{\n{rows}}};\n"


def filled(text: str, words: dict[str, str]) -> str:
    """A template with @WORD@ replaced."""
    for word, value in words.items():
        text = text.replace(f"@{word}@", value)
    return text


def write(file: Path, text: str) -> None:
    """Writes what differs only, so that make compiles what differs only."""
    file.parent.mkdir(parents=True, exist_ok=True)
    if not file.exists() or file.read_text(encoding="utf-8") != text:
        file.write_text(text, encoding="utf-8")


def contents() -> dict[str, str]:
    """Path and text of every file of the library."""
    core = ROOT / "firmware/core"
    abi = Abi.read()
    files = {}
    names = []
    for file in sorted(core.glob("*.[ch]")):
        text = file.read_text(encoding="utf-8")
        name = "hodograph.h" if file.name == "hodograph.h" else f"hodograph/{file.name}"
        own = declared(text) if file.suffix == ".h" else []
        names += own
        if file.name != "kernels_all.c":
            files[f"src/{name}"] = rewritten(text, [one for one in own if one in abi.functions])
    files["src/hodograph/names.h"] = names_header(sorted(names), abi.number)
    files["src/hodograph/kernels.c"] = (PARTS / "kernels.c").read_text(encoding="utf-8")
    for file in sorted((ROOT / "examples/embed").rglob("*")):
        if file.is_file():
            inside = file.relative_to(ROOT / "examples/embed")
            files[f"examples/{inside}"] = file.read_text(encoding="utf-8")
    image = ROOT / "tests/data/programs/alpha_quintic.hdgp"
    files["examples/Setpoints/program.h"] = image_header(image.read_bytes())
    for name in ("library.json", "library.properties", "README.md"):
        text = (PARTS / name).read_text(encoding="utf-8")
        files[name] = filled(text, {"VERSION": version()})
    for file in sorted((PARTS / "zephyr").iterdir()):
        files[f"zephyr/{file.name}"] = file.read_text(encoding="utf-8")
    files["LICENSE"] = (ROOT / "LICENSE").read_text(encoding="utf-8")
    return files


def make_library(out: Path) -> None:
    """Writes the library; removes from `out` what does not belong to it."""
    files = contents()
    for name, text in files.items():
        write(out / name, text)
    for file in list(out.rglob("*")):
        if file.is_file() and file.relative_to(out).as_posix() not in files:
            file.unlink()
    for folder in [folder for folder in out.rglob("*") if folder.is_dir()]:
        if folder.exists() and not any(path.is_file() for path in folder.rglob("*")):
            shutil.rmtree(folder)


def main() -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("out", type=Path)
    make_library(parser.parse_args().out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
