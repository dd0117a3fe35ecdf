"""Many cases in one call: crashes, units of a gyro along a motion, and predicted drifts.

A case depends on the seed and its own number alone: streams of `TOGETHER` cases share one generator
and are always computed whole, so that no bit depends on how a campaign is cut. Of a case only its
scalars are kept.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, Protocol

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown._kernels.unit_rates import turns_from, unit_increments
from strapdown.attitude_algorithms import make_algorithm
from strapdown.attitude_algorithms.algorithm import AttitudeAlgorithm
from strapdown.campaign.kinds import crash_case
from strapdown.campaign.kinds import scenario_of as written_scenario
from strapdown.config.motions import TrajectorySpec
from strapdown.config.outage import OutageSpec
from strapdown.config.sources import ScenarioSpec
from strapdown.config.spec import specify
from strapdown.crash.case import reconstruct_case
from strapdown.crash.case_contact import main_event
from strapdown.crash.delta_v_bound import AT_REST, WINDOW_ENDS, VelocityChange, body_effects
from strapdown.crash.entry import angles_sd
from strapdown.crash.path import PLACE, TOGETHER, VELOCITY, PathSampler
from strapdown.crash.pdof import horizontal_angles, pdof
from strapdown.crash.reconstruction import UnitReconstruction
from strapdown.dsp.chi_square import plane_bound
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import ConfigError, check_choice
from strapdown.navigation.outage import variances
from strapdown.rotation import within_half_turn
from strapdown.sensors.catalogue import DRAWN, Sensor, Spread, load_sensor
from strapdown.sensors.error_chain import gauss_markov_of, known_drift, walk_of
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.simulation import simulate_imu
from strapdown.systems.outage_run import ALIGNED, drift_of_sensor, sensor_of
from strapdown.systems.trajectory_source import make_motion, scenario_of
from strapdown.tables import ACCEL, GYRO, NED, QUATERNION
from strapdown.tables import VELOCITY as VELOCITIES
from strapdown.tables.checks import Array, index_of, values_of
from strapdown.units import SPEEDS


class BulkCases(Protocol):
    """Cases that are computed many at a time."""

    @property
    def scalars(self) -> tuple[str, ...]:
        """Names of the results of a case, each with its unit."""

    @property
    def nominal(self) -> Mapping[str, float]:
        """Results of the unperturbed case."""

    @property
    def linear_sd(self) -> Mapping[str, float]:
        """Standard deviation by linear propagation, of those results that have one."""

    def run(self, first: int, last: int) -> Array:
        """Results of the cases from `first` to before `last`, (last - first, scalars)."""
        ...


class _Streams(ABC):
    """Cases in streams of `TOGETHER`."""

    @property
    @abstractmethod
    def scalars(self) -> tuple[str, ...]:
        """Names of the results of a case, each with its unit."""

    @abstractmethod
    def _stream(self, number: int) -> Array:
        """Results of all cases of a stream, (TOGETHER, scalars)."""

    def run(self, first: int, last: int) -> Array:
        """Results of the cases from `first` to before `last`, (last - first, scalars).

        In one thread; memory is that of one stream and of what is returned.
        """
        out = np.empty((max(last - first, 0), len(self.scalars)))
        for number in range(first // TOGETHER, -(-last // TOGETHER)):
            begin = number * TOGETHER
            low, high = max(first, begin), min(last, begin + TOGETHER)
            if low < high:
                out[low - first : high - first] = self._stream(number)[low - begin : high - begin]
        return out


def _generator(seed: int, number: int) -> np.random.Generator:
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence(seed, spawn_key=(number,))))


def _root(covariance: Array) -> Array:
    """Square root R of a covariance that may be singular: ``R R' = covariance``."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


# Crashes: one record, with everything that is not known of it drawn.


@dataclass(frozen=True, eq=False)
class BulkCrash(_Streams):
    """Possible truths of one crash.

    The unknowns of the reconstruction are drawn, and its path is navigated in full, as by
    `sample_paths` with the same seed. The change of velocity of the severest event, along the
    vehicle's axes, takes the same draws: unknowns and noise of the samples; and draws of what
    moves it alone, the instants of the window and the level before the crash.

    Attributes
    ----------
    unit : UnitReconstruction
    seed : int
    """

    unit: UnitReconstruction
    seed: int = 0

    @property
    def scalars(self) -> tuple[str, ...]:
        """Names of the results of a case, each with its unit."""
        return tuple(self.nominal)

    @cached_property
    def nominal(self) -> Mapping[str, float]:
        """Results of the reconstruction itself."""
        change: tuple[float, ...] = ()
        if self._change is not None:
            vector = self._change.delta_v.vector
            angle = pdof(vector).horizontal_deg
            change = float(vector[0]), float(vector[1]), self._change.resultant, angle
        return _by_name(self.unit.path.table.iloc[-1], *change)

    @cached_property
    def linear_sd(self) -> Mapping[str, float]:
        """Standard deviations of the reconstruction; of the PDOF to first order."""
        change: tuple[float, ...] = ()
        if self._change is not None:
            vector, bound = self._change.delta_v.vector, self._change.bound
            across = np.array([-vector[1], vector[0]]) / (vector[:2] @ vector[:2])
            angle = math.degrees(math.sqrt(across @ bound.covariance[:2, :2] @ across))
            change = bound.sd[0], bound.sd[1], bound.along(vector), angle
        return _by_name(self.unit.path.sd.iloc[-1], *change)

    def _stream(self, number: int) -> Array:
        errors = np.empty((TOGETHER, 1, 9))
        drawn = self._sampler.stream(number, errors)
        place, velocity, heading, q_nb = self._end
        end = errors[:, 0]
        turned = rotation.compose(rotation.quaternion_from_rotation_vector(end[:, :3]), q_nb)
        away = rotation.euler_from_quaternion(turned)[:, 2] - heading
        columns = [
            *(place + end[:, PLACE]).T,
            *(velocity + end[:, VELOCITY]).T,
            heading + within_half_turn(away),
        ]
        if self._change is not None:
            each, by_sample, root = self._effects
            vector = self._change.delta_v.vector + np.einsum(
                "rp,pi->ri", drawn.draws[:, : len(each)], each
            )
            for noise, weights in zip(drawn.noise, by_sample, strict=True):
                # The contact is a small part of the path.
                inside = np.flatnonzero(weights.any(axis=0))
                if len(inside):
                    part = slice(inside[0], inside[-1] + 1)
                    vector = vector + np.einsum("rij,ij->ri", noise[:, 3:, part], weights[:, part])
            more = drawn.generator.standard_normal((TOGETHER, 3))
            vector = vector + np.einsum("rj,ij->ri", more, root)
            total = np.sqrt((vector * vector).sum(axis=1))
            at = self.nominal["pdof_deg"]
            columns += [
                vector[:, 0],
                vector[:, 1],
                total,
                total / SPEEDS["km/h"],
                at + within_half_turn(horizontal_angles(vector) - at),
            ]
        return np.column_stack(columns)

    @cached_property
    def _end(self) -> tuple[Array, Array, float, Array]:
        """End of the path: position, velocity, heading in deg, and attitude of every run."""
        path = self.unit.path
        row = path.table.iloc[-1]
        return (
            row[NED].to_numpy(dtype=np.float64),
            row[VELOCITIES].to_numpy(dtype=np.float64),
            float(row["heading"]),
            np.tile(path.q_nb[-1], (TOGETHER, 1)),
        )

    @cached_property
    def _sampler(self) -> PathSampler:
        return PathSampler(self.unit.path, self.seed, [len(self.unit.path.time) - 1])

    @cached_property
    def _change(self) -> VelocityChange | None:
        number = main_event(self.unit)
        return None if number is None else self.unit.body[number].event

    @cached_property
    def _effects(self) -> tuple[Array, list[Array], Array]:
        """Effects on the change: of the unknowns, (p, 3), of the noise of the steps, of the rest.

        Those of the noise are in the order of the stream, (3, k) for each segment of the path; a
        step has the noise of the sample at its end. The rest is the root of a covariance.
        """
        unit, change = self.unit, self._change
        assert change is not None
        effects, weights = unit.at_point.effects, change.delta_v.weights
        by_sample = (weights[:, None] * effects.force_noise).T
        first = int(np.searchsorted(unit.at_point.time, unit.path.time[0] - 1e-9))
        anchor = first + unit.path.anchor
        last = first + len(unit.path.time) - 1
        back = by_sample[:, first + 1 : anchor + 1][:, ::-1]
        ahead = by_sample[:, anchor + 1 : last + 1]
        beyond = by_sample.copy()
        beyond[:, first + 1 : last + 1] = 0.0
        rest = np.diag((beyond**2).sum(axis=1))
        lines = change.bound.by_contributor
        for line in (AT_REST, WINDOW_ENDS):
            if line in lines.index:
                rest = rest + lines.loc[line].to_numpy(dtype=np.float64).reshape(3, 3)
        return body_effects(effects, weights), [back, ahead], _root(rest)


def _by_name(end: pd.Series, *change: float) -> dict[str, float]:
    """Results of a crash: of the last row of its path, and of the change of velocity, if known.

    `change`: forward, right and total, m/s, and the PDOF, deg.
    """
    out = {f"end_{axis}_m": float(end[axis]) for axis in NED}
    out |= {f"end_velocity_{a}_m_per_s": float(end[f"V{a[0].upper()}"]) for a in NED}
    out["end_heading_deg"] = float(end["heading"])
    if change:
        forward, right, total, angle = change
        out |= {"delta_v_forward_m_per_s": forward, "delta_v_right_m_per_s": right}
        out |= {"delta_v_total_m_per_s": total, "delta_v_total_km_per_h": total / SPEEDS["km/h"]}
        out["pdof_deg"] = angle
    return out


# Attitude: units of one gyro triad along one motion, each integrated from the true attitude.


ANGLES = (
    "end_error_deg",
    "largest_error_deg",
    "end_roll_error_deg",
    "end_pitch_error_deg",
    "end_heading_error_deg",
)
#: Samples of a piece, the units whose increments are formed in one call, and the values of which
#: white noise takes one: all stay in the cache.
CHUNK, UNITS, _QUANTILES = 512, 4, 1 << 12
#: Blocks of a correlation time, and least number of blocks of a record. Over a block a wandering
#: bias is its mean, drawn exactly: so is the angle at its end, but for the turn within it.
_PER_TIME, _BLOCKS = 16, 64
# Columns of a unit's numbers, as `unit_increments` takes them.
_FELT, _SCALE, _SECOND, _THIRD, _BIAS = slice(3, 6), 6, 7, 8, 9


@lru_cache(maxsize=1)
def _quantiles() -> NDArray[np.float32]:
    """Equally probable values of unit variance: the middles of the steps of a normal number."""
    from scipy.special import ndtri

    values = ndtri((np.arange(_QUANTILES) + 0.5) / _QUANTILES)
    return np.asarray(values / np.sqrt((values * values).mean()), dtype=np.float32)


def _bytes(generator: np.random.Generator, count: int) -> NDArray[np.uint8]:
    """Numbers of `unit_increments` for the units of a stream, (TOGETHER, 6, count)."""
    raw = generator.bit_generator.random_raw(TOGETHER * 6 * count // 8)
    out = raw.astype("<u8", copy=False).view(np.uint8).reshape(TOGETHER, 6, count)
    out[:, 1::2] &= (_QUANTILES >> 8) - 1
    return out


@dataclass(frozen=True, eq=False)
class BulkAttitude(_Streams):
    """Attitude errors of many units of a sensor, integrated from the true attitude.

    The errors of a unit are those of `Sensor.draw` and `error_chain`, in the same order: constants
    within the data-sheet limits, a bias that wanders, white noise, range and quantization. White
    noise takes one of 4,096 equally probable values, of which the largest is 3.7 standard
    deviations; the wandering bias is, over each of some hundred blocks, its exact mean.

    Attributes
    ----------
    sensor : Sensor
    algorithm : AttitudeAlgorithm
    time : ndarray, (n,), s
    rate, force : ndarray, (3, n)
        True, rad/s and m/s², behind the low-pass of the sensor.
    truth : ndarray, (n, 4)
        True attitude ``q_nb``.
    mean : bool
        Whether the samples are means.
    seed : int
    """

    sensor: Sensor
    algorithm: AttitudeAlgorithm
    time: Array
    rate: Array
    force: Array
    truth: Array
    mean: bool
    seed: int = 0

    @property
    def scalars(self) -> tuple[str, ...]:
        """Names of the results of a case, each with its unit."""
        return ANGLES

    @cached_property
    def nominal(self) -> Mapping[str, float]:
        """Errors of a unit without errors: those of the algorithm, and of the Earth's turning."""
        plain = replace(self.sensor, imu_errors=ImuErrors(), spreads={})
        row = replace(self, sensor=plain)._stream(0)[0]
        return dict(zip(self.scalars, row.tolist(), strict=True))

    @cached_property
    def linear_sd(self) -> Mapping[str, float]:
        """Standard deviations of the angles at the end, to first order, without quantization."""
        covariance = self._covariance
        sds = angles_sd(self._end, covariance[None])[0]
        return dict(zip(self.scalars[2:], sds.tolist(), strict=True))

    @cached_property
    def _errors(self) -> TriadErrors:
        return self.sensor.imu_errors.gyro

    @cached_property
    def _spreads(self) -> Mapping[str, Spread]:
        return self.sensor.spreads.get("gyro", {})

    @cached_property
    def _blocks(self) -> tuple[int, Array]:
        """Samples of a block, and the lengths of the blocks, s."""
        count = len(self.time)
        step = float(self.time[-1] - self.time[0]) / (count - 1)
        each = max(1, count // _BLOCKS)
        wanders = any(self._errors.axis("bias_instability"))
        if wanders and math.isfinite(self._errors.correlation_time):
            each = max(1, min(each, int(self._errors.correlation_time / (_PER_TIME * step))))
        if each > CHUNK or not (wanders or any(self._errors.axis("random_walk"))):
            each = max(1, each // CHUNK) * CHUNK
        return each, np.full(-(-count // each), each * step)

    @cached_property
    def _numbers(self) -> tuple[int, ...]:
        """How many rows of standard normal numbers make the wandering bias of an axis."""
        blocks = len(self._blocks[1])
        wanders = any(self._errors.axis("bias_instability"))
        walks = any(self._errors.axis("random_walk"))
        return (blocks, blocks + 1) * wanders + (blocks, blocks) * walks

    def _slow(self, numbers: list[Array], columns: int) -> Array:
        """Wandering bias of each block, (blocks, 3 columns), from such numbers."""
        errors, steps = self._errors, self._blocks[1]
        out = np.zeros((len(steps), 3 * columns))
        if any(sd := errors.axis("bias_instability")):
            w1, further, *numbers = numbers
            out += gauss_markov_of(
                w1, further, steps, np.tile(sd, columns), errors.correlation_time
            )
        if any(density := errors.axis("random_walk")):
            first, more = numbers
            out += walk_of(first, more, steps, np.tile(density, columns))
        return out

    @cached_property
    def _shared(self) -> tuple[Array, Array, Array]:
        """What all units have: drift, (3, n), sd of the white noise, (3, n), and limits, (3, 2)."""
        errors = self._errors
        steps = np.diff(self.time, prepend=2.0 * self.time[0] - self.time[1])
        known = known_drift(errors, self.time, steps, self.mean)
        sd = np.asarray(errors.axis("noise_density"))[:, None] / np.sqrt(steps)
        return (
            np.ascontiguousarray(known.T),
            sd,
            np.column_stack([errors.axis("full_scale"), errors.axis("quantization")]),
        )

    @cached_property
    def _pieces(self) -> list[tuple[Any, ...]]:
        """What all units have, piece by piece, so that it stays in the cache from unit to unit."""
        known, sd, _ = self._shared
        dt, last = np.diff(self.time), len(self.time) - 1
        each = self._blocks[0]
        # A piece ends where a block does.
        length = CHUNK if each > CHUNK else CHUNK // each * each
        out: list[tuple[Any, ...]] = []
        for start in range(0, last, length):
            end = min(start + length, last)
            columns = [a[:, start : end + 1].copy() for a in (self.rate, self.force, known, sd)]
            own = slice(start // each, end // each + 1)
            if each > CHUNK:
                own = slice(start // each, start // each + 1)
            out.append(
                (*columns, own, dt[start:end].copy(), self.truth[start + 1 : end + 1].copy())
            )
        return out

    def _stream(self, number: int) -> Array:
        generator = _generator(self.seed, number)
        units = _units(self._errors, self._spreads, generator)
        blocks, each = len(self._blocks[1]), min(self._blocks[0], CHUNK + 1)
        numbers = [generator.standard_normal((rows, 3 * TOGETHER)) for rows in self._numbers]
        slow = self._slow(numbers, TOGETHER).reshape(blocks, TOGETHER, 3).transpose(1, 0, 2).copy()
        limits = self._shared[2]
        felt = bool(units[:, :, _FELT].any())
        algorithm, kernel = self.algorithm, type(self.algorithm).advance_kernel
        options = algorithm.kernel_options()
        plain = (
            type(algorithm).quaternions is AttitudeAlgorithm.quaternions and algorithm.width == 4
        )
        states = [algorithm.begin(self.truth[0]) for _ in range(TOGETHER)]
        turns: list[list[tuple[float, float]]] = [[] for _ in states]
        last, quantiles = np.empty((TOGETHER, 4)), _quantiles()
        bytes_ = _bytes(generator, 1)
        theta = dtheta = np.empty((UNITS, 0, 3))
        history = np.empty((0, algorithm.width))
        for rate, force, known, sd, own, dt, truth in self._pieces:
            steps = len(dt)
            # The last sample of a piece is the first of the next.
            bytes_ = np.concatenate([bytes_[:, :, -1:], _bytes(generator, steps)], axis=2)
            if steps != theta.shape[1]:
                theta, dtheta = np.empty((2, UNITS, steps, 3))
                history = np.empty((steps, algorithm.width))
            for first in range(0, TOGETHER, UNITS):
                some = slice(first, first + UNITS)
                unit_increments(
                    rate,
                    force,
                    felt,
                    known,
                    slow[some, own],
                    each,
                    units[some],
                    limits,
                    sd,
                    bytes_[some],
                    quantiles,
                    dt,
                    self.mean,
                    theta,
                    dtheta,
                )
                for k in range(UNITS):
                    kernel(states[first + k], dt, theta[k], dtheta[k], history, *options)
                    q = history if plain else algorithm.quaternions(history)
                    turns[first + k].append(turns_from(truth, q))
                    last[first + k] = q[-1]
        angles = np.array([[max(pairs)[0], pairs[-1][1]] for pairs in turns])
        return self._scalars(np.column_stack([angles, last]))

    @cached_property
    def _end(self) -> Array:
        """True roll, pitch and heading at the end, (1, 3), deg."""
        return rotation.euler_from_quaternion(self.truth[-1:])

    def _scalars(self, rows: Array) -> Array:
        """Results of units from their largest and last error, rad, and last attitude, (r, 6)."""
        q = rotation.normalise(rows[:, 2:])
        away = rotation.euler_from_quaternion(q) - self._end
        angles = np.degrees(rows[:, [1, 0]])
        out = np.column_stack([angles, within_half_turn(away)])
        out[~np.isfinite(rows).all(axis=1)] = math.nan
        return out

    @cached_property
    def _covariance(self) -> Array:
        """Covariance of the rotation vector in level at the end, (3, 3), rad²."""
        errors, count = self._errors, len(self.time)
        # Turn in level at the end for each rate of error of a sample: half of the step on either
        # side of an instantaneous one.
        c = rotation.dcm_from_quaternion(self.truth)
        over = 0.5 * (c[1:] + c[:-1]) * np.diff(self.time)[:, None, None]
        weights = np.zeros((count, 3, 3))
        if self.mean:
            weights[1:] = over
        else:
            weights[1:] += 0.5 * over
            weights[:-1] += 0.5 * over
        columns = [np.zeros((3, 1))]
        for quantity in DRAWN:
            if quantity not in self._spreads:
                continue
            spread = self._spreads[quantity]
            size = np.asarray(spread.size) / (1.0 if spread.kind == "sd" else math.sqrt(3.0))
            columns += _felt(quantity, weights, self.rate.T, self.force.T, size, errors)
        each = self._blocks[0]
        if self._numbers:
            # Of every block as of every standard normal number that it is made of.
            ends = np.arange(0, count, each)
            by_block = np.add.reduceat(weights, ends, axis=0)
            total = sum(self._numbers)
            for axis in range(3):
                made, at = [], 0
                for rows in self._numbers:
                    array = np.zeros((rows, 3 * total))
                    array[:, axis + 3 * at : axis + 3 * (at + rows) : 3] = np.eye(rows)
                    made.append(array)
                    at += rows
                slow = self._slow(made, total)[:, axis::3]
                columns.append(np.einsum("bi,bm->im", by_block[:, :, axis], slow))
        effects = np.concatenate(columns, axis=1)
        noise = weights * self._shared[1].T[:, None, :]
        return np.asarray(effects @ effects.T + np.einsum("nij,nkj->ik", noise, noise))


def _units(
    nominal: TriadErrors, spreads: Mapping[str, Spread], generator: np.random.Generator
) -> Array:
    """Numbers of the units of a stream, (TOGETHER, 3, 10), as `Sensor.draw` places them."""
    out = np.zeros((TOGETHER, 3, 10))
    out[:, :, :3] = np.eye(3) + np.asarray(nominal.misalignment)
    out[:, :, _FELT] = np.asarray(nominal.g_sensitivity)
    for column, name in (
        (_SCALE, "scale"),
        (_SECOND, "nonlinearity_2"),
        (_THIRD, "nonlinearity_3"),
        (_BIAS, "bias"),
    ):
        # The bias of all units is among the drifts that they share.
        out[:, :, column] = 0.0 if name == "bias" else nominal.axis(name)
    for quantity in DRAWN:
        if quantity not in spreads:
            continue
        spread, shape = spreads[quantity], (TOGETHER, 3, 3)
        normal = spread.kind == "sd"
        numbers = (
            generator.standard_normal(shape) if normal else generator.uniform(-1.0, 1.0, shape)
        )
        rows = np.asarray(spread.size)[:, None] * numbers
        if quantity == "misalignment":
            out[:, :, :3] = np.where(np.eye(3, dtype=bool), 1.0, rows)
        elif quantity == "g_sensitivity":
            out[:, :, _FELT] = rows
        elif quantity == "nonlinearity":
            out[:, :, _SECOND], out[:, :, _THIRD] = 0.5 * rows[..., 0], 0.5 * rows[..., 1]
        else:
            out[:, :, _BIAS if quantity == "bias" else _SCALE] = rows[..., 0]
    return out


def _felt(
    quantity: str, weights: Array, rate: Array, force: Array, size: Array, errors: TriadErrors
) -> list[Array]:
    """Effects of one standard deviation of each number on the last attitude, (3, k)."""
    if quantity == "misalignment":
        by = np.einsum("nij,nk->ijk", weights, rate) * size[:, None]
        return [by[:, ~np.eye(3, dtype=bool)]]
    if quantity == "g_sensitivity":
        return [(np.einsum("nij,nk->ijk", weights, force) * size[:, None]).reshape(3, 9)]
    if quantity == "nonlinearity":
        full = np.asarray(errors.axis("full_scale"))
        part = rate / full
        return [
            np.einsum("nij,nj->ij", weights, full * part**power) * 0.5 * size for power in (2, 3)
        ]
    if quantity == "scale":
        return [np.einsum("nij,nj->ij", weights, rate) * size]
    return [weights.sum(axis=0) * size]


def bulk_attitude(
    motion: ScenarioSpec | TrajectorySpec,
    sensor: str,
    algorithm: str = "quaternion",
    seed: int = 0,
) -> BulkAttitude:
    """Prepare many units of a sensor, of the catalogue or a file, along a motion.

    `motion`: its rate and its kind of samples are used, its sensor and its seed are not.
    `algorithm`: a name with its options. ConfigError: motion, sensor or algorithm are unknown, or
    the sensor has jitter.
    """
    known, chosen = load_sensor(sensor), make_algorithm(algorithm)
    errors = known.imu_errors.gyro
    if errors.jitter > 0.0:
        raise ConfigError("campaign.bulk-without-jitter", file=known.name, quantity="jitter_us")
    if isinstance(motion, ScenarioSpec):
        path = scenario_of(motion).motion
    else:
        path = make_motion(motion.motion, find_ellipsoid(motion.ellipsoid))
    plain = ImuErrors(TriadErrors(bandwidth=errors.bandwidth))
    imu, truth = simulate_imu(path, plain, rate=motion.rate_hz, sampling=motion.sampling)
    return BulkAttitude(
        known,
        chosen,
        np.ascontiguousarray(index_of(imu)),
        np.ascontiguousarray(values_of(imu, GYRO).T),
        np.ascontiguousarray(values_of(imu, ACCEL).T),
        np.ascontiguousarray(values_of(truth, QUATERNION)),
        motion.sampling == "mean",
        seed,
    )


# Predicted drifts: the covariance of an outage for many sensors, starts, lengths and speeds.


DRIFTS = ("horizontal_95_m", "speed_sd_m_per_s", "heading_sd_deg")
#: Keys of a start, and what an alignment leaves where they are not stated.
_STARTS = {
    "position_sd_m": ALIGNED[0],
    "velocity_sd_m_per_s": ALIGNED[1],
    "tilt_sd_deg": ALIGNED[2],
    "heading_sd_deg": ALIGNED[3],
    "gyro_bias_sd_deg_per_h": None,
    "accel_bias_sd_ug": None,
}
_CONSTANT = ("noise_density", "bias", "scale", "misalignment", "g_sensitivity")
#: Figures of a sensor, as what they multiply: triad and attribute.
_FIGURES = {
    **{f"{t}.{name}": (t, name) for t in ("gyro", "accel") for name in _CONSTANT},
    **{f"{t}.bias_instability": (f"{t}_drift", "sd") for t in ("gyro", "accel")},
    **{f"{t}.random_walk": (f"{t}_drift", "walk") for t in ("gyro", "accel")},
}
OUTAGE, SPEED = "outage_s", "speed_m_per_s"
#: Speeds at which the covariance is computed, Chebyshev's; between them it is a polynomial.
_NODES = 6


@dataclass(frozen=True, eq=False)
class BulkOutage(_Streams):
    """Predicted drifts of many cases of an outage.

    Without measurements the covariance is the sum, over independent sources, of their squared size
    times a covariance that depends on the motion alone, which the filter computes once: a case
    costs a product. Over the length of an outage and over its speed it is interpolated.

    Attributes
    ----------
    spec : OutageSpec
    sensors : ImuUncertainty
    ranges : mapping of str to (float, float)
        Of what varies: from, to; uniform.
    seed : int
    """

    spec: OutageSpec
    sensors: ImuUncertainty
    ranges: Mapping[str, tuple[float, float]]
    seed: int = 0

    @property
    def scalars(self) -> tuple[str, ...]:
        """Names of the results of a case, each with its unit."""
        return DRIFTS

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of what varies, in the order of the columns of `of`."""
        return tuple(self.ranges)

    @cached_property
    def nominal(self) -> Mapping[str, float]:
        """Results of the specification itself; of what it does not state, of the middle."""
        values = self.of(self._middle[None])[0]
        return dict(zip(self.scalars, values.tolist(), strict=True))

    @cached_property
    def linear_sd(self) -> Mapping[str, float]:
        """Standard deviations over the cases, by the derivatives at the nominal case."""
        total = np.zeros(len(self.scalars))
        for k, (low, high) in enumerate(self.ranges.values()):
            step = 1e-3 * (high - low)
            # The nominal case may be at an end of a range.
            ends = np.tile(self._middle, (2, 1))
            ends[:, k] = np.clip(self._middle[k] + np.array([-step, step]), low, high)
            below, above = self.of(ends)
            moved = ends[1, k] - ends[0, k]
            if moved > 0.0:
                total += ((above - below) / moved * (high - low)) ** 2 / 12.0
        return dict(zip(self.scalars, np.sqrt(total).tolist(), strict=True))

    def of(self, parameters: Array) -> Array:
        """Results, (n, scalars), of given parameters, (n, parameters)."""
        given = dict(zip(self.ranges, np.asarray(parameters, dtype=np.float64).T, strict=True))
        count = len(parameters)
        sources, nodes, spline = self._growth
        squares = np.ones((count, len(sources)))
        for k, (key, reference) in enumerate(sources):
            if key:
                squares[:, k] = (given[key] / reference) ** 2
        over = spline(given[OUTAGE]) if OUTAGE in given else spline(spline.x[-1:])
        by_speed = np.einsum(
            "nk,nskj->nsj", squares, np.broadcast_to(over, (count, *over.shape[1:]))
        )
        weights = np.ones((count, 1))
        if SPEED in given:
            weights = _lagrange(nodes, given[SPEED])
        nn, ee, ne, speed, heading = np.einsum("ns,nsj->jn", weights, by_speed)
        plane = np.stack([np.stack([nn, ne], -1), np.stack([ne, ee], -1)], -1)
        return np.column_stack(
            [
                plane_bound(plane),
                np.sqrt(np.maximum(speed, 0.0)),
                np.degrees(np.sqrt(np.maximum(heading, 0.0))),
            ]
        )

    def drawn(self, number: int) -> Array:
        """Parameters of the cases of a stream, (TOGETHER, parameters)."""
        low, high = np.array(list(self.ranges.values())).T
        unit = _generator(self.seed, number).random((TOGETHER, len(low)))
        return np.asarray(low + (high - low) * unit)

    def _stream(self, number: int) -> Array:
        return self.of(self.drawn(number))

    @cached_property
    def _middle(self) -> Array:
        """Parameters of the nominal case."""
        out = []
        for key, (low, high) in self.ranges.items():
            stated: float | None = 1.0
            if key == OUTAGE:
                stated = self.spec.outage_s
            elif key == SPEED:
                stated = self.spec.motion.speed_m_per_s
            elif key in _STARTS:
                stated = getattr(self.spec.start, key)
                stated = _STARTS[key] if stated is None else stated
            out.append(0.5 * (low + high) if stated is None else min(max(stated, low), high))
        return np.array(out)

    @cached_property
    def _growth(self) -> tuple[list[tuple[str, float]], Array, Any]:
        """Sources with their reference size, speeds, and their covariances over time.

        A cubic spline of north-north, east-east, north-east, speed and heading, (speeds, sources,
        5). The first source is all that does not vary.
        """
        from scipy.interpolate import CubicSpline

        varied = [key for key in self.ranges if key not in (OUTAGE, SPEED)]
        sources = [("", 1.0)]
        sources += [(key, self.ranges[key][1] if key in _STARTS else 1.0) for key in varied]
        low, high = self.ranges.get(SPEED, (self.spec.motion.speed_m_per_s,) * 2)
        nodes = np.array([low])
        if SPEED in self.ranges:
            at = np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES)[::-1]
            nodes = 0.5 * (low + high) + 0.5 * (high - low) * at
        made = []
        for speed in nodes.tolist():
            row = []
            for key, reference in sources:
                time, P = drift_of_sensor(*self._alone(key, reference, varied, speed))
                found = variances(P, np.zeros(len(time)))
                row.append([P[:, 0, 0], P[:, 1, 1], P[:, 0, 1], found["speed"], found["heading"]])
            made.append(row)
        # (speeds, sources, 5, time) to time first.
        return sources, nodes, CubicSpline(time, np.moveaxis(np.array(made), -1, 0))

    def _alone(
        self, key: str, reference: float, varied: list[str], speed: float
    ) -> tuple[OutageSpec, ImuUncertainty]:
        """Specification and sensors of one source alone; of no key, of all that does not vary."""
        start: dict[str, float | None] = {}
        for name in _STARTS:
            stated = getattr(self.spec.start, name)
            if key and (name in varied or stated is not None or _STARTS[name] is not None):
                start[name] = reference if name == key else 0.0
            elif name in varied:
                start[name] = 0.0
        sensors: dict[str, Any] = {}
        for name, (triad, attribute) in _FIGURES.items():
            if (key and name != key) or (not key and name in varied):
                part = sensors.get(triad, getattr(self.sensors, triad))
                sensors[triad] = replace(part, **{attribute: 0.0})
        longest = self.ranges.get(OUTAGE, (0.0, self.spec.outage_s))[1]
        spec = self.spec.model_copy(
            update={
                "outage_s": longest,
                "start": self.spec.start.model_copy(update=start),
                "motion": self.spec.motion.model_copy(update={"speed_m_per_s": speed}),
            }
        )
        return spec, replace(self.sensors, **sensors)


def _lagrange(nodes: Array, at: Array) -> Array:
    """Weights of the values at nodes for the polynomial through them, (n, nodes)."""
    out = np.ones((len(at), len(nodes)))
    for k, node in enumerate(nodes):
        for other in np.delete(nodes, k):
            out[:, k] *= (at - other) / (node - other)
    return out


def bulk_outage(
    spec: OutageSpec, ranges: Mapping[str, tuple[float, float]], seed: int = 0
) -> BulkOutage:
    """Prepare many predictions of the drift of a sensor along a stated motion.

    Parameters
    ----------
    spec : OutageSpec
        With a sensor, without measurements that remain, and with ``aided_s = 0``: the start is
        stated, or that after an alignment.
    ranges : mapping of str to (float, float)
        What varies, from and to: ``outage_s``, ``speed_m_per_s``; keys of the start; figures of the
        sensor, as factors: ``gyro.noise_density``, ``gyro.bias``, ``gyro.bias_instability``,
        ``gyro.random_walk``, ``gyro.scale``, ``gyro.misalignment``, ``gyro.g_sensitivity``, and
        likewise of ``accel``.
    seed : int

    Raises
    ------
    ConfigError
        The specification has measurements, or a range is not one.
    """
    if spec.sensor is None:
        raise ConfigError("outage.nothing-says-sensor", quantity="sensor")
    if spec.start.aided_s > 0.0 or spec.aiding:
        # Their gains would depend on what varies.
        raise ConfigError(
            "campaign.bulk-outage-with-measurements",
            quantity="start, aided_s" if spec.start.aided_s > 0.0 else "aiding",
        )
    known = (OUTAGE, SPEED, *_STARTS, *_FIGURES)
    for key, (low, high) in ranges.items():
        check_choice("campaign.bulk-outage-nothing-varies", known, quantity="ranges", name=key)
        least = 0.0 if key != OUTAGE else np.nextafter(0.0, 1.0)
        if not (least <= low < high < math.inf):
            raise ConfigError("campaign.bulk-not-a-range", quantity=key, low=low, high=high)
    if spec.motion.to_speed_m_per_s is not None and {OUTAGE, SPEED} & set(ranges):
        raise ConfigError("campaign.bulk-outage-changes-speed", quantity="motion, to_speed_m_per_s")
    return BulkOutage(spec, sensor_of(spec.sensor), dict(ranges), seed)


# The many cases of a campaign.


def bulk_cases(
    kind: str, table: Mapping[str, Any], seed: int, ranges: Mapping[str, tuple[float, float]]
) -> BulkCases:
    """Prepare the cases of a campaign that are computed many at a time.

    Parameters
    ----------
    kind : {'crash', 'attitude', 'outage'}
    table : mapping
        Configuration of the campaign's base.
    seed : int
    ranges : mapping of str to (float, float)
        Of an outage, what varies (`bulk_outage`).

    Raises
    ------
    ConfigError
        The configuration is invalid, or says nothing that can be drawn.
    """
    if kind == "crash":
        own = dict(table)
        if "simulate" in own:
            own["simulate"] = {"seed": seed, **own["simulate"]}
        with crash_case(own, "case") as (case, _):
            return BulkCrash(reconstruct_case(case).main, seed)
    if kind == "outage":
        return bulk_outage(specify(OutageSpec, **table), ranges, seed)
    source, sensor = table.get("source"), table.get("sensor")
    if isinstance(source, dict):
        sensor = sensor or source.get("sensor")
        motion = written_scenario(source, None, "case")
    else:
        keys = {k: table[k] for k in ("rate_hz", "sampling") if k in table}
        motion = specify(ScenarioSpec, name=source or "", **keys)
    if sensor is None:
        raise ConfigError("campaign.bulk-without-sensor", quantity="base, configuration, sensor")
    algorithms = table.get("algorithms") or ["quaternion"]
    return bulk_attitude(motion, str(sensor), str(algorithms[0]), seed)
