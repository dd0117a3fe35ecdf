"""The tables of a crash report."""

from __future__ import annotations

import math

import numpy as np

from strapdown.constants import STANDARD_GRAVITY, TWO_SIDED_95
from strapdown.crash.pdof import NedPdof, Pdof
from strapdown.crash.velocity_change import VelocityChange
from strapdown.report.crash_values import KMH, about, angle_range, instant, plain, recorder, speed
from strapdown.report.document import TableBlock
from strapdown.sensors.crash_unit import RecordedTriad
from strapdown.systems.case_severity import main_event
from strapdown.systems.crash_case import CaseResult
from strapdown.tables import NED

__all__ = [
    "answers_table",
    "budget_table",
    "comparison_table",
    "direction_table",
    "inputs_table",
    "path_table",
    "reference_table",
    "sensors_table",
    "severity_table",
    "units_table",
]

DEG = math.degrees(1.0)


def answers_table(result: CaseResult) -> TableBlock:
    """Changes of velocity of every event, by every recorder."""
    rows: list[tuple[str, ...]] = []
    strong = []
    for unit in result.reconstruction.answers:
        for k, (changes, kind) in enumerate(zip(unit.body, unit.types, strict=True)):
            event, whole = unit.events.events[k], changes.event
            if unit is result.reconstruction.main and k == main_event(unit):
                strong.append(len(rows))
            rows.append(
                (
                    recorder(unit, result),
                    f"{k + 1}, {kind.name}",
                    f"{instant(event.time_zero)} to {instant(event.end)}",
                    *(
                        about(KMH * v, KMH * h, "")
                        for v, h in zip(
                            whole.delta_v.vector.tolist(), whole.bound.half_width, strict=True
                        )
                    ),
                    about(KMH * whole.resultant, KMH * whole.resultant_bound, ""),
                    about(KMH * changes.peak.resultant, KMH * changes.peak.resultant_bound, ""),
                )
            )
    ms = 1e3 * result.spec.options.peak_window_s
    return TableBlock(
        (
            "recorder",
            "event",
            "from, to",
            "forward, km/h",
            "right, km/h",
            "down, km/h",
            "resultant, km/h",
            f"largest in {ms:.3g} ms, km/h",
        ),
        tuple(rows),
        text=(0, 1, 2),
        caption="Change of velocity along the turning axes of the vehicle, at the "
        f"{result.spec.point.name}; bounds hold 95 %. What changed: a frontal crash has a "
        "negative forward part.",
        strong=tuple(strong),
    )


def _direction_cells(change: VelocityChange) -> tuple[str, str, str]:
    angle = change.pdof
    across = change.interval.horizontal
    if isinstance(angle, NedPdof):
        at = f"{plain(angle.azimuth_deg, 1)}°"
    else:
        at = f"{plain(angle.horizontal_deg, 1)}°"
    if across.undetermined:
        return "not determined", "all", "–"
    return at, angle_range(across).split(" with ")[0], f"{plain(angle.vertical_deg, 1)}°"


def direction_table(result: CaseResult) -> TableBlock:
    """Directions of force by window and axes."""
    rows: list[tuple[str, ...]] = []
    for unit in result.reconstruction.answers:
        for k, (body, ned) in enumerate(zip(unit.body, unit.ned, strict=True)):
            pairs = [("vehicle", body.event), ("vehicle", body.peak)]
            if ned is not None:
                pairs += [("over ground", ned.event), ("over ground", ned.peak)]
            for frame, change in pairs:
                hour = "–"
                if isinstance(change.pdof, Pdof) and not change.interval.horizontal.undetermined:
                    hour = str(change.pdof.clock)
                window = "event" if change.window == "event" else "largest window"
                rows.append((recorder(unit, result), str(k + 1), window, frame, *_direction_cells(change), hour))
    return TableBlock(
        ("recorder", "event", "window", "axes", "horizontal", "95 %", "vertical", "clock"),
        tuple(rows),
        text=(0, 1, 2, 3, 5),
        caption="Where the force came from. Horizontal: from the front of the vehicle clockwise "
        "seen from above, or azimuth over ground; vertical: positive from above.",
    )


def path_table(result: CaseResult) -> TableBlock:
    """Places at the end of the path, by every recorder."""
    rows = []
    for unit in result.reconstruction.answers:
        table, sd = unit.path.table.iloc[-1], unit.path.sd.iloc[-1]
        rows.append(
            (
                recorder(unit, result),
                instant(unit.path.time[-1]),
                *(about(float(table[a]), TWO_SIDED_95 * float(sd[a]), "") for a in NED),
                *(
                    about(float(table[a]), TWO_SIDED_95 * float(sd[a]), "")
                    for a in ("roll", "pitch", "heading")
                ),
            )
        )
    return TableBlock(
        ("recorder", "at", "north, m", "east, m", "down, m", "roll, °", "pitch, °", "heading, °"),
        tuple(rows),
        text=(0,),
        caption="Place of the reference point from that at the entry, and attitude; bounds hold "
        "95 %. Where no heading is stated, north is forward at the entry and east right of it.",
    )


def budget_table(result: CaseResult) -> TableBlock | None:
    """Return what makes the bounds: one standard deviation of each contributor."""
    unit = result.reconstruction.main
    ends = unit.path.variances()[NED]
    number = main_event(unit)
    names = list(ends.index)
    changes = None if number is None else unit.body[number].event.bound.by_contributor
    if changes is not None:
        names += [n for n in changes.index if n not in names]
    rows: list[tuple[float, tuple[str, ...]]] = []
    sums = np.zeros(5)
    for name in names:
        squares = np.zeros(5)
        if changes is not None and name in changes.index:
            squares[0], squares[1] = (float(changes.loc[name, c]) for c in ("xx", "yy"))
        if name in ends.index:
            squares[2:] = ends.loc[name].to_numpy(dtype=np.float64)
        sums += squares
        sizes = np.sqrt(squares)
        rows.append((float(squares.sum()), (name, *_sizes(sizes))))
    rows.sort(key=lambda r: -r[0])
    lines = tuple(cells for _, cells in rows)
    return TableBlock(
        (
            "contributor",
            "delta-V forward, km/h",
            "delta-V right, km/h",
            "north at the end, m",
            "east at the end, m",
            "down at the end, m",
        ),
        (*lines, ("all together", *_sizes(np.sqrt(sums)))),
        caption=f"{recorder(unit, result)}: one standard deviation; their squares add up to that of the last "
        "line. The 95 % bounds are 1.96 times it.",
        strong=(len(lines),),
    )


def _sizes(sizes: np.ndarray[tuple[int], np.dtype[np.float64]]) -> tuple[str, ...]:
    scaled = sizes * np.array([KMH, KMH, 1.0, 1.0, 1.0])
    return tuple("–" if s < 5e-4 else plain(float(s), 3) for s in scaled)


def units_table(result: CaseResult) -> TableBlock:
    """Where each recorder sits and how its clock is tied."""
    rows = []
    for unit, at in zip(result.units, result.reconstruction.synchronised.units, strict=True):
        mounting = unit.mounting
        rows.append(
            (
                unit.name,
                " ".join(plain(v, 3) for v in mounting.position)
                + f" ± {TWO_SIDED_95 * mounting.position_sd:.2g}",
                " ".join(plain(v, 1) for v in mounting.angles_deg)
                + f" ± {TWO_SIDED_95 * mounting.angles_sd_deg:.2g}",
                "–" if unit.trigger is None else instant(unit.trigger),
                f"{1e3 * TWO_SIDED_95 * at.time_sd:.2g}",
                at.how,
                unit.gyro_from or ("own" if unit.gyro is not None else "none: assumed"),
            )
        )
    return TableBlock(
        (
            "recorder",
            "forward right down, m",
            "roll pitch heading, °",
            "trigger on its clock",
            "± ms",
            "clock",
            "gyro",
        ),
        tuple(rows),
        text=(0, 1, 2, 5, 6),
        caption="Mounting points from the vehicle's origin; angles turn vehicle axes into the "
        "recorder's. Bounds hold 95 %.",
    )


def sensors_table(result: CaseResult) -> TableBlock:
    """What is stated of each triad of sensors."""
    rows = []
    for spec, unit in zip(result.spec.units, result.units, strict=True):
        for triad_spec, triad in zip(spec.accelerometers, unit.accelerometers, strict=True):
            rows.append(_sensor(unit.name, triad_spec.sensor, triad, STANDARD_GRAVITY, "g"))
        if spec.gyro is not None and unit.gyro is not None:
            rows.append(_sensor(unit.name, spec.gyro.sensor, unit.gyro, 1.0 / DEG, "°/s"))
    return TableBlock(
        (
            "recorder",
            "triad",
            "sensor",
            "rate, Hz",
            "range, ±",
            "bias",
            "scale, %",
            "misalignment, mrad",
            "noise of a sample",
        ),
        tuple(rows),
        text=(0, 1, 2),
        caption="Standard deviations as stated in the case or its sensors' data sheets, before a "
        "rest has told more; the largest of the three axes.",
    )


def _sensor(
    unit: str, sensor: str | None, triad: RecordedTriad, size: float, symbol: str
) -> tuple[str, ...]:
    stated = triad.uncertainty
    step = float(np.median(np.diff(triad.table.index.to_numpy())))
    full = max(stated.axis("full_scale"))
    return (
        unit,
        triad.name,
        "stated in the case" if sensor is None else sensor.replace("\\", "/").rsplit("/", 1)[-1],
        f"{1.0 / step:.4g}",
        "not stated" if math.isinf(full) else f"{full / size:.3g} {symbol}",
        f"{max(stated.axis('bias')) / size:.2g} {symbol}",
        f"{100.0 * max(stated.axis('scale')):.2g}",
        f"{1e3 * max(stated.axis('misalignment')):.2g}",
        f"{max(stated.axis('noise_density')) / math.sqrt(step) / size:.2g} {symbol}",
    )


def comparison_table(result: CaseResult) -> TableBlock | None:
    """Return how pairs of recorders agree."""
    comparison = result.reconstruction.comparison
    if comparison is None:
        return None
    rows = []
    for pair in comparison.pairs:
        difference, sd = pair.difference[-1], pair.sd[-1]
        rows.append(
            (
                f"{pair.first} less {pair.second}",
                *(
                    about(KMH * float(d), KMH * TWO_SIDED_95 * float(s), "")
                    if math.isfinite(float(d))
                    else "not measured"
                    for d, s in zip(difference, sd, strict=True)
                ),
                f"{pair.chi_square / max(pair.freedom, 1):.2f}",
                "below 0.0001" if pair.probability < 1e-4 else f"{pair.probability:.2g}",
                "yes" if pair.agree else "NO",
            )
        )
    start, end = float(comparison.edges[0]), float(comparison.edges[-1])
    return TableBlock(
        (
            "recorders",
            "forward, km/h",
            "right, km/h",
            "down, km/h",
            "chi-square per degree of freedom",
            "probability",
            "agree",
        ),
        tuple(rows),
        text=(0, 6),
        caption="Difference of what two recorders say of the velocity at the "
        f"{result.spec.point.name}, {instant(start)} to {instant(end)}, beside the 95 % bound of "
        "such a difference. Probability: of differences as large or larger where everything that "
        "is stated is right.",
    )


def severity_table(result: CaseResult) -> TableBlock | None:
    """Return what models of injury risk say."""
    if not result.severity:
        return None
    rows = []
    for answer in result.severity:
        risk = answer.risk
        rows.append(
            (
                answer.model.outcome,
                "–" if risk is None else f"{100.0 * risk.probability:.2g} %",
                answer.because
                if risk is None
                else f"{100.0 * risk.low:.2g} to {100.0 * risk.high:.2g} %",
                answer.model.source,
            )
        )
    return TableBlock(
        ("outcome", "probability", "by the bound of delta-V", "source"),
        tuple(rows),
        text=(0, 2, 3),
        caption="Probability that an occupant is hurt at least so, by published models; the bound "
        "is that of the delta-V alone and not of the model.",
    )


def reference_table(result: CaseResult) -> TableBlock | None:
    """Return the answers beside what else is known."""
    rows = []
    for answer in result.references:
        spec, verdict = answer.spec, "yes" if answer.consistent else "NO"
        if answer.path is not None:
            found = answer.path
            rows.append(
                (
                    spec.name,
                    answer.unit,
                    "path",
                    " ".join(plain(v, 3) for v in found.rms) + " m RMS",
                    " ".join(plain(v, 3) for v in found.largest) + " m largest",
                    verdict,
                )
            )
            continue
        assert spec.delta_v_m_per_s is not None
        half = TWO_SIDED_95 * answer.sd
        other = TWO_SIDED_95 * spec.delta_v_sd_m_per_s
        rows.append(
            (
                spec.name,
                answer.unit,
                f"delta-V {spec.axis}, {instant(answer.span[0])} to {instant(answer.span[1])}",
                speed(answer.delta_v, half),
                speed(spec.delta_v_m_per_s, other),
                verdict,
            )
        )
    if not rows:
        return None
    return TableBlock(
        ("reference", "recorder", "of", "this report, or its error", "reference", "within 95 %"),
        tuple(rows),
        text=(0, 1, 2, 3, 4, 5),
        caption="Errors of a path: north, east, down, this report less the reference.",
    )


def inputs_table(result: CaseResult) -> TableBlock:
    """Return the files that the report rests on."""
    rows = []
    for item in result.inputs:
        for file, digest in zip(item.files, item.digests, strict=True):
            rows.append((item.role, file.name, digest))
    return TableBlock(
        ("role", "file", "SHA-256"),
        tuple(rows),
        text=(0, 1, 2),
        caption="Copies stand in the folder of the report under inputs/.",
    )
