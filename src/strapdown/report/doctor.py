"""Write the diagnosis of logs as a sealed bundle: one page and one JSON."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from strapdown.bundle import write_json
from strapdown.config.logs import DoctorSpec
from strapdown.constants import MICRO_G, Array
from strapdown.errors import DataError, Finding, Words
from strapdown.formats.clocks import UNIX, on_clock_of
from strapdown.formats.recording import AXES_OF_SENSOR, PLACEHOLDERS
from strapdown.frames import ways_between
from strapdown.report.chart import AXIS_COLOURS, BLACK, BLUE, GREY, Band, Chart, Line, Panel, curve
from strapdown.report.document import (
    Block,
    Document,
    Facts,
    Paragraph,
    Section,
    TableBlock,
    capital,
    document_of,
    findings_list,
    items_of,
    paragraph,
    run_again,
    section,
    table_of,
)
from strapdown.report.report_bundle import bundle_by_specification, finite, with_page
from strapdown.report.values import duration_words, instant, small
from strapdown.systems.doctor import (
    USES,
    Diagnosis,
    LogDiagnosis,
    of_other_file,
    refused_fixes,
    run_doctor,
)
from strapdown.tables import ACCEL, GEODETIC, GYRO, VELOCITY, VELOCITY_SD, find_gaps
from strapdown.tables.checks import HEIGHTS_AS_STATED, height_words, index_of, values_of

#: Commands of the uses.
COMMANDS = {"attitude": "attitude", "navigation": "init navigate", "crash": "init crash"}
#: Stationary stretches in a table and bands in a chart, at most.
MOST_RESTS, MOST_BANDS = 12, 40
BUCKETS = 500
#: Seconds since 1970 beyond which a date has no year of four digits.
LATEST = 2.5e11


def _write_data(result: Diagnosis, folder: Path) -> None:
    write_json(folder / "doctor.json", diagnosis_json(result))


def diagnosis_json(result: Diagnosis, words: Words = "cli") -> dict[str, Any]:
    """Return a diagnosis as plain data for programs, its sentences in these words.

    Returns
    -------
    dict
        ``logs``, each with its streams, columns, channels, stationary stretches, and for each use
        the answer with its reasons; questions, faults and notes; ``between`` the logs.
    """
    logs = [
        {
            **one.data,
            "fit": {
                use: {"answer": one.answer(use), "reasons": _listed(one.fit[use], words)}
                for use in USES
            },
            "questions": _listed(one.questions, words),
            "faults": _listed(one.faults, words),
            "notes": _listed(one.notes, words),
        }
        for one in result.logs
    ]
    return finite({"logs": logs, "between": _listed(result.between, words)})


def _listed(findings: Iterable[Finding], words: Words) -> list[Any]:
    return [one.plain(words) for one in findings]


# The answer, which page and terminal share.


def headline(one: LogDiagnosis) -> str:
    """Say what a log is fit for, in one sentence."""
    if not uses(one):
        held = " and ".join(str(s["name"]) for s in one.data["streams"]) or "fixes, not read yet"
        if log := one.data["fixes_for"]:
            return f"{one.name}: {held}, examined as the fixes of {log}."
        return f"{one.name}: {held} without inertial samples; give it beside an IMU log."
    words = {"yes": "fit for {}", "with limits": "fit for {} with limits", "no": "not fit for {}"}
    by_answer: dict[str, list[str]] = {}
    for use in USES:
        by_answer.setdefault(one.answer(use), []).append(use)
    parts = []
    for answer, text in words.items():
        *others, last = by_answer.get(answer, [""])
        if last:
            parts.append(text.format(f"{', '.join(others)} or {last}" if others else last))
    return f"{one.name}: {'; '.join(parts)}."


def uses(one: LogDiagnosis) -> tuple[str, ...]:
    """Return the uses that a log is judged for: none of fixes or a reference alone."""
    alone = one.streams and "imu" not in one.streams and not one.questions
    return () if alone or one.data["fixes_for"] else USES


def reasons(one: LogDiagnosis, use: str) -> str:
    """List what prevents or limits a use, faults by their number; else what supports it."""
    found = one.fit[use]
    against = [f for f in found if f.severity != "note"]
    if preventing := [f for f in against if f.severity == "error"]:
        against = preventing
    numbered = {_key(f): k for k, f in enumerate((*one.questions, *one.faults), 1)}
    said: list[str] = []
    for finding in against or found:
        number = numbered.get(_key(finding))
        if number is not None:
            said.append(f"point {number}" + (f" ({finding.quantity})" if finding.quantity else ""))
            continue
        text = finding.sentence("cli").partition("\n")[0]
        if finding.severity == "warning" and (helps := finding.advice("cli")):
            text = f"{text}; {helps}"
        said.append(f"{text} ({finding.quantity})" if finding.quantity else text)
    return "; ".join(dict.fromkeys(said))


def _key(finding: Finding) -> tuple[str, str | None, int | None]:
    return finding.code, finding.quantity, finding.row


def command(
    one: LogDiagnosis, use: str, log: str | None = None, fixes: str | None = None
) -> str | None:
    """Return the command line for a use; None if the log is not fit for it.

    `log`, `fixes`: paths; by default the names of the files.
    """
    if one.answer(use) == "no":
        return None
    flags = one.data["options"] if use != "crash" else ""
    if use == "navigation":
        beside = fixes or one.data["fixes_from"]
        flags += f" --gnss {shlex.quote(beside)}" if beside else ""
        flags = f"{flags} {one.data['fixes_options']}".strip()
    return _line(COMMANDS[use], flags, log or one.name)


def way(one: LogDiagnosis, use: str) -> str | None:
    """Return how a log becomes fit for a use that it is not fit for."""
    known = {_key(f) for f in (*one.questions, *one.faults)}
    preventing = [f for f in one.fit[use] if f.severity == "error" and _key(f) not in known]
    return next((a for f in preventing if (a := f.advice("cli"))), None)


def answering(one: LogDiagnosis, logs: Sequence[str]) -> str | None:
    """Return the command line that answers the open questions as inferred.

    `logs`: the file and those that were examined with it.
    """
    found = [one.refused if one.questions else None, refused_fixes(one)]
    more = [str(f.data.get("flags") or "") for f in found if f is not None]
    if not any(more) and not one.answers:
        return None  # the same command would be refused again
    flags = [str(one.data["options"]), *more, str(one.data["fixes_options"])]
    return _line("doctor", " ".join(part for part in flags if part), *logs)


def _line(name: str, flags: str, *logs: str) -> str:
    return f"strapdown {name} {shlex.join(logs)} {flags}".strip()


def wrong(one: LogDiagnosis) -> list[tuple[str, str, str]]:
    """List the location, sentence and fix of each question and fault."""
    return [
        (
            ", ".join(p for p in (file, f.quantity, f.row and f"row {f.row}") if p),
            f.sentence("cli"),
            f.advice("cli") or "",
        )
        for f in (*one.questions, *one.faults)
        for file in (of_other_file(one, f) and f.file,)
    ]


def stream_table(one: LogDiagnosis) -> TableBlock | None:
    """Rows, span, rate, gaps and clock of each stream."""
    rows = []
    for s in one.data["streams"]:
        rate = s["rate_hz"]
        gaps = f"{s['gaps']}, {small(s['longest_gap_s'])} s at most" if s["gaps"] else "none"
        rows.append(
            (
                s["name"],
                str(s["rows"]),
                instant(s["from_s"]),
                instant(s["to_s"]),
                "–" if rate is None else f"{rate:.4g}",
                gaps,
                _clock(s["clock"], s["clock_origin_s"]),
            )
        )
    return table_of("stream | rows | from | to | rate, Hz | gaps | clock", rows, text=(0, 5, 6))


def _clock(name: str, origin: float) -> str:
    """Name a clock with the instant at 0 s of the stamps."""
    if name == UNIX and 0.0 < origin < LATEST:
        zero = datetime.fromtimestamp(origin, UTC)
        return f"unix, 0 s is {zero:%Y-%m-%d %H:%M:%S} UTC"
    return f"{name} + {origin:.9g} s" if origin else name


def _stated_axes(one: LogDiagnosis) -> bool:
    return one.recording is None or one.recording.imu.attrs["axes"] != AXES_OF_SENSOR


def channel_table(one: LogDiagnosis) -> TableBlock | None:
    """Source, unit, range, noise and resolution of each channel."""
    sources = {r["quantity"].lstrip("-"): r for r in one.data["read_as"]}
    rows = []
    for name, c in one.data["channels"].items():
        factor = math.degrees(1.0) if name in GYRO else 1.0
        step, column = c["quantization"], "–"
        if (read := sources.get(name)) is not None:
            sign = "-" if read["quantity"].startswith("-") else ""
            column = f"{sign}{read['source']}, {read['unit']}"
        rows.append(
            (
                name,
                column,
                f"{factor * c['least']:.4g} to {factor * c['largest']:.4g}",
                f"{factor * c['noise']:.2g}",
                "–" if step is None else f"{factor * step:.2g}",
                ", ".join(dict.fromkeys(c["faults"])) or "none",
            )
        )
    axes = "Body axes forward, right, down" if _stated_axes(one) else "Axes as in the file"
    caption = f"{axes}. Gyros in deg/s, accelerometers in m/s²."
    columns = "channel | column, unit | range | noise | step | faults"
    return table_of(columns, rows, caption, text=(0, 1, 5))


def rest_table(one: LogDiagnosis) -> TableBlock | None:
    """Longest stationary stretches with the noise there."""
    rests = sorted(one.data["stationary"], key=lambda r: r["from_s"] - r["to_s"])[:MOST_RESTS]
    rows = []
    for r in sorted(rests, key=lambda r: float(r["from_s"])):
        bias = math.degrees(float(np.linalg.norm(r["gyro_mean_rad_per_s"])))
        gyro = [60.0 * math.degrees(x) for x in r["gyro_density_rad_per_s_per_sqrt_hz"]]
        accel = [MICRO_G * x for x in r["accel_density_m_per_s2_per_sqrt_hz"]]
        size = r["accel_size_m_per_s2"]
        rows.append(
            (
                f"{instant(r['from_s'])} to {instant(r['to_s'])}",
                r["grade"],
                f"{bias:.3g}",
                f"{math.degrees(max(r['gyro_sd_rad_per_s'])):.2g}",
                f"{max(gyro):.2g}",
                "–" if size is None else f"{size:.4f}",
                f"{max(r['accel_sd_m_per_s2']):.2g}" if r["accel_sd_m_per_s2"] else "–",
                f"{max(accel):.3g}" if accel else "–",
            )
        )
    more = len(one.data["stationary"]) - len(rows)
    caption = (
        "Noise of the noisiest axis: standard deviation, and white noise by second differences."
    )
    caption += f" {more} shorter ones are in doctor.json." if more > 0 else ""
    columns = "stationary | grade | gyro mean, deg/s | sd, deg/s | deg/√h"
    columns += " | force, m/s² | sd, m/s² | µg/√Hz"
    return table_of(columns, rows, caption, text=(0, 1))


# The page.


def doctor_document(result: Diagnosis, name: str = "") -> Document:
    """Return the report of a diagnosis."""
    sections: list[Section] = []
    if several := len(result.logs) > 1:
        between = findings_list(result.between, "cli")
        sections.append(section("between", "Between the logs", between))
    for k, one in enumerate(result.logs):
        sections += _sections(one, *((f"{k + 1}-", f"{one.name}: ") if several else ("", "")))
    if name:
        sections.append(section("again", "Check this folder", *run_again(name)))
    title = ", ".join(one.name for one in result.logs)
    names = [Path(log.path).resolve().name for log in result.spec.logs]
    front = (block for one in result.logs for block in _answer(one, names))
    return document_of(title, "Content of the log, and its faults", (), front, sections)


def _answer(one: LogDiagnosis, names: Sequence[str]) -> tuple[Block | None, ...]:
    shown = uses(one)
    good = not shown or any(one.answer(use) == "yes" for use in shown)
    rows = []
    for use in shown:
        helps = way(one, use)
        text = f"{capital(reasons(one, use))}.{f' {capital(helps)}.' if helps else ''}"
        rows.append((f"{capital(use)}: {one.answer(use)}", text))
    commands = [line for use in shown if (line := command(one, use))]
    ask = answering(one, names)
    blanks = ", ".join(sorted(PLACEHOLDERS & set((ask or "").split())))
    asked = f"With {blanks} filled in, and" if blanks else "With"
    faults = [
        (head, f"{capital(text)}. {'Fix: ' + fix + '.' if fix else ''}".strip())
        for head, text, fix in wrong(one)
    ]
    return (
        Paragraph(headline(one), "lead" if good else "warning"),
        items_of(rows),
        paragraph("\n".join(commands), "mono"),
        Paragraph("Faults, and the remedy of each:" if faults else "No fault was found."),
        items_of(faults, numbered=True),
        paragraph(f"{asked} every question answered as inferred:" if ask else None),
        paragraph(ask, "mono"),
    )


def _sections(one: LogDiagnosis, slug: str, title: str) -> list[Section]:
    read = [
        (f"{r['source']} → {r['quantity']}", f"{r['unit']}; {r['why']}; first value {r['first']}")
        for r in one.data["read_as"]
    ]
    columns = [
        (
            c["name"] + (f" [{c['unit']}]" if c["unit"] else ""),
            f"{c['least']:.6g} to {c['largest']:.6g}; first {c['first']}"
            if "least" in c
            else f"first {c['first']}",
        )
        for c in one.data["columns"]
    ]
    return [
        section(f"{slug}signals", f"{title}Signals", signal_chart(one, slug), fix_chart(one, slug)),
        section(f"{slug}streams", f"{title}Streams", stream_table(one), Facts(_facts(one))),
        section(
            f"{slug}channels",
            f"{title}Channels and stationary stretches",
            channel_table(one),
            rest_table(one),
            folded=True,
        ),
        section(
            f"{slug}columns",
            f"{title}Units and axes, with the evidence",
            items_of(read),
            items_of(columns),
            folded=True,
        ),
        section(f"{slug}notes", f"{title}Notes", findings_list(one.notes, "cli")),
    ]


def _facts(one: LogDiagnosis) -> tuple[tuple[str, str], ...]:
    data = one.data
    rows = []
    if data["format"] is not None:
        rows.append(("Format", data["format"]["title"]))
    if stamps := data["stamps"]:
        low, usual, high = (1e3 * stamps[f"{k}_s"] for k in _STEPS)
        rows.append(("Steps of time", f"{usual:.4g} ms; 98 % from {low:.4g} to {high:.4g} ms"))
    if (gravity := data["gravity"]) is not None:
        rest = gravity["at_rest_m_per_s2"]
        size = f"median {gravity['median_m_per_s2']:.4g} m/s²"
        size += "" if rest is None else f", {rest:.5g} m/s² at rest"
        rows.append(("Gravity", f"{'included' if gravity['included'] else 'removed'}; {size}"))
    if clock := data["receiver_clock"]:
        said = f"{clock['offset_s']:.3f} ± {clock['sd_s']:.2g} s against the samples (1 sd)"
        rows.append(("Receiver clock", said))
    if warm := data["temperature"]:
        rows.append(("Temperature", f"{warm['least_degc']:.4g} to {warm['largest_degc']:.4g} °C"))
    if rests := data["stationary"]:
        total = math.fsum(r["to_s"] - r["from_s"] for r in rests)
        count = f"{len(rests)} stretches" if len(rests) > 1 else "1 stretch"
        rows.append(("Stationary", f"{count}, {duration_words(total)} in all"))
    return tuple(rows)


_STEPS = ("low_1_percent", "median", "high_1_percent")


# Charts.


def signal_chart(one: LogDiagnosis, slug: str = "") -> Chart | None:
    """Angular rate, specific force with its magnitude, steps of time, and speed of the fixes."""
    imu = one.streams.get("imu")
    if imu is None:
        return None
    time = index_of(imu)
    names = _AXES if _stated_axes(one) else tuple("xyz")
    gaps = [gap.sample for gap in find_gaps(time)]

    between = np.insert(time, gaps, [0.5 * (time[k] + time[k - 1]) for k in gaps])

    def line(name: str, values: Array, colour: str, width: float = 0.9) -> Line:
        broken = np.insert(values, gaps, np.nan)
        return curve(name, between, broken, colour, width=width, buckets=BUCKETS)

    def triad(columns: list[str], factor: float) -> list[Line]:
        return [
            line(axis, factor * imu[c].to_numpy(dtype=np.float64), colour)
            for axis, c, colour in zip(names, columns, AXIS_COLOURS, strict=True)
        ]

    panels = [Panel("rate, deg/s", tuple(triad(GYRO, math.degrees(1.0))), title="Gyros")]
    if ACCEL[0] in imu.columns:
        size = np.linalg.norm(values_of(imu, ACCEL), axis=1)
        lines = [line("magnitude", size, BLACK, 0.7), *triad(ACCEL, 1.0)]
        panels.append(Panel("force, m/s²", tuple(lines), title="Accelerometers"))
    steps = curve("step", time[1:], 1e3 * np.diff(time), GREY, width=0.9, buckets=BUCKETS)
    panels.append(Panel("step, ms", (steps,), title="Steps of time", height=0.6))
    if (fixes := _speed(one)) is not None:
        panels.append(Panel("speed, m/s", (fixes,), title="Fixes", height=0.7))
    return Chart(
        f"{slug}signals",
        "Signals in body axes" if _stated_axes(one) else "Signals in axes that are not stated",
        "Least and largest values of each pixel. Bands: stationary stretches and faults.",
        "time, s",
        tuple(panels),
        bands=_bands(one),
    )


_AXES = ("x, forward", "y, right", "z, down")


def _bands(one: LogDiagnosis) -> tuple[Band, ...]:
    """Longest stationary stretches, and stretches of channel faults."""
    rests = sorted(one.rests, key=lambda r: r.start - r.end)[:MOST_BANDS]
    found = [Band(r.start, r.end, "at rest") for r in rests]
    for fault in one.faults:
        reason = fault.data.get("reason")
        if fault.code == "navigation.channel-fault" and isinstance(reason, Finding):
            found.append(Band(reason.data["begin"], reason.data["end"], str(fault.quantity)))
    return tuple(sorted(found, key=lambda b: b.start))


def _speed(one: LogDiagnosis) -> Line | None:
    """Horizontal speed of the fixes on the clock of the samples, measured or by positions."""
    gnss, imu = one.streams.get("gnss"), one.streams.get("imu")
    if gnss is None or len(gnss) < 2:
        return None
    if imu is not None:
        try:
            gnss, _ = on_clock_of(gnss, imu)
        except DataError:
            return None
        stamps, time = index_of(imu), index_of(gnss)
        gnss = gnss[(time >= stamps[0]) & (time <= stamps[-1])]
        if len(gnss) < 2:
            return None
    time = index_of(gnss)
    known = np.isfinite(values_of(gnss, VELOCITY_SD[:2])).all(axis=1)
    if known.any():
        speed = np.where(known, np.hypot(*values_of(gnss, VELOCITY)[:, :2].T), np.nan)
    else:
        speed = np.append(ways_between(values_of(gnss, GEODETIC)) / np.diff(time), np.nan)
    return curve("speed over ground", time, speed, BLUE, width=1.2, buckets=BUCKETS)


def fix_chart(one: LogDiagnosis, slug: str = "") -> Chart | None:
    """Speed, height and interval of fixes without inertial samples."""
    gnss = one.streams.get("gnss")
    if gnss is None or "imu" in one.streams or len(gnss) < 3:
        return None
    time = index_of(gnss)
    speed = _speed(one)
    level = height_words(as_stated=bool(gnss.attrs.get(HEIGHTS_AS_STATED)))
    height = curve("height", time, gnss["alt"].to_numpy(), BLUE, width=1.2, buckets=BUCKETS)
    steps = curve("step", time[1:], np.diff(time), GREY, width=0.9, buckets=BUCKETS)
    panels = [
        *([Panel("speed, m/s", (speed,), title="Speed over ground")] if speed else []),
        Panel("height, m", (height,), title=f"Height {level}"),
        Panel("step, s", (steps,), title="Steps of time", height=0.6),
    ]
    return Chart(f"{slug}fixes", "Fixes", "", "time, s", tuple(panels))


#: Page and JSON of a diagnosis.
DOCTOR = bundle_by_specification(
    "doctor", DoctorSpec, run_doctor, with_page(_write_data, doctor_document, figures=False)
)
