"""Contact of an event: onset and end with their uncertainty, and the change beyond the record."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np

from strapdown.crash.acceleration import Acceleration
from strapdown.crash.delta_v import VelocityCourse
from strapdown.crash.events import CrashEvent, EventRule, two_sds
from strapdown.tables.checks import Array

# The allowance, as a share of the mean acceleration that opens an event (11 m/s² by the
# regulation): 1.1 m/s², above what tire forces change by within a contact's rise.
ALLOWANCE = 0.1
# The allowance is so large that noise moves an edge by a fraction of this time.
RESOLUTION = 0.005  # s
# Scale of a normal distribution from its median absolute deviation.
OF_MEDIAN = 1.4826
# A swing of 30 Hz passes within this time; tires build up no more than a tenth of their force.
SETTLING = 0.03  # s
# Any finite change of velocity, m/s.
UNLIMITED = 1e300


@dataclass(frozen=True, eq=False)
class Edge:
    """Onset or end of a contact.

    `time`, `sd`, s. `rate`, (3,), m/s²: acceleration about the edge: change of delta-V per error of
    `time`. `force`, (3,): unit vector, horizontal, along which the velocity changes. `missing`,
    m/s: change of velocity along `force` that may lie outside the record: zero where the record
    reaches the edge, infinite where the record does not limit that.
    """

    time: float
    sd: float
    rate: Array = field(repr=False)
    force: Array = field(repr=False)
    missing: float = 0.0


@dataclass(frozen=True, eq=False)
class Contact:
    """Contact of one event, over which its delta-V is integrated.

    The regulation's time zero, which a recorder states, is that of the `CrashEvent`; it lies up to
    20 ms before the onset, and in a side impact up to 16 ms after it.
    """

    start: Edge
    end: Edge

    @property
    def moved(self) -> Array:
        """Effects on delta-V, (2, 3), m/s, of one standard deviation of onset and end."""
        return np.array([e.sd * e.rate for e in (self.start, self.end)])

    def beyond(self, bound: float) -> tuple[str, ...]:
        """Sides, ``before`` and ``after``, on which more may be missing than a bound, m/s.

        With an infinite bound: sides on which nothing in the record limits what is missing.
        """
        sides = (("before", self.start), ("after", self.end))
        return tuple(n for n, e in sides if e.missing > min(bound, UNLIMITED))

    def at_ends(self, beyond: Collection[str] = ()) -> Array:
        """`moved`, and what may be missing on the sides that are not `beyond` the bound."""
        sides = (("before", self.start), ("after", self.end))
        missing = [e.missing * e.force for name, e in sides if name not in beyond]
        return np.vstack([self.moved, *missing])


def find_contact(
    acceleration: Acceleration,
    event: CrashEvent,
    rule: EventRule,
    *,
    noise: float | Sequence[float] = 0.0,
    between: tuple[float, float] = (-math.inf, math.inf),
) -> Contact:
    """Find the onset and the end of the contact of an event.

    Parameters
    ----------
    acceleration : Acceleration
        In the frame ``body`` or ``impact``, as for the event.
    noise : float or (3,), m/s²
        Standard deviation of the white noise of a sample.
    between : (float, float), s
        End of the preceding event, and beginning of the next.

    Notes
    -----
    Cumulative sum of Page (Biometrika 41, 1954), backward from the instant at which the wake
    threshold was reached, and forward from the peak. With e, the acceleration along the force less
    its median before (after) the event, and an allowance nu, the edge is where the integral of
    ``e - nu`` is largest. White noise of density N = sigma² h moves it by about N / nu²; nu is at
    least ``2 sqrt(N / 5 ms)``.

    With the time t in which the acceleration grows from nu to 4 nu, a parabola exceeds nu late by
    t, a straight rise by t / 3 and a step, with t zero, not at all. The edge is put into the middle
    of parabola and straight rise, 2 t / 3 outward, with half their distance as its standard
    deviation. The velocity gained below nu is nu t / 3 or nu t / 6, within its effect.

    Where the velocity swings on after the contact, its end is the first instant from there at which
    the velocity has its mean over the next 30 ms, less the level.

    A record that ends before the contact misses at most what follows if the acceleration continues
    to decay as it has since its peak, exponentially: the last mean over 20 ms times its time
    constant. Means over 20 ms do not contain ringing, which therefore does not count. A record
    that begins within the contact likewise, with means over 5 ms.
    """
    sds = two_sds(noise, "noise")
    back, on = event.woken - rule.wake_window, min(event.end, acceleration.end)
    low = max(acceleration.begin, between[0], back - rule.trigger_window)
    high = min(acceleration.end, between[1], on + rule.trigger_window)
    peak = min(max(event.peak_time, event.woken), on)
    course = VelocityCourse(acceleration)
    struck = max(event.trigger, event.woken)
    return Contact(
        _edge(acceleration, course, -1.0, (event.woken, back, low, peak), (low, struck), rule, sds),
        _edge(acceleration, course, 1.0, (peak, on, high, peak), (event.woken, on), rule, sds),
    )


def _edge(
    acceleration: Acceleration,
    course: VelocityCourse,
    sign: float,
    places: tuple[float, float, float, float],
    over: tuple[float, float],
    rule: EventRule,
    noise: tuple[float, float],
) -> Edge:
    """Onset (sign -1) or end (1), from an instant within the contact to a far one.

    `places`, s: that instant, where quiet begins, the far one, the peak; `over`, s: the change of
    velocity between these gives the direction of the force.
    """
    near, quiet, far, peak = places
    # Unit vector, horizontal, of the change of velocity between two instants, (3,).
    start, end = course.velocity(np.array(over))
    change = end - start
    change[2] = 0.0
    size = float(np.sqrt(change @ change))
    force = np.asarray(change / size) if size > 0.0 else np.array([1.0, 0.0, 0.0])
    stamps = acceleration.time
    mean = acceleration.sampling == "mean"
    step = float(np.median(np.diff(stamps)))
    # The level beside the contact: of braking, sliding, a slope, a bias.
    beside = acceleration.values[(stamps >= min(quiet, far)) & (stamps <= max(quiet, far))]
    level = np.zeros(3)
    sigma = math.hypot(force[0] * noise[0], force[1] * noise[1])
    if len(beside) * step >= rule.wake_window:
        level = np.median(beside, axis=0)
        # Differences leave out what changes slowly, as sliding does.
        steps = np.abs(np.diff(beside @ force))
        sigma = max(sigma, OF_MEDIAN * float(np.median(steps)) / math.sqrt(2.0))
    density = sigma * sigma * step
    least = ALLOWANCE * rule.wake / rule.wake_window
    nu = max(least, 2.0 * math.sqrt(density / RESOLUTION))
    level_along = float(level @ force)
    if sign > 0.0 and level_along < 0.0:
        # Tire forces against the change take a tenth of a second to build up after the contact:
        # it ends where its own force does.
        level_along, level = 0.0, np.zeros(3)

    inner = stamps[(stamps > min(near, far)) & (stamps < max(near, far))]
    at = np.concatenate([[near], inner[:: int(sign)], [far]])
    gained = sign * (course.velocity(at) - course.velocity(np.array([near]))) @ force
    excess = gained - (level_along + nu) * np.abs(at - near)
    # The farthest of equals: a record may end at the peak itself.
    k = len(at) - 1 - int(np.argmax(excess[::-1]))
    rates = course.rate(at) @ force - level_along
    edge = float(at[k])
    if not mean and 0 < k < len(at) - 1:
        # Between the stamps the line of the acceleration crosses the allowance.
        other = k + 1 if rates[k] > nu else k - 1
        if (rates[other] - nu) * (rates[k] - nu) < 0.0:
            part = (rates[k] - nu) / (rates[k] - rates[other])
            edge += part * float(at[other] - at[k])
    strong = np.flatnonzero(rates[: k + 1] >= 4.0 * nu)
    late = abs(edge - float(at[strong[-1]])) if strong.size else abs(edge - near)
    cut = far in (acceleration.begin, acceleration.end)
    missing = 0.0
    if cut and k == len(at) - 1:
        window = rule.wake_window if sign > 0.0 else rule.lateral_window
        missing = _missing(course, stamps, (peak, far), sign * window, force)
    spread = math.hypot(late / 3.0, density / nu**2, step / math.sqrt(12.0))
    moved = edge + sign * 2.0 / 3.0 * late
    moved = min(moved, far) if sign > 0.0 else max(moved, far)
    if sign > 0.0 and far - moved >= 0.5 * SETTLING:
        swings = moved, min(moved + SETTLING, far)
        moved = _settled(course, stamps, swings, force, (level_along, nu))
    return Edge(float(moved), spread, level + nu * force, force, missing)


def _settled(
    course: VelocityCourse,
    stamps: Array,
    span: tuple[float, float],
    force: Array,
    beside: tuple[float, float],
) -> float:
    """Instant within a span from the end of a contact on at which the velocity has its mean of it.

    `beside`: the level after the contact and the allowance. The cumulative sum ends where the
    velocity is largest: in structure that rings, at a crest.
    """
    end, length = span[0], span[1] - span[0]
    level, nu = beside
    at = np.concatenate([[end], stamps[(stamps > end) & (stamps < end + length)], [end + length]])
    gained = (course.velocity(at) - course.velocity(at[:1])) @ force - level * (at - end)
    mean = float(np.trapezoid(gained, at)) / length
    if abs(mean) <= 0.5 * nu * length:
        return end
    k = int(np.argmax(gained / mean >= 1.0))
    part = (mean - gained[k - 1]) / (gained[k] - gained[k - 1])
    return float(at[k - 1] + part * (at[k] - at[k - 1]))


def _missing(
    course: VelocityCourse,
    stamps: Array,
    span: tuple[float, float],
    window: float,
    force: Array,
) -> float:
    """Change of velocity beyond the end of a record if the decay since the peak continues, m/s.

    With a negative window, beyond its beginning, if the rise to the peak is the decay reversed.
    """
    peak, far = span
    at = np.append(stamps[(stamps >= min(peak, far)) & (stamps <= max(peak, far))], far)
    inward = np.clip(at - window, stamps[0], stamps[-1])
    # Nothing lies inward of a peak at the other end of the record.
    at, inward = at[at != inward], inward[at != inward]
    means = (course.velocity(at) - course.velocity(inward)) @ force / (at - inward)
    last, most = float(means[-1]), int(np.argmax(means))
    if last <= 0.0:
        return 0.0
    if means[most] <= last:
        return math.inf
    return last * abs(far - float(at[most])) / math.log(float(means[most]) / last)
