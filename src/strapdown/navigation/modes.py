"""Modes of a pipeline and their end conditions."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from strapdown.alignment.alignment import Alignment, CoarseAlignment
from strapdown.alignment.fine import FineAlignment, FineResult
from strapdown.errors import ConfigError
from strapdown.nav_state import NavState
from strapdown.navigation.record import Event, NavigationChunk, Span
from strapdown.rotation import euler_from_quaternion
from strapdown.tables.checks import is_number


@dataclass(frozen=True)
class Command:
    """Command to a pipeline.

    Attributes
    ----------
    time : float, s
        The command holds from the first sample at or after it.
    word : str
        Name of the mode to begin: ``fine``, ``navigation``; or ``next``.
    """

    time: float
    word: str


@dataclass(frozen=True)
class Until:
    """End condition of an alignment mode: the first of these, or a command.

    Convergence is tried at whole seconds of the mode, each later than the one before by at least
    `pause` of the elapsed time: an alignment uses the whole record of its mode.

    Attributes
    ----------
    duration : float, s
        Longest duration; an error if no attitude was found.
    heading_sd_deg, tilt_sd_deg : float, deg, optional
        Largest standard deviations of the heading, and of the worse of roll and pitch; both must
        be met if both are given.
    least : float, s
        Time before the first attempt.
    """

    duration: float = field(default=math.inf, metadata={"unit": "s"})
    heading_sd_deg: float | None = None
    tilt_sd_deg: float | None = None
    least: float = field(default=1.0, metadata={"unit": "s"})
    pause: float = 0.05

    def __post_init__(self) -> None:
        for name in ("duration", "heading_sd_deg", "tilt_sd_deg", "least"):
            value = getattr(self, name)
            if value is not None and not (is_number(value) and value > 0.0):
                raise ConfigError("navigation.mode-end-not-positive", quantity=name, value=value)
        if not is_number(self.pause) or not 0.0 <= self.pause <= 1.0:
            raise ConfigError("navigation.no-part-time", quantity="pause", pause=self.pause)

    @property
    def converges(self) -> bool:
        """Whether the mode may end by convergence."""
        return self.heading_sd_deg is not None or self.tilt_sd_deg is not None

    def next_try(self, elapsed: float) -> float:
        """Time from the begin of the mode to the next attempt, s."""
        if not self.converges:
            return math.inf
        return max(self.least, float(math.ceil(elapsed * (1.0 + self.pause) + 1e-6)))

    def met(self, heading_sd_deg: float, tilt_sd_deg: float) -> bool:
        """Whether the attitude meets the required standard deviations."""
        heading, tilt = self.heading_sd_deg, self.tilt_sd_deg
        return (
            self.converges
            and (heading is None or heading_sd_deg <= heading)
            and (tilt is None or tilt_sd_deg <= tilt)
        )


@dataclass(frozen=True)
class Mode:
    """Mode of a pipeline."""

    kind: ClassVar[str]

    name: str
    until: Until = field(default_factory=Until)


@dataclass(frozen=True)
class CoarseMode(Mode):
    """Coarse alignment by the sensors, and by fixes if the vehicle moves.

    Attributes
    ----------
    window : float, s
        Length of the newest samples to align; the whole mode, if not given. A vehicle that waits
        for an hour and then drives is aligned by its last minute.
    """

    kind: ClassVar[str] = "coarse"

    name: str = "coarse"
    way: CoarseAlignment = field(kw_only=True)
    window: float = field(default=math.inf, metadata={"unit": "s"})


@dataclass(frozen=True)
class FineMode(Mode):
    """Fine alignment: attitude and biases by a filter at rest, after a coarse alignment."""

    kind: ClassVar[str] = "fine"

    name: str = "fine"
    way: FineAlignment = field(default_factory=FineAlignment)


@dataclass(frozen=True)
class Navigation(Mode):
    """Navigation, to the end of the record."""

    kind: ClassVar[str] = "navigation"

    name: str = "navigation"


def check_timeline(modes: tuple[Mode, ...], known_start: bool) -> None:
    """Refuse an invalid sequence of modes.

    Parameters
    ----------
    known_start : bool
        Whether the initial state is stated.
    """
    names = [mode.name for mode in modes]
    for name in names:
        if names.count(name) > 1 or name == "next":
            raise ConfigError("navigation.mode-name-taken", quantity="modes", name=name)
    kinds = [mode.kind for mode in modes]
    if not kinds or kinds[-1] != "navigation" or kinds.count("navigation") > 1:
        raise ConfigError(
            "navigation.modes-end-without-navigation",
            quantity="modes",
            names=", ".join(names) or "(none)",
        )
    if known_start and len(kinds) > 1:
        raise ConfigError(
            "navigation.state-start-known-would-look", quantity="modes", names=names[0]
        )
    if not known_start and len(kinds) == 1:
        raise ConfigError("navigation.no-start", quantity="modes")
    for before, mode in zip([None, *kinds], modes, strict=False):
        if mode.kind == "fine" and before != "coarse":
            raise ConfigError(
                "navigation.mode-without-coarse-alignment", quantity="modes", name=mode.name
            )


# Navigation from a known state, without an alignment.


Array = NDArray[np.float64]
Three = tuple[float, float, float]


@dataclass(frozen=True)
class KnownStart:
    """Initial state with standard deviations.

    Attributes
    ----------
    state : NavState
        Navigation begins with the sample at its time; earlier samples are ignored.
    position_sd : tuple of float, (3,), m
        North, east, down.
    velocity_sd : tuple of float, (3,), m/s
    attitude_sd_deg : tuple of float, (3,), deg
        Roll, pitch, heading.
    at_first_sample : bool
        Whether the state is that of the first sample, whatever its time.
    """

    state: NavState
    position_sd: Three
    velocity_sd: Three
    attitude_sd_deg: Three
    at_first_sample: bool = False

    def __post_init__(self) -> None:
        for name in ("position_sd", "velocity_sd", "attitude_sd_deg"):
            value = getattr(self, name)
            if len(value) != 3 or not all(is_number(x) and 0.0 <= x < math.inf for x in value):
                raise ConfigError(
                    "navigation.no-three-standard-deviations", quantity=name, value=value
                )

    @property
    def covariance(self) -> Array:
        """Covariance of displacement, velocity and rotation in north-east-down, (9, 9).

        Errors of roll, pitch and heading are rotations about the forward axis, about the level axis
        to its right, and about down.
        """
        _, pitch, heading = np.radians(euler_from_quaternion(self.state.q_nb)).tolist()
        sp, cp, sh, ch = math.sin(pitch), math.cos(pitch), math.sin(heading), math.cos(heading)
        axes = np.array([[cp * ch, -sh, 0.0], [cp * sh, ch, 0.0], [-sp, 0.0, 1.0]])
        P = np.zeros((9, 9))
        P[0:3, 0:3] = np.diag(np.square(self.position_sd))
        P[3:6, 3:6] = np.diag(np.square(self.velocity_sd))
        P[6:9, 6:9] = axes * np.square(np.radians(self.attitude_sd_deg)) @ axes.T
        return P


# Output of a pipeline for a chunk.


@dataclass(frozen=True, eq=False)
class Aligned:
    """Result of an alignment mode.

    Attributes
    ----------
    begin, end : float, s
        Of the mode.
    alignment : Alignment
        At its end.
    """

    mode: str
    begin: float
    end: float
    alignment: Alignment
    fine: FineResult | None = None


@dataclass(frozen=True, eq=False)
class PipelineChunk:
    """Output of a pipeline for a chunk of input.

    Attributes
    ----------
    mode : str
        At the end of the chunk.
    time : float, s
        Time of the newest step.
    navigation : tuple of NavigationChunk
        In order of time.
    aligned : tuple of Aligned
        Alignment modes that ended.
    events : tuple of Event
        Events found in the chunk; some occurred earlier.
    modes : tuple of Span
        Modes that ended.
    outages : tuple of (str, Span)
        Outages of measurements that ended.
    """

    mode: str
    time: float
    navigation: tuple[NavigationChunk, ...] = ()
    aligned: tuple[Aligned, ...] = ()
    events: tuple[Event, ...] = ()
    modes: tuple[Span, ...] = ()
    outages: tuple[tuple[str, Span], ...] = ()
