"""Health tests of the channels of an inertial log of minutes to hours, any sensor grade."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from strapdown.earth import gravity as normal_gravity
from strapdown.errors import ConfigError, Finding
from strapdown.sensors.health_log import ChannelFault, HealthLog, health_log
from strapdown.sensors.health_tests import (
    find_implausible,
    find_jumps,
    find_missing,
    find_noisy,
    find_saturated,
    find_stuck,
)
from strapdown.sensors.uncertainty import ImuUncertainty

__all__ = ["FALSE_ALARM", "TESTS", "ChannelFault", "HealthTest", "ImuHealth", "check_imu_channels"]

#: Probability per test, channel and record, for limits set by chance.
FALSE_ALARM = 1e-6
# Range of heights at which a sensor may rest.
LOWEST, HIGHEST = -500.0, 9000.0  # m
# Gravity anomalies are smaller; none in NGA's EGM2008 reaches 1000 mGal.
ANOMALY = 0.005  # m/s²


@dataclass(frozen=True)
class HealthTest:
    """One test of the channels of a log.

    Attributes
    ----------
    title : str
    limit : str
        Reference with which a channel is compared.
    false_alarm : str
        Source of its false-alarm rate.
    find : callable
    takes_out : bool
        Whether later tests exclude the samples that it found.
    """

    title: str
    limit: str
    false_alarm: str
    find: Callable[[HealthLog], list[ChannelFault]]
    takes_out: bool


#: In this order, because noise and level are defined only for valid samples.
TESTS: dict[str, HealthTest] = {
    "missing": HealthTest(
        "no number",
        "any NaN",
        "none: it is seen, not concluded",
        find_missing,
        True,
    ),
    "stuck": HealthTest(
        "repeats a reading, or is dead",
        "length of a run, from its share of repetitions and the tail of its runs",
        "P where repetitions are independent, or their runs have an exponential tail",
        find_stuck,
        True,
    ),
    "saturated": HealthTest(
        "at the end of its range",
        "stated full scale; or a flat top that jumps leave",
        "none at the stated end; a flat top as `saturation.find_limits`",
        find_saturated,
        True,
    ),
    "noisy": HealthTest(
        "noisier than it may be, or with outliers",
        "3 times the data sheet, its triad at rest, or its own past; three blocks of 1 s",
        "below P for sound sensors that differ by less than 3",
        find_noisy,
        True,
    ),
    "jump": HealthTest(
        "its zero steps while nothing moves",
        "tail of the record's own changes of the mean, quantile of its noise, stated drift",
        "P where changes at rest have an exponential tail; less where they are normal",
        find_jumps,
        True,
    ),
    "implausible": HealthTest(
        "at rest neither gravity nor the Earth's rate",
        "quantile of the stated bias, scale factor, misalignment",
        "P by construction, where the data sheet holds",
        find_implausible,
        False,
    ),
}


@dataclass(frozen=True, eq=False)
class ImuHealth:
    """Test results of a log.

    Attributes
    ----------
    channels : tuple of str
        Tested channels.
    faults : tuple of ChannelFault
        In order of time.
    rest_time : float, s
        Time for which the body was stationary according to all sound channels. The tests of noise
        against the neighbors, of jumps, and against gravity use only this time.
    noise : dict of str to float, rad/s or m/s²
        Sample-to-sample standard deviation, median over the record.
    """

    channels: tuple[str, ...]
    faults: tuple[ChannelFault, ...]
    rest_time: float
    noise: dict[str, float]

    @property
    def findings(self) -> tuple[Finding, ...]:
        """One finding per fault."""
        return tuple(f.finding for f in self.faults)

    @property
    def healthy(self) -> tuple[str, ...]:
        """Channels without a fault of their own or of their triad."""
        bad = {f.channel for f in self.faults}
        return tuple(c for c in self.channels if c not in bad and c.split("_")[0] not in bad)

    def of(self, channel: str) -> tuple[ChannelFault, ...]:
        """Faults of one channel."""
        return tuple(f for f in self.faults if f.channel == channel)

    def sound(self, imu: pd.DataFrame) -> pd.DataFrame:
        """Samples not covered by any fault.

        Parameters
        ----------
        imu : DataFrame
            The table that was tested.

        Returns
        -------
        DataFrame of bool
            One row per row of the table, one column per channel.
        """
        out = np.ones((len(imu), len(self.channels)), dtype=bool)
        for fault in self.faults:
            for k, name in enumerate(self.channels):
                if fault.channel in (name, name.split("_")[0]):
                    out[fault.first : fault.last + 1, k] = False
        return pd.DataFrame(out, index=imu.index, columns=list(self.channels))


def check_imu_channels(
    imu: pd.DataFrame,
    sensors: ImuUncertainty | None = None,
    *,
    gravity: float | None = None,
    false_alarm: float = FALSE_ALARM,
) -> ImuHealth:
    """Test each channel of an inertial log by itself, against the others and its data sheet.

    Parameters
    ----------
    imu : DataFrame
        Columns of an Imu table, rad/s and m/s²; NaN values are reported. Accelerometers may be
        absent.
    sensors : ImuUncertainty, optional
        Stated uncertainty. If not given, a channel is compared with itself and the others.
    gravity : float, m/s², optional
        Gravity at the site. If not given, any value from the equator at 9 km to a pole.
    false_alarm : float
        Probability that a sound channel fails one test over the whole record, for limits set by
        chance (`TESTS`).

    Returns
    -------
    ImuHealth

    Raises
    ------
    DataError
        A column is missing, time does not increase, or there are fewer than 64 samples.
    ConfigError
        `false_alarm` or `gravity` is invalid.

    Notes
    -----
    A fault of one channel can be separated from motion only at rest, or where no motion can cause
    it: a moving vehicle with a single unit has no test for a bias jump (`redundant_units` has one).
    Changes common to all channels are attributed to motion. The last incomplete block of less than
    a second is not tested for noise and jumps.

    The cost is about 30 operations per sample and channel: 1 h at 1 kHz takes seconds.
    """
    if not 0.0 < false_alarm < 0.5:
        raise ConfigError(
            "sensors.no-rate-false-alarms", quantity="false_alarm", false_alarm=false_alarm
        )
    if gravity is None:
        least = float(normal_gravity(0.0, HIGHEST)[2]) - ANOMALY
        most = float(normal_gravity(90.0, LOWEST)[2]) + ANOMALY
    elif math.isfinite(gravity) and gravity > 0.0:
        least = most = float(gravity)
    else:
        raise ConfigError("sensors.no-gravity", quantity="gravity", gravity=gravity)
    log = health_log(imu, sensors, (least, most), false_alarm)
    faults: list[ChannelFault] = []
    for test in TESTS.values():
        found = test.find(log)
        faults += found
        if found and test.takes_out:
            wrong = log.wrong.copy()
            for fault in found:
                wrong[log.names.index(fault.channel), fault.first : fault.last + 1] = True
            log = replace(log, wrong=wrong)
    b = log.blocks
    noise = {
        name: float(np.median(b.noise[b.valid[:, k], k])) if b.valid[:, k].any() else math.nan
        for k, name in enumerate(log.names)
    }
    return ImuHealth(
        log.names,
        tuple(sorted(faults, key=lambda f: (f.first, f.channel))),
        float(log.rests().sum() * b.samples / log.rate),
        noise,
    )
