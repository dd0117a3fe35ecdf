"""Kinematics of a unit at a point of the vehicle, and the effect of each unknown there."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY as GRAVITY
from strapdown.crash.acceleration import force_at_rest
from strapdown.errors import DataError
from strapdown.sensors.crash_unit import SHAPES, Assumed, RecordedTriad, assumed_shapes
from strapdown.sensors.lever_arm import MovedImu, move_unit
from strapdown.sensors.pre_crash import FROM_GRAVITY, Levelling, PreparedUnit
from strapdown.sensors.rest import RestStretch
from strapdown.sensors.unmeasured import AXES, TURNS, axis_names, unmeasured_axes, unmeasured_turns
from strapdown.tables import ACCEL, GYRO

Array = NDArray[np.float64]

# Contributors common to all units of one vehicle.
VEHICLE = "vehicle"
# Signal parts faster than this count as vibration.
VIBRATION = 0.025  # s


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
        self.prepared, self.time_sd = prepared, time_sd
        lender = unit.lender or unit
        assert lender.gyro is not None
        self.lender, self.gyro = lender, lender.gyro
        self.turn, self.gyro_turn = unit.mounting.C_vs, lender.mounting.C_vs
        self.time = prepared.imu.index.to_numpy(dtype=np.float64)
        self.force = prepared.imu[ACCEL].to_numpy(dtype=np.float64)
        self.rate = prepared.imu[GYRO].to_numpy(dtype=np.float64)
        # In sensor axes.
        self.felt, self.turned = self.force @ self.turn, self.rate @ self.gyro_turn
        rest = prepared.rest
        has_rest = rest is not None and rest.accel_mean is not None
        self.rest_felt = (
            np.asarray(rest.accel_mean) @ self.turn if has_rest and rest else np.zeros(3)
        )
        self.has_rest = has_rest
        self.moved = moved
        self.names: list[str] = []
        self.contributors: list[str] = []
        self.forces: list[Array] = []
        self.rates: list[Array] = []
        self.rests: list[Array] = []
        self.tilts: list[Array] = []
        level = prepared.levelling
        self.unmeasured = unmeasured_axes(unit)
        self.measured = np.eye(3) - self.unmeasured
        self.level = rotation.dcm_from_euler([level.roll_deg, level.pitch_deg, 0.0])

    def collect(self) -> SampleEffects:
        for number in range(len(self.prepared.unit.accelerometers)):
            self._range(number)
        self._gyro()
        self._mounting()
        self._timing()
        self._levelling()
        self._assumed()
        count, n = len(self.names), len(self.time)
        return SampleEffects(
            tuple(self.names),
            tuple(self.contributors),
            np.array(self.forces).reshape(count, n, 3),
            np.array(self.rates).reshape(count, n, 3),
            np.array(self.rests).reshape(count, 3),
            np.array(self.tilts).reshape(count, 3),
            # Gyro noise through the lever arm is treated as independent for each sample. This is
            # conservative: the noise of successive slopes has opposite signs.
            _sd(self._noise()),
            _sd(self.prepared.gyro_noise_covariance),
        )

    def _add(
        self,
        name: str,
        contributor: str,
        force: Array | None,
        rate: Array | None,
        rest: Array,
        owner: str = "",
        tilt: Array | None = None,
        through_arm: bool = True,
    ) -> None:
        n = len(self.time)
        added = np.zeros((n, 3)) if force is None else force
        if rate is not None and through_arm and self.moved.lever_arm.any():
            added = added + self.moved.of_rate(rate)
        if contributor not in (MISSING_AXIS, LEVELLING):
            # Sensor and lever-arm errors do not affect an assumed axis.
            added, rest = added @ self.measured, rest @ self.measured
        # Matching the stationary force to the length of gravity cancels the component of an
        # unknown along it.
        if self.prepared.gravity_matched and self.has_rest and rest.any():
            along = self.turn @ self.rest_felt
            along = along / np.sqrt(along @ along)
            taken = (rest @ along) * along
            added, rest = added - taken, rest - taken
        name = f"{owner or self.prepared.unit.name} {name}"
        # Two parts of one name have separate unknowns.
        again = sum(known.split("#")[0] == name for known in self.names)
        self.names.append(f"{name}#{again + 1}" if again else name)
        self.contributors.append(contributor)
        self.forces.append(added)
        self.rates.append(np.zeros((n, 3)) if rate is None else rate)
        self.rests.append(rest)
        self.tilts.append(self._tilted(rest) if tilt is None else tilt)

    def _tilted(self, rest: Array) -> Array:
        if not self.prepared.levelling.from_rest:
            return np.zeros(3)
        return level_turned_by(rest, self.level)

    def _range(self, number: int) -> None:
        triad = self.prepared.unit.accelerometers[number]
        spoke = self.prepared.range_spoken == number
        source = self.prepared.bias_from[number]
        # Ranges whose bias was taken from this one carry its stationary error.
        heirs = np.isin(self.prepared.range_spoken, self._heirs(number))
        if not (spoke.any() or heirs.any()):
            return
        sd = triad.uncertainty
        bias = sd.axis("bias") if source is None else self.prepared.bias_sd[number]
        for axis in range(3):
            if bias[axis] > 0.0:
                what = "bias" if source is None else "bias against the lower range"
                what, one = f"{what} {XYZ[axis]}", constant(bias[axis])
                self._axis_effect(number, axis, spoke, heirs, one, what, "accelerometer bias", True)
        for name, contributor, effects in triad_curves(triad):
            for axis, label, effect in effects:
                self._axis_effect(
                    number, axis, spoke, heirs, effect, f"{name}{label}", contributor, False
                )
        self._vibration(triad, spoke)

    def _heirs(self, number: int) -> list[int]:
        found: list[int] = []
        for other, source in enumerate(self.prepared.bias_from):
            if source is not None and (source == number or source in found):
                found.append(other)
        return found

    def _axis_effect(
        self,
        number: int,
        axis: int,
        spoke: NDArray[np.bool_],
        heirs: NDArray[np.bool_],
        effect: Curve,
        name: str,
        contributor: str,
        constant: bool,
    ) -> None:
        at_rest = float(effect(self.rest_felt[None, :])[0]) if self.has_rest or constant else 0.0
        source = self.prepared.bias_from[number]
        calibrated = source is not None and source != FROM_GRAVITY
        one = np.zeros(len(self.time))
        here = spoke[:, axis]
        one[here] = effect(self.felt)[here]
        if calibrated and not constant:
            one[here] -= at_rest
        one[heirs[:, axis]] = 0.0 if calibrated and not constant else at_rest
        direction = self.turn[:, axis]
        rest = at_rest * direction if not calibrated and self.has_rest else np.zeros(3)
        triad = self.prepared.unit.accelerometers[number]
        self._add(f"{triad.name} {name}", contributor, np.outer(one, direction), None, rest)

    def _vibration(self, triad: RecordedTriad, spoke: NDArray[np.bool_]) -> None:
        sd = triad.uncertainty.axis("vibration_rectification")
        if not any(sd):
            return
        variance = self._vibrating()
        for axis in range(3):
            if sd[axis] > 0.0:
                one = sd[axis] * np.where(spoke[:, axis], variance[:, axis], 0.0)
                force = np.outer(one, self.turn[:, axis])
                self._add(
                    f"{triad.name} rectification {XYZ[axis]}",
                    "vibration rectification",
                    force,
                    None,
                    np.zeros(3),
                )

    def _vibrating(self) -> Array:
        from scipy.ndimage import uniform_filter1d

        step = float(np.median(np.diff(self.time)))
        width = max(3, 2 * round(0.5 * VIBRATION / step) + 1)
        smooth = uniform_filter1d(self.felt, width, axis=0, mode="nearest")
        return np.asarray(
            uniform_filter1d((self.felt - smooth) ** 2, width, axis=0, mode="nearest")
        )

    def _gyro(self) -> None:
        sd, owner, none = self.gyro.uncertainty, self.lender.name, np.zeros(3)
        # Prepared in the axes of this unit; a stationary bias is along the part's axes.
        square = (self.gyro_turn.T @ self.turn) ** 2
        biases = np.sqrt(square @ np.square(self.prepared.gyro_bias_sd))
        felt = (self.force - self.turn @ self.rest_felt) @ self.gyro_turn
        for axis in range(3):
            direction = self.gyro_turn[:, axis]
            bias = biases[axis]
            if bias > 0.0:
                rate = np.tile(bias * direction, (len(self.time), 1))
                self._add(f"gyro bias {XYZ[axis]}", GYRO_BIAS, None, rate, none, owner)
            for name, contributor, one in self._gyro_curves(axis):
                self._add(name, contributor, None, np.outer(one, direction), none, owner)
            slope = sd.axis("g_sensitivity")[axis]
            if slope > 0.0:
                for j in range(3):
                    one = slope * felt[:, j]
                    self._add(
                        f"g-sensitivity {XYZ[axis]} of {XYZ[j]}",
                        "gyro g-sensitivity",
                        None,
                        np.outer(one, direction),
                        none,
                        owner,
                    )

    def _gyro_curves(self, axis: int) -> Iterator[tuple[str, str, Array]]:
        for name, contributor, effects in triad_curves(self.gyro):
            for a, label, effect in effects:
                if a == axis:
                    yield f"gyro {name}{label}", f"gyro {contributor}", effect(self.turned)

    def _mounting(self) -> None:
        mounting = self.prepared.unit.mounting
        angle = np.radians(mounting.angles_sd_deg)
        rest = self.turn @ self.rest_felt if self.has_rest else np.zeros(3)
        lent = self.lender is not self.prepared.unit
        for axis in range(3):
            unit, name = np.eye(3)[axis], f"mounting {TURNS[axis]}"
            if angle > 0.0:
                felt, left = self.force, rest
                if self.prepared.bias_from[0] == FROM_GRAVITY:
                    felt, left = self.force - rest, np.zeros(3)
                self._add(
                    name,
                    MOUNTING,
                    angle * np.cross(unit, felt),
                    None if lent else angle * np.cross(unit, self.rate),
                    angle * np.cross(unit, left),
                )
            turned = np.radians(self.lender.mounting.angles_sd_deg)
            if lent and turned > 0.0:
                rate = turned * np.cross(unit, self.rate)
                self._add(name, MOUNTING, None, rate, np.zeros(3), self.lender.name)
            if mounting.position_sd > 0.0:
                # The sensor is further along the axis, so that the arm is shorter there.
                force = self.moved.lever @ (-mounting.position_sd * unit)
                self._add(f"lever arm {XYZ[axis]}", LEVER_ARM, force, None, np.zeros(3))

    def _noise(self) -> Array:
        of_both = self.prepared.noise_covariance + self.moved.added
        return np.asarray(self.measured @ of_both @ self.measured)

    def _assumed(self) -> None:
        for of in assumed_effects(self.prepared):
            self._add(of.name, of.contributor, of.force, of.rate, np.zeros(3), VEHICLE)

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
                self._add(f"levelling {name}", LEVELLING, force, None, shift, VEHICLE, tilt)
        steady = self.prepared.rest_accel_sd
        if steady > 0.0 and self.prepared.bias_from[0] == FROM_GRAVITY:
            for axis in range(3):
                force = np.tile(steady * np.eye(3)[axis], (n, 1))
                name = f"steady acceleration {XYZ[axis]}"
                self._add(name, "accelerometer bias", force, None, np.zeros(3), VEHICLE)

    def _timing(self) -> None:
        none = np.zeros(3)
        slope = np.gradient(self.rate, self.time, axis=0)
        if self.lender is not self.prepared.unit:
            # The clock of a borrowed gyro is that of its owner.
            if self.time_sd > 0.0:
                force = self.time_sd * np.gradient(self.force, self.time, axis=0)
                self._add("timing", "timing", force, None, none)
            late = self.lender.trigger_sd
            if late > 0.0:
                self._add("timing", "timing", None, late * slope, none, self.lender.name)
        elif self.time_sd > 0.0:
            # Force and rate are delayed together, and so is the lever-arm term.
            at_point = self.moved.imu[ACCEL].to_numpy(dtype=np.float64)
            force = self.time_sd * np.gradient(at_point, self.time, axis=0)
            self._add("timing", "timing", force, self.time_sd * slope, none, through_arm=False)


def _sd(covariances: Array) -> Array:
    return np.asarray(np.sqrt(np.diagonal(covariances, axis1=1, axis2=2)))


# Unknowns of assumed axes and rotation that a unit does not measure.


@dataclass(frozen=True, eq=False)
class AssumedEffect:
    """Effect of one standard deviation of an unknown: force, m/s², and rate, rad/s, (n, 3)."""

    name: str
    contributor: str
    force: Array | None
    rate: Array | None


def assumed_effects(prepared: PreparedUnit) -> Iterator[AssumedEffect]:
    """List the unknowns of a unit's assumptions, as unknowns of the vehicle.

    For rotation, two time functions about each vehicle axis (`Assumed`) and the second-order
    effect; for missing axes, two along each. A specific force f rotated by φ about e keeps ``f -
    φ²/2 (f - e (e·f))`` to second order: ``φ²/2`` has the mean ``sd²/2`` and the standard deviation
    ``sd²/√2``. The means of all axes are one unknown about zero, the deviations one each; as it is
    one-sided, 6.5 % lie beyond the 95 % bound. Products of a rotation and a missing axis are
    neglected: 4 deg and 0.8 m/s give 0.03 m/s.
    """
    unit = prepared.unit
    time = prepared.imu.index.to_numpy(dtype=np.float64)
    sampling = str(prepared.imu.attrs["sampling"])
    turning = (unit.lender or unit).assumed
    turns, axes = unmeasured_turns(unit), unmeasured_axes(unit)
    if turning is not None and turns.any():
        force = prepared.imu[ACCEL].to_numpy(dtype=np.float64)
        yield from _of_turning(turning, turns, time, sampling, force)
    if unit.assumed is not None and axes.any():
        shapes = assumed_shapes(time, unit.assumed.over, sampling)
        for name, along in _directions(unit.assumed.sd_of("delta_v_sd"), axes, AXES):
            for shape, how in zip(shapes, SHAPES, strict=True):
                yield AssumedEffect(
                    f"assumed velocity {name} {how}", MISSING_AXIS, np.outer(shape, along), None
                )


def _of_turning(
    assumed: Assumed, turns: Array, time: Array, sampling: str, force: Array
) -> Iterator[AssumedEffect]:
    shapes = assumed_shapes(time, assumed.over, sampling)
    steps = np.diff(time, prepend=2.0 * time[0] - time[1])
    turned = (np.cumsum(shapes * steps, axis=1) ** 2).sum(axis=0)
    means = np.zeros_like(force)
    for name, degrees in _directions(assumed.sd_of("turn_sd_deg"), turns, TURNS):
        about = np.radians(degrees)
        for shape, how in zip(shapes, SHAPES, strict=True):
            yield AssumedEffect(f"assumed {name} {how}", NO_TURNING, None, np.outer(shape, about))
        variance = float(about @ about)
        axis = about / math.sqrt(variance)
        across = force - np.outer(force @ axis, axis)
        mean = -0.5 * variance * turned[:, None] * across
        means += mean
        yield AssumedEffect(f"assumed {name} squared", NO_TURNING, math.sqrt(2.0) * mean, None)
    if means.any():
        yield AssumedEffect("assumed turns squared", NO_TURNING, means, None)


def _directions(
    sds: tuple[float, float, float], unmeasured: Array, names: tuple[str, ...]
) -> Iterator[tuple[str, Array]]:
    """Effect of one standard deviation about each vehicle axis along the assumed directions."""
    for axis, (name, sd) in enumerate(zip(names, sds, strict=True)):
        along = sd * unmeasured[:, axis]
        if along.any():
            yield name, along


# Errors of a triad that depend on its input: one standard deviation of each.

#: From the input of a triad, (n, 3), to the addition to the output of one axis, (n,).
Curve = Callable[[Array], Array]
#: The axis it is added to, the end of the unknown's name, the curve.
AxisCurve = tuple[int, str, Curve]

XYZ = "xyz"


def triad_curves(triad: RecordedTriad) -> Iterator[tuple[str, str, list[AxisCurve]]]:
    """List scale factor, misalignment and nonlinearity of a triad where their sd is not zero.

    Yields name, line of the error budget, and curves as (axis, end of the name, curve).
    """
    sd = triad.uncertainty
    scale, skew = sd.axis("scale"), sd.axis("misalignment")
    bend, full = sd.axis("nonlinearity_2"), sd.axis("full_scale")
    yield (
        "scale",
        "scale factor",
        [(a, f" {XYZ[a]}", _part(scale[a], a)) for a in range(3) if scale[a] > 0.0],
    )
    yield (
        "misalignment",
        "misalignment",
        [
            (a, f" {XYZ[j]}→{XYZ[a]}", _part(skew[a], j))
            for a in range(3)
            for j in range(3)
            if j != a and skew[a] > 0.0
        ],
    )
    yield (
        "nonlinearity",
        "nonlinearity",
        [(a, f" {XYZ[a]}", _square(bend[a] / full[a], a)) for a in range(3) if bend[a] > 0.0],
    )


def _part(gain: float, axis: int) -> Curve:
    def curve(felt: Array) -> Array:
        return np.asarray(gain * felt[:, axis])

    return curve


def _square(gain: float, axis: int) -> Curve:
    def curve(felt: Array) -> Array:
        return np.asarray(gain * felt[:, axis] ** 2)

    return curve


def constant(value: float) -> Curve:
    """Return a curve that does not depend on the input."""

    def curve(felt: Array) -> Array:
        return np.full(len(felt), value)

    return curve


# Effect of the unknowns of a unit on every sample at a point of the vehicle.


#: Lines of the error budget that other modules look up.
GYRO_BIAS = "gyro bias"
LEVELLING = "levelling"
LEVER_ARM = "lever arm"
MOUNTING = "mounting"
NO_TURNING = "assumed: no turning"
MISSING_AXIS = "assumed: missing axis"


@dataclass(frozen=True, eq=False)
class SampleEffects:
    """Effect of one standard deviation of each of p unknowns on n samples, in vehicle axes.

    Unknowns of the same name are one unknown, in whatever unit they appear; `contributors`: the
    line of the error budget of each. `force`, (p, n, 3), m/s², at the point; `rate`, (p, n, 3),
    rad/s; `rest_force`, (p, 3), m/s², on the stationary mean; `tilt`, (p, 3), rad, on the leveled
    attitude, in local level with forward as north. `force_noise`, `rate_noise`, (n, 3): standard
    deviation of the part independent from sample to sample.
    """

    names: tuple[str, ...]
    contributors: tuple[str, ...]
    force: Array
    rate: Array
    rest_force: Array
    tilt: Array
    force_noise: Array
    rate_noise: Array

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


#: Name that units without gyro have instead of that of a gyro's owner.
NO_GYRO = "no gyro"


@dataclass(frozen=True, eq=False)
class PointKinematics:
    """Kinematics from a unit, or the mean of several, at a point of the vehicle.

    `imu` in vehicle axes, time from the common trigger; `rest_accel_sd`, m/s²: of the vehicle's own
    acceleration over the stationary interval; `prepared` and `moved` are None for a mean of
    several; `unmeasured`, `unmeasured_turns`, (3, 3): projections onto the directions along which
    the force, and about which the rotation, is assumed; None where all are measured.
    """

    name: str
    imu: pd.DataFrame = field(repr=False)
    effects: SampleEffects = field(repr=False)
    levelling: Levelling
    rest: RestStretch | None
    rest_accel_sd: float = 0.0
    prepared: PreparedUnit | None = field(default=None, repr=False)
    moved: MovedImu | None = field(default=None, repr=False)
    unmeasured: Array | None = field(default=None, repr=False)
    unmeasured_turns: Array | None = field(default=None, repr=False)

    @property
    def assumed_axes(self) -> tuple[str, ...]:
        """Assumed axes: of ``forward right down`` and ``roll pitch heading``."""
        none = np.zeros((3, 3))
        return axis_names(
            none if self.unmeasured is None else self.unmeasured,
            none if self.unmeasured_turns is None else self.unmeasured_turns,
        )

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
        if self.unmeasured_turns is not None and np.trace(self.unmeasured_turns) > 2.5:
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
        axes if axes.any() else None,
        turns if turns.any() else None,
    )


def _but_along(axes: Array, moved: MovedImu, prepared: PreparedUnit) -> MovedImu:
    """Remove the lever-arm terms along assumed axes: the assumption holds at the point itself."""
    kept, imu = np.eye(3) - axes, moved.imu.copy()
    force = moved.imu[ACCEL].to_numpy(dtype=np.float64) @ kept
    imu[ACCEL] = force + prepared.imu[ACCEL].to_numpy(dtype=np.float64) @ axes
    imu.attrs = dict(moved.imu.attrs)
    return replace(moved, imu=imu, added=kept @ moved.added @ kept)
