# SPDX-License-Identifier: MIT
"""One page: a self-contained HTML file, and its figures as PNG files next to it. Used by report/ and campaign/report.
Reads a template of its package, makes the folder of the page, and writes the files.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2

from ..errors import InputError


@dataclass(frozen=True)
class Figure:
    """A picture of a page; `name` is that of its file."""

    name: str
    caption: str
    png: bytes

    @property
    def base64(self) -> str:
        """The picture as a data URL has it."""
        return base64.b64encode(self.png).decode()


def file_name(text: str, otherwise: str) -> str:
    """A name for files and anchors made from any text; `otherwise` when nothing of it can stay."""
    return re.sub(r"[^A-Za-z0-9_-]+", "-", text).strip("-") or otherwise


def render(template: str, **values: Any) -> str:
    """The HTML of a template of this folder; each name in the template has to be in `values`."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("hodograph.report", "."),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
    )
    return environment.get_template(template).render(**values)


def write_page(page: Path, text: str, figures: Iterable[tuple[str, Figure]]) -> Path:
    """Writes the figures, each under the name that goes with it, then the page; makes the folder. Raises InputError."""
    folder = page.parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, figure in figures:
            (folder / f"{name}.png").write_bytes(figure.png)
        page.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"{folder}: cannot write the report: {error.strerror}") from None
    return page
