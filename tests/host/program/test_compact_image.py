# SPDX-License-Identifier: MIT
"""Images with compact records: the same program in fewer bytes, where its numbers fit (protocol.md 1.7.1). Run by
pytest; starts and writes nothing.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hodograph.errors import InputError
from hodograph.native.program import NativeLimits, NativeProgram
from hodograph.program import Program, ProgramLimits, decode, encode
from hodograph.program.check import check_image
from hodograph.program.codes import ProgramError
from hodograph.program.image import FLAG_COMPACT, with_crc

PROGRAMS = Path(__file__).parents[2] / "data" / "programs"
NAMES = ("heart_exponential", "alpha_events", "space3", "space6")


def _verdicts(image: bytes, *, chunk: bool = True) -> list[tuple[int, int] | None]:
    """(code, index) of the host's check and the controller's; None: accepted."""
    axes = decode(image).axis_count
    fields = (1000, 500_000, 5_000_000, 200_000, (-4000 << 40,) * axes, (4000 << 40,) * axes)
    own = check_image(image, ProgramLimits(*fields), chunk=chunk)
    native = NativeProgram(image).check(NativeLimits(*fields, chunk=int(chunk)))
    return [fault and (int(fault.code), fault.index) for fault in (own, native)]


def _wide(name: str) -> Program:
    return decode((PROGRAMS / f"{name}.hdgp").read_bytes())


def _compact(program: Program) -> Program:
    return replace(program, compact=True)


def _same(one: Program, other: Program) -> None:
    """All their numbers."""
    assert encode(replace(one, compact=False)) == encode(replace(other, compact=False))


@pytest.mark.parametrize("name", NAMES)
def test_a_compact_image_has_the_same_program(name: str) -> None:
    wide = _wide(name)
    image = encode(_compact(wide))
    assert len(image) == _compact(wide).image_size
    fewer = {2: 72 - 57, 3: 104 - 100, 6: 104 - 100 + 3}[wide.axis_count]
    saved = fewer * wide.segment_count + (88 + 16 - 69 - 12) * wide.piece_count
    assert wide.image_size - len(image) == saved
    read = decode(image)
    assert read.compact
    assert encode(read) == image
    _same(read, wide)
    assert _verdicts(image) == [None, None]


def test_it_is_refused_outside_of_a_chunk() -> None:
    image = encode(_compact(_wide("space3")))
    assert _verdicts(image, chunk=False) == 2 * [(int(ProgramError.FLAGS), 0)]


def _with_number(program: Program, field: str, value: int) -> Program:
    """With one number of its second record changed."""
    pieces = program.pieces
    if field == "bound_us":
        bound_us = program.stops.bound_us.copy()
        bound_us[1, 1] = value
        return replace(program, stops=replace(program.stops, bound_us=bound_us))
    if field in ("duration_q32_s", "c_q40", "piece_start_q40"):
        name = field.removeprefix("piece_")
        values = getattr(pieces, name).copy()
        values[1, ...] = value
        return replace(program, pieces=replace(pieces, **{name: values}))
    if field == "length_q40":
        return replace(program, length_q40=value)
    values = getattr(program, field).copy()
    values[(-1, 1) if values.ndim > 1 else 1] = value
    return replace(program, **{field: values})


@pytest.mark.parametrize(
    ("field", "bits", "signed"),
    [
        ("duration_q32_s", 32, False),
        ("c_q40", 48, True),
        ("a_q44", 48, True),
        ("extra_q40", 48, True),
        ("point_q40", 56, True),
        ("start_q40", 56, True),
        ("piece_start_q40", 56, True),
        ("length_q40", 55, False),
        ("bound_us", 24, False),
    ],
)
def test_numbers_at_the_ends_of_their_fields(field: str, bits: int, signed: bool) -> None:
    base = _compact(_wide("space6"))
    largest = (1 << bits - signed) - 1
    for value in (largest, *([-largest - 1] if signed else [0])):
        program = _with_number(base, field, value)
        assert program.has_compact_image
        _same(decode(encode(program)), program)
    beyond = _with_number(base, field, largest + 1)
    assert not beyond.has_compact_image
    if field in ("a_q44", "extra_q40"):  # 48 bits in the other records of space too
        with pytest.raises(InputError, match="48 bits"):
            encode(beyond)
        return
    image = encode(beyond)
    assert len(image) == beyond.image_size == replace(beyond, compact=False).image_size
    assert not int.from_bytes(image[28:30], "little") & FLAG_COMPACT
    _same(decode(image), beyond)


BASE = {name: encode(_compact(_wide(name))) for name in ("heart_exponential", "space6")}


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.sampled_from(sorted(BASE)), st.integers(0, 2**32 - 1), st.integers(0, 255))
def test_both_checks_agree_on_a_changed_byte(name: str, random: int, value: int) -> None:
    """In any record."""
    base = BASE[name]
    header = int.from_bytes(base[6:8], "little")
    place = header + random % (len(base) - header)
    image = with_crc(base[:place] + bytes([value]) + base[place + 1 :])
    own, native = _verdicts(image)
    assert own == native


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.integers(0, 400))
def test_a_cut_image_does_not_open(cut: int) -> None:
    image = BASE["space6"][: len(BASE["space6"]) - 1 - cut]
    with pytest.raises(InputError, match="truncated"):
        decode(image)
    with pytest.raises(InputError, match="truncated"):
        NativeProgram(image)


def test_setpoints_are_the_same() -> None:
    wide = _wide("heart_exponential")
    found = []
    for program in (wide, _compact(wide)):
        native, limits = NativeProgram(encode(program)), NativeLimits(chunk=1)
        assert native.check(limits) is None
        found.append(native.setpoints("fixed", (10_000, 10_000))[1])
    assert np.array_equal(*found)
