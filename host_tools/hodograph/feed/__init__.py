# SPDX-License-Identifier: MIT
"""Plans the feed along a path inside limits: profiles, plans, and the feed pieces of a program. Used by all modules
that plan a feed or handle a plan. No I/O.

`feed/optimal` plans for least time. This package does not use machine files: limits come as `Limits`,
`ControllerLimits` and `AxisLimits`.
"""

from .limits import (
    AxisLimits,
    ControllerLimits,
    FeedZone,
    Limit,
    Limits,
    Peak,
    Plant,
    Plants,
    ReserveZone,
    ineffective_limits,
)
from .pieces import FeedPiece, FeedPieces
from .plan import FeedPlan, Replan
from .planning import plan_feed, plan_path, replan
from .ramp import SearchStep
from .request import FeedRequest

__all__ = [
    "AxisLimits",
    "ControllerLimits",
    "FeedPiece",
    "FeedPieces",
    "FeedPlan",
    "FeedRequest",
    "FeedZone",
    "Limit",
    "Limits",
    "Peak",
    "Plant",
    "Plants",
    "Replan",
    "ReserveZone",
    "SearchStep",
    "ineffective_limits",
    "plan_feed",
    "plan_path",
    "replan",
]
