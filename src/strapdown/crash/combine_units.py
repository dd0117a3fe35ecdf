"""Combination of several units at a common point into one record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.crash.consistency import TINY, clipped_axes, floored
from strapdown.crash.measuring_point import PointKinematics, SampleEffects, level_turned_by
from strapdown.errors import ConfigError, DataError
from strapdown.rotation import level
from strapdown.sensors.pre_crash import Levelling
from strapdown.sensors.rest import LEAST_SAMPLES, RestStretch, rest_between
from strapdown.tables import imu_table
from strapdown.tables.checks import Array


def combine_units(units: Sequence[PointKinematics]) -> PointKinematics:
    """Combine units that were moved to one point.

    Parameters
    ----------
    units : sequence of PointKinematics
        Of one vehicle, at one point; the stamps of the first are kept, where all have samples,
        and the others are interpolated linearly.

    Returns
    -------
    PointKinematics
        One weight per unit and axis for the whole record, from the stated uncertainty of its change
        of velocity over the crash (`force_weights`): the mean's change of velocity then lies
        between those of the units. With the unknowns of all units, each scaled by the weight of its
        unit; an unknown that two units share, such as the bias of a borrowed gyro, is one. Rates
        are weighted by the uncertainty of the rotation from 0.1 s before to 0.75 s after the
        trigger. The combination is leveled from its mean specific force over the common stationary
        interval; without one, or where an attitude was stated, its level is the mean of theirs.

    Raises
    ------
    DataError
        There are fewer than two common samples.
    ConfigError
        There are too few units.

    Notes
    -----
    Any weights that sum to one are valid, since the effects of the mean use the same weights.
    Samples of a combination are treated as independent, although gyro noise through a lever arm
    is not: this is conservative.
    """
    if len(units) < 2:
        raise ConfigError("crash.units-cannot-combined", quantity="units", count=len(units))
    first, last = max(float(u.time[0]) for u in units), min(float(u.time[-1]) for u in units)
    time = units[0].time
    time = time[(time >= first) & (time <= last)]
    if time.size < 2:
        raise DataError("crash.units-share-samples", quantity="units", size=time.size)
    at = [_at(u, time) for u in units]
    force = np.array([u.force for u in at])
    weights = np.repeat(force_weights(at)[:, None], time.size, axis=1)
    # Rotation is that of the units that measure it about the most axes; assumed axes do not count.
    assumed = np.round([np.trace(u.unmeasured_turns) for u in at])
    counted = np.asarray(assumed == assumed.min())
    turning = _rate_weights(at, counted)
    name = f"weighted mean of {', '.join(u.name for u in units)}"
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
    # A third of the trace: one number per unit; they sum to one.
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
    levels = [u.levelling for u in units]
    mean = Levelling(
        float(share @ [v.roll_deg for v in levels]),
        float(share @ [v.pitch_deg for v in levels]),
        # One unknown of the vehicle, as its name says.
        float(share @ [v.sd_deg for v in levels]),
        all(v.from_rest for v in levels),
    )
    if levelled and rest is not None and rest.accel_mean is not None:
        roll, pitch = level(rest.accel_mean)
        mean = replace(mean, roll_deg=roll, pitch_deg=pitch)
        C_nb = rotation.dcm_from_euler([roll, pitch, 0.0])
        tilt = level_turned_by(effects.rest_force, C_nb)
        effects = replace(effects, tilt=effects.tilt + tilt)
    return PointKinematics(
        name,
        imu,
        effects,
        mean,
        rest,
        # The vehicle's own acceleration, common to all units.
        float(share @ [u.rest_accel_sd for u in units]),
        unmeasured=by_none([u.unmeasured for u in units]),
        unmeasured_turns=by_none(
            [u.unmeasured_turns for u, counts in zip(units, counted, strict=True) if counts]
        ),
    )


def _at(unit: PointKinematics, time: Array) -> PointKinematics:
    """Interpolate a unit linearly to other stamps."""
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
        # The noise of an interpolated value is smaller; that of the samples is kept.
        effects=replace(
            effects,
            force=at(effects.force),
            rate=at(effects.rate),
            force_noise=at(effects.force_noise),
            rate_noise=at(effects.rate_noise),
        ),
        moved=None,
    )


def _common_rest(units: Sequence[PointKinematics], time: Array) -> tuple[float, float] | None:
    rests: list[RestStretch] = [u.rest for u in units if u.rest is not None]
    if len(rests) < len(units):
        return None
    start, end = max(r.start for r in rests), min(r.end for r in rests)
    within = (time >= start) & (time <= end)
    return (start, end) if within.sum() >= LEAST_SAMPLES else None


def _without_own_tilt(unit: PointKinematics) -> SampleEffects:
    """Effects without the tilt from the stationary force, which is that of the mean."""
    effects, own = unit.effects, unit.levelling
    C_nb = rotation.dcm_from_euler([own.roll_deg, own.pitch_deg, 0.0])
    tilt = level_turned_by(effects.rest_force, C_nb)
    return replace(effects, tilt=effects.tilt - tilt)


def _rate_weights(units: Sequence[PointKinematics], counted: NDArray[np.bool_]) -> Array:
    """One weight per unit; a gyro shared by several units counts once."""
    steps = crash_steps(units[0].time)
    known, weights = set(), []
    for u, counts in zip(units, counted, strict=True):
        turned = np.tensordot(steps, u.effects.rate, axes=(0, 1))
        noise = steps[:, None] ** 2 * u.effects.rate_noise**2
        variance = float((turned**2).sum() + noise.sum())
        weights.append(0.0 if u.gyro in known or not counts else 1.0 / max(variance, TINY))
        known.add(u.gyro)
    return np.asarray(np.array(weights) / np.sum(weights))


# Effect of the unknowns of several units on their weighted mean.


@dataclass(frozen=True, eq=False)
class SampleWeights:
    """Weights of one unit in a mean.

    `force`, (n, 3, 3) or (3, 3), for each sample of the specific force in vehicle axes; `rest`, (3,
    3), for its stationary mean; `tilt` for the stationary attitude, as far as it does not follow
    from that; `rate`.
    """

    force: Array
    rest: Array
    tilt: float
    rate: float

    @classmethod
    def alike(cls, weight: float) -> SampleWeights:
        """The same weight for all quantities."""
        whole = weight * np.eye(3)
        return cls(whole, whole, weight, weight)


def combine_effects(
    parts: Sequence[SampleEffects], weights: Sequence[float | SampleWeights]
) -> SampleEffects:
    """Effects on a weighted mean of units at the same stamps and point; weights sum to one.

    Unknowns of the same name are one unknown, such as those of a gyro that two units share; the
    others are independent. The stationary attitude is the mean of theirs. Noise is that of
    independent units.
    """
    rows: dict[str, int] = {}
    contributors: list[str] = []
    for part in parts:
        for name, contributor in zip(part.names, part.contributors, strict=True):
            if name not in rows:
                rows[name] = len(rows)
                contributors.append(contributor)
    count, shape = len(rows), parts[0].force_noise.shape
    force, rate = np.zeros((count, *shape)), np.zeros((count, *shape))
    rest, tilt = np.zeros((count, 3)), np.zeros((count, 3))
    force_noise, rate_noise = np.zeros(shape), np.zeros(shape)
    for part, given in zip(parts, weights, strict=True):
        weight = given if isinstance(given, SampleWeights) else SampleWeights.alike(float(given))
        at = [rows[name] for name in part.names]
        # By sample, a product of matrices.
        weighed = part.force.swapaxes(0, 1) @ np.swapaxes(weight.force, -1, -2)
        force[at] += weighed.swapaxes(0, 1)
        rate[at] += weight.rate * part.rate
        rest[at] += part.rest_force @ weight.rest.T
        tilt[at] += weight.tilt * part.tilt
        force_noise += np.einsum("...ij,...j->...i", weight.force**2, part.force_noise**2)
        rate_noise += weight.rate**2 * part.rate_noise**2
    return SampleEffects(
        tuple(rows),
        tuple(contributors),
        force,
        rate,
        rest,
        tilt,
        np.sqrt(force_noise),
        np.sqrt(rate_noise),
    )


# Weights of units in their mean: one number per axis for the whole record.


# Window whose change of velocity is weighted: from before the impact to the end of the path.
CRASH_WINDOW = (-0.1, 0.75)  # s
# Rounding of squared cosines.
ROUNDING = 1e-9


def force_weights(units: Sequence[PointKinematics]) -> Array:
    """Weights of k units' specific forces in their mean, (k, 3, 3), summing to the identity.

    Units at one point and at the same stamps. Diagonal with values from zero to one where every
    axis that a unit lacks is a vehicle axis: the mean's change of velocity then lies between those
    of the units, axis by axis, over every window. In each axis the nonnegative weights w of sum one
    that minimize ``wᵀ C w``, with C the joint covariance of the changes of velocity from 0.1 s
    before to 0.75 s after the trigger. Weights per sample would bias the mean: the stated error of
    a scale factor grows with the reading, so that the smaller reading would always count for more.
    A unit clipped along an axis along which another was not does not count there.
    """
    covariance = velocity_covariance(units)
    missing = [u.unmeasured for u in units]
    if any(np.abs(p - np.diag(np.diagonal(p))).max() >= ROUNDING for p in missing):
        return _turned_weights(covariance, missing)
    weights = np.zeros((len(units), 3, 3))
    lacks = np.array([np.diagonal(p) for p in missing]) > 0.5
    cut = np.array([clipped_axes(u, CRASH_WINDOW) for u in units])
    for axis in range(3):
        counts = ~lacks[:, axis]
        if (counts & ~cut[:, axis]).any():
            counts &= ~cut[:, axis]
        if not counts.any():
            counts[:] = True
        weights[counts, axis, axis] = least_variance(covariance[axis][np.ix_(counts, counts)])
    return weights


def crash_steps(time: Array) -> Array:
    """Steps, (n,), s, zero outside the crash window; all steps where no stamp is in it."""
    steps = np.gradient(time)
    within = (time >= CRASH_WINDOW[0]) & (time <= CRASH_WINDOW[1])
    return np.where(within, steps, 0.0) if within.any() else steps


def velocity_covariance(units: Sequence[PointKinematics]) -> Array:
    """Joint covariance, (3, k, k), (m/s)², of the changes of velocity of k units, axis by axis.

    Of the integral of the specific force over the crash. Unknowns of the same name are one unknown;
    noise is independent from sample to sample.
    """
    steps = crash_steps(units[0].time)
    columns: dict[str, int] = {}
    for u in units:
        for name in u.effects.names:
            columns.setdefault(name, len(columns))
    spread = np.zeros((len(units), len(columns), 3))
    noise = np.zeros((len(units), 3))
    for k, u in enumerate(units):
        at = [columns[name] for name in u.effects.names]
        spread[k, at] = np.tensordot(steps, u.effects.force, axes=(0, 1))
        noise[k] = steps**2 @ u.effects.force_noise**2
    shared = np.einsum("apx,bpx->xab", spread, spread)
    return np.asarray(shared + noise.T[:, :, None] * np.eye(len(units)))


def least_variance(covariance: Array) -> Array:
    """Nonnegative weights, (k,), of sum one that minimize the variance of a mean.

    ``min |Lᵀ w|² + (1 - 1ᵀ w)²`` over ``w >= 0``, with ``C = L Lᵀ``: its minimum has the direction
    sought.
    """
    from scipy.optimize import nnls

    one = floored(covariance)
    one = one / np.diagonal(one).min()
    root = np.vstack([np.linalg.cholesky(one).T, np.ones(len(one))])
    found, _ = nnls(root, np.append(np.zeros(len(one)), 1.0))
    return np.asarray(found / found.sum())


def by_none(projections: Sequence[Array]) -> Array:
    """Projection onto the directions that none of several units measures, (3, 3)."""
    values, vectors = np.linalg.eigh(np.mean(projections, axis=0))
    kept = vectors[:, values > 1.0 - ROUNDING]
    return np.asarray(kept @ kept.T)


def _turned_weights(covariance: Array, missing: Sequence[Array]) -> Array:
    """Weights where a missing axis is not a vehicle axis, so that axes do not separate."""
    information = []
    for k, gone in enumerate(missing):
        own = floored(np.diag(covariance[:, k, k]))
        kept = np.eye(3) - gone
        information.append(kept @ np.linalg.inv(kept @ own @ kept + gone) @ kept)
    none = by_none(missing)
    if none.any():
        # Along directions that no unit measures all units are equally good.
        size = float(np.mean(np.trace(information, axis1=-2, axis2=-1)))
        information = [i + size * none for i in information]
    total = np.linalg.inv(np.sum(information, axis=0))
    return np.array([total @ i for i in information])
