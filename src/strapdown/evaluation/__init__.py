"""Evaluation of results: against truth, reference points, and each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.evaluation.position_references import dead_reckon as dead_reckon
    from strapdown.evaluation.trajectory_differences import ROTATION_ERROR as ROTATION_ERROR
    from strapdown.evaluation.trajectory_differences import (
        trajectory_differences as trajectory_differences,
    )


load_on_first_use(
    __name__,
    {
        "position_references": "dead_reckon",
        "trajectory_differences": "ROTATION_ERROR trajectory_differences",
    },
)
