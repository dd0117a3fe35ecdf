"""Calibration of gyros and accelerometers from rests, turns between them, and known rotations.

One estimate serves all procedures. Unknown are the errors of the sensors, the direction of gravity
at each rest, the drift of the gyro bias from rest to rest, gravity, and the vertical part of the
Earth's rotation. Observations are:

- the mean specific force of a rest is gravity in its direction (the norm alone, in effect);
- the mean rate of a rest is bias, drift and g-sensitivity, beside the Earth's rotation;
- the rotation from rest to rest carries the direction of gravity along (Tedaldi, Pretto and
  Menegatti, ICRA 2014, doi:10.1109/ICRA.2014.6907297);
- poses of a case with its faces up (six positions), turns by known angles, rates of a rate table.

Body axes are those of the accelerometers: turned so that their misalignment is symmetric, because
gravity of unknown direction does not show a rotation of all three. Gyros are aligned to them.
"""

from __future__ import annotations

import hashlib
import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown.constants import STANDARD_GRAVITY, TWO_SIDED_95
from strapdown.errors import DataError, Finding, StrapdownError
from strapdown.sensors.calibration_model import (
    CROSS,
    PAIRS,
    PRIOR,
    XYZ,
    CalibrationConditions,
    CalibrationProblem,
    indices_of,
)
from strapdown.sensors.calibration_stops import CalibrationRecord, KnownRotation
from strapdown.sensors.error_chain import compensate
from strapdown.sensors.magnetometer import MagnetometerCalibration
from strapdown.sensors.triad_errors import ImuErrors, Triad, TriadErrors, matrix_of, triad_of
from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty
from strapdown.tables import ACCEL, GYRO, MAG
from strapdown.tables.checks import Array, index_of, values_of

#: A parameter whose standard deviation the log has not halved is not observed.
NOT_OBSERVED = 0.5
#: Rounds of variance components, and steps in each.
ROUNDS, STEPS = 6, 60
#: Damping of a step, beside the information of the prior, which is one.
LEAST_DAMPING, MOST_DAMPING = 0.05, 1e9
#: Correlation from which the file states it; parameters beyond so many prior standard deviations,
#: or such a misalignment, rad, are of no sensor.
CORRELATED, IMPOSSIBLE, SKEW = 0.3, 8.0, 0.4


@dataclass(frozen=True, eq=False)
class ImuCalibration:
    """Errors of an inertial sensor with their covariance.

    Attributes
    ----------
    errors : ImuErrors
        In the axes of the sensor, the misalignment of the accelerometers symmetric.
    temperature_slopes : ndarray, (2, 3)
        Change of the biases of gyros and accelerometers with temperature, rad/s/°C and m/s²/°C.
    temperature : float or None, °C
        At which the biases are those of `errors`.
    names : tuple of str
        Of the parameters: ``accel_bias_x`` … ``g_sensitivity_zz``; SI.
    values, prior_sd : ndarray, (n,)
    covariance : ndarray, (n, n)
    rests : DataFrame
        A row for each rest: ``log``, ``start``, ``end``, direction ``up_x`` …, ``force_error``
        m/s² before and ``force_left`` after calibration, ``turn_error`` and ``turn_left`` rad: of
        the vertical as the turn to this rest predicts it, but for the gyro bias.
    turns : DataFrame
        A row for each known rotation: ``axis``, ``known``, ``measured``, ``left``, rad or rad/s.
    remedies : tuple of str
        Poses and turns that would show what is not observed: ``+y``, ``+x-z`` (up), ``turn y``.
    excess : dict of str to float
        Beyond noise: of the force of rests ``accel`` m/s², of turns ``turns`` rad; ``drift`` of
        the gyro bias, rad/s/√s.
    """

    errors: ImuErrors
    temperature_slopes: Array
    temperature: float | None
    names: tuple[str, ...]
    values: Array
    prior_sd: Array
    covariance: Array
    rests: pd.DataFrame = field(repr=False)
    turns: pd.DataFrame = field(repr=False)
    remedies: tuple[str, ...]
    excess: dict[str, float]

    @property
    def sd(self) -> Array:
        """Standard deviation of each parameter, (n,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def up_covariance(self, up: Array) -> Array:
        """Covariance of vectors up of rests, (n, 3), by what is left of the accelerometers.

        Returns (3n, 3n): errors are alike in all rests.
        """
        J = np.zeros((len(up), 3, 9))
        J[:, :, 0:3] = np.eye(3) / STANDARD_GRAVITY
        J[:, :, 3:6] = np.einsum("ni,ij->nij", up, np.eye(3))
        for k, (i, j) in enumerate(indices_of(PAIRS)):
            J[:, i, 6 + k], J[:, j, 6 + k] = up[:, j], up[:, i]
        # A component along the vertical changes the size alone.
        J -= np.einsum("ni,nj,njk->nik", up, up, J)
        rows = J.reshape(-1, 9)
        return np.asarray(rows @ self.covariance[:9, :9] @ rows.T)

    @property
    def observed(self) -> NDArray[np.bool_]:
        """Whether the log halved the standard deviation of each parameter, (n,)."""
        return np.asarray(self.sd < NOT_OBSERVED * self.prior_sd)


def calibrate_imu(
    records: Sequence[CalibrationRecord],
    rotations: Sequence[KnownRotation] = (),
    prior: ImuUncertainty = PRIOR,
    conditions: CalibrationConditions | None = None,
) -> ImuCalibration:
    """Estimate the errors of gyros and accelerometers.

    Parameters
    ----------
    records : sequence of CalibrationRecord
        Of one sensor.
    rotations : sequence of KnownRotation
    prior : ImuUncertainty
        Standard deviations before the log is read. Those of noise and drift, if stated, are used
        where the log shows less.
    conditions : CalibrationConditions, optional

    Returns
    -------
    ImuCalibration
        A parameter that the log does not show stays near zero, with its prior standard deviation.

    Raises
    ------
    DataError
        There is neither a rest nor a known rotation, or turns cannot be assigned.

    Notes
    -----
    Maximum posterior by Gauss-Newton steps. Excess of the residuals of rests and of turns over
    their noise, and the drift of the gyro bias, are estimated with them (variance components by
    Helmert's method): a hand that shakes, and a bias that varies, widen the bounds.
    """
    problem = CalibrationProblem.of(
        records, rotations, prior, conditions or CalibrationConditions()
    )
    z = np.zeros(problem.size)
    problem.begin(z)
    for _ in range(ROUNDS):
        z = _solve(problem, z)
        if not problem.update_excess(z):
            break
    _, jacobian, _ = problem.linearize(z)
    covariance: Array = np.asarray(np.linalg.inv(jacobian.T @ jacobian + np.diag(problem.weight)))
    n = len(problem.names)
    gyro_skew = z[15:21] * problem.sd[15:21]
    if np.abs(z[:n]).max(initial=0.0) > IMPOSSIBLE or np.abs(gyro_skew).max() > SKEW:
        worst = int(np.argmax(np.abs(z[:n])))
        data = {"name": problem.names[worst], "value": float(z[worst] * problem.sd[worst])}
        raise DataError("calibrate.contradiction", quantity="log", **data)
    # What no error explains, m/s², is not larger than the errors themselves may be.
    left = problem.accel_excess
    if left > math.hypot(problem.sd[0], STANDARD_GRAVITY * problem.sd[3]):
        data = {"name": "accel_residual", "value": float(left)}
        raise DataError("calibrate.contradiction", quantity="log", **data)
    return _result(problem, z, covariance)


def _solve(problem: CalibrationProblem, z: Array) -> Array:
    """Damped Gauss-Newton steps to the maximum of the posterior.

    Damping is by the prior (Levenberg), not by the information (Marquardt): bias and scale of a
    face that was up on one side alone lie in a narrow curved valley, whose own direction is known
    by the prior only, 1e-7 of the information across it.
    """
    residual, jacobian, _ = problem.linearize(z)
    cost, damping = float(residual @ residual + problem.weight @ z**2), 0.0
    for _ in range(STEPS):
        normal = jacobian.T @ jacobian + np.diag(problem.weight)
        gradient = jacobian.T @ residual + problem.weight * z
        directions = [node.up for node in problem.nodes]
        while True:
            damped = normal + damping * np.eye(problem.size)
            step: Array = np.asarray(np.linalg.solve(damped, gradient))
            tried = problem.moved(z, -step)
            residual, jacobian, _ = problem.linearize(tried)
            new = float(residual @ residual + problem.weight @ tried**2)
            if new <= cost * (1.0 + 1e-9) + 1e-9 or damping > MOST_DAMPING:
                break
            for node, up in zip(problem.nodes, directions, strict=True):
                node.up = up
            damping = max(4.0 * damping, LEAST_DAMPING)
        # A damped step is short, and does not show how far the maximum is.
        z, settled = tried, damping < 1.0 and abs(cost - new) < 1e-6 * (1.0 + new)
        cost, damping = new, 0.25 * damping if damping > LEAST_DAMPING else 0.0
        if settled:
            break
    return z


def _result(problem: CalibrationProblem, z: Array, covariance: Array) -> ImuCalibration:
    """Errors, covariance and residuals."""
    b_a, s_a, M_a, b_g, s_g, M_g, G = problem.errors(z)
    gyro = TriadErrors(
        bias=triad_of(b_g),
        scale=triad_of(s_g),
        misalignment=matrix_of(M_g),
        g_sensitivity=matrix_of(G),
    )
    accel = TriadErrors(bias=triad_of(b_a), scale=triad_of(s_a), misalignment=matrix_of(M_a))
    n = len(problem.names)
    sd, own = problem.sd[:n], covariance[:n, :n]
    return ImuCalibration(
        errors=ImuErrors(gyro, accel),
        temperature_slopes=problem.slopes(z),
        temperature=problem.middle,
        names=problem.names,
        values=z[:n] * sd,
        prior_sd=sd.copy(),
        covariance=sd[:, None] * own * sd[None, :],
        rests=pd.DataFrame(_rest_table(problem, z)),
        turns=pd.DataFrame(problem.compared),
        remedies=_remedies(problem.names, own, sd),
        excess={
            "accel": problem.accel_excess,
            "turns": problem.turn_excess,
            "drift": float(np.max(problem.drift)),
        },
    )


def _rest_table(problem: CalibrationProblem, z: Array) -> list[dict[str, Any]]:
    after = dict(problem.predicted)
    b, s, M, *_ = problem.errors(z)
    # Before: readings as they are, but for the bias of the gyros.
    raw, ups = z.copy(), [node.up for node in problem.nodes]
    raw[: len(problem.names)] = 0.0
    raw[9:12] = z[9:12]
    for node in problem.nodes:
        mean = np.array(node.rest.accel_mean)
        node.up = mean / np.linalg.norm(mean)
    problem.linearize(raw)
    before = dict(problem.predicted)
    for node, up in zip(problem.nodes, ups, strict=True):
        node.up = up
    problem.linearize(z)
    rows = []
    for k, node in enumerate(problem.nodes):
        mean = np.array(node.rest.accel_mean)
        f = np.linalg.solve(np.eye(3) + M, (mean - b) / (1.0 + s))
        size = problem.gravity_at(z) * (1.0 - node.wander)
        rows.append(
            {
                "log": node.log,
                "start": node.rest.start,
                "end": node.rest.end,
                **dict(zip(("up_x", "up_y", "up_z"), node.up.tolist(), strict=True)),
                "force_error": float(np.linalg.norm(mean) - size),
                "force_left": float(np.linalg.norm(f) - size),
                "turn_error": before.get(k, math.nan),
                "turn_left": after.get(k, math.nan),
                "held": node.held,
            }
        )
    return rows


def _remedies(names: Sequence[str], covariance: Array, sd: Array) -> tuple[str, ...]:
    """Poses and turns that show what is not observed, the most useful first.

    `covariance`: in units of the prior standard deviations `sd`. Each is an observation that is
    added to the posterior, as accurate as a rest of MEMS usually is.
    """
    C = covariance.copy()
    candidates: dict[str, list[tuple[Array, float]]] = {}
    units = [np.array(u, dtype=np.float64) for u in np.ndindex(3, 3, 3)]
    for u in sorted((u - 1.0 for u in units), key=lambda u: float(np.abs(u).sum())):
        if 0.5 < np.abs(u).sum() < 2.5:
            text = "".join(f"{'+' if x > 0 else '-'}{a}" for a, x in zip(XYZ, u, strict=True) if x)
            candidates[text] = _rest_rows(names, u / np.linalg.norm(u))
    for i, a in enumerate(XYZ):
        rows = []
        for name in (f"gyro_scale_{a}", *(f"gyro_misalignment_{b}{a}" for b in XYZ if b != a)):
            row = np.zeros(len(names))
            row[names.index(name)] = math.pi / 2.0
            rows.append((row, 2e-3))
        candidates[f"turn {XYZ[i]}"] = rows
    out: list[str] = []
    for _ in range(9):
        missing = np.flatnonzero(np.sqrt(np.diag(C)) >= NOT_OBSERVED)
        if not missing.size:
            break
        best, gain = "", 0.3
        for text, rows in candidates.items():
            after = _with(C, rows, sd)
            won = float(np.log(np.diag(C)[missing] / np.diag(after)[missing]).sum())
            if won > gain * 1.001:
                best, gain = text, won
        if not best:
            break
        C = _with(C, candidates.pop(best), sd)
        out.append(best)
    return tuple(out)


def _rest_rows(names: Sequence[str], u: Array) -> list[tuple[Array, float]]:
    """Observations of a rest with a direction up: the norm of the force, and three mean rates."""
    g, rows = STANDARD_GRAVITY, []
    row = np.zeros(len(names))
    for i, a in enumerate(XYZ):
        row[names.index(f"accel_bias_{a}")] = u[i]
        row[names.index(f"accel_scale_{a}")] = g * u[i] ** 2
    for pair, (i, j) in zip(PAIRS, indices_of(PAIRS), strict=True):
        row[names.index(f"accel_misalignment_{pair}")] = 2.0 * g * u[i] * u[j]
    rows.append((row, 5e-3))
    for i, a in enumerate(XYZ):
        row = np.zeros(len(names))
        row[names.index(f"gyro_bias_{a}")] = 1.0
        for j, b in enumerate(XYZ):
            row[names.index(f"g_sensitivity_{XYZ[i]}{b}")] = g * u[j]
        rows.append((row, 1e-4))
    return rows


def _with(C: Array, rows: Sequence[tuple[Array, float]], sd: Array) -> Array:
    """Covariance after further observations."""
    for row, noise in rows:
        h = row * sd
        gain = C @ h
        C = C - np.outer(gain, gain) / (float(h @ gain) + noise**2)
    return C


# The file of a calibration.


#: Pairs of axes of which a misalignment is a rotation about x, y, z; and its standard deviation
#: about each where a file does not state it, rad: as of the misalignment that is assumed.
ABOUT = ("yz", "xz", "xy")
CASE: Triad = triad_of(PRIOR.accel.axis("misalignment")[k] / math.sqrt(2.0) for k in range(3))


@dataclass(frozen=True, eq=False)
class SensorCalibration:
    """Known errors of a sensor and what is left: the file ``calibration.toml``.

    Attributes
    ----------
    errors : ImuErrors
        In the axes of the sensor.
    gyro, accel : TriadUncertainty
        Standard deviations of what is left: bias, scale, misalignment, g-sensitivity.
    temperature_slopes : ndarray, (2, 3)
        Of the biases of gyros and accelerometers, rad/s/°C and m/s²/°C.
    temperature : float or None, °C
    magnetometer : MagnetometerCalibration or None
        In the axes of the sensor.
    not_observed : tuple of str
        Parameters that the logs did not show.
    case : triad, rad
        Standard deviation of the rotation of these axes, those of the accelerometers, in the case
        about each axis: the antisymmetric part of a misalignment before the calibration.
    """

    errors: ImuErrors
    gyro: TriadUncertainty
    accel: TriadUncertainty
    temperature_slopes: Array
    temperature: float | None
    magnetometer: MagnetometerCalibration | None
    not_observed: tuple[str, ...]
    case: Triad = CASE

    @classmethod
    def of(
        cls, found: ImuCalibration, magnetometer: MagnetometerCalibration | None = None
    ) -> SensorCalibration:
        """Return the calibration as a file has it."""
        sd = dict(zip(found.names, found.sd.tolist(), strict=True))
        triads: dict[str, TriadUncertainty] = {}
        for triad, terms in (("gyro", CROSS), ("accel", PAIRS)):
            skew = np.zeros((3, 3))
            for term, (i, j) in zip(terms, indices_of(terms), strict=True):
                skew[i, j] = sd[f"{triad}_misalignment_{term}"]
                if triad == "accel":
                    skew[j, i] = skew[i, j]
            values: dict[str, Any] = {
                q: tuple(sd[f"{triad}_{q}_{a}"] for a in XYZ) for q in ("bias", "scale")
            }
            values["misalignment"] = triad_of(np.sqrt(np.square(skew).sum(axis=1) / 2.0))
            if triad == "gyro":
                rows = [[sd[f"g_sensitivity_{i}{j}"] for j in XYZ] for i in XYZ]
                values["g_sensitivity"] = triad_of(np.sqrt(np.square(rows).mean(axis=1)))
            triads[triad] = TriadUncertainty(**values)
        missing = tuple(n for n, o in zip(found.names, found.observed, strict=True) if not o)
        return cls(
            found.errors,
            triads["gyro"],
            triads["accel"],
            found.temperature_slopes,
            found.temperature,
            magnetometer,
            missing,
            # Symmetric and antisymmetric part, half the sum and the difference, are known alike.
            triad_of(found.prior_sd[found.names.index(f"accel_misalignment_{p}")] for p in ABOUT),
        )

    @classmethod
    def read(cls, path: str | Path) -> SensorCalibration:
        """Read the file.

        Raises
        ------
        DataError
            There is none, it is not of `strapdown calibrate`, or it was damaged or edited.
        """
        where = {"file": Path(path).name, "quantity": "calibration"}
        tables = _tables_of(Path(path))
        part = "gyro"
        try:
            gyro = _errors_of(tables[part], "rad_per_s"), _sd_of(tables[part], "rad_per_s")
            part = "accel"
            accel = _errors_of(tables[part], "m_per_s2"), _sd_of(tables[part], "m_per_s2")
            part = "temperature"
            warm = tables.get(part, {})
            slopes = np.array([warm.get(key, [0.0] * 3) for key in SLOPES], dtype=np.float64)
            at = warm.get("at_c")
            at = None if at is None else float(at)
            if slopes.shape != (2, 3) or not np.isfinite(slopes).all():
                raise ValueError
            part = "magnetometer"
            mag = None if part not in tables else _magnetometer_of(tables[part])
            part = "case"
            case = triad_of(tables.get(part, {}).get(CASE_KEY, CASE))
            if not (np.isfinite(case).all() and min(case) >= 0.0):
                raise ValueError
            part = "not_observed"
            missing = tuple(str(name) for name in tables.get(part, ()))
        except KeyError as error:
            key = str(error.args[0])
            key = key if key == part else f"{part}.{key}"
            raise DataError("calibrate.file-without-key", key=key, **where) from None
        except (ValueError, TypeError, AttributeError, StrapdownError):
            raise DataError("calibrate.file-value", key=part, **where) from None
        return cls(ImuErrors(gyro[0], accel[0]), gyro[1], accel[1], slopes, at, mag, missing, case)

    def tables(self) -> dict[str, dict[str, Any]]:
        """Tables of the file, SI."""
        out: dict[str, dict[str, Any]] = {}
        for triad, unit in (("accel", "m_per_s2"), ("gyro", "rad_per_s")):
            errors, sd = getattr(self.errors, triad), getattr(self, triad)
            out[triad] = {
                f"bias_{unit}": errors.axis("bias"),
                f"bias_sd_{unit}": sd.axis("bias"),
                "scale": errors.axis("scale"),
                "scale_sd": sd.axis("scale"),
                "misalignment_rad": errors.misalignment,
                "misalignment_sd_rad": sd.axis("misalignment"),
            }
            if triad == "gyro":
                out[triad][G_KEY] = errors.g_sensitivity
                out[triad][G_SD_KEY] = sd.axis("g_sensitivity")
        out["case"] = {CASE_KEY: self.case}
        if self.temperature is not None:
            slopes = dict(zip(SLOPES, self.temperature_slopes.tolist(), strict=True))
            out["temperature"] = {"at_c": self.temperature, **slopes}
        if self.magnetometer is not None:
            mag = self.magnetometer
            out["magnetometer"] = {
                "hard_iron": mag.hard_iron.tolist(),
                "hard_iron_sd": mag.hard_iron_sd.tolist(),
                "soft_iron": mag.soft_iron.tolist(),
                **_rotation_of(mag),
                **{key: float(getattr(mag, key)) for key in MAG_KEYS},
                "found": bool(mag.found),
            }
        return out

    def turned(self, C: ArrayLike) -> SensorCalibration:
        """In other axes, each of which is one of the sensor's or its opposite.

        Parameters
        ----------
        C : array_like, (3, 3)
            Signed permutation: rotates vectors into them.
        """
        R = np.asarray(C, dtype=np.float64)
        size = np.abs(R)

        def of(errors: TriadErrors) -> TriadErrors:
            return TriadErrors(
                bias=triad_of(R @ errors.axis("bias")),
                scale=triad_of(size @ errors.axis("scale")),
                misalignment=matrix_of(R @ np.array(errors.misalignment) @ R.T),
                g_sensitivity=matrix_of(R @ np.array(errors.g_sensitivity) @ R.T),
            )

        mag = self.magnetometer
        if mag is not None:
            mag = replace(
                mag,
                hard_iron=R @ mag.hard_iron,
                hard_iron_sd=size @ mag.hard_iron_sd,
                soft_iron=R @ mag.soft_iron @ R.T,
                rotation=R @ mag.rotation @ R.T,
                rotation_sd=size @ np.where(np.isfinite(mag.rotation_sd), mag.rotation_sd, 1e9),
            )
        assert self.errors.accel is not None
        return replace(
            self,
            errors=ImuErrors(of(self.errors.gyro), of(self.errors.accel)),
            gyro=self.gyro.turned(size),
            accel=self.accel.turned(size),
            temperature_slopes=self.temperature_slopes @ R.T,
            magnetometer=mag,
            case=triad_of(size @ self.case),
        )

    def apply(self, imu: pd.DataFrame, warmth: Array | None = None) -> pd.DataFrame:
        """Compensate the readings of a log in the axes of this calibration.

        Parameters
        ----------
        imu : DataFrame
            Imu table; not changed. Without specific force the g-sensitivity stays.
        warmth : ndarray, (n,), optional
            Temperature at the stamps, °C.
        """
        out = imu.copy()
        out.attrs = dict(imu.attrs)
        time, kind = index_of(imu), str(imu.attrs.get("sampling", "instantaneous"))
        rates, force = values_of(imu, GYRO), None
        above = None
        if warmth is not None and self.temperature is not None:
            above = np.nan_to_num(warmth - self.temperature)[:, None]
            rates = rates - above * self.temperature_slopes[0]
        gyro, accel = self.errors.gyro, self.errors.accel
        if set(ACCEL) <= set(imu.columns) and accel is not None:
            force = values_of(imu, ACCEL)
            if above is not None:
                force = force - above * self.temperature_slopes[1]
            force = compensate(accel, time, force, sampling=kind)
            out[ACCEL] = force
        else:
            gyro = replace(gyro, g_sensitivity=np.zeros((3, 3)).tolist())
        out[GYRO] = compensate(gyro, time, rates, sampling=kind, specific_force=force)
        if self.magnetometer is not None and set(MAG) <= set(imu.columns):
            out[MAG] = self.magnetometer.apply(values_of(imu, MAG))
        return out

    @property
    def missing(self) -> list[str]:
        """Parameters that are not observed, in short: ``gyro scale x y``."""
        groups: dict[str, list[str]] = {}
        for name in self.not_observed:
            head, _, axis = name.rpartition("_")
            groups.setdefault(head.replace("_", " "), []).append(axis)
        return [f"{head} {' '.join(axes)}" for head, axes in groups.items()]

    def findings(self, log: str, name: str) -> tuple[Finding, ...]:
        """Remaining errors, and how the axes may lie in the case: 95 % bounds of the worst axis."""
        data: dict[str, Any] = {"calibration": name}
        for triad, unit in (("gyro", math.pi / 648000.0), ("accel", 1e-3 * STANDARD_GRAVITY)):
            sd = getattr(self, triad)
            for key, size in (("bias", unit), ("scale", 0.01), ("misalignment", math.pi / 180.0)):
                data[f"{triad}_{key}"] = TWO_SIDED_95 * max(sd.axis(key)) / size
        deg = math.degrees(TWO_SIDED_95 * max(self.case))
        return (
            Finding("calibrate.applied", severity="note", file=log, data=data),
            Finding("calibrate.axes-in-case", severity="note", file=log, deg=deg),
        )

    def uncertainty(self, stated: ImuUncertainty) -> ImuUncertainty:
        """Uncertainty of a sensor's errors after this calibration; noise and drift as stated.

        Of a parameter that the calibration did not show, the data sheet may say more.
        """
        triads = {}
        for triad in ("gyro", "accel"):
            own, sheet = getattr(self, triad), getattr(stated, triad)
            values = {}
            for name in ("bias", "scale", "misalignment", "g_sensitivity"):
                pairs = zip(own.axis(name), sheet.axis(name), strict=True)
                values[name] = triad_of(min(o, s) if s > 0.0 else o for o, s in pairs)
            triads[triad] = replace(sheet, **values)
        return replace(stated, gyro=triads["gyro"], accel=triads["accel"])


def sealed_text(text: str) -> str:
    """Return the text of a calibration file with the hash of all its other lines."""
    return f"{SEAL}{seal_of(text)}{text}"


def seal_of(text: str) -> str:
    """Line that seals a text: the hash of its other lines, whatever ends them."""
    lines = [line.rstrip() for line in text.splitlines() if not line.startswith(SEAL)]
    digest = hashlib.sha256("\n".join(lines).rstrip().encode()).hexdigest()
    return f'"sha256 {digest}"\n'


def _tables_of(path: Path) -> dict[str, Any]:
    """Read a calibration file as far as TOML goes.

    DataError: there is none; it is damaged, edited, or a file of another kind.
    """
    where = {"file": path.name, "quantity": "calibration"}
    if not path.exists():
        raise DataError("io.no-such-file", file=str(path), quantity="calibration")
    try:
        text = path.read_text(encoding="utf-8-sig")
        tables = tomllib.loads(text)
    except UnicodeDecodeError as error:
        data = {"row": error.object[: error.start].count(b"\n") + 1}
        raise DataError("calibrate.file-not-text", **where, **data) from None
    except OSError as error:
        raise DataError("calibrate.file-no-toml", error=error.strerror, **where) from None
    except (ValueError, RecursionError) as error:
        raise DataError("calibrate.file-no-toml", error=str(error), **where) from None
    if {"class", "summary"} <= tables.keys():
        raise DataError("calibrate.file-of-sensor", **where)
    seals = [line for line in text.splitlines(keepends=True) if line.startswith(SEAL)]
    if seals and seals[0].removeprefix(SEAL).strip() != seal_of(text).strip():
        raise DataError("calibrate.file-changed", **where)
    if "procedure" in tables and not {"gyro", "accel"} & tables.keys():
        raise DataError("calibrate.file-of-magnetometer", **where)
    if not {"gyro", "accel"} & tables.keys():
        raise DataError("calibrate.no-calibration", **where)
    return tables


#: Key of the hash of a calibration file.
SEAL = "seal = "
SLOPES = ("gyro_rad_per_s_per_c", "accel_m_per_s2_per_c")
MAG_KEYS = ("field", "residual", "raw_residual", "direction_sd_deg", "change_deg")
ROTATION_KEY, ROTATION_SD_KEY = "rotation", "rotation_sd_rad"
CASE_KEY = "rotation_sd_rad"
G_KEY = "g_sensitivity_rad_per_s_per_m_per_s2"
G_SD_KEY = "g_sensitivity_sd_rad_per_s_per_m_per_s2"


def _errors_of(table: Mapping[str, Any], unit: str) -> TriadErrors:
    return TriadErrors(
        bias=table[f"bias_{unit}"],
        scale=table["scale"],
        misalignment=table["misalignment_rad"],
        g_sensitivity=table.get(G_KEY, np.zeros((3, 3)).tolist()),
    )


def _sd_of(table: Mapping[str, Any], unit: str) -> TriadUncertainty:
    return TriadUncertainty(
        bias=table[f"bias_sd_{unit}"],
        scale=table["scale_sd"],
        misalignment=table["misalignment_sd_rad"],
        g_sensitivity=table.get(G_SD_KEY, 0.0),
    )


def _magnetometer_of(table: Mapping[str, Any]) -> MagnetometerCalibration:
    values: dict[str, Any] = {key: float(table[key]) for key in MAG_KEYS}
    for key, shape in (("hard_iron", (3,)), ("hard_iron_sd", (3,)), ("soft_iron", (3, 3))):
        values[key] = np.array(table[key], dtype=np.float64)
        if values[key].shape != shape:
            raise ValueError
    if ROTATION_KEY in table:
        values["rotation"] = np.array(table[ROTATION_KEY], dtype=np.float64)
        values["rotation_sd"] = np.array(table[ROTATION_SD_KEY], dtype=np.float64)
        R = values["rotation"]
        if R.shape != (3, 3) or values["rotation_sd"].shape != (3,):
            raise ValueError
        if not np.allclose(R @ R.T, np.eye(3), atol=1e-6):
            raise ValueError
    return MagnetometerCalibration(**values, found=bool(table["found"]))


def _rotation_of(mag: MagnetometerCalibration) -> dict[str, Any]:
    if not np.isfinite(mag.rotation_sd).all():
        return {}
    return {ROTATION_KEY: mag.rotation.tolist(), ROTATION_SD_KEY: mag.rotation_sd.tolist()}


def correlations(found: ImuCalibration) -> list[tuple[str, str, float]]:
    """Pairs of parameters that are correlated, the strongest first."""
    unit = found.covariance / np.outer(found.sd, found.sd)
    pairs = [
        (found.names[i], found.names[j], float(unit[i, j]))
        for i in range(len(found.names))
        for j in range(i)
        if abs(unit[i, j]) > CORRELATED
    ]
    return sorted(pairs, key=lambda p: -abs(p[2]))
