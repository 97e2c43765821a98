# SPDX-License-Identifier: MIT
"""The errors of this package; main turns them into a line on stderr and exit status 125. Used by vcan/. No I/O."""


class BusUnavailable(Exception):
    """There is no bus, or it has ended; the text has the reason and the remedy."""


class NameTaken(BusUnavailable):
    """A bus of this name is open already."""
