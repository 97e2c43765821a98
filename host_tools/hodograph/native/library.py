# SPDX-License-Identifier: MIT
"""Finds the compiled module. Used by the other modules of this package. Loads the compiled module; no other I/O."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import HodographError


@cache
def library() -> tuple[Any, Any]:
    """(ffi, lib) of the compiled module. Raises HodographError when it is not built or does not load."""
    try:
        module = import_module("hodograph.native._native")
    except ModuleNotFoundError:
        raise HodographError(
            "hodograph.native: the compiled module is not there: run `make build` in the source tree"
        ) from None
    except ImportError as error:
        reason = " ".join(str(error).split())
        raise HodographError(
            f"hodograph.native: the compiled module does not load ({reason}): "
            "run `make clean` and `make build`"
        ) from None
    return module.ffi, module.lib


def native_file() -> Path:
    """The file of the compiled module. Raises HodographError as `library` does."""
    library()
    return Path(import_module("hodograph.native._native").__file__ or "")


def text(pointer: Any) -> str:
    """A C string as Python text."""
    ffi, _ = library()
    return str(ffi.string(pointer).decode("utf-8"))


def numbers(array: NDArray[Any]) -> Any:
    """An array as C takes it: of int64_t, or of double, two of them for a complex number."""
    ffi, _ = library()
    kind = "int64_t *" if array.dtype == np.int64 else "double *"
    return ffi.cast(kind, ffi.from_buffer(array))
