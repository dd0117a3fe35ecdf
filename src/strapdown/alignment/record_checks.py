"""What a record must be before any attitude is sought in it."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.alignment.north import CONTRADICTION
from strapdown.alignment.outliers import outlier_findings
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import DataError, Finding
from strapdown.tables import ACCEL, GYRO, check_imu, find_gaps
from strapdown.tables.checks import source_of

Array = NDArray[np.float64]

__all__ = ["LEAST_SAMPLES", "check_gravity", "check_record", "gravity_findings"]

# As levelling has it: what no bias, scale or rocking makes of gravity.
NEAR_GRAVITY = 0.2
#: Fewer tell no scatter.
LEAST_SAMPLES = 20
# rad/s or m/s²; no sensor is as quiet, and no simulation without errors as loud.
ROUNDING = 1e-12


def check_record(imu: pd.DataFrame) -> tuple[Finding, ...]:
    """Check an Imu table that is to be aligned.

    Parameters
    ----------
    imu : DataFrame

    Returns
    -------
    tuple of Finding
        Outliers, gaps.

    Raises
    ------
    DataError
        As `tables.check_imu`; there is no accelerometer, there are fewer than 20 samples, or a
        channel does not change at all while others do.
    """
    check_imu(imu)
    source = source_of(imu)
    if ACCEL[0] not in imu.columns:
        raise DataError("alignment.no-accelerometer", file=source, quantity="accel")
    if len(imu) < LEAST_SAMPLES:
        raise DataError(
            "alignment.too-few-samples",
            file=source,
            quantity="time",
            count=len(imu),
            index=imu.index[-1] - imu.index[0],
            least_samples=LEAST_SAMPLES,
        )
    values = imu[[*GYRO, *ACCEL]].to_numpy(dtype=np.float64)
    _check_alive(values, source)
    outliers = outlier_findings(values, [*GYRO, *ACCEL], source)
    return (*outliers, *_gaps(imu.index.to_numpy(dtype=np.float64), source))


def check_gravity(force: Array, source: str | None) -> tuple[Finding, ...]:
    """Check that a mean specific force is that of gravity.

    Parameters
    ----------
    force : ndarray, (3,), m/s²
    source : str, optional
        Of the record, for messages.

    Returns
    -------
    tuple of Finding
        Where the body stands on its head.

    Raises
    ------
    DataError
        Its length is not within 20 % of 9.8 m/s².
    """
    size = float(np.sqrt(force @ force))
    if not abs(size / STANDARD_GRAVITY - 1.0) <= NEAR_GRAVITY:
        if abs(size - 1.0) <= NEAR_GRAVITY:
            code = "alignment.mean-force-seems-in-g"
        elif abs(size / (1e3 * STANDARD_GRAVITY) - 1.0) <= NEAR_GRAVITY or (
            abs(size / 1e3 - 1.0) <= NEAR_GRAVITY
        ):
            code = "alignment.mean-force-seems-in-mg"
        else:
            code = "alignment.mean-force-not-gravity"
        raise DataError(code, file=source, quantity="accel", size=size)
    if not force[2] > 0.5 * size:
        return ()
    return (
        Finding(
            "alignment.force-points-down",
            file=source,
            quantity="accel_z",
            force=force[2],
        ),
    )


def gravity_findings(change: float, sd: float, source: str | None) -> tuple[Finding, ...]:
    """Compare the size of a mean specific force with the gravity of the site.

    Parameters
    ----------
    change : float
        Measured less the site's, relative.
    sd : float
        Of it.
    source : str, optional

    Returns
    -------
    tuple of Finding
        One, where it is more than five standard deviations.
    """
    if not abs(change) > CONTRADICTION * sd:
        return ()
    return (
        Finding(
            "alignment.gravity-contradicts-site",
            file=source,
            quantity="accel",
            change=1000000.0 * change,
            change_2=abs(change) / max(sd, 1e-300),
        ),
    )


def _check_alive(values: Array, source: str | None) -> None:
    """Refuse a channel that stands still while its neighbours do not."""
    # An ideal sensor at rest is constant on all channels to rounding, and nothing is said of it.
    spread = np.ptp(values, axis=0)
    for name, columns in (("gyro", slice(0, 3)), ("accel", slice(3, 6))):
        still = spread[columns] == 0.0
        rounding = ROUNDING * max(1.0, float(np.abs(values[:, columns]).max(initial=0.0)))
        if not still.any() or not (spread[columns] > rounding).any():
            continue
        channel = (GYRO if name == "gyro" else ACCEL)[int(np.argmax(still))]
        value = values[0, columns][int(np.argmax(still))]
        raise DataError(
            "alignment.dead-gyro" if name == "gyro" else "alignment.dead-accelerometer",
            file=source,
            row=1,
            quantity=channel,
            value=value,
            count=len(values),
        )


def _gaps(time: Array, source: str | None) -> tuple[Finding, ...]:
    gaps = find_gaps(time)
    if not gaps:
        return ()
    worst = max(gaps, key=lambda gap: gap.length)
    return (
        Finding(
            "alignment.gaps" if len(gaps) > 1 else "alignment.gap",
            file=source,
            row=worst.sample + 1,
            quantity="time",
            count=len(gaps),
            length=worst.length,
            start=worst.start,
            usual=worst.usual,
        ),
    )
