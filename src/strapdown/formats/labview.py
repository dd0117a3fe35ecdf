"""Measurement files of LabVIEW (``.lvm``): a text table under two headers.

The first header names separator and decimal sign; the second has a value of each channel in a line,
among them ``Y_Unit_Label`` and ``Delta_X`` (National Instruments, Specification for the LabVIEW
Measurement File). ``X_Value`` is time in s; without it, ``Delta_X`` is the step. The last name is
``Comment``, whose field is most often missing in the rows.
"""

from __future__ import annotations

from pathlib import Path

from strapdown.errors import DataError
from strapdown.formats import csv
from strapdown.formats.known_formats import under
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs

MAGIC, END = "LabVIEW Measurement", "***End_of_Header***"


detect = Signs(text=rf"\A{MAGIC}")


def read(path: Path) -> RawLog:
    """Read the channels, with the units that the header states.

    Raises
    ------
    DataError
        The header does not end, or a second one follows the rows.
    """
    text, _ = csv.decoded(path.read_bytes(), path.name)
    lines = text.split("\n")
    ends = [k for k, line in enumerate(lines) if line.startswith(END)]
    if len(ends) != 2 or len(lines) < ends[1] + 3:
        raise DataError("io.labview-headers", file=path.name, count=len(ends))
    about = [line.rstrip("\r").split("\t") for line in lines[: ends[1]]]
    said = {fields[0]: fields[1:] for fields in about}
    names = lines[ends[1] + 1].rstrip("\r").split("\t")
    width = len(lines[ends[1] + 2].rstrip("\r").split("\t"))
    names = ["time" if n == "X_Value" else n for n in names[:width]]
    raw = under(path, ends[1] + 1, "\t".join(names))
    units = [u for u in said.get("Y_Unit_Label", ()) if u]
    channels = [n for n in raw.columns if n not in ("time", "Comment")]
    if len(units) == len(channels):
        raw.units |= dict(zip(channels, units, strict=True))
    raw.units |= {"time": "s"} if "time" in raw.columns else {}
    step = next(iter(said.get("Delta_X", ())), "").replace(",", ".")
    if "time" not in raw.columns and step and float(step) > 0.0:
        raw.rate = 1.0 / float(step)
    return raw
