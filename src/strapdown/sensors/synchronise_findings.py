"""What a person should know of records that were brought to common stamps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from strapdown.exceptions import Finding
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
            kept = (
                f"whole from {time[inner[0]]:.4g} to {time[inner[-1]]:.4g} s"
                if inner.size
                else "nowhere whole"
            )
            found.append(
                Finding(
                    f"the low-pass is {kept}: outside, the record's ends were continued by their "
                    "point mirror, and samples scatter up to "
                    f"{float(t.noise_factor.max() / np.median(t.noise_factor)):.2g} times as much",
                    file=f"{name}, {t.triad.name}",
                    quantity="time",
                    remedy="record longer before and after, or use means (sampling='mean')",
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
                            "samples of the record are at the end of its range, and count in "
                            f"{rows.size} common stamps from {time[rows[0]]:.5g} s to "
                            f"{time[rows[-1]]:.5g} s",
                            file=f"{name}, {t.triad.name}",
                            quantity=column,
                            remedy="what is cut off is missing from the attitude after it; borrow "
                            "the gyro of another unit with a wider range"
                            if gyro
                            else "what is cut off is missing from delta-V: it is a lower bound on "
                            "this axis",
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
                f"it begins last, at {latest[1]:.4g} s, and {first[0]} at {first[1]:.4g} s: what "
                "is before is not used, and a stationary stretch in it is lost to the biases and "
                "the levelling",
                file=latest[0],
                quantity="time",
                remedy="leave this part or unit out if it is not needed, or reconstruct it by "
                "itself",
            )
        )
    if last[2] - time[-1] > WORTH_A_WORD:
        found.append(
            Finding(
                f"it ends first, at {earliest[2]:.4g} s, and {last[0]} at {last[2]:.4g} s: what "
                "is after is not used",
                file=earliest[0],
                quantity="time",
                remedy="leave this part or unit out if the later motion matters",
            )
        )
    return found
