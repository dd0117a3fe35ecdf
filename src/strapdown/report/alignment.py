"""An alignment as files: page, JSON, tables and figures, sealed in a bundle."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown.bundle.json_text import to_json
from strapdown.bundle.seal import Seal
from strapdown.config.alignment_file import alignment_spec
from strapdown.report.alignment_document import CONVENTIONS, alignment_document
from strapdown.report.alignment_json import alignment_json
from strapdown.report.crash_csv import write_table
from strapdown.report.document_data import draw_stills
from strapdown.report.document_files import write_drawings, write_text
from strapdown.report.document_html import document_page
from strapdown.report.report_bundle import report_bundle
from strapdown.systems.alignment_run import AlignmentResult, run_alignment
from strapdown.systems.one_thread import one_thread
from strapdown.systems.progress import Progress, silent
from strapdown.tables import EULER

__all__ = ["rerun_alignment", "write_alignment"]


def rerun_alignment(configuration: dict[str, Any], out: Path, *, report: bool = True) -> Seal:
    """Run a sealed alignment again from its configuration, with or without its page."""
    spec = alignment_spec(configuration["alignment"])
    path = configuration.get("file_path")
    name = str(configuration["name"])
    return write_alignment(
        run_alignment(spec, None if path is None else Path(path)), out, name=name, report=report
    )


@one_thread()
def write_alignment(
    result: AlignmentResult,
    out: str | Path,
    *,
    name: str | None = None,
    report: bool = True,
    force: bool = False,
    progress: Progress = silent,
) -> Seal:
    """Write an alignment as a sealed bundle.

    Parameters
    ----------
    result : AlignmentResult
    out : str or Path
        Folder to make.
    name : str, optional
        Of the folder, as the report names it; that of `out`, if not given.
    report : bool
        Whether the page and the figures are written, too.
    force : bool
        Replace a bundle that is there.
    progress : callable, optional

    Returns
    -------
    Seal

    Raises
    ------
    ConfigError
        `out` exists and may not be replaced.
    """
    name = Path(out).absolute().name if name is None else name
    seals: list[Seal] = []
    with report_bundle(
        result, out, "align", key="alignment", name=name, force=force, seals=seals, report=report
    ) as folder:
        write_text(folder / "align.json", to_json(alignment_json(result)))
        told = {key.lower().replace(" ", "_"): text for key, text in CONVENTIONS}
        write_table(_attitude(result), folder / "attitude.csv", told)
        if result.fine is not None:
            write_table(_history(result.fine.history), folder / "fine.csv", told)
        if report:
            progress("drawing the figures", 0.75)
            document = alignment_document(result, name)
            stills = draw_stills(document)
            write_drawings(document, stills, folder / "figures")
            progress("writing the page", 0.9)
            write_text(folder / "report.html", document_page(document, stills=stills))
    return seals[0]


def _attitude(result: AlignmentResult) -> pd.DataFrame:
    """Attitude at the rate that is asked for, each column with its unit."""
    table = result.attitude
    rate = result.spec.output.rate_hz
    if rate is not None:
        time = table.index.to_numpy(dtype=np.float64)
        cell = np.floor((time - time[0]) * rate + 1e-6)
        kept = np.concatenate([[True], np.diff(cell) > 0])
        kept[-1] = True
        table = table[kept]
    out = table.rename(columns={a: f"{a}_deg" for a in EULER})
    out.insert(0, "time_s", out.index.to_numpy())
    return out.reset_index(drop=True)


def _history(history: pd.DataFrame) -> pd.DataFrame:
    """Estimates and standard deviations of the fine alignment, each column with its unit."""
    units = dict.fromkeys(EULER, "deg")
    units |= {f"gyro_bias_{a}": "rad_per_s" for a in "xyz"}
    units |= {f"accel_bias_{a}": "m_per_s2" for a in "xyz"}
    names = {n: f"{n}_{u}" for n, u in units.items()}
    names |= {f"{n}_sd": f"{n}_sd_{u}" for n, u in units.items()}
    out = history.rename(columns=names)
    out.insert(0, "time_s", out.index.to_numpy())
    return out.reset_index(drop=True)
