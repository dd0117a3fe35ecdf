"""Named scenarios of rotation, from ``scenarios.toml``."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from strapdown.errors import ConfigError, check_choice
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation.attitude_motions import Coning, Gesture, Handling, SmoothRandom, gesture
from strapdown.simulation.motion import Motion, Pulse, PulseMotion, Track

_BEYOND = "beyond the paper"


@dataclass(frozen=True)
class Scenario:
    """A motion with exactly known attitude, and the errors of its sensors.

    Attributes
    ----------
    title : str
    origin : str
        Source in Alexiev (2021), or that the scenario is not from the paper.
    motion : Motion
    errors : ImuErrors
    references : tuple of str
        Known attitude at some instants, in the syntax of `--reference`, as for a recording without
        other truth.
    after : str
        What a scenario that is not from the paper was modelled after.
    """

    title: str
    origin: str
    motion: Motion
    errors: ImuErrors = field(default_factory=ImuErrors)
    references: tuple[str, ...] = ()
    after: str = ""

    @property
    def source(self) -> str:
        """Source of the scenario, with the name of the paper where it applies."""
        if self.after:
            return self.after
        return self.origin if self.origin == _BEYOND else f"Alexiev 2021, {self.origin}"


def _motion(table: dict[str, Any]) -> Motion:
    duration = table["duration"]
    if "pulses" in table:
        pulses = [q for p in table["pulses"] for q in _pulses(p)]
        return PulseMotion(tuple(pulses), duration, arm=tuple(table.get("arm", (0.0, 0.0, 0.0))))
    if "tracks" in table:
        tracks: dict[str, Any] = {k: Track(*map(tuple, v)) for k, v in table["tracks"].items()}
        return Gesture(duration, **tracks)
    if "poses" in table:
        return gesture(table["poses"], duration)
    if "coning" in table:
        return Coning(duration=duration, **table["coning"])
    if "smooth_random" in table:
        return SmoothRandom(duration=duration, **_tuples(table["smooth_random"]))
    return Handling(duration=duration, **table["handling"])


def _pulses(table: dict[str, Any]) -> list[Pulse]:
    """Pulses of one entry: by its rate, or with edges by its turn in deg; once, or repeated."""
    axis = "xyz".index(table["axis"])
    start, end, edge = table["start"], table["end"], table.get("edge", 0.0)
    if "turn" in table:
        return repeated_pulse(axis, (start, end), table["turn"], edge, *table.get("again", ()))
    return [Pulse(axis, start, end, table["rate"], table.get("closed", False), edge)]


def repeated_pulse(
    axis: int,
    within: tuple[float, float],
    turn: float,
    edge: float = 0.0,
    times: int = 1,
    every: float = 0.0,
) -> list[Pulse]:
    """Pulses that turn by an angle each, at a period.

    `axis`: 0, 1, 2. `within` (s): start and end of the first. `turn` (deg): of each. `edge` (s): as
    of `Pulse`. `times`: number of pulses, `every` s.
    """
    start, end = within
    if not 0.0 <= 2.0 * edge <= (end - start) * (1.0 + 1e-12):
        raise ConfigError(
            "simulation.pulse-shorter-than-edges",
            quantity="edge",
            edge=edge,
            length=end - start,
            start=start,
        )
    rate = math.radians(turn) / (end - start - edge)
    return [Pulse(axis, start + k * every, end + k * every, rate, edge=edge) for k in range(times)]


def _tuples(table: dict[str, Any]) -> dict[str, Any]:
    return {k: tuple(v) if isinstance(v, list) else v for k, v in table.items()}


def _scenario(table: dict[str, Any]) -> Scenario:
    return Scenario(
        table["title"],
        table.get("origin", _BEYOND),
        _motion(table),
        ImuErrors(TriadErrors(**_tuples(table["gyro"]))) if "gyro" in table else ImuErrors(),
        tuple(table.get("references", ())),
        table.get("after", ""),
    )


#: The scenarios by name.
SCENARIOS: dict[str, Scenario] = {
    name: _scenario(table)
    for name, table in tomllib.loads(
        Path(__file__).with_name("scenarios.toml").read_text(encoding="utf-8")
    ).items()
}


def find_scenario(name: str) -> Scenario:
    """Return the scenario with that name.

    ConfigError: the name is unknown; the message gives the nearest.
    """
    check_choice("simulation.no-scenario", SCENARIOS, quantity="scenario", name=name)
    return SCENARIOS[name]
