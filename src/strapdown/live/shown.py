"""The newest state as a line: JSON or by commas."""

from __future__ import annotations

import json
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError
from strapdown.navigation.navigator import Navigator
from strapdown.navigation.piece import Mark
from strapdown.rotation.euler_angles import euler_sd
from strapdown.systems.sins.piece import ChainPiece
from strapdown.tables import EULER, GEODETIC, TRAJECTORY, VELOCITY
from strapdown.tables.columns import POSITION_SD, VELOCITY_SD

__all__ = ["LINE_FORMS", "StateLines"]

Array = NDArray[np.float64]
STATE = [*GEODETIC, *VELOCITY, *EULER]
SD = [*POSITION_SD, *VELOCITY_SD, *(f"{angle}_sd" for angle in EULER)]
LINE_FORMS = ("json", "csv")
# Decimals: 0.1 mm of a place, and as much of an angle at 6 km.
_FINE, _COARSE = 9, 6
_DECIMALS = {name: _FINE if name in ("lat", "lon") else _COARSE for name in (*STATE, *SD)}


class StateLines:
    """Writes a line for the newest state, at most every so many seconds of the record.

    Parameters
    ----------
    navigator : Navigator
    write : callable
        Takes a line with its end.
    form : {'json', 'csv'}
    every : float, s
        Of the stamps; zero for each sample.

    Raises
    ------
    ConfigError
        There is no such form.
    """

    def __init__(
        self,
        navigator: Navigator,
        write: Callable[[str], None],
        form: str = "json",
        every: float = 1.0,
    ) -> None:
        if form not in LINE_FORMS:
            raise ConfigError("live.unknown-line-form", quantity="--lines", form=form)
        if not 0.0 <= every < math.inf:
            raise ConfigError("live.bad-interval", quantity="--every", every=every)
        self._used, self._write, self._form, self._every = navigator, write, form, every
        self._next = -math.inf
        self._mark: Mark | None = None
        self._begun = False

    def take(self, piece: ChainPiece) -> None:
        """Take what came of a sample."""
        for navigation in piece.navigation:
            if navigation.marks:
                self._mark = navigation.marks[-1]
        # A stamp is a decimal fraction that was rounded.
        if not math.isfinite(piece.time) or piece.time < self._next - 1e-9:
            return
        self._next = piece.time + self._every
        told = {"time": round(piece.time, _FINE), "mode": piece.mode, **self._state(piece)}
        if self._form == "json":
            self._write(json.dumps(told) + "\n")
            return
        if not self._begun:
            self._write(",".join(told) + "\n")
            self._begun = True
        self._write(",".join("" if v is None else str(v) for v in told.values()) + "\n")

    def _state(self, piece: ChainPiece) -> dict[str, float | None]:
        rows = [one.history[-1:] for one in piece.navigation if len(one.history)]
        if not rows:
            return dict.fromkeys([*STATE, *SD])
        out = np.empty((1, len(TRAJECTORY)))
        self._used.filter.mechanization.fill_trajectory(rows[-1], out)
        state = dict(zip(TRAJECTORY, out[0].tolist(), strict=True))
        told: dict[str, float | None] = {n: round(state[n], _DECIMALS[n]) for n in STATE}
        if self._mark is None:
            return {**told, **dict.fromkeys(SD)}
        covariance = self._mark.covariance
        euler = np.array([state[angle] for angle in EULER])
        sd = np.sqrt(np.diagonal(covariance)[:6]).tolist()
        sd += euler_sd(euler, covariance[6:, 6:]).tolist()
        return {**told, **{n: round(v, _COARSE) for n, v in zip(SD, sd, strict=True)}}
