#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""install.py: puts the C side into a prefix, or takes it away again: `make install` and `make uninstall`.

    install.py install|uninstall --build BUILD --prefix PREFIX [--destdir DIR] [--libdir DIR]

Run by `make install` and `make uninstall`. Writes below PREFIX, or below DIR.

Programs with their man pages, library, headers, EDS files and examples. With --destdir everything lies below that
folder, and the files still name PREFIX; so packages are made. `uninstall` removes what `install` with the same options
would write, and the folders that are empty then. Standard library only.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from dist.library import PARTS, ROOT, Abi, filled, version
from dist.program_page import program_page
from dist.programs import OBJECT_DICTIONARIES


@dataclass(frozen=True)
class Item:
    """One file of an installation: what it holds, or where a symbolic link leads."""

    target: Path
    """Without --destdir."""
    content: bytes | str
    """Of a file its bytes; of a link its text."""
    mode: int = 0o644


@dataclass(frozen=True)
class Places:
    """Where things go."""

    prefix: Path
    libdir: Path

    @property
    def data(self) -> Path:
        """Files that are the same on every machine."""
        return self.prefix / "share/hodograph"


def public_headers(tree: Path) -> list[Path]:
    """hodograph.h and what it includes at any depth, relative to the folder `src` of the library."""
    found: list[Path] = []
    waiting = [Path("hodograph.h")]
    while waiting:
        header = waiting.pop()
        if header not in found:
            found.append(header)
            text = (tree / "src" / header).read_text(encoding="utf-8")
            waiting += map(Path, re.findall(r'^#include "(hodograph/\w+\.h)"', text, re.M))
    return sorted(found)


def library_items(library: Path, places: Places) -> list[Item]:
    """Libraries, headers, and what pkg-config and CMake read."""
    abi, release = Abi.read(), version()
    shared = f"libhodograph.so.{release}"
    items = [
        Item(places.libdir / "libhodograph.a", (library / "libhodograph.a").read_bytes()),
        Item(places.libdir / shared, (library / shared).read_bytes()),
        Item(places.libdir / f"libhodograph.so.{abi.number}", shared),
        Item(places.libdir / "libhodograph.so", f"libhodograph.so.{abi.number}"),
    ]
    for header in public_headers(library / "tree"):
        content = (library / "tree/src" / header).read_bytes()
        items.append(Item(places.prefix / "include" / header, content))
    cmake = places.libdir / "cmake/hodograph"
    major, minor = release.split(".")[:2]
    words = {
        "PREFIX": str(places.prefix),
        "LIBDIR": str(places.libdir),
        "TO_PREFIX": os.path.relpath(places.prefix, cmake),
        "VERSION": release,
        "MAJOR": major,
        "MINOR": minor,
        "ABI": str(abi.number),
    }
    for template, folder in (
        ("hodograph.pc.in", places.libdir / "pkgconfig"),
        ("hodograph-config.cmake.in", cmake),
        ("hodograph-config-version.cmake.in", cmake),
    ):
        is_pc = template.endswith(".pc.in")
        named = {name: text.replace(" ", "\\ ") for name, text in words.items()} if is_pc else words
        text = filled((PARTS / template).read_text(encoding="utf-8"), named)
        items.append(Item(folder / template.removesuffix(".in"), text.encode()))
    return items


def other_items(build: Path, library: Path, places: Places) -> list[Item]:
    """Programs, man pages, EDS files, examples, licence."""
    items = []
    for program in sorted((build / "bin").glob("hodograph-*")):
        items.append(Item(places.prefix / "bin" / program.name, program.read_bytes(), 0o755))
        page = program_page(program, version())
        if page is not None:
            items.append(Item(places.prefix / f"share/man/man1/{program.name}.1", page))
    items += [
        Item(places.data / "eds" / eds.name, eds.read_bytes())
        for eds in map(ROOT.joinpath, OBJECT_DICTIONARIES.values())
    ]
    examples = library / "tree/examples"
    for file in sorted(path for path in examples.rglob("*") if path.is_file()):
        target = places.data / "examples/embed" / file.relative_to(examples)
        items.append(Item(target, file.read_bytes()))
    items += [
        Item(places.prefix / "share/doc/hodograph" / name, (ROOT / name).read_bytes())
        for name in ("LICENSE", "CHANGELOG.md")
    ]
    return items


def below(destdir: Path, target: Path) -> Path:
    """Where a file goes with --destdir."""
    return destdir / target.relative_to("/")


def install(items: list[Item], destdir: Path) -> None:
    """Writes all; a file that is there is replaced as a whole, also one that is running."""
    for item in items:
        target = below(destdir, item.target)
        target.parent.mkdir(parents=True, exist_ok=True)
        part = target.with_name(f".{target.name}.part")
        part.unlink(missing_ok=True)
        try:
            if isinstance(item.content, str):
                part.symlink_to(item.content)
            else:
                part.write_bytes(item.content)
                part.chmod(item.mode)
            part.replace(target)
        except OSError as error:
            part.unlink(missing_ok=True)
            raise OSError(error.errno, error.strerror, str(target)) from None


def uninstall(items: list[Item], destdir: Path, prefix: Path) -> int:
    """Removes all, and the folders of the prefix that are empty then. How many files there were."""
    folders, removed = set(), 0
    for item in items:
        target = below(destdir, item.target)
        removed += target.is_symlink() or target.exists()
        target.unlink(missing_ok=True)
        folders |= {folder for folder in item.target.parents if folder.is_relative_to(prefix)}
    for folder in sorted(folders, key=lambda folder: len(folder.parts), reverse=True):
        there = below(destdir, folder)
        if folder != prefix and there.is_dir() and not any(there.iterdir()):
            there.rmdir()
    return removed


def main() -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("action", choices=["install", "uninstall"])
    parser.add_argument("--build", type=Path, required=True)
    parser.add_argument("--prefix", type=Path, required=True)
    parser.add_argument("--destdir", type=Path, default=Path("/"))
    parser.add_argument("--libdir", type=Path, help="default: PREFIX/lib")
    options = parser.parse_args()
    places = Places(options.prefix, options.libdir or options.prefix / "lib")
    if not (places.prefix.is_absolute() and places.libdir.is_absolute()):
        parser.error("PREFIX and LIBDIR have to be absolute, as in /usr/local")
    library = options.build / "library"
    destdir = options.destdir.absolute()
    items = library_items(library, places) + other_items(options.build, library, places)
    try:
        if options.action == "install":
            install(items, destdir)
            count = len(items)
        else:
            count = uninstall(items, destdir, places.prefix)
    except PermissionError as error:
        print(f"{error.filename}: {error.strerror}; choose PREFIX or run as root", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"{error.filename}: {error.strerror}", file=sys.stderr)
        return 1
    print(f"{options.action}ed {count} files: {below(destdir, places.prefix)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
