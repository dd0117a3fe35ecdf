"""Changes of velocity, as event data recorders keep them, as what accelerometers would have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from strapdown.formats.crash_velocity import mean_accelerations_of
from strapdown.systems.crash_draft.parts import Part

__all__ = ["as_accelerations"]

# 49 CFR 563.8, Table III: a change of velocity is kept to ±10 %.
RECORDER = {"scale_bound_percent": 10.0, "misalignment_sd_deg": 2.0}


def as_accelerations(part: Part) -> Part:
    """Mean accelerations over the intervals of a table of changes of velocity.

    Parameters
    ----------
    part : Part
        Of kind ``velocity``, with values in m/s.
    """
    time = part.time
    from_zero = bool(0.0 < time[0] <= 1.5 * (time[1] - time[0]))
    columns, stamps = [], time
    for k in range(3):
        stamps, mean = mean_accelerations_of(time, part.values[:, k], from_zero=from_zero)
        columns.append(mean)
    return replace(
        part,
        kind="acceleration",
        time=stamps,
        values=np.column_stack(columns),
        zeroed=True,
        sampling="",
        uncertainty=RECORDER,
        basis="what 49 CFR 563.8 asks of a recorder: 10 % of the change of velocity",
        notes=(*part.notes, "changes of velocity; mean accelerations are made of them"),
    )
