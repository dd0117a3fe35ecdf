"""Voting of two or more inertial units on one body, fused into one table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import ConfigError, DataError, Finding
from strapdown.sensors.axis_voting import (
    AxisErrors,
    AxisEvent,
    AxisVote,
    AxisVoting,
    VotingRule,
    VotingState,
)
from strapdown.sensors.crash_unit import SAME_STAMP
from strapdown.sensors.health_log import WORDS, known_median
from strapdown.sensors.uncertainty import BiasDrift, ImuUncertainty, TriadUncertainty
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import check_columns, check_time, index_of, source_of, values_of

__all__ = [
    "MountedUnit",
    "UnitVoting",
    "UnitVotingState",
    "VoteEvent",
    "VotedImu",
    "fused_drift",
    "fused_noise",
    "fused_uncertainty",
    "told_events",
    "vote_units",
]


Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class VotedImu:
    """Fused measurements of the healthy channels of all units.

    Attributes
    ----------
    imu : DataFrame
        Imu table in body axes.
    used : DataFrame of bool
        One row per sample, one column per channel (``A.gyro_x``).
    events : tuple of VoteEvent
    noise_density : DataFrame
        Of the fused channels at each sample, in u/√Hz; it increases where a channel is excluded.
    """

    imu: pd.DataFrame
    used: pd.DataFrame
    events: tuple[VoteEvent, ...]
    noise_density: pd.DataFrame

    @property
    def findings(self) -> tuple[Finding, ...]:
        """One finding per event."""
        return tuple(e.finding for e in self.events)


@dataclass(frozen=True, eq=False)
class UnitVotingState:
    """State of a vote of units."""

    gyro: VotingState
    accel: VotingState
    last: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class UnitVoting:
    """Voting over several units.

    Attributes
    ----------
    units : sequence of MountedUnit
        Two units detect a disagreement; three identify the failed channel or unit.
    rate : float, Hz
    rule : VotingRule

    Raises
    ------
    ConfigError
        Fewer than two units are given, or two have the same name.

    Notes
    -----
    Gyros and accelerometers are voted on separately (`AxisVoting`). Where axes of units are
    parallel and only two measure along a direction, a disagreement along it is reported without
    identifying the faulty one, and both remain in use. Units skewed relative to each other allow
    identification with fewer axes. Lever arms are not corrected: accelerometers a distance r apart
    differ by up to ``r (ω² + |dω/dt|)``, of which `VotingRule.apart` allows for the ω² part. Where
    that exceeds their uncertainty, move the readings to one point first (`sensors.lever_arm`).
    """

    units: Sequence[MountedUnit]
    rate: float
    rule: VotingRule = field(default_factory=VotingRule)
    gyro: AxisVoting = field(init=False)
    accel: AxisVoting = field(init=False)

    def __post_init__(self) -> None:
        names = [u.name for u in self.units]
        if len(names) < 2 or len(set(names)) < len(names):
            raise ConfigError(
                "sensors.units-cannot-test-each-other", quantity="units", map=map(repr, names)
            )
        directions = np.vstack([np.asarray(u.mounting).T for u in self.units])
        groups = np.repeat(np.arange(len(names)), 3)
        of_unit = [u.uncertainty for u in self.units]
        gyro = [(u.gyro, u.gyro_drift, k) for u in of_unit for k in range(3)]
        accel = [(u.accel, u.accel_drift, k) for u in of_unit for k in range(3)]
        for name, parts, apart in (("gyro", gyro, 0.0), ("accel", accel, self.rule.apart)):
            errors = AxisErrors.of(parts)
            voting = AxisVoting(directions, errors, self.rate, self.rule, groups.tolist(), apart)
            object.__setattr__(self, name, voting)

    def begin(self) -> UnitVotingState:
        """Return the state before the first sample."""
        return UnitVotingState(self.gyro.begin(), self.accel.begin())

    def advance(
        self, state: UnitVotingState, tables: Mapping[str, pd.DataFrame]
    ) -> tuple[UnitVotingState, VotedImu]:
        """Vote over a chunk; the results do not depend on how the log is divided.

        Parameters
        ----------
        state : UnitVotingState
        tables : mapping of str to DataFrame
            Imu tables by unit name, in the unit's own axes, with the same stamps; NaN values are
            ignored.

        Returns
        -------
        UnitVotingState, VotedImu

        Raises
        ------
        DataError
            A table or a column is missing, stamps differ or do not increase, or too few channels
            are healthy.
        """
        time, gyro, accel, sampling = self._readings(state, tables)
        turned = np.stack(
            [
                accel[:, 3 * k : 3 * k + 3] @ np.asarray(u.mounting).T
                for k, u in enumerate(self.units)
            ]
        )
        # The median, so that a failed unit does not loosen the test of the gyros; zero where no
        # unit has a reading.
        force = np.nan_to_num(known_median(turned, 0))
        gyro_state, rates = self.gyro.advance(state.gyro, gyro, force)
        accel_state, forces = self.accel.advance(state.accel, accel, rates.values)
        names = [u.name for u in self.units]
        # Not `imu_table`: a chunk may be one sample, and the values are finite.
        imu = pd.DataFrame(
            np.hstack([rates.values, forces.values]),
            index=pd.Index(time, name="time"),
            columns=[*GYRO, *ACCEL],
        )
        imu.attrs = {
            "sampling": sampling,
            "source": f"the vote of {', '.join(names)}",
            "axes": "forward-right-down",
        }
        columns = (
            [f"{n}.{c}" for n in names for c in GYRO],
            [f"{n}.{c}" for n in names for c in ACCEL],
        )
        used = pd.DataFrame(
            np.hstack([rates.used, forces.used]), index=imu.index, columns=columns[0] + columns[1]
        )
        noise = np.hstack(
            [fused_noise(self.gyro, rates.used), fused_noise(self.accel, forces.used)]
        )
        events = [
            *told_events(rates, time, columns[0], "rad/s", state.gyro.samples),
            *told_events(forces, time, columns[1], "m/s²", state.accel.samples),
        ]
        return UnitVotingState(gyro_state, accel_state, (float(time[-1]),)), VotedImu(
            imu,
            used,
            tuple(sorted(events, key=lambda e: (e.time, e.channels))),
            pd.DataFrame(noise, index=imu.index, columns=[*GYRO, *ACCEL]),
        )

    def uncertainty(self) -> ImuUncertainty:
        """Uncertainty of the fused table while all channels are healthy.

        Returns
        -------
        ImuUncertainty
            Noise, bias, drift, and scale factor and misalignment of the mean of independent units.
            Range, quantization and bandwidth are not defined for a mean and are omitted.
        """
        return ImuUncertainty(
            fused_uncertainty(self.gyro),
            fused_uncertainty(self.accel),
            fused_drift(self.gyro),
            fused_drift(self.accel),
        )

    def _readings(
        self, state: UnitVotingState, tables: Mapping[str, pd.DataFrame]
    ) -> tuple[Array, Array, Array, str]:
        time = None
        samplings = set()
        gyro, accel = [], []
        for unit in self.units:
            if unit.name not in tables:
                raise DataError("sensors.no-table-unit", quantity="tables", name=unit.name)
            table = tables[unit.name]
            source = source_of(table) or unit.name
            check_columns(table, [*GYRO, *ACCEL], source)
            own = index_of(table)
            check_time(own, source)
            if time is None:
                time = own
                if state.last and not own[0] > state.last[0]:
                    raise DataError(
                        "sensors.begins-last-segment-ended",
                        file=source,
                        row=1,
                        quantity="time",
                        own=own[0],
                        last=state.last[0],
                    )
            if own.size != time.size or np.abs(own - time).max() > SAME_STAMP / self.rate:
                raise DataError(
                    "sensors.unit-stamps-differ",
                    file=source,
                    quantity="time",
                    size=own.size,
                    size_2=time.size,
                    name=self.units[0].name,
                )
            samplings.add(str(table.attrs.get("sampling", "instantaneous")))
            gyro.append(values_of(table, GYRO))
            accel.append(values_of(table, ACCEL))
        if len(samplings) > 1:
            raise DataError("sensors.some-units-give-instantaneous-values", quantity="sampling")
        assert time is not None  # at least two units
        return time, np.hstack(gyro), np.hstack(accel), samplings.pop()


def vote_units(
    units: Sequence[MountedUnit],
    tables: Mapping[str, pd.DataFrame],
    rule: VotingRule | None = None,
) -> VotedImu:
    """Vote over a whole log.

    Parameters
    ----------
    units : sequence of MountedUnit
    tables : mapping of str to DataFrame
        As in `UnitVoting.advance`; the rate is the mean rate of the first.
    rule : VotingRule, optional

    Returns
    -------
    VotedImu

    Raises
    ------
    ConfigError, DataError
        As `UnitVoting`.
    """
    first = tables.get(units[0].name) if units else None
    if first is None or len(first) < 2:
        raise DataError("sensors.no-table-two-samples-or", quantity="tables")
    time = index_of(first)
    rate = float((time.size - 1) / (time[-1] - time[0]))
    voting = UnitVoting(units, rate, VotingRule() if rule is None else rule)
    return voting.advance(voting.begin(), tables)[1]


# One of several inertial units on a body: its errors and its orientation.


# Tolerance for a mounting matrix to be a rotation.
ROTATION = 1e-6


@dataclass(frozen=True, eq=False)
class MountedUnit:
    """A unit's stated errors and mounting.

    Attributes
    ----------
    name : str
    uncertainty : ImuUncertainty
        Noise, bias, scale factor and so on, in its own axes; the misalignment includes that of its
        mounting.
    mounting : array_like, (3, 3)
        ``C``, which rotates a vector v from the unit's axes to body axes, ``C v``.

    Raises
    ------
    ConfigError
        The mounting is not a rotation.
    """

    name: str
    uncertainty: ImuUncertainty
    mounting: ArrayLike = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        c = np.asarray(self.mounting, dtype=np.float64)
        good = c.shape == (3, 3) and np.isfinite(c).all()
        if not good or np.abs(c @ c.T - np.eye(3)).max() > ROTATION or np.linalg.det(c) < 0.0:
            raise ConfigError("sensors.mounting-no-rotation", file=self.name, quantity="mounting")
        object.__setattr__(self, "mounting", c)


# Events of a vote of units, with their findings.


@dataclass(frozen=True)
class VoteEvent:
    """A decision of the vote.

    Attributes
    ----------
    kind : {'excluded', 'readmitted', 'disagree'}
    channels : tuple of str
        Such as ``A.gyro_x``; for a disagreement, the most likely ones.
    time, since : float, s
        Time of the decision, and start of the disagreement.
    size : float, rad/s or m/s²
        Deviation of the first channel from the others.
    chi_square, limit : float
    finding : Finding
    """

    kind: str
    channels: tuple[str, ...]
    time: float
    since: float
    size: float
    chi_square: float
    limit: float
    finding: Finding


def told_events(
    vote: AxisVote, time: Array, columns: Sequence[str], unit: str, before: int
) -> list[VoteEvent]:
    """Convert the events of a vote to findings; `before` samples preceded the chunk."""
    return [_event(e, time, columns, unit, before) for e in vote.events]


def _event(
    event: AxisEvent, time: Array, columns: Sequence[str], unit: str, before: int
) -> VoteEvent:
    channels = tuple(columns[k] for k in event.axes)
    when = float(time[event.row])
    step = float(time[1] - time[0]) if time.size > 1 else 0.0
    since = float(time[event.since]) if event.since >= 0 else float(time[0] + event.since * step)
    code = {
        "readmitted": "sensors.channel-readmitted",
        "excluded": "sensors.channel-excluded",
        "disagree": "sensors.channels-disagree",
    }[event.kind]
    if event.kind == "excluded" and len(channels) > 1:
        code = "sensors.unit-excluded"
    finding = Finding(
        code,
        row=before + event.row + 1,
        quantity=channels[0],
        channels=[_words(c) for c in channels],
        name=channels[0].split(".")[0],
        time=when,
        since=since,
        size=abs(event.size),
        unit=unit,
        chi_square=event.chi_square,
        limit=event.limit,
    )
    return VoteEvent(
        event.kind, channels, when, since, event.size, event.chi_square, event.limit, finding
    )


def _words(channel: str) -> str:
    name, column = channel.rsplit(".", 1)
    return f"{WORDS[column]} of unit {name}"


# Uncertainty of the vector fused from redundant axes.

Mask = NDArray[np.bool_]


def fused_noise(voting: AxisVoting, used: Mask) -> Array:
    """Noise density of the fused vector at each sample.

    Parameters
    ----------
    voting : AxisVoting
    used : ndarray of bool, (n, m)
        Axes included in the vector.

    Returns
    -------
    ndarray, (n, 3), u/√Hz
    """
    out = np.empty((len(used), 3))
    code = used @ (2 ** np.arange(used.shape[1], dtype=np.int64))
    for value in np.unique(code):
        at = code == value
        mask = used[int(np.argmax(at))]
        covariance = voting.covariance(mask, voting.errors.noise_density**2)
        out[at] = np.sqrt(np.diagonal(covariance))
    return out


def fused_uncertainty(voting: AxisVoting) -> TriadUncertainty:
    """Noise, bias, scale, misalignment and g-sensitivity of the vector of all axes."""
    e, everything = voting.errors, np.ones(len(voting.errors.bias), dtype=bool)
    parts: dict[str, Any] = {}
    for name in ("noise_density", "bias", "scale", "misalignment", "g_sensitivity"):
        variance = np.asarray(getattr(e, name)) ** 2
        x, y, z = np.sqrt(np.diagonal(voting.covariance(everything, variance))).tolist()
        parts[name] = (x, y, z)
    return TriadUncertainty(**parts)


def fused_drift(voting: AxisVoting) -> BiasDrift:
    """Drift of the bias of the vector of all axes."""
    e, everything = voting.errors, np.ones(len(voting.errors.bias), dtype=bool)
    x, y, z = np.sqrt(np.diagonal(voting.covariance(everything, e.drift**2))).tolist()
    # The shortest time, which allows for the slower drifts too early.
    return BiasDrift((x, y, z), float(e.correlation_time.min()))
