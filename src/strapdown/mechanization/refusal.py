"""Errors for a step that leaves the validity of a mechanization."""

from __future__ import annotations

from typing import NoReturn

import pandas as pd

from strapdown._kernels.ned import LARGEST_TURN, LEAP, POLE
from strapdown.errors import DivergenceError, Finding
from strapdown.tables import MOTION


def refuse_start(
    alt: float,
    speed: float,
    height_limits: tuple[float, float],
    largest_speed: float,
    source: str | None,
) -> None:
    """Refuse a start outside of the limits.

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
            "mechanization.state-begin-high-outside-or",
            file=source,
            quantity="state",
            alt=alt,
            speed=speed,
            lowest=lowest,
            highest=highest,
            largest_speed=largest_speed,
        )


def refuse_step(
    why: int, step: int, increments: pd.DataFrame, before: Finding | None, latitude_limit_deg: float
) -> NoReturn:
    """Raise the error of a step that a kernel refused.

    Parameters
    ----------
    why : int
        Code by the kernel's `verdict`.
    step : int
        Row of the increments, from 0.
    increments : DataFrame
        A MotionIncrements table.
    before : Finding or None
        Finding on the state before it; None at the first step.
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
            "mechanization.first-step-near-pole"
            if before is None
            else "mechanization.step-near-pole",
            file=source,
            quantity="lat",
            time=time,
            step=step + 1,
            latitude_limit_deg=latitude_limit_deg,
            before=before,
        )
    if why == LEAP:
        raise DivergenceError(
            "mechanization.first-step-too-far" if before is None else "mechanization.step-too-far",
            file=source,
            quantity="state",
            time=time,
            step=step + 1,
            at_row=row["dt"],
            largest_turn=LARGEST_TURN,
            before=before,
        )
    raise DivergenceError(
        "mechanization.first-step-diverges" if before is None else "mechanization.step-diverges",
        file=source,
        quantity="state",
        time=time,
        step=step + 1,
        increments=[f"{name} {row[name]:.4g}" for name in MOTION],
        before=before,
    )
