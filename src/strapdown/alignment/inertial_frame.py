"""Alignment in the inertial frame: for a body that rocks and sways about a place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.alignment import Alignment
from strapdown.alignment.body_turn import turn_findings
from strapdown.alignment.coarse import CoarseAlignment
from strapdown.alignment.inertial_fit import InertialFit, fit_inertially
from strapdown.alignment.inertial_sums import InertialSums, sum_inertially
from strapdown.alignment.north import (
    LARGEST_SD,
    latitude_findings,
    north_findings,
    seems_in_deg_per_s,
)
from strapdown.alignment.propagated_errors import sensor_covariance, sensor_noise
from strapdown.alignment.record_checks import check_gravity, check_record, gravity_findings
from strapdown.alignment.residual_noise import ResidualNoise, residual_noise
from strapdown.alignment.site import Site
from strapdown.alignment.still import still_by_gnss
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.tables import GYRO
from strapdown.tables.checks import source_of

Array = NDArray[np.float64]

__all__ = ["EPOCHS", "InertialFrame"]

EPOCHS = ("end", "start")


@dataclass(frozen=True)
class InertialFrame(CoarseAlignment):
    """Gravity turns with the Earth, and is seen to, from axes that the gyros hold still.

    Attributes
    ----------
    at : {'end', 'start'}
        The sample at which the attitude is wanted.

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
        if self.at not in EPOCHS:
            raise ConfigError(
                "alignment.unknown-epoch",
                quantity="at",
                at=self.at,
                word=str(self.at),
                known=EPOCHS,
            )

    def align(
        self,
        imu: pd.DataFrame,
        site: Site,
        sensors: ImuUncertainty,
        gnss: pd.DataFrame | None = None,
    ) -> Alignment:
        """As `CoarseAlignment.align`; at the first sample with ``at="start"``.

        Raises
        ------
        DataError
            The record has no accelerometer, a dead channel, a value that is not finite or too
            few samples; its force is not gravity; the body travelled; or the heading is not
            known to 1 rad.
        """
        source = source_of(imu)
        findings = [*check_record(imu)]
        sums = sum_inertially(imu)
        findings += check_gravity(_mean_force(sums), source)
        fit = fit_inertially(sums, site)
        noise = residual_noise(sums, fit, sensors)
        own = _own_covariance(sums, fit, sensors)
        findings += north_findings(site, float(np.sqrt(own[2, 2])), sensors, source)
        whole = own + noise.covariance(sums, fit.response.push, fit.response.place)
        sd = np.sqrt(np.maximum(np.diagonal(whole), 0.0))
        _refuse_travel(noise, sd, imu, site, findings)
        if noise.significant:
            findings.append(_left_over(noise, sd[2], sums.length, source))
        findings += still_by_gnss(gnss, imu, site, float(sd[2]))
        findings += turn_findings(sums, fit.C_nb, site, sensors, source)
        findings += gravity_findings(fit.gravity_change, float(sd[4]), source)
        measured = site.lat_deg + float(np.degrees(fit.latitude_change))
        measured_sd = float(np.degrees(sd[3]))
        findings += latitude_findings(site, measured, measured_sd, source)
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


def _mean_force(sums: InertialSums) -> Array:
    return np.asarray(sums.node_velocity.sum(axis=0) / sums.length)


def _own_covariance(
    sums: InertialSums, fit: InertialFit, sensors: ImuUncertainty, level: Array | None = None
) -> Array:
    """What the sensors alone make: of attitude at the start, latitude and gravity (5, 5).

    With `level`, which turns the local level at the start into that at the end, of the attitude
    at the end (3, 3).
    """
    turn, push = fit.response.turn, fit.response.push
    if level is not None:
        # The gyros carry the attitude to the end, with every error of theirs.
        turn = level @ (turn[:, :3] + fit.C_nb)
        push = level @ push[:, :3]
    return sensor_covariance(sums, turn, push, sensors) + sensor_noise(sums, turn, push, sensors)


def _refuse_travel(
    noise: ResidualNoise, sd: Array, imu: pd.DataFrame, site: Site, findings: list[Finding]
) -> None:
    """Refuse a record whose leftovers drown north."""
    if not (noise.significant and sd[2] > LARGEST_SD):
        return
    rate = imu[GYRO].to_numpy(dtype=np.float64).mean(axis=0)
    length = float(imu.index[-1] - imu.index[0])
    # A burst of outliers or a gap explains it better than a drive.
    known = [f for f in findings if f.row is not None]
    if known:
        raise DataError(
            "alignment.heading-lost",
            file=known[0].file,
            row=known[0].row,
            quantity=known[0].quantity,
            reason=known[0],
            sd_deg=np.degrees(sd[2]),
        )
    raise DataError(
        "alignment.body-travelled-or-gyros-in-deg-per-s"
        if seems_in_deg_per_s(rate, site)
        else "alignment.body-travelled",
        file=source_of(imu),
        quantity="accel",
        length=length,
        sway=noise.sway,
        ratio=noise.ratio,
        sd_deg=np.degrees(sd[2]),
    )


def _left_over(noise: ResidualNoise, sd: float, length: float, source: str | None) -> Finding:
    return Finding(
        "alignment.unexplained-slow-motion",
        file=source,
        quantity="accel",
        ratio=noise.ratio,
        length=length,
        sway=noise.sway,
        sd_deg=np.degrees(sd),
    )
