"""Terminal output of ``strapdown navigate``: at most 40 lines, or all with ``--verbose``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from strapdown.cli.console import WORDS, console, print_blocks, print_findings, print_table
from strapdown.errors import Finding
from strapdown.report.document import MOST_SAID, TableBlock
from strapdown.report.navigation_document import (
    cautions,
    end_table,
    error_table,
    observation_table,
    outage_table,
    point_table,
    state_table,
    withheld_table,
)
from strapdown.report.navigation_evaluation import (
    NavigationEvaluation,
    distance_over_ground,
    trust,
)
from strapdown.report.values import (
    duration_words,
    length_words,
    plain,
    spaced,
)
from strapdown.report.verdict import terminal_lines
from strapdown.rotation import within_half_turn
from strapdown.systems.navigation_run import NavigationRun

if TYPE_CHECKING:
    from strapdown.live.replay import Latency

#: Most lines of the answer, of which the paths and the seal take the last four.
LINES, PATHS = 40, 4
#: Most rows of a table: of the answer, of its first table, and of those with `--verbose`.
MOST, MOST_VERBOSE = 6, 12
STYLES = {"trusted": "green", "reserve": "yellow", "distrusted": "bold red"}
#: Quantities of `end_table` with an error against the truth.
SCORES = {
    "horizontal ±": "horizontal",
    "height": "down",
    "velocity north": "VN",
    "velocity east": "VE",
    "velocity down": "VD",
    "heading": "heading",
    "pitch": "pitch",
    "roll": "roll",
}


def print_navigation(
    result: NavigationRun, findings: Sequence[Finding] = (), *, verbose: bool = False
) -> None:
    """Print the final state of a run, its uncertainty, the verdict, and findings.

    `findings`: printed on the error stream, as many as there is room for. `verbose`: print also the
    start's and the sensors' tables, every caution and every finding.
    """
    out = console()
    evaluation = NavigationEvaluation(result)
    verdict = trust(evaluation)
    trajectory = result.record.trajectory
    time = trajectory.index
    duration = duration_words(float(time[-1] - time[0]))
    distance = length_words(distance_over_ground(trajectory))
    name = f"{result.source.name}: {result.source.what}"
    out.print(spaced(f"{name}, {duration}, {distance}, {len(time)} samples"))
    pair: TableBlock | None = None
    if evaluation.pair:
        from strapdown.report.paired_corrections import paired_table

        pair = paired_table(evaluation)
    seen = pair, point_table(evaluation), observation_table(evaluation)
    withheld = withheld_table(evaluation)
    tables: tuple[TableBlock | None, ...] = (_end(evaluation), *seen, withheld)
    if verbose:
        ends = end_table(evaluation), error_table(evaluation)
        tables = (*ends, *seen, outage_table(evaluation), withheld, state_table(evaluation))
    lines = [(verdict.sentence, STYLES[verdict.verdict])]
    lines += [(f"{head}: {said}", "") for head, said in cautions(evaluation, brief=not verbose)]
    lines += terminal_lines(evaluation, brief=not verbose)
    room = LINES - PATHS - 1
    for k, block in enumerate(tables):
        if block is not None:
            most = MOST_VERBOSE if verbose or not k else MOST
            print_blocks(replace(block, rows=block.rows[:most]))
            room -= 4 + min(len(block.rows), most)
            if len(block.rows) > most:
                out.print(f"  {len(block.rows) - most} more rows; see the report")
                room -= 1
    for said, style in lines:
        out.print(spaced(said), style=style)
        room -= _lines(said, out.width)
    if verbose:
        print_findings(findings)
        return
    # The verdict says the first of these already; alone, they have room for row and remedy.
    said_already = verdict.against[:MOST_SAID]
    others = [one for one in findings if one not in said_already] or list(findings)
    others.sort(key=lambda one: one.severity == "note")
    print_findings(others, _fitting(others, room, out.width))


def _end(evaluation: NavigationEvaluation) -> TableBlock:
    """Start and end with 95 % bounds, and the errors of the run where the truth is known."""
    block = end_table(evaluation)
    errors = error_table(evaluation)
    of: dict[str, tuple[str, ...]] = {}
    if evaluation.errors is not None and errors is not None:
        of = dict(zip((s.quantity for s in evaluation.errors.scores), errors.rows, strict=True))
    rows = []
    for name, *cells in block.rows:
        shown = of.get(SCORES.get(name, ""), ("",) * 6)
        if name == "position":
            # The height has a row of its own.
            name = "latitude, longitude"
            ends = evaluation.record.trajectory[["lat", "lon"]].iloc[[0, -1]].to_numpy()
            cells = [
                f"{plain(float(lat), 6)}°, {plain(float(within_half_turn(lon)), 6)}°"
                for lat, lon in ends
            ]
        rows.append((name, *cells, *((shown[1], shown[2], shown[5]) if of else ())))
    more = ("error, rms", "largest", "within bound") if of else ()
    return replace(block, columns=(*block.columns, *more), rows=tuple(rows))


def _lines(text: str, width: int) -> int:
    """Lines of a text on a terminal of so many columns."""
    return max(1, -(-len(text) // width))


def _fitting(findings: Sequence[Finding], room: int, width: int) -> int:
    """Number of findings that fit into so many lines, with one for the number of the others."""
    words = WORDS.get()
    used = 0
    for count, one in enumerate(findings):
        used += sum(_lines(line, width) for line in f"note: {one.text(words)}".splitlines())
        if used + (count + 1 < len(findings)) > room:
            return count
    return len(findings)


def print_latency(latency: Latency, what: str, of: str = "sample to state") -> None:
    """Print a latency `of` samples, and missed deadlines; `what` delivered them."""
    times = [_ms(t) for t in (latency.median, latency.most, latency.largest)]
    missed = "-" if latency.missed is None else str(latency.missed)
    behind = "-" if latency.behind is None else _ms(latency.behind)
    print_table(
        [f"{of}, ms", "samples", "median", "99 %", "largest", "missed", "behind", ""],
        [[what, str(latency.samples), *times, missed, behind, ""]],
    )


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.3f}"
