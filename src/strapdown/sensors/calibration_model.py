"""Unknowns and observations of a calibration of gyros and accelerometers."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from strapdown import rotation
from strapdown._kernels.attitude import quaternion_advance
from strapdown._kernels.increments import increments
from strapdown.constants import STANDARD_GRAVITY
from strapdown.ellipsoids import WGS84
from strapdown.errors import DataError
from strapdown.sensors.calibration_stops import (
    BETWEEN_LOGS,
    DEG,
    LEAST_RANGE,
    CalibrationRecord,
    KnownRotation,
    Stop,
    Stretch,
    across_of,
    angle_walk,
    assign_turns,
    bias_walk,
    held_ends,
    mean_variances,
    samples_between,
    stop_of,
)
from strapdown.sensors.triad_errors import triad_of
from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty
from strapdown.tables import find_gaps
from strapdown.tables.checks import Array

XYZ = "xyz"
PAIRS = ("xy", "xz", "yz")
CROSS = ("xy", "xz", "yx", "yz", "zx", "zy")
#: Before the log is read, where no data sheet says more: standard deviations, SI.
PRIOR = ImuUncertainty(
    TriadUncertainty(bias=10.0 * DEG, scale=0.03, misalignment=0.03, g_sensitivity=2e-4),
    TriadUncertainty(bias=0.8, scale=0.03, misalignment=0.03),
)
#: Change of bias with temperature, per °C, before the log is read.
TEMPERATURE_PRIOR = (0.1 * DEG, 0.02)
#: Gravity at an unknown position: mean over latitudes, and standard deviation, m/s².
GRAVITY, GRAVITY_SD = 9.806, 0.016
#: Least excess over noise of the mean force of a rest, m/s², and of turns, rad; residuals that the
#: usual variance counts as.
LEAST_EXCESS, LEAST_TILT, EXCESS_WEIGHT = 2e-4, 1e-4, 3.0
#: Least share of the noise of means that samples show, where residuals are smaller.
LEAST_FACTOR = 0.1
#: Rests of one pose are closer than this, rad.
ALIKE = 15.0 * DEG
#: Rests at most; the longest are used.
MOST_RESTS = 120
#: By how much a hand shakes the ends of a turn without a rest, m/s².
HELD = 0.3
#: Axis of a turn by hand against the stated one, rad; a case against its sensor, rad; arm of a
#: sensor on a rate table, m.
AXIS_SD, CASE_SD, ARM_SD = 4.0 * DEG, 2.0 * DEG, 0.05
#: Force across the axis of a rate table, beyond what its tilt and arm explain, m/s².
LEVEL_SD = 0.02
#: Change of the gyro bias from log to log, by temperature and switching on, rad/s.
BETWEEN_SD = 0.05 * DEG
#: Drift of the gyro bias where data do not show it, rad/s/√s.
LEAST_DRIFT = 5e-6
#: Longest path of a rotation between stops that the model follows, rad: two revolutions and a half.
LONGEST = 5.0 * math.pi


@dataclass(frozen=True)
class CalibrationConditions:
    """Conditions known beside the samples.

    Attributes
    ----------
    gravity, gravity_sd : float, m/s²
    latitude_deg : float or None
        For the Earth's rotation.
    pose_sd : float or None, rad
        Of the faces of a case that was laid on each: six positions. None for free poses.
    rate_scale_sd : float
        Relative standard deviation of all rates of a rate table together.
    """

    gravity: float = GRAVITY
    gravity_sd: float = GRAVITY_SD
    latitude_deg: float | None = None
    pose_sd: float | None = None
    rate_scale_sd: float = 1e-3


class CalibrationProblem:
    """Unknowns, scaled by their prior standard deviations, and observations by their own.

    Unknowns are those of the sensors, in the order of `names`; gravity, vertical Earth rate,
    scale of a rate table, rotation of a case, tilts and arms of a rate table; then of each node two
    tilts of the vertical, relative to `up` which moves along, and three drifts.
    """

    def __init__(
        self,
        nodes: list[Stop],
        stretches: list[Stretch],
        rates: list[Stretch],
        prior: ImuUncertainty,
        conditions: CalibrationConditions,
        warm: bool,
    ) -> None:
        self.nodes, self.stretches, self.rates = nodes, stretches, rates
        self.conditions, self.warm = conditions, warm
        names, sizes = _parameters(prior, warm)
        self.names = names
        at = len(names)
        self.gravity, self.earth, self.table, self.case = at, at + 1, at + 2, slice(at + 3, at + 6)
        self.tilt, self.arm = at + 6, at + 12
        self.first = at + 18
        self.size = self.first + 5 * len(nodes)
        # The horizontal part has an unknown direction; of an unknown latitude, means over all.
        sine, spread, cosine = 0.0, WGS84.rotation_rate / math.sqrt(3.0), math.sqrt(2.0 / 3.0)
        if conditions.latitude_deg is not None:
            angle = conditions.latitude_deg * DEG
            sine, spread, cosine = math.sin(angle), 1e-9, math.cos(angle)
        self.earth_up = WGS84.rotation_rate * sine
        self.level_rate = WGS84.rotation_rate * cosine / math.sqrt(2.0)
        others = [conditions.gravity_sd, spread, max(conditions.rate_scale_sd, 1e-9)]
        others += [CASE_SD] * 3 + [AXIS_SD] * 6 + [ARM_SD] * 6
        self.sd = np.concatenate([sizes, others, np.ones(5 * len(nodes))])
        # Tilts and drifts have no prior of their own.
        self.weight = np.concatenate([np.ones(self.first), np.zeros(5 * len(nodes))])
        variance = mean_variances(nodes)
        self.force_variance, self.rate_variance = variance[:, :3], variance[:, 3:]
        self.second_order = np.zeros(len(nodes))
        self.shift = np.zeros(len(nodes))
        self.noise = angle_walk(nodes, prior)
        self.force_factor = self.rate_factor = 1.0
        self.accel_excess = LEAST_EXCESS
        self.turn_excess = LEAST_TILT
        walk = np.array(prior.gyro_drift.triad)
        time = prior.gyro_drift.correlation_time
        stated = walk * math.sqrt(2.0 / time) if math.isfinite(time) else np.zeros(3)
        self.drift = np.maximum(
            bias_walk(nodes, self.rate_variance), np.where(stated > 0.0, stated, LEAST_DRIFT)
        )

    @classmethod
    def of(
        cls,
        records: Sequence[CalibrationRecord],
        rotations: Sequence[KnownRotation],
        prior: ImuUncertainty,
        conditions: CalibrationConditions,
    ) -> CalibrationProblem:
        """Make nodes of the rests, and stretches between them."""
        nodes = [stop_of(k, one, rest) for k, one in enumerate(records) for rest in one.rests]
        if len(nodes) > MOST_RESTS:
            nodes.sort(key=lambda n: n.rest.start - n.rest.end)
            nodes = nodes[:MOST_RESTS]
        turns = [one for one in rotations if one.rate is None]
        nodes += held_ends(records, nodes, turns)
        nodes.sort(key=lambda n: (n.log, n.rest.start))
        rates = [
            samples_between(
                records[one.log or 0], one.log or 0, one.start or 0.0, one.end or 0.0, one
            )
            for one in rotations
            if one.rate is not None
        ]
        for stretch in rates:
            _refuse_opposite_sign(stretch)
        if not nodes and not rates:
            logs = [str(one.imu.attrs["source"]) for one in records if one.imu.attrs.get("source")]
            raise DataError("calibrate.no-rest", file=", ".join(logs) or None, quantity="log")
        stretches = []
        still = [n.rest.gyro_mean for n in nodes if not n.held]
        bias = np.mean(still, axis=0) if still else np.zeros(3)
        for k in range(len(nodes) - 1):
            one, two = nodes[k], nodes[k + 1]
            if one.log == two.log and two.rest.start > one.rest.end:
                made = samples_between(records[one.log], one.log, one.rest.end, two.rest.start)
                made.first, made.last = k, k + 1
                path = np.trapezoid(np.linalg.norm(made.gyro - bias, axis=1), made.time)
                if not find_gaps(made.time) and path < LONGEST:
                    stretches.append(made)
        assign_turns(stretches, nodes, turns)
        if conditions.pose_sd is not None:
            for node in nodes:
                axis = int(np.argmax(np.abs(node.up)))
                if not node.held and abs(node.up[axis]) > math.cos(25.0 * DEG):
                    node.face = np.sign(node.up[axis]) * np.eye(3)[axis]
        warmth = [n.warmth for n in nodes if not math.isnan(n.warmth)]
        warm = len(warmth) == len(nodes) and bool(warmth) and np.ptp(warmth) > LEAST_RANGE
        middle = float(np.mean(warmth)) if warm else 0.0
        problem = cls(nodes, stretches, rates, prior, conditions, bool(warm))
        problem.middle = middle if warm else None
        return problem

    middle: float | None = None

    # Unknowns.

    def moved(self, z: Array, step: Array) -> Array:
        """Add a step; tilts of the vertical move the directions of the nodes and stay zero."""
        out = z + step
        for k, node in enumerate(self.nodes):
            tilt = step[self.first + 5 * k : self.first + 5 * k + 2]
            up = node.up + across_of(node.up) @ tilt
            node.up = up / np.linalg.norm(up)
        of_nodes = out[self.first :].reshape(-1, 5)
        of_nodes[:, :2] = 0.0
        return out

    def errors(self, z: Array) -> tuple[Array, Array, Array, Array, Array, Array, Array]:
        """Accel bias, scale, misalignment; gyro bias, scale, misalignment, g-sensitivity."""
        x = z[: len(self.names)] * self.sd[: len(self.names)]
        m_a, m_g = np.zeros((2, 3, 3))
        for k, (i, j) in enumerate(indices_of(PAIRS)):
            m_a[i, j] = m_a[j, i] = x[6 + k]
        for k, (i, j) in enumerate(indices_of(CROSS)):
            m_g[i, j] = x[15 + k]
        return x[0:3], x[3:6], m_a, x[9:12], x[12:15], m_g, x[21:30].reshape(3, 3)

    def slopes(self, z: Array) -> Array:
        """Change of gyro and accelerometer biases per °C, (2, 3)."""
        if not self.warm:
            return np.zeros((2, 3))
        return np.asarray((z[30:36] * self.sd[30:36]).reshape(2, 3))

    def gravity_at(self, z: Array) -> float:
        """Gravity, m/s²."""
        return self.conditions.gravity + self._value(z, self.gravity)

    def _value(self, z: Array, index: int) -> float:
        return float(z[index] * self.sd[index])

    def drifts(self, z: Array) -> Array:
        """Drift of the gyro bias at each node, (n, 3), rad/s."""
        return np.asarray(z[self.first :].reshape(-1, 5)[:, 2:] * self.drift_scale)

    #: Unit of the drifts.
    drift_scale = 1e-4

    # Observations.

    def linearize(self, z: Array) -> tuple[Array, Array, list[tuple[str, int, int]]]:
        """Residuals by their standard deviations, their derivatives by `z`, and their kinds."""
        residuals: list[Array] = []
        rows: list[Array] = []
        kinds: list[tuple[str, int, int]] = []
        total = 0
        for kind, residual, jacobian in self._observations(z):
            residuals.append(residual)
            rows.append(jacobian * self.sd[None, :])
            kinds.append((kind, total, total + residual.size))
            total += residual.size
        return np.concatenate(residuals), np.vstack(rows), kinds

    def _observations(self, z: Array) -> Iterator[tuple[str, Array, Array]]:
        self.predicted: list[tuple[int, float]] = []
        self.compared: list[dict[str, float]] = []
        yield from self._rests(z)
        yield from self._drift_rows(z)
        for stretch in self.stretches:
            yield from self._turn(z, stretch)
        for stretch in self.rates:
            yield from self._rate(z, stretch)

    def _columns(self) -> Array:
        return np.zeros((3, self.size))

    def _accel_columns(self, out: Array, f: Array, z: Array) -> Array:
        """Derivatives of a reading of the accelerometers; returns those by the force, (3, 3)."""
        _, s, M, *_ = self.errors(z)
        gain = (1.0 + s)[:, None] * (np.eye(3) + M)
        out[:, 0:3] = np.eye(3)
        out[:, 3:6] = np.diag(f + M @ f)
        for k, (i, j) in enumerate(indices_of(PAIRS)):
            out[i, 6 + k] += (1.0 + s[i]) * f[j]
            out[j, 6 + k] += (1.0 + s[j]) * f[i]
        return np.asarray(gain)

    def _gyro_columns(self, out: Array, w: Array, f: Array, z: Array) -> tuple[Array, Array]:
        """Derivatives of a reading of the gyros; returns those by rate and force, (3, 3)."""
        _, _, _, _, s, M, G = self.errors(z)
        out[:, 9:12] = np.eye(3)
        out[:, 12:15] = np.diag(w + M @ w + G @ f)
        for k, (i, j) in enumerate(indices_of(CROSS)):
            out[i, 15 + k] = (1.0 + s[i]) * w[j]
        for i in range(3):
            out[i, 21 + 3 * i : 24 + 3 * i] = (1.0 + s[i]) * f
        of = (1.0 + s)[:, None]
        return np.asarray(of * (np.eye(3) + M)), np.asarray(of * G)

    def _warm_columns(self, out: Array, warmth: float, triad: int) -> None:
        if self.warm and self.middle is not None:
            out[:, 30 + 3 * triad : 33 + 3 * triad] = (warmth - self.middle) * np.eye(3)

    def _above(self, warmth: float) -> float:
        return warmth - self.middle if self.warm and self.middle is not None else 0.0

    def _rests(self, z: Array) -> Iterator[tuple[str, Array, Array]]:
        b_a, s_a, M_a, b_g, s_g, M_g, G = self.errors(z)
        slopes, drifts = self.slopes(z), self.drifts(z)
        g = self.gravity_at(z)
        earth = self.earth_up + self._value(z, self.earth)
        for k, node in enumerate(self.nodes):
            at, across = self.first + 5 * k, across_of(node.up)
            size, above = g * (1.0 - node.wander), self._above(node.warmth)
            f = size * node.up
            model = (1.0 + s_a) * (f + M_a @ f) + b_a + slopes[1] * above
            # A hand that tilts moves the force across the vertical, and hardly its size.
            excess = HELD if node.held else self.accel_excess
            sd = np.sqrt(self.force_variance[k] * self.force_factor + excess**2)
            sd[0] = math.hypot(sd[0], self.second_order[k])
            frame = np.column_stack([node.up, across]).T / sd[:, None]
            out = self._columns()
            gain = self._accel_columns(out, f, z)
            self._warm_columns(out, node.warmth, 1)
            out[:, self.gravity] = gain @ node.up * (1.0 - node.wander)
            out[:, at : at + 2] = size * gain @ across
            mean = np.array(node.rest.accel_mean)
            off = frame @ (model - mean)
            off[0] -= self.shift[k] / sd[0]
            yield "held" if node.held else "accel", off, frame @ out
            if node.face is not None and self.conditions.pose_sd is not None:
                turn = z[self.case] * self.sd[self.case]
                face = node.face + np.cross(turn, node.face)
                out = np.zeros((2, self.size))
                out[:, at : at + 2] = np.eye(2)
                out[:, self.case] = across.T @ rotation.cross_matrix(node.face[None])[0]
                off = across.T @ (node.up - face)
                yield "pose", off / self.conditions.pose_sd, out / self.conditions.pose_sd
            if node.held:
                continue
            w = earth * node.up
            model = (1.0 + s_g) * (w + M_g @ w + G @ f) + b_g + drifts[k] + slopes[0] * above
            sd = np.sqrt(self.rate_variance[k] * self.rate_factor + self.level_rate**2)
            out = self._columns()
            by_rate, by_force = self._gyro_columns(out, w, f, z)
            self._warm_columns(out, node.warmth, 0)
            out[:, self.earth] = by_rate @ node.up
            out[:, self.gravity] = by_force @ node.up
            out[:, at : at + 2] = (earth * by_rate + size * by_force) @ across
            out[:, at + 2 : at + 5] = self.drift_scale * np.eye(3)
            mean = np.array(node.rest.gyro_mean)
            yield "gyro", (model - mean) / sd, out / sd[:, None]

    def _drift_rows(self, z: Array) -> Iterator[tuple[str, Array, Array]]:
        """The drift is a random walk from node to node, and zero in the mean."""
        if not self.nodes:
            return
        drifts, n = self.drifts(z), len(self.nodes)
        columns = [self.first + 5 * k + 2 for k in range(n)]
        mean = self._columns()
        for k in columns:
            mean[:, k : k + 3] = self.drift_scale / n * np.eye(3)
        yield "mean", drifts.mean(axis=0) / 1e-8, mean / 1e-8
        for k in range(n - 1):
            one, two = self.nodes[k], self.nodes[k + 1]
            sd = self.drift * math.sqrt(max(two.middle - one.middle, 1e-3))
            if one.log != two.log:
                sd = np.hypot(self.drift * math.sqrt(BETWEEN_LOGS), BETWEEN_SD)
            out = self._columns()
            out[:, columns[k] : columns[k] + 3] = -self.drift_scale * np.eye(3)
            out[:, columns[k + 1] : columns[k + 1] + 3] = self.drift_scale * np.eye(3)
            yield "drift", (drifts[k + 1] - drifts[k]) / sd, out / sd[:, None]

    def _corrected(self, z: Array, stretch: Stretch, drift: Array) -> tuple[Array, Array, Array]:
        """Rates, their part before misalignment, and forces of a stretch, (n, 3) each."""
        b_a, s_a, M_a, b_g, s_g, M_g, G = self.errors(z)
        f = np.linalg.solve(np.eye(3) + M_a, ((stretch.accel - b_a) / (1.0 + s_a)).T).T
        v = (stretch.gyro - b_g - drift) / (1.0 + s_g)
        w = np.linalg.solve(np.eye(3) + M_g, (v - f @ G.T).T).T
        return np.ascontiguousarray(w), np.asarray(v), np.asarray(f)

    def _rotation(self, z: Array, stretch: Stretch) -> tuple[Array, Array, Array, Array]:
        """Rotation from end to start, (3, 3); by unknowns, (3, size); angle; and of the axes."""
        nodes = self.nodes
        k, m = stretch.first, stretch.last
        drifts = self.drifts(z)
        warmth = 0.5 * (nodes[k].warmth + nodes[m].warmth)
        drift = 0.5 * (drifts[k] + drifts[m]) + self.slopes(z)[0] * self._above(warmth)
        w, v, f = self._corrected(z, stretch, drift)
        dt = np.diff(stretch.time)
        theta, dtheta = np.empty((2, dt.size, 3))
        increments(dt, w, stretch.mean, theta, dtheta)
        history = np.empty((dt.size, 4))
        start = np.array([1.0, 0.0, 0.0, 0.0])
        quaternion_advance(start.copy(), dt, theta, dtheta, history, 0.0, 1.0)
        C = rotation.dcm_from_quaternion(np.vstack([start, history]))
        # Weights of the trapezoidal rule; of means, of their own intervals.
        weight = np.zeros(stretch.time.size)
        if stretch.mean:
            weight[1:] = dt
        else:
            weight[1:] += 0.5 * dt
            weight[:-1] += 0.5 * dt
        _, _, _, _, s, M, _ = self.errors(z)
        D = C @ np.linalg.inv(np.eye(3) + M)
        by = np.hstack([np.ones((v.shape[0], 1)), w, f, v])
        P = -np.einsum("n,nki,nq->kiq", weight, D, by, optimize=True)
        out = self._columns()
        out[:, 9:12] = P[:, :, 0] / (1.0 + s)
        for i in range(3):
            out[:, 12 + i] = P[:, i, 7 + i] / (1.0 + s[i])
            out[:, 21 + 3 * i : 24 + 3 * i] = P[:, i, 4:7]
        for c, (i, j) in enumerate(indices_of(CROSS)):
            out[:, 15 + c] = P[:, i, 1 + j]
        for node in (k, m):
            at = self.first + 5 * node + 2
            out[:, at : at + 3] = 0.5 * self.drift_scale * out[:, 9:12]
        if self.warm:
            out[:, 30:33] = self._above(warmth) * out[:, 9:12]
        total = (weight[:, None] * w).sum(axis=0)
        return C[-1], out, total, (weight[:, None] * v).sum(axis=0)

    def _turn(self, z: Array, stretch: Stretch) -> Iterator[tuple[str, Array, Array]]:
        R, phi, total, _ = self._rotation(z, stretch)
        one, two = self.nodes[stretch.first], self.nodes[stretch.last]
        at, to = self.first + 5 * stretch.first, self.first + 5 * stretch.last
        start, end = across_of(one.up), across_of(two.up)
        walk = float(np.mean(np.square(self.noise))) * stretch.length
        walk += (WGS84.rotation_rate * stretch.length) ** 2
        spread = self.turn_excess**2 + stretch.second_order**2
        stretch.sd = sd = math.sqrt(walk + spread + 2.0 * (one.wander + two.wander))
        carried = R.T @ one.up
        out = end.T @ R.T @ rotation.cross_matrix(one.up[None])[0] @ phi
        out[:, at : at + 2] += end.T @ R.T @ start
        out[:, to : to + 2] -= np.eye(2)
        left = end.T @ carried
        self.predicted.append((stretch.last, float(np.linalg.norm(left))))
        kind = "turns" if not (one.held or two.held) else "held turns"
        yield kind, left / sd, out / sd
        known = stretch.known
        if known is None or known.angle is None:
            return
        axis = int(np.argmax(np.abs(total))) if known.axis is None else known.axis
        angle = math.copysign(known.angle, total[axis])
        n = np.eye(3)[axis]
        back = rotation.dcm_from_rotation_vector(-angle * n)
        r = rotation.rotation_vector_from_dcm(back @ R)
        across_sd = math.hypot(known.sd, 2.0 * math.sin(0.5 * abs(angle)) * AXIS_SD)
        sd3 = np.full(3, math.hypot(across_sd, math.sqrt(walk)))
        sd3[axis] = math.hypot(known.sd, math.sqrt(walk))
        self.compared.append(
            {"axis": axis, "known": angle, "measured": float(total[axis]), "left": float(r[axis])}
        )
        yield "known", r / sd3, (back @ phi) / sd3[:, None]

    def _rate(self, z: Array, stretch: Stretch) -> Iterator[tuple[str, Array, Array]]:
        """Mean readings at a known rate: about the vertical, where the force is that of gravity."""
        known = stretch.known
        assert known is not None
        assert known.rate is not None
        axis = 0 if known.axis is None else known.axis
        b_a, s_a, M_a, b_g, s_g, M_g, G = self.errors(z)
        others = [k for k in range(3) if k != axis]
        tilt, arm = (slice(at + 2 * axis, at + 2 * axis + 2) for at in (self.tilt, self.arm))
        E = np.eye(3)[:, others]
        n = np.eye(3)[axis] + E @ (z[tilt] * self.sd[tilt])
        n /= np.linalg.norm(n)
        E = E - np.outer(n, n @ E)
        rate = known.rate * (1.0 + self._value(z, self.table))
        w = rate * n
        mean_a, mean_g = stretch.accel.mean(axis=0), stretch.gyro.mean(axis=0)
        g = self.gravity_at(z)
        up = math.copysign(1.0, mean_a[axis])
        outward = rate**2 * (E @ (z[arm] * self.sd[arm]))
        f = up * g * n - outward
        size = float(np.linalg.norm(mean_a))
        vertical = abs(mean_a[axis]) > math.cos(25.0 * DEG) * size > 0.7 * STANDARD_GRAVITY
        if not vertical:
            _, _, forces = self._corrected(z, stretch, np.zeros(3))
            f = forces.mean(axis=0)
        white = np.sqrt(np.square(self.noise) / stretch.length + known.sd**2)
        # The bias drifts about its mean over the rests as from log to log.
        sd = np.sqrt(white**2 + np.square(self.drift) * BETWEEN_LOGS)
        out = self._columns()
        by_rate, by_force = self._gyro_columns(out, w, f, z)
        out[:, tilt] = rate * by_rate @ E
        out[:, self.table] = known.rate * by_rate @ n
        if vertical:
            out[:, tilt] += up * g * by_force @ E
            out[:, arm] = -(rate**2) * by_force @ E
            out[:, self.gravity] = up * by_force @ n
        model = (1.0 + s_g) * (w + M_g @ w + G @ f) + b_g
        self.compared.append(
            {
                "axis": axis,
                "known": known.rate,
                "measured": float(mean_g[axis]),
                "left": float(mean_g[axis] - model[axis]),
            }
        )
        yield "rates", (model - mean_g) / sd, out / sd[:, None]
        if vertical:
            # The direction alone: its size would be wrong by products of what is not known yet.
            out = self._columns()
            gain = self._accel_columns(out, f, z)
            out[:, tilt] = up * g * gain @ E
            out[:, arm] = -(rate**2) * gain @ E
            out[:, self.gravity] = up * gain @ n
            model = (1.0 + s_a) * (f + M_a @ f) + b_a
            yield "level", (model - mean_a)[others] / LEVEL_SD, out[others] / LEVEL_SD

    # Variance components.

    def begin(self, z: Array) -> None:
        """Begin with the products of errors as they are before the log is read."""
        self.second_order = self._second_order(z, np.eye(self.size))
        self.shift = np.zeros(len(self.nodes))

    def update_excess(self, z: Array) -> bool:
        """Estimate the excess of rests and turns, and the drift; whether they changed."""
        residual, jacobian, kinds = self.linearize(z)
        information = jacobian.T @ jacobian + np.diag(self.weight)
        covariance: Array = np.asarray(np.linalg.inv(information))
        before = (self.accel_excess, self.turn_excess, *self.second_order)
        self.second_order = self._second_order(z, covariance)
        self._second_order_of_turns(jacobian, covariance, kinds)
        squares, free = self._squares("gyro", residual, jacobian, covariance, kinds)
        self.rate_factor = max(_pooled(squares * self.rate_factor, free, 1.0), LEAST_FACTOR)
        quiet = [k for k, n in enumerate(self.nodes) if not n.held]
        squares, free = self._squares("accel", residual, jacobian, covariance, kinds)
        own = _median(self.force_variance[quiet, 0])
        second = _median(self.second_order[quiet] ** 2)
        total = squares * (self.force_factor * own + second + self.accel_excess**2)
        variance = _pooled(total, free, own + second + LEAST_EXCESS**2) - second
        # Noise of the means is at most what the samples show, and may be less.
        self.force_factor = min(max(variance / own, LEAST_FACTOR), 1.0) if own > 0.0 else 1.0
        self.accel_excess = math.sqrt(max(variance - own, LEAST_EXCESS**2))
        squares, free = self._squares("turns", residual, jacobian, covariance, kinds)
        own = float(np.mean(np.square(self.noise))) * _median(
            np.array([s.length for s in self.stretches])
        )
        variance = _pooled(squares * (own + self.turn_excess**2), free, own + LEAST_TILT**2)
        self.turn_excess = math.sqrt(max(variance - own, LEAST_TILT**2))
        after = (self.accel_excess, self.turn_excess, *self.second_order)
        return any(abs(a - b) > 0.05 * b + 1e-5 for a, b in zip(after, before, strict=True))

    @staticmethod
    def _squares(
        kind: str,
        residual: Array,
        jacobian: Array,
        covariance: Array,
        kinds: Sequence[tuple[str, int, int]],
    ) -> tuple[float, float]:
        """Sum of squares of the residuals of a kind, and how many are free."""
        spans = [np.arange(a, b) for k, a, b in kinds if k == kind]
        if not spans:
            return 0.0, 0.0
        index = np.concatenate(spans)
        J = jacobian[index]
        free = index.size - float(np.einsum("ij,jk,ik->", J, covariance, J, optimize=True))
        return float(np.square(residual[index]).sum()), max(free, 0.0)

    def _second_order(self, z: Array, covariance: Array) -> Array:
        """Standard deviation of the norm of the force by products of what is not observed, m/s².

        Of the Hessian H of the norm of each compensated mean by the nine parameters of the
        accelerometers, with their covariance P, half the trace of ``H P H P`` is the variance.
        """
        if not self.nodes:
            return np.zeros(0)
        mean = np.array([n.rest.accel_mean for n in self.nodes])
        sd = np.sqrt(np.diag(covariance)[:9])

        def norm(step: Array) -> Array:
            tried = z.copy()
            tried[:9] += step
            b, s, M, *_ = self.errors(tried)
            return np.asarray(
                np.linalg.norm(np.linalg.solve(np.eye(3) + M, ((mean - b) / (1.0 + s)).T), axis=0)
            )

        unit, H = np.diag(sd), np.empty((len(self.nodes), 9, 9))
        for i in range(9):
            for j in range(i + 1):
                p, m = unit[i] + unit[j], unit[i] - unit[j]
                change = 0.25 * (norm(p) - norm(m) - norm(-m) + norm(-p))
                H[:, i, j] = H[:, j, i] = change
        correlation = covariance[:9, :9] / np.outer(sd, sd)
        HP = H @ correlation
        # The same in all rests of one pose.
        ups = np.array([node.up for node in self.nodes])
        alike = (ups @ ups.T > math.cos(ALIKE)).sum(axis=1)
        self.shift = 0.5 * np.einsum("nii->n", HP)
        return np.asarray(np.sqrt(0.5 * alike * np.einsum("nij,nji->n", HP, HP)))

    def _second_order_of_turns(
        self, jacobian: Array, covariance: Array, kinds: Sequence[tuple[str, int, int]]
    ) -> None:
        """Angle by products of angles that are not known: thrice their variances, rad²."""
        spans = [slice(a, b) for kind, a, b in kinds if kind in ("turns", "held turns")]
        n = len(self.names)
        for stretch, span in zip(self.stretches, spans, strict=True):
            J = stretch.sd * jacobian[span, :n]
            variance = float(np.einsum("ij,jk,ik->", J, covariance[:n, :n], J))
            for k in (stretch.first, stretch.last):
                at = self.first + 5 * k
                variance += float(np.trace(covariance[at : at + 2, at : at + 2]))
            stretch.second_order = 3.0 * variance


def _pooled(squares: float, free: float, usual: float) -> float:
    """Variance of residuals, with the usual one as if of `EXCESS_WEIGHT` residuals more."""
    return (squares + EXCESS_WEIGHT * usual) / (free + EXCESS_WEIGHT)


def _median(values: Array) -> float:
    return float(np.median(values)) if values.size else 0.0


def _parameters(prior: ImuUncertainty, warm: bool) -> tuple[tuple[str, ...], Array]:
    """Names and prior standard deviations of the errors; zero of a data sheet is not known."""
    sizes: dict[str, tuple[float, float, float]] = {}
    for triad in ("accel", "gyro"):
        for quantity in ("bias", "scale", "misalignment", "g_sensitivity"):
            stated = getattr(prior, triad).axis(quantity)
            usual = getattr(PRIOR, triad).axis(quantity)
            sizes[f"{triad}_{quantity}"] = triad_of(
                s if s > 0.0 else u for s, u in zip(stated, usual, strict=True)
            )
    # Biases of MEMS are stated at one temperature, on one board.
    sizes["gyro_bias"] = triad_of(max(s, PRIOR.gyro.axis("bias")[0]) for s in sizes["gyro_bias"])
    names = [f"accel_{q}_{a}" for q in ("bias", "scale") for a in XYZ]
    values = [*sizes["accel_bias"], *sizes["accel_scale"]]
    names += [f"accel_misalignment_{p}" for p in PAIRS]
    own = sizes["accel_misalignment"]
    # Half of the sum of two angles.
    values += [0.5 * math.hypot(own[i], own[j]) for i, j in indices_of(PAIRS)]
    names += [f"gyro_{q}_{a}" for q in ("bias", "scale") for a in XYZ]
    values += [*sizes["gyro_bias"], *sizes["gyro_scale"]]
    names += [f"gyro_misalignment_{p}" for p in CROSS]
    values += [
        math.sqrt(sizes["gyro_misalignment"][i] ** 2 + 0.25 * (own[i] ** 2 + own[j] ** 2))
        for i, j in indices_of(CROSS)
    ]
    names += [f"g_sensitivity_{i}{j}" for i in XYZ for j in XYZ]
    values += [sizes["gyro_g_sensitivity"][i] for i in range(3) for _ in XYZ]
    if warm:
        for k, triad in enumerate(("gyro", "accel")):
            names += [f"{triad}_temperature_{a}" for a in XYZ]
            values += [TEMPERATURE_PRIOR[k]] * 3
    return tuple(names), np.array(values)


def indices_of(terms: Sequence[str]) -> list[tuple[int, int]]:
    """Row and column of terms such as ``xy``."""
    return [(XYZ.index(t[0]), XYZ.index(t[1])) for t in terms]


def _refuse_opposite_sign(stretch: Stretch) -> None:
    """Refuse a known rate of which the gyro shows the opposite: its scale error would be -200 %."""
    known = stretch.known
    if known is None or known.rate is None:
        return
    axis = known.axis or 0
    measured = float(stretch.gyro[:, axis].mean())
    # Nearer to the rate reversed than to none: no bias of a gyro is half of a rate to calibrate by.
    if measured * known.rate < 0.0 and abs(measured) > 0.5 * abs(known.rate):
        raise DataError(
            "calibrate.turn-sign",
            quantity="turns",
            axis=XYZ[axis],
            stated=known.rate / DEG,
            measured=measured / DEG,
            start=known.start,
            end=known.end,
        )
