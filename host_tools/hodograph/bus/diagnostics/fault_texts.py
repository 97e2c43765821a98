# SPDX-License-Identifier: MIT
"""Texts of emergency error codes (CiA 301 table 26, CiA 402-2, and 0xFFxx of this project): the fault and its remedy.
After the remedy, `hodograph reset` resets the fault. Used by diagnostics/texts. No I/O.

Single codes come before the classes that contain them. The codes that the controller (firmware/app/machine/fault.h)
and the simulated drives (firmware/canopen/emcy.h) can raise are all single codes here.
"""

from __future__ import annotations

from dataclasses import dataclass

from .drive_states import state_of_statusword


@dataclass(frozen=True)
class FaultText:
    """One phrase each, without a full stop."""

    text: str
    remedy: str


_SINGLE = {
    0x1000: (
        "generic error of a drive",
        "read what the drive itself says (its display, its error history 0x1003)",
    ),
    0x2310: (
        "overload: the motor's current was too high for too long (I2t)",
        "look for a jammed axis, lower feed or acceleration, let the motor cool down",
    ),
    0x2320: ("short circuit or earth leakage", "check motor, motor cable and their insulation"),
    0x2350: (
        "overload: thermal state of the motor (I2t)",
        "lower feed or acceleration, let the motor cool down",
    ),
    0x3110: ("mains over-voltage", "check the supply of the drive"),
    0x3120: ("mains under-voltage", "check the supply of the drive, its fuses and contactors"),
    0x3130: ("a mains phase is missing", "check the supply of the drive and its fuses"),
    0x3210: (
        "DC link over-voltage",
        "check the supply and the brake resistor; lower the quick stop deceleration",
    ),
    0x3220: (
        "DC link under-voltage",
        "switch the drive's power on, check supply and emergency stop",
    ),
    0x4210: ("the drive is too hot", "let it cool down, check fans and filters"),
    0x4310: ("the motor is too hot", "let it cool down, lower feed or acceleration"),
    0x6100: (
        "internal software error",
        "note code, node and detail and report it; restart the controller if it comes again",
    ),
    0x7121: ("the motor is blocked", "look for a collision or a closed brake"),
    0x7122: (
        "motor or commutation error",
        "check the motor's wiring and the drive's commissioning",
    ),
    0x7300: ("position sensor", "check encoder and encoder cable; home the axis anew"),
    0x7305: (
        "encoder fault: the position is not to be trusted",
        "check encoder and encoder cable; home the axis anew",
    ),
    0x7306: ("second encoder fault", "check encoder and encoder cable; home the axis anew"),
    0x8100: ("communication", "check CAN cable, termination and bit rate of all nodes"),
    0x8110: (
        "CAN overrun: frames were lost",
        "look for other traffic on the bus (hodograph status shows the load), take it away",
    ),
    0x8120: (
        "CAN in error passive mode",
        "check CAN cable, termination (120 ohms at both ends) and bit rate",
    ),
    0x8130: (
        "no heartbeat within the monitoring time",
        "is the drive powered and connected, is the controller running? check the CAN cable",
    ),
    0x8140: (
        "recovered from bus-off",
        "check CAN cable, termination (120 ohms at both ends) and bit rate",
    ),
    0x8210: (
        "a PDO was too short",
        "another node sends under this identifier: look with candump, take it away",
    ),
    0x8240: ("SYNC has an unexpected length", "another SYNC producer is on the bus: switch it off"),
    0x8250: (
        "expected PDOs were not received",
        "is the drive powered and connected? check the CAN cable and the bus load; "
        "on a slow host raise answer_wait_ms and setpoint_timeout_ms in the machine file",
    ),
    0x8311: ("torque above its limit", "look for a collision, lower feed or acceleration"),
    0x8480: ("speed out of bounds", "lower the feed, check the encoder"),
    0x8611: (
        "following error: the axis does not follow its setpoints",
        "look for a jammed axis, lower feed or acceleration, or widen the following error window",
    ),
    0x8612: (
        "position limit: the axis is at the end of its travel or on a limit switch",
        "move the axis off the limit, check travel and work offset in the machine file",
    ),
    0x8700: (
        "SYNC lost: the drive received none within its time",
        "is the controller running? check the CAN cable",
    ),
    0xFF00: (
        "manufacturer specific error",
        "read the error history of the drive (0x1003) and its manual",
    ),
    0xFF01: (
        "the drive did not switch on in time",
        "is its power stage fed and its enable input on? read the drive's error code",
    ),
    0xFF02: (
        "the drive left operation enabled by itself",
        "check emergency stop, enable input and power of the drive, read its error code",
    ),
    0xFF03: ("the drive restarted by itself", "check its supply; home the axis anew"),
    0xFF04: (
        "the drive no longer follows its controlword (remote bit off)",
        "switch its local operation or its commissioning tool off",
    ),
    0xFF05: (
        "the drive is enabled but does not follow its target",
        "check mode and limits of the drive (its internal limits, a limit switch)",
    ),
    0xFF06: (
        "the drive did not end its quick stop in time",
        "check quick stop deceleration 0x6085 and reaction 0x605A of the drive",
    ),
    0xFF07: (
        "the bus takes no frames from the controller",
        "check CAN cable and termination: is any other node powered? check the bus load",
    ),
    0xFF08: (
        "the axis is not where its setpoints are, and its drive does not say why",
        "look for a jammed axis; another node may have changed the drive's PDOs: look with candump; "
        "a drive that lags behind by design needs following_window_mm in the machine file",
    ),
    0xFF09: (
        "no SYNC for longer than real drives can interpolate: the axes left the path",
        "give the controller real-time priority (docs/guides/machine.md section 3) and an idle processor; home "
        "if in doubt",
    ),
    0xFF0A: (
        "a stop along the path took longer than the program says",
        "compile the program again; if it comes again, report a bug",
    ),
    0xFF0B: (
        "the main loop of the controller did not run for 1 s while axes moved",
        "give the controller's computer some processor time; if it comes again, report a bug",
    ),
    0xFF10: (
        "the drive did not take the mode for homing, or the one for motion after it",
        "has the drive a homing mode (0x6502)? switch its local operation off",
    ),
    0xFF11: (
        "the drive reports that homing failed",
        "check home and limit switches and the homing method, read the drive's error code",
    ),
    0xFF12: (
        "homing did not end in time",
        "check home and limit switches, homing method and homing speeds",
    ),
}

_CLASSES = (
    (0xFF00, 0x0000, "no error", "nothing needs to be done"),
    (
        0xF000,
        0x1000,
        "generic error",
        "read the error history of the drive (0x1003) and its manual",
    ),
    (
        0xFF00,
        0x2100,
        "current on the device's input side",
        "check the supply of the drive and its fuses",
    ),
    (
        0xFF00,
        0x2200,
        "current inside the device",
        "switch the drive off and on; have it checked if it comes again",
    ),
    (
        0xFF00,
        0x2300,
        "current on the device's output side",
        "check motor and motor cable, look for a jammed axis",
    ),
    (0xF000, 0x2000, "current", "check motor, motor cable and supply, look for a jammed axis"),
    (0xFF00, 0x3100, "mains voltage", "check the supply of the drive"),
    (0xFF00, 0x3200, "voltage inside the device", "check the supply of the drive"),
    (0xFF00, 0x3300, "output voltage", "check motor and motor cable"),
    (0xF000, 0x3000, "voltage", "check the supply of the drive"),
    (0xFF00, 0x4100, "ambient temperature", "cool the cabinet, check fans and filters"),
    (0xF000, 0x4000, "temperature", "let drive and motor cool down, check fans and filters"),
    (
        0xF000,
        0x5000,
        "device hardware",
        "switch the drive off and on; have it checked if it comes again",
    ),
    (
        0xFF00,
        0x6300,
        "data set: parameters of the drive",
        "check the drive's parameters, restore them from its backup",
    ),
    (
        0xF000,
        0x6000,
        "device software",
        "switch the drive off and on; check its firmware and parameters",
    ),
    (0xFF00, 0x7100, "power module, brake or motor", "check motor, brake and their wiring"),
    (0xFF00, 0x7300, "sensor", "check encoder and encoder cable; home the axis anew"),
    (0xF000, 0x7000, "additional modules", "check the modules plugged into the drive"),
    (0xFF00, 0x8100, "communication", "check CAN cable, termination and bit rate of all nodes"),
    (
        0xFF00,
        0x8200,
        "protocol error",
        "another node may use the same identifiers: look with candump",
    ),
    (0xFF00, 0x8300, "torque control", "look for a collision or a jammed axis"),
    (0xFF00, 0x8400, "velocity control", "lower the feed, check the encoder"),
    (0xFF00, 0x8500, "position control", "check encoder and gains of the drive"),
    (0xFF00, 0x8600, "positioning", "check travel, following error window and homing of the axis"),
    (0xFF00, 0x8700, "synchronisation", "is the controller running? check the CAN cable"),
    (
        0xF000,
        0x8000,
        "monitoring",
        "read the error history of the drive (0x1003) and its manual",
    ),
    (
        0xF000,
        0x9000,
        "external error",
        "check the inputs of the drive: emergency stop, external fault",
    ),
    (
        0xFF00,
        0xF000,
        "additional functions",
        "read the error history of the drive (0x1003) and its manual",
    ),
    (0xFF00, 0xFF00, "device specific error", "look the code up in the drive's manual"),
)


def known_code(code: int) -> bool:
    """Whether exactly this code has a text."""
    return code in _SINGLE


def fault_words(code: int) -> FaultText:
    """Text and remedy of a CANopen emergency error code, by its class when the code is not known."""
    if code in _SINGLE:
        return FaultText(*_SINGLE[code])
    for mask, value, text, remedy in _CLASSES:
        if code & mask == value:
            return FaultText(text, remedy)
    return FaultText(f"unknown error 0x{code:04X}", "look the code up in the drive's manual")


def fault_text(code: int) -> str:
    """The text alone."""
    return fault_words(code).text


_MISSED = 0x8250
"""Reported by the controller with a count, and by a drive, with 0."""
_COUNTS = {
    _MISSED: "positions missed in a row",
    0xFF07: "ticks in a row",
    0xFF08: "counts apart",
    0xFF09: "us",
    0xFF0A: "setpoint",
    0xFF0B: "us",
}
_PLAIN = (0x6100, 0xFF10)
_HEARTBEAT = 0x8130
_NMT_STATES = {0x04: "stopped", 0x7F: "pre-operational"}
"""Detail of a heartbeat fault: the state that the I/O module reports. A drive's own fault has its statusword."""


def detail_text(code: int, detail: int) -> str:
    """The detail in object 0x2003 sub 3 as text, by the code of the controller; empty: none. Mostly a statusword."""
    if code == _MISSED and not detail:
        return "the drive received no setpoints for setpoint_timeout_ms"
    if code in _COUNTS:
        return f"{detail} {_COUNTS[code]}"
    if not detail:
        return ""
    if code == _HEARTBEAT and detail in _NMT_STATES:
        return f"it sends heartbeats, but its NMT state is {_NMT_STATES[detail]}"
    if code in _PLAIN:
        return f"detail 0x{detail:X}"
    return f"statusword 0x{detail:04X}, {state_of_statusword(detail)}"
