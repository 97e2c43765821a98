# SPDX-License-Identifier: MIT
"""From a run's number to its settings. Run by pytest; writes to temporary folders."""

from __future__ import annotations

from campaign_files import Write

from hodograph.campaign.definition import load_campaign
from hodograph.campaign.run_settings import Case

TEXT = """
paths = ["path.toml", "{examples}/heart.toml"]
profiles = ["quintic", "minimax"]
feeds_mm_s = [50, 60, 70]
samples = 4
[[gains]]
name = "own"
[[gains]]
name = "soft"
k_pp_rad_s_mm = 60
k_vf = [0.5, 0.6]
feedforward = { velocity = 0.1 }
[vary.gain_rad_s_v]
factor_uniform = [0.8, 1.2]
[vary.friction_volts]
values = [0, 0.2]
axis = "y"
[[faults]]
name = "none"
[[faults]]
name = "load"
rules = ["load at={at} for=50 node=3 volts=1.5", "drop at=7 id={rpdo1}"]
random = { at = [5, 500], node = [2, 3] }
"""


def test_every_combination_once(write: Write) -> None:
    design = load_campaign(write(TEXT)).design
    runs = [design.run(number) for number in range(design.total)]
    seen = {(r.case, r.sample, dict(r.varied)["y.friction_volts"]) for r in runs}
    assert len(seen) == len(runs) == 2 * 2 * 3 * 2 * 2 * 2 * 4
    assert runs[-1].case == Case(1, 1, 2, 1, 1)
    assert [r.sample for r in runs[:5]] == [0, 1, 2, 3, 0]
    programs = [(r.case.path, r.case.profile, r.case.feed) for r in runs]
    assert programs == sorted(programs)


def test_settings_arrive(write: Write) -> None:
    design = load_campaign(write(TEXT)).design
    for number in range(0, design.total, 7):
        run = design.run(number)
        x, y = run.plant.drives
        soft = run.case.gains == 1
        assert (x.k_pp_rad_s_mm == 60) == soft
        assert ((x.k_vf, y.k_vf) == (0.5, 0.6)) == soft
        assert [f.velocity for f in run.plant.feedforward] == ([0.1, 0.1] if soft else [0, 0])
        varied = dict(run.varied)
        assert tuple(varied) == design.varied_columns
        assert (x.gain_rad_s_v, y.gain_rad_s_v) == (
            varied["x.gain_rad_s_v"],
            varied["y.gain_rad_s_v"],
        )
        own = design.plants[run.case.path].drives
        assert 0.8 * own[0].gain_rad_s_v < x.gain_rad_s_v < 1.2 * own[0].gain_rad_s_v
        assert y.equipment.friction_volts == varied["y.friction_volts"]
        assert x.equipment.friction_volts is None
        assert [f.kind for f in run.faults] == (["load", "setpoint-lost"] if run.case.fault else [])


def test_a_sample_is_the_same_machine_everywhere(write: Write) -> None:
    """And with other variations, samples and gains beside it, so campaigns can be compared."""
    more = TEXT.replace("samples = 4", "samples = 9") + "[vary.k_vf]\nuniform = [0.8, 0.9]\n"
    one, two = load_campaign(write(TEXT)).design, load_campaign(write(more)).design

    def gain(design: object, sample: int) -> set[float]:
        runs = [design.run(n) for n in range(design.program_size)]  # type: ignore[attr-defined]
        return {dict(r.varied)["x.gain_rad_s_v"] for r in runs if r.sample == sample}

    assert len(gain(one, 3)) == 1
    assert gain(one, 3) == gain(two, 3)
    assert gain(one, 3) != gain(one, 2)
