# SPDX-License-Identifier: MIT
"""Objects of the controller from a machine file: in the dictionary, in range, with the requested values. Run by pytest;
starts and writes nothing.
"""

from __future__ import annotations

from pathlib import Path

import canopen
import pytest

from hodograph.bus.sdo.configuration import configuration
from hodograph.config import load_machine
from hodograph.data import CONTROLLER_EDS

MACHINES = Path(__file__).resolve().parents[3] / "examples" / "machines"


def wanted(name: str) -> dict[tuple[int, int | None], int]:
    return dict(configuration(load_machine(MACHINES / f"{name}.toml"), "fixed"))


@pytest.mark.parametrize("name", [file.stem for file in MACHINES.glob("*.toml")])
def test_every_value_is_one_that_the_dictionary_takes(name: str) -> None:
    dictionary = canopen.import_od(str(CONTROLLER_EDS), node_id=1)
    for (index, sub), value in wanted(name).items():
        variable = dictionary.get_variable(index, sub or 0)
        assert variable is not None, f"0x{index:04X} sub {sub}"
        assert variable.access_type == "rw"
        assert variable.decode_raw(variable.encode_raw(value)) == value
        assert variable.min is None or value >= variable.min, variable.name
        assert variable.max is None or value <= variable.max, variable.name


def test_files_without_the_new_keys_ask_for_the_defaults() -> None:
    """Only what a machine file has always set differs from power-on, and how drives brake by themselves."""
    dictionary = canopen.import_od(str(CONTROLLER_EDS), node_id=1)
    changed = {
        index
        for (index, sub), value in wanted("paper_alpha").items()
        if dictionary.get_variable(index, sub or 0).default != value
    }
    assert changed <= {0x2004, 0x2006, 0x2007, 0x2018, 0x201F, 0x2030, 0x2031, 0x2032}
    assert wanted("paper_alpha")[0x2004, 11] == 0


def test_values_of_real_drives() -> None:
    found = wanted("real_drives")
    assert [found[0x2004, sub] for sub in (1, 8, 9, 10, 11)] == [3, 2, 1, 50, 3]
    first = [found[index, 1] for index in range(0x2012, 0x2017)]
    assert first == [17, -200_000_000, 20_000_000, 2_000_000, 200_000_000]
    assert [found[index, 1] for index in (0x2018, 0x2019, 0x201A)] == [1000, 819_200, 196_608]
    assert [found[0x201D, axis] for axis in (1, 2, 3)] == [2_000_000, 2_000_000, 1_000_000]
    assert [found[0x201E, axis] for axis in (1, 2, 3)] == [20, 20, 10]
    assert found[0x201F, 1] == 3_000_000_000
    assert [found[index, 1] for index in range(0x2020, 0x2024)] == [131072, 10_000_000, 1, 1]
    assert [found[index, 3] for index in range(0x2020, 0x2024)] == [0, 0, 0, 0]
