"""One channel of an ISO MME test: its header in words, and its samples when they are asked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import TIME_UNITS
from strapdown.exceptions import DataError
from strapdown.formats.crash_record import CrashChannel
from strapdown.formats.crash_text import LONGEST_NAME, clean
from strapdown.formats.crash_units import factor_of, unit_of
from strapdown.formats.mme_codes import DIMENSIONS, NO_CLASS, MmeCode, decode_mme
from strapdown.formats.mme_text import MmeHeader, even_stamps, read_header, read_samples
from strapdown.tables import SAMPLINGS

Array = NDArray[np.float64]

__all__ = ["MmeFile", "channel_of", "read_mme_file"]

#: What the writer of this package says in comments, and no field of the standard does.
SAMPLING_NOTE = "sampling "
AXIS_NOTE = "axis "
CHANGE_NOTE = "change of velocity since time zero of the recorder"
BODY_NOTE = "fixed to "
FILTER_NOTE = "low-pass "
AXES = ("x", "y", "z", "-x", "-y", "-z")
_GOOD = ("ok", "o.k.", "good", "valid", "as measured")
_REMARKS = (
    "location",
    "reference system",
    "transducer type",
    "transducer id",
    "pre-filter type",
    "data source",
    "laboratory channel code",
    "customer channel code",
)


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


def channel_of(file: MmeFile, name: str, others: Mapping[str, tuple[str, MmeFile]]) -> CrashChannel:
    """Make a channel of a record of it.

    Parameters
    ----------
    file : MmeFile
    name : str
        Unique in the record.
    others : dict of str to (str, MmeFile)
        Channels of the test by their code in capitals, each with its name: a channel may hold the
        stamps of another.

    Returns
    -------
    CrashChannel

    Raises
    ------
    DataError
        A field of the header is no number.
    """
    header, known = file.header, file.known
    text = header.text("unit")
    quantity, unit, factor, against = _unit(file, text)
    notes = header.all("comments")
    change = CHANGE_NOTE in notes
    clock = _clock(file, others)
    read_stamps = _stamps(file, clock, others)

    def samples() -> Array:
        values = read_samples(file.path, header, f"channel {name}")
        if quantity == "velocity" and not change and values.size:
            values = values - values[0]
        return values if factor is None else values * factor

    def load() -> tuple[Array, Array]:
        values = samples()
        return values if quantity == "time" else read_stamps(values.size), values

    # Stamps that the header does not tell may be stated by a case.
    open_stamps = (
        bool(clock) or quantity == "time" or _plain_number(header, "sampling interval") is None
    )
    full_scale = _plain_number(header, "channel amplitude class")
    cut_off = _plain_number(header, "cut off frequency")
    return CrashChannel(
        name=name,
        quantity=quantity,
        axis=_note(notes, AXIS_NOTE, AXES) or (known.axis if known else ""),
        unit=unit,
        load=load,
        sampling=_note(notes, SAMPLING_NOTE, SAMPLINGS)
        or ("instantaneous" if quantity in ("acceleration", "rate") else None),
        place=_place(file),
        body=_note(notes, BODY_NOTE) or (known.body if known else "not known"),
        low_pass=_note(notes, FILTER_NOTE) or _low_pass(file, cut_off),
        remarks=_remarks(file, against, notes),
        full_scale=None if full_scale is None else full_scale * (factor or 1.0),
        bandwidth=cut_off if cut_off is not None and cut_off > 0.0 else None,
        file=file.path.name,
        row=lambda k: header.end + k + 1,
        clock=others[clock.upper()][0] if clock else "",
        samples=samples if open_stamps else None,
    )


def _unit(file: MmeFile, text: str) -> tuple[str, str, float | None, str]:
    """Quantity, unit, factor, and what of the code speaks against the unit."""
    said = file.known.quantity if file.known else "other"
    found = unit_of(text) if text else None
    if found is None:
        # Of a quantity whose unit is not stated or not known the values are as recorded.
        return said, clean(text, LONGEST_NAME), None, ""
    quantity, unit = found
    if said in ("other", quantity):
        # A dimension that is known and none of ours, such as an angle, is not made one.
        plain = file.known is not None and file.code[12:14].upper() in DIMENSIONS
        if said == "other" and plain and file.code[12:14] != "00":
            return "other", unit, None, ""
        return quantity, unit, factor_of(quantity, unit), ""
    against = f"its code says {said}, and its unit is one of {quantity}"
    return quantity, unit, factor_of(quantity, unit), against


def _note(notes: list[str], key: str, known: tuple[str, ...] = ()) -> str:
    said = next((n[len(key) :] for n in notes if n.startswith(key)), "")
    return said if not known or said in known else ""


def _place(file: MmeFile) -> str:
    given = file.header.text("name of the channel")
    place = file.known.place if file.known else ""
    return given or place


def _plain_number(header: MmeHeader, key: str) -> float | None:
    """A number of the header that may also be a word there."""
    try:
        return header.number(key)
    except DataError:
        return None


def _low_pass(file: MmeFile, cut_off: float | None) -> str:
    parts = []
    stated = file.header.text("channel frequency class")
    if file.known and file.known.code[-1] != NO_CLASS:
        parts.append(file.known.filter)
    elif stated and file.known is None:
        parts.append(stated if not stated.isdecimal() else f"CFC {stated}")
    if cut_off is not None and cut_off > 0.0:
        parts.append(f"{cut_off:g} Hz before the sampler")
    return "; ".join(parts)


def _remarks(file: MmeFile, against: str, notes: list[str]) -> tuple[str, ...]:
    header, known = file.header, file.known
    remarks = [against] if against else []
    if known is None:
        remarks.append(
            f"'{file.code}' is no channel code of sixteen characters"
            if file.code
            else "it has no channel code"
        )
    else:
        remarks.append(f"{known.test_object}, {known.dimension}, {known.direction}")
        if header.text("name of the channel") and known.place:
            remarks.append(f"place by its code: {known.place}")
        if known.unknown:
            remarks.append(f"not in the tables of codes: {', '.join(known.unknown)}")
        stated = header.text("channel frequency class")
        figures = "".join(c for c in stated if c.isdigit())
        if figures and known.filter.startswith("CFC") and figures not in known.filter.split():
            remarks.append(f"its header says {stated}, and its code {known.filter}")
    if status := header.text("data status"):
        remarks.append(f"status {status}")
    remarks += [f"{key}: {header.text(key)}" for key in _REMARKS if header.text(key)]
    own = (SAMPLING_NOTE, AXIS_NOTE, BODY_NOTE, FILTER_NOTE)
    remarks += [n for n in notes if not n.startswith(own)]
    return tuple(remarks)


def is_bad(file: MmeFile) -> bool:
    """Whether the laboratory gives another status than a good one."""
    status = file.header.text("data status").lower()
    return bool(status) and status not in _GOOD


def _clock(file: MmeFile, others: Mapping[str, tuple[str, MmeFile]]) -> str:
    """Code of the channel that holds its stamps; empty where they are even."""
    kind = file.header.text("reference channel").lower()
    named = file.header.text("reference channel name")
    if kind == "implicit" or (not kind and not named) or file.code[2:6].upper() == "TIRS":
        return ""
    if not kind and file.header.text("sampling interval"):
        return ""
    code = named.split("/")[0].strip()
    if code.upper() not in others:
        raise DataError(
            f"its stamps are those of channel '{code}', which the test does not have"
            if code
            else "its stamps are those of another channel, which is not named",
            file=file.path.name,
            row=file.header.line("reference channel name") or file.header.line("reference channel"),
            quantity="reference channel name",
            remedy="add that channel from the laboratory, or state an even sampling: "
            "`Reference channel :implicit` with `Time of first sample` and `Sampling interval`",
        )
    return code


def _stamps(
    file: MmeFile, clock: str, others: Mapping[str, tuple[str, MmeFile]]
) -> Callable[[int], Array]:
    header = file.header
    if clock:
        held = others[clock.upper()][1]

        def recorded(count: int) -> Array:
            text = held.header.text("unit")
            unit = unit_of(text) if text else ("time", "s")
            if unit is None or unit[0] != "time":
                raise DataError(
                    f"it holds stamps, and its unit is '{text[:40]}'",
                    file=held.path.name,
                    row=held.header.line("unit"),
                    quantity="unit",
                    remedy="write s or ms",
                )
            stamps = read_samples(held.path, held.header, f"channel {clock}")
            if stamps.size != count:
                raise DataError(
                    f"it has {count} samples, and its stamps, in {held.path.name}, are "
                    f"{stamps.size}",
                    file=file.path.name,
                    quantity="number of samples",
                    remedy="get both files of the test again",
                )
            bad = np.flatnonzero(~(np.diff(stamps) > 0.0))
            if bad.size or not np.isfinite(stamps[:1]).all():
                k = int(bad[0]) + 1 if bad.size else 0
                raise DataError(
                    f"time goes from {stamps[k - 1]:.9g} to {stamps[k]:.9g}",
                    file=held.path.name,
                    row=held.header.end + k + 1,
                    quantity="time",
                    remedy="correct the stamps, or get the file of the test again",
                )
            return stamps * TIME_UNITS[unit[1]]

        return recorded

    def even(count: int) -> Array:
        interval = header.number("sampling interval")
        if interval is None or not interval > 0.0:
            raise DataError(
                "its sampling interval is not stated"
                if interval is None
                else f"a sampling interval of {interval:g} s is none",
                file=file.path.name,
                row=header.line("sampling interval"),
                quantity="sampling interval",
                remedy="write it in the header, in s; or state rate_hz = 10000",
            )
        first = "0"
        if header.number("time of first sample") is not None:
            first = header.text("time of first sample").split()[0]
        return even_stamps(first, header.text("sampling interval").split()[0], count)

    return even
