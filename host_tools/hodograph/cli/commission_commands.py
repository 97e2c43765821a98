# SPDX-License-Identifier: MIT
"""Commands that read drives without a controller: scan, check. Started by cli/main. Reads objects of drives by SDO, may
give drives node numbers and write a machine file, and prints to stdout and stderr.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator
from dataclasses import asdict, dataclass

from ..bus.address import BusAddress
from ..bus.own_bus import bus_address
from ..bustime import require_fit
from ..commission import (
    Assignment,
    DriveProperties,
    Finding,
    Identity,
    NodeReader,
    Unconfigured,
    assign,
    check_axis,
    find_unconfigured,
    found_nodes,
    machine_text,
    matched,
    opened_bus,
    read_properties,
    require_no_controller,
)
from ..commission.check import FAULT, OK
from ..commission.drive_properties import MODES
from ..config import load_machine
from ..config.axis_table import MAX_AXES
from ..errors import BusError, InputError
from .output import complain, note, print_json, require_new, require_places, write_files


def scan(options: Namespace) -> None:
    """hodograph scan."""
    if options.assign and options.no_lss:
        raise InputError("--assign: needs LSS: leave --no-lss out")
    if options.store and not options.assign:
        raise InputError("--store: stores what --assign gives: add --assign")
    require_places(options.output)
    require_new(options.output, force=options.force)
    address = bus_address(options.bus)
    scanned = _scanned(options, address)
    if scanned.unconfigured.hidden is not None:
        note(scanned.unconfigured.hidden)
    if not scanned.nodes and not scanned.unconfigured.identities:
        raise BusError(
            f"{address}: no node answers in {options.wait:g} s: is the power on, and the bit rate right?"
        )
    if options.output is not None:
        _write(options, address, scanned.nodes)
    if options.json:
        written = None if options.output is None else str(options.output)
        print_json({"bus": str(address), **scanned.document(), "file": written})
        return
    for line in scanned.lines():
        print(line)
    if options.output is not None:
        print(options.output)


@dataclass(frozen=True)
class _Scanned:
    """The nodes of a bus, those without number, and the numbers that were given to some of these."""

    nodes: list[DriveProperties]
    unconfigured: Unconfigured
    assigned: dict[Identity, int]

    def document(self) -> dict[str, object]:
        """For --json."""
        without = [
            asdict(identity) | {"assigned": self.assigned.get(identity)}
            for identity in self.unconfigured.identities
        ]
        return {"nodes": [properties.json() for properties in self.nodes], "unconfigured": without}

    def lines(self) -> Iterator[str]:
        """The result as text."""
        for identity in self.unconfigured.identities:
            node = self.assigned.get(identity)
            became = "no node number" if node is None else f"is node {node} now"
            yield f"LSS: {identity}: {became}"
        for properties in self.nodes:
            yield from _lines(properties)


def _scanned(options: Namespace, address: BusAddress) -> _Scanned:
    """Searches the bus, and assigns node numbers as the options require."""
    wanted = [Assignment(*one) for one in options.assign]
    unconfigured, assigned = Unconfigured(()), dict[Identity, int]()
    with opened_bus(address, options.bitrate) as network:
        require_no_controller(network, address)
        nodes = found_nodes(network, options.wait)
        if not options.no_lss:
            unconfigured = find_unconfigured(network)
        found = [read_properties(NodeReader(network, node)) for node in nodes]
        taken = {properties.node: _identity(properties) for properties in found}
        try:
            for identity, node in matched(wanted, unconfigured.identities, taken):
                assign(network, identity, node, store=options.store)
                assigned[identity] = node
            if assigned:
                new = found_nodes(network, options.wait, assigned.values())
                found += [read_properties(NodeReader(network, node)) for node in new]
                found.sort(key=lambda properties: properties.node)
        except BaseException:
            for identity, node in assigned.items():
                complain(f"{identity}: is node {node} now")
            raise
    return _Scanned(found, unconfigured, assigned)


def _identity(properties: DriveProperties) -> Identity:
    """The identity as LSS compares it: a value that a node does not report is 0."""
    numbers = (properties.vendor, properties.product, properties.revision, properties.serial)
    return Identity(*(number or 0 for number in numbers))


def _write(options: Namespace, address: BusAddress, nodes: list[DriveProperties]) -> None:
    drives = [properties for properties in nodes if properties.is_drive]
    if not drives:
        raise BusError(
            f"{address}: no drive by CiA 402 among the nodes: no machine file is written"
        )
    if len(drives) > MAX_AXES:
        note(f"{len(drives)} drives: the file has the first {MAX_AXES}, as a machine has no more")
    others = [properties.node for properties in nodes if not properties.is_drive]
    text = machine_text(drives, options.bitrate, str(address), others)
    write_files({options.output: text}, force=options.force)


def _lines(properties: DriveProperties) -> Iterator[str]:
    kind = (
        "drive" if properties.is_drive else f"no drive (device type 0x{properties.device_type:08X})"
    )
    described = properties.described
    yield f"node {properties.node}: {kind}{', ' if described else ''}{described}"
    numbers = (properties.vendor, properties.product, properties.revision, properties.serial)
    identity = ["-" if number is None else f"0x{number:08X}" for number in numbers]
    yield "  vendor {}, product {}, revision {}, serial {}".format(*identity)
    if not properties.is_drive:
        return
    modes = [MODES.get(mode, str(mode)) for mode in properties.modes]
    yield f"  modes: {', '.join(modes) or 'not reported'}"
    for text, value in (
        ("encoder increments in one turn of the motor", properties.encoder_increments),
        ("motor turns for one shaft turn", properties.gear_ratio),
        ("counts in one turn of the shaft", properties.feed_counts),
        ("position, counts", properties.position_counts),
        ("least position, counts", properties.limit_min_counts),
        ("greatest position, counts", properties.limit_max_counts),
        ("following error window, counts", properties.window_counts),
        ("quick stop deceleration, counts/s^2", properties.quick_stop_counts_s2),
    ):
        if value is not None:
            yield f"  {text}: {value:.15g}"
    if properties.error_code:
        yield f"  error code 0x{properties.error_code:04X}"


def check(options: Namespace) -> None:
    """hodograph check."""
    machine = load_machine(options.file)
    require_fit(machine)
    address = bus_address(options.bus)
    findings: dict[str, list[Finding]] = {}
    with opened_bus(address, machine.bitrate) as network:
        require_no_controller(network, address)
        there = found_nodes(network, options.wait, machine.nodes)
        for axis in machine.axes:
            if axis.node in there:
                findings[axis.name] = check_axis(NodeReader(network, axis.node), axis, machine)
            else:
                text = f"node {axis.node} does not answer in {options.wait:g} s: power, wiring, node number, bit rate?"
                findings[axis.name] = [Finding(0x1000, 0, FAULT, text)]
    faults = {
        name: [one for one in found if one.verdict == FAULT] for name, found in findings.items()
    }
    if options.json:
        axes = [
            {
                "name": axis.name,
                "node": axis.node,
                "objects": [f.json() for f in findings[axis.name]],
            }
            for axis in machine.axes
        ]
        print_json({"bus": str(address), "able": not any(faults.values()), "axes": axes})
    else:
        for axis in machine.axes:
            _print_axis(f"axis {axis.name}, node {axis.node}", findings[axis.name], options.all)
    bad = [name for name, found in faults.items() if found]
    if bad:
        first = faults[bad[0]][0]
        raise BusError(
            f"{options.file}: {'axis' if len(bad) == 1 else 'axes'} {', '.join(bad)} cannot do what the machine "
            f"needs: {first.name}: {first.text}"
        )


def _print_axis(title: str, findings: list[Finding], everything: bool) -> None:
    count = sum(finding.verdict == OK for finding in findings)
    print(f"{title}: {count} of {len(findings)} objects are as needed")
    for finding in findings:
        if everything or finding.verdict != OK:
            value = "" if finding.value is None else f"0x{finding.value:X}"
            print(f"  {finding.verdict:<6}{finding.name:<13} {value:>12}  {finding.text}")


COMMANDS = {"scan": scan, "check": check}
