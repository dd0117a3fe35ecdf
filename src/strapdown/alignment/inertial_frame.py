"""Alignment in the inertial frame: for a body that rocks and sways about a position."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.alignment import record_checks as checks
from strapdown.alignment.alignment import Alignment, CoarseAlignment, Site
from strapdown.alignment.inertial_sums import InertialSums, moments, sum_inertially
from strapdown.alignment.mean_errors import CHANCE, mean_of_drift, sensor_covariance, sensor_noise
from strapdown.constants import DEG_PER_HOUR
from strapdown.dsp.chi_square import chi_square_exceeded
from strapdown.earth import earth_rate
from strapdown.errors import DataError, Finding, add_warning, check_choice
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables import GYRO
from strapdown.tables.checks import Array, source_of

EPOCHS = ("end", "start")


@dataclass(frozen=True)
class InertialFrame(CoarseAlignment):
    """The direction of gravity turns with the Earth, observed in inertial axes held by the gyros.

    Attributes
    ----------
    at : {'end', 'start'}
        The sample of the resulting attitude.

    Raises
    ------
    ConfigError
        The epoch is unknown.
    """

    name: ClassVar[str] = "inertial_frame"
    summary: ClassVar[str] = (
        "gravity's turn with the Earth, in axes that the gyros hold still: for a body that rocks "
        "about its place"
    )
    source: ClassVar[str] = "Wahba 1965; Markley 1988; fit to the second integral: derived here"

    at: str = "end"

    def __post_init__(self) -> None:
        check_choice("alignment.unknown-epoch", EPOCHS, quantity="at", at=self.at)

    def align(
        self,
        imu: pd.DataFrame,
        site: Site,
        sensors: ImuUncertainty,
        gnss: pd.DataFrame | None = None,
    ) -> Alignment:
        """As `CoarseAlignment.align`; at the first sample with ``at="start"``.

        DataError: the record is unusable, its force is not gravity, the body traveled, or the
        standard deviation of the heading exceeds 1 rad.
        """
        source = source_of(imu)
        findings = [*checks.check_record(imu)]
        sums = sum_inertially(imu)
        findings += checks.check_gravity(sums.node_velocity.sum(axis=0) / sums.length, source)
        fit = fit_inertially(sums, site)
        noise = residual_noise(sums, fit, sensors)
        own = _own_covariance(sums, fit, sensors)
        findings += checks.north_findings(site, float(np.sqrt(own[2, 2])), sensors, source)
        whole = own + noise.covariance(sums, fit.response.push, fit.response.place)
        sd = np.sqrt(np.maximum(np.diagonal(whole), 0.0))
        _refuse_travel(noise, sd, imu, site, findings)
        if noise.significant:
            add_warning(
                findings,
                "alignment.unexplained-slow-motion",
                file=source,
                quantity="accel",
                ratio=noise.ratio,
                length=sums.length,
                sway=noise.sway,
                sd_deg=np.degrees(sd[2]),
            )
        findings += checks.still_by_gnss(gnss, imu, site, float(sd[2]))
        findings += turn_findings(sums, fit.C_nb, site, sensors, source)
        findings += checks.gravity_findings(fit.gravity_change, float(sd[4]), source)
        measured = site.lat_deg + float(np.degrees(fit.latitude_change))
        measured_sd = float(np.degrees(sd[3]))
        findings += checks.latitude_findings(site, measured, measured_sd, source)
        C_nb, covariance = fit.C_nb, whole[:3, :3]
        if self.at == "end":
            level = rotation.dcm_from_rotation_vector(-site.earth_rate * sums.length)
            C_nb = level @ fit.C_nb @ rotation.dcm_from_quaternion(sums.turned[-1])
            covariance = _own_covariance(sums, fit, sensors, level)
            covariance += noise.covariance(
                sums, level @ fit.response.push[:, :3], level @ fit.response.place[:, :3]
            )
        return Alignment(
            self.name,
            sums.start + (sums.length if self.at == "end" else 0.0),
            rotation.quaternion_from_dcm(C_nb),
            covariance,
            measured_latitude_deg=measured,
            measured_latitude_sd_deg=measured_sd,
            findings=tuple(findings),
        )


def _own_covariance(
    sums: InertialSums, fit: InertialFit, sensors: ImuUncertainty, level: Array | None = None
) -> Array:
    """Covariance by the sensors alone: of attitude at the start, latitude and gravity (5, 5).

    With `level`, which rotates the local level at the start to that at the end, of the attitude
    at the end (3, 3).
    """
    turn, push = fit.response.turn, fit.response.push
    if level is not None:
        # The gyros propagate the attitude to the end, with all their errors.
        turn = level @ (turn[:, :3] + fit.C_nb)
        push = level @ push[:, :3]
    return sensor_covariance(sums, turn, push, sensors) + sensor_noise(sums, turn, push, sensors)


def _refuse_travel(
    noise: ResidualNoise, sd: Array, imu: pd.DataFrame, site: Site, findings: list[Finding]
) -> None:
    """Refuse a record whose residuals are too large to find north."""
    if not (noise.significant and sd[2] > checks.LARGEST_SD):
        return
    rate = imu[GYRO].to_numpy(dtype=np.float64).mean(axis=0)
    length = float(imu.index[-1] - imu.index[0])
    # A burst of outliers or a gap is a likelier cause than a drive.
    known = [f for f in findings if f.row is not None]
    if known:
        raise DataError(known[0].explains("alignment.heading-lost", sd_deg=np.degrees(sd[2])))
    raise DataError(
        "alignment.body-travelled-or-gyros-in-deg-per-s"
        if checks.seems_in_deg_per_s(rate, site)
        else "alignment.body-travelled",
        file=source_of(imu),
        quantity="accel",
        length=length,
        sway=noise.sway,
        ratio=noise.ratio,
        sd_deg=np.degrees(sd[2]),
    )


# Attitude that aligns the specific force of a record with gravity at its position.
#
# In the body axes of the first instant, fixed in inertial space, the second integral of the
# specific force is ``S(t) = s0 + v0 t + C_bn W(t) + e(t)``. In the local-level axes of that
# instant, fixed likewise, the second integral of minus gravity is known:
# ``W(t) = -∫∫ exp([ω t x]) g``. Both are expanded in Legendre polynomials of time; degrees zero
# and one are position and velocity, which are not needed. The others form Wahba's problem.
#
# A body that rocks and sways stays near its position, so that ``e`` is bounded by its excursion and
# does not grow, while ``W`` grows as ``g t²/2``: for the mean force the fit is a weight
# ``30 t² (T - t)²/T⁵`` that vanishes at both ends with its slope. On white noise of the
# accelerometers it costs a fifth of the standard deviation against the plain mean.


# Degrees 0 and 1 are nuisance, 2 and 3 hold the attitude; those above, at most ten periods over the
# record, determine the noise.
DEGREES = 21
FIRST_FREE = 4
_STEP = 1e-4  # rad of latitude, for a derivative that is a sine


@dataclass(frozen=True, eq=False)
class Response:
    """Sensitivity of the estimates to an error in a node, (m, 5, 3) each.

    The estimates are: error of the attitude at the first instant (3, north-east-down, rad), of the
    latitude (rad) and of the magnitude of gravity (relative). An error is a vector in the body axes
    at the first instant.

    `turn` ((m, 5, 3), per rad): of an error of the angle within the node. `push` ((m, 5, 3), per
    m/s): of an error of the velocity gained within the node. `place` ((m, 5, 3), per m s): of an
    error of the second integral, times the length of the node.
    """

    turn: Array
    push: Array
    place: Array


@dataclass(frozen=True, eq=False)
class InertialFit:
    """The attitude at the first instant, and the residuals.

    `C_nb` ((3, 3)): body to local level at the first instant. `measured`, `known` ((DEGREES, 3),
    m): coefficients of S in north-east-down by the fitted attitude, and of W. `latitude_change`
    (rad): measured latitude minus the site's: from the Earth's rate across the vertical.
    `gravity_change`: measured gravity minus the site's, relative.
    """

    C_nb: Array
    measured: Array
    known: Array
    latitude_change: float
    gravity_change: float
    response: Response

    @property
    def residual(self) -> Array:
        """Measured minus known, (DEGREES, 3), m; degrees 0 and 1 are not used."""
        return self.measured - self.known


def turning_gravity(stamps: Array, rate: float) -> Array:
    """Second integrals of 1, sin(w t)/w and (1 - cos(w t))/w²; (n, 3).

    Minus gravity of an Earth that turns by the vector w is
    ``-(g + sin(w t)/w (w x g) + (1 - cos(w t))/w² w x (w x g))``.
    """
    t = stamps
    plain = 0.5 * t * t
    once = (t - np.sin(rate * t) / rate) / rate**2
    twice = (plain - 2.0 * np.square(np.sin(0.5 * rate * t) / rate)) / rate**2
    return np.column_stack([plain, once, twice])


def fallen_gravity(basis: Array, gravity: Array, rate: Array) -> Array:
    """W, second integral of minus gravity, from (..., 3) of `turning_gravity`; (..., 3), m."""
    across = np.cross(rate, gravity)
    return np.asarray(-basis @ np.vstack([gravity, across, np.cross(rate, across)]))


def _wahba(measured: Array, known: Array, weights: Array) -> Array:
    """C with the least sum of weighted squares of ``C measured - known`` (Markley 1988)."""
    product = (known * weights[:, None]).T @ measured
    u, _, vt = np.linalg.svd(product)
    sign = np.linalg.det(u) * np.linalg.det(vt)
    return np.asarray(u @ np.diag([1.0, 1.0, sign]) @ vt)


def fit_inertially(sums: InertialSums, site: Site) -> InertialFit:
    """Fit the attitude.

    Wahba's problem by the singular value decomposition (Markley, J. Astronaut. Sci. 36 (1988) 245):
    north, east and down are determined by ``g`` and by ``ω x g``, which the second and third powers
    of the time carry.
    """
    gravity, rate = site.gravity, site.earth_rate
    basis = turning_gravity(sums.stamps, float(np.sqrt(rate @ rate)))
    both = moments(sums.stamps, np.hstack([sums.fallen, basis]), DEGREES)
    measured_b, basis = both[:, :3], both[:, 3:]
    known = fallen_gravity(basis, gravity, rate)
    weights: Array = np.asarray(2.0 / (2.0 * np.arange(DEGREES) + 1.0), dtype=np.float64)
    weights[:2] = 0.0
    C_nb = _wahba(measured_b, known, weights)
    measured = measured_b @ C_nb.T

    lat = np.degrees(_STEP)
    ahead, behind = (_rate_at(site, site.lat_deg + side * lat) for side in (1.0, -1.0))
    by_latitude = (
        fallen_gravity(basis, gravity, ahead) - fallen_gravity(basis, gravity, behind)
    ) / (2.0 * _STEP)
    cross = np.array([rotation.cross_matrix(x) for x in known])
    design = np.concatenate([-cross, by_latitude[:, :, None], known[:, :, None]], axis=2)
    normal = np.einsum("d,dik,dil->kl", weights, design, design)
    # The estimate rotates to cancel an error: C d + phi x W = 0, coupled to latitude and gravity.
    gain3 = -np.linalg.solve(normal[:3, :3], _rows(design[:, :, :3], weights))
    gain5 = _solve(normal, _rows(design, weights))
    gain = np.concatenate([gain3, gain5[3:]]).reshape(5, DEGREES, 3)
    change = np.einsum("kdi,di->k", gain[3:], measured - known)
    return InertialFit(
        C_nb, measured, known, float(change[0]), float(change[1]), _response(sums, gain, C_nb)
    )


def _rate_at(site: Site, lat_deg: float) -> Array:
    """Rate of the Earth in the local level, continued beyond the poles."""
    at_equator = earth_rate(0.0, ellipsoid=site.ellipsoid)
    size = float(np.sqrt(at_equator @ at_equator))
    lat = np.radians(lat_deg)
    return size * np.array([np.cos(lat), 0.0, -np.sin(lat)])


def _rows(design: Array, weights: Array) -> Array:
    return np.asarray(np.einsum("d,dik->kdi", weights, design).reshape(design.shape[2], -1))


def _solve(normal: Array, rows: Array) -> Array:
    """Solve where a direction may be unobservable (latitude at the equator): it is set to zero."""
    scale = np.sqrt(np.diagonal(normal))
    scale = np.where(scale > 0.0, scale, 1.0)
    inner = np.linalg.pinv(normal / np.outer(scale, scale), rcond=1e-12)
    return np.asarray((inner @ (rows / scale[:, None])) / scale[:, None])


def functionals(sums: InertialSums) -> tuple[Array, Array]:
    """Coefficients per second integral times time in a node, and per velocity gained in it.

    Returns `place`, `push` ((DEGREES, m)): exact for a constant within a node: by integrals of the
    polynomials from the end.
    """
    from numpy.polynomial import legendre

    ends = np.concatenate([[0.0], np.cumsum(sums.node_length)])
    u = 2.0 * ends / ends[-1] - 1.0
    place, push = (np.empty((DEGREES, len(u) - 1)) for _ in range(2))
    for d in range(DEGREES):
        once = legendre.legint(np.eye(d + 1)[d], lbnd=1)
        # The second is the integral of P_d(s) (s - u) from u to the end.
        thrice = legendre.legint(once, m=2, lbnd=1)
        for out, whole in ((place, once), (push, thrice)):
            out[d] = (2 * d + 1) / sums.length * np.diff(legendre.legval(u, whole)) / np.diff(u)
    return place, push * (0.5 * sums.length) ** 2


def _response(sums: InertialSums, gain: Array, C_nb: Array) -> Response:
    place, push = functionals(sums)
    # Errors are in the initial body axes; the gain is for north, east, down.
    gain_b = gain @ C_nb
    of_place = np.einsum("kdi,dm->mki", gain_b, place)
    of_push = np.einsum("kdi,dm->mki", gain_b, push)
    # An angle error d rotates all that follows: d x dv = -[dv x] d; half of its own node.
    crosses = np.array([rotation.cross_matrix(v) for v in sums.node_velocity])
    turned = -of_push @ crosses
    after = np.cumsum(turned[::-1], axis=0)[::-1]
    return Response(after - 0.5 * turned, of_push, of_place)


# Rotation of a body against the local level, or mismatch of the gyros' vertical and the latitude.

BLOCKS = 10


def heading_rate(
    sums: InertialSums, C_nb: Array, site: Site, sensors: ImuUncertainty
) -> tuple[float, float]:
    """Rate of the body about the vertical against the local level.

    `C_nb` ((3, 3)): at the first sample. Returns `rate`, `sd` (rad/s): slope of the line through
    the angle. The variance adds to the sensor errors the scatter of the angle about the line,
    ``12 s²/(m T²)`` with s that of the means of m = 10 parts.
    """
    picked = np.unique(np.linspace(0, len(sums.stamps) - 1, 50 * BLOCKS).astype(np.int64))
    time = sums.stamps[picked]
    turned = rotation.dcm_from_quaternion(sums.turned[picked])
    level = rotation.dcm_from_rotation_vector(-site.earth_rate * time[:, None])
    turn = level @ (C_nb @ turned @ C_nb.T)
    angle = np.unwrap(np.arctan2(turn[:, 1, 0], turn[:, 0, 0]))
    off = time - time.mean()
    slope = float(off @ angle) / float(off @ off)
    left = angle - angle.mean() - slope * off
    means = np.array([part.mean() for part in np.array_split(left, BLOCKS)])
    scatter = 12.0 * means.var(ddof=2) / (BLOCKS * sums.length**2)
    gyro = sensors.gyro
    # The slope of a line through a random walk has 6/5 of the variance of its end point.
    noise = 1.2 * np.square(gyro.axis("noise_density")) / sums.length
    own = np.square(gyro.axis("bias")) + mean_of_drift(sensors.gyro_drift, sums.length) + noise
    across = np.square(gyro.axis("misalignment")) + np.square(gyro.axis("scale"))
    own = own + across * float(site.earth_rate @ site.earth_rate)
    own = own + np.square(gyro.axis("g_sensitivity")) * 9.8**2
    return slope, float(np.sqrt(own.max() + scatter))


def turn_findings(
    sums: InertialSums, C_nb: Array, site: Site, sensors: ImuUncertainty, source: str | None
) -> tuple[Finding, ...]:
    """Report a rotation about the vertical; parameters as of `heading_rate`.

    One finding, if the rate is more than five standard deviations from zero. It does no harm to an
    inertial-frame alignment of a body that turned; it does if the body was stationary.
    """
    rate, sd = heading_rate(sums, C_nb, site, sensors)
    if not abs(rate) > checks.CONTRADICTION * sd:
        return ()
    vertical = -float(site.earth_rate[2])
    size = float(np.sqrt(site.earth_rate @ site.earth_rate))
    mirrored = abs(rate + 2.0 * -vertical) < abs(rate) / 10.0
    # Relative to the level of a latitude, a stationary body turns by the excess of that rate.
    sine = (vertical - rate) / size
    measured = float(np.degrees(np.arcsin(np.clip(sine, -1.0, 1.0))))
    if mirrored:
        code = "alignment.turns-about-vertical-latitude-mirrored"
    elif abs(sine) <= 1.0:
        code = "alignment.turns-about-vertical-as-elsewhere"
    else:
        code = "alignment.turns-about-vertical"
    return (
        Finding(
            code,
            file=source,
            quantity="gyro",
            rate=rate * DEG_PER_HOUR,
            sd=sd * DEG_PER_HOUR,
            lat_deg=site.lat_deg,
            measured_deg=measured,
        ),
    )


# Slow noise that the sensors do not explain, from the residuals of an inertial fit.
#
# The fit uses the Legendre degrees 2 and 3 of the second integral of the specific force. The
# degrees above hold noise alone: from 4 to 20, two horizontal axes each, their energies give the
# level of the noise and its slope with frequency, and so its level at degrees 2 and 3.


#: White in position, in velocity, in specific force, and in its derivative.
KINDS = ("place", "velocity", "force", "walk")
_ROUNDS = 300


@dataclass(frozen=True, eq=False)
class ResidualNoise:
    """Excess noise over the noise of the sensors.

    `ratio`: root of the mean ratio of energies: measured over predicted by the sensors.
    `significant`: whether chance gives this with a probability below one in a million. `excess`
    ((4,)): spectral densities of `KINDS`: m²/Hz, (m/s)²/Hz, (m/s²)²/Hz, (m/s³)²/Hz; zero where it
    is not significant. `sway` (m): root mean square of the horizontal excursion that no fit takes
    away.
    """

    ratio: float
    significant: bool
    excess: Array
    sway: float

    def covariance(self, sums: InertialSums, push: Array, place: Array) -> Array:
        """Covariance of an estimate to errors of velocity gain and position; as `Response`.

        `push`, `place` ((m, k, 3)). Returns (k, k).
        """
        dt = sums.node_length
        by_place, by_force = place, push
        by_velocity = _onward(place * dt[:, None, None])
        by_walk = _onward(push * dt[:, None, None])
        total = np.zeros((push.shape[1], push.shape[1]))
        for density, response in zip(
            self.excess, (by_place, by_velocity, by_force, by_walk), strict=True
        ):
            total += density * np.einsum("mki,mli,m->kl", response, response, dt)
        return total


def _onward(response: Array) -> Array:
    """Sum over all later nodes, and half of the node itself."""
    return np.asarray(np.cumsum(response[::-1], axis=0)[::-1] - 0.5 * response)


def residual_noise(sums: InertialSums, fit: InertialFit, sensors: ImuUncertainty) -> ResidualNoise:
    """Test and estimate the noise in the residuals of a fit.

    The energies of a degree are exponentially distributed about the sum of the contributions of
    each kind of noise; maximum-likelihood densities are found by steps that keep them positive and
    never lose likelihood (Févotte and Idier 2011, doi:10.1162/NECO_a_00168, the Itakura-Saito
    divergence with exponent 1/2).
    """
    shapes = _energies(sums)[:, FIRST_FREE:]
    g = float(np.linalg.norm(sums.node_velocity.sum(axis=0))) / sums.length
    drift = sensors.accel_drift
    known = max(sensors.accel.axis("noise_density")) ** 2 * shapes[2]
    walk = (g * max(sensors.gyro.axis("noise_density"))) ** 2
    walk += 2.0 * max(drift.triad) ** 2 / drift.correlation_time + max(drift.steps) ** 2
    known = known + walk * shapes[3]
    energy = np.square(fit.residual[FIRST_FREE:, :2]).sum(axis=1)
    # Rounding error of a second integral of some 1e6 m.
    known = known + (1e-14 * float(np.abs(sums.fallen[-1]).max())) ** 2
    axes = 2 * len(energy)
    statistic = float((energy / known).sum())
    significant = statistic > chi_square_exceeded(CHANCE, axes)
    excess = np.zeros(len(KINDS))
    if significant:
        excess = _likeliest(energy, known, shapes)
    degrees = np.arange(FIRST_FREE, DEGREES)
    slow = float((np.square(fit.residual[FIRST_FREE:, :2]).T / (2.0 * degrees + 1.0)).sum())
    return ResidualNoise(
        float(np.sqrt(statistic / axes)), significant, excess, float(np.sqrt(slow))
    )


def _energies(sums: InertialSums) -> Array:
    """Variance of each degree per unit density of each kind, (4, DEGREES)."""
    place, push = functionals(sums)
    dt = sums.node_length
    later = np.triu(np.ones((len(dt), len(dt))), 1).T + 0.5 * np.eye(len(dt))
    velocity, walk = (place * dt) @ later, (push * dt) @ later
    return np.array([(np.square(x) * dt).sum(axis=1) for x in (place, velocity, push, walk)])


def _likeliest(energy: Array, known: Array, shapes: Array) -> Array:
    scale = energy.mean() / np.maximum(shapes.mean(axis=1), 1e-300)
    density = scale / len(shapes)
    for _ in range(_ROUNDS):
        model = known + density @ shapes
        # Two axes share a degree: its energy is twice the variance on average.
        up = shapes @ (0.5 * energy / model**2)
        down = shapes @ (1.0 / model)
        density = density * np.sqrt(up / np.maximum(down, 1e-300))
    return np.asarray(density)
