"""Write the noise of a sensor as a sealed bundle: page, JSON, table of deviations, sensor file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from strapdown.bundle import write_json
from strapdown.config.logs import AllanSpec
from strapdown.constants import STANDARD_GRAVITY
from strapdown.formats import csv
from strapdown.report import document
from strapdown.report.chart import AXIS_COLOURS, Chart, Line, Panel, dots
from strapdown.report.report_bundle import bundle_by_specification, finite, with_page
from strapdown.report.values import duration_words
from strapdown.sensors.bridge import TARGETS, target_of
from strapdown.sensors.noise_terms import NoiseTerm
from strapdown.systems.allan_run import AllanRun, run_allan
from strapdown.tables import ACCEL, GYRO

DEG, G = math.pi / 180.0, STANDARD_GRAVITY
#: Name of a term, then factor and unit for gyros and for accelerometers.
SHOWN: dict[str, tuple[str, tuple[float, str], tuple[float, str]]] = {
    "Q": ("quantization", (3600.0 / DEG, "arcsec"), (1e3, "mm/s")),
    "N": ("white noise", (60.0 / DEG, "deg/√h"), (60.0, "m/s/√h")),
    "B": ("flicker", (3600.0 / DEG, "deg/h"), (1e6 / G, "µg")),
    "GM": ("Gauss-Markov, sd", (3600.0 / DEG, "deg/h"), (1e6 / G, "µg")),
    "T": ("Gauss-Markov, time", (1.0, "s"), (1.0, "s")),
    "K": ("rate random walk", (216000.0 / DEG, "deg/h/√h"), (6e7 / G, "µg/√h")),
    "C": ("effect of temperature", (3600.0 / DEG, "deg/h/°C"), (1e6 / G, "µg/°C")),
    "R": ("ramp", (3600.0**2 / DEG, "deg/h/h"), (3.6e9 / G, "µg/h")),
}
CAPTION = (
    "Coefficients as in IEEE Std 952 with 95 % intervals. < : not observable in this record, 95 % "
    "upper bound. ? : fitted, but another model without it describes the record as well."
)
METHOD = (
    "Noise terms by maximum likelihood over the covariances of block means of all lengths, of "
    "which mean and ramp of the record are projected out; a term is in the model where it gains "
    "5.4 in log-likelihood (0.1 % by chance).",
    "Intervals by the profile of the likelihood where the variance of a term is known to worse "
    "than 10 %.",
    "Several logs are independent records of one sensor: one likelihood of all, and deviations "
    "over the differences within each.",
    "The sensor's noise is Gaussian and does not change with time. The effect of temperature is "
    "estimated beside it where the log has a temperature that changes.",
)


def _write_data(result: AllanRun, folder: Path) -> None:
    write_json(folder / "allan.json", allan_json(result))
    table = result.deviations
    csv.write(
        folder / "deviations.csv",
        {("tau_s" if c == "tau" else str(c)): table[c].to_numpy() for c in table.columns},
        {"units": "allan, modified, hadamard, model: rad/s of gyros, m/s² of accelerometers"},
    )
    (folder / "sensor.toml").write_text(result.sensor_text(), encoding="utf-8", newline="\n")


def allan_json(result: AllanRun) -> dict[str, Any]:
    """Return the noise as plain data for programs, in SI.

    Returns
    -------
    dict
        ``channels`` with their terms; the ``sensor`` in the error model of this package; with a
        target its ``parameters``; the findings.
    """
    channels = {
        channel: {
            "terms": {
                one.name: {k: getattr(one, k) for k in ("value", "low", "high", "observable")}
                for one in noise.terms
            },
            "model": dict(noise.model),
            "correlation_time_s": noise.correlation_time,
            "up_to_hz": noise.up_to_hz,
            "models_alike": noise.alike,
        }
        for channel, noise in result.noise.items()
    }
    sensor = {
        triad: {
            key: getattr(errors, key)
            for key in ("noise_density", "bias_instability", "correlation_time", "random_walk")
        }
        for triad, errors in (("gyro", result.errors.gyro), ("accel", result.errors.accel))
        if errors is not None
    }
    out: dict[str, Any] = {
        "record": {
            "name": result.name,
            "from_s": result.start,
            "to_s": result.end,
            "logs": [
                {"name": one.name, "from_s": one.start, "to_s": one.end} for one in result.stretches
            ],
            "rate_hz": result.rate_hz,
        },
        "channels": channels,
        "sensor": sensor,
        "findings": [one.plain("cli") for one in result.findings],
    }
    if result.spec.target is not None:
        name, target = target_of(result.spec.target)
        rows = result.parameters(name).to_dict("records")
        out["parameters"] = {"program": name, "source": target.source, "values": rows}
    return finite(out)


# The answer, which page and terminal share.


def headline(result: AllanRun) -> str:
    """Say what was used, and which terms it determines."""
    kinds = []
    for word, channels in (("gyros", GYRO), ("accelerometers", ACCEL)):
        noise = [result.noise[c] for c in channels if c in result.noise]
        if not noise:
            continue
        observable = {term.name for one in noise for term in one.terms if term.observable}
        seen = [name for name in SHOWN if name in observable]
        kinds.append(f"{word} {', '.join(seen)}")
    length = duration_words(result.length)
    if len(result.stretches) > 1:
        length += f" of {len(result.stretches)} logs"
    return (
        f"{result.name}: {length} at rest at {result.rate_hz:.6g} Hz determine {'; '.join(kinds)}."
    )


def term_tables(result: AllanRun) -> list[document.TableBlock]:
    """Return a table of the terms of each triad; the last with the caption."""
    tables = []
    triads = [("Gyros", GYRO), ("Accelerometers", ACCEL)]
    used = [any(c in result.noise for c in channels) for _, channels in triads]
    for k, (title, channels) in enumerate(triads):
        noise = [result.noise[c] for c in channels if c in result.noise]
        if not noise:
            continue
        rows = []
        for name, (words, *shown) in SHOWN.items():
            factor, unit = shown[k]
            found = [next((t for t in one.terms if t.name == name), None) for one in noise]
            if any(one is not None for one in found):
                cells = tuple("–" if one is None else _cell(one, factor) for one in found)
                rows.append((f"{name}  {words}", unit, *cells))
        caption = CAPTION if not any(used[k + 1 :]) else ""
        tables.append(document.TableBlock((title, "unit", *"xyz"), tuple(rows), (0, 1), caption))
    return tables


def _cell(term: NoiseTerm, factor: float) -> str:
    if math.isnan(term.value):
        return f"< {_digits(factor * term.high, 2)}" if term.high > 0.0 else "–"
    doubt = "" if term.observable else " ?"
    if term.name == "C":
        half = 0.5 * factor * (term.high - term.low)
        return f"{factor * term.value:.3g} ± {half:.2g}{doubt}".replace("-", "−")
    low, high = factor * term.low, factor * term.high
    # Digits of the interval: two of its width.
    digits = max(2, 2 - math.floor(math.log10((term.high - term.low) / term.value)))
    value, ends = _digits(factor * term.value, digits), [_digits(x, digits) for x in (low, high)]
    return f"{value} ({ends[0]}–{ends[1]}){doubt}"


def _digits(value: float, digits: int) -> str:
    """A number with so many significant digits; without an exponent between 0.001 and 1e5."""
    if value <= 0.0 or not 1e-3 <= value < 1e5:
        return f"{value:.{digits}g}"
    return f"{value:.{max(0, digits - 1 - math.floor(math.log10(value)))}f}"


def parameter_table(result: AllanRun) -> document.TableBlock | None:
    """Return the parameters of the program that was asked for."""
    if result.spec.target is None:
        return None
    name, target = target_of(result.spec.target)
    rows = []
    for row in result.parameters(name).to_dict("records"):
        words = (str(row[key]) for key in ("parameter", "triad", "unit"))
        rows.append((*words, *(f"{row[axis]:.4g}" for axis in "xyz")))
    note = f" {target.note[:1].upper()}{target.note[1:]}." if target.note else ""
    caption = f"{target.title}, by {target.source}.{note}"
    return document.table_of((name, "triad", "unit", *"xyz"), rows, caption, text=(0, 1, 2))


# Page and chart.


def allan_document(result: AllanRun, name: str = "") -> document.Document:
    """Return the report of the noise of a sensor."""
    chosen = parameter_table(result)
    rows = tuple(
        (title.title, f"strapdown allan {result.name} --for {key}")
        for key, title in TARGETS.items()
        if key != "strapdown"
    )
    sections = (
        document.section("deviations", "Allan deviations", allan_chart(result)),
        document.section(
            "bridge", "For another program", chosen, document.Items(rows), folded=chosen is None
        ),
        document.section(
            "others",
            "Modified Allan and Hadamard deviations",
            allan_chart(result, "modified"),
            allan_chart(result, "hadamard"),
            folded=True,
        ),
        document.section(
            "sensor",
            "Sensor file",
            document.Paragraph(
                "sensor.toml, for --sensor of navigate and align. Its biases are as large as the "
                "mean of the record suggests; scale factor and misalignment are not in it: a "
                "record at rest does not show them."
            ),
            document.paragraph(result.sensor_text(), "mono"),
            folded=True,
        ),
        document.section("method", "Method", document.listed(METHOD), folded=True),
        document.section("again", "Check this folder", *document.run_again(name)),
    )
    good = not result.findings
    return document.document_of(
        result.name,
        "Noise of the sensor",
        (
            ("Stationary", f"{one.name}, {one.start:.6g} s to {one.end:.6g} s")
            for one in result.stretches
        ),
        (
            document.Paragraph(headline(result), "lead" if good else "warning"),
            *term_tables(result),
            None if good else document.findings_list(result.findings, "cli"),
        ),
        sections,
        links=(
            ("allan.json", "terms with their intervals, SI"),
            ("deviations.csv", "deviations by averaging time, SI"),
            ("sensor.toml", "the sensor, for --sensor"),
        ),
    )


def allan_chart(result: AllanRun, kind: str = "allan") -> Chart:
    """Return deviations over the averaging time, and the fitted terms of the Allan deviation."""
    panels = []
    triads = (("Gyros", "deg/h", 3600.0 / DEG, GYRO), ("Accelerometers", "µg", 1e6 / G, ACCEL))
    for title, unit, factor, channels in triads:
        lines: list[Line] = []
        for channel, colour in zip(channels, AXIS_COLOURS, strict=True):
            table = result.deviations[result.deviations["channel"] == channel]
            table = table[np.isfinite(table[kind])]
            if not len(table):
                continue
            tau, axis = table["tau"].to_numpy(), channel[-1]
            values = factor * table[kind].to_numpy()
            if kind == "allan":
                lines.append(dots(axis, tau, values, colour, size=4.0))
                model = factor * table["model"].to_numpy()
                lines.append(Line(f"{axis}, fitted", tau, model, colour, width=1.0))
            else:
                lines.append(Line(axis, tau, values, colour))
        if lines:
            panels.append(Panel(f"deviation, {unit}", tuple(lines), log=True, title=title))
    words = {
        "allan": "Overlapping Allan deviation",
        "modified": "Modified Allan deviation",
        "hadamard": "Overlapping Hadamard deviation",
    }
    return Chart(kind, words[kind], "", "averaging time, s", tuple(panels), log_x=True)


#: Page, JSON, deviations and sensor file of a record at rest.
ALLAN = bundle_by_specification(
    "allan", AllanSpec, run_allan, with_page(_write_data, allan_document)
)
