"""The attitude bench as files: page, figures, JSON, CSV, sealed in a bundle."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.bundle.json_text import to_json
from strapdown.bundle.seal import Seal
from strapdown.bundle.writing import write_bundle
from strapdown.formats import csv
from strapdown.report import attitude_words as words
from strapdown.report.attitude_answer_charts import share_basis
from strapdown.report.attitude_charts import charts
from strapdown.report.attitude_json import attitude_json
from strapdown.report.attitude_page import attitude_page
from strapdown.report.svg_chart import draw
from strapdown.results.attitude_bench import AttitudeBench
from strapdown.tables import EULER, QUATERNION

__all__ = ["attitude_json", "attitude_page", "write_attitude"]


def write_attitude(
    bench: AttitudeBench,
    out: str | Path,
    *,
    report: bool = True,
    force: bool = False,
    png: bool = False,
) -> Seal:
    """Write a bench as a sealed bundle.

    Parameters
    ----------
    bench : AttitudeBench
    out : str or Path
        Folder to make.
    report : bool
        Whether the page and the figures are written, too.
    force : bool
        Replace a bundle that is there.
    png : bool
        Write each figure as PNG, too.

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
        configuration={**bench.specification, **({} if report else {"report": False})},
        inputs=bench.inputs,
        force=force,
        seals=seals,
    ) as folder:
        (folder / "attitude.json").write_text(
            to_json(attitude_json(bench)), encoding="utf-8", newline="\n"
        )
        _write_csv(bench, folder / "attitude.csv")
        if len(bench.sweep):
            _write_sweep(bench, folder / "sweep.csv")
        if report:
            (folder / "figures").mkdir()
            drawn = charts(bench)
            for chart in drawn:
                for ending in ("svg", "png") if png else ("svg",):
                    draw(chart, folder / "figures" / f"{chart.slug}.{ending}")
            (folder / "report.html").write_text(
                attitude_page(bench, drawn), encoding="utf-8", newline="\n"
            )
    return seals[0]


def _write_csv(bench: AttitudeBench, path: Path) -> None:
    """Write every algorithm's attitude side by side, to 1e-9 and to 1e-6 deg."""
    columns: dict[str, NDArray[Any]] = {
        "time_s": bench.runs[0].attitude.index.to_numpy(dtype=np.float64)
    }
    for run in bench.runs:
        # Neither a comma nor a semicolon, which a reader may take for what parts the columns.
        name = run.algorithm.replace(",", " ")
        columns |= {f"{name} {q}": np.round(run.attitude[q].to_numpy(), 9) for q in QUATERNION}
        columns |= {f"{name} {e}_deg": np.round(run.attitude[e].to_numpy(), 6) for e in EULER}
    csv.write(
        path, columns, {key.lower().replace(" ", "_"): text for key, text in words.CONVENTIONS}
    )


def _write_sweep(bench: AttitudeBench, path: Path) -> None:
    """Write the errors at every rate; a field is empty where nothing is known."""
    columns: dict[str, NDArray[Any]] = {}
    for name in bench.sweep.columns:
        values = bench.sweep[name].to_numpy()
        if values.dtype.kind == "f":
            # What is missing is left empty, and not called NaN.
            values = np.array([None if np.isnan(v) else v for v in values.tolist()], dtype=object)
        columns[str(name)] = values
    csv.write(
        path,
        columns,
        {
            "meaning": "drop: samples are left out; sum: increments are summed",
            "error_deg": "what the answer judges: against the truth, else at the reference "
            "points, else own_deg",
            "own_deg": share_basis(bench),
        }
        | {key.lower().replace(" ", "_"): text for key, text in words.CONVENTIONS},
    )
