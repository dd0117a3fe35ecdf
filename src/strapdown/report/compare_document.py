"""The page of a comparison: what differs in options, inputs, numbers and over time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from strapdown import __version__
from strapdown.config.toml_file import shown
from strapdown.constants import STANDARD_GRAVITY
from strapdown.report.compare_charts import charts, in_units, quantity_words
from strapdown.report.compare_numbers import Value
from strapdown.report.compare_tracks import QUANTITIES
from strapdown.report.document import (
    Block,
    Document,
    Facts,
    Items,
    KeyFigure,
    KeyFigures,
    Paragraph,
    TableBlock,
    findings_list,
    run_again,
    section,
)
from strapdown.report.values import (
    GAP,
    MINUS,
    bounded,
    decimals,
    duration_words,
    half_words,
    instant,
    length_words,
    on_ground,
    plain,
    share_words,
    shown_unit,
    stamp,
)

if TYPE_CHECKING:
    from strapdown.report.compare import NumberRow, RunComparison

SAME, NONE = "same", "–"
#: Distance of two positions that is rounding alone, m.
SAME_PLACE = 1e-9
#: What a computation in double precision leaves of zero, in any unit that is shown.
ROUNDING = 1e-9
METHOD = (
    "Options are those of the sealed configurations, which have every default: a default that one "
    "of them states is no difference. Inputs are compared by their SHA-256.",
    "A difference is a run minus the first one. Its 95 % bound is the root of the sum of the "
    "squares of both bounds, as of independent errors. Runs of one log share measurements, and "
    "differ by less if both bounds hold: a difference outside says that one of them does not, one "
    "within proves neither. Sensor errors of different records or units differ as these do: their "
    "differences have no bound.",
    "Over time: at the instants of the covariance of the run (the first is interpolated), rms and "
    "shares weighted by time. Horizontally within means within the ellipse of both standard "
    "deviations north and east, without their correlation.",
    "Times taken stand outside of the seals: they are indicative.",
)


# The answer, which page and terminal share.


def headline(result: RunComparison) -> str:
    """Say what differs, in a few sentences."""
    runs = result.runs
    commands = list(dict.fromkeys(run.command for run in runs))
    said = [f"{len(runs)} runs of {' and '.join(commands)}."]
    keys = [row.key for row in result.options]
    if not keys:
        said.append(
            "All options are the same." if result.same_command else "No common option differs."
        )
    else:
        few = ", ".join(keys[:3]) + (f" and {len(keys) - 3} more" if len(keys) > 3 else "")
        said.append(
            f"{len(keys)} {'option differs' if len(keys) == 1 else 'options differ'}: {few}."
        )
    said.append(_inputs_words(result))
    if result.same_command and result.numbers:
        said.append(_numbers_words(result))
    for one in result.differences:
        if (score := one.score("horizontal")) is not None:
            of = f"{runs[one.run].name}: " if len(runs) > 2 else ""
            vehicle = f" of {one.label}" if one.label else ""
            if score.largest < SAME_PLACE:
                said.append(f"{of}Horizontal positions{vehicle} are the same at all times.")
                continue
            within = ""
            if score.share is not None:
                within = f", within their bounds {share_words(score.share)} of the time"
            said.append(
                f"{of}Horizontal positions{vehicle} differ by {length_words(score.rms)} (rms), "
                f"{length_words(score.largest)} at most{within}."
            )
    return " ".join(said)


def _numbers_words(result: RunComparison) -> str:
    count = len(result.numbers)
    finer = sum(is_finer(row, result.units) for row in result.numbers)
    other = sum(not row.same for row in result.numbers) - finer
    outside = sum(False in row.within for row in result.numbers)
    if not other:
        less = f" by as much as is shown; {finer} of {count} by less" if finer else ""
        return f"No number differs{less}."
    words = f"{other} of {count} numbers {'differs' if other == 1 else 'differ'}"
    if outside:
        words += f", {outside} by more than their 95 % bound"
    return f"{words}; {finer} more by less than is shown." if finer else f"{words}."


def _inputs_words(result: RunComparison) -> str:
    rows = result.inputs
    if not rows:
        return "No run has input files."
    other = [row.role for row in rows if not row.same]
    if other:
        return f"Other inputs: {', '.join(dict.fromkeys(other))}."
    if any("renamed" in row.status for row in rows):
        return "The inputs have the same bytes, under other names."
    return "The inputs are the same."


def compare_document(result: RunComparison, name: str) -> Document:
    """Return the page of a comparison; `name`: that of its folder."""
    drawn = {chart.slug: chart for chart in charts(result)}
    plans = [chart for slug, chart in drawn.items() if slug.startswith("plan")]
    over = [chart for slug, chart in drawn.items() if not slug.startswith("plan")]
    several = result.same_command
    same = sum(row.same for row in result.numbers)
    whole = numbers_block(result, every=True) if several else None
    count = f"All {len(result.numbers)} numbers ({same} are the same)"
    sections = [
        section("options", "Options that differ", *_options(result)),
        section("inputs", "Inputs", inputs_block(result) or Paragraph("None: simulations.")),
        section("numbers", "Numbers that differ", *_numbers(result)) if several else None,
        section("time", "Differences over time", scores_block(result), *over),
        section("plan", "Plan", *plans),
        section("findings", "Findings that not all runs have", *_codes(result))
        if several
        else None,
        section("all", count, whole, folded=True),
        section("conditions", "Versions and platform", *_conditions(result), folded=True),
        section("seconds", "Time taken, indicative", seconds_block(result), folded=True),
        section("runs", "Runs and their seals", _runs_block(result), folded=True),
        section("method", "Method", Items(tuple(("", text) for text in METHOD)), folded=True),
        section("again", "Check this folder", *run_again(name)),
    ]
    facts = tuple((f"Run {k}", _described(result, k - 1)) for k in range(1, len(result.runs) + 1))
    return Document(
        " | ".join(run.name for run in result.runs),
        "Results compared",
        (*facts, ("Software", f"strapdown {__version__}")),
        tuple(front(result)),
        tuple(one for one in sections if one is not None and one.blocks),
        links=(("compare.json", "all of it, for programs"),),
    )


def _described(result: RunComparison, k: int) -> str:
    run = result.runs[k]
    ran = ", run for this comparison" if run.ran else ""
    changed = " – changed after it was sealed" if run.changed else ""
    return f"{run.name} ({run.command}{ran}){changed}"


def front(result: RunComparison) -> Iterator[Block]:
    """Yield the answer: warnings, a few sentences, key numbers."""
    warnings = [one for one in result.findings if one.severity != "note"]
    if result.changed:
        names = ", ".join(run.name for run in result.runs if run.changed)
        yield Paragraph(
            f"Changed after it was sealed: {names}. Its numbers are those of the changed files.",
            "warning",
        )
    yield Paragraph(headline(result), "lead")
    figures = tuple(_figures(result))
    if figures:
        yield KeyFigures(figures)
    if warnings:
        listed = findings_list(warnings, "cli")
        yield listed
    notes = [one for one in result.findings if one.severity == "note"]
    for note in notes:
        yield Paragraph(f"{note.sentence('cli')}.".replace("..", "."), "note")


def _figures(result: RunComparison) -> Iterator[KeyFigure]:
    if len(result.runs) != 2:
        return
    for one in result.differences:
        of = f", {one.label}" if one.label else ""
        for quantity in ("horizontal", "heading"):
            if (score := one.score(quantity)) is None:
                continue
            name = QUANTITIES[quantity][0]
            note = (
                ""
                if score.share is None
                else f"within their bounds {share_words(score.share)} of the time"
            )
            yield KeyFigure(
                f"{name[0].upper()}{name[1:]}{of}",
                f"{_amount(score.rms, score.unit)}",
                f"rms of the difference; {_amount(score.largest, score.unit)} at most, at "
                f"{_time(score.largest_at)}",
                note,
            )
    for row in result.numbers:
        if row.key.endswith((".delta_v_m_per_s", ".pdof_deg")) and row.key.startswith(
            ("main.", "vehicle ")
        ):
            if ".recorders." in row.key or row.differences[1] is None:
                continue
            factor, unit = _scale(row, result.units)
            half = (
                "" if row.combined[1] is None else f"{half_words(factor * row.combined[1])} {unit}"
            )
            words = {True: "within ± ", False: "outside ± ", None: ""}[row.within[1]]
            yield KeyFigure(
                f"{row.any.label[0].upper()}{row.any.label[1:]}",
                f"{_signed(factor * row.differences[1])} {unit}",
                f"difference, {words}{half}" if half else "difference",
            )


# Tables.


def options_block(result: RunComparison) -> TableBlock | None:
    """Return the options that differ, side by side."""
    if not result.options:
        return None
    rows = tuple((row.key, *map(_option, row.values)) for row in result.options)
    return TableBlock(("option", *_names(result)), rows, text=_all_text(result))


def _options(result: RunComparison) -> Iterator[Block | None]:
    count = result.equal_options
    yield options_block(result)
    if result.options:
        yield Paragraph(f"{count} further options are the same.", "note")
    else:
        yield Paragraph(f"None: all {count} are the same." if count else "No option in common.")


def _numbers(result: RunComparison) -> Iterator[Block | None]:
    block = numbers_block(result, short=True)
    yield block
    if hidden := hidden_numbers(result):
        yield Paragraph(f"{hidden} further numbers that differ are below, under all.", "note")
    elif block is None:
        yield Paragraph("None.")


def _codes(result: RunComparison) -> Iterator[Block]:
    yield codes_block(result) or Paragraph("None.")


def _conditions(result: RunComparison) -> Iterator[Block]:
    yield conditions_block(result) or Paragraph("The same.")


def _option(value: Any) -> str:
    if value is None:
        return NONE
    return value if isinstance(value, str) and len(value) <= 80 else shown(value)


def inputs_block(result: RunComparison) -> TableBlock | None:
    """Return the inputs, and whether they have the same bytes."""
    if not result.inputs:
        return None
    rows = []
    for row in result.inputs:
        cells = []
        for file, status in zip(row.files, row.status, strict=True):
            if file is None:
                cells.append(NONE)
            elif status == "first":
                cells.append(file[0])
            else:
                words = {
                    "same": "same bytes",
                    "renamed": f"{file[0]}: same bytes, other name",
                    "changed": f"{file[0]}: other bytes",
                }
                cells.append(words[status])
        rows.append((row.role, *cells))
    return TableBlock(("input", *_names(result)), tuple(rows), text=_all_text(result))


def numbers_block(
    result: RunComparison, *, every: bool = False, short: bool = False
) -> TableBlock | None:
    """Return the numbers that differ, or all, under the names of their groups.

    `short`: without details, and without those that differ by less than is shown.
    """
    rows: list[tuple[str, ...]] = []
    strong = []
    two = len(result.runs) == 2
    bounded = any(row.combined[-1] is not None for row in result.numbers)
    columns = ["", *_names(result)]
    if two:
        columns += ["difference", "95 % bound of it"][: 2 if bounded else 1]
    group = None
    for row in result.numbers:
        if (row.same and not every) or (short and _is_hidden(row, result)):
            continue
        if row.any.group != group:
            group = row.any.group
            strong.append(len(rows))
            rows.append((group or "Result", *("" for _ in columns[1:])))
        rows.append(tuple(_cells(row, result, two))[: len(columns)])
    if not rows:
        return None
    caption = "Difference: a run minus the first."
    if not two:
        caption = "In brackets: minus the first; ! outside the 95 % bound of the difference."
    return TableBlock(tuple(columns), tuple(rows), (0,), caption, tuple(strong))


def hidden_numbers(result: RunComparison) -> int:
    """Return how many numbers that differ a short list leaves out."""
    return sum(not row.same and _is_hidden(row, result) for row in result.numbers)


def _is_hidden(row: NumberRow, result: RunComparison) -> bool:
    return row.any.detail or is_finer(row, result.units)


def is_finer(row: NumberRow, system: str | None) -> bool:
    """Whether a number differs, but by less than is shown of it, its bounds and its differences."""
    if row.same or False in row.within:
        return False
    said = shown_row(row, system)
    alike = all(len(set(said[key])) == 1 for key in ("values", "bounds"))
    return alike and not any(one.strip(f"0.{MINUS}") for one in said["differences"] if one != SAME)


def shown_row(row: NumberRow, system: str | None) -> dict[str, Any]:
    """Return a row as texts, for a page that lays it out itself.

    Parameters
    ----------
    system : str or None
        Of units, of a crash.

    Returns
    -------
    dict
        ``unit``; ``bound_unit``, that of bounds and differences; of each run ``values``, ``bounds``
        (empty without one), ``differences`` from the first (empty where there is none) and
        ``combined``, the bound of this difference.
    """
    factor, unit = _scale(row, system)
    places = _places(row, factor)
    pairs = [("–", "") if v is None else shown_value(v, factor, places) for v in row.values]
    on_ground = row.any.kind in ("lat", "lon")
    return {
        "unit": "" if on_ground else unit,
        "bound_unit": "m" if on_ground else unit,
        "values": [said for said, _ in pairs],
        "bounds": [bound for _, bound in pairs],
        "differences": ["", *(_apart(row, k, factor) for k in range(1, len(row.values)))],
        "combined": [
            "" if half is None else f"±{GAP}{half_words(factor * half)}" for half in row.combined
        ],
    }


def _cells(row: NumberRow, result: RunComparison, two: bool) -> Iterator[str]:
    factor, unit = _scale(row, result.units)
    label = row.any.label
    yield f"{label}, {unit}" if unit and row.any.kind not in ("lat", "lon") else label
    places = _places(row, factor)
    for k, value in enumerate(row.values):
        text = _value(value, factor, places)
        if not two and k:
            text += _in_brackets(row, k, factor)
        yield text
    if two:
        yield _difference(row, 1, factor)
        half = row.combined[1]
        if half is None:
            yield ""
        else:
            word = "within" if row.within[1] else "outside"
            metres = f"{GAP}m" if row.any.kind in ("lat", "lon") else ""
            yield f"{word} ± {half_words(factor * half)}{metres}"


def _in_brackets(row: NumberRow, k: int, factor: float) -> str:
    own = row.values[k]
    if own is None or row.values[0] is None or isinstance(own.value, str):
        return ""
    said = _difference(row, k, factor)
    mark = " !" if row.within[k] is False else ""
    return f" ({said}{mark})" if said else ""


def _difference(row: NumberRow, k: int, factor: float) -> str:
    said = _apart(row, k, factor)
    metres = f"{GAP}m" if row.any.kind in ("lat", "lon") and row.differences[k] else ""
    return f"{said}{metres}"


def _apart(row: NumberRow, k: int, factor: float) -> str:
    """The difference of a run from the first, without unit."""
    first, other, apart = row.values[0], row.values[k], row.differences[k]
    if first is None or other is None:
        return ""
    if apart is None:
        if isinstance(other.value, str):
            return SAME if other.value == first.value else "other"
        if other.at is not None and first.at is not None and other.at != first.at:
            return "other instant"
        return ""
    half = row.combined[k]
    if half is not None and math.isfinite(half) and half > 0.0 and apart != 0.0:
        said, _ = bounded(factor * apart, factor * half)
        signed = row.any.kind != "horizontal" and said.strip("0.") and not said.startswith(MINUS)
        return f"+{said}" if signed else said
    if row.any.kind == "horizontal":
        return plain(apart, decimals(apart, 2)) if apart else SAME
    if apart == 0.0:
        return SAME
    return _signed(factor * apart)


def _value(value: Value | None, factor: float, places: int) -> str:
    if value is None:
        return NONE
    said, bound = shown_value(value, factor, places)
    if not bound:
        return said
    ground = f"{GAP}m" if value.kind in ("lat", "lon") else ""
    return f"{said} {bound}{ground}" if said else f"{bound}{ground}"


def shown_value(value: Value, factor: float, places: int) -> tuple[str, str]:
    """Format a value and its bound, as `bounded`; `places`: decimals of one without a bound.

    The bound of a latitude or a longitude is in m along the ground, the others in the unit of the
    value times `factor`. Empty: the value of a quantity that has a bound alone; a bound that there
    is not.
    """
    if isinstance(value.value, str):
        return value.value, ""
    below, above = value.below, value.above
    if value.value is None:
        return "", "" if below is None else f"±{GAP}{half_words(factor * below)}"
    if value.kind in ("lat", "lon"):
        return on_ground(value.value, below)
    shown = factor * value.value
    if below is not None and above is not None and not math.isinf(min(below, above)):
        return bounded(shown, factor * below, factor * above)
    if value.kind == "count" or _is_whole(shown):
        return plain(shown, 0), ""
    if abs(shown) < 0.5 * 10.0**-places:
        return (_tiny(shown) if abs(shown) > ROUNDING else "0"), ""
    return plain(shown, places), ""


def _is_whole(value: float) -> bool:
    return value == round(value) and abs(value) < 1e6


def _scale(row: NumberRow, system: str | None) -> tuple[float, str]:
    """Factor and unit in which a quantity is shown."""
    about = row.any
    if system is not None and about.unit in ("m", "m/s"):
        return in_units(system, about.unit)
    if about.kind in ("word", "count", "share", "lat", "lon", "horizontal"):
        return 1.0, about.unit
    size = max(
        (abs(v.value) + (v.below or 0.0) if math.isfinite(v.below or 0.0) else abs(v.value))
        for v in row.values
        if v is not None and isinstance(v.value, float | int)
    )
    if about.unit == "m/s²" and size >= 1.0:
        return 1.0 / STANDARD_GRAVITY, "g"
    if about.unit in ("rad/s", "m/s²", "1", "rad", "(rad/s)/(m/s²)"):
        return shown_unit(about.unit, size)
    return 1.0, about.unit


def _places(row: NumberRow, factor: float) -> int:
    """Decimals that show the bound to two digits, and without one the difference."""
    halves = [
        factor * h
        for v in row.values
        if v is not None
        for h in (v.below, v.above)
        if h is not None and math.isfinite(h) and h > 0.0
    ]
    if halves:
        return decimals(min(halves), 2, most=6)
    values = [
        factor * abs(v.value)
        for v in row.values
        if v is not None and isinstance(v.value, float | int) and v.value
    ]
    apart = [factor * abs(d) for d in row.differences if d]
    least = decimals(max(values), 4, most=6) if values else 2
    return max(least, decimals(min(apart), 2, most=6)) if apart else least


def _signed(value: float) -> str:
    if abs(value) < 1e-6:
        text = _tiny(abs(value))
    else:
        text = plain(abs(value), decimals(abs(value), 3, most=7))
    return f"{MINUS if value < 0.0 else '+'}{text}"


def _tiny(value: float) -> str:
    return f"{value:.1e}".replace("-", MINUS)


def _amount(value: float, unit: str) -> str:
    if unit == "m":
        return length_words(value)
    return f"{plain(value, decimals(value, 3))}{'°' if unit == 'deg' else GAP + unit}"


def scores_block(result: RunComparison) -> TableBlock | None:
    """Return the differences over time: rms, largest and where, share within the bounds."""
    if not result.differences:
        return None
    several = len(result.runs) > 2 or any(one.label for one in result.differences)
    rows: list[tuple[str, ...]] = []
    strong = []
    for one in result.differences:
        name = result.runs[one.run].name if len(result.runs) > 2 else ""
        head = ", ".join(part for part in (name, one.label) if part)
        if several and len(one.scores) > 1:
            strong.append(len(rows))
            rows.append((head, "", "", "", "", ""))
        for score in one.scores:
            words, unit = quantity_words(result, score.quantity)
            factor, unit = in_units(result.units, unit)
            alone = f"{head}: " if several and len(one.scores) == 1 else ""
            where = _time(score.largest_at)
            if score.quantity == "horizontal" and one.place:
                where += f" ({', '.join(_placed(*p, result.units) for p in one.place)})"
            same = score.largest < SAME_PLACE
            rows.append(
                (
                    f"{alone}{words}, {unit}",
                    SAME if same else _digits(factor * score.rms),
                    SAME if same else _digits(factor * score.largest),
                    "" if same else where,
                    NONE if score.bound is None else half_words(factor * score.bound),
                    NONE if score.share is None else share_words(score.share),
                )
            )
    columns = ("", "rms", "largest", "at", "95 % bound, rms", "time within")
    ends = [(one.table.index[0], one.table.index[-1]) for one in result.differences]
    spans = {f"{_time(float(a)).removesuffix(f'{GAP}s')} to {_time(float(b))}" for a, b in ends}
    caption = (
        f"Minus {result.runs[0].name}, {' and '.join(sorted(spans))}; the bound is that of the "
        "difference."
    )
    return TableBlock(columns, tuple(rows), (0, 3), caption, tuple(strong))


def _time(time: float) -> str:
    """Format an instant: of a crash to a tenth of a millisecond, of a drive to a hundredth."""
    return instant(time) if abs(time) < 10.0 else stamp(time)


def _placed(name: str, value: float, unit: str, system: str | None) -> str:
    if unit == "deg":
        return f"{name} {plain(value, 6)}°"
    factor, shown_as = in_units(system, unit)
    return f"{name} {plain(factor * value, 2)}{GAP}{shown_as}"


def _digits(value: float) -> str:
    return _tiny(value) if 0.0 < value < 1e-6 else plain(value, decimals(value, 3, most=7))


def codes_block(result: RunComparison) -> TableBlock | None:
    """Return the findings that some runs have and others do not."""
    found = [one for one in result.codes if one.differs]
    if not found:
        return None
    rows = tuple(
        (
            one.severity,
            one.code,
            *(("yes" if n == 1 else f"{n} times") if n else NONE for n in one.counts),
            one.sentence,
        )
        for one in found
    )
    columns = ("", "code", *_names(result), "what it says")
    return TableBlock(columns, rows, text=tuple(range(len(columns))))


def conditions_block(result: RunComparison) -> TableBlock | None:
    """Return versions and properties of the platform that differ."""
    if not result.conditions:
        return None
    rows = tuple((row.name, *(_condition(v) for v in row.values)) for row in result.conditions)
    return TableBlock(("", *_names(result)), rows, text=_all_text(result))


def _condition(value: str | None) -> str:
    if value is None:
        return NONE
    return f"{value[:12]}…" if len(value) == 64 else value


def seconds_block(result: RunComparison) -> TableBlock | None:
    """Return the seconds of each stage, and of all."""
    if not any(result.seconds):
        return None
    stages = list(dict.fromkeys(stage for one in result.seconds for stage in one))
    rows = [
        (stage, *(f"{one[stage]:.2f} s" if stage in one else NONE for one in result.seconds))
        for stage in stages
    ]
    total = tuple(f"{sum(one.values()):.2f} s" if one else NONE for one in result.seconds)
    rows.append(("in all", *total))
    return TableBlock(("stage", *_names(result)), tuple(rows), strong=(len(rows) - 1,))


def _runs_block(result: RunComparison) -> Facts:
    rows = []
    for run in result.runs:
        for part in run.parts:
            name = f"{run.name}, {part.label}" if part.label else run.name
            rows.append((name, f"{run.command}, seal sha256 {part.seal}"))
            rows += [
                (f"{name}, changed", f"{one.file}: {one.sentence('cli')}") for one in part.changed
            ]
    return Facts(tuple(rows))


def _names(result: RunComparison) -> tuple[str, ...]:
    return tuple(run.name for run in result.runs)


def _all_text(result: RunComparison) -> tuple[int, ...]:
    return tuple(range(len(result.runs) + 1))


def total_words(result: RunComparison) -> str:
    """Say how long each run took."""
    parts = [
        f"{run.name} {duration_words(sum(one.values()))}"
        for run, one in zip(result.runs, result.seconds, strict=True)
        if one
    ]
    return f"Time taken, indicative: {', '.join(parts)}." if parts else ""
