"""The page of a comparison: what differs in options, inputs, numbers and over time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from strapdown.config.toml_file import shown
from strapdown.constants import STANDARD_GRAVITY
from strapdown.report.compare_charts import charts, in_units, quantity_words
from strapdown.report.compare_numbers import Value
from strapdown.report.compare_tracks import QUANTITIES, DifferenceScore
from strapdown.report.document import (
    Block,
    Document,
    Facts,
    KeyFigure,
    KeyFigures,
    Paragraph,
    TableBlock,
    document_of,
    findings_list,
    listed,
    run_again,
    section,
    table_of,
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
#: Rounding of zero in double precision, in any unit that is shown.
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
        same = result.same_command
        said.append("All options are the same." if same else "No common option differs.")
    else:
        few = ", ".join(keys[:3]) + (f" and {len(keys) - 3} more" if len(keys) > 3 else "")
        said.append(
            f"{len(keys)} {'option differs' if len(keys) == 1 else 'options differ'}: {few}."
        )
    other = [row.role for row in result.inputs if not row.same]
    if not result.inputs:
        said.append("No run has input files.")
    elif other:
        said.append(f"Other inputs: {', '.join(dict.fromkeys(other))}.")
    elif any("renamed" in row.status for row in result.inputs):
        said.append("The inputs have the same bytes, under other names.")
    else:
        said.append("The inputs are the same.")
    if result.same_command and result.numbers:
        said.append(_numbers_words(result))
    for one in result.differences:
        if (score := one.score("horizontal")) is not None:
            of = f"{runs[one.run].name}: " if len(runs) > 2 else ""
            vehicle = f" of {one.label}" if one.label else ""
            if score.largest < SAME_PLACE:
                said.append(f"{of}Horizontal positions{vehicle} are the same at all times.")
                continue
            within = f", {shares}" if (shares := _within_words(score)) else ""
            said.append(
                f"{of}Horizontal positions{vehicle} differ by {length_words(score.rms)} (rms), "
                f"{length_words(score.largest)} at most{within}."
            )
    return " ".join(said)


def _within_words(score: DifferenceScore) -> str:
    """Share of the time within the bounds; empty without bounds."""
    share = score.share
    return "" if share is None else f"within their bounds {share_words(share)} of the time"


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


def compare_document(result: RunComparison, name: str) -> Document:
    """Return the page of a comparison; `name`: that of its folder."""
    drawn = {chart.slug: chart for chart in charts(result)}
    plans = [chart for slug, chart in drawn.items() if slug.startswith("plan")]
    over = [chart for slug, chart in drawn.items() if not slug.startswith("plan")]
    several = result.same_command
    same = sum(row.same for row in result.numbers)
    whole = numbers_block(result, every=True) if several else None
    count = f"All {len(result.numbers)} numbers ({same} are the same)"
    codes = codes_block(result) or Paragraph("None.")
    sections = [
        section("options", "Options that differ", *_options(result)),
        section("inputs", "Inputs", inputs_block(result) or Paragraph("None: simulations.")),
        section("numbers", "Numbers that differ", *_numbers(result)) if several else None,
        section("time", "Differences over time", scores_block(result), *over),
        section("plan", "Plan", *plans),
        section("findings", "Findings that not all runs have", codes) if several else None,
        section("all", count, whole, folded=True),
        section(
            "conditions",
            "Versions and platform",
            conditions_block(result) or Paragraph("The same."),
            folded=True,
        ),
        section("seconds", "Time taken, indicative", seconds_block(result), folded=True),
        section("runs", "Runs and their seals", _runs_block(result), folded=True),
        section("method", "Method", listed(METHOD), folded=True),
        section("again", "Check this folder", *run_again(name)),
    ]
    facts = []
    for k, run in enumerate(result.runs, start=1):
        ran = ", run for this comparison" if run.ran else ""
        changed = " – changed after it was sealed" if run.changed else ""
        facts.append((f"Run {k}", f"{run.name} ({run.command}{ran}){changed}"))
    return document_of(
        " | ".join(_names(result)),
        "Results compared",
        facts,
        front(result),
        (one for one in sections if one is not None and one.blocks),
        links=(("compare.json", "all of it, for programs"),),
    )


def front(result: RunComparison) -> Iterator[Block]:
    """Yield the answer: warnings, a few sentences, key numbers."""
    if result.changed:
        names = ", ".join(run.name for run in result.runs if run.changed)
        yield Paragraph(
            f"Changed after it was sealed: {names}. Its numbers are those of the changed files.",
            "warning",
        )
    yield Paragraph(headline(result), "lead")
    if figures := tuple(_figures(result)):
        yield KeyFigures(figures)
    if warnings := [one for one in result.findings if one.severity != "note"]:
        yield findings_list(warnings, "cli")
    for note in result.findings:
        if note.severity == "note":
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
            yield KeyFigure(
                f"{name[0].upper()}{name[1:]}{of}",
                _amount(score.rms, score.unit),
                f"rms of the difference; {_amount(score.largest, score.unit)} at most, at "
                f"{_time(score.largest_at)}",
                _within_words(score),
            )
    for row in result.numbers:
        if row.key.endswith((".delta_v_m_per_s", ".pdof_deg")) and row.key.startswith(
            ("main.", "vehicle ")
        ):
            if ".recorders." in row.key or row.differences[1] is None:
                continue
            factor, unit = _scale(row, result.units)
            bound = "difference"
            if (half := row.combined[1]) is not None:
                words = {True: "within ± ", False: "outside ± ", None: ""}[row.within[1]]
                bound += f", {words}{half_words(factor * half)} {unit}"
            yield KeyFigure(
                f"{row.any.label[0].upper()}{row.any.label[1:]}",
                f"{_signed(factor * row.differences[1])} {unit}",
                bound,
            )


# Tables.


def options_block(result: RunComparison) -> TableBlock | None:
    """Return the options that differ, side by side."""
    rows = ((row.key, *map(_option, row.values)) for row in result.options)
    return table_of(("option", *_names(result)), rows, text=_all_text(result))


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


def _option(value: Any) -> str:
    if value is None:
        return NONE
    return value if isinstance(value, str) and len(value) <= 80 else shown(value)


def inputs_block(result: RunComparison) -> TableBlock | None:
    """Return the inputs, and whether they have the same bytes."""
    said = {
        "first": "{}",
        "same": "same bytes",
        "renamed": "{}: same bytes, other name",
        "changed": "{}: other bytes",
    }
    rows = []
    for row in result.inputs:
        pairs = zip(row.files, row.status, strict=True)
        cells = (NONE if file is None else said[how].format(file[0]) for file, how in pairs)
        rows.append((row.role, *cells))
    return table_of(("input", *_names(result)), rows, text=_all_text(result))


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
    caption = "Difference: a run minus the first."
    if not two:
        caption = "In brackets: minus the first; ! outside the 95 % bound of the difference."
    return table_of(columns, rows, caption, strong=strong)


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
    said = shown_row(row, result.units)
    metres = f"{GAP}m" if row.any.kind in ("lat", "lon") else ""
    yield f"{row.any.label}, {said['unit']}" if said["unit"] else row.any.label
    # Of equal positions, "same" has no unit.
    apart = [
        text + (metres if text and number else "")
        for text, number in zip(said["differences"], row.differences, strict=True)
    ]
    for k, (value, bound) in enumerate(zip(said["values"], said["bounds"], strict=True)):
        text = f"{value} {bound}{metres if bound else ''}".strip()
        if not two and k and apart[k] and not _is_word(row, k):
            text += f" ({apart[k]}{' !' if row.within[k] is False else ''})"
        yield text
    if two:
        yield apart[1]
        word = "within" if row.within[1] else "outside"
        half = said["combined"][1].replace(f"±{GAP}", "± ")
        yield f"{word} {half}{metres}" if half else ""


def _is_word(row: NumberRow, k: int) -> bool:
    own = row.values[k]
    return own is not None and isinstance(own.value, str)


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
    if row.alike(k):
        return SAME
    half = row.combined[k]
    if half is not None and math.isfinite(half) and half > 0.0:
        said, _ = bounded(factor * apart, factor * half)
        signed = row.any.kind != "horizontal" and said.strip("0.") and not said.startswith(MINUS)
        return f"+{said}" if signed else said
    if row.any.kind == "horizontal":
        return plain(apart, decimals(apart, 2))
    return _signed(factor * apart) if apart else "0"


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
    if value.kind == "count" or (shown == round(shown) and abs(shown) < 1e6):
        return plain(shown, 0), ""
    if abs(shown) < 0.5 * 10.0**-places:
        return (_tiny(shown) if abs(shown) > ROUNDING else "0"), ""
    return plain(shown, places), ""


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
    known = [v for v in row.values if v is not None]
    halves = [h for v in known for h in (v.below, v.above) if h is not None and 0.0 < h < math.inf]
    if halves:
        return decimals(factor * min(halves), 2, most=6)
    sizes = [abs(v.value) for v in known if isinstance(v.value, float | int) and v.value]
    apart = [abs(d) for d in row.differences if d]
    least = decimals(factor * max(sizes), 4, most=6) if sizes else 2
    return max(least, decimals(factor * min(apart), 2, most=6)) if apart else least


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
    columns = "| rms | largest | at | 95 % bound, rms | time within"
    ends = [(one.table.index[0], one.table.index[-1]) for one in result.differences]
    spans = {f"{_time(float(a)).removesuffix(f'{GAP}s')} to {_time(float(b))}" for a, b in ends}
    caption = (
        f"Minus {result.runs[0].name}, {' and '.join(sorted(spans))}; the bound is that of the "
        "difference."
    )
    return table_of(columns, rows, caption, text=(0, 3), strong=strong)


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
    rows = []
    for one in result.codes:
        if one.differs:
            counts = (("yes" if n == 1 else f"{n} times") if n else NONE for n in one.counts)
            rows.append((one.severity, one.code, *counts, one.sentence))
    columns = ("", "code", *_names(result), "what it says")
    return table_of(columns, rows, text=range(len(columns)))


def conditions_block(result: RunComparison) -> TableBlock | None:
    """Return versions and properties of the platform that differ."""
    rows = []
    for row in result.conditions:
        # Of a digest the begin.
        cells = (NONE if v is None else f"{v[:12]}…" if len(v) == 64 else v for v in row.values)
        rows.append((row.name, *cells))
    return table_of(("", *_names(result)), rows, text=_all_text(result))


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
    return table_of(("stage", *_names(result)), rows, strong=(len(rows) - 1,))


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
