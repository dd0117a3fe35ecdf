"""What a person should know of records that were brought to common stamps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import Finding
from strapdown.sensors.onto_stamps import TriadAtStamps
from strapdown.tables import ACCEL, GYRO

Array = NDArray[np.float64]

# Less of a record than this may be left out without a word.
WORTH_A_WORD = 0.1  # s


def end_findings(
    units: Sequence[tuple[str, Sequence[TriadAtStamps]]],
) -> list[Finding]:
    """Samples near the ends of a record, which a low-pass had to continue."""
    found = []
    for name, parts in units:
        for t in parts:
            if t.whole.all():
                continue
            inner, time = np.flatnonzero(t.whole), t.triad.table.index.to_numpy()
            found.append(
                Finding(
                    "sensors.low-pass-at-ends" if inner.size else "sensors.low-pass-nowhere-whole",
                    file=f"{name}, {t.triad.name}",
                    quantity="time",
                    begin=time[inner[0]] if inner.size else None,
                    end=time[inner[-1]] if inner.size else None,
                    noise_factor=float(t.noise_factor.max() / np.median(t.noise_factor)),
                )
            )
    return found


def clipped_findings(
    units: Sequence[tuple[str, Sequence[TriadAtStamps]]],
) -> list[Finding]:
    """Samples at the end of the range, where the low-pass hides them from all that comes later."""
    found = []
    for name, parts in units:
        for t in parts:
            if t.method not in ("decimated", "averaged"):
                continue
            time = t.triad.table.index.to_numpy()
            gyro = GYRO[0] in t.triad.table.columns
            for k, column in enumerate(GYRO if gyro else ACCEL):
                rows = np.flatnonzero(t.clipped[:, k])
                if rows.size:
                    found.append(
                        Finding(
                            "sensors.gyro-clipped-before-resampling"
                            if gyro
                            else "sensors.accel-clipped-before-resampling",
                            file=f"{name}, {t.triad.name}",
                            quantity=column,
                            size=rows.size,
                            time=time[rows[0]],
                            time_2=time[rows[-1]],
                        )
                    )
    return found


def cut_findings(spans: Sequence[tuple[str, float, float]], time: Array) -> list[Finding]:
    """What was left out of the longest record, because another is shorter.

    Parameters
    ----------
    spans : sequence of (source, first, last)
        What every part can serve, s on the common clock.
    time : ndarray, (n,), s
        What all serve.
    """
    latest, earliest = max(spans, key=lambda s: s[1]), min(spans, key=lambda s: s[2])
    first, last = min(spans, key=lambda s: s[1]), max(spans, key=lambda s: s[2])
    found = []
    if time[0] - first[1] > WORTH_A_WORD:
        found.append(
            Finding(
                "sensors.begins-last-before-not-used",
                file=latest[0],
                quantity="time",
                latest=latest[1],
                first=first[0],
                first_2=first[1],
            )
        )
    if last[2] - time[-1] > WORTH_A_WORD:
        found.append(
            Finding(
                "sensors.ends-first-after-not-used",
                file=earliest[0],
                quantity="time",
                earliest=earliest[2],
                last=last[0],
                last_2=last[2],
            )
        )
    return found
