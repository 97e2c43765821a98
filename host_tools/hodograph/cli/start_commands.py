# SPDX-License-Identifier: MIT
"""hodograph init and schema: initial files, and the schemas of all input files. Started by cli/main. Reads templates,
writes files, and prints to stdout.
"""

from __future__ import annotations

import json
import shlex
from argparse import Namespace
from pathlib import Path

from ..data import TEMPLATE
from ..errors import InputError
from ..schemas import NAMES, schema
from .output import write_files

_SCHEMAS = ("path", "machine", "drive")
"""Kinds of files that `init` writes."""


def init(options: Namespace) -> None:
    """hodograph init."""
    folder: Path = options.folder
    texts = {file.name: file.read_text(encoding="utf-8") for file in TEMPLATE.glob("*.toml")}
    texts |= {f"schemas/{name}.schema.json": _text(name) for name in _SCHEMAS}
    files = {folder / name: text for name, text in sorted(texts.items())}
    there = [str(file) for file in files if file.exists() or file.is_symlink()]
    if there:
        raise InputError(
            f"{', '.join(there)}: there already, and nothing was written: name another folder"
        )
    _make(folder / "schemas")
    write_files(files, force=True)
    for file in files:
        print(file)
    print(f"next: hodograph simulate {shlex.quote(str(folder / 'path.toml'))}")


def schema_(options: Namespace) -> None:
    """hodograph schema."""
    if options.output is None:
        if options.name is None:
            raise InputError(f"schema: name one of {', '.join(NAMES)}, or a folder with --output")
        print(_text(options.name), end="")
        return
    names = NAMES if options.name is None else (options.name,)
    texts = {options.output / f"{name}.schema.json": _text(name) for name in names}
    _make(options.output)
    write_files(texts, force=True)
    for file in texts:
        print(file)


def _text(name: str) -> str:
    return json.dumps(schema(name), indent=2, ensure_ascii=False) + "\n"


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror}") from None


COMMANDS = {"init": init, "schema": schema_}
