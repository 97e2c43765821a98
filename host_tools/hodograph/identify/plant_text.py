# SPDX-License-Identifier: MIT
"""What was identified, as drive-file text and as JSON."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from .plant_fit import Estimate, Plant


def plant_text(name: str, plant: Plant) -> str:
    """The sections of a drive file that the fit found, with 95 % intervals."""
    lines = [
        f"# axis {name}: {plant.periods} periods; left over {plant.rms_um:.3f} um, {plant.rms_mv:.1f} mV rms; +- 95 %",
        "[plant]",
        _line("gain_rad_s_v", plant.gain_rad_s_v),
        _line("time_constant_s", plant.time_constant_s),
    ]
    if plant.friction_volts is not None:
        lines += ["", "[equipment]", _line("friction_volts", plant.friction_volts)]
    return "\n".join(lines)


def _line(key: str, estimate: Estimate) -> str:
    text = f"{key} = {estimate.value:.6g}"
    return f"{text:<32}# +- {estimate.within:.2g}"


def plant_json(name: str, plant: Plant) -> dict[str, Any]:
    """The keys that tools may rely on."""
    return {"name": name, **asdict(plant)}
