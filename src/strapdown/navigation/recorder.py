"""Keeps of a run what is wanted of it, at the rate that is wanted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.navigation.navigator import Navigator
from strapdown.navigation.piece import NavigationPiece, Seen
from strapdown.navigation.record import NavigationRecord
from strapdown.tables import EULER, trajectory_error_table

__all__ = ["record_of"]

Array = NDArray[np.float64]


def record_of(
    navigator: Navigator, pieces: Sequence[NavigationPiece], source: str | None = None
) -> NavigationRecord:
    """Put the pieces of a run together, every sample of them.

    Parameters
    ----------
    navigator : Navigator
    pieces : sequence of NavigationPiece
        At least one sample and one mark.
    source : str, optional
        Name for messages.

    Returns
    -------
    NavigationRecord
    """
    used, model = navigator.filter.mechanization, navigator.filter.model
    trajectory = used.trajectory(
        np.concatenate([p.time for p in pieces]),
        np.concatenate([p.history for p in pieces]),
        source,
    )
    marks = [mark for piece in pieces for mark in piece.marks]
    time = pd.Index([mark.time for mark in marks], name="time")
    covariance = np.array([mark.covariance for mark in marks])
    sd = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    nearest = np.clip(trajectory.index.searchsorted(time), 0, len(trajectory) - 1)
    euler = trajectory[EULER].to_numpy()[nearest]
    labels = list(model.layout.labels())[-model.stacked.sd.size :]
    units = [one.block.unit for one in model.sensors for _ in one.block.labels]
    return NavigationRecord(
        trajectory=trajectory,
        sd=trajectory_error_table(
            time, sd[:, :3], sd[:, 3:6], rotation.euler_sd(euler, covariance[:, 6:, 6:]), source
        ),
        covariance=covariance,
        sensors=pd.DataFrame([m.sensors for m in marks], index=time, columns=labels),
        sensors_sd=pd.DataFrame([m.sensors_sd for m in marks], index=time, columns=labels),
        units=dict(zip(labels, units, strict=True)),
        innovations=innovations_by_name([one for piece in pieces for one in piece.seen]),
    )


def innovations_by_name(seen: Sequence[Seen]) -> dict[str, pd.DataFrame]:
    """Return innovations as tables, by name of the observation."""
    out = {}
    for name in dict.fromkeys(one.name for one in seen):
        those = [one for one in seen if one.name == name]
        labels = those[0].labels
        out[name] = pd.DataFrame(
            np.hstack(
                [
                    np.array([getattr(one.innovations, part) for one in those])
                    for part in ("nu", "s", "weight")
                ]
            ),
            index=pd.Index([one.time for one in those], name="time"),
            columns=[f"{part} {label}" for part in ("nu", "s", "weight") for label in labels],
        )
    return out
