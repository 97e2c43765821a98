# SPDX-License-Identifier: MIT
"""The buttons: what a browser may ask of the controller."""

from __future__ import annotations

from typing import Any

from ..bus.sdo.controller import Controller
from ..bus.sdo.objects import DISABLE, ENABLE, HOLD, HOME, QUICK_STOP, RESET, RESUME, START, STOP
from ..errors import InputError
from .link import Command

MOST_PERCENT = 200

_BUTTONS = {
    "enable": ENABLE,
    "disable": DISABLE,
    "start": START,
    "hold": HOLD,
    "resume": RESUME,
    "stop": STOP,
    "quick-stop": QUICK_STOP,
    "reset": RESET,
    "home": HOME,
}
"""Names as in the page, and commands of object 0x2001."""


def read_command(request: dict[str, Any]) -> Command:
    """The command that a request of a browser stands for. Raises InputError for anything else."""
    name = request.get("name")
    if name == "override":
        percent = request.get("percent")
        if type(percent) is not int or not 0 <= percent <= MOST_PERCENT:
            raise InputError(f"override: a whole number from 0 to {MOST_PERCENT} is needed")
        return lambda controller: controller.override(percent)
    if not isinstance(name, str) or name not in _BUTTONS:
        raise InputError("there is no such command")
    return _button(_BUTTONS[name])


def _button(number: int) -> Command:
    def give(controller: Controller) -> None:
        controller.command(number)

    return give
