# SPDX-License-Identifier: MIT
"""Files that the package carries: by links controller.eds, drive.eds and examples/; what `hodograph init` writes. Used
by all modules that need an EDS or an example. Reads EDS files, and keeps them in memory.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from canopen import ObjectDictionary

CONTROLLER_EDS = Path(__file__).parent / "controller.eds"
EXAMPLES = Path(__file__).parent / "examples"
DRIVE_EDS = Path(__file__).parent / "drive.eds"
TEMPLATE = Path(__file__).parent / "template"


def object_dictionary(eds: Path, node: int) -> ObjectDictionary:
    """The objects that an EDS file describes, as those of node `node`.

    All callers in this process share the result, since reading a file takes some 0.1 s: do not change it.

    Raises what canopen's import_od raises: OSError, ValueError, KeyError, configparser.Error and others.
    """
    return _read(eds, eds.stat().st_mtime_ns, node)


@cache
def _read(eds: Path, _mtime_ns: int, node: int) -> ObjectDictionary:
    from canopen import import_od

    return import_od(str(eds), node)
