"""Why a run stops: the step that leaves the range of a mechanization, in words."""

from __future__ import annotations

from typing import NoReturn

import pandas as pd

from strapdown._kernels.ned import LARGEST_TURN, LEAP, POLE
from strapdown.exceptions import DivergenceError
from strapdown.tables import MOTION


def refuse_start(
    alt: float,
    speed: float,
    height_limits: tuple[float, float],
    largest_speed: float,
    source: str | None,
) -> None:
    """Refuse a state that was outside of the limits before any step.

    Parameters
    ----------
    alt : float, m
    speed : float, m/s
    height_limits : tuple of float, m
    largest_speed : float, m/s
    source : str or None
        Name for the message.

    Raises
    ------
    DivergenceError
        The state is outside of the limits.
    """
    lowest, highest = height_limits
    if speed > largest_speed or not lowest <= alt <= highest:
        raise DivergenceError(
            f"the state to begin with, {alt:.6g} m high and at {speed:.6g} m/s, is "
            f"outside of {lowest:g} to {highest:g} m, or above {largest_speed:g} m/s",
            file=source,
            quantity="state",
            remedy="give the height over the ellipsoid in m and the velocity in m/s, or other "
            "height_limits or largest_speed",
        )


def refuse_step(
    why: int, step: int, increments: pd.DataFrame, before: str, latitude_limit_deg: float
) -> NoReturn:
    """Refuse a step that a kernel did not make.

    Parameters
    ----------
    why : int
        What the kernel's `verdict` said of it.
    step : int
        Row of the increments, from 0.
    increments : DataFrame
        A MotionIncrements table.
    before : str
        The state before it in words, or nothing.
    latitude_limit_deg : float, deg

    Raises
    ------
    DivergenceError
        Always.
    """
    time = float(increments.index[step])
    row = increments.iloc[step]
    source = increments.attrs.get("source")
    if why == POLE:
        raise DivergenceError(
            f"the sample at {time:.9g} s (step {step + 1}) comes nearer to a pole than "
            f"{latitude_limit_deg:g} deg of latitude{before}: north, and every angle from "
            "it, changes too fast there",
            file=source,
            quantity="lat",
            remedy="end the run before it, or navigate with WanderAzimuth, which knows no "
            "pole; north-east-down has no meaning there",
        )
    if why == LEAP:
        raise DivergenceError(
            f"with the sample at {time:.9g} s (step {step + 1}, of {row['dt']:.4g} s) the "
            f"place moves by more than {LARGEST_TURN:g} rad around the Earth{before}",
            file=source,
            quantity="state",
            remedy="a step so long has no course between its ends: cut the log there",
        )
    given = ", ".join(f"{name} {row[name]:.4g}" for name in MOTION)
    raise DivergenceError(
        f"the state has diverged with the sample at {time:.9g} s (step {step + 1}: {given})"
        f"{before}",
        file=source,
        quantity="state",
        remedy="look at this sample and those before it: units (rad/s, m/s²), the sign of "
        "gravity (-9.8 on z at level rest), a burst; at the start: an attitude in rad; or a "
        "sensor too poor for so long a run, whose bias is best taken off at a rest, or a free "
        "height over an hour",
    )
