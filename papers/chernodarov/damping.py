"""What the covariance of an alignment says of the errors of the hour after it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from papers.chernodarov.bench import (
    ELLIPSOID,
    END,
    EVERY,
    FINE_END,
    HEADING_DEG,
    SENSOR,
    SITE,
    UNCERTAINTY,
    Bench,
    Course,
    after,
    align,
    autonomous_filter,
    go,
    wander,
)
from papers.reproduction import (
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Evidence,
    Figure,
    FigurePanel,
    Statement,
    Table,
    Trace,
    amount,
)
from strapdown.alignment import FineResult
from strapdown.earth import radii_of_curvature
from strapdown.estimation import (
    COVARIANCES,
    PHYSICAL,
    ErrorFilter,
    RotationVectorModel,
    gyro_misalignment,
    gyro_scale,
)
from strapdown.increments import motion_increments
from strapdown.navigation import Navigator, OpenLoop
from strapdown.simulation import Origin, PathMotion, Track, simulate_imu

Array = NDArray[np.float64]

#: Estimates taken off; left on; taken off, and errors taken as independent of each other.
KINDS = ("damped", "undamped", "independent")
PREDICTED_EVERY = 10.0  # s
# Attitude and force by their means, s: the table turns by a few degrees in it at most.
STEP = 0.5


@dataclass(frozen=True, eq=False)
class Predicted:
    """Standard deviations, north and east together: the root of the sum of the variances.

    Attributes
    ----------
    time : ndarray, (n,), s
    speed : ndarray, (n,), m/s
    place : ndarray, (n,), m
    last : ndarray, (p, p)
        Covariance of the physical errors at the end, level axes.
    """

    time: Array
    speed: Array
    place: Array
    last: Array


def covariance_after(fine: FineResult, kind: str = "damped") -> Array:
    """Return the covariance of the physical errors at the end of an alignment.

    What is estimated and what its estimate is off by are independent of each other. So errors of
    sensors that are left as they are have the covariance of what is off, and that of the estimate
    besides: what was known before less what is not known after.

    Parameters
    ----------
    fine : FineResult
    kind : str
        Of `KINDS`.

    Returns
    -------
    ndarray, (15, 15)
        North-east-down; the biases in body axes.
    """
    filter_, state = fine.filter, fine.state
    level = filter_.mechanization.level_from_ned(state.row)
    turn = np.eye(filter_.model.physical_size)
    for at in (0, 3, 6):
        turn[at : at + 3, at : at + 3] = level.T
    P = np.asarray(turn @ filter_.physical_covariance(state) @ turn.T)
    if kind == "independent":
        return np.diag(np.diagonal(P))
    if kind == "undamped":
        stacked = filter_.model.stacked
        since = state.time - float(fine.history.index[0])
        before = np.diag(np.square(stacked.sd) + np.square(stacked.drive) * since)
        P[PHYSICAL:, PHYSICAL:] = before
    return P


def predict(fine: FineResult, increments: pd.DataFrame, kind: str) -> Predicted:
    """Take the covariance at the end of an alignment over the record after it.

    Parameters
    ----------
    fine : FineResult
    increments : DataFrame
    kind : str
        Of `KINDS`.

    Returns
    -------
    Predicted
        Scale factors and misalignments of the gyros are in it, which a rest does not show and a
        turn does.
    """
    P = covariance_after(fine, kind)
    gyro = UNCERTAINTY.gyro
    model = RotationVectorModel(
        fine.filter.model.gyro_noise,
        fine.filter.model.accel_noise,
        (
            *fine.filter.model.sensors,
            gyro_scale(gyro.axis("scale")),
            gyro_misalignment(max(gyro.axis("misalignment"))),
        ),
    )
    whole = np.zeros((model.physical_size,) * 2)
    whole[: len(P), : len(P)] = P
    more = slice(len(P), None)
    whole[more, more] = np.diag(np.square(model.stacked.sd[len(P) - PHYSICAL :]))
    used = ErrorFilter(wander("held"), model, COVARIANCES["joseph"](), step=STEP)
    start = fine.filter.mechanization.nav_state(fine.state.mechanization, fine.state.time)
    state = used.begin(start, whole)
    ends, rows = after(increments, state.time)
    rows = fine.filter.compensated(fine.state, rows)
    every = max(1, round(PREDICTED_EVERY / float(np.median(np.diff(ends)))))
    found = []
    for k in range(0, len(ends) - every + 1, every):
        state, _ = used.predict(state, ends[k : k + every], rows[k : k + every])
        variance = np.diagonal(used.physical_covariance(state))
        found.append((state.time, variance[3] + variance[4], variance[0] + variance[1]))
    time, speed, place = np.array(found).T
    return Predicted(time, np.sqrt(speed), np.sqrt(place), used.physical_covariance(state))


# ==================================================================================================
# Many units on the bench, half of their runs with the table turned after the alignment
# ==================================================================================================

COUNT = 24
FIRST = 100  # seed of the first
# Of a body that rests, or turns about one axis, means hold everything.
RATE = 10.0  # Hz
TURN_DEG, RAMP, STEADY = 180.0, 5.0, 10.0


@dataclass(frozen=True, eq=False)
class Kept:
    """Runs of one kind: the table still, or turned.

    Attributes
    ----------
    damped, undamped : tuple of Course
        One a unit.
    predicted : dict of Predicted
        By kind, from the alignment of the first unit.
    """

    damped: tuple[Course, ...]
    undamped: tuple[Course, ...]
    predicted: dict[str, Predicted]

    def rms(self, which: str, quantity: str) -> Array:
        """Root of the mean over units of the square of Delta V or Delta S, by time, (n,)."""
        courses = self.damped if which == "damped" else self.undamped
        values = np.array([getattr(c, quantity) for c in courses])
        return np.asarray(np.sqrt(np.square(values).mean(axis=0)))

    @property
    def time(self) -> Array:
        """Times of the courses, s."""
        return self.damped[0].time


@dataclass(frozen=True, eq=False)
class Units:
    """Both kinds.

    Attributes
    ----------
    still, turned : Kept
    forward_apart : float, m/s
        Largest difference of the velocities of the first unit at rest, with its estimates fed
        back, and with the mechanization free and the errors that (6) predicts taken off.
    """

    still: Kept
    turned: Kept
    forward_apart: float


def table_motion(turned: bool) -> PathMotion:
    """Return the table: at rest, and after the alignment turned by half a turn or not."""
    rate = TURN_DEG / (RAMP + STEADY)
    times = (0.0, FINE_END, FINE_END + RAMP, FINE_END + RAMP + STEADY)
    track = Track((*times, times[-1] + RAMP), (0.0, 0.0, rate, rate, 0.0))
    return PathMotion(
        END,
        Origin(SITE.lat_deg, SITE.lon_deg, SITE.alt),
        heading_deg=HEADING_DEG,
        turn_rate=track if turned else Track((0.0,), (0.0,)),
        ellipsoid=ELLIPSOID,
    )


def units(count: int = COUNT) -> Units:
    """Align each unit, and let it navigate for an hour in four ways.

    Parameters
    ----------
    count : int

    Returns
    -------
    Units
    """
    motions = [table_motion(turned) for turned in (False, True)]
    courses: list[tuple[list[Course], list[Course]]] = [([], []), ([], [])]
    predicted: list[dict[str, Predicted]] = [{}, {}]
    for seed in range(FIRST, FIRST + count):
        errors = SENSOR.draw(seed)
        for k, motion in enumerate(motions):
            imu, _ = simulate_imu(motion, errors, rate=RATE, sampling="mean", seed=seed)
            increments = motion_increments(imu, interpolation="cubic")
            if k == 0:
                fine = align(imu)
                off = replace(fine.state, sensors=np.zeros_like(fine.state.sensors))
                used = autonomous_filter(fine)
            for state, into in zip((fine.state, off), courses[k], strict=True):
                into.append(go(used, state, increments))
            if not predicted[k]:
                if k == 0:
                    forward = fed_forward(fine, increments)
                    apart = forward - courses[0][0][0].velocity
                predicted[k] = {kind: predict(fine, increments, kind) for kind in KINDS}
    kept = [Kept(tuple(c[0]), tuple(c[1]), p) for c, p in zip(courses, predicted, strict=True)]
    return Units(kept[0], kept[1], float(np.linalg.norm(apart, axis=1).max()))


def fed_forward(fine: FineResult, increments: pd.DataFrame) -> Array:
    """Return the velocity north and east with estimates taken off what is shown, (n, 2), m/s."""
    used = autonomous_filter(fine)
    navigator = Navigator(used, damping=OpenLoop())
    ends, rows = after(increments, fine.state.time)
    _, piece = navigator.advance(navigator.begin_from(fine.state), ends, rows)
    path = used.mechanization.trajectory(piece.time, piece.history)
    every = round(RATE * EVERY)
    return path[["VN", "VE"]].to_numpy()[every - 1 :: every]


# ==================================================================================================
# Figs. 8 to 11: an hour without aids, sensor drifts damped and not
# ==================================================================================================

#: After the alignment, s.
TIMES = (60.0, 300.0, 1200.0, 3590.0)
QUANTITIES = {"speed": "ΔV, m/s", "circular": "ΔS, m"}
OF_PREDICTED = {"speed": "speed", "circular": "place"}
# Two roots of means over 24 units, of errors along two axes, differ by chance by a fifth at most.
AGREES = 1.4
# A gain below it is none.
GAIN = 1.2
CHOSEN = (
    f"Curves: unit 1 on the bench, and the root mean square of {COUNT} other units; the FOG-1000 "
    "class of the catalogue. The paper does not say how long it navigated; an hour here. Height "
    "held. Damped: the estimates of the alignment are taken off the sensors; not damped: they are "
    "not, and the attitude is the same."
)


def schuler(lat_deg: float = SITE.lat_deg) -> float:
    """Schuler's period, s."""
    from strapdown.earth import gravity

    meridian, _ = radii_of_curvature(lat_deg, ellipsoid=ELLIPSOID)
    down = float(np.linalg.norm(gravity(lat_deg, SITE.alt, ellipsoid=ELLIPSOID)))
    return 2.0 * math.pi * math.sqrt((float(meridian) + SITE.alt) / down)


def figures(made: Bench, many: Units) -> list[Figure]:
    """Return Figs. 8 to 11, and what comes of them where the table turns."""
    out = []
    for slug, which, quantity in (
        ("fig8", "damped", "speed"),
        ("fig9", "undamped", "speed"),
        ("fig10", "damped", "circular"),
        ("fig11", "undamped", "circular"),
    ):
        course = getattr(made, which)
        word = "damped" if which == "damped" else "not damped"
        what = "ground velocity" if quantity == "speed" else "place"
        traces = (
            Trace("unit 1", course.time, getattr(course, quantity)),
            *_expected(many.still, which, quantity),
        )
        out.append(
            Figure(
                slug,
                f"Fig. {slug[3:]}: error of the {what}, sensor drifts {word}",
                "The dotted curve is what the covariance at the end of the alignment says.",
                CHOSEN,
                "time, s",
                (FigurePanel(QUANTITIES[quantity], traces),),
                marks=((FINE_END + 0.5 * schuler(), "half of Schuler's period"),),
            )
        )
    panels = []
    for kind, kept in (("still", many.still), ("turned", many.turned)):
        traces = (
            Trace("damped", kept.time, kept.rms("damped", "speed")),
            Trace("not damped", kept.time, kept.rms("undamped", "speed")),
            Trace(
                "damped, predicted",
                kept.predicted["damped"].time,
                kept.predicted["damped"].speed,
                reference=True,
            ),
            Trace(
                "predicted without correlations",
                kept.predicted["independent"].time,
                kept.predicted["independent"].speed,
                reference=True,
            ),
        )
        panels.append(FigurePanel(f"table {kind}: ΔV, m/s", traces))
    out.append(
        Figure(
            "turned",
            "The same units, where the table turns by half a turn after the alignment",
            "At rest the errors that no rest tells apart cancel, tilt against bias. The turn ends "
            "that, and nothing is left of the gain.",
            CHOSEN + f" The table turns by {TURN_DEG:g}° from 600 s to 620 s.",
            "time, s",
            tuple(panels),
            marks=((FINE_END + 0.5 * schuler(), "half of Schuler's period"),),
        )
    )
    return out


def _expected(kept: Kept, which: str, quantity: str) -> tuple[Trace, ...]:
    predicted = kept.predicted[which]
    return (
        Trace(f"{COUNT} units, RMS", kept.time, kept.rms(which, quantity)),
        Trace(
            "predicted",
            predicted.time,
            getattr(predicted, OF_PREDICTED[quantity]),
            reference=True,
        ),
    )


def at_times(kept: Kept, which: str, quantity: str) -> Array:
    """Root mean square over units at `TIMES`."""
    rows = np.searchsorted(kept.time, FINE_END + np.asarray(TIMES) - 1e-6)
    return kept.rms(which, quantity)[rows]


def predicted_at(kept: Kept, kind: str, quantity: str) -> Array:
    """What the covariance says at `TIMES`."""
    found = kept.predicted[kind]
    rows = np.searchsorted(found.time, FINE_END + np.asarray(TIMES) - 1e-6)
    values: Array = getattr(found, OF_PREDICTED[quantity])[rows]
    return values


def table(many: Units) -> Table:
    """Return what was measured beside what the covariance says."""
    rows: list[tuple[str, tuple[float | None, ...]]] = []
    for name, kept in (("still", many.still), ("turned", many.turned)):
        for quantity, label in QUANTITIES.items():
            for which in ("damped", "undamped"):
                word = "damped" if which == "damped" else "not damped"
                measured = at_times(kept, which, quantity)
                expected = predicted_at(kept, which, quantity)
                values = [v for pair in zip(measured, expected, strict=True) for v in pair]
                rows.append((f"{name}, {word}, {label}", tuple(float(v) for v in values)))
            lone: list[float | None] = []
            for value in predicted_at(kept, "independent", quantity).tolist():
                lone += [None, value]
            rows.append((f"{name}, without correlations, {label}", tuple(lone)))
    columns = [f"{t:g} s, {w}" for t in TIMES for w in ("measured", "predicted")]
    return Table(
        "damping",
        "Figs. 8 to 11 in numbers",
        f"Root mean square over {COUNT} units, beside what the covariance of the alignment says. "
        "“Without correlations” takes the same standard deviations as if errors were independent "
        "of each other.",
        ("run, time after the alignment", *columns),
        tuple(rows),
    )


def damped(many: Units, quantity: str) -> Statement:
    """Judge what damping does to Delta V or Delta S."""
    gains = {
        name: at_times(kept, "undamped", quantity) / at_times(kept, "damped", quantity)
        for name, kept in (("still", many.still), ("turned", many.turned))
    }
    still = many.still
    told = predicted_at(still, "undamped", quantity) / predicted_at(still, "damped", quantity)
    return damped_from(quantity, gains["still"], gains["turned"], told)


def damped_from(quantity: str, still: Array, turned: Array, told: Array) -> Statement:
    """Judge from errors not damped over errors damped at `TIMES`, and as predicted."""
    gained, lasting = bool(still.min() > GAIN), bool(turned[1:].min() > GAIN)
    if gained and lasting:
        verdict, condition = HOLDS, ""
    elif gained:
        verdict = HOLDS_WHEN
        condition = (
            "the unit stays as it stood when it was aligned: after half a turn of the table the "
            f"gain is {amount(float(turned[-1]))}"
        )
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    velocity = quantity == "speed"
    return Statement(
        "fig8-9" if velocity else "fig10-11",
        "Section 4, Figs. 8 and 9" if velocity else "Section 4, Figs. 10 and 11",
        "Figure 8 reflects the dynamic behavior of the ground velocity error when sensor drifts "
        "are damped, and Figure 9 reflects the above behavior when the sensor drifts are not damped"
        if velocity
        else "Figure 10 reflects the dynamic behavior of the circular error in the object position "
        "when sensor drifts are damped, and Figure 11 reflects the dynamic behavior of the "
        "circular error in the object position when sensor drifts are not damped",
        verdict,
        condition,
        f"Root mean square over {COUNT} units, estimates left on over estimates taken off. What a "
        "rest tells of the drifts is worth what it says. A horizontal bias it does not tell from "
        "a tilt; at rest the two cancel, whoever is damped, and a turn brings them out.",
        (
            *(Evidence(f"gain after {t:g} s", float(g)) for t, g in zip(TIMES, still, strict=True)),
            *(
                Evidence(f"gain as predicted, {t:g} s", float(g))
                for t, g in zip(TIMES, told, strict=True)
            ),
            *(
                Evidence(f"gain with the table turned, {t:g} s", float(g))
                for t, g in zip(TIMES, turned, strict=True)
            ),
        ),
        "fig8" if velocity else "fig10",
    )


def comparison(many: Units) -> Statement:
    """Judge that such runs tell how good a system is, from measured over predicted."""
    ratios = np.array(
        [
            at_times(kept, which, quantity) / predicted_at(kept, which, quantity)
            for kept in (many.still, many.turned)
            for which in ("damped", "undamped")
            for quantity in QUANTITIES
        ]
    )
    last = "circular"
    return comparison_from(
        float(ratios.min()),
        float(ratios.max()),
        float(at_times(many.still, "damped", last)[-1]),
        float(at_times(many.turned, "damped", last)[-1]),
        float(predicted_at(many.still, "independent", last)[-1]),
        many.forward_apart,
    )


def comparison_from(
    least: float,
    most: float,
    still: float,
    turned: float,
    independent: float,
    forward: float,
) -> Statement:
    """Judge from the extremes of measured over predicted, and from Delta S after an hour, m.

    `forward` is by how much, in m/s, it matters whether estimates are fed back or forward.
    """
    if not (least > 1.0 / AGREES and most < AGREES):
        verdict, condition = DOES_NOT_HOLD, ""
    elif turned > 2.0 * still:
        verdict = HOLDS_WHEN
        condition = (
            "it is of a table that stands: what a vehicle would have after the same alignment is "
            f"{amount(turned / still)} times as much, and the covariance says so"
        )
    else:
        verdict, condition = HOLDS, ""
    return Statement(
        "comparison",
        "Section 4",
        "The results of a comparison analysis of SINS operation when using different schemes for "
        "the damping of sensor errors were obtained",
        verdict,
        condition,
        "The covariance at the end of the alignment, taken over the hour, against the units. By "
        "the same standard deviations without their correlations a table that stands would be "
        "expected to do as badly as one that is turned: the cancelling is in the correlations. "
        "Whether the estimates are fed back to the sensors, or (6) predicts what they do to a "
        "mechanization that runs free, comes to the same.",
        (
            Evidence("measured over predicted, least", least),
            Evidence("measured over predicted, most", most),
            Evidence("ΔS after an hour, damped", still, "m"),
            Evidence("the same, table turned", turned, "m"),
            Evidence("predicted without correlations", independent, "m"),
            Evidence("ΔV apart, fed back and fed forward", forward, "m/s"),
        ),
        "turned",
    )
