"""Rauch-Tung-Striebel (RTS) smoothing of a navigation run."""

from __future__ import annotations

import math
import tempfile
import weakref
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import IO, ClassVar

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown._kernels.smoothing import (
    COVARIANCE,
    TIME,
    TURN,
    padded,
    row_width,
    smooth_back,
    unpack,
)
from strapdown.errors import ConfigError
from strapdown.estimation.covariance import Observation
from strapdown.estimation.error_model import PHYSICAL
from strapdown.mechanization.mechanization import Mechanization
from strapdown.navigation.compiled_engine import compiled
from strapdown.navigation.engine import SAME_INSTANT
from strapdown.navigation.measurements.gnss import TINY
from strapdown.navigation.navigator import Navigator, Reference
from strapdown.navigation.record import CovarianceSnapshots, GrowingRows, NavigationChunk
from strapdown.tables import on_disk
from strapdown.tables.checks import is_number

Array = NDArray[np.float64]

#: Tolerance of the time of a mark, s: before an observation it is a microsecond earlier.
SAME_MARK = 1.5e-6
#: Interval at which a further pass follows the smoothed states, s: in between, sensors with their
#: smoothed errors subtracted leave them by next to nothing.
ANCHORS = 1.0


@dataclass(frozen=True)
class RauchTungStriebel:
    """Fixed-interval smoother of the filter: for any error model, form, rule and aid.

    The smoother history holds the covariance, the transition and the correction of each
    propagation and update of the filter; the backward pass adds the later observations. States and
    covariances are those of Rauch, Tung and Striebel (AIAA Journal 3 (1965) 1445, Eqs. 3.28 to
    3.31), computed in the adjoint form of Bryson and Frazier. Where errors only grow it needs no
    inverse, so that exactly known states do no harm.

    One pass is linear about the filter's own states, which each observation changes: the products
    of transitions and observations of one run are then those of different trajectories, and what no
    observation shows, as a tilt against the accelerometer bias that hides it, seems to be observed
    (Huang, Mourikis and Roumeliotis, Int. J. Robotics Research 29 (2010) 502). A run is therefore
    repeated about its smoothed states (`replay.relinearized`): the Gauss-Newton method for the
    states of highest probability (Bell, SIAM J. Optimization 4 (1994) 626). Outliers rejected by a
    rule of the last pass are not used.

    Attributes
    ----------
    memory : float, MB
        Beyond it the history is written to disk (the folder for temporary files).
    passes : int
        Most passes over a record; 1 is linear about the states of the filter.

    Raises
    ------
    ConfigError
        The size or the number is invalid.
    """

    name: ClassVar[str] = "rts"
    summary: ClassVar[str] = "fixed interval: every state by all observations, later ones too"
    source: ClassVar[str] = "Rauch, Tung and Striebel (1965); Bryson and Frazier (1963)"

    memory: float = field(default=64.0, metadata={"unit": "mb"})
    passes: int = 5

    def __post_init__(self) -> None:
        if not isinstance(self.passes, int) or not 1 <= self.passes <= 100:
            raise ConfigError(
                "navigation.smoother-passes", quantity="passes", passes=str(self.passes)
            )
        if not is_number(self.memory) or not 1.0 <= self.memory <= 1e6:
            raise ConfigError(
                "navigation.smoother-memory-too-small", quantity="memory_mb", memory=self.memory
            )

    def begin(self, navigator: Navigator) -> Smoothing:
        """Return an empty smoother history."""
        return Smoothing(navigator, int(self.memory * 1e6))


#: A new smoother is a class and a line here.
SMOOTHERS: dict[str, type[RauchTungStriebel]] = {"rts": RauchTungStriebel}


class Smoothing:
    """Smoother history of a run so far.

    Parameters
    ----------
    memory : int, bytes
    """

    def __init__(self, navigator: Navigator, memory: int) -> None:
        self._tape = SmoothingTape(navigator.filter.model.physical_size, memory)
        self._navigator, self._memory = navigator, memory
        model = navigator.filter.model
        self._left = GrowingRows.of(PHYSICAL)
        #: Time, that of the last mark, row of the history, estimates of the sensors at the mark.
        self._row = navigator.filter.mechanization.row
        self._anchors = GrowingRows.of(2 + self._row + model.stacked.sd.size)
        self._newest = CovarianceSnapshots.joined((), 0.0)
        self._due = -math.inf if navigator.about is None else navigator.about.next_time(-math.inf)
        #: With the corrections of the sensors at each node, and the marks.
        self._result: tuple[Smoothed, Array, Array] | None = None

    def take(self, piece: NavigationChunk) -> None:
        """Append the result of a chunk."""
        for rows in piece.nodes:
            self._tape.take(rows)
        self._left = self._left.and_then(piece.left)
        self._take_anchors(piece)

    def _take_anchors(self, piece: NavigationChunk) -> None:
        """Keep a state each `ANCHORS` seconds, with the last estimates of the sensors before it.

        A further pass keeps the instants of the first one, at which it follows the reference.
        """
        marks = CovarianceSnapshots.joined([self._newest, piece.marks], -math.inf)
        if not len(marks):
            return
        at, about, kept = marks.time, self._navigator.about, []
        k = int(piece.time.searchsorted(max(self._due, at[0]) - SAME_INSTANT))
        while k < len(piece.time):
            kept.append(k)
            time = float(piece.time[k])
            self._due = time + ANCHORS if about is None else about.next_time(time)
            k = int(piece.time.searchsorted(self._due - SAME_INSTANT))
        of = at.searchsorted(piece.time[kept] + SAME_INSTANT) - 1
        rows = (piece.time[kept], at[of], piece.history[kept], marks.sensors[of])
        self._anchors = self._anchors.and_then(np.column_stack(rows))
        self._newest = marks[-1:]

    def smoothed(self, marks: Array) -> Smoothed:
        """Run the backward pass over the whole history.

        Parameters
        ----------
        marks : ndarray, (m,), s
            Times of the marks of the run for which covariances are computed.
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
        errors = on_disk.room((len(time), n))
        covariance = on_disk.room((len(nodes), 9, 9))
        sensors_sd = on_disk.room((len(nodes), n - 9))
        joint = None
        for met, P, turn in self._back(nodes, errors):
            if joint is None and len(P):
                joint = P[-1, 9:, 9:].copy()
            for a in (0, 3, 6):
                for b in (0, 3, 6):
                    covariance[met, a : a + 3, b : b + 3] = (
                        turn.transpose(0, 2, 1) @ P[:, a : a + 3, b : b + 3] @ turn
                    )
            variances = np.diagonal(P, axis1=1, axis2=2)[:, 9:]
            sensors_sd[met] = np.sqrt(np.maximum(variances, 0.0))
            on_disk.let_go_of_all()
        sensors = on_disk.stored(errors[:, 9:], of_mark)
        left = self._left.rows
        for part in on_disk.parts_of(len(left), n):
            errors[part, :9] += left[part]
            on_disk.let_go_of_all()
        smoothed = Smoothed(
            mechanization=self._navigator.filter.mechanization,
            time=time,
            errors=errors[:, :9],
            left=left,
            covariance=on_disk.stored(covariance, place),
            sensors=sensors,
            sensors_sd=on_disk.stored(sensors_sd, place),
            joint=np.zeros((n - 9, n - 9)) if joint is None else joint,
        )
        self._result = smoothed, errors[:, 9:], marks
        return smoothed

    def release(self) -> None:
        """Drop the history, of which the smoothed states have been made."""
        self._tape = SmoothingTape(self._tape.size, self._memory)

    def correlation(self) -> Array:
        """Return the correlation of the sensor errors at the last mark, (s, s)."""
        assert self._result is not None
        joint = self._result[0].joint
        sd = np.sqrt(np.maximum(np.diagonal(joint), TINY))
        return np.asarray(joint / np.outer(sd, sd))

    def reference(self) -> Reference | None:
        """Return the smoothed states, about which another pass is linearized.

        None where no other pass is possible: the errors are not rotation vectors of a compiled
        closed loop, or there are no states.
        """
        navigator = self._navigator
        linear = compiled(navigator.filter) and navigator.damping.feeds_back
        if self._result is None or not self._anchors.count or not linear:
            return None
        smoothed, sensors, marks = self._result
        anchors = self._anchors.rows
        time, states = anchors[:, 0].copy(), on_disk.room((len(anchors), 10))
        errors = on_disk.stored(anchors[:, 2 + self._row :])
        for part in on_disk.parts_of(*anchors.shape):
            rows = smoothed.corrected(time[part], anchors[part, 2 : 2 + self._row])
            table = smoothed.mechanization.trajectory(time[part], rows).to_numpy()
            states[part, :2], states[part, 2:6] = np.radians(table[:, :2]), table[:, 2:6]
            states[part, 6:] = rotation.quaternion_from_euler(table[:, 6:])
            errors[part] += sensors[smoothed.nodes_at(anchors[part, 1])]
            on_disk.let_go_of_all()
        about = marks if navigator.about is None else navigator.about.marks
        return Reference(time, states, errors, about)

    def moved(self) -> float:
        """Return how far the smoothed states are from what they were linearized about.

        In standard deviations, the largest of the root mean squares of horizontal and vertical
        velocity, tilt and heading, where the state follows a reference: between two of these the
        noise of the sensors moves it. Those of the position act linearly.
        """
        if self._result is None or not self._anchors.count:
            return math.inf
        smoothed, _, marks = self._result
        time = self._anchors.rows[:, 0].copy()
        before = np.clip(marks.searchsorted(time + SAME_INSTANT) - 1, 0, None)
        apart = np.empty((4, len(time)))
        for part in on_disk.parts_of(len(time), 81):
            nodes = smoothed.nodes_at(time[part])
            squares = np.square(smoothed.errors[nodes, 3:])
            variances = np.diagonal(smoothed.covariance, axis1=1, axis2=2)[before[part], 3:]
            for k, own in enumerate((slice(0, 2), slice(2, 3), slice(3, 5), slice(5, 6))):
                apart[k, part] = squares[:, own].sum(axis=1)
                apart[k, part] /= np.maximum(variances[:, own].sum(axis=1), TINY)
            on_disk.let_go_of_all()
        return math.sqrt(max(float(own.mean()) for own in apart))

    def seen(self, times: Array, observations: Sequence[Observation]) -> tuple[Array, Array]:
        """Return the residuals of unused observations against the smoothed states.

        Parameters
        ----------
        times : ndarray, (m,), s
            Of epochs of the run, rising.
        observations : sequence of Observation, (m,)
            As `Seen` has them, of one number of components.

        Returns
        -------
        error : ndarray, (m, l)
            Smoothed minus observed, to first order in the smoother's corrections: every quantity of
            the observation is smoothed, including errors of an aid.
        covariance : ndarray, (m, l, l)
            Its predicted covariance, including the noise of the observation.
        """
        time = self._tape.times()
        # The first node of an instant is of the state before the updates there.
        nodes = np.clip(np.searchsorted(time, times), 0, len(time) - 1)
        H = np.array([one.H for one in observations])
        errors = np.empty((len(time), self._tape.size))
        covariance = np.array([np.diag(one.R) for one in observations])
        for met, P, _ in self._back(nodes, errors):
            covariance[met] += H[met] @ P @ H[met].transpose(0, 2, 1)
        z = np.array([one.z for one in observations])
        return z - (H @ errors[nodes][:, :, None])[:, :, 0], covariance

    def _back(self, nodes: NDArray[np.intp], errors: Array) -> Iterator[tuple[slice, Array, Array]]:
        """Run the backward pass.

        Parameters
        ----------
        nodes : ndarray, (m,)
            Indices of nodes, increasing.
        errors : ndarray, (count, p)
            Filled with the errors of the state at each node.

        Yields
        ------
        met : slice
            The nodes that are in a chunk.
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
            # Less than what rounding leaves of a start that was all but unknown: the filter's is an
            # upper bound.
            lost = (np.diagonal(P, axis1=1, axis2=2)[:, :PHYSICAL] < 0.0).any(axis=1)
            for k in np.flatnonzero(lost):
                unpack(rows[there[k]], COVARIANCE, P[k])
            yield met, P, rows[there, TURN:COVARIANCE].reshape(-1, 3, 3)
            end = begin


# Result of a smoother.


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Smoothed corrections to a filter's states, with their covariance.

    Attributes
    ----------
    time : ndarray, (k,), s
        Of the nodes.
    errors : ndarray, (k, 9)
        Of the state at each, level axes of the mechanization.
    left : ndarray, (k or 0, 9)
        Part of these that is the filter's estimate, where its state follows a reference.
    covariance : ndarray, (m, 9, 9)
        At the marks, north-east-down.
    sensors : ndarray, (m, s)
        Smoothed correction of the sensor estimates.
    sensors_sd : ndarray, (m, s)
    joint : ndarray, (s, s)
        Their covariance at the last mark.
    """

    mechanization: Mechanization
    time: Array
    errors: Array
    left: Array
    covariance: Array
    sensors: Array
    sensors_sd: Array
    joint: Array

    def nodes_at(self, time: Array) -> NDArray[np.intp]:
        """Return the last node not after each time: with several at an instant, of the output."""
        right = np.searchsorted(self.time, time + SAME_INSTANT, side="right")
        return np.asarray(np.clip(right - 1, 0, len(self.time) - 1))

    def corrected(self, time: Array, history: Array) -> Array:
        """Return rows of a history with the smoothed corrections applied.

        Between two nodes the correction is interpolated linearly: a tenth of a second apart, the
        error is less than a thousandth of the correction.

        Parameters
        ----------
        time : ndarray, (n,), s
        history : ndarray, (n, row)

        Returns
        -------
        ndarray, (n, row)
        """
        before = self.nodes_at(time)
        after = np.clip(before + 1, 0, len(self.time) - 1)
        length = self.time[after] - self.time[before]
        part = np.clip(time - self.time[before], 0.0, None)
        share = np.divide(part, length, out=np.zeros_like(part), where=length > 0.0)
        # Beyond the last node of a filter no growth is recorded.
        share = np.minimum(share, 1.0)[:, None]
        errors = (1.0 - share) * self.errors[before] + share * self.errors[after]
        return self.mechanization.corrected_history(history, errors)


# Smoother history, in memory or, if large, on disk.


#: Nodes of a chunk: some megabytes.
CHUNK = 1024


class SmoothingTape:
    """Smoother history, read from the last node to the first.

    A node needs ``8 (11 + p (p + 1) + p)`` bytes or a little more: 2 kB with 15 errors, 5 kB with
    24. Beyond the given memory, nodes are written to an unnamed file, which is removed with the
    tape or with the process, whichever ends first; only their times stay in memory.

    Parameters
    ----------
    size : int
        Number of physical errors, p.
    memory : int, bytes
    """

    def __init__(self, size: int, memory: int) -> None:
        self.size = size
        self._width = row_width(size)
        self._memory = memory
        self._chunks: list[Array] = []
        self._used = CHUNK
        self._times: list[Array] = []
        self._file: IO[bytes] | None = None
        self._written = 0

    def take(self, rows: Array) -> None:
        """Append nodes.

        Parameters
        ----------
        rows : ndarray, (k, width)
            Of `NodeRows`.
        """
        self._times.append(rows[:, TIME].copy())
        at = 0
        while at < len(rows):
            if self._used == CHUNK:
                self._new_chunk()
            some = rows[at : at + CHUNK - self._used]
            self._chunks[-1][self._used : self._used + len(some)] = some
            self._used += len(some)
            at += len(some)

    def times(self) -> Array:
        """Return the time of each node, (count,), s."""
        self._times = [np.concatenate([np.empty(0), *self._times])]
        return self._times[0]

    def backward(self) -> Iterator[Array]:
        """Yield chunks of rows, the last one first; within each they are in order of time."""
        for k in range(len(self._chunks) - 1, -1, -1):
            last = k + 1 == len(self._chunks)
            yield self._chunks[k][: self._used if last else CHUNK]
            on_disk.let_go(self._chunks[k])
        for k in range(self._written - 1, -1, -1):
            yield self._read(k)

    def _new_chunk(self) -> None:
        if self._chunks:
            on_disk.let_go(self._chunks[-1])
        most = max(self._memory // (8 * CHUNK * self._width), 1)
        if len(self._chunks) < most:
            self._chunks.append(on_disk.room((CHUNK, self._width)))
        else:
            self._write(self._chunks[0])
            on_disk.let_go(self._chunks[0])
            self._chunks.append(self._chunks.pop(0))
        self._used = 0

    def _write(self, rows: Array) -> None:
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile()  # noqa: SIM115
                weakref.finalize(self, _close, self._file)
            self._file.seek(0, 2)
            self._file.write(rows.data)
            self._file.flush()
        except OSError as error:
            folder = tempfile.gettempdir()
            took = 8e-6 * CHUNK * self._width * self._written
            raise ConfigError(
                "navigation.smoother-keeps-mb-memory-took",
                quantity="smoother, memory_mb",
                memory=1e-06 * self._memory,
                folder=folder,
                took=took,
                strerror=error.strerror or error,
            ) from None
        self._written += 1

    def _read(self, number: int) -> Array:
        assert self._file is not None
        size = 8 * CHUNK * self._width
        self._file.seek(number * size)
        return np.frombuffer(self._file.read(size)).reshape(CHUNK, self._width)


def _close(file: IO[bytes]) -> None:
    """Close a file; a failure to write its contents does not matter any more."""
    with suppress(OSError):
        file.close()
