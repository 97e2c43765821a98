# SPDX-License-Identifier: MIT
"""Tests of bus/sdo/upload: what it checks before it sends a program. Run by `make pytest`. Reads an image of
tests/data; the controller is a class here, so no bus is needed.
"""

from __future__ import annotations

from dataclasses import astuple
from pathlib import Path
from typing import Any, cast

import pytest

from hodograph.bus.sdo.objects import PROGRAM_MEMORY
from hodograph.bus.sdo.upload import upload
from hodograph.errors import RefusedError
from hodograph.program.image import RECORD_BYTES, memory_bytes

IMAGE = (Path(__file__).parents[2] / "data/programs/alpha_quintic.hdgp").read_bytes()
NEEDED = memory_bytes(IMAGE, RECORD_BYTES["fixed"])


class UploadBegunError(Exception):
    """The upload has gone on to another object than the sizes of the banks."""


class SmallController:
    """A controller of which only the sizes of banks and records can be read."""

    def __init__(self, bank_bytes: int) -> None:
        self._memory = (0, bank_bytes, *astuple(RECORD_BYTES["fixed"]))

    def read(self, index: int, sub: int) -> int:
        if index != PROGRAM_MEMORY:
            raise UploadBegunError
        return self._memory[sub]

    def who(self) -> str:
        return "node 1"


def test_a_program_that_no_bank_holds_is_refused_before_its_upload() -> None:
    small = cast("Any", SmallController(NEEDED - 1))
    with pytest.raises(
        RefusedError, match=rf"node 1 has {NEEDED - 1} bytes for a program, this one takes {NEEDED}"
    ):
        upload(small, IMAGE)


def test_a_program_that_just_fits_is_sent() -> None:
    with pytest.raises(UploadBegunError):
        upload(cast("Any", SmallController(NEEDED)), IMAGE)
