"""Reference points of position compared with what a run dead-reckons between rests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.evaluation.dead_reckoning import dead_reckon
from strapdown.evaluation.place_references import PlaceReference
from strapdown.results.rests import RestStretch
from strapdown.results.runs import AttitudeRun
from strapdown.results.scores import PositionScore

Array = NDArray[np.float64]

__all__ = ["SensorErrors", "score_places"]

# A word that is rounded to a tenth, or said at the edge of a window, still means the rest.
NEAR_REST = 0.5  # s


@dataclass(frozen=True)
class SensorErrors:
    """What is assumed of the sensors and the start, for the sd of a position.

    Attributes
    ----------
    accel_bias_sd : float, m/s²
        Of each accelerometer, constant in the body (`rest_references.ACCEL_BIAS_SD`).
    gyro_bias_sd : float, rad/s
        What is left of the bias of each gyro, constant over the log.
    tilt_sd_deg : float, deg
        Of the initial attitude about each horizontal axis, over and above what levelling with
        biased accelerometers does.
    accel_noise : float or None, m/s²/√Hz
        White noise of each accelerometer; from the scatter at the rests where it is None.
    levelled : bool
        The run was levelled with these accelerometers where it begins: their biases then tilt
        the start, so that they cancel as long as the body keeps that pose.
    """

    accel_bias_sd: float = 0.3
    gyro_bias_sd: float = 2e-4
    tilt_sd_deg: float = 0.0
    accel_noise: float | None = None
    levelled: bool = True


def score_places(
    run: AttitudeRun,
    places: Sequence[PlaceReference],
    imu: pd.DataFrame,
    rests: Sequence[RestStretch],
    *,
    errors: SensorErrors | None = None,
    gravity: float | None = None,
) -> tuple[PositionScore, ...]:
    """Compare the displacements of a run with what is known of them.

    Parameters
    ----------
    run : AttitudeRun
    places : sequence of PlaceReference
    imu : DataFrame
        The Imu table that the run used, with acceleration.
    rests : sequence of RestStretch
        In order of time; every instant of `places` lies in one or within half a second of it.
    errors : SensorErrors, optional
        For the sd of the position; a consumer sensor if not given.
    gravity : float, m/s², optional
        As in `dead_reckon`.

    Returns
    -------
    tuple of PositionScore
        Rests between the two instants are used: the velocity begins anew at each.

    Raises
    ------
    DataError
        An instant is not at a rest, two are at the same one, or as `dead_reckon`.
    """
    assumed = errors or SensorErrors()
    return tuple(
        _score(run, place, imu, list(rests)[slice(*_between(place, rests))], assumed, gravity)
        for place in places
    )


def _between(place: PlaceReference, rests: Sequence[RestStretch]) -> tuple[int, int]:
    found = []
    for at in (place.since, place.time):
        near = [max(r.start - at, at - r.end, 0.0) for r in rests]
        if not near or min(near) > NEAR_REST:
            known = ", ".join(f"{r.start:.2f}-{r.end:.2f}" for r in rests) or "none was found"
            raise DataError(
                "evaluation.names-no-rest-rests",
                quantity="reference",
                place=place,
                at=at,
                known=known,
            )
        found.append(int(np.argmin(near)))
    if found[0] == found[1]:
        rest = rests[found[0]]
        raise DataError(
            "evaluation.names-two-instants-rest",
            quantity="reference",
            place=place,
            start=rest.start,
            end=rest.end,
        )
    return found[0], found[1] + 1


def _score(
    run: AttitudeRun,
    place: PlaceReference,
    imu: pd.DataFrame,
    rests: list[RestStretch],
    errors: SensorErrors,
    gravity: float | None,
) -> PositionScore:
    legs = [
        dead_reckon(run, imu, a, b, gravity=gravity, levelled=errors.levelled)
        for a, b in pairwise(rests)
    ]
    moved = np.sum([leg.position[-1] for leg in legs], axis=0)
    corrected = np.sum([leg.position_corrected[-1] for leg in legs], axis=0)
    ends = [float(np.sqrt(np.square(leg.velocity[-1]).sum())) for leg in legs]
    worst = legs[int(np.argmax(ends))]
    noise = errors.accel_noise if errors.accel_noise is not None else _density(rests, imu)
    expected = np.array(place.moved)
    raw = [(leg.position_by_bias, leg.position_by_tilt, leg.seconds**3 / 3.0) for leg in legs]
    mended = [
        (
            leg.position_by_bias - leg.velocity_by_bias * (0.5 * leg.seconds),
            leg.position_by_tilt - leg.velocity_by_tilt * (0.5 * leg.seconds),
            leg.seconds**3 / 12.0,
        )
        for leg in legs
    ]
    at_end = [(worst.velocity_by_bias, worst.velocity_by_tilt, worst.seconds)]
    return PositionScore(
        algorithm=run.algorithm,
        against=str(place),
        time=place.time,
        since=place.since,
        legs=len(legs),
        seconds=sum(leg.seconds for leg in legs),
        moved_m=_triple(moved),
        moved_corrected_m=_triple(corrected),
        expected_m=place.moved,
        error_m=float(np.linalg.norm(moved - expected)),
        corrected_error_m=float(np.linalg.norm(corrected - expected)),
        end_velocity_m_s=max(ends),
        sd_m=_sd(raw, errors, noise),
        corrected_sd_m=_sd(mended, errors, noise),
        end_velocity_sd_m_s=_sd(at_end, errors, noise),
        reference_sd_m=place.sd,
        gravity_m_s2=legs[0].gravity,
    )


def _sd(parts: list[tuple[Array, Array, float]], errors: SensorErrors, noise: float) -> float:
    """Root mean square length: biases and tilt are the same in all parts, noise is not."""
    by_bias = np.sum([p[0] for p in parts], axis=0)
    by_tilt = np.sum([p[1] for p in parts], axis=0)
    of_bias = np.repeat([errors.accel_bias_sd, errors.gyro_bias_sd], 3)
    variance = np.square(by_bias * of_bias).sum()
    variance += np.square(by_tilt * np.radians(errors.tilt_sd_deg)).sum()
    variance += 3.0 * noise**2 * sum(p[2] for p in parts)
    return float(np.sqrt(variance))


def _density(rests: list[RestStretch], imu: pd.DataFrame) -> float:
    """White noise of an accelerometer, from the quietest of the rests: sd times √(step)."""
    scatter = [float(np.mean(np.square(r.accel_sd))) for r in rests if r.accel_sd is not None]
    step = float(np.median(np.diff(imu.index.to_numpy(dtype=np.float64))))
    return float(np.sqrt(min(scatter, default=0.0) * step))


def _triple(values: Array) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])
