#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""make_share.py DIR: man page and shell completion of `hodograph`, from its help, as they lie below PREFIX/share.

Run by `make share`. Writes to DIR only.

The same bytes from the same tree.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator
from pathlib import Path

from argparse_manpage.manpage import Manpage

from hodograph import __version__
from hodograph.cli.completion import completion_text
from hodograph.cli.parser import DESCRIPTION, EPILOG, make_parser

COMPLETIONS = {
    "bash": "bash-completion/completions/hodograph",
    "zsh": "zsh/site-functions/_hodograph",
    "fish": "fish/vendor_completions.d/hodograph.fish",
}
MAN = "man/man1/hodograph.1"
_MACROS = re.compile(r"\.([A-Z]{1,2}|nf|fi)( |$)")
ENVIRONMENT = {
    "HODOGRAPH_BUS": "bus of commands without --bus, as INTERFACE:CHANNEL",
    "HODOGRAPH_CONTROLLER": "command that starts a controller, as --controller",
    "HODOGRAPH_DEBUG": "1: show tracebacks, as --debug",
}


def man_page() -> str:
    """The page, in man(7) macros."""
    parser = make_parser()
    parser.epilog = None
    page = Manpage(
        parser,
        format="single-commands-section",
        _data={
            "project_name": "hodograph",
            "version": __version__,
            "description": DESCRIPTION.rstrip("."),
            "manual_title": "Hodograph",
            "authors": ["The Hodograph authors"],
        },
    )
    page.date = ""
    statuses = EPILOG.removeprefix("exit status: ").partition(" (docs")[0]
    page.add_section("exit status", "=", _escaped(statuses + "."))
    page.add_section("environment", "=", "\n".join(_environment()))
    return "\n".join(map(_protected, str(page).splitlines())) + "\n"


def _environment() -> Iterator[str]:
    for name, text in ENVIRONMENT.items():
        yield f".TP\n.B {name}\n{_escaped(text)}"


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace("-", "\\-")


def _protected(line: str) -> str:
    """Text that begins with a dot or a quote is no macro."""
    return f"\\&{line}" if line[:1] in (".", "'") and not _MACROS.match(line) else line


def main() -> None:
    """Writes all files."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("folder", metavar="DIR", type=Path)
    folder = options.parse_args().folder
    texts = {name: completion_text(shell) for shell, name in COMPLETIONS.items()}
    for name, text in {MAN: man_page(), **texts}.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
