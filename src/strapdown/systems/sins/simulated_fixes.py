"""Fixes of a receiver that is simulated, with the outages and outliers that it is told to have."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.config.navigation import ReceiverTable
from strapdown.sensors.error_draws import child, normal
from strapdown.simulation.earth_motion import EarthMotion
from strapdown.simulation.gnss import GnssReceiver, moved_places, simulate_gnss
from strapdown.tables import GEODETIC, POSITION_SD, VELOCITY_SD, gnss_table
from strapdown.tables import VELOCITY as VELOCITY_COLUMNS
from strapdown.tables.checks import index_of, values_of

__all__ = ["simulated_fixes"]

Array = NDArray[np.float64]

# Streams below the seed; those of the receiver itself are counted from zero.
_STRUCK, _WAY = 100, 101


def simulated_fixes(
    motion: EarthMotion, asked: ReceiverTable, seed: np.random.SeedSequence, name: str
) -> pd.DataFrame:
    """Simulate a receiver over a motion.

    Parameters
    ----------
    motion : EarthMotion
    asked : ReceiverTable
    seed : SeedSequence
        Of everything that is random.
    name : str
        Of the aid, for messages.

    Returns
    -------
    DataFrame
        Gnss table: without the fixes of the outages; outliers claim the precision of the others.
    """
    receiver = GnssReceiver(
        rate=asked.rate_hz,
        position_noise=asked.position_noise_m,
        position_drift=asked.position_drift_m,
        correlation_time=asked.correlation_time_s,
        velocity_noise=asked.velocity_noise_m_per_s,
        antenna=asked.antenna_m,
        time_offset=asked.time_offset_s,
        on_excess="unaffected",
    )
    table = simulate_gnss(motion, receiver, seed=seed, source=name)
    time = index_of(table)
    place, velocity = values_of(table, GEODETIC), values_of(table, VELOCITY_COLUMNS)
    place_sd, velocity_sd = values_of(table, POSITION_SD), values_of(table, VELOCITY_SD)
    if asked.outlier_share > 0.0:
        struck = _uniform(child(seed, _STRUCK), len(time)) < asked.outlier_share
        way = normal(seed, _WAY, len(time), axes=6)
        for part in (way[:, :3], way[:, 3:]):
            part /= np.linalg.norm(part, axis=1, keepdims=True)
        off = asked.outlier_size * struck[:, None] * way
        place = moved_places(place, off[:, :3] * place_sd, motion.ellipsoid)
        velocity = velocity + off[:, 3:] * velocity_sd
    if not asked.velocity:
        velocity_sd = np.full_like(velocity_sd, np.inf)
    kept = np.ones(len(time), dtype=np.bool_)
    for begin, end in asked.outages_s:
        kept &= (time < begin) | (time > end)
    return gnss_table(
        time[kept], place[kept], velocity[kept], place_sd[kept], velocity_sd[kept], source=name
    )


def _uniform(seed: np.random.SeedSequence, count: int) -> Array:
    return np.random.Generator(np.random.PCG64(seed)).random(count)
