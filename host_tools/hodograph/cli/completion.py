# SPDX-License-Identifier: MIT
"""hodograph completion: the script with which a shell completes commands, options and files. Started by cli/main;
tools/make_share installs the same script. Prints to stdout.
"""

from __future__ import annotations

import argparse
from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path

from .parser import make_parser


def completion_text(shell: str) -> str:
    """The completion of the whole command line, for one of names.SHELLS."""
    import shtab

    parser = make_parser()
    for one in _parsers(parser):
        for action in one._actions:
            if action.type is Path:
                is_folder = action.metavar == "DIR"
                action.complete = shtab.DIRECTORY if is_folder else shtab.FILE  # type: ignore[attr-defined]
    return shtab.complete(parser, shell)


def _parsers(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    yield parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for inner in action.choices.values():
                yield from _parsers(inner)


def completion(options: Namespace) -> None:
    """hodograph completion."""
    print(completion_text(options.shell), end="")


COMMANDS = {"completion": completion}
