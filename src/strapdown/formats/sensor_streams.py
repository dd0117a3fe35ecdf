"""Sensors of a phone as they arrive, each with its own stamps, joined on those of the gyro.

What `join` does of whole tables, for samples one by one: accelerometer and magnetometer are
interpolated linearly to the stamps of the gyro, without extrapolation, and linear acceleration and
gravity are added. A gyro sample waits until the samples around its stamp have arrived, at most
`WAIT` by the stamps. All decisions depend on the stamps and on the order of arrival alone: the
samples of a journal, in that order, give the same numbers.
"""

from __future__ import annotations

import heapq
import math
from collections import Counter, deque
from typing import NamedTuple

from strapdown.formats.clocks import EPOCH
from strapdown.formats.stamp_gate import StampGate

#: Kinds of events, and their numbers of values: rad/s; m/s² with gravity, without it, and gravity
#: alone, of the sign of specific force; µT; latitude and longitude (deg), height over the ellipsoid
#: (m), speed and its standard deviation (m/s), course (deg), horizontal and vertical accuracy (m),
#: NaN where unknown; hPa.
GYRO, ACCEL, LINEAR, GRAVITY, MAG, FIX, PRESSURE = range(7)
WIDTHS = (3, 3, 3, 3, 3, 8, 1)

#: Longest wait for another sensor, by the stamps, ns.
WAIT = 500_000_000
#: Samples in a row that confirm a gap, or a clock that went back; and a step that is a gap, as a
#: multiple of the usual one: phones write their samples in bursts.
CONFIRM, GAP = 10, 5.0
#: A clock went back if in-order stamps are so far behind, or older ones last so long, ns. Messages
#: that overtake one another are late by less.
BACK, OLDER = 10_000_000_000, 2_000_000_000
#: Stamps of a sensor by which repeated samples are known.
KNOWN = 512
_NS = 1_000_000_000
#: The year 2255, ns, and beyond any sensor: rad/s, m/s², µT; deg, deg, m; hPa; anything else.
LATEST = 9 * 10**18
LIMITS = ((1e4,), (1e6,), (1e6,), (1e6,), (1e6,), (90.0, 360.0, 1e8), (1e6,))
MOST = 1e9


class Event(NamedTuple):
    """One sample of one sensor.

    `stamp` (ns): by the clock of the device. `values`: as many as `WIDTHS` says, axes of the
    device.
    """

    kind: int
    stamp: int
    values: tuple[float, ...]


class Joined(NamedTuple):
    """Sample of all inertial sensors at a stamp of the gyro.

    `time` (s): from `SensorStreams.epoch`. `gyro`, `accel`: rad/s and m/s², axes of the device.
    `mag`: µT; None where there is none.
    """

    time: float
    gyro: tuple[float, ...]
    accel: tuple[float, ...]
    mag: tuple[float, ...] | None


class Located(NamedTuple):
    """Fix of the device; `time` (s) as in `Joined`, values as in an event."""

    time: float
    values: tuple[float, ...]


Vector = tuple[float, ...]


class _Track:
    """Newest samples of one sensor, to be interpolated."""

    def __init__(self) -> None:
        self._samples: deque[tuple[int, Vector]] = deque()

    def append(self, stamp: int, values: Vector) -> None:
        self._samples.append((stamp, values))

    @property
    def seen(self) -> bool:
        return bool(self._samples)

    def covers(self, stamp: int) -> bool:
        """Whether no sample that is still to come changes the value at a stamp."""
        return bool(self._samples) and self._samples[-1][0] >= stamp

    def at(self, stamp: int, origin: int) -> Vector | None:
        """Return the value at a stamp that is covered; None before the first sample.

        Stamps only grow: what is before the last one is forgotten. Seconds count from `origin`, as
        those of `join`, so that the last bits are the same.
        """
        samples = self._samples
        while len(samples) > 1 and samples[1][0] <= stamp:
            samples.popleft()
        first, before = samples[0]
        if first == stamp:
            return before
        if first > stamp:
            return None
        second, after = samples[1]
        begin = (first - origin) * 1e-9
        step, since = (second - origin) * 1e-9 - begin, (stamp - origin) * 1e-9 - begin
        return tuple((b - a) / step * since + a for a, b in zip(before, after, strict=True))


class SensorStreams:
    """Join the sensors of one device as their samples arrive.

    `hold` (s): by how much samples of a sensor may be late; each waits so long, by the stamps.
    `epoch` (s): origin of `Joined.time`, on the clock of the device; None before the first sample.
    `unused`: events that were not used, by reason. `went_back`: whether the clock of the device was
    set back: what follows belongs to another session.
    """

    def __init__(self, hold: float = 0.0) -> None:
        self.epoch: int | None = None
        self.unused: Counter[str] = Counter()
        self.went_back = False
        self._hold = round(hold * _NS)
        self._held: list[list[tuple[int, int, Event]]] = [[] for _ in WIDTHS]
        self._count = 0
        self._base = 0
        self._gates: list[StampGate[Event]] = [StampGate(CONFIRM, GAP) for _ in WIDTHS]
        self._newest: list[int | None] = [None] * len(WIDTHS)
        self._known: list[tuple[deque[int], set[int]]] = [(deque(), set()) for _ in WIDTHS]
        self._behind: list[tuple[int, int, int]] = [(0, 0, 0)] * len(WIDTHS)
        self._gyro: deque[tuple[int, Vector]] = deque()
        self._tracks = {kind: _Track() for kind in (ACCEL, LINEAR, GRAVITY, MAG)}
        self._linear: deque[tuple[int, Vector]] = deque()
        self._summed = _Track()
        self._has_mag = self._joined = False
        #: First stamps of the gyro and of the linear acceleration.
        self._first = self._first_linear = 0

    def take(self, event: Event) -> list[Joined | Located]:
        """Take an event; return the samples and fixes that are complete by it, in order."""
        if not self._count:
            self._base = event.stamp
        self._count += 1
        self._has_mag |= event.kind == MAG
        if self._is_repeated(event):
            self.unused["repeated"] += 1
            return []
        if not self._hold:
            return self._in_order(event)
        held = self._held[event.kind]
        heapq.heappush(held, (event.stamp, self._count, event))
        newest = max(event.stamp, max(one[0] for one in held))
        out: list[Joined | Located] = []
        while held and held[0][0] <= newest - self._hold:
            out += self._in_order(heapq.heappop(held)[2])
        return out

    def finish(self) -> list[Joined | Located]:
        """Return what waits, as far as it is complete."""
        out: list[Joined | Located] = []
        held = sorted(one for kind in self._held for one in kind)
        for _, _, event in held:
            out += self._in_order(event)
        self._held = [[] for _ in WIDTHS]
        for kind, gate in enumerate(self._gates):
            for _, event in gate.finish():
                self._accept(kind, event.stamp, event.values)
            self.unused["stamp not confirmed"] += len(gate.dropped)
        out += self._released(last=True)
        self.unused = +self.unused
        return out

    def _is_repeated(self, event: Event) -> bool:
        order, known = self._known[event.kind]
        if event.stamp in known:
            return True
        order.append(event.stamp)
        known.add(event.stamp)
        if len(order) > KNOWN:
            known.discard(order.popleft())
        return False

    def _in_order(self, event: Event) -> list[Joined | Located]:
        """Use an event that is later than those of its sensor before."""
        kind, stamp, values = event
        newest = self._newest[kind]
        if newest is not None and stamp <= newest:
            self.unused["late"] += 1
            self._note_behind(kind, stamp, newest)
            return []
        self._behind[kind] = (0, 0, 0)
        if kind in (FIX, PRESSURE):
            self._newest[kind] = stamp
            return self._located(stamp, values) if kind == FIX else []
        gate = self._gates[kind]
        passed = gate.take((stamp - self._base) * 1e-9, event)
        self.unused["stamp not confirmed"] += len(gate.dropped)
        for _, one in passed:
            self._newest[kind] = one.stamp
            self._accept(kind, one.stamp, one.values)
        return self._released() if passed else []

    def _note_behind(self, kind: int, stamp: int, newest: int) -> None:
        count, first, last = self._behind[kind]
        count, first = (count + 1, first) if count and stamp > last else (1, stamp)
        self._behind[kind] = (count, first, stamp)
        far = newest - stamp > BACK or stamp - first > OLDER
        self.went_back |= count >= CONFIRM and far

    def _accept(self, kind: int, stamp: int, values: Vector) -> None:
        if kind == GYRO:
            if self.epoch is None:
                self.epoch = stamp // _NS if abs(stamp) > EPOCH * _NS else 0
                self._first = stamp
            self._gyro.append((stamp, values))
        elif kind == LINEAR:
            self._first_linear = self._first_linear or stamp
            self._linear.append((stamp, values))
        else:
            self._tracks[kind].append(stamp, values)
        if kind in (LINEAR, GRAVITY):
            self._sum()

    def _sum(self) -> None:
        """Add gravity to linear accelerations, at their stamps."""
        gravity = self._tracks[GRAVITY]
        while self._linear and gravity.covers(self._linear[0][0]):
            stamp, linear = self._linear.popleft()
            if (down := gravity.at(stamp, self._first_linear)) is None:
                self.unused["without the other sensors"] += 1
                continue
            self._summed.append(stamp, tuple(a + b for a, b in zip(linear, down, strict=True)))
        while self._linear and self._linear[-1][0] - self._linear[0][0] > WAIT:
            self._linear.popleft()
            self.unused["without the other sensors"] += 1

    def _released(self, last: bool = False) -> list[Joined | Located]:
        """Return gyro samples whose other sensors have arrived, or have kept them waiting.

        `last`: no more samples arrive.
        """
        out: list[Joined | Located] = []
        accel = self._tracks[ACCEL]
        force_of = accel if accel.seen else self._summed
        mag = self._tracks[MAG]
        while self._gyro:
            stamp, rate = self._gyro[0]
            overdue = last or self._gyro[-1][0] - stamp > WAIT
            if not force_of.covers(stamp):
                if not overdue:
                    break
                force = None
            else:
                force = force_of.at(stamp, self._first)
            if force is None:
                self._gyro.popleft()
                self.unused["without the other sensors"] += 1
                continue
            if self._has_mag and not mag.covers(stamp) and not overdue:
                break
            self._gyro.popleft()
            field = mag.at(stamp, self._first) if mag.covers(stamp) else None
            if field is None and mag.covers(stamp) and not self._joined:
                # As `join` leaves out what another sensor does not cover.
                self.unused["without the other sensors"] += 1
                continue
            self._joined = True
            out.append(Joined(self._time(stamp), rate, force, field))
        return out

    def _located(self, stamp: int, values: Vector) -> list[Joined | Located]:
        if self.epoch is None:
            self.unused["fix before the first sample"] += 1
            return []
        return [Located(self._time(stamp), values)]

    def _time(self, stamp: int) -> float:
        assert self.epoch is not None
        return (stamp - self.epoch * _NS) * 1e-9


def is_event(kind: int, stamp: int, values: tuple[float, ...]) -> bool:
    """Whether numbers can be those of an event: as many as it has, none beyond its sensor."""
    if len(values) != WIDTHS[kind] or not -LATEST < stamp < LATEST:
        return False
    needed = 3 if kind == FIX else len(values)
    limits = LIMITS[kind]
    return all(
        abs(value) <= limits[min(k, len(limits) - 1)] for k, value in enumerate(values[:needed])
    ) and not any(math.isinf(value) or abs(value) > MOST for value in values[needed:])
