"""What in a log's numbers can hardly be, or should be known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.tables import find_gaps

Array = NDArray[np.float64]
AXES = "xyz"

# Beyond this no rate is one, and squares of it leave the range of doubles soon.
IMPOSSIBLE_RATE = 1e6  # rad/s
# Nothing that is carried, driven or flown turns like this for a twentieth of a log.
LASTING_RATE = 20.0  # rad/s, 3 turns a second
# No gyro in a phone, a toy, a car or an aircraft reads this; a unit that is wrong does.
ABSURD_RATE = 100.0  # rad/s, 16 turns a second
# Full scales that gyros are made with, deg/s. A run of equal readings at one of them was cut off.
FULL_SCALES = (125.0, 250.0, 400.0, 450.0, 500.0, 1000.0, 2000.0, 4000.0)
CUT_OFF_RUN = 3  # samples

# A gap this long holds a motion that nothing tells of.
LONG_GAP = 1.0  # s


def report_gaps(name: str, time: Array, gyro: Array, findings: list[Finding]) -> None:
    """Say where time has holes, and how much may have been turned in the longest."""
    gaps = find_gaps(time)
    if not gaps:
        return
    worst = max(gaps, key=lambda g: g.length)
    speed = np.sqrt((gyro[worst.sample - 1 : worst.sample + 1] ** 2).sum(axis=1)).max()
    missed = float(np.degrees(speed * worst.length))
    findings.append(
        Finding(
            "io.long-gap" if worst.length >= LONG_GAP else "io.gaps",
            file=name,
            quantity="time",
            severity="warning" if worst.length >= LONG_GAP else "note",
            count=len(gaps),
            length=worst.length,
            start=worst.start,
            end=worst.end,
            usual=worst.usual,
            missed_deg=missed,
        )
    )


def report_absurd(
    name: str, gyro: Array, row: Callable[[int], int], findings: list[Finding]
) -> None:
    """Say where a rate is more than can be, or is cut off at the sensor's full scale.

    Raises
    ------
    DataError
        A rate is beyond anything that turns.
    """
    largest = np.abs(gyro).max(axis=0)
    k = int(largest.argmax())
    if largest[k] > IMPOSSIBLE_RATE:
        at = int(np.abs(gyro[:, k]).argmax())
        raise DataError(
            "io.rate-impossible",
            file=name,
            row=row(at),
            quantity=f"gyro_{AXES[k]}",
            gyro=gyro[at, k],
        )
    lasting = float(np.quantile(np.sqrt((gyro * gyro).sum(axis=1)), 0.95))
    if LASTING_RATE < lasting <= largest[k] <= ABSURD_RATE:
        findings.append(
            Finding(
                "io.rate-absurd-for-long",
                file=name,
                quantity="gyro",
                lasting=lasting,
                lasting_2=lasting / (2 * np.pi),
            )
        )
    if largest[k] > ABSURD_RATE:
        at = int(np.abs(gyro[:, k]).argmax())
        findings.append(
            Finding(
                "io.rate-absurd",
                file=name,
                row=row(at),
                quantity=f"gyro_{AXES[k]}",
                gyro=gyro[at, k],
                largest=largest[k] / (2 * np.pi),
            )
        )
    for k in range(3):
        reading = float(np.degrees(largest[k]))
        # A 16-bit reading ends one step short of the full scale.
        scale = next((s for s in FULL_SCALES if s * (1 - 1e-3) <= reading <= s * 1.0001), None)
        if scale is None:
            continue
        full = np.abs(gyro[:, k]) == largest[k]
        run = np.convolve(full, np.ones(CUT_OFF_RUN), mode="valid") == CUT_OFF_RUN
        if run.any():
            findings.append(
                Finding(
                    "io.rate-at-full-scale",
                    file=name,
                    row=row(int(run.argmax())),
                    quantity=f"gyro_{AXES[k]}",
                    full=int(full.sum()),
                    reading=reading,
                )
            )
