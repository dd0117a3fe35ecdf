"""Trajectories with known places, for tests: random walks of a vehicle, and exact circles."""

from __future__ import annotations

import numpy as np
import pandas as pd

from strapdown.tables import trajectory_table

R = 6378137.0


def random_trajectory(seed: int, n: int = 200, start=(55.0, 37.0, 150.0)) -> pd.DataFrame:
    """Places a few kilometres about a start, any velocity, any attitude."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.05, 0.2, n))
    place = np.array(start) + rng.normal(size=(n, 3)) * [0.02, 0.02, 300.0]
    euler = rng.uniform([-180, -80, 0], [180, 80, 360], (n, 3))
    return trajectory_table(time, place, rng.normal(size=(n, 3)) * 30.0, euler, "est")


def perturbed(table: pd.DataFrame, place, velocity, euler, source="ref") -> pd.DataFrame:
    """The same with something added to every row."""
    out = table.copy()
    out[["lat", "lon", "alt"]] += place
    out[["VN", "VE", "VD"]] += velocity
    out[["roll", "pitch", "heading"]] += euler
    out.attrs["source"] = source
    return out


def weaving(time, lat0=55.0, lon0=37.0, source="ref") -> pd.DataFrame:
    """North at the equator's radius, weaving: places in deg by exact integrals of the velocity.

    Along one meridian of the ellipsoid nothing is closed, so this drives along the equator, where
    the radius is the semi-major axis: ``lon = lon0 + E(t)/R``, and ``alt`` carries a second
    motion. Its derivatives are exact.
    """
    t = np.asarray(time, dtype=float)
    w = 0.6
    alt = 100.0 + 5.0 * np.sin(w * t)
    up = 5.0 * w * np.cos(w * t)
    # lon(t) is given; its rate times the radius at that height is the east velocity.
    lon_rad = np.radians(lon0) + (20.0 * t + 30.0 * np.sin(0.4 * t)) / R
    east = (20.0 + 12.0 * np.cos(0.4 * t)) / R * (R + alt)
    zero = np.zeros_like(t)
    place = np.column_stack([zero, np.degrees(lon_rad), alt])
    velocity = np.column_stack([zero, east, -up])
    euler = np.column_stack([10 * np.sin(0.5 * t), 5 * np.cos(0.5 * t), 90 + 20 * np.sin(0.3 * t)])
    return trajectory_table(t, place, velocity, euler, source)
