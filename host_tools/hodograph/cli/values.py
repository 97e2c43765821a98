# SPDX-License-Identifier: MIT
"""Values on the command line: from their text, with a message that says what is wrong with it."""

from __future__ import annotations

import argparse
import math
import re


def finite(text: str) -> float:
    """A finite number on the command line."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f'"{text}" is not a number') from None
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f'"{text}" is not finite')
    return value


def seconds(text: str) -> float:
    """A time above zero."""
    value = finite(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f'"{text}" is not a time above 0')
    return value


def positive(text: str) -> float:
    """A number above zero."""
    value = finite(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f'"{text}" is not a number above 0')
    return value


def node_or_own(text: str) -> int:
    """A node number, or 0."""
    if not text.isdigit() or int(text) > 127:
        raise argparse.ArgumentTypeError(f'"{text}" is not a node number from 1 to 127, or 0')
    return int(text)


def percentage(text: str) -> int:
    """A feed override."""
    if not text.isdigit() or int(text) > 200:
        raise argparse.ArgumentTypeError(f'"{text}" is not a whole number from 0 to 200')
    return int(text)


def count(text: str) -> int:
    """A number of things."""
    if not text.isdigit() or int(text) > 100_000:
        raise argparse.ArgumentTypeError(f'"{text}" is not a whole number from 0 to 100000')
    return int(text)


def at_least_one(text: str) -> int:
    """A number of things of which there must be one."""
    if not text.isdigit() or not 1 <= int(text) <= 1000:
        raise argparse.ArgumentTypeError(f'"{text}" is not a whole number from 1 to 1000')
    return int(text)


def part(text: str) -> tuple[int, int]:
    """One of several equal parts."""
    match = re.fullmatch(r"(\d{1,3})/(\d{1,3})", text)
    if match is None or not 1 <= int(match[1]) <= int(match[2]):
        raise argparse.ArgumentTypeError(f'"{text}" is no part such as 1/2')
    return int(match[1]), int(match[2])


def node_number(text: str) -> int:
    """A CANopen node number."""
    if not text.isdigit() or not 1 <= int(text) <= 127:
        raise argparse.ArgumentTypeError(f'"{text}" is not a node number (1 to 127)')
    return int(text)


def port_number(text: str) -> int:
    """A TCP port that an ordinary user may serve."""
    if not text.isdigit() or not 1 <= int(text) <= 65535:
        raise argparse.ArgumentTypeError(f'"{text}" is not a port (1 to 65535)')
    return int(text)
