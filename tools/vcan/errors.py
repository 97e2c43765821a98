# SPDX-License-Identifier: MIT
"""The one error of this package; main turns it into a line on stderr and exit status 125."""


class BusUnavailable(Exception):
    """There is no bus, or it has ended; the text has the reason and the remedy."""
