# SPDX-License-Identifier: MIT
"""Outputs at standstill (object 0x2058): switches and reads the outputs of the I/O module while no program runs. Used
by job_run, cli/motion_commands and cli/stream_command. Reads and writes objects of the controller by SDO.
"""

from __future__ import annotations

from ..errors import RefusedError
from ..events import ANALOGUES, OutputValues
from .diagnostics.texts import STATES
from .sdo.controller import Controller, lacks_object, needs_standstill_outputs
from .sdo.objects import READY, STANDSTILL_OUTPUTS

_FIRST_ANALOGUE, _ALL = 3, 7
"""Subindices of the first analogue output and of all outputs as one number; digital outputs are subs 1 and 2."""


def require_standstill_outputs(controller: Controller) -> None:
    """Raises RefusedError: the firmware cannot switch outputs at standstill, nor keep them on between two programs."""
    with needs_standstill_outputs(controller):
        controller.read(STANDSTILL_OUTPUTS, 1)


def set_outputs(controller: Controller, values: OutputValues) -> None:
    """Switches the outputs at standstill, all at once, with the drives on. They stay until the next start, a stop or a
    fault.

    Raises RefusedError: axes move, the drives are off, there is no I/O module, or the firmware cannot do this.
    """
    controller.acted = True
    with needs_standstill_outputs(controller):
        try:
            _set_together(controller, values)
        except RefusedError as error:
            if lacks_object(error):
                raise
            raise RefusedError(f"{controller.who()}: {_reason(controller, error)}") from error


def _set_together(controller: Controller, values: OutputValues) -> None:
    try:
        controller.write(STANDSTILL_OUTPUTS, _ALL, values.together)
    except RefusedError as error:
        if not lacks_object(error):
            raise
        _set_one_by_one(controller, values)


def _set_one_by_one(controller: Controller, values: OutputValues) -> None:
    """For a controller of minor version 2, which takes each byte of digital outputs and each analogue output by itself.
    Analogue outputs come first, so that a spindle has its speed when it is switched on.
    """
    for i, value in enumerate(values.analogue):
        controller.write(STANDSTILL_OUTPUTS, _FIRST_ANALOGUE + i, value)
    for sub in (1, 2):
        controller.write(STANDSTILL_OUTPUTS, sub, values.digital >> 8 * (sub - 1) & 0xFF)


def _reason(controller: Controller, error: RefusedError) -> str:
    state = controller.state()
    if state != READY:
        return (
            f"is {STATES.get(state, state)}: outputs are switched at standstill, with the drives on"
        )
    return f"has no I/O module in its configuration: {error}"


def outputs_of(controller: Controller) -> OutputValues:
    """The outputs as a program, or `set_outputs`, has switched them last. Raises RefusedError: the firmware does not
    tell.
    """
    with needs_standstill_outputs(controller):
        digital = controller.read(STANDSTILL_OUTPUTS, 1)
        digital |= controller.read(STANDSTILL_OUTPUTS, 2) << 8
        subs = range(_FIRST_ANALOGUE, _FIRST_ANALOGUE + ANALOGUES)
        return OutputValues(
            digital, tuple(controller.read(STANDSTILL_OUTPUTS, sub) for sub in subs)
        )
