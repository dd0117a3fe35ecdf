"""A second reckoning of the heading that is not told what the first one assumed of it.

Beside a run small navigators go over the same record, each from some instant on, with a heading
that is as good as unknown there, and with fixes of satellites alone. What such a witness says of
the heading it has from the motion since then: from no start, no alignment, no heading aid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.aiding.gnss import Gnss
from strapdown.constants import MAD_TO_SD
from strapdown.ellipsoids import Ellipsoid, find_ellipsoid
from strapdown.errors import DataError, DivergenceError
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.filter_state import FilterState
from strapdown.evaluation.heading_light import doubted
from strapdown.evaluation.trajectory_at import trajectory_at
from strapdown.nav_state import NavState
from strapdown.navigation.navigator import Navigator, NavigatorState
from strapdown.navigation.piece import Mark, NavigationPiece
from strapdown.navigation.record import NavigationRecord
from strapdown.rotation.euler_angles import euler_sd
from strapdown.systems.sins.witness_source import Witnesses
from strapdown.tables import EULER, GEODETIC, VELOCITY
from strapdown.tables.checks import index_of

__all__ = ["Evidence", "hear_witnesses"]

Array = NDArray[np.float64]

#: Of a heading that is as good as unknown, deg: beyond it equations of the first order are none.
UNKNOWN = 20.0
#: It knows a heading no better than this, deg: its steps are joined, its fixes thinned.
LEAST_HEADING = 0.03
#: What the run says of everything but its heading is taken so many times less well.
LOOSER = 2.0
#: Known no better than this at its start: m, m/s, deg of roll and pitch.
LEAST_PLACE, LEAST_VELOCITY, LEAST_TILT = 0.1, 0.05, 0.2
#: The same of roll and pitch of a run that was doubted, deg: what a change of velocity by 0.2 g
#: leaves in them where the heading is off by 10 deg.
DOUBTED_TILT = 2.0
#: A new witness begins so often, s, and so often where one knows enough; the record is gone over in
#: parts of the last.
TURN, RENEWED, HEARD = 60.0, 180.0, 20.0
#: Epochs over which the scatter of what a witness observes is judged, and fewest that tell.
JUDGED, FEWEST = 60, 8
#: So large an innovation counts no more.
CLIP = 3.0
#: Stamps are the same within this, s.
NEAR = 1e-6


@dataclass(frozen=True, eq=False)
class Evidence:
    """What one witness said.

    Attributes
    ----------
    since : float, s
        When it began.
    time : ndarray, (n,), s
        Seconds of the run, after `since`.
    difference : ndarray, (n,), deg
        Heading of the run less that of the witness.
    sd : ndarray, (n,), deg
        Standard deviation of the heading of the witness, times `scale`.
    scale : ndarray, (n,)
        By how much more its innovations scatter, and last, than it expected: 1 or more.
    covariance : ndarray, (n, 9, 9)
        As `NavigationRecord.covariance`, of the witness.
    kind : str
    """

    since: float
    time: Array
    difference: Array
    sd: Array
    scale: Array
    covariance: Array
    kind: str = "motion"


def hear_witnesses(made: Witnesses, record: NavigationRecord, enough: float) -> list[Evidence]:
    """Let witnesses go over a record, two at a time at most.

    A new one begins each minute, and each three minutes while one knows as much as is enough. The
    older of two is heard on until the younger knows that by itself, or knows it better.

    What was wrong with a run stays in what it believes of its sensors and of its tilt, long after
    its observations agree again. So once it was doubted, a new witness takes the sensors for what
    they were at its start.

    Parameters
    ----------
    made : Witnesses
    record : NavigationRecord
    enough : float, deg
        Standard deviation of a heading from which on older evidence is not needed: a third of the
        limit.

    Returns
    -------
    list of Evidence
        In the order of their begins.
    """
    end = float(made.time[-1])
    cuts = np.arange(made.begun, end, HEARD)
    seconds = np.arange(math.ceil(made.begun + NEAR), math.floor(end) + 1.0)
    places = np.clip(np.searchsorted(made.time, seconds - NEAR), 0, len(made.time) - 1)
    firsts = np.searchsorted(made.time, cuts + NEAR, side="right").tolist()
    begun = np.array([made.time[k - 1] if k else made.begun for k in firsts])
    wanted = np.unique(np.concatenate([begun, made.time[places]]))
    run = trajectory_at(record.trajectory, wanted, _ellipsoid(made.navigator))
    done: list[_Witness] = []
    heard: list[_Witness] = []
    told: list[_Witness] = []
    doubt = False
    for at, first, last in zip(begun.tolist(), firsts, [*firsts[1:], len(made.time)], strict=True):
        if len(heard) > 1 and heard[-1].sd <= enough:
            heard = heard[-1:]
        youngest = at - heard[-1].since if heard else math.inf
        if youngest >= (RENEWED if heard and heard[-1].sd <= enough else TURN) - HEARD / 2.0:
            if len(heard) > 1:
                heard = [min(heard, key=lambda one: one.sd)]
            if not doubt:
                said = [one.evidence() for one in told if one.marks]
                doubt = doubted(record, said, at, 3.0 * enough)
            fresh = _Witness(made, record, run, at, doubt)
            done.append(fresh)
            heard.append(fresh)
            told = list(heard)
        for one in heard:
            one.over(made.time[first:last], made.rows[first:last])
        heard = [one for one in heard if not one.lost]
    return [one.evidence() for one in done if one.marks]


class _Witness:
    """One witness on its way."""

    def __init__(
        self,
        made: Witnesses,
        record: NavigationRecord,
        run: pd.DataFrame,
        since: float,
        doubt: bool,
    ) -> None:
        self.navigator, self.run, self.since = made.navigator, run, since
        self.marks: list[Mark] = []
        self.times: list[Array] = []
        self.history: list[Array] = []
        self.seen: list[tuple[float, Array]] = []
        self.lost = False
        state = self.navigator.begin_from(_begin(self.navigator.filter, record, run, since, doubt))
        for aid in self.navigator.aids:
            assert isinstance(aid, Gnss)
            table = made.tables[aid.name]
            later = table[index_of(table) > since + aid.time_offset + aid.velocity_delay]
            if len(later):
                later.attrs = dict(table.attrs)
                state = self.navigator.tell(state, aid.name, later)
        self.state: NavigatorState = state

    @property
    def sd(self) -> float:
        """Standard deviation of the heading at the newest mark, deg, as it says itself."""
        if not self.marks:
            return math.inf
        return math.degrees(math.sqrt(max(float(self.marks[-1].covariance[8, 8]), 0.0)))

    def over(self, time: Array, rows: Array) -> None:
        """Go over steps; who is lost says nothing any more."""
        try:
            self.state, piece = self.navigator.advance(self.state, time, rows.copy())
        except (DivergenceError, DataError):
            self.lost = True
            return
        self._take(piece)

    def _take(self, piece: NavigationPiece) -> None:
        self.marks += piece.marks
        self.times.append(piece.time)
        self.history.append(piece.history)
        for one in piece.seen:
            # The vertical tells nothing of a heading.
            nu, s = one.innovations.nu[:2], one.innovations.s[:2]
            self.seen.append((one.time, nu / np.sqrt(s)))

    def evidence(self) -> Evidence:
        """What it said at each second."""
        marked = np.array([mark.time for mark in self.marks])
        seconds = np.arange(math.ceil(self.since + NEAR), math.floor(marked[-1]) + 1.0)
        at = np.searchsorted(marked, seconds + NEAR, side="right") - 1
        seconds, at = seconds[at >= 0], at[at >= 0]
        covariance = np.array([self.marks[k].covariance for k in at]).reshape(-1, 9, 9)
        times, rows = np.concatenate(self.times), np.concatenate(self.history)
        near = np.clip(np.searchsorted(times, seconds - NEAR), 0, len(times) - 1)
        near, back = np.unique(near, return_inverse=True)
        own = self.navigator.filter.mechanization.trajectory(times[near], rows[near], None)
        heading = self.run["heading"].to_numpy(dtype=np.float64)
        heading = heading[np.searchsorted(index_of(self.run), times[near] - NEAR)]
        apart = rotation.within_half_turn(heading - own["heading"].to_numpy(dtype=np.float64))[back]
        euler = own[EULER].to_numpy(dtype=np.float64)[back]
        scale = self._scale(seconds)
        sd = euler_sd(euler, covariance[:, 6:, 6:])[:, 2] if len(seconds) else seconds
        sd = np.hypot(scale * sd, LEAST_HEADING)
        return Evidence(self.since, seconds, apart, sd, scale, covariance)

    def _scale(self, seconds: Array) -> Array:
        """How much more than expected its newest innovations scatter and last."""
        if not self.seen:
            return np.ones(len(seconds))
        time = np.array([t for t, _ in self.seen])
        u = np.array([x for _, x in self.seen])
        # As many epochs are looked at as there are, up to a full window.
        size = np.minimum(u.shape[0], JUDGED)
        upto = np.searchsorted(time, seconds + NEAR, side="right")
        out = np.ones(len(seconds))
        full = upto >= size
        every = sliding_window_view(u, size, axis=0).reshape(len(u) - size + 1, -1)
        if size >= FEWEST:
            out[full] = _scatter(every)[upto[full] - size]
        for k in np.flatnonzero(~full & (upto >= FEWEST)).tolist():
            out[k] = _scatter(u[: upto[k]].reshape(1, -1))[0]
        return out


def _scatter(u: Array) -> Array:
    """Scatter of rows of normalised innovations, 1 or more; a few gross errors count little."""
    whole = np.sqrt(np.minimum(u * u, CLIP**2).mean(axis=1))
    middle = MAD_TO_SD * np.median(np.abs(u), axis=1)
    return np.asarray(np.maximum(1.0, np.maximum(whole, middle)))


def _begin(
    filter_: ErrorFilter, record: NavigationRecord, run: pd.DataFrame, at: float, doubt: bool
) -> FilterState:
    """State at an instant of a run, with a heading that is as good as unknown."""
    model = filter_.model
    row = run.iloc[int(np.searchsorted(index_of(run), at - NEAR))]
    lat, lon, alt = (float(row[c]) for c in GEODETIC)
    roll, pitch, heading = (float(row[c]) for c in EULER)
    start = replace(
        NavState.from_degrees(
            lat,
            lon,
            alt,
            v_n=row[VELOCITY].to_numpy(dtype=np.float64),
            roll_deg=roll,
            pitch_deg=pitch,
            heading_deg=heading,
        ),
        time=at,
    )
    marks = record.sd.index.to_numpy(dtype=np.float64)
    k = max(int(np.searchsorted(marks, at + NEAR, side="right")) - 1, 0)
    P = LOOSER**2 * record.covariance[k]
    P[8, :8] = P[:8, 8] = 0.0
    P[8, 8] = max(math.radians(UNKNOWN) ** 2, float(P[8, 8]))
    tilt = DOUBTED_TILT if doubt else LEAST_TILT
    P = P + np.diag(
        np.square(
            np.repeat([LEAST_PLACE, LEAST_VELOCITY, math.radians(tilt)], 3)
            * np.array([1.0] * 8 + [0.0])
        )
    )
    names = list(model.layout.labels())[9:]
    k = 0 if doubt else k
    sd = LOOSER * record.sensors_sd[names].iloc[k].to_numpy(dtype=np.float64)
    whole = np.diag(np.concatenate([np.zeros(9), np.square(sd)]))
    whole[:9, :9] = P
    told = record.sensors[names].iloc[k].to_numpy(dtype=np.float64)
    return replace(filter_.begin(start, whole), sensors=told)


def _ellipsoid(navigator: Navigator) -> Ellipsoid:
    return find_ellipsoid(navigator.filter.mechanization.ellipsoid)
