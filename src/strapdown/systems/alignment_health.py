"""Channels of a record that do not read anything: told, or refused, before it is aligned."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from strapdown.errors import DataError, Finding
from strapdown.sensors.health_log import LEAST_SAMPLES
from strapdown.sensors.imu_health import ChannelFault, check_imu_channels
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import index_of, source_of, values_of

__all__ = ["channel_findings"]

#: Faults that are seen in the samples themselves. Noise, jumps and levels are left to the
#: alignments: a vehicle that people enter shows them, too.
SILENT = ("missing", "stuck", "dead", "saturated")
#: Part of a record that may be without a channel.
MOST = 0.01


def channel_findings(imu: pd.DataFrame, sensors: ImuUncertainty) -> tuple[Finding, ...]:
    """Find channels that read nothing for a part of a record.

    Parameters
    ----------
    imu : DataFrame
        Imu table as it was recorded, body axes.
    sensors : ImuUncertainty

    Returns
    -------
    tuple of Finding
        Stretches that are short; or that no channel ever changes.

    Raises
    ------
    DataError
        A channel is stuck, dead, saturated or without numbers for more than a hundredth of the
        record.
    """
    if len(imu) < LEAST_SAMPLES:
        # So short a record is refused by each alignment, with what would be long enough.
        return _made_up(imu)
    faults = [f for f in check_imu_channels(imu, sensors).faults if f.kind in SILENT]
    for channel in dict.fromkeys(f.channel for f in faults):
        own = [f for f in faults if f.channel == channel]
        lost = sum(f.last - f.first + 1 for f in own)
        # One that is dead all the time is refused by each alignment in its own words.
        whole = lost == len(imu)
        if lost > MOST * len(imu) and not (whole and _alone(channel, faults)):
            worst = max(own, key=lambda f: f.last - f.first)
            said = worst.finding
            time = index_of(imu)
            before, after = worst.begin - float(time[0]), float(time[-1]) - worst.end
            part = (
                "alignment.channel-lost-align-before"
                if before >= after
                else "alignment.channel-lost-align-after"
            )
            raise DataError(
                "alignment.channel-lost" if whole else part,
                file=said.file,
                row=said.row,
                quantity=said.quantity,
                reason=said,
                share=lost / len(imu),
                before=before,
                end=worst.end,
            )
    return (*(f.finding for f in faults), *_made_up(imu))


def _alone(channel: str, faults: Sequence[ChannelFault]) -> bool:
    """Whether another channel of its triad goes on."""
    triad = channel.split("_")[0]
    return len({f.channel for f in faults if f.channel.startswith(triad)}) < len(GYRO)


def _made_up(imu: pd.DataFrame) -> tuple[Finding, ...]:
    columns = [c for c in [*GYRO, *ACCEL] if c in imu.columns]
    if np.ptp(values_of(imu, columns), axis=0).any():
        return ()
    return (
        Finding(
            "alignment.no-channel-changes",
            file=source_of(imu),
            quantity="gyro, accel",
            count=len(imu),
        ),
    )
