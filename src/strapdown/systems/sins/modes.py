"""The modes of a chain, one after the other, and what ends each."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

from strapdown.alignment.coarse import CoarseAlignment
from strapdown.alignment.fine import FineAlignment
from strapdown.errors import ConfigError
from strapdown.tables.checks import is_number

__all__ = ["CoarseMode", "Command", "FineMode", "Mode", "Navigation", "Until", "check_timeline"]


@dataclass(frozen=True)
class Command:
    """A word to a chain.

    Attributes
    ----------
    time : float, s
        It holds from the first sample at or after it.
    word : str
        Name of the mode that is to begin: ``fine``, ``navigation``; or ``next``.
    """

    time: float
    word: str


@dataclass(frozen=True)
class Until:
    """What ends a mode of alignment: what comes first of these, or a command.

    Convergence is tried at whole seconds of the mode, each at least `pause` of the time so far
    after the one before: an alignment is of the whole record of its mode.

    Attributes
    ----------
    duration : float, s
        It ends then, and with an error if it found no attitude.
    heading_sd_deg, tilt_sd_deg : float, deg, optional
        It ends when the standard deviation of the heading, and of the worse of roll and pitch, are
        no more than these; of both, if both are given.
    least : float, s
        No alignment is tried before.
    pause : float

    Raises
    ------
    ConfigError
        A number means nothing, or nothing ends the mode.
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
        """Whether it may end by convergence."""
        return self.heading_sd_deg is not None or self.tilt_sd_deg is not None

    def next_try(self, elapsed: float) -> float:
        """Time since the begin of the mode at which an alignment is tried next, s."""
        if not self.converges:
            return math.inf
        return max(self.least, float(math.ceil(elapsed * (1.0 + self.pause) + 1e-6)))

    def met(self, heading_sd_deg: float, tilt_sd_deg: float) -> bool:
        """Whether an attitude is known as well as it was asked for."""
        heading, tilt = self.heading_sd_deg, self.tilt_sd_deg
        return (
            self.converges
            and (heading is None or heading_sd_deg <= heading)
            and (tilt is None or tilt_sd_deg <= tilt)
        )


@dataclass(frozen=True)
class Mode:
    """A time over which a chain does one thing.

    Attributes
    ----------
    name : str
    until : Until
    """

    kind: ClassVar[str]

    name: str
    until: Until = field(default_factory=Until)


@dataclass(frozen=True)
class CoarseMode(Mode):
    """Attitude by what the sensors read, and by fixes where the vehicle moves.

    Attributes
    ----------
    way : CoarseAlignment
    window : float, s
        The newest samples that are kept and aligned; all of the mode, if not given. A vehicle that
        waits for an hour and then drives is aligned by its last minute.
    """

    kind: ClassVar[str] = "coarse"

    name: str = "coarse"
    way: CoarseAlignment = field(kw_only=True)
    window: float = field(default=math.inf, metadata={"unit": "s"})


@dataclass(frozen=True)
class FineMode(Mode):
    """Attitude and biases by a filter over a rest; it begins with the attitude of the mode before.

    Attributes
    ----------
    way : FineAlignment
    """

    kind: ClassVar[str] = "fine"

    name: str = "fine"
    way: FineAlignment = field(default_factory=FineAlignment)


@dataclass(frozen=True)
class Navigation(Mode):
    """Navigation, to the end."""

    kind: ClassVar[str] = "navigation"

    name: str = "navigation"


def check_timeline(modes: tuple[Mode, ...], known_start: bool) -> None:
    """Refuse modes that do not lead from one to the next.

    Parameters
    ----------
    modes : tuple of Mode
    known_start : bool
        Whether the state at the start is stated.

    Raises
    ------
    ConfigError
        The last mode is not navigation, a name stands twice, a fine alignment has nothing before
        it, a mode of alignment never ends, or there is neither an alignment nor a known state.
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
