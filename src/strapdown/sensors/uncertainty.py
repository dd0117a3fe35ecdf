"""Stated uncertainty of a triad of sensors, from data sheets or the user; unit draws."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from strapdown.errors import ConfigError
from strapdown.sensors.catalogue import KEYS, Key, Sensor
from strapdown.sensors.error_chain import Seed, child
from strapdown.sensors.triad_errors import Triad, TriadErrors, TriadLike, matrix_of, triad_of
from strapdown.tables.checks import Array, is_number
from strapdown.units import GYRO_UNITS

# A component with a smaller share of an axis is not affected by that axis's range limit.
FEELS = 1e-3
# Known properties of the range, not standard deviations; they may be infinite.
FACTS = ("full_scale", "quantization", "bandwidth")
WHERE_ZERO_IS_NOTHING = ("full_scale", "bandwidth")


@dataclass(frozen=True)
class TriadUncertainty:
    """Standard deviations of the errors of a triad, and the known properties of its range.

    The unit u is rad/s for gyros and m/s² for accelerometers. A single number applies to all axes.
    All errors are independent and normal with zero mean; they act as in `error_chain`.

    Attributes
    ----------
    noise_density : triad, u/√Hz
        White noise: a sample over an interval dt has the standard deviation ``noise_density /
        √dt``.
    bias : triad, u
        Bias of a record, before any estimation.
    scale : triad
        Relative.
    misalignment : triad, rad
        Each of the two angles by which an axis senses the other two.
    nonlinearity_2 : triad
        Relative to full scale, at full-scale input.
    g_sensitivity : triad, u per m/s²
        For gyros: each of the three terms of an axis.
    vibration_rectification : triad, u per (m/s²)²
        Output shift per vibration variance along the axis.
    full_scale : triad, u
        The output is clipped to ± this.
    quantization : triad, u
        Quantization step.
    bandwidth : float, Hz
        Of the single-pole low-pass before the sampler.

    Raises
    ------
    ConfigError
        A number is negative or not finite, or a full scale or a bandwidth is zero.
    """

    noise_density: TriadLike = 0.0
    bias: TriadLike = 0.0
    scale: TriadLike = 0.0
    misalignment: TriadLike = 0.0
    nonlinearity_2: TriadLike = 0.0
    g_sensitivity: TriadLike = 0.0
    vibration_rectification: TriadLike = 0.0
    full_scale: TriadLike = math.inf
    quantization: TriadLike = 0.0
    bandwidth: float = math.inf

    def __post_init__(self) -> None:
        for f in fields(self):
            given = getattr(self, f.name)
            numbers = _numbers(given, f.name)
            if f.name != "bandwidth":
                numbers = numbers * 3 if len(numbers) == 1 else numbers
            if len(numbers) != (1 if f.name == "bandwidth" else 3):
                raise ConfigError("sensors.not-right-shape", quantity=f.name, given=given)
            if any(math.isnan(x) or x < 0.0 for x in numbers) or (
                f.name not in FACTS and any(math.isinf(x) for x in numbers)
            ):
                raise ConfigError(
                    "sensors.no-standard-deviation-or-range", quantity=f.name, given=given
                )
            if f.name in WHERE_ZERO_IS_NOTHING and 0.0 in numbers:
                raise ConfigError("sensors.leaves-nothing-measure", quantity=f.name, given=given)
            value = tuple(float(x) for x in numbers)
            object.__setattr__(self, f.name, value[0] if f.name == "bandwidth" else value)
        if any(
            n > 0.0 and math.isinf(r)
            for n, r in zip(self.axis("nonlinearity_2"), self.axis("full_scale"), strict=True)
        ):
            raise ConfigError("sensors.nonlinearity-relative-none", quantity="full_scale")

    def axis(self, name: str) -> Triad:
        """Return a per-axis attribute as three numbers."""
        value: Triad = getattr(self, name)
        return value

    def mapped(self, sd: Callable[[Array], Array], full_scale: Array) -> TriadUncertainty:
        """Map the standard deviations of the axes, (3,) to (3,), and replace the range."""
        names = [f.name for f in fields(self) if f.name not in ("full_scale", "bandwidth")]
        values: dict[str, Any] = {n: triad_of(sd(np.array(self.axis(n)))) for n in names}
        return replace(self, full_scale=triad_of(full_scale), **values)

    def turned(self, C: Array) -> TriadUncertainty:
        """Rotate into other axes; `C` ((3, 3)) rotates vectors into them.

        Standard deviations as for independent axes, ``sd² -> (C ∘ C) sd²``; the range of an axis is
        the least of the contributing ranges.
        """
        limits = np.where(np.abs(C) > FEELS, np.array(self.full_scale), np.inf).min(axis=1)
        return self.mapped(lambda sd: np.asarray(np.sqrt(C**2 @ np.square(sd))), limits)

    def variance_by_input(self, value: Array) -> Array:
        """Return the error variance from scale factors and misalignments for a constant input.

        Parameters
        ----------
        value : ndarray, (3,), u

        Returns
        -------
        ndarray, (3,), u²
            Variance of the reading of each axis.
        """
        squares = value * value
        across = float(value @ value) - squares
        scale, misalignment = self.axis("scale"), self.axis("misalignment")
        return np.asarray(np.square(scale) * squares + np.square(misalignment) * across)


def _numbers(given: Any, name: str) -> tuple[float, ...]:
    try:
        numbers = (given,) if is_number(given) else tuple(given)
        if isinstance(given, str) or not all(is_number(x) for x in numbers):
            raise TypeError
        return tuple(float(x) for x in numbers)
    except TypeError:
        raise ConfigError("sensors.uncertainty-not-a-number", quantity=name, given=given) from None


# Unit-to-unit uncertainty from a data sheet, as standard deviations.

TRIADS = ("gyro", "accel")
# Quantities of a data sheet, and the attributes of `TriadUncertainty` for their spread.
SPREADS = {
    "bias": "bias",
    "scale": "scale",
    "misalignment": "misalignment",
    "g_sensitivity": "g_sensitivity",
    "nonlinearity": "nonlinearity_2",
}
SHEET_FACTS = ("noise_density", "full_scale", "quantization", "bandwidth")


def uncertainty_of(sensor: Sensor, triad: str, **overrides: TriadLike) -> TriadUncertainty:
    """Convert a catalogue sensor to the uncertainty of one of its units.

    `triad` ({'gyro', 'accel'}). `**overrides`: attributes of `TriadUncertainty`, in its units, that
    replace the data sheet's, for example from a calibration. A standard deviation of the data sheet
    is used unchanged; a bound is divided by √3 (uniform distribution). The bound of a nonlinearity
    is assigned entirely to its second order: the third has zero mean, and a data sheet does not
    separate them. Drifts within a record (bias instability, random walk, trend) are not included.
    ConfigError: the sensor lacks that triad, or an override is not one of the attributes.
    """
    if triad not in TRIADS or not any(f.key.startswith(f"{triad}.") for f in sensor.sources):
        raise ConfigError(
            "sensors.sensor-no-triad",
            quantity="triad",
            name=sensor.name,
            triad=triad,
            triads=TRIADS,
        )
    errors = sensor.imu_errors.gyro if triad == "gyro" else sensor.imu_errors.accel
    values: dict[str, Any] = {name: getattr(errors, name) for name in SHEET_FACTS}
    spreads = sensor.spreads.get(triad, {})
    for name, spread in spreads.items():
        part = 1.0 if spread.kind == "sd" else 1.0 / math.sqrt(3.0)
        values[SPREADS[name]] = tuple(x * part for x in spread.size)
    try:
        return TriadUncertainty(**{**values, **overrides})
    except TypeError:
        known = TriadUncertainty.__dataclass_fields__
        wrong = ", ".join(name for name in overrides if name not in known)
        raise ConfigError(
            "sensors.triad-no", quantity="overrides", wrong=wrong, known=known
        ) from None


# Uncertainty of gyros and accelerometers for alignment and navigation.


@dataclass(frozen=True)
class BiasDrift:
    """Bias drift within a record: a first-order Gauss-Markov process and a random walk.

    Attributes
    ----------
    sd : triad, rad/s or m/s²
        Steady-state standard deviation of the process.
    correlation_time : float, s
        Infinite for a constant bias.
    walk : triad, rad/s/√s or m/s²/√s
        Drive of the random walk.
    """

    sd: TriadLike = 0.0
    correlation_time: float = math.inf
    walk: TriadLike = 0.0

    def __post_init__(self) -> None:
        for name in ("sd", "walk"):
            size = getattr(self, name)
            given = (size,) * 3 if isinstance(size, int | float) else tuple(size)
            if len(given) != 3 or not all(is_number(x) and 0.0 <= x < math.inf for x in given):
                raise ConfigError("sensors.no-standard-deviation", quantity=name, sd=size)
            object.__setattr__(self, name, tuple(float(x) for x in given))
        if not is_number(self.correlation_time) or not self.correlation_time > 0.0:
            raise ConfigError(
                "sensors.no-time",
                quantity="correlation_time",
                correlation_time=self.correlation_time,
            )

    @property
    def triad(self) -> Triad:
        """Standard deviation of the process of each axis."""
        return self.sd  # type: ignore[return-value]

    @property
    def steps(self) -> Triad:
        """Drive of the random walk of each axis."""
        return self.walk  # type: ignore[return-value]

    def moved(self, length: float) -> Array:
        """Variance of the change of the bias over a time in s, (3,)."""
        process = -2.0 * math.expm1(-length / self.correlation_time) * np.square(self.triad)
        return np.asarray(process + length * np.square(self.steps))


@dataclass(frozen=True)
class ImuUncertainty:
    """Standard deviations of the errors of gyros and accelerometers, in SI.

    Attributes
    ----------
    gyro, accel : TriadUncertainty
        Errors constant over a record, and white noise.
    gyro_drift, accel_drift : BiasDrift
        Bias drift within it.
    """

    gyro: TriadUncertainty
    accel: TriadUncertainty
    gyro_drift: BiasDrift = field(default_factory=BiasDrift)
    accel_drift: BiasDrift = field(default_factory=BiasDrift)

    def gyro_bias_variance(self) -> Array:
        """Variances of the gyro biases with their drift, (3,), rad²/s²."""
        return np.asarray(np.square(self.gyro.axis("bias")) + np.square(self.gyro_drift.triad))

    def accel_bias_variance(self) -> Array:
        """Variances of the accelerometer biases with their drift, (3,), m²/s⁴."""
        return np.asarray(np.square(self.accel.axis("bias")) + np.square(self.accel_drift.triad))

    @classmethod
    def of_sensor(cls, sensor: Sensor) -> ImuUncertainty:
        """Make the uncertainty from a data sheet.

        Parameters
        ----------
        sensor : Sensor
            With gyros and accelerometers.

        Raises
        ------
        ConfigError
            The sensor lacks a triad.
        """
        gyro = uncertainty_of(sensor, "gyro")
        accel = uncertainty_of(sensor, "accel")
        errors = sensor.imu_errors
        assert errors.accel is not None  # uncertainty_of has found it
        drifts = (
            BiasDrift(e.bias_instability, e.correlation_time, e.random_walk)
            for e in (errors.gyro, errors.accel)
        )
        return cls(gyro, accel, *drifts)


# Uncertainty of a triad stated by the user, in the keys of the sensor catalogue.


Stated = float | Sequence[float]


STATED_KEYS: dict[str, dict[str, Key]] = {
    triad: {k: key for k, key in keys.items() if key.quantity in (*SPREADS, *SHEET_FACTS)}
    for triad, keys in KEYS.items()
}


def stated_uncertainty(
    triad: str, stated: Mapping[str, Stated], sensor: Sensor | None = None
) -> TriadUncertainty:
    """Convert the stated values of a triad to its uncertainty.

    `triad` ({'gyro', 'accel'}). `stated`: by catalogue key (``bias_sd_mg``, ``full_scale_g``): one
    number, or three. A bound is converted to the standard deviation of a uniform distribution.
    `sensor`: supplies the values that are not stated. ConfigError: a key is unknown, a quantity is
    stated twice, or a value is not a number.
    """
    keys = STATED_KEYS[triad]
    values: dict[str, Any] = {}
    said: dict[str, str] = {}
    for name, given in stated.items():
        if name not in keys:
            raise ConfigError(
                "sensors.no-such-key", quantity=f"uncertainty, {name}", word=name, known=keys
            )
        key = keys[name]
        attribute = SPREADS.get(key.quantity, key.quantity)
        if attribute in values:
            raise ConfigError(
                "sensors.states-same", quantity=f"uncertainty, {name}", said=said[attribute]
            )
        factor = key.factor / (math.sqrt(3.0) if key.spread == "bound" else 1.0)
        values[attribute] = _scaled(given, factor, f"uncertainty, {name}")
        said[attribute] = name
    if sensor is not None:
        return uncertainty_of(sensor, triad, **values)
    return TriadUncertainty(**values)


def _scaled(given: Stated, factor: float, quantity: str) -> Stated:
    numbers = _numbers(given, quantity)
    return numbers[0] * factor if is_number(given) else tuple(factor * x for x in numbers)


# Uncertainty of gyros and accelerometers together: a data sheet with overrides.

#: Degrees of freedom of Student's t distribution of the errors of the units of a type, and the
#: standard deviation of that distribution in units of the stated one. A maker measures units before
#: they are soldered, aged and warm, and some lie far outside. Its bound of 95 % is wider than a
#: normal one by the same factor, to 0.2 %.
FREEDOM = 4.0
UNIT_FACTOR = math.sqrt(FREEDOM / (FREEDOM - 2.0))
DRIFT = ("bias_instability", "correlation_time", "random_walk")

_NEEDED = {"bias": "bias_sd", "noise_density": "noise_density"}


def stated_imu(
    sensor: Sensor | None,
    gyro: Mapping[str, Stated],
    accel: Mapping[str, Stated],
    calibrated: Callable[[ImuUncertainty], ImuUncertainty] | None = None,
    unit_factor: float = 1.0,
) -> ImuUncertainty:
    """Combine a catalogue sensor and stated values into an uncertainty.

    `sensor`: supplies the values that are not stated. `gyro`, `accel`: by catalogue key: one
    number, or three. `calibrated`: replaces what a calibration knows, unless it is stated.
    `unit_factor`: on the sensor's standard deviations of what differs from unit to unit
    (`SPREADS`); `UNIT_FACTOR` for a unit of which the type is all that is known.
    ConfigError: a key is unknown, a value is not a number, or bias or noise of a
    triad is neither stated nor in the data sheet. Zero instead would give the bounds of a perfect
    sensor.
    """
    base = None if sensor is None else ImuUncertainty.of_sensor(sensor)
    triads: dict[str, TriadUncertainty] = {}
    drifts: dict[str, BiasDrift] = {}
    for triad, stated in (("gyro", gyro), ("accel", accel)):
        slow = {
            k: v for k, v in stated.items() if k in KEYS[triad] and KEYS[triad][k].quantity in DRIFT
        }
        fixed = {k: v for k, v in stated.items() if k not in slow}
        try:
            known_triad = stated_uncertainty(triad, fixed, sensor)
        except ConfigError as error:
            # Name the triad itself in the finding.
            place = (error.finding.quantity or "").replace("uncertainty", triad)
            raise error.replaced(quantity=place) from None
        triads[triad] = _of_unit(known_triad, unit_factor, [KEYS[triad][k].quantity for k in fixed])
        drifts[triad] = _stated_drift(
            triad, slow, None if base is None else getattr(base, f"{triad}_drift")
        )
    out = ImuUncertainty(triads["gyro"], triads["accel"], drifts["gyro"], drifts["accel"])
    if calibrated is not None:
        known, out = out, calibrated(out)
        for triad, stated in (("gyro", gyro), ("accel", accel)):
            names = {SPREADS.get(KEYS[triad][key].quantity) for key in stated}
            own = {name: getattr(getattr(known, triad), name) for name in names if name}
            out = replace(out, **{triad: replace(getattr(out, triad), **own)})
    for triad in triads:
        _require(triad, getattr(out, triad))
    return out


def _of_unit(triad: TriadUncertainty, factor: float, stated: Sequence[str]) -> TriadUncertainty:
    """Uncertainty of a unit, with a factor on what is not `stated` of its type."""
    names = [name for quantity, name in SPREADS.items() if quantity not in stated]
    wider = {name: tuple(factor * x for x in triad.axis(name)) for name in names}
    return replace(triad, **wider)  # type: ignore[arg-type]


def _stated_drift(triad: str, stated: Mapping[str, Stated], base: BiasDrift | None) -> BiasDrift:
    drift = base or BiasDrift()
    sd, time, walk = drift.sd, drift.correlation_time, drift.walk
    for name, given in stated.items():
        key = KEYS[triad][name]
        if key.quantity == "bias_instability":
            sd = _scaled(given, key.factor, f"{triad}, {name}")
        elif key.quantity == "random_walk":
            walk = _scaled(given, key.factor, f"{triad}, {name}")
        elif isinstance(given, int | float):
            time = float(given) * key.factor
        else:
            raise ConfigError("sensors.time-belongs-all-axes", quantity=f"{triad}, {name}")
    return BiasDrift(sd, time if time > 0.0 else math.inf, walk)


def _require(triad: str, known: TriadUncertainty) -> None:
    for attribute, said in _NEEDED.items():
        value = getattr(known, attribute)
        sizes = (value,) if isinstance(value, int | float) else tuple(value)
        if max(sizes) > 0.0:
            continue
        keys = [k for k in STATED_KEYS[triad] if k.startswith(said)]
        raise ConfigError(
            "sensors.bias-not-stated" if attribute == "bias" else "sensors.noise-not-stated",
            quantity=f"{triad}, {said}",
            triad=triad,
            keys=keys[:2],
        )


# Random draw of one unit of a triad from its uncertainty.

# Keys of the quantities in the seed tree; a number is never reused for another quantity.
BIAS, SCALE, MISALIGNMENT, G_SENSITIVITY, NONLINEARITY, RECTIFICATION = range(6)
# The slope 1 + s + 2 n2 x must stay positive within the range, |x| <= 1; at 0.5 it vanishes.
MOST_NONLINEARITY = 0.49


def draw_errors(uncertainty: TriadUncertainty, seed: Seed, *streams: int) -> TriadErrors:
    """Draw the errors of one unit.

    `seed` (int or SeedSequence): identifies the unit. `*streams`: path below the seed, where one
    seed serves several triads. All draws are normal and independent. Each quantity and axis has its
    own stream, so setting one spread to zero does not change the other draws. The second order of
    the curve is limited to 0.49 of the slope, so that the inverse is unique; this takes effect only
    for standard deviations of tenths of full scale. Noise, range, quantization and low-pass are
    those of the uncertainty. ConfigError: the draw is not a valid sensor: a scale factor of -1 or
    less, or angles that sum to 1 rad.
    """

    def draws(name: str, key: int) -> Array:
        """Three numbers per axis, (3, 3), each axis with its own standard deviation."""
        rows = np.empty((3, 3))
        for axis, sd in enumerate(uncertainty.axis(name)):
            generator = np.random.Generator(np.random.PCG64(child(seed, *streams, key, axis)))
            rows[axis] = sd * generator.standard_normal(3)
        return rows

    scale = draws("scale", SCALE)[:, 0]
    turned = draws("misalignment", MISALIGNMENT)
    np.fill_diagonal(turned, 0.0)
    most = MOST_NONLINEARITY * (1.0 + scale)
    bent = np.clip(draws("nonlinearity_2", NONLINEARITY)[:, 0], -most, most)
    return TriadErrors(
        noise_density=uncertainty.noise_density,
        bias=triad_of(draws("bias", BIAS)[:, 0]),
        scale=triad_of(scale),
        misalignment=matrix_of(turned),
        g_sensitivity=matrix_of(draws("g_sensitivity", G_SENSITIVITY)),
        nonlinearity_2=triad_of(bent),
        vibration_rectification=triad_of(draws("vibration_rectification", RECTIFICATION)[:, 0]),
        quantization=uncertainty.quantization,
        full_scale=uncertainty.full_scale,
        bandwidth=uncertainty.bandwidth,
    )


# Stated uncertainties of a crash recorder's triads.


def crash_priors(rate: float = 200.0) -> dict[str, TriadUncertainty]:
    """Return the error model of a merged consumer-grade crash recorder.

    `rate` (Hz): sample rate for which the specific force noise per sample is stated. Returns
    ``accel``: bias 0.2 m/s² (Tadic and Vukajlovic 2016, section 3: the low-g parts' own), scale
    factor 2 %, noise 0.4 m/s² per sample. ``gyro``: bias 0.3 deg/s. All are standard deviations of
    every axis. All other errors are zero, and the range is unlimited. Scale, noise and gyro bias
    are chosen; the paper gives no values. ConfigError: the rate is not positive.
    """
    if not (math.isfinite(rate) and rate > 0.0):
        raise ConfigError("sensors.rate-not-positive", quantity="rate", rate=rate)
    return {
        "accel": TriadUncertainty(bias=0.2, scale=0.02, noise_density=0.4 / math.sqrt(rate)),
        "gyro": TriadUncertainty(bias=0.3 * GYRO_UNITS["deg/s"]),
    }
