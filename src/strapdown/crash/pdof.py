"""Principal direction of force and its first-order uncertainty."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown.crash.acceleration import Acceleration
from strapdown.crash.delta_v import DeltaV, delta_v
from strapdown.errors import ConfigError, DataError, check_choice
from strapdown.rotation import within_half_turn
from strapdown.tables.checks import Array


@dataclass(frozen=True)
class Pdof:
    """Direction that a force came from, seen from the vehicle.

    Attributes
    ----------
    horizontal_deg : float, deg
        In (-180, 180]: 0 from the front, positive clockwise seen from above, so that 90 is from
        the right.
    vertical_deg : float, deg
        In [-90, 90]: positive from above.
    """

    horizontal_deg: float
    vertical_deg: float

    @property
    def clock(self) -> int:
        """Hour, 1 to 12, each 30 deg wide; 12 is the front."""
        return clock_of(self.horizontal_deg)


@dataclass(frozen=True)
class NedPdof:
    """Direction that a force came from, over ground.

    Attributes
    ----------
    azimuth_deg : float, deg
        In [0, 360): the force came from that side; 0 north, 90 east.
    relative_deg : float, deg
        In (-180, 180]: the same, clockwise from the heading at the impact.
    vertical_deg : float, deg
        In [-90, 90]: positive from above.
    """

    azimuth_deg: float
    relative_deg: float
    vertical_deg: float

    @property
    def clock(self) -> int:
        """Hour of the relative direction."""
        return clock_of(self.relative_deg)


def vector_of(change: DeltaV | ArrayLike, frames: Sequence[str]) -> Array:
    """Three components of a delta-V with a direction, in one of the frames."""
    if isinstance(change, DeltaV) and change.frame not in frames:
        raise ConfigError(
            "crash.delta-v-frame-needed", quantity="frame", frame=change.frame, frames=frames
        )
    vector = np.asarray(change.vector if isinstance(change, DeltaV) else change, dtype=np.float64)
    if vector.shape != (3,) or not np.isfinite(vector).all() or not vector.any():
        raise DataError("crash.no-direction", quantity="delta-V", vector=vector.tolist())
    return vector


def _angles(vector: Array) -> tuple[float, float]:
    x, y, z = vector.tolist()
    # 0 - y and not -y: a change without lateral component is from behind at +180 deg, not -180.
    horizontal = math.degrees(math.atan2(0.0 - y, 0.0 - x))
    return horizontal, math.degrees(math.atan2(z, math.hypot(x, y)))


def horizontal_angles(vectors: Array) -> Array:
    """Horizontal directions, (n,), deg, that the forces of many changes, (n, 3), came from."""
    return np.asarray(np.degrees(np.arctan2(0.0 - vectors[:, 1], 0.0 - vectors[:, 0])))


def pdof(change: DeltaV | ArrayLike) -> Pdof:
    """Direction of force from a change of velocity along vehicle axes.

    Parameters
    ----------
    change : DeltaV or array_like, (3,), m/s
        Forward, right, down, free of gravity.

    Returns
    -------
    Pdof
        ``horizontal = atan2(-dV_y, -dV_x)``, ``vertical = atan2(dV_z, hypot(dV_x, dV_y))``.
        For a vertical change the horizontal direction is 0 and undefined, which
        `pdof_interval` reports.

    Raises
    ------
    ConfigError
        The change is in north-east-down.
    DataError
        The change is zero, or not three finite numbers.
    """
    return Pdof(*_angles(vector_of(change, ("body", "impact"))))


def ned_pdof(change: DeltaV | ArrayLike, heading_deg: float) -> NedPdof:
    """Direction of force from a change of velocity over ground.

    Parameters
    ----------
    change : DeltaV or array_like, (3,), m/s
        North, east, down.
    heading_deg : float, deg
        Of the vehicle at the impact.

    Raises
    ------
    ConfigError
        The change is along vehicle axes.
    DataError
        The change is zero, or not three finite numbers; or the heading is not finite.
    """
    if not math.isfinite(heading_deg):
        raise DataError("crash.no-heading", quantity="heading", heading_deg=heading_deg)
    azimuth, vertical = _angles(vector_of(change, ("ned",)))
    relative = float(within_half_turn(np.array([azimuth - heading_deg]))[0])
    full = azimuth % 360.0
    # The remainder rounds a tiny negative angle up to 360.
    return NedPdof(0.0 if full >= 360.0 else full, relative, vertical)


def covariance_of(given: ArrayLike) -> Array:
    """A covariance, (3, 3): symmetric, finite, without a negative variance."""
    matrix = np.asarray(given, dtype=np.float64)
    good = matrix.shape == (3, 3) and bool(np.isfinite(matrix).all())
    if good:
        scale = float(np.abs(matrix).max())
        good = bool(np.abs(matrix - matrix.T).max() <= 1e-9 * scale)
        good = good and bool(np.linalg.eigvalsh(matrix).min() >= -1e-9 * scale)
    if not good:
        raise DataError(
            "crash.no-covariance", quantity="covariance", asarray=np.asarray(given).tolist()
        )
    return 0.5 * (matrix + matrix.T)


# Other conventions for a direction of force.


@dataclass(frozen=True)
class PdofConvention:
    """Convention for a horizontal direction.

    In which the force pushes (`to`) or from which it comes; clockwise seen from above or not; in
    [0, 360) (`full_turn`) or (-180, 180].
    """

    meaning: str
    to: bool = False
    clockwise: bool = True
    full_turn: bool = False


#: Zero is ahead in all conventions.
CONVENTIONS: dict[str, PdofConvention] = {
    "strapdown": PdofConvention(
        "the direction the force came from, clockwise, -180 to 180: 90 from the right"
    ),
    "nhtsa": PdofConvention(
        "the direction the force came from, clockwise, 0 to 360: 90 from the right, 350 from "
        "the front and a little from the left (degrees of the NASS CDS, CIREN and CISS files, "
        "whose clock is that of SAE J224)",
        full_turn=True,
    ),
    "counterclockwise": PdofConvention(
        "the direction the force came from, counterclockwise, -180 to 180: 90 from the left (axes "
        "forward-left-up, as of ISO 8855)",
        clockwise=False,
    ),
    "delta-v": PdofConvention(
        "the direction of the change of velocity, clockwise, -180 to 180: a frontal impact has "
        "180, one from the right -90",
        to=True,
    ),
    "delta-v counterclockwise": PdofConvention(
        "the direction of the change of velocity in axes forward-left-up, -180 to 180: one from "
        "the right has 90",
        to=True,
        clockwise=False,
    ),
    "tadic-2016": PdofConvention(
        "taken as strapdown's: Tadic and Vukajlovic (2016), Table 2, prints signed angles near "
        "zero for a frontal impact, and says neither which side is positive nor the range"
    ),
}


def _convention(name: str) -> PdofConvention:
    check_choice(
        "crash.no-convention-direction-force", CONVENTIONS, quantity="convention", name=name
    )
    return CONVENTIONS[name]


def to_convention(horizontal_deg: float, name: str) -> float:
    """Convert a direction to another convention.

    Parameters
    ----------
    horizontal_deg : float, deg
        The direction the force came from, clockwise from the front.
    name : str
        A key of `CONVENTIONS`.

    Returns
    -------
    float, deg

    Raises
    ------
    ConfigError
        The name is unknown, or the angle is not finite.
    """
    how = _convention(name)
    angle = _finite(horizontal_deg) + (180.0 if how.to else 0.0)
    return _wrapped(angle if how.clockwise else -angle, how.full_turn)


def from_convention(angle_deg: float, name: str) -> float:
    """Convert a direction from another convention.

    Parameters
    ----------
    angle_deg : float, deg
    name : str
        A key of `CONVENTIONS`.

    Returns
    -------
    float, deg
        The direction the force came from, clockwise from the front, in (-180, 180].

    Raises
    ------
    ConfigError
        As `to_convention`.
    """
    how = _convention(name)
    angle = _finite(angle_deg) if how.clockwise else -_finite(angle_deg)
    return _wrapped(angle - (180.0 if how.to else 0.0), False)


def clock_of(horizontal_deg: float) -> int:
    """Hour that a force came from, 1 to 12, by its direction, deg clockwise from the front.

    The nearest hour, each 30 deg wide: 12 is the front, 3 the right (Collision Deformation
    Classification, SAE J224, columns 1 and 2). A border belongs to the next hour clockwise: 15 deg
    is 1 o'clock, 345 deg is 12.
    """
    return (math.floor(_finite(horizontal_deg) / 30.0 + 0.5) - 1) % 12 + 1


def _wrapped(angle: float, full_turn: bool) -> float:
    turned = math.fmod(angle, 360.0)
    if full_turn:
        turned += 360.0 if turned < 0.0 else 0.0
        # The remainder rounds a tiny negative angle up to 360.
        return 0.0 if turned >= 360.0 else turned + 0.0
    if turned > 180.0:
        turned -= 360.0
    elif turned <= -180.0:
        turned += 360.0
    return turned + 0.0


def _finite(angle: float) -> float:
    if not math.isfinite(angle):
        raise ConfigError("crash.no-angle", quantity="direction", angle=angle)
    return float(angle)


# Interval of the direction of force with correct coverage also for a small delta-V.


@dataclass(frozen=True)
class AngleInterval:
    """All directions consistent with the measurement.

    `low_deg <= estimate <= high_deg`, continuous about it, so that either may lie beyond 180.
    `undetermined`: no direction can be excluded, as the change may be zero; the range is then
    whole.
    """

    low_deg: float
    high_deg: float
    undetermined: bool = False

    @property
    def width_deg(self) -> float:
        """From low to high, deg."""
        return self.high_deg - self.low_deg

    def contains(self, angle_deg: float) -> bool:
        """Whether the interval contains an angle, up to full turns."""
        return self.undetermined or (angle_deg - self.low_deg) % 360.0 <= self.width_deg


@dataclass(frozen=True)
class PdofInterval:
    """Intervals of the two angles of a direction of force, each with coverage `level`."""

    horizontal: AngleInterval
    vertical: AngleInterval
    level: float


def pdof_interval(
    change: DeltaV | ArrayLike, covariance: ArrayLike, level: float = 0.95
) -> PdofInterval:
    """Confidence intervals of the direction of force.

    Parameters
    ----------
    change : DeltaV or array_like, (3,), m/s
        In any frame; for north-east-down the horizontal interval is that of the azimuth.
    covariance : array_like, (3, 3), m²/s²
        Of its error, taken as normal.
    level : float
        Between 0 and 1.

    Returns
    -------
    PdofInterval
        The horizontal interval has the coverage `level` for every true change and covariance:
        exactly, except for the chance that the estimate points away from the truth by more than
        a right angle (in the metric of the covariance), which is below 1e-4 where the change is
        four standard deviations long. Where the change may be zero the interval is the whole
        circle and `undetermined`. The vertical interval is the same construction in the vertical
        plane through the estimate, within [-90, 90]; it neglects the error of the horizontal
        direction, of second order.

    Raises
    ------
    ConfigError
        `level` is not between 0 and 1.
    DataError
        The change is zero or not finite, or the covariance is not valid.

    Notes
    -----
    Fieller's theorem (Fieller 1954, J. R. Stat. Soc. B 16, 175-185). A direction u, (2,), is
    excluded where the component of the change m across it, n(u) m, which is normal with
    variance n P n and mean zero if u is the truth, exceeds z standard deviations: the
    interval is ``{u: (n m)² <= z² n P n}``, z = 1.96 for 95 %. This is the angle subtended at the
    origin by the ellipse ``(x - m) P^-1 (x - m) <= z²``. Note z² = 3.84, for one degree of
    freedom; the 95 % ellipse of the two components (5.99) would cover 98.6 %.
    """
    if not 0.0 < level < 1.0:
        raise ConfigError("crash.no-probability", quantity="level", level=level)
    vector = vector_of(change, ("body", "impact", "ned"))
    matrix = covariance_of(covariance)
    z = NormalDist().inv_cdf(0.5 + 0.5 * level)
    # 0 - x and not -x, as for the estimate: from behind is +180 deg.
    horizontal = _fieller(0.0 - vector[:2], matrix[:2, :2], z)
    if horizontal is None:
        across = AngleInterval(-180.0, 180.0, undetermined=True)
    else:
        across = AngleInterval(*horizontal)
    size = float(np.hypot(vector[0], vector[1]))
    ahead = vector[:2] / size if size > 0.0 else np.array([1.0, 0.0])
    turn = np.zeros((2, 3))
    turn[0, :2], turn[1, 2] = ahead, 1.0
    vertical = _fieller(np.array([size, vector[2]]), turn @ matrix @ turn.T, z)
    if vertical is None:
        up = AngleInterval(-90.0, 90.0, undetermined=True)
    else:
        up = AngleInterval(max(vertical[0], -90.0), min(vertical[1], 90.0))
    return PdofInterval(across, up, level)


def _fieller(mean: Array, spread: Array, z: float) -> tuple[float, float] | None:
    """Directions not excluded, deg about that of the mean; None if none is excluded."""
    # Scaled to avoid underflow of squares.
    scale = float(max(np.abs(mean).max(), math.sqrt(np.abs(spread).max())))
    if scale == 0.0:
        return None
    m, s = mean / scale, spread / scale**2
    # Normals n with n A n <= 0 belong to directions that are not excluded.
    a = np.outer(m, m) - z * z * s
    half, part = 0.5 * (a[0, 0] + a[1, 1]), 0.5 * (a[0, 0] - a[1, 1])
    swing = math.hypot(part, a[0, 1])
    most, least = half + swing, half - swing
    if most <= 0.0 or not m.any():
        return None
    # The middle direction is the axis of the largest eigenvalue; beside it, the normal turns
    # toward that axis until A vanishes.
    middle = 0.5 * math.degrees(math.atan2(a[0, 1], part))
    reach = math.degrees(math.atan(math.sqrt(max(-least, 0.0) / most)))
    estimate = math.degrees(math.atan2(m[1], m[0]))
    # Of the two opposite directions the one on the side of the estimate.
    away = float(within_half_turn(np.array(middle - estimate)))
    if abs(away) > 90.0:
        away -= math.copysign(180.0, away)
    return estimate + min(away - reach, 0.0), estimate + max(away + reach, 0.0)


# Sensitivity of a direction of force to the length of the window and to time zero.


#: Lengths of the windows of a sensitivity table, s.
WINDOWS = (0.010, 0.020, 0.030, 0.040, 0.050, 0.075, 0.100, 0.125, 0.150)
#: Shifts of time zero of a sensitivity table, s.
SHIFTS = (-0.010, -0.005, -0.002, -0.001, 0.0, 0.001, 0.002, 0.005, 0.010)


def _table(
    acceleration: Acceleration,
    spans: Sequence[tuple[float, float]],
    heading_deg: float,
    index: pd.Index,
) -> pd.DataFrame:
    """Change of velocity and direction of force of each span."""
    rows = []
    for start, end in spans:
        change = delta_v(acceleration, start, end, across_gaps=True)
        angles = (math.nan, math.nan)
        if change.vector.any() and acceleration.frame == "ned":
            over_ground = ned_pdof(change, heading_deg)
            angles = over_ground.relative_deg, over_ground.vertical_deg
        elif change.vector.any():
            angles = _angles(vector_of(change, ("body", "impact")))
        rows.append([*change.vector.tolist(), *angles])
    columns = ["dv_x", "dv_y", "dv_z", "horizontal_deg", "vertical_deg"]
    return pd.DataFrame(rows, index=index, columns=columns, dtype=np.float64)


def pdof_by_window(
    acceleration: Acceleration,
    time_zero: float,
    windows: Sequence[float] = WINDOWS,
    *,
    heading_deg: float = 0.0,
) -> pd.DataFrame:
    """Direction of force versus the length of the window from time zero.

    Parameters
    ----------
    acceleration : Acceleration
    time_zero : float, s
    windows : sequence of float, s
    heading_deg : float, deg
        At the impact; for a record in north-east-down, the direction is relative to this
        heading.

    Returns
    -------
    DataFrame
        Index ``window``, s; ``dv_x dv_y dv_z``, m/s, ``horizontal_deg``, ``vertical_deg``; NaN
        for a zero change of velocity. Windows that extend beyond the record are left out.

    Raises
    ------
    DataError
        None of the windows is within the record.
    """
    fit = [w for w in windows if w > 0.0 and _fits(acceleration, time_zero, time_zero + w)]
    if not fit:
        raise _no_window(acceleration, time_zero, windows)
    spans = [(time_zero, time_zero + w) for w in fit]
    return _table(acceleration, spans, heading_deg, pd.Index(fit, name="window", dtype=np.float64))


def pdof_by_shift(
    acceleration: Acceleration,
    time_zero: float,
    end: float,
    shifts: Sequence[float] = SHIFTS,
    *,
    keep_length: bool = False,
    heading_deg: float = 0.0,
) -> pd.DataFrame:
    """Direction of force versus an error of time zero.

    Parameters
    ----------
    acceleration : Acceleration
    time_zero, end : float, s
        The detected window.
    shifts : sequence of float, s
        Added to `time_zero`.
    keep_length : bool
        Whether the end is shifted as well.
    heading_deg : float, deg
        As `pdof_by_window`.

    Returns
    -------
    DataFrame
        Index ``shift``, s; columns as `pdof_by_window`.

    Raises
    ------
    DataError
        None of the windows is within the record.
    """
    ends = [end + (s if keep_length else 0.0) for s in shifts]
    pairs = [(s, time_zero + s, e) for s, e in zip(shifts, ends, strict=True)]
    fit = [(s, a, b) for s, a, b in pairs if b > a and _fits(acceleration, a, b)]
    if not fit:
        raise _no_window(acceleration, time_zero, [end - time_zero])
    index = pd.Index([s for s, _, _ in fit], name="shift", dtype=np.float64)
    return _table(acceleration, [(a, b) for _, a, b in fit], heading_deg, index)


def _fits(acceleration: Acceleration, start: float, end: float) -> bool:
    return acceleration.begin <= start and end <= acceleration.end


def _no_window(acceleration: Acceleration, zero: float, windows: Sequence[float]) -> DataError:
    shortest = min(windows, default=0.0)
    return DataError(
        "crash.no-window-shortest-ms-within",
        file=acceleration.source,
        quantity="window",
        zero=zero,
        shortest=shortest * 1000.0,
        begin=acceleration.begin,
        end=acceleration.end,
    )
