"""Error specification of a triad of sensors, of an IMU, and of its axes matrix."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from strapdown.errors import ConfigError, Finding
from strapdown.tables.checks import Array, is_number

Triad = tuple[float, float, float]
Matrix = tuple[Triad, Triad, Triad]
# Accepted input for a triad.
TriadLike = float | Sequence[float]

ZERO: Triad = (0.0, 0.0, 0.0)
NO_MATRIX: Matrix = (ZERO, ZERO, ZERO)

# Attributes per axis; with one value for the triad; and matrices.
TRIADS = (
    "noise_density",
    "bias",
    "bias_instability",
    "random_walk",
    "trend",
    "scale",
    "nonlinearity_2",
    "nonlinearity_3",
    "quantization",
    "full_scale",
    "warm_up",
    "vibration_rectification",
)
NOT_NEGATIVE = ("noise_density", "bias_instability", "random_walk", "quantization", "jitter")
POSITIVE = ("correlation_time", "full_scale", "bandwidth", "warm_up_time")


@dataclass(frozen=True)
class TriadErrors:
    """Errors of one triad of sensors, independent of the sample rate.

    The unit u is rad/s for gyros and m/s² for accelerometers. For a per-axis attribute, a single
    number applies to all three axes. `error_chain` defines their effect and order.

    Attributes
    ----------
    noise_density : triad, u/√Hz
        White noise: a sample over an interval dt has the standard deviation ``noise_density /
        √dt``, and the integral has ``noise_density √t``.
    bias : triad, u
    bias_instability : triad, u
        Standard deviation of a stationary first-order Gauss-Markov process.
    correlation_time : float, s
        Correlation time of that process: its autocorrelation is ``exp(-|t| / correlation_time)``.
    random_walk : triad, u/√s
        Bias random walk: standard deviation ``random_walk √t``, zero at the first sample.
    trend : triad, u/s
        Bias change per time, zero at time zero.
    scale : triad
        Relative scale factor error: an axis outputs ``1 + scale`` times its input.
    misalignment : 3x3, rad
        ``misalignment[i][j]``, i ≠ j, is the fraction of the input along body axis j sensed by axis
        i (small angles; six cross-axis terms). The diagonal is zero; see `scale`.
    g_sensitivity : 3x3, u per m/s²
        For gyros: output of axis i per specific force along body axis j.
    nonlinearity_2, nonlinearity_3 : triad
        Error of second and third order, relative to full scale, at full-scale input.
    quantization : triad, u
        Quantization step; zero for none. For an increment sensor read as a mean rate, the step of
        the increment times the sample rate; no remainder is carried over.
    full_scale : triad, u
        The output is clipped to ± this.
    bandwidth : float, Hz
        -3 dB frequency of a single-pole low-pass between motion and sampler. Noise and drifts are
        those of the output and do not pass through it.
    jitter : float, s
        Standard deviation of the sampling instant about the stamp.
    warm_up : triad, u
        Part of the bias at time zero that decays as ``exp(-t / warm_up_time)``.
    warm_up_time : float, s
    vibration_rectification : triad, u per (m/s²)²
        Output shift per mean square vibration along the axis.

    Raises
    ------
    ConfigError
        A number is not finite or out of range, or the nonlinearity makes the transfer curve
        non-monotone.
    """

    noise_density: TriadLike = ZERO
    bias: TriadLike = ZERO
    bias_instability: TriadLike = ZERO
    correlation_time: float = math.inf
    random_walk: TriadLike = ZERO
    trend: TriadLike = ZERO
    scale: TriadLike = ZERO
    misalignment: Sequence[Sequence[float]] = NO_MATRIX
    g_sensitivity: Sequence[Sequence[float]] = NO_MATRIX
    nonlinearity_2: TriadLike = ZERO
    nonlinearity_3: TriadLike = ZERO
    quantization: TriadLike = ZERO
    full_scale: TriadLike = math.inf
    bandwidth: float = math.inf
    jitter: float = 0.0
    warm_up: TriadLike = ZERO
    warm_up_time: float = math.inf
    vibration_rectification: TriadLike = ZERO

    def __post_init__(self) -> None:
        for f in fields(self):
            given = getattr(self, f.name)
            try:
                value = _plain(f.name, given)
            except (TypeError, ValueError):
                raise _refused(f.name, _shape(f.name), given=repr(given)) from None
            object.__setattr__(self, f.name, value)
            for number in _numbers(value):
                if math.isnan(number) or (math.isinf(number) and f.name not in POSITIVE):
                    raise _refused(f.name, "sensors.no-finite-number", number=number)
                if f.name in POSITIVE and number <= 0.0:
                    raise _refused(f.name, "sensors.not-positive", number=number)
                if f.name in NOT_NEGATIVE and number < 0.0:
                    raise _refused(f.name, "sensors.negative", number=number)
                if f.name == "scale" and number <= -1.0:
                    raise _refused(f.name, "sensors.leaves-no-signal", number=number)
        for i, row in enumerate(self.misalignment):
            if row[i] != 0.0:
                raise _refused(
                    "misalignment", "sensors.misalignment-diagonal-not-zero", i=i + 1, at_row=row[i]
                )
            if sum(abs(x) for x in row) >= 1.0:
                raise _refused(
                    "misalignment", "sensors.row-sums-rad", i=i + 1, sum=sum(abs(x) for x in row)
                )
        # The slope ``1 + s + 2 n2 x + 3 n3 x²`` must stay positive on [-1, 1].
        axes = zip(
            self.axis("scale"),
            self.axis("nonlinearity_2"),
            self.axis("nonlinearity_3"),
            self.axis("full_scale"),
            strict=True,
        )
        for s, n2, n3, full in axes:
            if n2 == 0.0 and n3 == 0.0:
                continue
            if math.isinf(full):
                raise _refused("full_scale", "sensors.nonlinearity-relative-none")
            places = [-1.0, 1.0]
            if n3 != 0.0 and abs(n2) < abs(3.0 * n3):
                places.append(-n2 / (3.0 * n3))
            least = min(1.0 + s + 2.0 * n2 * x + 3.0 * n3 * x * x for x in places)
            if least <= 0.0:
                raise _refused(
                    "nonlinearity", "sensors.slope-falls-nominal-within-range", least=least
                )

    def axis(self, name: str) -> Triad:
        """Return a per-axis attribute as three numbers."""
        value: Triad = getattr(self, name)
        return value


@dataclass(frozen=True)
class ImuErrors:
    """Errors of an inertial measurement unit.

    Attributes
    ----------
    gyro : TriadErrors
        In rad/s; default, error-free.
    accel : TriadErrors, optional
        In m/s²; None is an error-free accelerometer.
    """

    gyro: TriadErrors = field(default_factory=TriadErrors)
    accel: TriadErrors | None = None


def _plain(name: str, value: Any) -> float | Triad | Matrix:
    if name in TRIADS:
        return triad_of((value,) * 3 if isinstance(value, int | float) else value)
    if name in ("misalignment", "g_sensitivity"):
        return matrix_of(value)
    return float(value)


def triad_of(values: Any) -> Triad:
    """Three numbers as plain floats."""
    x, y, z = values
    return (float(x), float(y), float(z))


def matrix_of(rows: Any) -> Matrix:
    """Three rows of three numbers as plain floats."""
    first, second, third = rows
    return (triad_of(first), triad_of(second), triad_of(third))


def _shape(name: str) -> str:
    """Return the error code for the expected shape."""
    if name in TRIADS:
        return "sensors.not-one-or-three-numbers"
    if name in ("misalignment", "g_sensitivity"):
        return "sensors.not-three-rows-of-three"
    return "sensors.not-one-number"


def _numbers(value: Any) -> list[float]:
    if isinstance(value, tuple):
        return [number for part in value for number in _numbers(part)]
    return [float(value)]


def _refused(name: str, code: str, **values: Any) -> ConfigError:
    return ConfigError(code, quantity=name, data=values)


# Validation of user input: three numbers, or one.

#: Largest distance between two points of a road vehicle; a larger position is in mm.
FARTHEST = 30.0  # m


def triple(given: Any, quantity: str, code: str, file: str | None = None, **values: Any) -> Triad:
    """Return three finite numbers as a triad.

    `code`: of the error, whose data include `given` and `values`. `**values`: further data of the
    error. ConfigError: the input is not three finite numbers.
    """
    try:
        x, y, z = (float(v) for v in given)
    except (TypeError, ValueError):
        x = y = z = math.nan
    if isinstance(given, str) or not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)):
        raise ConfigError(code, file=file, quantity=quantity, data={**values, "given": repr(given)})
    return x, y, z


def span(given: Any) -> tuple[float, float] | None:
    """Return two finite, increasing numbers; None if the value is not such a pair."""
    try:
        start, end = given
    except (TypeError, ValueError):
        return None
    if not (finite(start) and finite(end) and start < end):
        return None
    return float(start), float(end)


def finite(given: Any) -> bool:
    """Whether the value is one real, finite number."""
    return is_number(given) and math.isfinite(given)


def check_sd(given: Any, quantity: str, unit: str, file: str | None = None) -> None:
    """Check a standard deviation.

    ConfigError: the value is not a number, negative or not finite.
    """
    if not finite(given) or given < 0.0:
        raise ConfigError(
            "sensors.standard-deviation-invalid",
            file=file,
            quantity=quantity,
            given=given,
            unit=unit,
        )


# Checks of the matrix M from sensor axes to body axes. Its rows are the body's forward, right and
# down, each in components along the sensor's x, y, z: ``v_body = M v_sensor``.


#: Unit designs by name. Chernodarov (2009): with its (1,4) set to -Θz, the printed matrix of (1) is
#: that of ``2 dq/dt = q (0, ω)`` for ``ω = (-Θy, Θx, Θz)``: gyros rotated by 90° about z.
NAMED_AXES: dict[str, tuple[tuple[float, float, float], ...]] = {
    "chernodarov-2009": ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
}
#: Tolerance of ``M M'`` about 1: cosines with three decimals, but no misalignment.
ROUNDING = 2e-3
# A vehicle during alignment is within this of level, and far from level with wrong axes.
_LEVEL, _FAR = 0.94, 0.7  # cosines of 20° and 45°


def check_axes_matrix(matrix: ArrayLike, quantity: str = "matrix") -> Array:
    """Check that a matrix rotates one right-handed triad into another.

    `matrix` ((3, 3)): sensor axes to body forward-right-down. `quantity`: for messages. Returns (3,
    3): the nearest rotation, without the rounding of the input decimals. ConfigError: it is not 3x3
    finite numbers, its rows are not orthonormal to 2e-3, or it is a mirror image (determinant -1).
    """
    try:
        m = np.array(matrix, dtype=np.float64)
    except (TypeError, ValueError):
        m = np.empty(0)
    if m.shape != (3, 3) or not np.isfinite(m).all():
        raise ConfigError("sensors.not-three-rows-three-finite", quantity=quantity)
    product = m @ m.T
    worst = np.unravel_index(np.argmax(np.abs(product - np.eye(3))), (3, 3))
    if abs(product[worst] - (worst[0] == worst[1])) > ROUNDING:
        raise _not_square(product, (int(worst[0]), int(worst[1])), quantity)
    if np.linalg.det(m) < 0.0:
        raise ConfigError(
            "sensors.matrix-mirror-image",
            quantity=quantity,
            # Most likely two rows were swapped, or one lost its sign.
            down=np.cross(m[0], m[1]) + 0.0,
        )
    u, _, vt = np.linalg.svd(m)
    return np.asarray(u @ vt)


def _not_square(product: Array, worst: tuple[int, int], quantity: str) -> ConfigError:
    rows = ("forward", "right", "down")
    i, j = sorted(worst)
    if i == j:
        return ConfigError(
            "sensors.matrix-row-not-unit",
            quantity=quantity,
            row_number=i + 1,
            row_name=rows[i],
            length=np.sqrt(product[i, i]),
        )
    size = float(np.sqrt(product[i, i] * product[j, j]))
    angle = float(np.degrees(np.arccos(np.clip(product[i, j] / size, -1.0, 1.0))))
    return ConfigError(
        "sensors.matrix-rows-not-perpendicular",
        quantity=quantity,
        first=i + 1,
        second=j + 1,
        names=(rows[i], rows[j]),
        angle=angle,
    )


def axes_letters(matrix: Array) -> tuple[str, Array]:
    """Split a rotation into signed axes, as in ``--axes``, and a remaining rotation.

    `matrix` ((3, 3)): as returned by `check_axes_matrix`. Returns `letters`: such as ``x,-y,-z``:
    the sensor axes nearest to forward, right and down, among all right-handed choices; `turn` ((3,
    3)): remaining rotation: ``matrix = turn @ letters``; the identity if the axes are parallel.
    """
    best, found = -np.inf, np.eye(3)
    for plain in _right_handed():
        fit = float(np.sum(plain * matrix))
        if fit > best + 1e-9:
            best, found = fit, plain
    words = []
    for row in found:
        axis = int(np.argmax(np.abs(row)))
        words.append(("-" if row[axis] < 0 else "") + "xyz"[axis])
    return ",".join(words), np.asarray(matrix @ found.T)


def _right_handed() -> list[Array]:
    """The 24 rotations that map axes to axes."""
    out = []
    for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)):
        for signs in np.ndindex(2, 2, 2):
            m = np.eye(3)[list(order)] * (1.0 - 2.0 * np.array(signs))[:, None]
            if np.linalg.det(m) > 0:
                out.append(m)
    return out


def report_transposed(
    matrix: Array, force: Sequence[float] | Array, file: str
) -> tuple[Finding, ...]:
    """Report a matrix that appears transposed: gravity is level only with its transpose.

    `matrix` ((3, 3)). `force` ((3,), m/s²): mean specific force in body axes, after applying the
    matrix. `file`: for messages.
    """
    body = np.asarray(force, dtype=np.float64)
    size = float(np.linalg.norm(body))
    if not size > 0.0:
        return ()
    up = body / size
    other = matrix.T @ matrix.T @ up
    if -up[2] > _FAR or -other[2] < _LEVEL:
        return ()
    tilt = float(np.degrees(np.arccos(np.clip(-up[2], -1.0, 1.0))))
    return (
        Finding(
            "sensors.matrix-looks-transposed-body-lies", file=file, quantity="matrix", tilt=tilt
        ),
    )
