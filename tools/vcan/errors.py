# SPDX-License-Identifier: MIT
"""The one error of this package; main turns it into a line on stderr and exit status 125."""


class BusUnavailable(Exception):
    """There is no bus, or no longer; the text says why and what to do."""
