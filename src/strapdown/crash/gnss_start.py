"""A path that is tied to what a satellite receiver said before the crash."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
import pandas as pd

from strapdown.crash.at_point import AtPoint
from strapdown.crash.entry import Entry
from strapdown.crash.entry_priors import EntryPriors
from strapdown.crash.entry_state import ACCEL_BIAS, ATTITUDE, GYRO_BIAS, VELOCITY, EntryState
from strapdown.crash.gnss_entry import entry_state_from_gnss
from strapdown.errors import ConfigError, DataError
from strapdown.sensors.borrowed_gyro import turned_uncertainty
from strapdown.sensors.triad_numbers import finite, triple
from strapdown.sensors.triad_uncertainty import TriadUncertainty

CONTRIBUTOR = "entry from GNSS"
# What the entry state has instead: lines of the error budget.
BIASES = ("accelerometer bias", "gyro bias", "levelling")
OTHER_PRIORS = tuple(f.name for f in fields(EntryPriors) if f.name not in ("gyro", "accel"))


@dataclass(frozen=True, eq=False)
class GnssEntry:
    """Fixes before the crash, from which every unit finds its own entry state and biases.

    Attributes
    ----------
    fixes : DataFrame
        Gnss table, time from the common trigger.
    impact : float, s
        Nothing from there on is used.
    window : float, s
        Length of the record before the impact that is used.
    before : float, s
        How long before the impact the path is tied: the first sample of the crash already has
        its jerk.
    antenna : sequence of float, (3,), m
        Vehicle axes, from the vehicle's origin.
    priors : dict
        Attributes of `EntryPriors` other than the sensors', which are the unit's own.

    Raises
    ------
    ConfigError
        A number is none, or a prior is unknown or out of range.
    """

    fixes: pd.DataFrame = field(repr=False)
    impact: float = 0.0
    window: float = 10.0
    before: float = 0.02
    antenna: Sequence[float] = (0.0, 0.0, 0.0)
    priors: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("impact", "window", "before"):
            if not finite(getattr(self, name)):
                raise ConfigError(
                    "crash.gnss-entry-not-a-number",
                    quantity=f"GNSS entry, {name}",
                    value=getattr(self, name),
                )
        triple(self.antenna, "GNSS entry, antenna", "sensors.point-not-three-numbers")
        for name in self.priors:
            if name not in OTHER_PRIORS:
                raise ConfigError(
                    "crash.no-prior",
                    quantity="GNSS entry, priors",
                    name=name,
                    word=str(name),
                    known=OTHER_PRIORS,
                )
        EntryPriors(gyro=TriadUncertainty(), accel=TriadUncertainty(), **self.priors)


def start_from_gnss(
    at: AtPoint, given: GnssEntry, point: Sequence[float]
) -> tuple[AtPoint, Entry, EntryState]:
    """Find the entry of a unit and take off the biases that were found with it.

    Parameters
    ----------
    at : AtPoint
    given : GnssEntry
    point : sequence of float, (3,), m
        Where the unit was moved to, vehicle axes from the vehicle's origin.

    Returns
    -------
    at : AtPoint
        Without the biases. Of its unknowns, those of the biases are gone, and each other one
        counts only as far as it adds something else than it did on average over the window:
        that much the biases have taken in. How the unit is turned in roll and pitch is taken in
        by the attitude, too, and counts all the same: the bound is on the safe side there.
    entry : Entry
        With the joint covariance of attitude, velocity and biases.
    state : EntryState
        As it was estimated, with every fix and why it was used or not.

    Raises
    ------
    DataError, ConfigError, DivergenceError
        As `entry_state_from_gnss`; or an axis or the turning of the unit is assumed.
    """
    unit = None if at.prepared is None else at.prepared.unit
    if unit is None or unit.gyro is None:
        raise DataError("crash.mean-several-units-no-sensors", file=at.name, quantity="entry")
    if at.assumed_axes:
        raise DataError(
            "crash.assumed-not-measured-nothing-carries",
            file=at.name,
            quantity="entry",
            assumed_axes=at.assumed_axes,
        )
    C_vs = unit.mounting.C_vs
    anchor = given.impact - given.before
    state = entry_state_from_gnss(
        at.imu,
        given.fixes,
        impact=given.impact,
        anchor=anchor,
        window=given.window,
        antenna=tuple(float(a - p) for a, p in zip(given.antenna, point, strict=True)),
        priors=EntryPriors(
            gyro=turned_uncertainty(unit.gyro.uncertainty, C_vs),
            accel=turned_uncertainty(unit.accelerometers[0].uncertainty, C_vs),
            **given.priors,
        ),
    )
    return _without_biases(at, state, anchor - given.window), _entry(state), state


def _entry(state: EntryState) -> Entry:
    order = np.r_[ATTITUDE, VELOCITY, GYRO_BIAS, ACCEL_BIAS]
    values, vectors = np.linalg.eigh(state.covariance[np.ix_(order, order)])
    columns = (vectors * np.sqrt(np.maximum(values, 0.0))).T
    roll, pitch, heading = (float(x) for x in state.roll_pitch_heading)
    north, east, down = (float(v) for v in state.state.v_n)
    nothing = np.zeros(3)
    return Entry(
        time=state.state.time,
        velocity=(north, east, down),
        heading_deg=heading % 360.0,
        unknowns=tuple(
            # A bias that is larger than was found leaves less for the motion.
            (
                f"{CONTRIBUTOR} {k + 1}",
                CONTRIBUTOR,
                (*np.r_[c[:6], nothing, -c[6:]].tolist(),),
            )
            for k, c in enumerate(columns)
        ),
        attitude_deg=(roll, pitch),
        lat_deg=float(np.degrees(state.state.lat)),
        lon_deg=float(np.degrees(state.state.lon)),
        alt=state.state.alt,
        source="GNSS before the crash",
    )


def _without_biases(at: AtPoint, state: EntryState, begin: float) -> AtPoint:
    effects = at.effects
    time = at.imu.index.to_numpy(dtype=np.float64)
    window = (time >= begin) & (time <= state.state.time)
    keep = [k for k, c in enumerate(effects.contributors) if c not in BIASES]
    force = effects.force[keep] - effects.force[keep][:, window].mean(axis=1, keepdims=True)
    rate = effects.rate[keep] - effects.rate[keep][:, window].mean(axis=1, keepdims=True)
    return replace(
        at,
        imu=state.with_biases_off(at.imu),
        effects=replace(
            effects,
            names=tuple(effects.names[k] for k in keep),
            contributors=tuple(effects.contributors[k] for k in keep),
            force=force,
            rate=rate,
            rest_force=np.zeros((len(keep), 3)),
            tilt=np.zeros((len(keep), 3)),
        ),
    )
