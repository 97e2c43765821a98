# SPDX-License-Identifier: MIT
"""A run without a bus: hashes, settling, refusals, and every kernel. Run by pytest; starts and writes nothing."""

from __future__ import annotations

import hashlib
from dataclasses import replace

import numpy as np
import pytest

from hodograph.errors import InputError
from hodograph.native import DriveModel, NativeProgram
from hodograph.program import decode
from hodograph.simulate import SETTLING_S, settling_ticks, simulate
from hodograph.simulate import simulation as simulation_module

from .conftest import Case


def test_hashes_cover_the_program_ticks_only(alpha: Case) -> None:
    motion = alpha.motion
    rows = motion.program_rows
    assert len(motion.rows) == motion.ticks + 200
    assert SETTLING_S * 1e6 == 1000 * settling_ticks(1000) == 8000 * settling_ticks(8000)
    for column, digest in (
        ("set_counts", motion.setpoints_sha256),
        ("act_counts", motion.encoders_sha256),
    ):
        counts = np.ascontiguousarray(rows[column][:, :2], dtype="<i4")
        assert hashlib.sha256(counts.tobytes()).hexdigest() == digest


def test_maxima_count_the_settling_time_and_the_mean_does_not(alpha: Case) -> None:
    motion = alpha.motion
    assert motion.max_contour_error_um == motion.contour_error_um.max()
    assert motion.max_following_error_um == pytest.approx(abs(motion.following_error_um).max())
    assert motion.max_volts == abs(motion.volts).max()
    rms = np.sqrt(np.mean(motion.contour_error_um[: motion.ticks] ** 2))  # without it
    assert motion.rms_contour_error_um == pytest.approx(rms, rel=1e-12)
    following = 1000.0 * (motion.set_mm - motion.act_mm)
    assert motion.following_error_um == pytest.approx(following, abs=1e-6)
    assert np.abs(motion.set_mm - motion.cmd_mm).max() <= 0.5000001e-6  # a count is a nanometre
    settled = motion.contour_error_um[-1]
    assert settled < 0.05


def test_chunks_and_kept_rows_change_nothing(alpha: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[int, int]] = []
    monkeypatch.setattr(simulation_module, "CHUNK_TICKS", 97)
    motion = simulate(
        alpha.image,
        alpha.drives,
        keep_rows=False,
        progress=lambda done, total: seen.append((done, total)),
    )
    assert motion.summary() == alpha.motion.summary()
    assert motion.rows.size == 0
    total = alpha.motion.ticks + 200
    assert seen[0] == (97, total)
    assert seen[-1] == (total, total)


def test_summary_has_the_promised_keys(alpha: Case) -> None:
    assert list(alpha.motion.summary()) == [
        "ticks",
        "setpoints_sha256",
        "encoders_sha256",
        "max_contour_error_um",
        "max_following_error_um",
        "max_volts",
        "kernel",
    ]


def test_row_k_is_the_drive_one_period_after_it_has_setpoint_k(alpha: Case) -> None:
    rows = alpha.motion.rows
    for axis, drive in enumerate(alpha.drives):
        model = DriveModel(drive)
        model.place(int(rows["set_counts"][0, axis]))
        positions, volts_mv = model.follow(rows["set_counts"][:, axis])
        assert np.array_equal(positions, rows["act_counts"][:, axis])
        assert np.array_equal(volts_mv, rows["volts_mv"][:, axis])


def test_path_begins_and_ends_where_the_program_does(alpha: Case) -> None:
    motion = alpha.motion
    program = decode(alpha.image)
    assert motion.cmd_mm[0] == pytest.approx(program.point_q40[:, 0] / 2**40)
    end = alpha.spline.point(np.array([alpha.spline.length_mm]))[0]
    assert motion.cmd_mm[motion.ticks - 1] == pytest.approx([end.real, end.imag], abs=1e-8)
    assert np.all(motion.rows["set_counts"][motion.ticks :] == motion.rows["set_counts"][-1])
    assert motion.feed_mm_s[motion.ticks - 1 :] == pytest.approx(0.0, abs=1e-6)
    assert motion.t_s[-1] == pytest.approx((motion.ticks + 199) * 1e-3)


# The paper's own figures are 10.5 and 10.8 um; its block diagram is not known (shared reading of the PDFF loop).
@pytest.mark.parametrize(("name", "low", "high"), [("alpha", 21.0, 21.7), ("heart", 27.7, 28.5)])
def test_contour_error_with_the_gains_of_the_paper(
    name: str, low: float, high: float, request: pytest.FixtureRequest
) -> None:
    case: Case = request.getfixturevalue(name)
    assert low < case.motion.max_contour_error_um < high
    assert case.motion.max_volts < 5.0


def test_kernels_agree_to_counts(alpha: Case) -> None:
    double = simulate(alpha.image, alpha.drives, kernel="double")
    for kernel, most in (("fixed", 1), ("float", 10)):
        motion = simulate(alpha.image, alpha.drives, kernel=kernel)
        difference = motion.rows["set_counts"].astype(np.int64) - double.rows["set_counts"]
        assert np.abs(difference).max() <= most
        assert motion.kernel == kernel


def test_times_are_exact_and_stop_at_the_duration(alpha: Case) -> None:
    program = NativeProgram(alpha.image)
    times = program.tick_times_q42_s(0, program.ticks + 3)
    expected = [(2 * k * 2**42 + 1000) // 2000 for k in range(program.ticks - 1)]
    assert times[: program.ticks - 1].tolist() == expected
    assert set(times[program.ticks - 1 :].tolist()) == {program.duration_q32_s << 10}


def test_points_at_any_time_in_any_order(alpha: Case) -> None:
    program = NativeProgram(alpha.image)
    times = program.tick_times_q42_s()
    order = np.random.default_rng(1).permutation(len(times))
    ordered = program.points("fixed", times)
    assert np.array_equal(program.points("fixed", times[order]), ordered[order])


def test_bad_input_is_refused(alpha: Case) -> None:
    with pytest.raises(InputError, match="program image"):
        simulate(alpha.image[:-1], alpha.drives)
    broken = bytearray(alpha.image)
    broken[200] ^= 1
    with pytest.raises(InputError, match="program image"):
        simulate(bytes(broken), alpha.drives)
    with pytest.raises(InputError, match="fixed, float, double"):
        simulate(alpha.image, alpha.drives, kernel="fast")
    with pytest.raises(InputError, match="2 axes"):
        simulate(alpha.image, alpha.drives[:1])
    slow = replace(alpha.drives[1], loop_rate_hz=1234)
    with pytest.raises(InputError, match=r"axis 2: .*servo samples"):
        simulate(alpha.image, (alpha.drives[0], slow))
    with pytest.raises(InputError, match="gains"):
        DriveModel(replace(alpha.drives[0], k_vf=-1.0))
