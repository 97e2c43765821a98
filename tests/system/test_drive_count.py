# SPDX-License-Identifier: MIT
"""Machines of one, three and six drives: the plane moves as with two, the others hold, one drive takes no program. Run
by pytest; starts a controller and drives on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from bench import EXAMPLES, MakeBench
from commands import result
from hodograph.bus.hub import LocalHub
from hodograph.bus.sdo.controller import OFF, READY
from hodograph.bus.sdo.network import open_network
from hodograph.bus.sdo.objects import ACTUAL, TARGET
from hodograph.bustime import axis_choice, drive_pdos
from hodograph.cli.main import main
from hodograph.data import DRIVE_EDS
from marks import long
from runs import same_motion

ALPHA = str(EXAMPLES / "alpha.toml")


def machine_of(folder: Path, drives: int, period_us: int) -> Path:
    """The machine of the alpha with so many drives; the first two are the paper's, the others like its x."""
    text = (EXAMPLES / "machines" / "paper_alpha.toml").read_text()
    text = text.replace("../drives", f"{EXAMPLES}/drives")
    text = text.replace("period_us = 1000", f"period_us = {period_us}")
    head, *axes = text.split("[[axis]]")
    axes += [
        f'\nname = "a{i}"\nnode = {i + 1}\ntravel_mm = [0, 9]\nvelocity_mm_s = 500\n'
        f'acceleration_mm_s2 = 5000\njerk_mm_s3 = 200000\ndrive = "{EXAMPLES}/drives/alpha_x.toml"\n'
        for i in range(3, drives + 1)
    ]
    file = folder / f"machine_{drives}.toml"
    file.write_text("[[axis]]".join([head, *axes[:drives]]))
    return file


@pytest.mark.parametrize(
    ("drives", "period_us", "is_reported"),
    [(3, 1000, False), (6, 2000, False), long(6, 2000, True)],
)
def test_the_plane_moves_as_with_two_drives(
    hub: LocalHub,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    drives: int,
    period_us: int,
    is_reported: bool,
) -> None:
    two = machine_of(tmp_path, 2, period_us)
    many = machine_of(tmp_path, drives, period_us)
    simulated = result(capsys, "simulate", ALPHA, "--machine", str(two), "--json")
    report = ("--report", str(tmp_path / "report")) if is_reported else ()
    recorded = result(capsys, "run", ALPHA, "--machine", str(many), "--json", *report)
    assert same_motion(recorded, simulated)
    load = recorded["bus_load"]
    assert load["model_least_percent"] <= load["measured_percent"] <= load["model_worst_percent"]
    assert load["kinds"]["setpoints"]["frames"] == pytest.approx(
        drives * load["kinds"]["SYNC"]["frames"], abs=drives
    )


@pytest.mark.parametrize(("drives", "period_us"), [(3, 1000), (6, 2000)])
def test_further_axes_hold(
    make_bench: MakeBench,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    drives: int,
    period_us: int,
) -> None:
    file = machine_of(tmp_path, drives, period_us)
    controller = make_bench(file=file).controller
    assert main(["goto", ALPHA, "--machine", str(file)]) == 0
    held = [controller.read(TARGET, axis) for axis in range(3, drives + 1)]
    assert main(["start", "--follow"]) == 0
    assert [controller.read(TARGET, axis) for axis in range(3, drives + 1)] == held
    assert [controller.read(ACTUAL, axis) for axis in range(3, drives + 1)] == held
    status = result(capsys, "status", "--json")
    assert [axis["node"] for axis in status["axes"]] == list(range(2, 2 + drives))
    assert {axis["state"] for axis in status["axes"]} == {"operation enabled"}


def test_one_drive_takes_no_program(
    make_bench: MakeBench, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = machine_of(tmp_path, 1, 1000)
    controller = make_bench(file=file).controller
    image = tmp_path / "alpha.hdgp"
    assert main(["compile", ALPHA, "-o", str(image)]) == 0
    for command in ("compile", "upload", "run", "goto", "simulate"):
        for program in (ALPHA, str(image)) if command == "upload" else (ALPHA,):
            capsys.readouterr()
            assert main([command, program, "--machine", str(file)]) == 2
            assert (
                "has one axis (x), a path needs two: add a second [[axis]]"
                in capsys.readouterr().err
            )
    controller.enable()
    assert controller.state() == READY
    assert main(["start"]) == 5  # no program
    assert len(result(capsys, "status", "--json")["axes"]) == 1
    assert main(["stop", "--off"]) == 0
    assert controller.state() == OFF


@pytest.mark.parametrize("feedforward", ["", "velocity = 1", "torque_permille_s_m = 2"])
def test_the_model_has_the_pdos_that_drives_are_given(
    make_bench: MakeBench, tmp_path: Path, feedforward: str
) -> None:
    file = machine_of(tmp_path, 2, 2000)
    file.write_text(file.read_text() + f"\n[axis.feedforward]\n{feedforward}\n")
    bench = make_bench(file=file)
    bench.controller.enable()
    bench.rig.processes[1].kill()  # one SDO client at a time
    for axis in bench.machine.axes:
        with open_network(bench.bus, axis.node, 1_000_000) as network:
            drive = network.add_node(axis.node, str(DRIVE_EDS))
            drive.sdo.RESPONSE_TIMEOUT = 5.0
            drive.tpdo.read()
            drive.rpdo.read()
            found = {
                (
                    received,
                    number,
                    pdo.cob_id,
                    tuple(v.index << 16 | v.subindex << 8 | v.length for v in pdo.map),
                )
                for received, maps in ((True, drive.rpdo), (False, drive.tpdo))
                for number, pdo in maps.items()
                if pdo.enabled
            }
        wanted = {
            (
                p.received,
                p.number,
                p.cob_id,
                tuple(e.index << 16 | e.sub << 8 | e.bits for e in p.entries),
            )
            for p in drive_pdos(axis.node, axis_choice(bench.machine, axis))
        }
        assert found == wanted
