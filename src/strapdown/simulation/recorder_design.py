"""How a crash recorder is built: its triads, its place, its clock and its trigger."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from strapdown.errors import ConfigError
from strapdown.sensors.crash_unit import Mounting
from strapdown.sensors.triad_errors import TriadErrors
from strapdown.sensors.triad_uncertainty import TriadUncertainty

# Faster than this, a crystal is broken.
MOST_DRIFT = 1000.0  # ppm


@dataclass(frozen=True)
class TriadDesign:
    """One triad of a recorder.

    Attributes
    ----------
    part : str
        Name, for messages.
    uncertainty : TriadUncertainty
        What is told of it: goes into the record.
    rate : float, Hz
    errors : TriadErrors, optional
        What it really does; drawn from the uncertainty, if not given.

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
    """Biases that die away after a recorder is switched on.

    Attributes
    ----------
    accel : float, m/s²
        Standard deviation at the instant of switching on, of every axis and triad.
    gyro : float, rad/s
        The same of the gyro.
    time_constant : float, s
    elapsed : float, s
        From switching on to the beginning of the motion: stated, and not simulated.

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
        """What is left of it when the motion begins, relative."""
        return math.exp(-self.elapsed / self.time_constant)


@dataclass(frozen=True)
class RecorderDesign:
    """A recorder on a vehicle.

    Attributes
    ----------
    name : str
        Two recorders of one seed differ by it.
    accelerometers : tuple of TriadDesign
        One or more, the lowest range first.
    gyro : TriadDesign, optional
    mounting : Mounting
        As it is told; the true one is drawn with its standard deviations.
    gyro_from : str, optional
        Of which recorder the gyro is borrowed, where there is none.
    warm_up : WarmUp, optional
    trigger_sd : float, s
        Of the stamp of the trigger.
    clock_offset : float, s
        What the recorder's clock shows when the motion begins.
    clock_drift_ppm : float
        By how much it runs fast.
    high_g_bias : float, m/s²
        Bound of the biases, uniformly drawn, of every accelerometer but the first; zero leaves
        them to their own uncertainty.

    Raises
    ------
    ConfigError
        There is no accelerometer, or a number is out of range.
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
        """What is told of an accelerometer: its own, its high-g bias, what is left of warm-up."""
        own = self.accelerometers[which].uncertainty
        if which > 0 and self.high_g_bias > 0.0:
            own = replace(own, bias=self.high_g_bias / math.sqrt(3.0))
        return self._warm(own, self.warm_up.accel if self.warm_up else 0.0)

    def told_gyro(self) -> TriadUncertainty | None:
        """The same of the gyro."""
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
    """What a simulated recorder really did.

    Attributes
    ----------
    accelerometers : tuple of TriadErrors
    gyro : TriadErrors, optional
    mounting : Mounting
        Where it really sat; without standard deviations.
    clock_offset : float, s
    clock_drift_ppm : float
    trigger_error : float, s
        By how much the stamp of the trigger is late.
    """

    accelerometers: tuple[TriadErrors, ...]
    gyro: TriadErrors | None
    mounting: Mounting
    clock_offset: float
    clock_drift_ppm: float
    trigger_error: float

    def clock(self, time: float) -> float:
        """What the recorder's clock shows at an instant of the motion, s."""
        return self.clock_offset + (1.0 + 1e-6 * self.clock_drift_ppm) * time


def _out(design: RecorderDesign, name: str, code: str) -> ConfigError:
    value = getattr(design, name)
    return ConfigError(code, quantity=name, name=design.name, value=value, most=MOST_DRIFT)
