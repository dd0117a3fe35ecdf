"""How an error of a sensor changes in time, as a person states it: constant, fading or walking."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from strapdown.errors import ConfigError
from strapdown.estimation.sensor_blocks import ERRORS_OF_SENSORS, gauss_markov, random_walk
from strapdown.estimation.sensor_states import SensorStates
from strapdown.sensors.triad_errors import TriadLike

__all__ = ["StateProcess", "with_processes"]


@dataclass(frozen=True)
class StateProcess:
    """What is stated of a block of states; what is not stays as it was.

    Attributes
    ----------
    sd : float or triad, optional
        At the start; of a Gauss-Markov process at every instant. SI.
    correlation_time : float, s, optional
        Of a stationary Gauss-Markov process.
    walk : float or triad, unit/√s, optional
        Of a random walk.

    Raises
    ------
    ConfigError
        Both a correlation time and a walk are stated.
    """

    sd: TriadLike | None = None
    correlation_time: float | None = None
    walk: TriadLike | None = None

    def __post_init__(self) -> None:
        if self.correlation_time is not None and self.walk is not None:
            raise ConfigError(
                "estimation.cannot-both-walk-come-back", quantity="states, correlation_time"
            )

    def of(self, name: str, block: SensorStates | None) -> SensorStates:
        """Return a block with what is stated.

        Parameters
        ----------
        name : str
            Of `ERRORS_OF_SENSORS`.
        block : SensorStates, optional
            As it was; None where only this states it.

        Returns
        -------
        SensorStates

        Raises
        ------
        ConfigError
            Nothing states how large it is.
        """
        if self.sd is not None:
            drifts = name.endswith("_drift")
            time = self.correlation_time
            if (
                drifts
                and time is None
                and block is not None
                and math.isfinite(block.correlation_time)
            ):
                time = block.correlation_time
            if drifts and time is None:
                raise ConfigError(
                    "estimation.nothing-states-over-time-changes",
                    quantity=f"states.{name}",
                    name=name,
                )
            made = ERRORS_OF_SENSORS[name]
            new = made(self.sd, time) if drifts else made(self.sd)
            if block is not None and not drifts:
                new = replace(new, drive=block.drive, correlation_time=block.correlation_time)
            block = new
        if block is None:
            raise ConfigError(
                "estimation.nothing-states-how-large-may", quantity=f"states.{name}", name=name
            )
        if self.correlation_time is not None:
            return gauss_markov(block, self.correlation_time)
        return block if self.walk is None else random_walk(block, self.walk)


def with_processes(
    states: tuple[SensorStates, ...], processes: Mapping[str, StateProcess]
) -> tuple[SensorStates, ...]:
    """Return states with what is stated of some of them; those that are not there come last.

    Parameters
    ----------
    states : tuple of SensorStates
    processes : mapping of str to StateProcess
        By name of a block.

    Returns
    -------
    tuple of SensorStates
    """
    there = {one.block.name for one in states}
    changed = [
        processes[one.block.name].of(one.block.name, one) if one.block.name in processes else one
        for one in states
    ]
    more = [process.of(name, None) for name, process in processes.items() if name not in there]
    return (*changed, *more)
