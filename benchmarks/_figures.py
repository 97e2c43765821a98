# SPDX-License-Identifier: MIT
"""The option `--json OUT` of benchmarks and the file that it names; tools/run_benchmarks.py gathers these files. Used
by all scripts of `make bench` and by `make compare`. Writes that file.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any


def figures_parser(doc: str, *, required: bool = False) -> argparse.ArgumentParser:
    """A parser with `--json OUT`, described by the first line of a module's docstring.

    required  whether the option has to be given
    """
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument("--json", type=Path, required=required, help="file for the figures")
    return parser


def write_figures(file: Path | None, figures: Any) -> None:
    """Writes figures to a file as JSON; None: nowhere."""
    if file is not None:
        file.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
