"""Rests as reference points: where a sensor lies still, gravity tells roll and pitch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.alignment.levelling import level
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import DataError
from strapdown.results.rests import RestStretch, SamePose
from strapdown.tables import references_table

Array = NDArray[np.float64]

__all__ = ["ACCEL_BIAS_SD", "same_pose_candidates", "tilt_references", "tilt_sd_deg"]

#: Standard deviation that is assumed for the bias of each accelerometer, m/s², by class of
#: sensor. Consumer: the MPU-6050 may be 50 mg off in x and y and 80 mg in z (data sheet 3.4,
#: section 6.2), taken as the ends of an even spread, 29 to 46 mg. The others are the usual order
#: of magnitude, 5 mg, 1 mg and 50 µg: state what your data sheet says instead.
ACCEL_BIAS_SD = {"consumer": 0.3, "industrial": 0.05, "tactical": 0.01, "navigation": 0.0005}

# Two poses count as one where gravity agrees to so many standard deviations of the noise, and
# to what nobody can put a thing back to by hand, or feel on a table.
SAME_SIGMAS = 3.0
LEAST_APART = 0.1  # deg


def tilt_sd_deg(
    rest: RestStretch, *, bias_sd: float = ACCEL_BIAS_SD["consumer"], gravity: float | None = None
) -> float:
    """How well the direction of gravity at a rest is known.

    Parameters
    ----------
    rest : RestStretch
        With acceleration.
    bias_sd : float, m/s²
        Standard deviation that is assumed for the bias of each accelerometer, as it is now in
        the log. One of `ACCEL_BIAS_SD`, or from a calibration.
    gravity : float, m/s², optional
        Local gravity; 9.80665 if not given, which is right to 0.03 m/s² everywhere on the
        surface.

    Returns
    -------
    float
        Root mean square of the angle by which the direction is off, in deg: two axes square to
        gravity, each off by ``sqrt(bias² + noise²)/g`` rad. The bias is the larger of what is
        assumed and of how far the length of the specific force is from gravity: the log may
        refute an assumption, and it cannot confirm one, since what is square to gravity does
        not change the length.

    Raises
    ------
    DataError
        The rest has no acceleration, or what it has is no gravity (20 %).
    """
    force, noise = _force(rest)
    g = STANDARD_GRAVITY if gravity is None else gravity
    size = float(np.sqrt(force @ force))
    bias = max(bias_sd, abs(size - g))
    return float(np.degrees(np.sqrt(2.0 * (bias / size) ** 2 + _across(force, noise))))


def tilt_references(
    rests: Sequence[RestStretch],
    *,
    bias_sd: float = ACCEL_BIAS_SD["consumer"],
    gravity: float | None = None,
    levelled_from: RestStretch | None = None,
) -> pd.DataFrame:
    """Make a reference point of every rest: its roll and pitch, the heading left open.

    Parameters
    ----------
    rests : sequence of RestStretch
        As `sensors.rest.find_rests` finds them; those without acceleration are left out.
    bias_sd, gravity
        As in `tilt_sd_deg`.
    levelled_from : RestStretch, optional
        The rest that the run was levelled from. It is left out: the run would be compared with
        its own start.

    Returns
    -------
    DataFrame
        A References table of kind ``tilt``, each at the middle of its rest;
        `evaluation.reference_points.score_references` compares a run with it. The biases of
        the accelerometers are the same in all rows, so that the errors of these references
        are not independent of each other, and cancel between rests of one pose where the run
        was levelled in that pose.

    Raises
    ------
    DataError
        As `tilt_sd_deg`.
    """
    rows: list[dict[str, object]] = []
    for rest in rests:
        if rest.accel_mean is None or (levelled_from is not None and _overlap(rest, levelled_from)):
            continue
        roll, pitch = level(rest.accel_mean)
        rows.append(
            {
                "time": _middle(rest),
                "kind": "tilt",
                "roll": roll,
                "pitch": pitch,
                "sd": tilt_sd_deg(rest, bias_sd=bias_sd, gravity=gravity),
            }
        )
    return references_table(rows, source="rests")


def same_pose_candidates(rests: Sequence[RestStretch]) -> tuple[SamePose, ...]:
    """Find rests at which the sensor may have lain as at an earlier one.

    Parameters
    ----------
    rests : sequence of RestStretch
        In order of time.

    Returns
    -------
    tuple of SamePose
        For each rest the earliest one whose direction of gravity agrees with it, within three
        standard deviations of the noise of both (the biases of the accelerometers are the same
        in both and cancel) or 0.1 deg, whichever is more. They are offered and never used:
        gravity does not tell heading, and only who moved the sensor knows that.
    """
    found: list[SamePose] = []
    lying = [r for r in rests if r.accel_mean is not None]
    for number, rest in enumerate(lying):
        for earlier in lying[:number]:
            apart, sd = _apart(rest, earlier)
            if apart <= max(SAME_SIGMAS * sd, LEAST_APART):
                at, since = f"{_middle(rest):.2f}", f"{_middle(earlier):.2f}"
                found.append(
                    SamePose(
                        _middle(rest),
                        _middle(earlier),
                        apart,
                        sd,
                        f"{at} same as {since}",
                        f"gravity agrees to {apart:.2g}°; that the heading does, too, is "
                        "assumed: use it only where the sensor was put back",
                    )
                )
                break
    return tuple(found)


def _middle(rest: RestStretch) -> float:
    return 0.5 * (rest.start + rest.end)


def _overlap(a: RestStretch, b: RestStretch) -> bool:
    return a.start <= b.end and b.start <= a.end


def _force(rest: RestStretch) -> tuple[Array, Array]:
    if rest.accel_mean is None:
        raise DataError(
            "evaluation.rest-no-acceleration", quantity="accel", start=rest.start, end=rest.end
        )
    level(rest.accel_mean)
    noise = rest.accel_mean_sd or rest.accel_sd or (0.0, 0.0, 0.0)
    return np.array(rest.accel_mean), np.array(noise)


def _apart(a: RestStretch, b: RestStretch) -> tuple[float, float]:
    """Angle between the directions of gravity at two rests, and its sd by the noise, deg."""
    (f_a, n_a), (f_b, n_b) = _force(a), _force(b)
    cross = np.cross(f_a, f_b)
    angle = float(np.arctan2(np.sqrt(cross @ cross), f_a @ f_b))
    variance = _across(f_a, n_a) + _across(f_b, n_b)
    return float(np.degrees(angle)), float(np.degrees(np.sqrt(variance)))


def _across(force: Array, noise: Array) -> float:
    """Variance of the direction of a force, both axes square to it together, rad²."""
    up = force / np.sqrt(force @ force)
    # What of the noise is square to the force: |n|² less the part along it.
    return float(((noise**2).sum() - ((up * noise) ** 2).sum()) / (force @ force))
