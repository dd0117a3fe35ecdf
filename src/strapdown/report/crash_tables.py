"""The tables of a crash report."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from strapdown.config.crash_case import TriadSpec
from strapdown.constants import STANDARD_GRAVITY, TWO_SIDED_95
from strapdown.crash.case import CaseResult
from strapdown.crash.case_contact import main_event
from strapdown.crash.delta_v_bound import VelocityChange
from strapdown.crash.entry import determined
from strapdown.crash.pdof import AngleInterval, Pdof
from strapdown.report.crash_words import DEG, DRIVE_QUANTITIES
from strapdown.report.document import TableBlock, table_of
from strapdown.report.values import (
    GAP,
    about,
    axis_names,
    component_words,
    decimals,
    energy_shown,
    impulse_shown,
    instant,
    length_factor,
    length_unit,
    mass_words,
    over_ground,
    plain,
    probability_words,
    recorder,
    resultant_words,
    speed_factor,
    speed_unit,
    speed_words,
)
from strapdown.rotation import within_half_turn
from strapdown.sensors.crash_unit import RecordedTriad
from strapdown.tables import NED
from strapdown.tables.checks import Array, index_of

if TYPE_CHECKING:
    from strapdown.crash.closure import Figure

Row = tuple[str, str, str, str]
ANGLES = ("roll, deg", "pitch, deg", "heading, deg")
OVER_GROUND = "Axes: over ground."
FROM_THE_ENTRY = (
    "Axes: forward and right of the vehicle at the entry; heading relative to that at the entry."
)


def answers_table(result: CaseResult) -> TableBlock | None:
    """Delta-V of every event, by every recorder."""
    rows: list[tuple[str, ...]] = []
    strong = []
    for unit in result.reconstruction.answers:
        for k, (changes, kind) in enumerate(zip(unit.body, unit.types, strict=True)):
            whole = changes.event
            if unit is result.reconstruction.main and k == main_event(unit):
                strong.append(len(rows))
            rows.append(
                (
                    recorder(unit.name, result),
                    f"{k + 1}, {kind.name}",
                    f"{plain(whole.delta_v.start, 4)} to {plain(whole.delta_v.end, 4)}",
                    *component_words(whole),
                    resultant_words(changes.peak),
                )
            )
    ms, unit_of = 1e3 * result.spec.options.peak_window_s, speed_unit()
    return table_of(
        f"recorder | event | contact, s | forward, {unit_of} | right, {unit_of} | down, {unit_of} "
        f"| resultant, {unit_of} | largest in {ms:.3g} ms, {unit_of}",
        rows,
        f"Delta-V of the {result.spec.point.name} in the axes of the vehicle, with 95 % bounds, "
        "over the contact; a frontal crash has a negative forward component.",
        text=(0, 1, 2),
        strong=strong,
    )


def direction_table(result: CaseResult) -> TableBlock | None:
    """Directions of force by window, along the axes of the vehicle and of the path."""
    rows: list[tuple[str, ...]] = []
    ground = over_ground(result)
    for unit in result.reconstruction.answers:
        for k, (body, ned) in enumerate(zip(unit.body, unit.ned, strict=True)):
            for window in ("event", "peak"):
                change: VelocityChange = getattr(body, window)
                angle, across = change.pdof, change.interval.horizontal
                assert isinstance(angle, Pdof)
                known = not across.undetermined
                up = change.interval.vertical
                path = ("–", "–", "–")
                if ned is not None:
                    path = _over_ground(getattr(ned, window), ground)
                rows.append(
                    (
                        recorder(unit.name, result),
                        f"{k + 1}, {'contact' if window == 'event' else 'largest'}"
                        + (", recorded part" if change.at_least else ""),
                        f"{plain(angle.horizontal_deg, 1)}°" if known else "not determined",
                        _ends(across) if known else "all",
                        str(angle.clock) if known else "–",
                        f"{plain(angle.vertical_deg, 1)}°" if known else "–",
                        "all" if up.undetermined else _ends(up),
                        *path,
                    )
                )
    axes = "over ground, azimuth" if ground else "against the entry"
    told = (
        "over ground, from north"
        if ground
        else "in axes that do not turn with the vehicle, from its heading at the entry"
    )
    ms = 1e3 * result.spec.options.peak_window_s
    return table_of(
        "recorder | window | horizontal | 95 % | o'clock "
        f"| vertical | 95 % | {axes} | 95 % | vertical there",
        rows,
        "Principal direction of force over the contact, and over the "
        f"{ms:.3g} ms of the largest change. Horizontal: from the front of the vehicle, clockwise "
        f"from above; vertical: positive from above; {axes} and vertical there: {told}.",
        text=(0, 1),
    )


def _over_ground(change: VelocityChange, azimuth: bool) -> tuple[str, str, str]:
    """Direction, its interval and elevation: an azimuth, or an angle from the entry's heading."""
    angle, across = change.pdof, change.interval.horizontal
    if across.undetermined:
        return "not determined", "all", "–"
    at = math.remainder(getattr(angle, "azimuth_deg", math.nan), 360.0)
    at += 360.0 * (azimuth and at < 0.0)
    shift = 360.0 * round((at - 0.5 * (across.low_deg + across.high_deg)) / 360.0)
    return f"{plain(at, 1)}°", _ends(across, shift), f"{plain(angle.vertical_deg, 1)}°"


def _ends(interval: AngleInterval, shift: float = 0.0) -> str:
    low, high = interval.low_deg + shift, interval.high_deg + shift
    return f"{plain(low, 1)}° to {plain(high, 1)}°"


def path_table(result: CaseResult) -> TableBlock | None:
    """Positions at the end of the path, by every recorder."""
    rows, size = [], length_factor()
    for unit in result.reconstruction.answers:
        table, sd = unit.path.table.iloc[-1].copy(), unit.path.sd.iloc[-1]
        if not over_ground(result):
            # As in the charts: relative to the initial heading, within half a turn.
            table["heading"] = float(within_half_turn(table["heading"]))
        rows.append(
            (
                recorder(unit.name, result),
                instant(unit.path.time[-1]),
                *(
                    about(size * float(table[a]), size * TWO_SIDED_95 * float(sd[a]), "")
                    for a in NED
                ),
                *(
                    about(float(table[a]), TWO_SIDED_95 * float(sd[a]), "")
                    for a in ("roll", "pitch", "heading")
                ),
            )
        )
    return table_of(
        ("recorder", "at", *(f"{name}, {length_unit()}" for name in axis_names(result)), *ANGLES),
        rows,
        "Position of the reference point from that at the entry, and attitude, with 95 % bounds. "
        + (OVER_GROUND if over_ground(result) else FROM_THE_ENTRY),
    )


def budget_table(result: CaseResult) -> TableBlock | None:
    """Return the error budget: one standard deviation of each contributor."""
    unit = result.reconstruction.main
    ends = unit.path.variances()[NED]
    number = main_event(unit)
    names = list(ends.index)
    changes = None if number is None else unit.body[number].event.bound.by_contributor
    if changes is not None:
        names += [n for n in changes.index if n not in names]
    variances: dict[str, Array] = {}
    for name in names:
        squares = np.zeros(5)
        if changes is not None and name in changes.index:
            squares[0], squares[1] = (float(changes.loc[name, c]) for c in ("xx", "yy"))
        if name in ends.index:
            squares[2:] = ends.loc[name].to_numpy(dtype=np.float64)
        variances[name] = squares
    variances["total"] = np.sum([variances[name] for name in names], axis=0)
    names.sort(key=lambda name: -float(variances[name].sum()))
    units = np.repeat([speed_factor(), length_factor()], [2, 3])
    shown = {name: (np.sqrt(squares) * units).tolist() for name, squares in variances.items()}
    return table_of(
        (
            "contributor",
            f"delta-V forward, {speed_unit()}",
            f"delta-V right, {speed_unit()}",
            *(f"{name} at the end, {length_unit()}" for name in axis_names(result)),
        ),
        (
            (name, *("–" if sd < 5e-4 else plain(sd, 3) for sd in shown[name]))
            for name in (*names, "total")
        ),
        f"{recorder(unit.name, result)}: one standard deviation; squares add up to that of the "
        "total. The 95 % bound is 1.96 times it.",
        strong=(len(names),),
    )


# Comparison with other recorders, injury-risk models and references.


def comparison_table(result: CaseResult) -> TableBlock | None:
    """Return the agreement of pairs of recorders."""
    comparison = result.reconstruction.comparison
    if comparison is None:
        return None
    rows = []
    for pair in comparison.pairs:
        difference, sd = pair.difference[-1], pair.sd[-1]
        rows.append(
            (
                f"{pair.first} − {pair.second}",
                *(
                    about(speed_factor() * float(d), speed_factor() * TWO_SIDED_95 * float(s), "")
                    if math.isfinite(float(d))
                    else "not measured"
                    for d, s in zip(difference, sd, strict=True)
                ),
                f"{pair.chi_square / max(pair.freedom, 1):.2f}",
                probability_words(pair.probability),
                "yes" if pair.agree else "NO",
            )
        )
    start, end = float(comparison.edges[0]), float(comparison.edges[-1])
    return table_of(
        f"recorders | forward, {speed_unit()} | right, {speed_unit()} | down, {speed_unit()} "
        "| chi-square per degree of freedom | probability | consistent",
        rows,
        f"Difference of the delta-V of two recorders at the {result.spec.point.name}, "
        f"{instant(start)} to {instant(end)}, with its 95 % bound. Probability of a difference as "
        "large or larger by the stated uncertainties.",
        text=(0, 6),
    )


def turning_table(result: CaseResult) -> TableBlock | None:
    """Turning of a vehicle without a gyro, by its measuring points."""
    comparison = result.reconstruction.comparison
    turned = None if comparison is None else comparison.turned
    if turned is None:
        return None
    rows = []
    for k, axis in enumerate(("roll", "pitch", "heading")):
        rate, rate_sd = float(turned.rate[-1, k]), float(turned.rate_sd[-1, k])
        angle, angle_sd = float(turned.angle[-1, k]), float(turned.angle_sd[-1, k])
        told = [about(v, TWO_SIDED_95 * sd, "") for v, sd in ((rate, rate_sd), (angle, angle_sd))]
        rows.append((axis, *told))
    end = instant(float(turned.edges[-1]))
    return table_of(
        "about | rate, deg/s | turned, deg",
        rows,
        f"Turning at {end}, by the motion of the recorders against each other, with its "
        "95 % bound. About an axis that they do not show it is the stated assumption. Positive "
        "heading to the right.",
    )


def _figure_row(
    what: str, figure: Figure | None, factor: float, places: int, unit: str, more: str = ""
) -> Row | None:
    if figure is None:
        return None
    value, low, high = (plain(factor * x, places) for x in (figure.value, figure.low, figure.high))
    return what, f"{more}{value}", f"from {low}" if more else f"{low} to {high}", unit


def _figures_table(rows: Iterable[Row | None], caption: str) -> TableBlock:
    found = tuple(row for row in rows if row is not None)
    return TableBlock(("quantity", "value", "95 % bound", "unit"), found, (0, 3), caption)


def deformation_table(result: CaseResult) -> TableBlock | None:
    """Crush of a vehicle, and its energy of deformation."""
    found = result.deformation
    if not (found.crush or found.energy):
        return None
    row, per, per_unit = _figure_row, speed_factor(), speed_unit()
    rows = [
        row(
            f"crush by {recorder(one.unit, result)}, {1e3 * (one.time - one.touch):.0f} ms "
            "after the first touch",
            one.depth,
            length_factor(),
            3,
            length_unit(),
            "at least " if one.at_least else "",
        )
        for one in found.crush
    ]
    rows.append(row("energy from residual crush and stiffness", found.energy, *energy_shown()))
    rows.append(row("energy-equivalent speed from it", found.equivalent_speed, per, 1, per_unit))
    return _figures_table(
        rows,
        "Deformation. The crush is how far the reference point came nearer to the barrier, "
        "which holds while the front stands there; a part that is folded or sheared off is not in "
        "it. Dynamic crush is larger than the residual one."
        if found.crush
        else "Deformation.",
    )


def closure_table(result: CaseResult) -> TableBlock | None:
    """Statements of a vehicle with the other, or a barrier: closing speed, restitution, energy."""
    closure = result.closure
    if closure is None:
        return None
    first, second = (*result.vehicle_names, "the barrier")[:2]
    row, named = _figure_row, result.spec.point.name
    common = closure.common_velocity if result.partners else None
    taken = "" if named == "center of mass" else ", taken for its center of mass"
    per, per_unit = speed_factor(), speed_unit()
    at = "at the contact" if closure.basis == "contact" else "of the centers of mass"
    equivalent = zip((first, second), closure.energy_equivalent_speed, strict=True)
    rows = (
        row(f"closing speed {at}, along the impulse", closure.closing_speed, per, 1, per_unit),
        row(f"separation speed {at}", closure.separation_speed, per, 1, per_unit),
        row("restitution", closure.restitution, 1.0, 2, ""),
        row(f"common velocity, along the impulse on {first}", common, per, 1, per_unit),
        row(
            f"direction of the impulse on {first}",
            closure.direction_deg,
            1.0,
            1,
            "deg from forward",
        ),
        row(f"mass of {second} over that of {first}", closure.mass_ratio, 1.0, 3, ""),
        row(f"impulse of {first} less that of {second}", closure.magnitude, *impulse_shown()),
        row("heading of the second less the first", closure.relative_heading_deg, 1.0, 1, "deg"),
        row("impulse of the contact", closure.impulse, *impulse_shown()),
        row("kinetic energy lost in the contact", closure.energy, *energy_shown()),
        *(
            row(f"energy-equivalent speed of {name}", of, per, 1, per_unit)
            for name, of in equivalent
        ),
    )
    tested = (
        f"Momentum closes with a probability of {probability_words(closure.probability)} "
        f"(chi-square {closure.chi_square:.3g}, {closure.freedom} degrees of freedom)."
        if closure.freedom
        else "Momentum could not be tested: masses or headings are not known."
        if result.partners
        else "The barrier is taken for rigid and fixed."
    )
    if closure.contradicted:
        tested += " They contradict each other: these bounds do not hold before that is explained."
    return _figures_table(
        rows,
        f"{first} and {second} together, {'each ' * bool(result.partners)}by its own "
        f"recorders at its {named}{taken}. {tested}",
    )


def indices_table(result: CaseResult) -> TableBlock | None:
    """Indices of the vehicle and of the occupants, each with its standard and bound."""
    rows = []
    for index in result.indices:
        factor = speed_factor() if index.unit == "m/s" else 1.0
        unit = speed_unit() if index.unit == "m/s" else index.unit
        value, bound = "–", "" if index.because is None else index.because.sentence("file")
        if index.value is not None:
            ends = [factor * x for x in (index.low, index.high) if x is not None]
            half = max((abs(x - factor * index.value) for x in ends), default=math.inf)
            places = decimals(half, 2, most=3) if math.isfinite(half) else decimals(index.value)
            value = f"{plain(factor * index.value, places)} {unit}".strip()
            if index.at_least:
                value = f"{value} or beyond" if index.value < 0.0 else f"at least {value}"
            bound = "not stated by the record" if index.channels else "not determined"
            if ends:
                side = "" if len(ends) == 2 else "above " if index.high is None else "below "
                bound = side + " to ".join(plain(x, places) for x in ends)
        detail = [index.detail] if index.detail else []
        if index.channels:
            detail.append(f"channels {', '.join(index.channels)}")
        rows.append(
            (
                recorder(index.of, result),
                index.name,
                value,
                bound,
                "" if index.limit is None else f"{index.limit:g} {index.unit}".strip(),
                index.standard,
                "; ".join(detail),
            )
        )
    return table_of(
        "of | index | value | 95 % bound | limit | standard | by",
        rows,
        f"Indices of the vehicle at its {result.spec.point.name} in the severest event, "
        "from the common stamps, with the bound by the error budget and the onset; and of "
        "occupants by channels of the records. Limits are of the standard named.",
        text=(0, 1, 3, 5, 6),
    )


def severity_table(result: CaseResult) -> TableBlock | None:
    """Return the results of the injury-risk models."""
    if not result.severity:
        return None
    rows = []
    sources = list(dict.fromkeys(answer.model.source for answer in result.severity))
    for answer in result.severity:
        risk, words = answer.risk, "–"
        bound = "" if answer.because is None else answer.because.sentence("file")
        if risk is not None:
            low, high = (f"{100.0 * p:.2g}" for p in (risk.low, risk.high))
            words = f"{'at least ' if answer.at_least else ''}{100.0 * risk.probability:.2g} %"
            bound = f"above {low} %" if answer.at_least else f"{low} to {high} %"
        rows.append(
            (
                answer.model.outcome,
                words,
                bound,
                "delta-V and the model" if answer.model.covariance else "delta-V alone",
                *((answer.model.source,) if len(sources) > 1 else ()),
            )
        )
    main = result.reconstruction.main
    kind = main.types[main_event(main) or 0].name
    any_type = not any("crash_type" in answer.model.applies for answer in result.severity)
    name = recorder({answer.of for answer in result.severity}.pop(), result)
    return table_of(
        "outcome | probability | 95 % bound | the bound is of" + " | source" * (len(sources) > 1),
        rows,
        "Probability of at least this injury, by published models, from the resultant "
        f"delta-V by {name} at the {result.spec.point.name}. The bound is due to delta-V and, "
        "where the model states their covariance or standard errors, to its coefficients; else it "
        "leaves the uncertainty of the model out."
        + any_type * f" The model is of all types of impact together, not of this one ({kind})."
        + (f" Source: {sources[0]}" if len(sources) == 1 else ""),
        text=(0, 2, 3, 4),
    )


def reference_tables(result: CaseResult) -> tuple[TableBlock, ...]:
    """Return the answers beside references: delta-V values, and paths."""
    changes: list[tuple[str, ...]] = []
    paths: list[tuple[str, ...]] = []
    for answer in result.references:
        spec, verdict = answer.spec, "yes" if answer.consistent else "NO"
        who = (spec.name, recorder(answer.unit, result))
        if answer.path is not None:
            errors = [length_factor() * v for v in (*answer.path.rms, *answer.path.largest)]
            paths.append((*who, *(plain(float(v), 3) for v in errors), verdict))
            continue
        assert spec.delta_v_m_per_s is not None
        less, both = answer.difference
        changes.append(
            (
                *who,
                f"{spec.axis}, {instant(answer.span[0])} to {instant(answer.span[1])}",
                *(plain(speed_factor() * v, 1) for v in (answer.delta_v, spec.delta_v_m_per_s)),
                about(speed_factor() * less, speed_factor() * both, ""),
                verdict,
            )
        )
    names = axis_names(result)
    tables = (
        table_of(
            f"reference | recorder | delta-V | this report, {speed_unit()} | reference, "
            f"{speed_unit()} | difference (95 %), {speed_unit()} | consistent",
            changes,
            "Delta-V of this report less that of a reference. The 95 % bound of the difference "
            "holds the bounds of both, and neither alone decides." + "".join(_force_words(result)),
            text=(0, 1, 2, 6),
        ),
        table_of(
            (
                *("reference", "recorder"),
                *(f"{name}, RMS, {length_unit()}" for name in names),
                *(f"{name}, largest, {length_unit()}" for name in names),
                "consistent",
            ),
            paths,
            "Errors of the path: this report − reference.",
            text=(0, 1, 8),
        ),
    )
    return tuple(table for table in tables if table is not None)


def _force_words(result: CaseResult) -> Iterator[str]:
    """Parts of the difference from a measured force."""
    for name, impulse in result.deformation.impulses:
        for answer in result.references:
            if answer.spec.name == name and answer.unit == result.reconstruction.main.name:
                mass = result.spec.vehicle.mass_kg
                assert mass is not None
                force = impulse.half_width / mass
                given = TWO_SIDED_95 * answer.spec.delta_v_sd_m_per_s
                rest = math.sqrt(max(given**2 - force**2, 0.0))
                own, *parts = (
                    f"± {speed_words(v)}" for v in (TWO_SIDED_95 * answer.sd, force, rest)
                )
                factor, places, unit = impulse_shown()
                yield (
                    f" {name}: an impulse of {plain(factor * impulse.value, places)} {unit} over "
                    f"{mass_words(mass)}; the bound holds that of this report, {own}, of the "
                    f"measured force, {parts[0]}, and of the mass and the friction of the tires, "
                    f"which the force does not show, {parts[1]}."
                )


# Inputs of a crash report: records, recorders, sensors, files.


def records_table(result: CaseResult) -> TableBlock | None:
    """Return the channels taken from each record, and their recorder."""
    rows = []
    for spec, unit in zip(result.spec.units, result.units, strict=True):
        for triad_spec, triad in zip(spec.accelerometers, unit.accelerometers, strict=True):
            name = triad.name if "accel" in triad.name else f"{triad.name} accelerometer"
            rows.append(_taken(result, unit.name, name, triad_spec, triad))
        if spec.gyro is not None and unit.gyro is not None:
            rows.append(_taken(result, unit.name, "gyro", spec.gyro, unit.gyro))
    return table_of(
        "recorder | sensors | record | format | channels | samples | rate, Hz | from, to",
        rows,
        "Channels of each record along the axes x, y, z of the recorder, on its own clock.",
        text=(0, 1, 2, 3, 4, 7),
    )


def _taken(
    result: CaseResult, unit: str, name: str, spec: TriadSpec, triad: RecordedTriad
) -> tuple[str, ...]:
    record = result.records[spec.path]
    time = index_of(triad.table)
    given = [
        f"{axis}:{GAP}{spec.channels[axis]}" for axis in ("x", "y", "z") if axis in spec.channels
    ]
    return (
        unit,
        name,
        record.path.name,
        record.format,
        ", ".join(given) or "by their names",
        str(len(time)),
        _rate(triad),
        f"{instant(float(time[0]))} to {instant(float(time[-1]))}",
    )


def _rate(triad: RecordedTriad) -> str:
    rate = 1.0 / float(np.median(np.diff(triad.table.index.to_numpy())))
    return f"{round(rate):d}" if rate >= 1000.0 else f"{rate:.4g}"


def units_table(result: CaseResult) -> TableBlock | None:
    """Mounting position and clock synchronization of each recorder."""
    rows, size = [], length_factor()
    for unit, at in zip(result.units, result.reconstruction.synchronised.units, strict=True):
        mounting = unit.mounting
        rows.append(
            (
                unit.name,
                " ".join(plain(size * v, 3) for v in mounting.position)
                + f" ± {size * TWO_SIDED_95 * mounting.position_sd:.2g}",
                " ".join(plain(v, 1) for v in mounting.angles_deg)
                + f" ± {TWO_SIDED_95 * mounting.angles_sd_deg:.2g}",
                "–" if unit.trigger is None else instant(unit.trigger),
                f"{1e3 * TWO_SIDED_95 * at.time_sd:.2g}",
                at.how,
                unit.gyro_from or ("own" if unit.gyro is not None else "none: assumed"),
            )
        )
    return table_of(
        f"recorder | forward right down, {length_unit()} | roll pitch heading, deg "
        "| trigger on its clock | ± ms | clock | gyro",
        rows,
        "Mounting positions from the vehicle's origin; angles turn vehicle axes into the "
        "recorder's. 95 % bounds.",
        text=(0, 1, 2, 5, 6),
    )


def drive_table(result: CaseResult) -> TableBlock | None:
    """Errors of each recorder as estimated from the drive before the crash; None without one."""
    rows, open_ones = [], []
    for unit in result.reconstruction.units:
        if unit.drive is None or unit.drive.calibration is None:
            continue
        for what in unit.drive.calibration.to_dict("records"):
            _, symbol, size, names = DRIVE_QUANTITIES[what["quantity"]]
            name = names[what["axis"]]
            if not determined(what):
                open_ones.append(" ".join((what["of"], name)))
                continue
            half, stated, kept = (
                TWO_SIDED_95 * x / size for x in (what["sd"], what["stated"], what["in_crash"])
            )
            of_wheels = what["quantity"].startswith("speed")
            rows.append(
                (
                    recorder(unit.name, result),
                    ": ".join((what["of"], name)),
                    about(what["error"] / size, half, symbol),
                    f"± {stated:.2g} {symbol}",
                    GAP if of_wheels else f"± {kept:.2g} {symbol}",
                )
            )
    if not rows and not open_ones:
        return None
    left = f" Not determined, as stated: {', '.join(dict.fromkeys(open_ones))}." * bool(open_ones)
    return TableBlock(
        ("recorder", "of", "by the drive", "as stated", "in the crash"),
        tuple(rows),
        text=(0, 1),
        title="The drive before the crash",
        caption="Errors of the sensors (measured − true), of the wheels (with their delay) and of "
        "the stated mounting angles, positive as these; 95 % bounds. All are corrected. Ranges "
        "that the drive did not reach, and nonlinearity, are as stated." + left,
    )


def sensors_table(result: CaseResult) -> TableBlock | None:
    """Stated properties of each sensor triad."""
    rows = []
    for spec, unit in zip(result.spec.units, result.units, strict=True):
        for triad_spec, triad in zip(spec.accelerometers, unit.accelerometers, strict=True):
            rows.append(_sensor(unit.name, triad_spec.sensor, triad, STANDARD_GRAVITY, "g"))
        if spec.gyro is not None and unit.gyro is not None:
            rows.append(_sensor(unit.name, spec.gyro.sensor, unit.gyro, 1.0 / DEG, "°/s"))
    return table_of(
        "recorder | triad | sensor | rate, Hz | range, ± | bias | scale, % | misalignment, mrad "
        "| noise of a sample",
        rows,
        "Standard deviations as stated in the case or by data sheets, before calibration at rest; "
        "the largest of the three axes.",
        text=(0, 1, 2),
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
        _rate(triad),
        "not stated" if math.isinf(full) else f"{full / size:.3g} {symbol}",
        f"{max(stated.axis('bias')) / size:.2g} {symbol}",
        f"{100.0 * max(stated.axis('scale')):.2g}",
        f"{1e3 * max(stated.axis('misalignment')):.2g}",
        f"{max(stated.axis('noise_density')) / math.sqrt(step) / size:.2g} {symbol}",
    )


def inputs_table(result: CaseResult) -> TableBlock | None:
    """Return the input files of the report."""
    rows = [
        (item.role, file.name, digest)
        for item in result.inputs
        for file, digest in zip(item.files, item.digests, strict=True)
    ]
    caption = "Copies are in the folder of the report under inputs/."
    return table_of("role | file | SHA-256", rows, caption, text=(0, 1, 2))
