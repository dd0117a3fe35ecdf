"""The one table of update rules."""

from __future__ import annotations

from strapdown.estimation.adaptive_rule import AdaptiveRule
from strapdown.estimation.paper_update import PaperUpdate
from strapdown.estimation.robust_update import RobustUpdate

UPDATE_RULES: dict[str, type[RobustUpdate] | type[PaperUpdate] | type[AdaptiveRule]] = {
    "robust": RobustUpdate,
    "paper": PaperUpdate,
    "adaptive": AdaptiveRule,
}
