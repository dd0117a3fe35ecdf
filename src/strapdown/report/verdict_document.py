"""Verdict page of a run: whether it can be trusted, and the evidence against it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown import __version__
from strapdown.constants import TWO_SIDED_95
from strapdown.evaluation.plane_bound import plane_bound
from strapdown.navigation.heading_integrity import REASONS, HeadingIntegrity
from strapdown.navigation.heading_witness import UNSEEN
from strapdown.report.chart import BLUE, GREY, VERMILLION, thin
from strapdown.report.document import (
    Block,
    Document,
    Items,
    KeyFigure,
    KeyFigures,
    Paragraph,
    Picture,
    Section,
    TableBlock,
)
from strapdown.report.svg_drawing import INK, Drawing, text_width
from strapdown.report.values import GAP, duration_words, half, length_words, plain, share_words
from strapdown.report.values import alignment_values_instant as instant
from strapdown.report.verdict_words import (
    advice_words,
    answer,
    degrees_words,
    first_words,
    kind_words,
    promise,
    repeated_words,
    span_words,
    unwitnessed_words,
    witness_words,
)
from strapdown.systems.navigation_run import NavigationRun

#: Rows per table of the page; the files have all.
_MOST = 12


def verdict_document(result: NavigationRun, name: str) -> Document:
    """Return the verdict page of a navigation run.

    Parameters
    ----------
    result : NavigationRun
    name : str
        Folder name.
    """
    trust = result.trust
    seen = len(trust.light.table) > 0
    sound = trust.first is None and seen and trust.light.spans[-1].colour == "green"
    sections = (
        Section("heading", "Is the heading to be trusted?", _heading(result)),
        Section("innovations", "Does what was observed agree?", _innovations(result)),
        Section("first", "What is the first that does not, and does it matter?", _first(result)),
        Section("meaning", "What the colours mean", (Items(promise(trust)), _limits())),
    )
    return Document(
        "Can it be trusted?",
        result.spec.title or f"Verdict on the navigation of {result.source.name}",
        (
            ("Record", f"{result.source.name}, {result.source.what}"),
            ("Made with", f"strapdown {__version__}"),
        ),
        (
            KeyFigures(_keys(result)),
            Paragraph(answer(result), "lead" if sound else "warning"),
            *((light_picture(result),) if seen else ()),
        ),
        sections,
        f"Verdict on {name}",
        links=(("report.html", "The whole report"),),
    )


def light_section(result: NavigationRun) -> Section:
    """Heading integrity, as a section of the report."""
    said = Paragraph(answer(result))
    return Section(
        "trust", "Can it be trusted?", (said, light_picture(result), *_of_filter(result))
    )


def _of_filter(result: NavigationRun) -> tuple[Block, ...]:
    """Note for a smoothed run on the parts that use the filter alone."""
    if result.forward is None:
        return ()
    return (
        Paragraph(
            "The light, and the repeated run, are of the filter alone: of what was known at each "
            "second then. Smoothed, the heading is known by what came later, too.",
            "note",
        ),
    )


def _keys(result: NavigationRun) -> tuple[KeyFigure, ...]:
    trust, light = result.trust, result.trust.light
    bounds = plane_bound(result.record.covariance)
    heading = half(result.record.sd["heading"].iloc[-1])
    spans = light.spans
    last = spans[-1].colour if spans else "unknown"
    since = next((s.begin for s in reversed(spans) if s.colour != last), None)
    begun = "all of the run" if since is None else f"for the last {_since(result, last)}"
    first = trust.first
    return (
        KeyFigure(
            "Heading at the end",
            last,
            f"{begun}; own bound {degrees_words(heading)}",
            REASONS[spans[-1].reason] if spans else "",
        ),
        KeyFigure(
            "Heading is green",
            share_words(light.share("green")),
            f"of the time: within {plain(light.green, 1)}°",
            f"amber {share_words(light.share('amber'))}, red {share_words(light.share('red'))}",
        ),
        KeyFigure(
            "Place at the end",
            f"±{GAP}{length_words(float(bounds[-1]))}",
            f"horizontal, 95{GAP}%",
            f"at its worst {length_words(float(bounds.max()))}",
        ),
        KeyFigure(
            "What was observed",
            _agrees(result),
            _looked_at(len(trust.consistency))
            if first is None
            else f"{first.name} {kind_words(first)}",
            "" if first is None else f"since {instant(first.since)}",
        ),
    )


def _agrees(result: NavigationRun) -> str:
    trust = result.trust
    if not trust.consistency:
        return "nothing"
    if trust.first is None:
        return "agrees"
    # Single outliers are not inconsistencies of the filter.
    if trust.against_bounds is None:
        return "agrees, mostly"
    return "does not agree"


def _since(result: NavigationRun, colour: str) -> str:
    seconds = 0.0
    for span in reversed(result.trust.light.spans):
        if span.colour != colour:
            break
        seconds += span.end - span.begin
    return duration_words(seconds)


def _heading(result: NavigationRun) -> tuple[Block, ...]:
    trust, light = result.trust, result.trust.light
    if not len(light.table):
        return (Paragraph("The run is shorter than a second."),)
    blocks: list[Block] = [*_of_filter(result), _reasons(result)]
    if trust.unwitnessed:
        blocks.append(
            Paragraph(
                f"Nothing could confirm the heading: {unwitnessed_words(trust)}. It rests on its "
                "start, or on one source alone, and is not green at any time.",
                "warning",
            )
        )
    if any(a.options for a in trust.advice):
        rows = tuple(
            (
                f"{a.span.colour.capitalize()}, {span_words(a.span)}",
                _capital(advice_words(a, trust)),
            )
            for a in trust.advice
        )
        blocks += [
            Paragraph(
                "What would have helped, at the end of the longest stretches that were not green "
                "(by the covariance of the filter, taken over the manoeuvre, without what was "
                "assumed of the heading):"
            ),
            Items(rows),
        ]
    elif trust.advice:
        said = advice_words(trust.advice[-1], trust)
        blocks.append(Paragraph(f"What would have helped: {said}."))
    table = _against_truth(result)
    return (*blocks, *(() if table is None else (table,)))


def _reasons(result: NavigationRun) -> TableBlock:
    table = result.trust.light.table
    rows = []
    for colour, number in (("green", 0), ("amber", 1), ("red", 2)):
        those = table[table["light"] == number]
        for reason, count in those["reason"].value_counts().items():
            share = share_words(count / len(table))
            why = REASONS[str(reason)]
            if colour == "green" and witness_words(result.trust):
                why = f"{why}: the run, and {witness_words(result.trust)}"
            rows.append((colour, why, f"{count}", share))
    return TableBlock(
        ("light", "why", "seconds", "of the time"), tuple(rows), (0, 1), "The light, and why"
    )


def _against_truth(result: NavigationRun) -> TableBlock | None:
    """Sizes of the errors under each status color; None if the truth is not known."""
    light = result.trust.light
    error = heading_error(result, light.table.index.to_numpy(dtype=np.float64))
    if error is None:
        return None
    size, number = np.abs(error), light.table["light"].to_numpy()
    rows = []
    for colour, k in (("green", 0), ("amber", 1), ("red", 2)):
        those = size[(number == k) & np.isfinite(size)]
        if len(those):
            within = share_words(float(np.mean(those <= light.green)))
            largest, rms = float(those.max()), math.sqrt(float(np.mean(those**2)))
            rows.append(
                (colour, f"{len(those)}", within, f"{plain(rms, 3)}", f"{plain(largest, 3)}")
            )
    if not rows:
        return None
    return TableBlock(
        ("light", "seconds", f"within {plain(light.green, 1)}°", "rms, deg", "largest, deg"),
        tuple(rows),
        (0,),
        f"The heading against {result.source.truth_name}, by what the light showed",
    )


def _innovations(result: NavigationRun) -> tuple[Block, ...]:
    trust = result.trust
    if not trust.consistency:
        return (Paragraph("Nothing was observed."),)
    rows = []
    for name, one in trust.consistency.items():
        doubts = [i for i in trust.inconsistencies if i.name == name]
        kinds = ", ".join(dict.fromkeys(kind_words(i) for i in doubts)) or "agrees"
        scales = [c.scale for c in one.components if math.isfinite(c.scale)]
        worst = max(scales, key=lambda x: abs(math.log(max(x, 1e-9))), default=math.nan)
        gross = sum(c.gross for c in one.components)
        rows.append((name, kinds, f"{len(one.nis)}", plain(worst, 2), f"{gross}"))
    blocks: list[Block] = [
        TableBlock(
            ("observation", "verdict", "epochs", "scatter, sd", "gross errors"),
            tuple(rows),
            (0, 1),
            "What was observed against what was expected of it; a scatter of 1 is as stated",
        )
    ]
    small = [
        (name, v.finding.what)
        for name, one in trust.consistency.items()
        for v in one.verdicts
        if v.kind != "few"
        and not any(
            i.name == name and i.component == v.component and i.kind == v.kind
            for i in trust.inconsistencies
        )
    ]
    if small:
        blocks += [
            Paragraph("More than chance, but too little to matter, or on the safe side:"),
            Items(tuple((name, f"{what}.") for name, what in small[:_MOST])),
        ]
    return tuple(blocks)


def _first(result: NavigationRun) -> tuple[Block, ...]:
    trust = result.trust
    blocks: list[Block] = [Paragraph(first_words(trust))]
    if len(trust.inconsistencies) > 1:
        rows = tuple(
            (instant(i.since), i.name, i.component.partition(",")[0], kind_words(i))
            for i in trust.inconsistencies[:_MOST]
        )
        blocks.append(
            TableBlock(
                ("since", "observation", "component", "what"),
                rows,
                (0, 1, 2, 3),
                "All doubts in the order in which they count: what holds throughout has no begin, "
                "and comes after gross errors of its aid, which may be its cause",
            )
        )
    said = repeated_words(result)
    if said:
        blocks.append(Paragraph(said))
    picture = repeated_picture(result)
    if picture is not None:
        blocks.append(picture)
    repeated = trust.repeated
    if repeated is not None and repeated.left:
        rows_left = tuple(
            (i.name, f"{kind_words(i)}: {i.finding.what}.") for i in repeated.left[:_MOST]
        )
        blocks += [Paragraph("What does not agree in the repeated run:"), Items(rows_left)]
    return tuple(blocks)


def _limits() -> Block:
    return Paragraph(
        "What no light can tell: a record whose fixes are all wrong in the same way, as of a "
        "receiver that is led astray with a motion of its own, agrees with itself. And a gyro that "
        f"changes by more than {UNSEEN:g} standard deviations of its bias after the last rest, in "
        "a run without fixes, is seen by nothing before the next one.",
        "note",
    )


def _looked_at(number: int) -> str:
    return "one observation looked at" if number == 1 else f"{number} observations looked at"


def _capital(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"


# Pictures of a verdict: heading integrity over time, and the run against its re-run.


Array = NDArray[np.float64]

#: Status colors from Okabe and Ito, distinguishable by color-blind readers.
LIGHTS = {"green": "#009E73", "amber": "#E69F00", "red": "#D55E00"}
WIDTH, LEFT, RIGHT = 940.0, 74.0, 14.0
SMALL, STRIP, PANEL, VERDICT_PICTURE_GAP = 12.5, 34.0, 190.0, 30.0
#: Points per curve of a picture.
BUCKETS = 500


@dataclass(frozen=True)
class _Curve:
    name: str
    x: Array
    y: Array
    colour: str
    width: float = 1.8
    dash: str = "solid"
    band: bool = False


@dataclass(frozen=True)
class _Frame:
    """A panel in a picture: its position, and the values at its edges."""

    top: float
    height: float
    begin: float
    end: float
    most: float
    least: float = 0.0
    log: bool = False

    def at(self, x: Array, y: Array) -> Array:
        across = LEFT + (x - self.begin) / (self.end - self.begin) * (WIDTH - LEFT - RIGHT)
        ends = np.array([self.least, self.most])
        y = np.clip(y, *ends)
        low, high = np.log10(ends) if self.log else ends
        share = ((np.log10(y) if self.log else y) - low) / (high - low)
        return np.column_stack([across, self.top + self.height * (1.0 - share)])


def heading_error(result: NavigationRun, time: Array) -> Array | None:
    """Heading error at given instants, deg; None if the truth is not known."""
    differences = result.filtered_differences
    if differences is None or not len(differences):
        return None
    known = differences.index.to_numpy(dtype=np.float64)
    error = differences["heading"].to_numpy(dtype=np.float64)
    return np.asarray(np.interp(time, known, error, left=np.nan, right=np.nan))


def light_picture(result: NavigationRun) -> Picture:
    """Heading integrity of each second, with the bounds that determine it."""
    light = result.trust.light
    table = light.table
    time = table.index.to_numpy(dtype=np.float64)
    picture = Drawing(
        WIDTH, 40.0 + STRIP + VERDICT_PICTURE_GAP + PANEL + 62.0, "Light of the heading over time"
    )
    begin, end = float(time[0]), max(float(time[-1]) + 1.0, float(time[0]) + 2.0)
    _strip(picture, light, begin, end, 8.0)
    bound = table["bound"].to_numpy(dtype=np.float64)
    # Decades from below the smallest bound up to a practically unknown heading.
    known = min(float(np.nanmin(bound)), light.green) if np.isfinite(bound).any() else light.green
    error = heading_error(result, time)
    if error is not None and np.isfinite(error).any():
        known = min(known, max(float(np.nanmedian(np.abs(error))), 1e-3))
    least = 10.0 ** math.floor(math.log10(max(known, 1e-4)))
    frame = _Frame(8.0 + STRIP + VERDICT_PICTURE_GAP, PANEL, begin, end, light.red, least, log=True)
    carried = np.where(np.isfinite(table["carried"]), table["carried"], light.red)
    curves = [
        _Curve("bound of the run itself (95 %)", time, bound, BLUE),
        _Curve("bound that a witness bears out (99 %)", time, carried, INK, 2.2),
    ]
    if error is not None:
        name = f"error against {result.source.truth_name}"
        curves.append(_Curve(name, time, np.abs(error), VERMILLION, 1.6, "dot"))
    _panel(picture, frame, "heading, deg", curves, level=light.green)
    _legend(picture, frame.top + PANEL + 44.0, curves)
    return Picture(
        "heading-light",
        picture.svg(),
        "The heading, second by second",
        f"Above: the light. Below: what it goes by. Green needs both curves below "
        f"{plain(light.green, 1)}° (the dashed line); what is at the top is unknown there. The "
        "scale is one of decades.",
        "Light of the heading over time, with the bounds that it goes by",
    )


def repeated_picture(result: NavigationRun) -> Picture | None:
    """Difference of a run from its re-run, with the bounds of both; None without a re-run."""
    repeated = result.trust.repeated
    if repeated is None or repeated.differences is None or repeated.record is None:
        return None
    table = repeated.differences
    time = table.index.to_numpy(dtype=np.float64)
    if len(time) < 2:
        return None
    begin, end = float(time[0]), float(time[-1])
    place = np.hypot(table["north"].to_numpy(), table["east"].to_numpy())
    turn = np.abs(table["heading"].to_numpy(dtype=np.float64))
    picture = Drawing(WIDTH, 2 * PANEL + VERDICT_PICTURE_GAP + 100.0, "A run beside its repetition")
    bottom = 8.0
    both = (result.filtered, repeated.record)
    for label, difference, bounds in (
        ("place, m", place, [plane_bound(r.covariance) for r in both]),
        (
            "heading, deg",
            turn,
            [TWO_SIDED_95 * r.sd["heading"].to_numpy(dtype=np.float64) for r in both],
        ),
    ):
        curves = [
            _Curve("bound of the run (95 %)", result.filtered.sd.index.to_numpy(), bounds[0], BLUE),
            _Curve(
                "bound of the repeated run (95 %)",
                repeated.record.sd.index.to_numpy(),
                bounds[1],
                GREY,
                1.6,
                "dash",
            ),
            _Curve("run and repeated run apart", time, difference, VERMILLION, 2.2),
        ]
        within = [c.y[(c.x >= begin) & (c.x <= end) & np.isfinite(c.y)] for c in curves]
        # The bounds of a start, and those of an outage, would hide the rest.
        tall = max(float(np.quantile(y, 0.98)) for y in within if len(y))
        most = max(1.15 * tall, 1.02 * float(np.nanmax(difference)), 1e-6)
        frame = _Frame(bottom, PANEL, begin, end, most)
        _panel(picture, frame, label, curves, ticks=label.startswith("heading"))
        bottom += PANEL + VERDICT_PICTURE_GAP
    _legend(picture, bottom + 16.0, curves)
    return Picture(
        "repeated",
        picture.svg(),
        "The run and its repetition",
        f"How far the run is from the same run {repeated.change.what}, beside the bounds of both.",
        "Differences of place and heading between the run and the repeated run, beside bounds",
    )


def _strip(picture: Drawing, light: HeadingIntegrity, begin: float, end: float, top: float) -> None:
    picture.text((LEFT - 10.0, top + 0.5 * STRIP), "light", SMALL, anchor="end")
    scale = (WIDTH - LEFT - RIGHT) / (end - begin)
    seconds = _merged(light)
    for first, last, colour in seconds:
        a, b = LEFT + (first - begin) * scale, LEFT + (min(last, end) - begin) * scale
        # The height shows the status without color.
        up = top + {"green": 0.0, "amber": 0.25, "red": 0.5}[colour] * STRIP
        box = [(a, up), (b, up), (b, top + STRIP), (a, top + STRIP)]
        picture.shape(box, None, fill=LIGHTS[colour])
        if b - a > text_width(colour, 11.0) + 10.0:
            middle = (0.5 * (a + b), 0.5 * (up + top + STRIP))
            picture.text(
                middle, colour, 11.0, "#ffffff" if colour != "amber" else INK, anchor="middle"
            )


def _merged(light: HeadingIntegrity) -> list[tuple[float, float, str]]:
    """Stretches of one color, whatever the reason."""
    out: list[tuple[float, float, str]] = []
    for span in light.spans:
        if out and out[-1][2] == span.colour:
            out[-1] = (out[-1][0], span.end, span.colour)
        else:
            out.append((span.begin, span.end, span.colour))
    return out


def _panel(
    picture: Drawing,
    frame: _Frame,
    label: str,
    curves: Sequence[_Curve],
    *,
    level: float | None = None,
    ticks: bool = True,
) -> None:
    right, bottom = WIDTH - RIGHT, frame.top + frame.height
    heights = _decades(frame) if frame.log else _ticks(frame.least, frame.most, 5)
    for value in heights:
        y = float(frame.at(np.array([frame.begin]), np.array([value]))[0, 1])
        picture.line((LEFT, y), (right, y), "#e4e8ec", 1.0)
        picture.text((LEFT - 8.0, y), _number(value), SMALL, anchor="end")
    for value in _ticks(frame.begin, frame.end, 8):
        x = float(frame.at(np.array([value]), np.array([frame.least]))[0, 0])
        picture.line((x, bottom), (x, bottom + 4.0), INK, 1.0)
        if ticks:
            picture.text((x, bottom + 14.0), _number(value), SMALL, anchor="middle")
    if ticks:
        picture.text((right, bottom + 30.0), "time, s", SMALL, anchor="end")
    picture.text((18.0, frame.top + 0.5 * frame.height), label, SMALL, anchor="middle", turn=-90.0)
    if level is not None:
        height = float(frame.at(np.array([frame.begin]), np.array([level]))[0, 1])
        picture.line((LEFT, height), (right, height), LIGHTS["green"], 1.6, "dash")
    with picture.within((LEFT, frame.top - 2.0, right, bottom + 2.0)):
        for curve in curves:
            points = frame.at(*thin(curve.x, curve.y, BUCKETS))
            picture.shape(points, curve.colour, curve.width, curve.dash, closed=False)
    picture.line((LEFT, frame.top), (LEFT, bottom), INK, 1.0)
    picture.line((LEFT, bottom), (right, bottom), INK, 1.0)


def _legend(picture: Drawing, y: float, curves: Sequence[_Curve]) -> None:
    x = LEFT
    for curve in curves:
        picture.line((x, y), (x + 26.0, y), curve.colour, curve.width + 0.4, curve.dash)
        picture.text((x + 32.0, y), curve.name, SMALL)
        x += 50.0 + 0.86 * text_width(curve.name, SMALL)


def _decades(frame: _Frame) -> list[float]:
    """Powers of ten between the ends, and the upper end."""
    low, high = math.log10(frame.least), math.log10(frame.most)
    out = [10.0**k for k in range(math.ceil(low - 1e-9), math.floor(high + 1e-9) + 1)]
    return out if high - math.floor(high + 1e-9) < 0.2 else [*out, frame.most]


def _ticks(least: float, most: float, count: int) -> list[float]:
    """Round numbers between two."""
    step = 10.0 ** math.floor(math.log10(max(most - least, 1e-9) / count))
    for factor in (1.0, 2.0, 5.0, 10.0):
        if (most - least) / (factor * step) <= count:
            step *= factor
            break
    first = math.ceil(least / step - 1e-9)
    return [k * step for k in range(first, math.floor(most / step + 1e-9) + 1)]


def _number(value: float) -> str:
    return f"{value:.6g}".replace("-", "\u2212") if abs(value) < 1e5 else f"{value:.0f}"
