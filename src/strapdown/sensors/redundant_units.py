"""Two or more inertial units on one body: mutual testing, voting, and one table of all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import ConfigError, DataError, Finding
from strapdown.sensors.axis_voting import AxisVoting, VotingState
from strapdown.sensors.fused_axes import fused_drift, fused_noise, fused_uncertainty
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.sensors.known_median import known_median
from strapdown.sensors.mounted_unit import MountedUnit
from strapdown.sensors.unit_checks import SAME_STAMP
from strapdown.sensors.vote_events import VoteEvent, told_events
from strapdown.sensors.voting_rule import AxisErrors, VotingRule
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import check_columns, check_time, index_of, source_of, values_of

Array = NDArray[np.float64]

__all__ = ["MountedUnit", "UnitVoting", "UnitVotingState", "VoteEvent", "VotedImu", "vote_units"]


@dataclass(frozen=True, eq=False)
class VotedImu:
    """What the healthy channels of all units tell.

    Attributes
    ----------
    imu : DataFrame
        Imu table in body axes.
    used : DataFrame of bool
        A row a sample, a column a channel (``A.gyro_x``).
    events : tuple of VoteEvent
    noise_density : DataFrame
        Of the fused channels at each sample, in u/√Hz: it grows where a channel is left out.
    """

    imu: pd.DataFrame
    used: pd.DataFrame
    events: tuple[VoteEvent, ...]
    noise_density: pd.DataFrame

    @property
    def findings(self) -> tuple[Finding, ...]:
        """One for each event."""
        return tuple(e.finding for e in self.events)


@dataclass(frozen=True, eq=False)
class UnitVotingState:
    """Where a vote of units stands."""

    gyro: VotingState
    accel: VotingState
    last: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class UnitVoting:
    """Units that vote.

    Attributes
    ----------
    units : sequence of MountedUnit
        Two show that they disagree; three show which channel, or which unit, has failed.
    rate : float, Hz
    rule : VotingRule

    Raises
    ------
    ConfigError
        There are fewer than two, or two have one name.

    Notes
    -----
    Gyros and accelerometers are voted on apart (`AxisVoting`). Where axes of units are parallel,
    and only two measure along a direction, a disagreement along it is told, and which of the two
    is wrong is not: both go on being used. Units that are skewed against each other tell more with
    fewer. Lever arms are not corrected: accelerometers that are r apart differ by up to
    ``r (ω² + |dω/dt|)``, which `VotingRule.apart` allows for as to ω²; move readings to one point
    before (`sensors.lever_arm`) where that is more than their uncertainty.
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
        """Stand before the first sample."""
        return UnitVotingState(self.gyro.begin(), self.accel.begin())

    def advance(
        self, state: UnitVotingState, tables: Mapping[str, pd.DataFrame]
    ) -> tuple[UnitVotingState, VotedImu]:
        """Vote over a segment; a log cut anywhere gives the same numbers.

        Parameters
        ----------
        state : UnitVotingState
        tables : mapping of str to DataFrame
            By name of the unit: Imu tables in the unit's own axes, with the same stamps; a value
            may be NaN, and is left out there.

        Returns
        -------
        UnitVotingState, VotedImu

        Raises
        ------
        DataError
            A table or a column is missing, stamps differ or do not advance, or too few healthy
            channels are left.
        """
        time, gyro, accel, sampling = self._readings(state, tables)
        turned = np.stack(
            [
                accel[:, 3 * k : 3 * k + 3] @ np.asarray(u.mounting).T
                for k, u in enumerate(self.units)
            ]
        )
        # The middle one, so that a unit that fails does not loosen the test of the gyros; zero
        # where none has a reading.
        force = np.nan_to_num(known_median(turned, 0))
        gyro_state, rates = self.gyro.advance(state.gyro, gyro, force)
        accel_state, forces = self.accel.advance(state.accel, accel, rates.values)
        names = [u.name for u in self.units]
        # Not `imu_table`: a segment may be one sample, and the values are finite.
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
        """What is not known of the fused table while all channels are healthy.

        Returns
        -------
        ImuUncertainty
            Noise, bias, drift; scale factor and misalignment as of a mean of independent units.
            Range, quantization and bandwidth have no place in a mean, and are left open.
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
        assert time is not None  # two units at least
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
        As of `UnitVoting.advance`; the rate is the mean one of the first.
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
