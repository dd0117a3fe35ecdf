"""One record from several units at a common point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.levelling import level
from strapdown.crash.at_point import AtPoint
from strapdown.crash.combined_effects import SampleWeights, combine_effects
from strapdown.crash.mean_weights import by_none, crash_steps, force_weights
from strapdown.crash.sample_effects import SampleEffects, level_turned_by
from strapdown.crash.unit_differences import TINY
from strapdown.errors import ConfigError, DataError
from strapdown.results.rests import RestStretch
from strapdown.sensors.prepared_unit import Levelling
from strapdown.sensors.rest import LEAST_SAMPLES, rest_between
from strapdown.tables import imu_table

Array = NDArray[np.float64]

__all__ = ["COMBINATIONS", "combine_units"]

COMBINATIONS = ("weighted", "median")


def combine_units(units: Sequence[AtPoint], method: str = "weighted") -> AtPoint:
    """Combine units that were moved to one point.

    Parameters
    ----------
    units : sequence of AtPoint
        Of one vehicle, at one point; the stamps of the first are kept, where all have samples,
        and the others are interpolated linearly.
    method : {'weighted', 'median'}
        One weight a unit and axis for the whole record, by what each states of its change of
        velocity over the crash (`force_weights`): such a change of the mean lies between those of
        the units. Or, of three units or more, the median of each axis and sample, which one unit
        gone astray does not move far.

    Returns
    -------
    AtPoint
        With the unknowns of all its parts, each with the weight of its unit: one that two units
        share, as the bias of a borrowed gyro, is one. Rates are weighed by how well they tell the
        turn from 0.1 s before to 0.75 s after the trigger. It is
        level where the mean of its specific force at rest is, over what all have in common of
        their rests; without such, and where an attitude was stated, at the mean of theirs.

    Raises
    ------
    DataError
        There are fewer than two common samples.
    ConfigError
        There are too few units, the method is unknown, or a median has units with assumed axes.

    Notes
    -----
    Any weights that sum to one are right, with the effects of the mean made with them. Samples of
    a combination are taken for independent, though what the noise of the gyros does through a
    lever arm is not: this states more than there is.
    """
    if method not in COMBINATIONS:
        raise ConfigError(
            "crash.no-way-combine-units",
            quantity="method",
            method=method,
            combinations=COMBINATIONS,
        )
    if len(units) < 2 or (method == "median" and len(units) < 3):
        raise ConfigError(
            "crash.units-cannot-combined", quantity="units", count=len(units), method=method
        )
    if method == "median" and any(u.unmeasured is not None for u in units):
        raise ConfigError(
            "crash.median-takes-every-unit-value",
            file=next(u.name for u in units if u.unmeasured is not None),
            quantity="units",
        )
    time = _common_stamps(units)
    at = [_at(u, time) for u in units]
    force = np.array([u.force for u in at])
    if method == "weighted":
        weights = np.repeat(force_weights(at)[:, None], time.size, axis=1)
    else:
        weights = _median_weights(force)
    counted = _turning_measured(at)
    turning = _rate_weights(at, counted)
    kind = "weighted mean" if method == "weighted" else method
    name = f"{kind} of {', '.join(u.name for u in units)}"
    imu = imu_table(
        time,
        np.tensordot(turning, np.array([u.rate for u in at]), axes=1),
        np.einsum("unij,unj->ni", weights, force),
        sampling=str(units[0].imu.attrs["sampling"]),
        source=name,
    )
    common = _common_rest(units, time)
    if common is None:
        at_rest, rest = weights.mean(axis=1), None
    else:
        rest = rest_between(imu, *common, grade=units[0].rest.grade if units[0].rest else "stated")
        at_rest = weights[:, (time >= rest.start) & (time <= rest.end)].mean(axis=1)
    # A third of the trace: one number a unit that sums to one.
    share = np.trace(at_rest, axis1=1, axis2=2) / 3.0
    levelled = rest is not None and all(u.levelling.from_rest for u in units)
    parts = [_without_own_tilt(u) if levelled else u.effects for u in at]
    effects = combine_effects(
        parts,
        [
            SampleWeights(w, r, float(s), float(q))
            for w, r, s, q in zip(weights, at_rest, share, turning, strict=True)
        ],
    )
    mean = _mean_levelling(units, share)
    if levelled and rest is not None and rest.accel_mean is not None:
        roll, pitch = level(rest.accel_mean)
        mean = replace(mean, roll_deg=roll, pitch_deg=pitch)
        tilt = level_turned_by(effects.rest_force, _level(mean))
        effects = replace(effects, tilt=effects.tilt + tilt)
    return AtPoint(
        name,
        imu,
        effects,
        mean,
        rest,
        # The vehicle's own, which all units feel alike.
        float(share @ [u.rest_accel_sd for u in units]),
        unmeasured=by_none([u.unmeasured for u in units]),
        unmeasured_turns=by_none(
            [u.unmeasured_turns for u, counts in zip(units, counted, strict=True) if counts]
        ),
    )


def _turning_measured(units: Sequence[AtPoint]) -> NDArray[np.bool_]:
    """Which units measure the turning about the most axes: what others assume does not count."""
    assumed = [0.0 if u.unmeasured_turns is None else np.trace(u.unmeasured_turns) for u in units]
    return np.asarray(np.round(assumed) == np.round(min(assumed)))


def _common_stamps(units: Sequence[AtPoint]) -> Array:
    first = max(float(u.time[0]) for u in units)
    last = min(float(u.time[-1]) for u in units)
    time = units[0].time
    time = time[(time >= first) & (time <= last)]
    if time.size < 2:
        raise DataError("crash.units-share-samples", quantity="units", size=time.size)
    return time


def _at(unit: AtPoint, time: Array) -> AtPoint:
    """A unit at other stamps, on straight lines between its own."""
    own = unit.time
    if own.size == time.size and np.array_equal(own, time):
        return unit
    k = np.clip(np.searchsorted(own, time, side="right") - 1, 0, own.size - 2)
    part = ((time - own[k]) / (own[k + 1] - own[k]))[:, None]

    def at(values: Array) -> Array:
        return np.asarray((1.0 - part) * values[..., k, :] + part * values[..., k + 1, :])

    effects = unit.effects
    return replace(
        unit,
        imu=imu_table(
            time,
            at(unit.rate),
            at(unit.force),
            sampling=str(unit.imu.attrs["sampling"]),
            source=unit.name,
        ),
        # The noise of a value between two samples is less than theirs; theirs is kept.
        effects=replace(
            effects,
            force=at(effects.force),
            rate=at(effects.rate),
            force_noise=at(effects.force_noise),
            rate_noise=at(effects.rate_noise),
        ),
        moved=None,
    )


def _common_rest(units: Sequence[AtPoint], time: Array) -> tuple[float, float] | None:
    rests: list[RestStretch] = [u.rest for u in units if u.rest is not None]
    if len(rests) < len(units):
        return None
    start, end = max(r.start for r in rests), min(r.end for r in rests)
    within = (time >= start) & (time <= end)
    return (start, end) if within.sum() >= LEAST_SAMPLES else None


def _mean_levelling(units: Sequence[AtPoint], share: Array) -> Levelling:
    levels = [u.levelling for u in units]
    return Levelling(
        float(share @ [v.roll_deg for v in levels]),
        float(share @ [v.pitch_deg for v in levels]),
        # One unknown of the vehicle, as its name says.
        float(share @ [v.sd_deg for v in levels]),
        all(v.from_rest for v in levels),
    )


def _level(levelling: Levelling) -> Array:
    return rotation.dcm_from_euler([levelling.roll_deg, levelling.pitch_deg, 0.0])


def _without_own_tilt(unit: AtPoint) -> SampleEffects:
    """Effects without the tilt that follows from the force at rest: it is that of the mean."""
    effects = unit.effects
    tilt = level_turned_by(effects.rest_force, _level(unit.levelling))
    return replace(effects, tilt=effects.tilt - tilt)


def _median_weights(force: Array) -> Array:
    """One for the unit in the middle, a half for each of two in the middle; per sample and axis."""
    count = len(force)
    order = np.argsort(force, axis=0, kind="stable")
    weights = np.zeros((*force.shape, 3))
    middle = {(count - 1) // 2, count // 2}
    n, axes = np.indices(force.shape[1:])
    for place in middle:
        weights[order[place], n, axes, axes] = 1.0 / len(middle)
    return weights


def _rate_weights(units: Sequence[AtPoint], counted: NDArray[np.bool_]) -> Array:
    """One number a unit; a gyro that several have counts once."""
    steps = crash_steps(units[0].time)
    known, weights = set(), []
    for u, counts in zip(units, counted, strict=True):
        turned = np.tensordot(steps, u.effects.rate, axes=(0, 1))
        noise = steps[:, None] ** 2 * u.effects.rate_noise**2
        variance = float((turned**2).sum() + noise.sum())
        weights.append(0.0 if u.gyro in known or not counts else 1.0 / max(variance, TINY))
        known.add(u.gyro)
    return np.asarray(np.array(weights) / np.sum(weights))
