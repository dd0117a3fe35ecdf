"""Kinematics of a unit at a point of the vehicle, and the effect of each unknown there."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY as GRAVITY
from strapdown.crash.acceleration import force_at_rest
from strapdown.dsp.samples import moving_mean
from strapdown.errors import DataError
from strapdown.sensors.crash_unit import (
    AXES,
    NO_GYRO,
    SHAPES,
    TURN_SHAPES,
    TURNS,
    Assumed,
    RecordedTriad,
    assumed_shapes,
    axis_names,
    turning_shapes,
    unmeasured_axes,
    unmeasured_turns,
)
from strapdown.sensors.lever_arm import MovedImu, move_unit
from strapdown.sensors.pre_crash import FROM_GRAVITY, Levelling, PreparedUnit
from strapdown.sensors.rest import RestStretch
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import Array

# Contributors common to all units of one vehicle.
VEHICLE = "vehicle"
# Signal parts faster than this count as vibration.
VIBRATION = 0.025  # s
XYZ = "xyz"
NONE = np.zeros(3)


def unit_effects(prepared: PreparedUnit, moved: MovedImu, *, time_sd: float = 0.0) -> SampleEffects:
    """List the unknowns of a unit and the effect of each at the point that it was `moved` to.

    Bias, scale factor, misalignment, nonlinearity and vibration rectification (of the variance
    about a moving mean of 25 ms) of every used range; the same for the gyro, with its
    g-sensitivity, and through the lever arm; mounting; lever arm; timing, with `time_sd`, s,
    relative to the common clock; and assumptions. An unknown without a standard deviation is left
    out; those of a borrowed gyro have the name of its unit, and those of the leveling belong to the
    vehicle. A range whose bias was taken from a lower one while stationary has the lower one's
    error there, and its own only as far as the input has changed since: ``e_l(f_rest) + e_h(f) -
    e_h(f_rest)``.
    """
    return _UnitEffects(prepared, moved, time_sd).collect()


class _UnitEffects:
    def __init__(self, prepared: PreparedUnit, moved: MovedImu, time_sd: float) -> None:
        unit = prepared.unit
        if unit.gyro is None:
            raise DataError("crash.no-gyro-nor-borrowed", file=unit.name, quantity="gyro")
        self.prepared, self.moved, self.time_sd = prepared, moved, time_sd
        self.unit, self.lender = unit, unit.lender or unit
        self.turn, self.gyro_turn = unit.mounting.C_vs, self.lender.mounting.C_vs
        self.time = prepared.imu.index.to_numpy(dtype=np.float64)
        self.force = prepared.imu[ACCEL].to_numpy(dtype=np.float64)
        self.rate = prepared.imu[GYRO].to_numpy(dtype=np.float64)
        # In sensor axes.
        self.felt, self.rest_felt = self.force @ self.turn, np.zeros(3)
        rest = prepared.rest
        self.has_rest = rest is not None and rest.accel_mean is not None
        if rest is not None and rest.accel_mean is not None:
            self.rest_felt = np.asarray(rest.accel_mean) @ self.turn
        self.names: list[str] = []
        self.contributors: list[str] = []
        self.parameters: list[Parameter | None] = []
        self.forces: list[Array] = []
        self.rates: list[Array] = []
        self.rests: list[Array] = []
        self.tilts: list[Array] = []
        level = prepared.levelling
        self.unmeasured = unmeasured_axes(unit)
        self.measured = np.eye(3) - self.unmeasured
        self.level = rotation.dcm_from_euler([level.roll_deg, level.pitch_deg, 0.0])

    def collect(self) -> SampleEffects:
        for number in range(len(self.unit.accelerometers)):
            self._range(number)
        self._gyro()
        self._mounting()
        self._timing()
        self._levelling()
        for name, contributor, force, rate in assumed_effects(self.prepared, self.moved.lever_arm):
            self._add(f"{VEHICLE} {name}", contributor, force, rate)
        count, n = len(self.names), len(self.time)
        noise = self.prepared.noise_covariance + self.moved.added
        return SampleEffects(
            tuple(self.names),
            tuple(self.contributors),
            np.array(self.forces).reshape(count, n, 3),
            np.array(self.rates).reshape(count, n, 3),
            np.array(self.rests).reshape(count, 3),
            np.array(self.tilts).reshape(count, 3),
            # Gyro noise through the lever arm is treated as independent for each sample. This is
            # conservative: the noise of successive slopes has opposite signs.
            _sd(self.measured @ noise @ self.measured),
            _sd(self.prepared.gyro_noise_covariance),
            tuple(self.parameters),
        )

    def _add(
        self,
        name: str,
        contributor: str,
        force: Array | None,
        rate: Array | None = None,
        rest: Array = NONE,
        tilt: Array | None = None,
        parameter: Parameter | None = None,
    ) -> None:
        n = len(self.time)
        added = np.zeros((n, 3)) if force is None else force
        if rate is not None and contributor != TIMING and self.moved.lever_arm.any():
            added = added + self.moved.of_rate(rate)
        if contributor not in (MISSING_AXIS, TURNED_AXIS, LEVELLING):
            # Sensor and lever-arm errors do not affect an assumed axis.
            added, rest = added @ self.measured, rest @ self.measured
        # Matching the stationary force to the length of gravity cancels the component of an
        # unknown along it.
        if self.prepared.gravity_matched and self.has_rest and rest.any():
            along = self.turn @ self.rest_felt
            along = along / np.sqrt(along @ along)
            taken = (rest @ along) * along
            added, rest = added - taken, rest - taken
        if tilt is None:
            from_rest = self.prepared.levelling.from_rest
            tilt = level_turned_by(rest, self.level) if from_rest else NONE
        # Two parts of one name have separate unknowns.
        again = sum(known.split("#")[0] == name for known in self.names)
        self.names.append(f"{name}#{again + 1}" if again else name)
        self.contributors.append(contributor)
        self.parameters.append(parameter)
        self.forces.append(added)
        self.rates.append(np.zeros((n, 3)) if rate is None else rate)
        self.rests.append(rest)
        self.tilts.append(tilt)

    def _range(self, number: int) -> None:
        triad = self.unit.accelerometers[number]
        spoke = self.prepared.range_spoken == number
        source = self.prepared.bias_from[number]
        # Ranges whose bias was taken from this one carry its stationary error.
        heirs = np.isin(self.prepared.range_spoken, self._heirs(number))
        if not (spoke.any() or heirs.any()):
            return
        name = f"{self.unit.name} {triad.name}"
        # The effect at rest comes first.
        felt = np.vstack([self.rest_felt, self.felt])
        bias = triad.uncertainty.axis("bias") if source is None else self.prepared.bias_sd[number]
        what = "bias" if source is None else "bias against the lower range"
        errors: list[InputError] = [
            (f"{what} {XYZ[axis]}", ACCEL_BIAS, axis, np.full(len(felt), bias[axis]))
            for axis in range(3)
            if bias[axis] > 0.0
        ]
        calibrated = source is not None and source != FROM_GRAVITY
        for label, contributor, axis, values in (*errors, *input_errors(triad, felt)):
            of_bias = contributor == ACCEL_BIAS
            at_rest = float(values[0]) if self.has_rest or of_bias else 0.0
            since_rest = calibrated and not of_bias
            one, here = np.zeros(len(self.time)), spoke[:, axis]
            one[here] = values[1:][here]
            if since_rest:
                one[here] -= at_rest
            one[heirs[:, axis]] = 0.0 if since_rest else at_rest
            direction = self.turn[:, axis]
            rest = at_rest * direction if not calibrated and self.has_rest else NONE
            of = None
            if of_bias and not calibrated:
                of = Parameter("bias", axis, bias[axis], name)
            elif label == f"scale {XYZ[axis]}":
                of = Parameter("scale", axis, triad.uncertainty.axis("scale")[axis], name)
            force = np.outer(one, direction)
            self._add(f"{name} {label}", contributor, force, rest=rest, parameter=of)
        sd = triad.uncertainty.axis("vibration_rectification")
        if not any(sd):
            return
        fast = self.felt - slow_part(self.felt, self.time)
        variance = slow_part(fast**2, self.time)
        for axis in range(3):
            if sd[axis] > 0.0:
                one = sd[axis] * np.where(spoke[:, axis], variance[:, axis], 0.0)
                force = np.outer(one, self.turn[:, axis])
                self._add(f"{name} rectification {XYZ[axis]}", "vibration rectification", force)

    def _heirs(self, number: int) -> list[int]:
        found: list[int] = []
        for other, source in enumerate(self.prepared.bias_from):
            if source is not None and (source == number or source in found):
                found.append(other)
        return found

    def _gyro(self) -> None:
        gyro, owner = self.lender.gyro, self.lender.name
        assert gyro is not None
        # Prepared in the axes of this unit; a stationary bias is along the part's axes.
        square = (self.gyro_turn.T @ self.turn) ** 2
        biases = np.sqrt(square @ np.square(self.prepared.gyro_bias_sd))
        felt = (self.force - self.turn @ self.rest_felt) @ self.gyro_turn
        errors = list(input_errors(gyro, self.rate @ self.gyro_turn))
        for axis in range(3):
            direction = self.gyro_turn[:, axis]
            if biases[axis] > 0.0:
                rate = np.tile(biases[axis] * direction, (len(self.time), 1))
                of = Parameter("gyro bias", axis, biases[axis], f"{owner} gyro")
                name = f"{owner} gyro bias {XYZ[axis]}"
                self._add(name, GYRO_BIAS, None, rate, parameter=of)
            for name, contributor, of_axis, one in errors:
                if of_axis == axis:
                    rate = np.outer(one, direction)
                    scale = gyro.uncertainty.axis("scale")[axis]
                    of_scale = name == f"scale {XYZ[axis]}"
                    self._add(
                        f"{owner} gyro {name}",
                        f"gyro {contributor}",
                        None,
                        rate,
                        parameter=Parameter("gyro scale", axis, scale, f"{owner} gyro")
                        if of_scale
                        else None,
                    )
            slope = gyro.uncertainty.axis("g_sensitivity")[axis]
            if slope > 0.0:
                for j in range(3):
                    name = f"{owner} g-sensitivity {XYZ[axis]} of {XYZ[j]}"
                    rate = np.outer(slope * felt[:, j], direction)
                    self._add(name, "gyro g-sensitivity", None, rate)

    def _mounting(self) -> None:
        mounting, own = self.unit.mounting, self.unit.name
        angle = np.radians(mounting.angles_sd_deg)
        rest = self.turn @ self.rest_felt if self.has_rest else NONE
        lent = self.lender is not self.unit
        for axis in range(3):
            unit, name = np.eye(3)[axis], f"mounting {TURNS[axis]}"
            if angle > 0.0:
                felt, left = self.force, rest
                if self.prepared.bias_from[0] == FROM_GRAVITY:
                    felt, left = self.force - rest, NONE
                self._add(
                    f"{own} {name}",
                    MOUNTING,
                    angle * np.cross(unit, felt),
                    None if lent else angle * np.cross(unit, self.rate),
                    angle * np.cross(unit, left),
                    parameter=Parameter("mounting", axis, float(angle), own),
                )
            turned = np.radians(self.lender.mounting.angles_sd_deg)
            if lent and turned > 0.0:
                rate = turned * np.cross(unit, self.rate)
                self._add(f"{self.lender.name} {name}", MOUNTING, None, rate)
            if mounting.position_sd > 0.0:
                # The sensor is further along the axis, so that the arm is shorter there.
                force = self.moved.lever @ (-mounting.position_sd * unit)
                self._add(f"{own} lever arm {XYZ[axis]}", LEVER_ARM, force)

    def _levelling(self) -> None:
        sd = np.radians(self.prepared.levelling.sd_deg)
        n = len(self.time)
        for axis, name in enumerate(("north", "east")):
            tilt = sd * np.eye(3)[axis]
            # A bias taken from gravity in a stated attitude inherits the attitude error.
            shift = -self.level.T @ np.cross(tilt, [0.0, 0.0, -GRAVITY])
            if self.prepared.bias_from[0] != FROM_GRAVITY:
                # Gravity was added along an assumed axis in any case.
                shift = self.unmeasured @ shift
            if sd > 0.0:
                force = np.tile(shift, (n, 1))
                self._add(f"{VEHICLE} levelling {name}", LEVELLING, force, rest=shift, tilt=tilt)
        steady = self.prepared.rest_accel_sd
        if steady > 0.0 and self.prepared.bias_from[0] == FROM_GRAVITY:
            for axis in range(3):
                force = np.tile(steady * np.eye(3)[axis], (n, 1))
                self._add(f"{VEHICLE} steady acceleration {XYZ[axis]}", ACCEL_BIAS, force)

    def _timing(self) -> None:
        name = f"{self.unit.name} timing"
        slope = np.gradient(self.rate, self.time, axis=0)
        if self.lender is not self.unit:
            # The clock of a borrowed gyro is that of its owner.
            if self.time_sd > 0.0:
                force = self.time_sd * np.gradient(self.force, self.time, axis=0)
                self._add(name, TIMING, force)
            late = self.lender.trigger_sd
            if late > 0.0:
                # The correction for the lever arm is as late as the rate.
                moved = self.moved.of_rate(late * slope) if self.moved.lever_arm.any() else None
                self._add(f"{self.lender.name} timing", TIMING, moved, late * slope)
        elif self.time_sd > 0.0:
            # Force and rate are delayed together, and so is the lever-arm term.
            at_point = self.moved.imu[ACCEL].to_numpy(dtype=np.float64)
            force = self.time_sd * np.gradient(at_point, self.time, axis=0)
            self._add(name, TIMING, force, self.time_sd * slope)


def slow_part(values: Array, time: Array) -> Array:
    """Mean of values, (n, k), about each stamp over the time of `VIBRATION`."""
    step = float(np.median(np.diff(time)))
    width = max(3, 2 * round(0.5 * VIBRATION / step) + 1)
    return moving_mean(values, width)


def _sd(covariances: Array) -> Array:
    return np.asarray(np.sqrt(np.diagonal(covariances, axis1=1, axis2=2)))


# Unknowns of assumed axes and rotation that a unit does not measure.


#: Name, line of the error budget, and effect of one sd on force, m/s², and rate, rad/s, (n, 3).
AssumedEffect = tuple[str, str, Array | None, Array | None]


def assumed_effects(prepared: PreparedUnit, lever_arm: Array) -> Iterator[AssumedEffect]:
    """List the unknowns of a unit's assumptions, as unknowns of the vehicle.

    `lever_arm`, (3,), m: from the unit to the point.

    For rotation, two time functions about each vehicle axis (`Assumed`), by the force less gravity
    and without vibration, and the second-order effect; for missing axes, two along each. A specific
    force f rotated by φ about e keeps ``f - φ²/2 (f - e (e·f))`` to second order: ``φ²/2`` has the
    mean ``sd²/2`` and the standard deviation ``sd²/√2``. The means of all axes are one unknown
    about zero, the deviations one each; as it is one-sided, 6.5 % lie beyond the 95 % bound. The
    centripetal acceleration ``ω² (r - e (e·r))`` of a lever arm r has the root mean square
    ``√3 sd²`` of a normal rate, and is one unknown. Products of a rotation and a missing axis are
    neglected: 4 deg and 0.8 m/s give 0.03 m/s.

    A change of velocity along a missing axis may be stated along the axis as it was at the impact,
    as a film or tire marks show it, or as it turns with the vehicle. With the specific force f of
    the measured axes and a rotation φ these differ by ``φ × f`` along the missing axis: 2 deg and
    18 m/s by 0.2 m/s. As either may be meant, a turning that no gyro measures has this as unknowns
    of its own, beside the error of the attitude that it makes.
    """
    unit = prepared.unit
    time = prepared.imu.index.to_numpy(dtype=np.float64)
    sampling = str(prepared.imu.attrs["sampling"])
    turning = (unit.lender or unit).assumed
    turns, axes = unmeasured_turns(unit), unmeasured_axes(unit)
    if turning is not None and turns.any():
        force = prepared.imu[ACCEL].to_numpy(dtype=np.float64)
        rest, level = prepared.rest, prepared.levelling
        if rest is None or rest.accel_mean is None:
            at_rest = force_at_rest(level.roll_deg, level.pitch_deg, GRAVITY)
        else:
            at_rest = np.asarray(rest.accel_mean)
        free = slow_part((force - at_rest) @ (np.eye(3) - axes), time)
        shapes = turning_shapes(time, turning.over, sampling, np.linalg.norm(free, axis=1))
        yield from _of_turning(turning, turns, (time, shapes), force, lever_arm)
        if axes.any():
            yield from _of_turned_axes(turning, turns, (time, shapes), free, axes)
    if unit.assumed is not None and axes.any():
        shapes = assumed_shapes(time, unit.assumed.over, sampling)
        for name, along in _directions(unit.assumed.sd_of("delta_v_sd"), axes, AXES):
            for shape, how in zip(shapes, SHAPES, strict=True):
                force = np.outer(shape, along)
                yield f"assumed velocity {name} {how}", MISSING_AXIS, force, None


def _of_turning(
    assumed: Assumed, turns: Array, profiles: tuple[Array, Array], force: Array, lever_arm: Array
) -> Iterator[AssumedEffect]:
    """Of a turning whose rates at the stamps, (n,), are the shapes, (k, n)."""
    time, shapes = profiles
    steps = np.diff(time, prepend=2.0 * time[0] - time[1])
    turned = (np.cumsum(shapes * steps, axis=1) ** 2).sum(axis=0)
    means = np.zeros_like(force)
    for name, degrees in _directions(assumed.sd_of("turn_sd_deg"), turns, TURNS):
        about = np.radians(degrees)
        for shape, how in zip(shapes, TURN_SHAPES, strict=True):
            yield f"assumed {name} {how}", NO_TURNING, None, np.outer(shape, about)
        variance = float(about @ about)
        axis = about / math.sqrt(variance)
        across = force - np.outer(force @ axis, axis)
        mean = -0.5 * variance * turned[:, None] * across
        means += mean
        yield f"assumed {name} squared", NO_TURNING, math.sqrt(2.0) * mean, None
        if lever_arm.any():
            inward = lever_arm - (lever_arm @ axis) * axis
            rates = variance * (shapes**2).sum(axis=0)
            yield (
                f"assumed {name} inward",
                NO_TURNING,
                math.sqrt(3.0) * np.outer(rates, inward),
                None,
            )
    if means.any():
        yield "assumed turns squared", NO_TURNING, means, None


def _of_turned_axes(
    assumed: Assumed, turns: Array, profiles: tuple[Array, Array], free: Array, axes: Array
) -> Iterator[AssumedEffect]:
    """What turned axes measure along missing ones, (3, 3), by the force without gravity, (n, 3)."""
    time, shapes = profiles
    steps = np.diff(time, prepend=2.0 * time[0] - time[1])
    for name, degrees in _directions(assumed.sd_of("turn_sd_deg"), turns, TURNS):
        across = np.cross(np.radians(degrees), free) @ axes
        if across.any():
            for shape, how in zip(shapes, TURN_SHAPES, strict=True):
                leak = np.cumsum(shape * steps)[:, None] * across
                yield f"assumed axis turned by {name} {how}", TURNED_AXIS, leak, None


def _directions(
    sds: tuple[float, float, float], unmeasured: Array, names: tuple[str, ...]
) -> Iterator[tuple[str, Array]]:
    """Effect of one standard deviation about each vehicle axis along the assumed directions."""
    for axis, (name, sd) in enumerate(zip(names, sds, strict=True)):
        along = sd * unmeasured[:, axis]
        if along.any():
            yield name, along


# Errors of a triad that depend on its input: one standard deviation of each.

#: Name, line of the error budget, axis of the output, and addition to that axis, (n,).
InputError = tuple[str, str, int, Array]


def input_errors(triad: RecordedTriad, felt: Array) -> Iterator[InputError]:
    """List scale factor, misalignment and nonlinearity of a triad where their sd is not zero.

    `felt`, (n, 3): input of the triad, in its axes.
    """
    sd = triad.uncertainty
    scale, skew = sd.axis("scale"), sd.axis("misalignment")
    bend, full = sd.axis("nonlinearity_2"), sd.axis("full_scale")
    for a, axis in enumerate(XYZ):
        if scale[a] > 0.0:
            yield f"scale {axis}", "scale factor", a, scale[a] * felt[:, a]
    for a, axis in enumerate(XYZ):
        for j, other in enumerate(XYZ):
            if j != a and skew[a] > 0.0:
                yield f"misalignment {other}→{axis}", "misalignment", a, skew[a] * felt[:, j]
    for a, axis in enumerate(XYZ):
        if bend[a] > 0.0:
            added = (bend[a] / full[a]) * felt[:, a] ** 2
            yield f"nonlinearity {axis}", "nonlinearity", a, added


# Effect of the unknowns of a unit on every sample at a point of the vehicle.


#: Lines of the error budget.
ACCEL_BIAS = "accelerometer bias"
GYRO_BIAS = "gyro bias"
LEVELLING = "levelling"
LEVER_ARM = "lever arm"
MOUNTING = "mounting"
NO_TURNING = "assumed: no turning"
MISSING_AXIS = "assumed: missing axis"
TURNED_AXIS = "assumed: missing axis turned"
TIMING = "timing"


class Parameter(NamedTuple):
    """An unknown that a drive before the crash may determine.

    `quantity`: ``bias``, ``scale`` (m/s² and relative), ``gyro bias``, ``gyro scale`` (rad/s and
    relative), or ``mounting`` (rad, about an axis of the vehicle); `axis`: 0 to 2; `sd`: as stated;
    `of`: the sensor or the unit.
    """

    quantity: str
    axis: int
    sd: float
    of: str


@dataclass(frozen=True, eq=False)
class SampleEffects:
    """Effect of one standard deviation of each of p unknowns on n samples, in vehicle axes.

    Unknowns of the same name are one unknown, in whatever unit they appear; `contributors`: the
    line of the error budget of each. `force`, (p, n, 3), m/s², at the point; `rate`, (p, n, 3),
    rad/s; `rest_force`, (p, 3), m/s², on the stationary mean; `tilt`, (p, 3), rad, on the leveled
    attitude, in local level with forward as north. `force_noise`, `rate_noise`, (n, 3): standard
    deviation of the part independent from sample to sample. `parameters`: what each unknown is, or
    None; empty where no unit has them.
    """

    names: tuple[str, ...]
    contributors: tuple[str, ...]
    force: Array
    rate: Array
    rest_force: Array
    tilt: Array
    force_noise: Array
    rate_noise: Array
    parameters: tuple[Parameter | None, ...] = ()

    @property
    def roll_bias_sd(self) -> float:
        """Standard deviation of the bias about the forward axis, rad/s."""
        of_bias = [k for k, name in enumerate(self.contributors) if name == GYRO_BIAS]
        return float(np.sqrt((self.rate[of_bias, 0, 0] ** 2).sum()))


def level_turned_by(rest: Array, level: Array) -> Array:
    """Tilt of the level, (..., 3), rad, by an error of the stationary force, (..., 3), m/s².

    `level`, (3, 3), is from vehicle axes into local level, heading zero.
    """
    felt = rest @ level.T / GRAVITY
    return np.stack([-felt[..., 1], felt[..., 0], np.zeros(felt.shape[:-1])], axis=-1)


# Kinematics of a unit at a point of the vehicle, with the effects of its unknowns.


@dataclass(frozen=True, eq=False)
class PointKinematics:
    """Kinematics from a unit, or the mean of several, at a point of the vehicle.

    `imu` in vehicle axes, time from the common trigger; `rest_accel_sd`, m/s²: of the vehicle's own
    acceleration over the stationary interval; `prepared` and `moved` are None for a mean of
    several; `unmeasured`, `unmeasured_turns`, (3, 3): projections onto the directions along which
    the force, and about which the rotation, is assumed; zero where all are measured.
    """

    name: str
    imu: pd.DataFrame = field(repr=False)
    effects: SampleEffects = field(repr=False)
    levelling: Levelling
    rest: RestStretch | None
    rest_accel_sd: float = 0.0
    prepared: PreparedUnit | None = field(default=None, repr=False)
    moved: MovedImu | None = field(default=None, repr=False)
    unmeasured: Array = field(default_factory=lambda: np.zeros((3, 3)), repr=False)
    unmeasured_turns: Array = field(default_factory=lambda: np.zeros((3, 3)), repr=False)

    @property
    def assumed_axes(self) -> tuple[str, ...]:
        """Assumed axes: of ``forward right down`` and ``roll pitch heading``."""
        return axis_names(self.unmeasured, self.unmeasured_turns)

    @property
    def assumed_until(self) -> float:
        """End of the time for which an assumed turning is stated, s; infinite with a gyro."""
        unit = None if self.prepared is None else self.prepared.unit
        assumed = None if unit is None else (unit.lender or unit).assumed
        turns = assumed is not None and self.unmeasured_turns.any()
        return assumed.over[1] if assumed is not None and turns else math.inf

    @property
    def time(self) -> Array:
        """Stamps, (n,), s."""
        return np.asarray(self.imu.index.to_numpy(), dtype=np.float64)

    @property
    def force(self) -> Array:
        """Specific force, (n, 3), m/s²."""
        return np.ascontiguousarray(self.imu[ACCEL].to_numpy(dtype=np.float64))

    @property
    def rate(self) -> Array:
        """Rates, (n, 3), rad/s."""
        return np.ascontiguousarray(self.imu[GYRO].to_numpy(dtype=np.float64))

    @property
    def gyro(self) -> str:
        """Name of the unit that has the gyro, which others may borrow; or `NO_GYRO`."""
        if np.trace(self.unmeasured_turns) > 2.5:
            return NO_GYRO
        lender = None if self.prepared is None else self.prepared.unit.lender
        return self.name if lender is None else lender.name

    def resting_force(self, gravity: float) -> tuple[Array, Array]:
        """Mean specific force before the crash and its standard deviation, (3,) each, m/s².

        Without a stationary interval, gravity, m/s², in the stated attitude.
        """
        rest, level = self.rest, self.levelling
        if rest is None:
            tilt = gravity * math.radians(level.sd_deg)
            force = force_at_rest(level.roll_deg, level.pitch_deg, gravity)
            return force, np.array([tilt, tilt, 0.0])
        within = (self.imu.index >= rest.start - 1e-9) & (self.imu.index <= rest.end + 1e-9)
        mean = self.imu.loc[within, ACCEL].to_numpy(dtype=np.float64).mean(axis=0)
        noise = np.zeros(3) if rest.accel_mean_sd is None else np.asarray(rest.accel_mean_sd)
        return mean, np.hypot(noise, self.rest_accel_sd)


def at_point(
    prepared: PreparedUnit,
    point: Sequence[float],
    *,
    time_sd: float | None = None,
    window: float | None = None,
) -> PointKinematics:
    """Move a prepared unit to a point and list its unknowns there.

    Parameters
    ----------
    prepared : PreparedUnit
    point : sequence of float, (3,), m
        Vehicle axes, from the vehicle's origin.
    time_sd : float, s, optional
        Standard deviation of the unit's clock relative to the common one; by default that of its
        trigger.
    window : float, s, optional
        Of the derivative, as in `move_imu`.
    """
    moved = move_unit(prepared, point, window=window)
    axes, turns = unmeasured_axes(prepared.unit), unmeasured_turns(prepared.unit)
    if axes.any():
        moved = _but_along(axes, moved, prepared)
    sd = prepared.unit.trigger_sd if time_sd is None else time_sd
    return PointKinematics(
        prepared.unit.name,
        moved.imu,
        unit_effects(prepared, moved, time_sd=sd),
        prepared.levelling,
        prepared.rest,
        prepared.rest_accel_sd,
        prepared,
        moved,
        axes,
        turns,
    )


def _but_along(axes: Array, moved: MovedImu, prepared: PreparedUnit) -> MovedImu:
    """Remove the lever-arm terms along assumed axes: the assumption holds at the point itself."""
    kept, imu = np.eye(3) - axes, moved.imu.copy()
    force = moved.imu[ACCEL].to_numpy(dtype=np.float64) @ kept
    imu[ACCEL] = force + prepared.imu[ACCEL].to_numpy(dtype=np.float64) @ axes
    imu.attrs = dict(moved.imu.attrs)
    return replace(moved, imu=imu, added=kept @ moved.added @ kept)
