# SPDX-License-Identifier: MIT
"""Accuracy, noise and speed of the three number kernels.

    python benchmarks/kernels.py [--json OUT] [--points N] [--compiler CC]

Run by `make bench`; tests/host/core/test_accuracy.py uses it. Compiles firmware/core as a shared object of its own, in
a temporary folder. Prints the figures and writes them as one JSON object:

- accuracy: largest distance from the program as uploaded in 50-digit arithmetic, on random segments at the
  limit of the speed ratio (31 mm to 1e-6 mm) and on the golden programs;
- noise: third differences of the unrounded output at 1 kHz minus those of the exact points, mm/s^3, and the
  same for the feed (first differences of the chord);
- speed: time of a tick relative to the double kernel, and instructions of a tick where `valgrind` is there (the
  motion part, to counts, with coefficient records, as in the controller; on microcontrollers: benchmarks/counts.py);
- override: instructions of a tick of the fixed kernel at a constant override, while the override changes all
  the time, and above the factor that every piece allows.
"""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
from _figures import figures_parser, write_figures

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "benchmarks" / "support"))

from image import Piece, Segment, encode, exponent, random_segment  # noqa: E402

CORE = ROOT / "firmware" / "core"
PROGRAMS = ROOT / "tests" / "data" / "programs"
GOLDEN = ("alpha_exponential", "alpha_minimax", "heart_exponential", "star_minimax", "line_slow")
KERNELS = ("fixed", "float", "double")
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off")
DIGITS = 50
LENGTHS_MM = (31.0, 20.0, 5.0, 1.0, 0.1, 1e-3, 1e-6)
"""Lengths of the segments in which kernels are compared."""


class Point(ctypes.Structure):
    """struct interpolator_point."""

    _fields_ = [(name, ctypes.c_int64) for name in ("arc", "feed", "x", "y", "z", "a", "b", "c")]


class Core:
    """The compiled core."""

    def __init__(self, compiler: str, folder: Path) -> None:
        target = folder / "core.so"
        sources = sorted(str(p) for p in CORE.glob("*.c"))
        command = [
            compiler,
            *FLAGS,
            "-fPIC",
            "-shared",
            f"-I{CORE.parent}",
            *sources,
            "-o",
            str(target),
        ]
        subprocess.run(command, check=True)
        self.lib = ctypes.CDLL(str(target))
        self.lib.kernel_find.restype = ctypes.c_void_p
        self.lib.coefficients_size.restype = ctypes.c_uint64

    def open(self, image: bytes) -> tuple[Any, Any]:
        """struct program and the buffer that it refers to."""
        program = ctypes.create_string_buffer(256)
        buffer = ctypes.create_string_buffer(image, len(image))
        if self.lib.program_open(program, buffer, len(image)) != 0:
            raise SystemExit("an image cannot be opened")
        return program, buffer

    def points(self, image: bytes, times_q42: Sequence[int], kernel: int) -> list[Point]:
        """Points at program times in 2^-42 s."""
        program, _buffer = self.open(image)
        cursor = ctypes.create_string_buffer(4096)
        made_for = ctypes.c_void_p(self.lib.kernel_find(kernel))
        size = self.lib.coefficients_size(program, made_for)
        records = (ctypes.c_uint64 * (size // 8 + 1))()
        self.lib.coefficients_make_in(program, made_for, records, ctypes.c_uint64(size))
        self.lib.interpolator_begin(cursor, program)
        out = []
        for time in times_q42:
            point = Point()
            self.lib.interpolator_seek(cursor, ctypes.c_uint64(time >> 10))
            if self.lib.interpolator_at_q42(cursor, ctypes.c_uint64(time), ctypes.byref(point)) < 0:
                raise SystemExit("a point was refused")
            out.append(point)
        return out


@dataclass(frozen=True)
class Program:
    """An image and what is in it."""

    image: bytes
    segments: list[Segment]
    pieces: list[Piece]

    @property
    def duration_q42(self) -> int:
        """Duration in 2^-42 s."""
        return sum(p.duration for p in self.pieces) << 10


def decode(image: bytes) -> Program:
    """Segments and pieces of an image."""
    count = int.from_bytes(image[20:24], "little")
    pieces_at = 128 + 72 * count
    words = np.frombuffer(image, "<i8", 9 * count, 128).reshape(count, 9)
    piece_count = int.from_bytes(image[24:28], "little")
    rows = np.frombuffer(image, "<i8", 11 * piece_count, pieces_at).reshape(-1, 11)
    segments = [
        Segment(int(r[0]), int(r[1]), int(r[2]), tuple(int(v) for v in r[3:])) for r in words
    ]
    pieces = [Piece(int(r[0]), int(r[1]), tuple(int(v) for v in r[2:9])) for r in rows]
    return Program(image, segments, pieces)


def exact(program: Program, time_q42: int) -> tuple[Any, Any, Any, Any]:
    """(arc length, x, y, feed) of the program in 50 digits, mm and mm/s."""
    with mpmath.workdps(DIGITS):
        arc, feed = exact_feed(program, time_q42)
        arc = max(arc, mpmath.mpf(0))
        key = int(mpmath.floor(mpmath.ldexp(arc, 40)))
        segment = [s for s in program.segments if s.start <= key][-1]
        x, y = exact_point(segment, arc)
        return arc, x, y, feed


def exact_feed(program: Program, time_q42: int) -> tuple[Any, Any]:
    """Arc length and feed."""
    for piece in program.pieces:
        if time_q42 < piece.duration << 10:
            break
        time_q42 -= piece.duration << 10
    e = exponent(piece.duration)
    tau = mpmath.ldexp(mpmath.mpf(time_q42), -42 - e)
    c = [mpmath.ldexp(mpmath.mpf(v), -40) for v in (piece.start, *piece.c)]
    feed = sum(k * v * tau ** (k - 1) for k, v in enumerate(c) if k > 0)
    return sum(v * tau**k for k, v in enumerate(c)), mpmath.ldexp(feed, -e)


def exact_point(segment: Segment, arc: Any) -> tuple[Any, Any]:
    """Point at an arc length, by Newton's iteration in 50 digits."""
    w0, w1, w2 = (
        mpmath.mpc(mpmath.ldexp(u, -44), mpmath.ldexp(v, -44))
        for u, v in zip(segment.w[0::2], segment.w[1::2], strict=True)
    )
    a, b, c = w0, 2 * (w1 - w0), w0 - 2 * w1 + w2
    ca, cb, cc = mpmath.conj(a), mpmath.conj(b), mpmath.conj(c)
    distance = [a * ca, a * cb, (b * cb + 2 * a * cc) / 3, b * cc / 2, c * cc / 5]
    distance = [mpmath.re(v) for v in distance]
    curve = [a * a, a * b, (b * b + 2 * a * c) / 3, b * c / 2, c * c / 5]
    local = arc - mpmath.ldexp(mpmath.mpf(segment.start), -40)
    xi = local / sum(distance)
    for _ in range(12):
        rest = sum(v * xi ** (k + 1) for k, v in enumerate(distance)) - local
        xi -= rest / abs(a + b * xi + c * xi * xi) ** 2
    r = sum(v * xi ** (k + 1) for k, v in enumerate(curve))
    x = mpmath.ldexp(mpmath.mpf(segment.x), -40) + mpmath.re(r)
    return x, mpmath.ldexp(mpmath.mpf(segment.y), -40) + mpmath.im(r)


def extreme_program(rng: np.random.Generator, length_mm: float) -> Program:
    """Three segments at the limit of the speed ratio under one piece of constant feed."""
    segments: list[Segment] = []
    start, x, y = 0, int(rng.integers(-4000, 4000)) << 40, int(rng.integers(-4000, 4000)) << 40
    for _ in range(3):
        segments.append(random_segment(rng, start, x, y, length_mm))
        x, y, start = segments[-1].next_start()
    duration = int(rng.integers(1 << 20, 5 << 32))
    slope = int(0.999 * start * 2.0 ** (32 + exponent(duration)) / duration)
    pieces = [Piece(duration, 0, (slope, 0, 0, 0, 0, 0, 0))]
    return Program(encode(segments, pieces), segments, pieces)


def largest_errors(core: Core, program: Program, times: Sequence[int]) -> np.ndarray:
    """Largest error of a coordinate in mm by kernel, (3,)."""
    truth = [exact(program, t) for t in times]
    errors = np.zeros(3)
    for kernel in range(3):
        for got, want in zip(core.points(program.image, times, kernel), truth, strict=True):
            for value, right in ((got.x, want[1]), (got.y, want[2])):
                error = abs(mpmath.ldexp(mpmath.mpf(value), -40) - right)
                errors[kernel] = max(errors[kernel], float(error))
    return errors


def accuracy(core: Core, points: int) -> dict[str, Any]:
    """Largest errors in mm, by case and kernel."""
    rng = np.random.default_rng(2024)
    out: dict[str, Any] = {}
    for length_mm in LENGTHS_MM:
        errors = np.zeros(3)
        for _ in range(max(1, points // 20)):
            program = extreme_program(rng, length_mm)
            times = sorted(int(t) for t in rng.integers(0, program.duration_q42, 20))
            errors = np.maximum(errors, largest_errors(core, program, times))
        out[f"extreme_{length_mm:g}_mm"] = dict(zip(KERNELS, errors.tolist(), strict=True))
    for name in GOLDEN:
        program = decode((PROGRAMS / f"{name}.hdgp").read_bytes())
        times = sorted(int(t) for t in rng.integers(0, program.duration_q42, points))
        errors = largest_errors(core, program, times)
        out[name] = dict(zip(KERNELS, errors.tolist(), strict=True))
    return out


def noise(core: Core, name: str) -> dict[str, Any]:
    """Third differences and chord feed of the error over a program, at 1 kHz."""
    program = decode((PROGRAMS / f"{name}.hdgp").read_bytes())
    count = int(program.duration_q42 / 2**42 * 1000)
    times = [(2 * k * 2**42 + 1000) // 2000 for k in range(count)]
    truth = [exact(program, t) for t in times]
    out = {}
    for kernel, label in enumerate(KERNELS):
        got = core.points(program.image, times, kernel)
        x = np.array(
            [mpmath.ldexp(mpmath.mpf(g.x), -40) - t[1] for g, t in zip(got, truth, strict=True)]
        )
        y = np.array(
            [mpmath.ldexp(mpmath.mpf(g.y), -40) - t[2] for g, t in zip(got, truth, strict=True)]
        )
        third = np.diff(np.array([x, y], dtype=float), 3) * 1e9
        ripple = np.diff(np.array([x, y], dtype=float), 1) * 1e3
        out[label] = {
            "third_difference_rms_mm_s3": float(np.sqrt(np.mean(third**2))),
            "third_difference_peak_mm_s3": float(np.abs(third).max()),
            "feed_ripple_peak_mm_s": float(np.hypot(*ripple).max()),
        }
    return out


def build_driver(compiler: str, folder: Path) -> Path:
    """The program of support/tick.c."""
    source, target = ROOT / "benchmarks" / "support" / "tick.c", folder / "tick"
    sources = sorted(str(p) for p in CORE.glob("*.c"))
    subprocess.run(
        [compiler, *FLAGS, f"-I{CORE.parent}", str(source), *sources, "-o", str(target)], check=True
    )
    return target


def instructions(driver: Path, name: str, kernel: int, runs: int, *override: int) -> int:
    """Instructions of so many runs, counted by callgrind."""
    return counted(driver, name, kernel, runs, *override)[0]


def counted(driver: Path, name: str, kernel: int, runs: int, *override: int) -> tuple[int, int]:
    """Instructions and ticks of so many runs."""
    command = [
        "valgrind",
        "--tool=callgrind",
        "--callgrind-out-file=/dev/null",
        str(driver),
        str(PROGRAMS / f"{name}.hdgp"),
        str(kernel),
        str(runs),
        *map(str, override),
    ]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    found = re.search(r"Collected : (\d+)", done.stderr)
    if found is None:
        raise SystemExit("callgrind gave no count")
    return int(found.group(1)), int(done.stdout)


def speed(compiler: str, folder: Path) -> dict[str, Any]:
    """Time of a tick relative to the double kernel, ns and instructions."""
    driver = build_driver(compiler, folder)
    name = "heart_exponential"
    ticks = int(decode((PROGRAMS / f"{name}.hdgp").read_bytes()).duration_q42 / 2**42 * 1000) + 2
    out: dict[str, Any] = {}
    for kernel, label in enumerate(KERNELS):
        best = min(run_time(driver, name, kernel, 300) for _ in range(3))
        out[label] = {"tick_ns": 1e9 * best / 300 / ticks}
        if shutil.which("valgrind"):
            many = instructions(driver, name, kernel, 3) - instructions(driver, name, kernel, 1)
            out[label]["tick_instructions"] = many / 2 / ticks
    for label in KERNELS:
        out[label]["time_ratio_to_double"] = out[label]["tick_ns"] / out["double"]["tick_ns"]
    return out


OVERRIDES = {
    "plain": (100, 100),
    "constant 70 %": (70, 70),
    "on the way between 50 and 90 %": (50, 90),
    "200 % wanted": (200, 200),
}


def override_cost(compiler: str, folder: Path) -> dict[str, float]:
    """Instructions of a tick with the override in use; empty without valgrind."""
    if not shutil.which("valgrind"):
        return {}
    driver = build_driver(compiler, folder)
    out = {}
    for label, override in OVERRIDES.items():
        one, three = (counted(driver, "heart_exponential", 0, n, *override) for n in (1, 3))
        out[label] = (three[0] - one[0]) / (three[1] - one[1])
    return out


def run_time(driver: Path, name: str, kernel: int, runs: int) -> float:
    """User seconds of so many runs."""
    import resource

    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run(
        [str(driver), str(PROGRAMS / f"{name}.hdgp"), str(kernel), str(runs)],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def main() -> None:
    """See the head of the file."""
    parser = figures_parser(__doc__)
    parser.add_argument("--points", type=int, default=60, help="points per program")
    parser.add_argument("--compiler", default="gcc")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        core = Core(options.compiler, folder)
        figures = {
            "accuracy_mm": accuracy(core, options.points),
            "noise_1khz": {n: noise(core, n) for n in ("alpha_exponential", "heart_exponential")},
            "speed": speed(options.compiler, folder),
            "override_tick_instructions": override_cost(options.compiler, folder),
        }
    report(figures)
    write_figures(options.json, figures)


def report(figures: dict[str, Any]) -> None:
    """Print the figures, one line for each case."""
    print("largest error of a coordinate, nm           fixed       float      double")
    for case, errors in figures["accuracy_mm"].items():
        print(f"  {case:38}" + "".join(f"{1e6 * errors[k]:12.2e}" for k in KERNELS))
    for case, kernels in figures["noise_1khz"].items():
        for kernel, values in kernels.items():
            print(
                f"  {case} {kernel}: third difference rms {values['third_difference_rms_mm_s3']:.2g}, "
                f"peak {values['third_difference_peak_mm_s3']:.2g} mm/s^3; "
                f"feed ripple {values['feed_ripple_peak_mm_s']:.1e} mm/s"
            )
    for kernel, values in figures["speed"].items():
        count = values.get("tick_instructions")
        counted = f", {count:.0f} instructions" if count else ""
        print(
            f"  {kernel}: {values['tick_ns']:.0f} ns a tick{counted}, "
            f"{values['time_ratio_to_double']:.2f} of double"
        )
    for label, cost in figures["override_tick_instructions"].items():
        print(f"  fixed, override {label}: {cost:.0f} instructions a tick")


if __name__ == "__main__":
    main()
