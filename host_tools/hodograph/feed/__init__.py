# SPDX-License-Identifier: MIT
"""Feed along a path: profiles, plans inside limits, and the feed pieces of a program."""

from .limits import AxisLimits, ControllerLimits, FeedCap, Limits
from .path_planning import plan_path
from .pattern_search import SearchStep
from .pieces import FeedPiece, FeedPieces
from .plan import Excess, FeedPlan, Plan
from .planning import plan_feed
from .plant import Plant
from .request import FeedRequest

__all__ = [
    "AxisLimits",
    "ControllerLimits",
    "Excess",
    "FeedCap",
    "FeedPiece",
    "FeedPieces",
    "FeedPlan",
    "FeedRequest",
    "Limits",
    "Plan",
    "Plant",
    "SearchStep",
    "plan_feed",
    "plan_path",
]
