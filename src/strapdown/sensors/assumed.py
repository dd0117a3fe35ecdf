"""What is taken of a vehicle where a unit does not measure it, and how uncertain that is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError
from strapdown.sensors.triad_errors import Triad
from strapdown.sensors.triad_numbers import finite, triple

Array = NDArray[np.float64]

__all__ = ["SHAPES", "Assumed", "assumed_shapes"]

#: Of the two shapes in time, in the order of `assumed_shapes`, for the names of unknowns.
SHAPES = ("by the end", "on the way")
# A random walk that is known at its end is known to half of that half way.
ON_THE_WAY = 0.5
# A vehicle that has turned farther is not near to "not turning", and linear bounds end there.
MOST_TURN = 45.0  # deg
# No road vehicle changes its velocity by more in a crash.
MOST_CHANGE = 60.0  # m/s
# An assumption for longer than this is none about an impact.
LONGEST = 10.0  # s


@dataclass(frozen=True)
class Assumed:
    """What is taken for the axes that a unit has no sensor on.

    Attributes
    ----------
    turn_sd_deg : float or triad, deg, optional
        Where there is no gyro the vehicle is taken not to turn. Standard deviation of what each
        of roll, pitch and heading has changed by at the end of `over`. None: a missing gyro is
        refused.
    delta_v_sd : float or triad, m/s, optional
        Where there is no accelerometer along an axis, the specific force along it is taken as
        gravity's in the attitude of the vehicle at rest, and no more, at the point that is
        reconstructed. Standard deviation of the change of velocity along it over `over`; three
        numbers are for the vehicle's forward, right, down. None: a missing axis is refused.
    over : (float, float), s
        From the trigger: when that may happen. What the vehicle does before and after is in no
        bound.
    because : str
        Why it may be assumed, in words of the person who does, for the report.

    Raises
    ------
    ConfigError
        Neither is given, a number is negative or not finite, a turn is beyond 45 deg or a change
        beyond 60 m/s, or `over` is no stretch of up to 10 s.

    Notes
    -----
    In time, what an axis turns (or gains) is the sum of two independent unknowns. One grows by
    ``u - sin(2 pi u) / (2 pi)``, the integral of a haversine, with u from 0 to 1 over `over`; it
    has the stated standard deviation at the end. Alone it would say that half way half of the turn
    was done, no more and no less: a turn that comes early, or a dip that comes back, would do more
    to the velocity than any bound has, since a crash pulse acts when it acts. So another goes there
    and back, by ``sin²(pi u)``, with half the standard deviation at the middle: as much as remains
    unknown of a random walk half way when its end is known. The standard deviation in the middle is
    then 0.71 of that at the end, that of a random walk as well.
    """

    turn_sd_deg: float | Triad | None = None
    delta_v_sd: float | Triad | None = None
    over: tuple[float, float] = (0.0, 0.15)
    because: str = ""

    def __post_init__(self) -> None:
        if self.turn_sd_deg is None and self.delta_v_sd is None:
            raise ConfigError("sensors.nothing-assumed", quantity="assumed")
        turns, axes = ("roll", "pitch", "heading"), ("forward", "right", "down")
        for name, said in (
            ("turn_sd_deg", {"unit": "deg", "axes": turns, "most": MOST_TURN}),
            ("delta_v_sd", {"unit": "m/s", "axes": axes, "most": MOST_CHANGE}),
        ):
            given = getattr(self, name)
            if given is not None:
                object.__setattr__(self, name, _sds(given, name, said))
        object.__setattr__(self, "over", _stretch(self.over))
        if not isinstance(self.because, str):
            raise ConfigError(
                "sensors.reason-not-text",
                quantity="assumed, because",
                name=type(self.because).__name__,
            )

    def sd_of(self, name: str) -> Triad:
        """Return ``turn_sd_deg`` or ``delta_v_sd`` as three numbers; zeros where it is None."""
        value: Triad | None = getattr(self, name)
        return (0.0, 0.0, 0.0) if value is None else value


def assumed_shapes(time: Array, over: tuple[float, float], sampling: str) -> Array:
    """Rates of the two shapes at the samples, for one standard deviation of one at the end.

    Parameters
    ----------
    time : ndarray, (n,), s
    over : (float, float), s
    sampling : {'instantaneous', 'mean'}

    Returns
    -------
    ndarray, (2, n), 1/s
        Means over the interval that ends at the stamp, or about it, so that their sum times
        the step is exact, even where few samples are in `over`.
    """
    steps = np.diff(time, prepend=2.0 * time[0] - time[1])
    after = np.append(steps[1:], steps[-1])
    if sampling == "mean":
        begin, end = time - steps, time
    else:
        begin, end = time - 0.5 * steps, time + 0.5 * after
    return np.asarray((_grown(end, over) - _grown(begin, over)) / (end - begin))


def _grown(time: Array, over: tuple[float, float]) -> Array:
    """What both shapes have come to, (2, n)."""
    u = np.clip((time - over[0]) / (over[1] - over[0]), 0.0, 1.0)
    whole = u - np.sin(2.0 * np.pi * u) / (2.0 * np.pi)
    return np.array([whole, ON_THE_WAY * np.sin(np.pi * u) ** 2])


def _sds(given: object, name: str, limits: dict[str, Any]) -> Triad:
    if finite(given):
        given = (given, given, given)
    quantity = f"assumed, {name}"
    numbers = triple(given, quantity, "sensors.assumed-not-three-numbers", **limits)
    if any(x < 0.0 or x > limits["most"] for x in numbers):
        raise ConfigError(
            "sensors.assumed-out-of-range", quantity=quantity, given=repr(given), **limits
        )
    return numbers


def _stretch(given: object) -> tuple[float, float]:
    try:
        start, end = (float(x) for x in given)  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        start = end = math.nan
    if not (math.isfinite(start) and math.isfinite(end) and 0.0 < end - start <= LONGEST):
        raise ConfigError(
            "sensors.no-stretch", quantity="assumed, over", given=given, longest=LONGEST
        )
    return start, end
