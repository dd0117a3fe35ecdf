"""The attitude bench as files: page, figures, JSON, CSV, sealed in a bundle."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown import __version__
from strapdown.bundle import Seal, to_json, write_bundle
from strapdown.formats import csv
from strapdown.report import attitude_words as words
from strapdown.report.attitude_charts import charts
from strapdown.report.chart import Chart
from strapdown.report.page import embedded, render
from strapdown.report.plotly_chart import figure
from strapdown.report.svg_chart import draw
from strapdown.results import AttitudeBench
from strapdown.tables import EULER, QUATERNION

__all__ = ["attitude_json", "attitude_page", "write_attitude"]


def write_attitude(bench: AttitudeBench, out: str | Path, *, force: bool = False) -> Seal:
    """Write a bench as a sealed bundle.

    Parameters
    ----------
    bench : AttitudeBench
    out : str or Path
        Folder to make.
    force : bool
        Replace a bundle that is there.

    Returns
    -------
    Seal

    Raises
    ------
    ConfigError
        `out` exists and may not be replaced.
    DataError
        An input has changed since it was read.
    """
    seals: list[Seal] = []
    with write_bundle(
        Path(out),
        command="attitude",
        configuration=bench.specification,
        inputs=bench.inputs,
        force=force,
        seals=seals,
    ) as folder:
        (folder / "attitude.json").write_text(
            to_json(attitude_json(bench)), encoding="utf-8", newline="\n"
        )
        _write_csv(bench, folder / "attitude.csv")
        (folder / "figures").mkdir()
        drawn = charts(bench)
        for chart in drawn:
            draw(chart, folder / "figures" / f"{chart.slug}.svg")
        (folder / "report.html").write_text(
            attitude_page(bench, drawn), encoding="utf-8", newline="\n"
        )
    return seals[0]


def attitude_json(bench: AttitudeBench) -> dict[str, Any]:
    """Return a bench as plain data; every key carries its unit.

    Parameters
    ----------
    bench : AttitudeBench

    Returns
    -------
    dict
    """
    return {
        "schema": "strapdown attitude 1",
        "source": bench.source,
        "description": bench.description,
        "conventions": dict(words.CONVENTIONS),
        "initial": bench.initial,
        "gyro_bias": bench.gyro_bias,
        "headline": words.headline(bench),
        "algorithms": [
            {
                "algorithm": run.algorithm,
                "title": run.title,
                "equations": f"Alexiev (2021) {run.equations}",
                "final": _final(run.attitude.iloc[-1], float(run.attitude.index[-1])),
                "diagnostics": run.diagnostics,
                "scores": [
                    {
                        "against": s.against,
                        "time_s": s.time,
                        "error_deg": s.error_deg,
                        "rms_deg": s.rms_deg,
                        "max_deg": s.max_deg,
                        "turned_deg": s.turned_deg,
                        "expected_deg": s.expected_deg,
                        "sd_deg": s.sd_deg,
                    }
                    for s in bench.scores
                    if s.algorithm == run.algorithm
                ],
            }
            for run in bench.runs
        ],
        "sampling_error_deg": _sampling_error(bench),
        "largest_difference_deg": {
            name: {other: float(v) for other, v in row.items()}
            for name, row in bench.differences_deg.iterrows()
        },
        "rests": [
            {
                "start_s": r.start,
                "end_s": r.end,
                "gyro_mean_rad_per_s": r.gyro_mean,
                "gyro_sd_rad_per_s": r.gyro_sd,
                "accel_mean_m_per_s2": r.accel_mean,
            }
            for r in bench.rests
        ],
        "readings": [vars(r) for r in bench.readings],
        "findings": [vars(f) for f in bench.findings],
    }


def _sampling_error(bench: AttitudeBench) -> dict[str, float] | None:
    if bench.sampling_error_deg is None:
        return None
    return dict(zip(("final", "max"), bench.sampling_error_deg, strict=True))


def _final(row: Any, time: float) -> dict[str, float]:
    return (
        {"time_s": time}
        | {q: float(row[q]) for q in QUATERNION}
        | {f"{e}_deg": float(row[e]) for e in EULER}
    )


def _write_csv(bench: AttitudeBench, path: Path) -> None:
    """Write every algorithm's attitude side by side, to 1e-9 and to 1e-6 deg."""
    columns: dict[str, NDArray[Any]] = {
        "time_s": bench.runs[0].attitude.index.to_numpy(dtype=np.float64)
    }
    for run in bench.runs:
        name = run.algorithm.replace(",", ";")
        columns |= {f"{name} {q}": np.round(run.attitude[q].to_numpy(), 9) for q in QUATERNION}
        columns |= {f"{name} {e}_deg": np.round(run.attitude[e].to_numpy(), 6) for e in EULER}
    csv.write(
        path, columns, {key.lower().replace(" ", "_"): text for key, text in words.CONVENTIONS}
    )


def attitude_page(bench: AttitudeBench, drawn: Sequence[Chart] | None = None) -> str:
    """Return a bench as one offline HTML page.

    Parameters
    ----------
    bench : AttitudeBench
    drawn : sequence of Chart, optional
        Its charts, where they have been made already.

    Returns
    -------
    str
    """
    shown = []
    for chart in charts(bench) if drawn is None else drawn:
        data = figure(chart)
        shown.append(
            {
                "slug": chart.slug,
                "title": chart.title,
                "caption": chart.caption,
                "height": data["layout"]["height"],
                "json": embedded(data),
            }
        )
    names = [run.algorithm for run in bench.runs]
    table = bench.differences_deg.to_numpy()
    return render(
        "attitude.html",
        {
            "title": bench.source,
            "headline": words.headline(bench),
            "columns": words.result_columns(bench),
            "rows": words.result_rows(bench),
            "references": words.reference_lines(bench),
            "hint": "" if bench.scores else words.HOW_TO_REFERENCE,
            "findings": [
                {
                    "place": ", ".join(
                        str(part)
                        for part in (f.file, f"row {f.row}" if f.row else None, f.quantity)
                        if part
                    ),
                    "what": f.what,
                    "remedy": f.remedy,
                }
                for f in bench.findings
            ],
            "charts": shown,
            "differences": {
                "names": names,
                "rows": [
                    (name, ["–" if i == j else words.degrees(float(v)) for j, v in enumerate(row)])
                    for i, (name, row) in enumerate(zip(names, table, strict=True))
                ],
            }
            if len(names) > 1
            else None,
            "facts": words.facts(bench),
            "readings": bench.readings,
            "first_value": words.first_value,
            "conventions": words.CONVENTIONS,
            "version": __version__,
        },
    )
