# SPDX-License-Identifier: MIT
"""Feed along a path: profiles, plans inside limits, and the feed pieces of a program."""

from .request import ControllerLimits, FeedRequest, Limits

__all__ = ["ControllerLimits", "FeedRequest", "Limits"]
