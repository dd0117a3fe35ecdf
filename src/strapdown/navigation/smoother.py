"""A run seen from its end: what later observations tell of earlier states."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from strapdown._kernels.smoothing import padded, smooth_back
from strapdown._kernels.smoothing_rows import COVARIANCE, TURN
from strapdown.errors import ConfigError
from strapdown.estimation.observation import Observation
from strapdown.navigation.navigator import Navigator
from strapdown.navigation.piece import NavigationPiece
from strapdown.navigation.smoothed import Smoothed
from strapdown.navigation.smoothing_tape import SmoothingTape
from strapdown.tables.checks import is_number

__all__ = ["SMOOTHERS", "RauchTungStriebel", "Smoother", "Smoothing"]

Array = NDArray[np.float64]

#: A mark is that of a node within this, s: before an observation it is a microsecond earlier.
SAME_MARK = 1.5e-6


@dataclass(frozen=True)
class Smoother(ABC):
    """How a run is smoothed; it holds no state of its own."""

    name: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]

    @abstractmethod
    def begin(self, navigator: Navigator) -> Smoothing:
        """Return what takes the pieces of a run of a navigator with this smoother."""


@dataclass(frozen=True)
class RauchTungStriebel(Smoother):
    """Fixed-interval smoother over the filter that ran: any error model, form, rule and aid.

    Of each growth and each update of the filter its covariance, the transition, and what was taken
    off are kept; from the end back to the start it then adds what came later. States and
    covariances are those of Rauch, Tung and Striebel (AIAA Journal 3 (1965) 1445, Eqs. 3.28 to
    3.31); they are reckoned in the adjoint form of Bryson and Frazier, which inverts nothing
    where errors only grow, so that what is known exactly does no harm.

    It is linear about the filter's own states: where the filter was far from the truth, as with a
    heading that is off by tens of degrees, the smoothed states of that time are no better than
    the linear model there. What a rule took for an outlier stays one.

    Attributes
    ----------
    memory : float, MB
        Beyond it nodes go to the disk (the folder for temporary files).

    Raises
    ------
    ConfigError
        It is no size.
    """

    name: ClassVar[str] = "rts"
    summary: ClassVar[str] = "fixed interval: every state by all observations, later ones too"
    source: ClassVar[str] = "Rauch, Tung and Striebel (1965); Bryson and Frazier (1963)"

    memory: float = field(default=256.0, metadata={"unit": "mb"})

    def __post_init__(self) -> None:
        if not is_number(self.memory) or not 1.0 <= self.memory <= 1e6:
            raise ConfigError(
                "navigation.smoother-memory-too-small", quantity="memory_mb", memory=self.memory
            )

    def begin(self, navigator: Navigator) -> Smoothing:
        """Return what takes the pieces of a run."""
        return Smoothing(navigator, int(self.memory * 1e6))


#: A new smoother is a class and a line here.
SMOOTHERS: dict[str, type[Smoother]] = {"rts": RauchTungStriebel}


class Smoothing:
    """What a smoother knows of a run so far.

    Parameters
    ----------
    navigator : Navigator
    memory : int, bytes
    """

    def __init__(self, navigator: Navigator, memory: int) -> None:
        self._tape = SmoothingTape(navigator.filter.model.physical_size, memory)
        self._navigator = navigator

    def take(self, piece: NavigationPiece) -> None:
        """Take what came of a further piece."""
        for rows in piece.nodes:
            self._tape.take(rows)

    def smoothed(self, marks: Array) -> Smoothed:
        """Go back over everything that was taken.

        Parameters
        ----------
        marks : ndarray, (m,), s
            Where covariances are wanted: times of marks of the run.

        Returns
        -------
        Smoothed
        """
        n, time = self._tape.size, self._tape.times()
        of_mark = np.clip(np.searchsorted(time, marks + SAME_MARK, side="right") - 1, 0, None)
        of_mark = np.where(
            np.abs(time[of_mark] - marks) > SAME_MARK / 10.0,
            # Before an observation: the growth that led to it.
            np.clip(np.searchsorted(time, marks), 0, len(time) - 1),
            of_mark,
        )
        nodes, place = np.unique(of_mark, return_inverse=True)
        errors = np.empty((len(time), n))
        mark_errors = np.empty((len(nodes), 9))
        covariance = np.empty((len(nodes), 9, 9))
        sensors_sd = np.empty((len(nodes), n - 9))
        for met, P, turn in self._back(nodes, errors):
            level = errors[nodes[met], :9].reshape(-1, 3, 3)
            mark_errors[met] = (level @ turn).reshape(-1, 9)
            for a in (0, 3, 6):
                for b in (0, 3, 6):
                    covariance[met, a : a + 3, b : b + 3] = (
                        turn.transpose(0, 2, 1) @ P[:, a : a + 3, b : b + 3] @ turn
                    )
            variances = np.diagonal(P, axis1=1, axis2=2)[:, 9:]
            sensors_sd[met] = np.sqrt(np.maximum(variances, 0.0))
        return Smoothed(
            mechanization=self._navigator.filter.mechanization,
            time=time,
            errors=errors[:, :9].copy(),
            mark_errors=mark_errors[place],
            covariance=covariance[place],
            sensors=errors[of_mark, 9:],
            sensors_sd=sensors_sd[place],
        )

    def seen(self, times: Array, observations: Sequence[Observation]) -> tuple[Array, Array]:
        """Return what observations that were not used are off by from the smoothed states.

        Parameters
        ----------
        times : ndarray, (m,), s
            Of epochs of the run, rising.
        observations : sequence of Observation, (m,)
            As `Seen` has them, of one number of components.

        Returns
        -------
        error : ndarray, (m, l)
            Smoothed less observed, to first order in what the smoother takes off: everything that
            the observation depends on is smoothed, errors of an aid too.
        covariance : ndarray, (m, l, l)
            Expected of it, noise of the observation and all.
        """
        time = self._tape.times()
        # The first of an instant is of the state before anything was taken at it.
        nodes = np.clip(np.searchsorted(time, times), 0, len(time) - 1)
        H = np.array([one.H for one in observations])
        errors = np.empty((len(time), self._tape.size))
        covariance = np.array([np.diag(one.R) for one in observations])
        for met, P, _ in self._back(nodes, errors):
            covariance[met] += H[met] @ P @ H[met].transpose(0, 2, 1)
        z = np.array([one.z for one in observations])
        return z - (H @ errors[nodes][:, :, None])[:, :, 0], covariance

    def _back(self, nodes: NDArray[np.intp], errors: Array) -> Iterator[tuple[slice, Array, Array]]:
        """Go back over the tape.

        Parameters
        ----------
        nodes : ndarray, (m,)
            Numbers of nodes, rising.
        errors : ndarray, (count, p)
            Filled with those of the state at each node.

        Yields
        ------
        met : slice
            Which of the nodes are in a chunk.
        covariance : ndarray, (k, p, p)
            Of these.
        turn : ndarray, (k, 3, 3)
            From north-east-down to level axes.
        """
        n, end = self._tape.size, len(errors)
        told, less = np.zeros(padded(n)), np.zeros((n, padded(n)))
        for rows in self._tape.backward():
            begin = end - len(rows)
            met = slice(*np.searchsorted(nodes, [begin, end]).tolist())
            there = nodes[met] - begin
            wanted = np.full(len(rows), -1)
            wanted[there] = np.arange(len(there))
            P = np.empty((len(there), n, n))
            smooth_back(rows, n, told, less, wanted, errors[begin:end], P)
            yield met, P, rows[there, TURN:COVARIANCE].reshape(-1, 3, 3)
            end = begin
