"""Errors of one measuring point that a comparison with the others would not show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from strapdown import rotation
from strapdown.crash.consistency import (
    UnitComparison,
    VelocityIncrements,
    body_turning,
    clipped_pieces,
    compare_pair,
    velocity_increments,
)
from strapdown.crash.measuring_point import PointKinematics
from strapdown.crash.structure import unlearnt
from strapdown.errors import Finding

#: A gross scale factor, a position and a mounting that a tape and an eye would make.
SCALE, POSITION, TURNED_DEG = 1.25, 0.25, 5.0


def wrong_ones(one: VelocityIncrements) -> dict[str, VelocityIncrements]:
    """Increments of a unit with each of the errors that are tried, by the codes of their names."""
    opposite = np.eye(3)
    # Along the horizontal axis that changed most.
    main = int(np.argmax(np.abs(one.values[:, :2].sum(axis=0))))
    opposite[main, main] = -1.0
    values = {
        "crash.wrong-sign": one.values @ opposite.T,
        "crash.wrong-axes": one.values @ np.eye(3)[[1, 0, 2]].T,
        "crash.wrong-scale": one.values @ np.diag([SCALE, SCALE, 1.0]).T,
        "crash.wrong-position": one.values,
        "crash.wrong-heading": one.values
        @ rotation.dcm_from_rotation_vector([0.0, 0.0, np.radians(TURNED_DEG)]).T,
    }
    turning = body_turning((one,))
    if turning is not None:
        off = (turning.lever @ (POSITION * np.array([1.0, 1.0, 0.0]))).reshape(-1, 3)
        values["crash.wrong-position"] = one.values + off
    return {code: replace(one, values=moved) for code, moved in values.items()}


def undetectable(
    units: Sequence[PointKinematics], comparison: UnitComparison, level: float = 1e-3
) -> list[Finding]:
    """State the errors that a comparison of agreeing units would not detect.

    Each of `wrong_ones` is put into the record of one unit after another, which is then compared
    with the others as in `compare_units`, structure and turning learnt anew. One that a unit could
    have without a contradiction is listed. Errors common to all units never show: their records
    are those of another crash.

    Parameters
    ----------
    units : sequence of PointKinematics
        As compared.
    comparison : UnitComparison
    level : float
        Probability below which a pair disagrees.

    Returns
    -------
    list of Finding
        One note, or none where the units disagree.
    """
    if not comparison.agree:
        return []
    edges, rigid = comparison.edges, unlearnt(units)
    increments = [velocity_increments(u, edges) for u in units]
    cut = [clipped_pieces(u, edges) for u in units]
    tried = [wrong_ones(one) for one in increments]
    hidden = []
    for code in tried[0]:
        for k, unit in enumerate(units):
            pairs = (
                compare_pair(
                    *(unit, other, tried[k][code], increments[j], ~(cut[k] | cut[j]), level, rigid),
                    explained=False,
                )
                for j, other in enumerate(units)
                if j != k
            )
            if all(p.agree and all(f.severity == "note" for f in p.findings) for p in pairs):
                hidden.append(Finding(code, severity="note"))
                break
    return [
        Finding(
            "crash.not-detectable-with-these-points",
            severity="note",
            file=", ".join(u.name for u in units),
            quantity="comparison",
            hidden=[*hidden, Finding("crash.wrong-alike", severity="note")],
        )
    ]
