"""Alignment in the inertial frame: for a body that rocks and sways about a place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.alignment import Alignment
from strapdown.alignment.coarse import CoarseAlignment
from strapdown.alignment.inertial_fit import InertialFit, fit_inertially
from strapdown.alignment.inertial_sums import InertialSums, sum_inertially
from strapdown.alignment.north import CONTRADICTION, latitude_findings, north_findings
from strapdown.alignment.propagated_errors import sensor_covariance, sensor_noise
from strapdown.alignment.record_checks import check_gravity, check_record
from strapdown.alignment.residual_noise import ResidualNoise, residual_noise
from strapdown.alignment.site import Site
from strapdown.alignment.still import still_by_gnss
from strapdown.exceptions import ConfigError, DataError, Finding, nearest
from strapdown.sensors.imu_uncertainty import ImuUncertainty

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
                f"'{self.at}' is no epoch", quantity="at", remedy=nearest(str(self.at), EPOCHS)
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
        source = imu.attrs.get("source")
        findings = [*check_record(imu)]
        sums = sum_inertially(imu)
        findings += check_gravity(_mean_force(sums), source)
        fit = fit_inertially(sums, site)
        noise = residual_noise(sums, fit, sensors)
        whole = _covariance(sums, fit, noise, sensors, None)
        sd = np.sqrt(np.maximum(np.diagonal(whole), 0.0))
        _refuse_travel(noise, fit, sd, sums.length, source)
        if noise.significant:
            findings.append(_left_over(noise, sd[2], sums.length, source))
        findings += north_findings(site, float(sd[2]), sensors, source)
        findings += still_by_gnss(gnss, imu, site, float(sd[2]))
        findings += _gravity_findings(fit, float(sd[4]), source)
        measured = site.lat_deg + float(np.degrees(fit.latitude_change))
        findings += latitude_findings(site, measured, float(np.degrees(sd[3])), source)
        C_nb, covariance = fit.C_nb, whole[:3, :3]
        if self.at == "end":
            level = rotation.dcm_from_rotation_vector(-site.earth_rate * sums.length)
            C_nb = level @ fit.C_nb @ rotation.dcm_from_quaternion(sums.turned[-1])
            covariance = _covariance(sums, fit, noise, sensors, level)
        return Alignment(
            self.name,
            sums.start + (sums.length if self.at == "end" else 0.0),
            rotation.quaternion_from_dcm(C_nb),
            covariance,
            findings=tuple(findings),
        )


def _mean_force(sums: InertialSums) -> Array:
    return np.asarray(sums.node_velocity.sum(axis=0) / sums.length)


def _covariance(
    sums: InertialSums,
    fit: InertialFit,
    noise: ResidualNoise,
    sensors: ImuUncertainty,
    level: Array | None,
) -> Array:
    """Of attitude at the start, latitude and gravity (5, 5); or, with `level`, of that at the end.

    `level` turns the local level at the start into that at the end.
    """
    turn, push, place = fit.response.turn, fit.response.push, fit.response.place
    if level is not None:
        # The gyros carry the attitude to the end, with every error of theirs.
        turn = level @ (turn[:, :3] + fit.C_nb)
        push, place = level @ push[:, :3], level @ place[:, :3]
    total = sensor_covariance(sums, turn, push, sensors)
    total += sensor_noise(sums, turn, push, sensors)
    total += noise.covariance(sums, push, place)
    return 0.5 * (total + total.T)


def _refuse_travel(
    noise: ResidualNoise, fit: InertialFit, sd: Array, length: float, source: str | None
) -> None:
    """Refuse a record whose leftovers drown north."""
    if not (noise.significant and sd[2] > 1.0):
        return
    raise DataError(
        f"the body did not stay at its place, or the gyros do not tell its turns: within "
        f"{length:.4g} s the second integral of the specific force departs from gravity's by "
        f"{noise.sway:.3g} m (root mean square), {noise.ratio:.3g} times what the noise of the "
        f"sensors explains, and the heading is not known to better than "
        f"{np.degrees(sd[2]):.3g} deg",
        file=source,
        quantity="accel",
        remedy="align while the vehicle stands (it may rock), or with gnss_course while it "
        "drives; check units and axes of the gyros",
    )


def _left_over(noise: ResidualNoise, sd: float, length: float, source: str | None) -> Finding:
    returns = noise.excess[0] > 0.0 and noise.excess[2] + noise.excess[3] == 0.0
    return Finding(
        f"slow motion or noise that the sensors do not explain: {noise.ratio:.3g} times their "
        f"noise, {noise.sway:.2g} m (root mean square) over {length:.4g} s; it is in the stated "
        f"uncertainty of the heading, {np.degrees(sd):.2g} deg"
        + (": the body sways about its place" if returns else ""),
        file=source,
        quantity="accel",
        remedy="align for longer, while the vehicle does not drive; where it stood, state noisier "
        "sensors",
    )


def _gravity_findings(fit: InertialFit, sd: float, source: str | None) -> tuple[Finding, ...]:
    off = fit.gravity_change
    if not abs(off) > CONTRADICTION * sd:
        return ()
    return (
        Finding(
            f"gravity is measured {1e6 * off:+.4g} ppm off that of the site, "
            f"{abs(off) / max(sd, 1e-300):.1f} standard deviations of the accelerometers",
            file=source,
            quantity="accel",
            remedy="check the height and the latitude of the site, the scale of the "
            "accelerometers and their stated bias, and that the vehicle did not drive",
        ),
    )
