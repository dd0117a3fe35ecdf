"""The chain of system C: samples and tables of aids in, navigation out, in pieces of any length."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.aiding.aid import TableAid
from strapdown.alignment.site import Site
from strapdown.errors import ConfigError
from strapdown.navigation.growing_rows import GrowingRows
from strapdown.navigation.navigator import Navigator, NavigatorState
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.systems.sins.deliveries import Deliveries, DeliveriesState
from strapdown.systems.sins.gaps import Hole
from strapdown.systems.sins.intake import Intake, IntakeState
from strapdown.systems.sins.known_start import KnownStart
from strapdown.systems.sins.modes import Command, Mode, Navigation, check_timeline
from strapdown.systems.sins.piece import Aligned, ChainPiece

__all__ = ["Chain", "ChainState"]

Array = NDArray[np.float64]
Three = tuple[float, float, float]

#: A step as it is kept during an alignment: time, six values, ten increments.
KEPT = 17
#: How long what an aid was told is kept in navigation, where a gap may need it again, s.
REMEMBERED = 60.0


@dataclass(frozen=True, eq=False)
class ChainState:
    """Everything that a chain remembers: from here it goes on.

    Attributes
    ----------
    intake : IntakeState
    mode : int
        Place of the mode in the chain's `modes`.
    begun : float, s
        When the mode began; not a number before the first sample.
    next_try : float, s
        Since then, when an alignment is tried next.
    kept : GrowingRows
        Steps of an alignment.
    aligned : Aligned or None
        What the mode before ended with.
    told : mapping of str to tuple of DataFrame
        Tables that aids were told, as long as an alignment may need them.
    commands : tuple of Command
        That are still to come.
    holes : tuple of Hole
        That the steps have not come to yet.
    navigator : NavigatorState or None
    deliveries : DeliveriesState
        What each aid delivered.
    time : float, s
        Of the newest step.
    """

    intake: IntakeState
    mode: int
    begun: float
    next_try: float
    kept: GrowingRows
    aligned: Aligned | None
    told: Mapping[str, tuple[pd.DataFrame, ...]]
    commands: tuple[Command, ...]
    holes: tuple[Hole, ...]
    navigator: NavigatorState | None
    deliveries: DeliveriesState
    time: float


@dataclass(frozen=True, eq=False)
class Chain:
    """Samples to steps, coarse and fine alignment, navigation: a timeline of modes.

    It does not know where its samples come from. They may come in pieces of any length, and the
    table of each aid at once or bit by bit, as long as a row is told before the samples that
    follow it: the numbers are the same to the last bit. A method never changes the state that it
    is given.

    During an alignment the steps of its mode are kept (136 bytes each; of a coarse mode with a
    `window` no more than that), and what aids were told; afterwards nothing but the states of the
    stages.

    Attributes
    ----------
    navigator : Navigator
    intake : Intake
    modes : tuple of Mode
        The last is navigation.
    start : KnownStart, optional
        Where navigation alone is the timeline.
    sensors : ImuUncertainty, optional
        Of alignments.
    site : Site, optional
        Where the body stands while it is aligned; by fixes, if not given.
    site_sd : tuple of float, (3,), m
        How well that is known, north, east, down.
    velocity_sd : tuple of float, (3,), m/s
        Of a body after a coarse alignment at a site, which is at rest.
    fixes : str, optional
        The aid whose table has the fixes of an alignment; the first that is a satellite receiver,
        if not given.
    commands : tuple of Command
    deliveries : Deliveries
        How outages, recoveries and rejections are told.

    Raises
    ------
    ConfigError
        The modes do not lead from one to the next, or something that they need is not given.
    """

    navigator: Navigator
    intake: Intake = field(default_factory=Intake)
    modes: tuple[Mode, ...] = (Navigation(),)
    start: KnownStart | None = None
    sensors: ImuUncertainty | None = None
    site: Site | None = None
    site_sd: Three = (1.0, 1.0, 1.0)
    velocity_sd: Three = (0.1, 0.1, 0.1)
    fixes: str | None = None
    commands: tuple[Command, ...] = ()
    deliveries: Deliveries = field(default_factory=Deliveries)

    def __post_init__(self) -> None:
        check_timeline(self.modes, self.start is not None)
        if len(self.modes) > 1 and self.sensors is None:
            raise ConfigError("navigation.alignment-without-sensor-errors", quantity="sensors")
        if self.intake.gaps.beyond == "align" and len(self.modes) == 1:
            raise ConfigError("navigation.no-alignment-after-gap", quantity="gaps")
        for command in self.commands:
            self._check_word(command.word)
        if self.fixes is not None and self.fixes not in self._tables():
            raise ConfigError(
                "navigation.no-aid-table-2",
                quantity="fixes",
                fixes=self.fixes,
                word=self.fixes,
                known=self._tables(),
            )

    @property
    def fixes_from(self) -> str | None:
        """The aid whose table has the fixes of an alignment."""
        if self.fixes is not None:
            return self.fixes
        return next((aid.name for aid in self.navigator.aids if aid.kind == "gnss"), None)

    def begin(self, sampling: str = "instantaneous", source: str | None = None) -> ChainState:
        """Return the state before the first sample.

        Parameters
        ----------
        sampling : {'instantaneous', 'mean'}
            As `tables.imu_table`.
        source : str, optional
            Name of the samples, for messages.
        """
        return ChainState(
            intake=self.intake.begin(sampling, source),
            mode=0,
            begun=np.nan,
            next_try=np.inf,
            kept=GrowingRows.of(KEPT),
            aligned=None,
            told=dict.fromkeys(self._tables(), ()),
            commands=tuple(sorted(self.commands, key=lambda one: one.time)),
            holes=(),
            navigator=None,
            deliveries=self.deliveries.begin(self._tables()),
            time=-np.inf,
        )

    def tell(self, state: ChainState, name: str, table: pd.DataFrame) -> ChainState:
        """Take rows of the table of an aid, later than those before.

        Parameters
        ----------
        state : ChainState
        name : str
            Of the aid.
        table : DataFrame

        Returns
        -------
        ChainState

        Raises
        ------
        ConfigError
            There is no such aid.
        DataError
            The table is not valid.
        """
        if state.navigator is not None:
            told = self.navigator.tell(state.navigator, name, table)
            state = replace(state, navigator=told)
            return self._remembering(state, name, table) if self._aligns_anew else state
        aid = self.navigator.by_name.get(name)
        if not isinstance(aid, TableAid):
            raise ConfigError(
                "navigation.no-aid-table",
                quantity="aiding",
                name=name,
                word=name,
                known=self._tables(),
            )
        # What is wrong with it is said when it comes, and not after an alignment.
        aid.epochs(table)
        return self._remembering(state, name, table)

    def command(self, state: ChainState, word: str, time: float = -np.inf) -> ChainState:
        """Take a command.

        Parameters
        ----------
        state : ChainState
        word : str
            As `Command.word`.
        time : float, s
            It holds from the first sample at or after it: the next one, if not given.
        """
        self._check_word(word)
        commands = sorted((*state.commands, Command(time, word)), key=lambda one: one.time)
        return replace(state, commands=tuple(commands))

    def advance(
        self, state: ChainState, time: Array, values: Array, last: bool = False
    ) -> tuple[ChainState, ChainPiece]:
        """Go on over samples.

        Parameters
        ----------
        state : ChainState
        time : ndarray, (k,), s
            Stamps.
        values : ndarray, (k, 6)
            Rates in rad/s and specific forces in m/s², axes of the sensors.
        last : bool
            Whether no sample follows: what waits in a pre-filter comes out.

        Returns
        -------
        state : ChainState
        piece : ChainPiece

        Raises
        ------
        DataError
            The samples cannot be used, a gap is longer than is bridged, or an alignment is not
            possible.
        DivergenceError
            As `Navigator.advance`.
        """
        from strapdown.systems.sins.going import Going

        intake, steps = self.intake.advance(state.intake, time, values, last)
        going = Going(self, replace(state, intake=intake))
        going.over(steps)
        return going.state(), going.piece(last)

    def finish(self, state: ChainState) -> tuple[ChainState, ChainPiece]:
        """Say that no sample follows; as the last piece does with `last`."""
        return self.advance(state, np.empty(0), np.empty((0, 6)), last=True)

    @property
    def _aligns_anew(self) -> bool:
        return self.intake.gaps.beyond == "align"

    def _remembering(self, state: ChainState, name: str, table: pd.DataFrame) -> ChainState:
        """Keep a table for what is to begin; in navigation, without what is long past."""
        known = state.told[name]
        if state.navigator is not None:
            known = tuple(one for one in known if one.index[-1] > state.time - REMEMBERED)
        return replace(state, told={**state.told, name: (*known, table)})

    def _tables(self) -> tuple[str, ...]:
        return tuple(aid.name for aid in self.navigator.aids if isinstance(aid, TableAid))

    def _check_word(self, word: str) -> None:
        words = ("next", *(mode.name for mode in self.modes[1:]))
        if word not in words:
            raise ConfigError(
                "navigation.unknown-mode", quantity="commands", word=word, known=words
            )
