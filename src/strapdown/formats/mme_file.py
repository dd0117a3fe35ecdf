"""Channel files of ISO MME: the header with its code, and the stamps of the samples."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import TIME_UNITS
from strapdown.errors import DataError
from strapdown.formats.crash_text import LONGEST_NAME, clean
from strapdown.formats.crash_units import unit_of
from strapdown.formats.mme_codes import MmeCode, decode_mme
from strapdown.formats.mme_text import MmeHeader, even_stamps, read_header, read_samples

Array = NDArray[np.float64]

__all__ = ["MmeFile", "clock_of", "read_mme_file", "stamps_of"]


@dataclass(frozen=True, eq=False)
class MmeFile:
    """One channel file.

    Attributes
    ----------
    path : Path
    header : MmeHeader
    code : str
        As it stands there, or in the index; empty where neither has one.
    known : MmeCode or None
        The code in words, where it is one.
    """

    path: Path
    header: MmeHeader
    code: str
    known: MmeCode | None


def read_mme_file(path: Path, indexed: str, objects: int) -> MmeFile:
    """Read the header of a channel file.

    Parameters
    ----------
    path : Path
    indexed : str
        Code that the index has of it; empty where it is not there.
    objects : int
        Test objects of the test.

    Returns
    -------
    MmeFile

    Raises
    ------
    DataError
        As `read_header`.
    """
    header = read_header(path)
    code = header.text("channel code") or indexed
    return MmeFile(path, header, clean(code, LONGEST_NAME), decode_mme(code, objects=objects))


def clock_of(file: MmeFile, others: Mapping[str, tuple[str, MmeFile]]) -> str:
    """Code of the channel that holds its stamps; empty where they are even.

    Raises
    ------
    DataError
        The test does not have that channel, or the header does not name it.
    """
    kind = file.header.text("reference channel").lower()
    named = file.header.text("reference channel name")
    if kind == "implicit" or (not kind and not named) or file.code[2:6].upper() == "TIRS":
        return ""
    if not kind and file.header.text("sampling interval"):
        return ""
    code = named.split("/")[0].strip()
    if code.upper() not in others:
        raise DataError(
            "io.stamps-those-channel-test-does" if code else "io.stamps-those-another-channel-not",
            file=file.path.name,
            row=file.header.line("reference channel name") or file.header.line("reference channel"),
            quantity="reference channel name",
            word=code,
        )
    return code


def stamps_of(
    file: MmeFile, clock: str, others: Mapping[str, tuple[str, MmeFile]]
) -> Callable[[int], Array]:
    """Read the stamps of so many samples, from a channel of stamps or from the header."""
    header = file.header
    if clock:
        held = others[clock.upper()][1]

        def recorded(count: int) -> Array:
            text = held.header.text("unit")
            unit = unit_of(text) if text else ("time", "s")
            if unit is None or unit[0] != "time":
                raise DataError(
                    "io.holds-stamps-unit",
                    file=held.path.name,
                    row=held.header.line("unit"),
                    quantity="unit",
                    text=text[:40],
                )
            stamps = read_samples(held.path, held.header, f"channel {clock}")
            if stamps.size != count:
                raise DataError(
                    "io.samples-stamps",
                    file=file.path.name,
                    quantity="number of samples",
                    count=count,
                    name=held.path.name,
                    size=stamps.size,
                )
            bad = np.flatnonzero(~(np.diff(stamps) > 0.0))
            if bad.size or not np.isfinite(stamps[:1]).all():
                k = int(bad[0]) + 1 if bad.size else 0
                raise DataError(
                    "io.time-goes-2",
                    file=held.path.name,
                    row=held.header.end + k + 1,
                    quantity="time",
                    stamps=stamps[k - 1],
                    stamps_2=stamps[k],
                )
            return stamps * TIME_UNITS[unit[1]]

        return recorded

    def even(count: int) -> Array:
        interval = header.number("sampling interval")
        if interval is None or not interval > 0.0:
            raise DataError(
                "io.sampling-interval-not-stated"
                if interval is None
                else "io.sampling-interval-none",
                file=file.path.name,
                row=header.line("sampling interval"),
                quantity="sampling interval",
                interval=interval,
            )
        first = "0"
        if header.number("time of first sample") is not None:
            first = header.text("time of first sample").split()[0]
        return even_stamps(first, header.text("sampling interval").split()[0], count)

    return even
