"""Gate of arriving samples: stamps far ahead wait for confirmation.

A sample whose stamp is a gap away from the one before is held: one wrong stamp must not refuse the
right ones. Once `confirm` held samples follow one another, the gap is real: they are used, wrong
ones among them dropped. A sample that continues where the others were contradicts all held
samples. The decision depends on the stamps alone, so that it repeats with the samples.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

T = TypeVar("T")

#: A longer step is not a step of a sensor: held samples further apart do not confirm each other, s.
COHERENT = 10.0
#: Samples that give the usual step, as in `navigation.preprocessing`, and its share of them.
FIRST, SHARE = 64, 0.95
#: Most samples that are held, as a multiple of those that confirm.
HELD = 4
#: Stamps are rounded: a step of exactly the limit is not a gap.
ROUNDED = 1.01


@dataclass(frozen=True, eq=False)
class _Held(Generic[T]):
    """Held sample, the one that it follows, and its number in that row."""

    time: float
    item: T
    before: _Held[T] | None
    number: int


class StampGate(Generic[T]):
    """Hold samples after a gap until others confirm it.

    `confirm`: samples in a row that confirm a new time, and the begin of a run. `gap`: a step of
    more than this multiple of the usual one is a gap. `newest` (s): stamp of the newest sample that
    passed; -inf before the first. `dropped`: stamps and items that were contradicted by the last
    call.
    """

    def __init__(self, confirm: int, gap: float) -> None:
        self._confirm, self._gap = confirm, gap
        self.newest = -math.inf
        self.dropped: list[tuple[float, T]] = []
        self._held: list[_Held[T]] = []
        self._steps: list[float] = []
        self._limit, self._known = 0.0, False

    @property
    def holding(self) -> bool:
        """Whether samples are held."""
        return bool(self._held)

    def take(self, time: float, item: T) -> list[tuple[float, T]]:
        """Take a sample later than `newest`; return those that can be used now, in order."""
        self.dropped = []
        if time - self.newest <= self._limit:
            if self._held:
                self._drop(self._held)
            return self._pass([(time, item)])
        before = [one for one in self._held if 0.0 < time - one.time <= COHERENT]
        last = max(before, key=lambda one: (one.number, one.time), default=None)
        new = _Held(time, item, last, 1 if last is None else last.number + 1)
        self._held.append(new)
        if new.number >= self._confirm:
            return self._pass(self._chain(new))
        if len(self._held) > HELD * self._confirm:
            self._drop(self._held[:1])
        return []

    def finish(self) -> list[tuple[float, T]]:
        """Return the samples of a run that ends before its begin is confirmed; drop others."""
        self.dropped = []
        if self.newest == -math.inf and self._held:
            return self._pass(self._chain(max(self._held, key=lambda one: one.number)))
        self._drop(self._held)
        return []

    def restart(self, time: float) -> None:
        """Continue from a stamp of a clock that was reset."""
        self._drop(self._held)
        self.newest = time

    def _chain(self, last: _Held[T]) -> list[tuple[float, T]]:
        """Take the samples that follow one another to the last one, and drop the others."""
        chain: list[_Held[T]] = []
        one: _Held[T] | None = last
        while one is not None:
            chain.append(one)
            one = one.before
        self._drop([one for one in self._held if one not in chain])
        self._held = []
        # These steps are the usual ones from here on.
        self._steps, self._known = [], False
        return [(one.time, one.item) for one in reversed(chain)]

    def _drop(self, held: list[_Held[T]]) -> None:
        self.dropped += [(one.time, one.item) for one in held]
        self._held = [one for one in self._held if one not in held]

    def _pass(self, items: list[tuple[float, T]]) -> list[tuple[float, T]]:
        for k, (time, _) in enumerate(items):
            # Not the step over the gap.
            if k or len(items) == 1:
                self._learn(time - self.newest)
            self.newest = time
        return items

    def _learn(self, step: float) -> None:
        self._steps.append(step)
        if not self._known or len(self._steps) == FIRST:
            usual = float(np.quantile(self._steps, SHARE, method="lower"))
            self._limit = self._gap * ROUNDED * usual
        if len(self._steps) == FIRST:
            self._steps, self._known = [], True
