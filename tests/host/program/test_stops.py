# SPDX-License-Identifier: MIT
"""The stop table: codes, bounds by both checks, and what compile makes of them. Run by pytest; writes to temporary
folders.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hodograph.errors import PlanError
from hodograph.native import NativeProgram
from hodograph.native.stop_bounds import stop_bounds
from hodograph.pipeline import load_pipeline
from hodograph.program import decode, encode, inspect_dict
from hodograph.program.check import check
from hodograph.program.check_stops import bounds
from hodograph.program.codes import ProgramError
from hodograph.program.stop_planning import with_bounds
from hodograph.program.stops import FAULT, HOLD, code_below, mantissas, numbers

ROOT = Path(__file__).parents[3]
EXAMPLES = ("alpha", "alpha_optimal", "heart_optimal", "star")


@pytest.fixture(scope="module", params=EXAMPLES)
def program(request):
    return load_pipeline(ROOT / "examples" / f"{request.param}.toml").program


def test_codes_are_eighths_of_octaves() -> None:
    assert mantissas([0, 1, 8, 64, 65, 255]).tolist() == [
        0,
        71468,
        65536 << 1,
        65536 << 8,
        71468 << 8,
        120193 << 31,
    ]
    assert numbers([64, 64, 72]).tolist() == [64.0, 1.0, 128.0]


@pytest.mark.parametrize(("column", "value"), [(0, 50000.0), (1, 2000.0), (2, 1.0), (1, 1.0)])
def test_the_code_below_a_number_is_the_greatest_that_is_not_above(column, value) -> None:
    code = code_below(column, value)
    own, above = (numbers([c] * 3)[column] for c in (code, code + 1))
    assert own <= value < above


def test_a_number_below_all_codes_has_code_0() -> None:
    assert code_below(1, 1e-3) == 0


def test_the_table_survives_encoding(program) -> None:
    again = decode(encode(program)).stops
    assert np.array_equal(again.codes, program.stops.codes)
    assert np.array_equal(again.bound_us, program.stops.bound_us)
    assert (again.worst_us, again.worst_um) == (program.stops.worst_us, program.stops.worst_um)


@pytest.mark.parametrize("kind", [HOLD, FAULT])
def test_both_checks_have_the_same_bounds(program, kind) -> None:
    """The controller's is never the shorter one, and some ten microseconds longer."""
    time_us, distance_um = stop_bounds(NativeProgram(encode(program)), kind)
    own_us, own_um = bounds(program, kind)
    assert np.all(time_us >= own_us)
    assert np.all(time_us <= own_us + 100.0)
    assert np.all(distance_um >= own_um)
    assert np.all(distance_um <= 1.03 * own_um + 20.0)


@pytest.mark.parametrize("kind", [HOLD, FAULT])
def test_the_numbers_keep_path_limits_by_themselves(program, kind) -> None:
    """Holds those of the path file, fault stops those of the machine file."""
    most = np.array([[50000.0, 2000.0, 50000.0], [200000.0, 5000.0, 200000.0]])[kind]
    assert np.all(numbers(program.stops.codes[:, kind]) <= most)


def test_every_piece_of_the_examples_has_a_fault_stop(program) -> None:
    """Except where the program, or the distance to the next piece that has one, ends sooner than a brake; or where one
    that begins while a hold brakes would pass a limit. That wait is never the longest stop."""
    without = (program.stops.codes[:, FAULT] == 0).any(axis=1)
    duration_us = np.ldexp(program.pieces.duration_q32_s.astype(float), -32) * 1e6
    assert duration_us[without].sum() < 60_000
    assert program.stops.bound_us[without, FAULT].max(initial=0) < program.stops.worst_us[FAULT]
    assert program.stops.worst(FAULT).time_s < 0.2


def test_a_piece_without_a_brake_waits_for_the_next(program) -> None:
    """Its time is in the bound."""
    codes = program.stops.codes.copy()
    codes[5, FAULT] = 0
    changed = with_bounds(replace(program, stops=replace(program.stops, codes=codes)))
    duration_us = program.pieces.duration_q32_s[5] * 2.0**-32 * 1e6
    waits = int(changed.stops.bound_us[5, FAULT])
    assert waits >= duration_us + int(program.stops.bound_us[6, FAULT])
    assert waits <= duration_us + int(changed.stops.bound_us[6, FAULT]) + 2
    assert check(changed) is None


def test_a_table_that_says_less_is_refused_by_both(program) -> None:
    bound_us = program.stops.bound_us.copy()
    bound_us[3, HOLD] -= 200
    changed = replace(program, stops=replace(program.stops, bound_us=bound_us))
    fault = check(changed)
    native = NativeProgram(encode(changed)).check()
    assert fault is not None
    assert native is not None
    assert (fault.code, fault.index) == (ProgramError.STOP_BOUND, 3) == (native.code, native.index)


def test_inspection_has_the_worst_stops(program) -> None:
    stops = inspect_dict(program)["stops"]
    for kind, name in enumerate(("hold", "fault")):
        assert stops[name]["time_s"] == program.stops.worst_us[kind] * 1e-6
        assert stops[name]["distance_mm"] == program.stops.worst_um[kind] * 1e-3
        place = stops[name]["piece"]
        assert stops[name]["at_mm"] == program.piece_starts_mm[place]


def test_a_fault_stop_that_takes_too_long_is_refused_with_its_place(tmp_path) -> None:
    text = (ROOT / "examples/machines/paper_alpha.toml").read_text(encoding="utf-8")
    text = text.replace("[work]", "stop_time_ms = 10\n[work]", 1)
    text = text.replace("../drives", str(ROOT / "examples/drives"))
    machine = tmp_path / "machine.toml"
    machine.write_text(text, encoding="utf-8")
    pipeline = load_pipeline(ROOT / "examples/alpha.toml", machine)
    with pytest.raises(PlanError, match=r"fault stop at arc length .* stop_time_ms = 10"):
        _ = pipeline.program
