"""Design of a crash recorder: triads, mounting, clock and trigger."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from strapdown.constants import GYRO_UNITS
from strapdown.errors import ConfigError
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.crash_unit import Mounting
from strapdown.sensors.triad_errors import Triad, TriadErrors
from strapdown.sensors.uncertainty import TriadUncertainty, uncertainty_of

# A larger clock drift means a defective crystal.
MOST_DRIFT = 1000.0  # ppm


@dataclass(frozen=True)
class TriadDesign:
    """One triad of a recorder.

    Attributes
    ----------
    part : str
        Name, for messages.
    uncertainty : TriadUncertainty
        Stated uncertainty, written to the record.
    rate : float, Hz
    errors : TriadErrors, optional
        True errors; drawn from the uncertainty if not given.

    Raises
    ------
    ConfigError
        The rate is not positive.
    """

    part: str
    uncertainty: TriadUncertainty
    rate: float
    errors: TriadErrors | None = None

    def __post_init__(self) -> None:
        if not (math.isfinite(self.rate) and self.rate > 0.0):
            raise ConfigError(
                "simulation.hz-no-rate", quantity="rate", part=self.part, rate=self.rate
            )


@dataclass(frozen=True)
class WarmUp:
    """Biases that decay after a recorder is switched on.

    Attributes
    ----------
    accel : float, m/s²
        Standard deviation at switch-on, for every axis and triad.
    gyro : float, rad/s
        The same for the gyro.
    time_constant : float, s
    elapsed : float, s
        From switch-on to the start of the motion; stated, not simulated.

    Raises
    ------
    ConfigError
        A number is negative or not finite, or the time constant is zero.
    """

    accel: float
    gyro: float
    time_constant: float
    elapsed: float = 0.0

    def __post_init__(self) -> None:
        for name in ("accel", "gyro", "time_constant", "elapsed"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0) or (
                name == "time_constant" and value == 0.0
            ):
                raise ConfigError("simulation.out-range-4", quantity=name, value=value)

    @property
    def left(self) -> float:
        """Fraction of the warm-up bias left when the motion starts."""
        return math.exp(-self.elapsed / self.time_constant)


@dataclass(frozen=True)
class RecorderDesign:
    """A recorder on a vehicle.

    Attributes
    ----------
    name : str
        Also selects the random stream: two recorders with one seed differ by it.
    accelerometers : tuple of TriadDesign
        One or more, in order of increasing range.
    gyro : TriadDesign, optional
    mounting : Mounting
        Stated mounting; the true one is drawn with its standard deviations.
    gyro_from : str, optional
        Recorder that supplies the gyro, for a recorder without one.
    warm_up : WarmUp, optional
    trigger_sd : float, s
        Standard deviation of the trigger stamp.
    clock_offset : float, s
        Reading of the recorder's clock when the motion starts.
    clock_drift_ppm : float
        Rate by which the clock runs fast.
    high_g_bias : float, m/s²
        Half-width of the uniform bias distribution of every accelerometer except the first; zero
        leaves them to their own uncertainty.

    Raises
    ------
    ConfigError
        No accelerometer is given, or a number is out of range.
    """

    name: str
    accelerometers: tuple[TriadDesign, ...]
    gyro: TriadDesign | None = None
    mounting: Mounting = field(default_factory=Mounting)
    gyro_from: str | None = None
    warm_up: WarmUp | None = None
    trigger_sd: float = 0.0
    clock_offset: float = 0.0
    clock_drift_ppm: float = 0.0
    high_g_bias: float = 0.0

    def __post_init__(self) -> None:
        if not self.accelerometers:
            raise ConfigError("simulation.recorder-none", quantity="accelerometers", name=self.name)
        for name in ("trigger_sd", "high_g_bias"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise _out(self, name, "simulation.recorder-negative")
        if not math.isfinite(self.clock_offset):
            raise _out(self, "clock_offset", "simulation.recorder-not-finite")
        if not abs(self.clock_drift_ppm) <= MOST_DRIFT:
            raise _out(self, "clock_drift_ppm", "simulation.recorder-drift")

    def told(self, which: int) -> TriadUncertainty:
        """Stated uncertainty of an accelerometer, with high-g bias and residual warm-up bias."""
        own = self.accelerometers[which].uncertainty
        if which > 0 and self.high_g_bias > 0.0:
            own = replace(own, bias=self.high_g_bias / math.sqrt(3.0))
        return self._warm(own, self.warm_up.accel if self.warm_up else 0.0)

    def told_gyro(self) -> TriadUncertainty | None:
        """Stated uncertainty of the gyro, likewise."""
        if self.gyro is None:
            return None
        return self._warm(self.gyro.uncertainty, self.warm_up.gyro if self.warm_up else 0.0)

    def _warm(self, own: TriadUncertainty, sd: float) -> TriadUncertainty:
        if self.warm_up is None:
            return own
        bias = np.hypot(own.axis("bias"), sd * self.warm_up.left)
        x, y, z = (float(b) for b in bias)
        return replace(own, bias=(x, y, z))


@dataclass(frozen=True)
class RecorderTruth:
    """True errors of a simulated recorder.

    Attributes
    ----------
    accelerometers : tuple of TriadErrors
    gyro : TriadErrors, optional
    mounting : Mounting
        True mounting, without standard deviations.
    clock_offset : float, s
    clock_drift_ppm : float
    trigger_error : float, s
        Delay of the trigger stamp.
    """

    accelerometers: tuple[TriadErrors, ...]
    gyro: TriadErrors | None
    mounting: Mounting
    clock_offset: float
    clock_drift_ppm: float
    trigger_error: float

    def clock(self, time: float) -> float:
        """Reading of the recorder's clock at an instant of the motion, s."""
        return self.clock_offset + (1.0 + 1e-6 * self.clock_drift_ppm) * time


def _out(design: RecorderDesign, name: str, code: str) -> ConfigError:
    value = getattr(design, name)
    return ConfigError(code, quantity=name, name=design.name, value=value, most=MOST_DRIFT)


# The four recorders of the crash test of Tadic and Vukajlovic (2016).


# Section 3 of the paper: the largest bias found in a high-g part; the warm-up; Table 1.
HIGH_G_BIAS = 11.91  # m/s²
ELAPSED = 600.0  # s
IMU_RATE, LAB_RATE = 200.0, 10_000.0  # Hz
# Chosen, because the paper gives no positions. Relative to the vehicle's origin, taken 0.5 m above
# the ground in the middle of the car: on the floor before the front seats, and halfway up the
# B-pillars.
FLOOR: Triad = (0.6, 0.5, 0.2)
PILLAR: Triad = (-0.3, 0.7, -0.3)
# Chosen: a 12-bit converter over 3.3 V with 20, 40 and 40 mV/g.
HIGH_G_STEP: Triad = (0.4, 0.2, 0.2)  # m/s²


def paper_units(scale_sd: float = 0.02) -> tuple[RecorderDesign, ...]:
    """Return the platforms of the paper: LAB1, LAB2, IMU1, IMU2; 1 is left, 2 is right.

    Parameters
    ----------
    scale_sd : float
        Scale factor standard deviation of every MEMS triad after calibration; the data sheets alone
        allow up to ±10 %.

    Returns
    -------
    tuple of RecorderDesign
        From the paper: parts, rates and ranges (but see the catalogue's note on ±100 g), the high-g
        bias of up to 11.91 m/s², the low-g bias of 0.2 m/s², 10 minutes of warm-up, the common
        trigger, laboratory units without gyros (here they use IMU1's), B-pillars and floor. Chosen
        here: positions and their standard deviations, converters, clocks, warm-up drift, and
        stamping a trigger with the sample in which it falls.

    Raises
    ------
    ConfigError
        The scale factor's standard deviation is negative or not finite.
    """
    return (
        _lab("LAB1", -1.0),
        _lab("LAB2", 1.0),
        _imu("IMU1", -1.0, scale_sd, 3.7, 18.0),
        _imu("IMU2", 1.0, scale_sd, -1.3, -25.0),
    )


def _imu(name: str, side: float, scale: float, offset: float, drift: float) -> RecorderDesign:
    low, high, gyro = (
        load_sensor(part) for part in ("lis302dlh", "mma3202-mma1213", "idg-500-isz-500")
    )
    return RecorderDesign(
        name,
        (
            TriadDesign(low.name, uncertainty_of(low, "accel", scale=scale), IMU_RATE),
            TriadDesign(
                high.name,
                uncertainty_of(high, "accel", scale=scale, quantization=HIGH_G_STEP),
                IMU_RATE,
            ),
        ),
        TriadDesign(gyro.name, uncertainty_of(gyro, "gyro", scale=scale), IMU_RATE),
        Mounting(_beside(FLOOR, side), position_sd=0.01, angles_sd_deg=1.0),
        warm_up=WarmUp(0.5, 1.0 * GYRO_UNITS["deg/s"], 150.0, ELAPSED),
        trigger_sd=_one_sample(IMU_RATE),
        clock_offset=offset,
        clock_drift_ppm=drift,
        high_g_bias=HIGH_G_BIAS,
    )


def _lab(name: str, side: float) -> RecorderDesign:
    part = load_sensor("endevco-7264b-500")
    return RecorderDesign(
        name,
        (TriadDesign(part.name, uncertainty_of(part, "accel"), LAB_RATE),),
        mounting=Mounting(_beside(PILLAR, side), position_sd=0.005, angles_sd_deg=0.5),
        gyro_from="IMU1",
        trigger_sd=_one_sample(LAB_RATE),
        clock_drift_ppm=2.0 * side,
    )


def _beside(position: Triad, side: float) -> Triad:
    return (position[0], side * position[1], position[2])


def _one_sample(rate: float) -> float:
    """Standard deviation of an instant uniformly distributed over a sample interval, s."""
    return 1.0 / rate / math.sqrt(12.0)
