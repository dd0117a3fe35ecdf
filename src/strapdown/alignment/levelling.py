"""Roll and pitch from the specific force at rest."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.alignment.alignment import Alignment, CoarseAlignment, Site
from strapdown.alignment.inertial_sums import sum_inertially
from strapdown.alignment.mean_errors import (
    BlockMeans,
    block_means,
    excursion,
    force_covariance,
    gravity_change,
    of_mean,
)
from strapdown.alignment.record_checks import check_gravity, check_record, gravity_findings
from strapdown.ellipsoids import WGS84
from strapdown.errors import ConfigError, DataError, Finding, add_warning
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables import GYRO
from strapdown.tables.checks import Array, is_number, source_of

# Roll and pitch alone: the heading is undetermined.


#: Standard deviation of an unknown heading: uniform over a turn, rad.
UNKNOWN_HEADING = math.pi / math.sqrt(3.0)


@dataclass(frozen=True)
class Levelling(CoarseAlignment):
    """Mean specific force at rest is up; the heading is unknown."""

    name: ClassVar[str] = "levelling"
    summary: ClassVar[str] = "roll and pitch from the mean specific force at rest; no heading"
    source: ClassVar[str] = "f_b = C_bn (0, 0, -g)"

    def align(
        self,
        imu: pd.DataFrame,
        site: Site,
        sensors: ImuUncertainty,
        gnss: pd.DataFrame | None = None,
    ) -> Alignment:
        """As `CoarseAlignment.align`; heading 0 is a placeholder."""
        found = level_at_rest(self.name, imu, site, sensors, 0.0, UNKNOWN_HEADING)
        unknown = Finding(
            "alignment.heading-not-known",
            file=source_of(imu),
            quantity="heading",
            unknown_heading_deg=math.degrees(UNKNOWN_HEADING),
        )
        return replace(found, findings=(*found.findings, unknown))


# Levelling with a stated heading.


@dataclass(frozen=True)
class KnownHeading(CoarseAlignment):
    """Roll and pitch from the mean specific force at rest; the heading as stated.

    Attributes
    ----------
    heading_deg : float, deg
        Of the body's forward axis at the first sample, from true north, clockwise. A body that
        swings is followed from there by its gyros; any other keeps it.
    sd_deg : float, deg
        Its standard deviation, above zero.

    Raises
    ------
    ConfigError
        The heading is not a number, or its standard deviation is not between 0 and 104.
    """

    name: ClassVar[str] = "known_heading"
    summary: ClassVar[str] = "roll and pitch from the mean specific force at rest; stated heading"
    source: ClassVar[str] = "f_b = C_bn (0, 0, -g)"

    heading_deg: float
    sd_deg: float

    def __post_init__(self) -> None:
        if not (is_number(self.heading_deg) and math.isfinite(self.heading_deg)):
            raise ConfigError(
                "alignment.heading-not-finite", quantity="heading_deg", heading_deg=self.heading_deg
            )
        if not (is_number(self.sd_deg) and 0.0 < self.sd_deg < math.degrees(UNKNOWN_HEADING)):
            raise ConfigError(
                "alignment.heading-sd-not-positive", quantity="sd_deg", sd_deg=self.sd_deg
            )

    def align(
        self,
        imu: pd.DataFrame,
        site: Site,
        sensors: ImuUncertainty,
        gnss: pd.DataFrame | None = None,
    ) -> Alignment:
        """As `CoarseAlignment.align`."""
        found = level_at_rest(
            self.name, imu, site, sensors, self.heading_deg, math.radians(self.sd_deg)
        )
        return replace(found, heading_given=True)


# Roll and pitch of a stationary body with their uncertainty, for a stated heading.


BLOCKS = 10


def level_at_rest(
    method: str,
    imu: pd.DataFrame,
    site: Site,
    sensors: ImuUncertainty,
    heading_deg: float,
    heading_sd: float,
) -> Alignment:
    """Level a stationary record.

    `method`: to be named in the result. `heading_deg` (deg): at the first sample. `heading_sd`
    (rad). The result holds at the last sample. Scatter of the force beyond noise is included in the
    covariance, with a finding. A body that swings is followed by its gyros (`_held`), or over a
    long time keeps its mean attitude within its angles.
    DataError: as `record_checks.check_record` and `check_gravity`; the body points to the zenith or
    the nadir.

    `rotation.level` takes gravity as vertical; above the ellipsoid its north component is
    ``8e-9 alt sin(2 lat)`` m/s², a microradian of tilt at 1200 m, which is neglected.
    """
    source = source_of(imu)
    findings = [*check_record(imu)]
    means = block_means(imu, BLOCKS)
    findings += check_gravity(means.whole_force, source)
    turning, loud = means.scatter(sensors)
    mean, blocks, swing = means.whole_force, means.force, np.zeros((3, 3))
    turned, turned_sd = NOT_TURNED, np.zeros(3)
    if loud > 1.0 or turning > 1.0:
        swing = excursion(imu, sensors.gyro.axis("noise_density"))
        size = float(np.sqrt(np.trace(swing)))
        followed = size > LEAST_SWING and EARTH_RATE * means.length < SMALL * size
        if turning > 1.0 and followed:
            blocks, turned, turned_sd = _held(imu, sensors, means, swing)
            mean, swing = blocks.mean(axis=0), np.zeros((3, 3))
        add_warning(
            findings,
            "alignment.specific-force-scatters",
            file=source,
            quantity="accel",
            blocks=BLOCKS,
            length=means.length / BLOCKS,
            loud=loud,
            turning=turning,
            in_bound=True,
            swing_deg=math.degrees(size),
        )
    roll, pitch = rotation.level(mean)
    C_nb = rotation.dcm_from_quaternion(rotation.quaternion_from_euler([roll, pitch, heading_deg]))
    force = force_covariance(sensors, means.length, mean)
    if loud > 1.0:
        force = force + of_mean(blocks)
    change = gravity_change(mean, force, site.gravity)
    findings += gravity_findings(*change, source)
    by_force, by_heading = error_of_force_and_heading(-site.gravity, pitch, heading_deg, source)
    # A swing about the vertical does not affect a heading that is stated for the mean attitude.
    by_swing = by_force @ rotation.cross_matrix(site.gravity) @ C_nb
    to_ned = by_force @ C_nb
    covariance = to_ned @ force @ to_ned.T + by_swing @ swing @ by_swing.T
    covariance += heading_sd**2 * np.outer(by_heading, by_heading)
    # Gravity is found in the middle, from which a wrong bias turns for half of the time.
    q_nb = rotation.compose(rotation.quaternion_from_dcm(C_nb), turned)
    late = means.length * np.array([[0.5], [0.5], [1.0]]) * rotation.dcm_from_quaternion(q_nb)
    covariance += (late * np.square(turned_sd)) @ late.T
    return Alignment(method, float(imu.index[-1]), q_nb, covariance, findings=tuple(findings))


#: No rotation from the first to the last sample. A mean rate beyond so many standard deviations of
#: the gyros' bias is a turn of the body.
NOT_TURNED = np.array([1.0, 0.0, 0.0, 0.0])
TURNS = 3.0
#: Standard deviation of the net turn of a swing over that of its angles.
NET = 2.0
#: A swing of this size, rad, is followed where the Earth turns by less than this part of it
#: meanwhile: over a longer time the mean attitude is better known than the angle turned.
LEAST_SWING, SMALL = math.radians(0.5), 0.1
EARTH_RATE = WGS84.rotation_rate


def _held(
    imu: pd.DataFrame, sensors: ImuUncertainty, means: BlockMeans, swing: Array
) -> tuple[Array, Array, Array]:
    """Means of the force of a swinging body in its axes at the first sample, held by the gyros.

    `swing`: as of `excursion`. Also the rotation to the last sample (quaternion), and the standard
    deviations of the rates that it is by, (3,), rad/s. The mean rate is that of a bias of known
    standard deviation B and of a swing, of mean rate m: the part ``B² / (B² + m²)`` is bias.
    """
    bias = sensors.gyro_bias_variance()
    by_swing = turn_variance(sensors, means, swing)
    part = np.divide(bias, bias + by_swing, out=np.zeros(3), where=bias > 0.0)
    table = imu.copy()
    table.attrs = dict(imu.attrs)
    table[GYRO] = table[GYRO].to_numpy(dtype=np.float64) - part * means.whole_rate
    sums = sum_inertially(table)
    ends = np.cumsum(sums.node_length)
    begins = np.searchsorted(ends, sums.length * np.arange(BLOCKS) / BLOCKS, side="right")
    begins = np.unique(np.minimum(begins, len(ends) - 1))
    lengths = np.add.reduceat(sums.node_length, begins)
    blocks = np.add.reduceat(sums.node_velocity, begins, axis=0) / lengths[:, None]
    return blocks, sums.turned[-1], np.sqrt(part * by_swing)


def turn_variance(sensors: ImuUncertainty, means: BlockMeans, swing: Array) -> Array:
    """Variances of the mean rate of a swinging body by its own turn, (3,), rad²/s².

    `swing`: as of `excursion`. A swing ends as far from its begin as two of its angles, sd √2 of
    theirs; a slow one further, because `excursion` is about a line: twice. A mean rate that the
    stated bias does not explain is a turn.
    """
    bias = sensors.gyro_bias_variance()
    rate = means.whole_rate
    by_swing: Array = np.square(NET / means.length) * np.diagonal(swing)
    # Of a swing as slow as the record the halves differ; by how much is known of all axes together.
    half = len(means.rate) // 2
    halves = means.rate[:half].mean(axis=0) - means.rate[half:].mean(axis=0)
    by_swing = np.maximum(by_swing, 0.5 * float(np.mean(np.square(halves))))
    turns = np.abs(rate) > TURNS * np.sqrt(bias)
    by_swing[turns] = np.maximum(by_swing, np.square(rate) - bias)[turns]
    return by_swing


# Attitude errors for a force known in both frames and a stated heading.

#: Beyond this pitch, deg, heading and roll axes coincide to within a minute of arc.
STEEPEST = 89.9


def error_of_force_and_heading(
    force: Array, pitch_deg: float, heading_deg: float, source: str | None = None
) -> tuple[Array, Array]:
    """Sensitivities of an attitude from a force in both frames and a stated heading.

    `force` ((3,), m/s²): North-east-down, known: minus gravity at rest. `pitch_deg`, `heading_deg`
    (deg). `source`: for messages. Returns `by_force` ((3, 3), rad per m/s²): of ``phi`` per error
    of the known force minus that of the measured one, north-east-down; `by_heading` ((3,),
    rad/rad). DataError: the body points to the zenith or the nadir: it has no heading.

    ``phi x F = e`` leaves the rotation about F free: ``phi = F x e/F² + l F``. The heading changes
    by ``phi_D + tan(pitch) (cos(heading) phi_N + sin(heading) phi_E)``, which gives l. At rest this
    is ``phi_N = -df_E/g``, ``phi_E = df_N/g``.
    """
    if not abs(pitch_deg) <= STEEPEST:
        raise DataError(
            "alignment.pitch-vertical", file=source, quantity="pitch", pitch_deg=pitch_deg
        )
    steep, heading = np.tan(np.radians(pitch_deg)), np.radians(heading_deg)
    row = np.array([steep * np.cos(heading), steep * np.sin(heading), 1.0])
    along = force / (row @ force)
    by_force = (np.eye(3) - np.outer(along, row)) @ rotation.cross_matrix(force) / (force @ force)
    return np.asarray(by_force), np.asarray(along)
