"""A mobile laboratory with a satellite receiver: outliers, an outage, and who bears them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from papers.chernodarov.bench import ELLIPSOID, HEADING_DEG, SENSOR, SITE, after, align
from strapdown.alignment import FineResult
from strapdown.earth import radii_of_curvature
from strapdown.errors import DataError, DivergenceError
from strapdown.estimation import (
    ErrorFilter,
    ErrorModel,
    Huber,
    PaperUpdate,
    QuaternionModel,
    RobustUpdate,
    Tukey,
    UpdateRule,
)
from strapdown.increments import motion_increments
from strapdown.navigation import (
    ClosedLoop,
    Correction,
    Gnss,
    LostCovarianceError,
    NavigationChunk,
    Navigator,
)
from strapdown.simulation import (
    Accelerate,
    GnssReceiver,
    LaneChange,
    Origin,
    PathMotion,
    Stop,
    Straight,
    Turn,
    car,
    simulate_gnss,
    simulate_imu,
)
from strapdown.tables import GEODETIC, POSITION_SD, VELOCITY, VELOCITY_SD

Array = NDArray[np.float64]

UNIT = 2
ROAD_SPEED = 15.0  # m/s
RATE = 100.0  # Hz, of the inertial sensors: as after the digital filter
ENDS = (100.0, 300.0)  # s, of the coarse and of the fine alignment before the drive
RECEIVER = GnssReceiver(rate=1.0, position_noise=(3.0, 3.0, 5.0), velocity_noise=0.1)
#: A receiver of today beside it, with the phase of the carrier.
PRECISE = GnssReceiver(rate=1.0, position_noise=(0.02, 0.02, 0.04), velocity_noise=0.02)
OUTLIER_SHARE, OUTLIER_SDS = 0.1, 50.0
OUTAGE = (600.0, 720.0)  # s
_GNSS_SEED, _OUTLIER_SEED = 3, 5
# Samples at a time: what comes before a run is lost is kept up to here.
PIECE = 1000

#: Ways to take an observation, by the names in tables.
RULES: dict[str, UpdateRule | None] = {
    "plain": None,
    "robust, Huber": RobustUpdate(Huber()),
    "robust, Tukey": RobustUpdate(Tukey()),
    "printed, Huber": PaperUpdate(Huber()),
    "printed, Tukey": PaperUpdate(Tukey()),
}
#: What the receiver tells, by the names in tables.
FIXES = ("clean", "outliers", "outage", "both")


def route() -> PathMotion:
    """Return the drive: five minutes at rest, then thirteen through streets with stops."""
    block = (
        ("straight", Straight(60.0)),
        ("turn", Turn(90.0, 60.0)),
        ("straight", Straight(50.0)),
        ("lane", LaneChange(3.5, 5.0)),
        ("turn", Turn(-60.0, 80.0)),
        ("stop", Stop(6.0, 10.0)),
        ("go", Accelerate(ROAD_SPEED, 10.0)),
    )
    return car(
        Origin(SITE.lat_deg, SITE.lon_deg, SITE.alt),
        (("rest", Straight(ENDS[1])), ("go", Accelerate(ROAD_SPEED, 10.0)), *(5 * block)),
        heading_deg=HEADING_DEG,
        sway_roll=0.5,
        sway_pitch=0.5,
        ellipsoid=ELLIPSOID,
    )


@dataclass(frozen=True, eq=False)
class Driven:
    """One run.

    Attributes
    ----------
    time : ndarray, (n,), s
    error : ndarray, (n,), m
        Horizontal.
    velocity_error : ndarray, (n, 2), m/s
        North, east.
    sd_time, sd : ndarray, (m,), s and m
        What the filter states: the root of the sum of the variances north and east.
    least : float, m²
        The least variance of a place that it states: none is negative.
    history : ndarray, (n, 12)
        Rows of the mechanization.
    lost : str
        Why it went no further; empty where it came to the end.
    """

    time: Array
    error: Array
    velocity_error: Array
    sd_time: Array
    sd: Array
    least: float
    history: Array
    lost: str = ""

    @property
    def rms(self) -> float:
        """Root of the mean square of the horizontal error, m."""
        return float(np.sqrt(np.square(self.error).mean()))

    @property
    def worst(self) -> float:
        """Largest horizontal error, m."""
        return float(self.error.max())

    def largest(self, since: float, until: float) -> float:
        """Largest horizontal error of a part, m."""
        part = (self.time >= since - 1e-6) & (self.time <= until + 1e-6)
        return float(self.error[part].max()) if part.any() else float("nan")


@dataclass(frozen=True, eq=False)
class Drive:
    """The drive, sensed and aligned once, to be navigated in several ways."""

    motion: PathMotion = field(default_factory=route)

    @cached_property
    def imu(self) -> pd.DataFrame:
        """Imu table of the whole drive."""
        return simulate_imu(self.motion, SENSOR.draw(UNIT), rate=RATE, sampling="mean", seed=UNIT)[
            0
        ]

    @cached_property
    def increments(self) -> pd.DataFrame:
        """MotionIncrements table."""
        return motion_increments(self.imu, interpolation="cubic")

    @cached_property
    def truth(self) -> pd.DataFrame:
        """Trajectory at the samples after the alignment."""
        ends, _ = after(self.increments, self.aligned(QuaternionModel).state.time)
        return self.motion.trajectory(ends)

    @cached_property
    def _aligned(self) -> dict[type[ErrorModel], FineResult]:
        return {}

    def aligned(self, model: type[ErrorModel]) -> FineResult:
        """The alignment before the drive by an error model."""
        if model not in self._aligned:
            self._aligned[model] = align(self.imu, self.increments, model, ends=ENDS)
        return self._aligned[model]

    @cached_property
    def _fixes(self) -> dict[GnssReceiver, pd.DataFrame]:
        return {}

    def fixes(self, kind: str, receiver: GnssReceiver = RECEIVER) -> pd.DataFrame:
        """What the receiver tells after the alignment.

        Parameters
        ----------
        kind : str
            Of `FIXES`.
        receiver : GnssReceiver

        Returns
        -------
        DataFrame
        """
        if receiver not in self._fixes:
            self._fixes[receiver] = simulate_gnss(self.motion, receiver, seed=_GNSS_SEED)
        whole = self._fixes[receiver]
        out = whole[whole.index > ENDS[1] + 0.5]
        if kind in ("outliers", "both"):
            out = with_outliers(out)
        if kind in ("outage", "both"):
            out = out[(out.index < OUTAGE[0]) | (out.index > OUTAGE[1])]
        out.attrs = dict(whole.attrs)
        return out

    def navigate(
        self,
        rule: UpdateRule | None,
        fixes: pd.DataFrame | None,
        model: type[ErrorModel] = QuaternionModel,
        damped: bool = True,
        damping: Correction | None = None,
    ) -> Driven:
        """Drive.

        Parameters
        ----------
        rule : UpdateRule or None
        fixes : DataFrame or None
            From `fixes`; none: inertial alone.
        model : type of ErrorModel
        damped : bool
            Whether the estimates of the alignment are taken off the sensors.
        damping : Damping, optional
            Whether what is estimated is fed back; it is, if not given.

        Returns
        -------
        Driven
        """
        fine = self.aligned(model)
        filter_: ErrorFilter = replace(fine.filter, rests=False, rule=rule)
        begun = fine.state
        if not damped:
            begun = replace(begun, sensors=np.zeros_like(begun.sensors))
        navigator = Navigator(filter_, (Gnss(name="gnss"),), damping=damping or ClosedLoop())
        state = navigator.begin_from(begun)
        if fixes is not None:
            state = navigator.tell(state, "gnss", fixes)
        ends, rows = after(self.increments, begun.time)
        pieces: list[NavigationChunk] = []
        lost, least = "", np.inf
        for k in range(0, len(ends), PIECE):
            try:
                state, piece = navigator.advance(state, ends[k : k + PIECE], rows[k : k + PIECE])
            except (DataError, DivergenceError) as error:
                lost = error.finding.what
                if isinstance(error, LostCovarianceError):
                    least = float(error.place.min())
                if not pieces:
                    raise
                break
            pieces.append(piece)
        time = np.concatenate([p.time for p in pieces])
        history = np.concatenate([p.history for p in pieces])
        path = filter_.mechanization.trajectory(time, history)
        marks = [m for p in pieces for m in p.marks]
        each = np.array([np.diagonal(m.covariance)[:2] for m in marks])
        return Driven(
            time,
            apart(path, self.truth.iloc[: len(time)]),
            (path[VELOCITY[:2]].to_numpy() - self.truth[VELOCITY[:2]].to_numpy()[: len(time)]),
            np.array([m.time for m in marks]),
            np.sqrt(np.maximum(each, 0.0).sum(axis=1)),
            min(float(each.min()), least),
            history,
            lost,
        )


def apart(path: pd.DataFrame, truth: pd.DataFrame) -> Array:
    """Horizontal distance between two trajectories at the same instants, (n,), m."""
    lat = truth["lat"].to_numpy()
    meridian, transverse = radii_of_curvature(lat, ellipsoid=ELLIPSOID)
    off = np.radians(path[["lat", "lon"]].to_numpy() - truth[["lat", "lon"]].to_numpy())
    alt = truth["alt"].to_numpy()
    north = off[:, 0] * (meridian + alt)
    east = off[:, 1] * (transverse + alt) * np.cos(np.radians(lat))
    return np.asarray(np.hypot(north, east))


def with_outliers(fixes: pd.DataFrame) -> pd.DataFrame:
    """Return fixes of which a tenth of the places and a tenth of the velocities are far off.

    By `OUTLIER_SDS` standard deviations in each component, with signs by chance.
    """
    draw = np.random.default_rng(_OUTLIER_SEED)
    hit = draw.random((len(fixes), 2)) < OUTLIER_SHARE
    sign = draw.choice([-1.0, 1.0], (len(fixes), 6))
    out = fixes.copy()
    place = OUTLIER_SDS * out[POSITION_SD].to_numpy() * sign[:, :3] * hit[:, :1]
    lat = out["lat"].to_numpy()
    meridian, transverse = radii_of_curvature(lat, ellipsoid=ELLIPSOID)
    place[:, 0] /= meridian
    place[:, 1] /= transverse * np.cos(np.radians(lat))
    place[:, :2] = np.degrees(place[:, :2])
    place[:, 2] *= -1.0
    out[GEODETIC] += place
    out[VELOCITY] += OUTLIER_SDS * out[VELOCITY_SD].to_numpy() * sign[:, 3:] * hit[:, 1:]
    return out
