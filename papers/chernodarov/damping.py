"""Figs. 8 to 11: an hour without aids, sensor drifts damped and not."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from papers.chernodarov.bench import Bench
from papers.chernodarov.setting import ELLIPSOID, FINE_END, SITE
from papers.chernodarov.units import COUNT, TURN_DEG, Kept, Units
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
from strapdown.earth import radii_of_curvature

Array = NDArray[np.float64]

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
