# SPDX-License-Identifier: MIT
"""The C core and simulator, called from Python: the same objects as in the controller.

`make build` makes the compiled module (build_native.py); without it each call raises a HodographError with that
message. Arrays go in and out without copies; the interpreter lock is released during the calls.

Used by many modules of host_tools. Loads the compiled module; no other I/O.
"""

from ..names import KERNELS
from .axis_run import AxisInputs, run_axis
from .contour import Contour
from .drive import DriveModel
from .library import library, native_file
from .offline import FAULT_KINDS, FOR_EVER, ROW, OfflineFault, OfflineSimulation
from .program import (
    POINT,
    NativeFault,
    NativeLimits,
    NativeProgram,
    counts_from_q40_mm,
    kernel_code,
)
from .stream import OfflineStream

__all__ = [
    "FAULT_KINDS",
    "FOR_EVER",
    "KERNELS",
    "POINT",
    "ROW",
    "AxisInputs",
    "Contour",
    "DriveModel",
    "NativeFault",
    "NativeLimits",
    "NativeProgram",
    "OfflineFault",
    "OfflineSimulation",
    "OfflineStream",
    "counts_from_q40_mm",
    "kernel_code",
    "library",
    "native_file",
    "run_axis",
]
