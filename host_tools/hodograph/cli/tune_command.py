# SPDX-License-Identifier: MIT
"""Commands about servo loops: tune. Started by cli/main. Reads machine and path files, may write machine and drive
files and a report, and prints to stdout and stderr.
"""

from __future__ import annotations

from argparse import Namespace
from dataclasses import replace
from pathlib import Path

from ..bustime import require_fit
from ..config import Machine, load_machine
from ..config.axis_table import Feedforward
from ..config.rewrite import rewritten
from ..errors import InputError
from ..pipeline import load_pipeline
from .output import note, print_json, progress, require_new, require_places, write_files


def tune(options: Namespace) -> None:
    """hodograph tune."""
    from ..tune import Asked, Wanted, tuning_json, tuning_text
    from ..tune import tune as tune_machine

    _check(options)
    require_places(options.output, folders=[options.report])
    require_new(options.output, force=options.force)
    machine = load_machine(options.file)
    pipelines = [load_pipeline(file, options.file) for file in options.path or ()]
    asked = Asked(
        bandwidth_hz=options.bandwidth,
        damping=options.damping if options.damping is not None else 1.0,
        stiffness_n_um=options.stiffness,
        interpolation=options.interpolation,
        velocity=options.velocity,
        wanted=Wanted(modulus=options.margin, delay_s=options.delay_us * 1e-6),
    )
    with progress("search", "loop") as advance:
        found = tune_machine(machine, pipelines, asked, advance)
    for axis in found.axes:
        if options.bandwidth is not None and axis.tuned.margins.modulus < options.margin:
            note(
                f"axis {axis.name}: the modulus margin is {axis.tuned.margins.modulus:.3f}, below {options.margin:g}"
            )
    require_fit(_with_feedforward(machine, found.feedforward))
    files: dict[Path, str] = {}
    if options.output is not None:
        drives, forward = dict(enumerate(found.drives)), dict(enumerate(found.feedforward))
        files = rewritten(machine, drives, forward, options.output, "tune")
        write_files(files, force=options.force)
    if options.report is not None:
        from ..report.tune_report import write_tune_report

        files[write_tune_report(found, pipelines, options.report)] = ""
    if options.json:
        print_json(tuning_json(found) | {"files": [str(file) for file in files]})
        return
    print(tuning_text(found))
    for file in files:
        print(file)


def _with_feedforward(machine: Machine, forward: tuple[Feedforward, Feedforward]) -> Machine:
    """The tuned machine; checks that it fits the bus, since offsets need bytes of frames."""
    plane = zip(machine.require_plane("tune"), forward, strict=True)
    with_feedforward = tuple(replace(axis, feedforward=own) for axis, own in plane)
    return replace(machine, axes=(*with_feedforward, *machine.axes[len(with_feedforward) :]))


def _check(options: Namespace) -> None:
    if options.delay_us < 0:
        raise InputError(f"--delay-us {options.delay_us:g}: a dead time is not negative")
    if options.bandwidth is None:
        if not options.path:
            raise InputError(
                "tune: say what for: --bandwidth HZ, or --path FILE for the least contour error on it"
            )
        for name in ("damping", "stiffness"):
            if getattr(options, name) is not None:
                raise InputError(f"tune: --{name} goes with --bandwidth HZ")


COMMANDS = {"tune": tune}
