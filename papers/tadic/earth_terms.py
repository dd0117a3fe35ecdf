"""Coriolis, the Earth's rate and other simplifications over a crash, beside the sensors."""

from __future__ import annotations

import numpy as np

from papers.reproduction import (
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Evidence,
    Statement,
    Table,
    amount,
)
from papers.tadic.experiment import PLATFORMS, Experiments
from papers.tadic.simplifications import (
    SIMPLIFICATIONS,
    TRIPS,
    error_course,
    predicted_errors,
)

LONGER = ("10 s", "60 s")
# What may be left out beside a sensor: a tenth of its error adds half a percent to it.
NEGLIGIBLE = 0.1
# A bias of 0.2 m/s² and one of 0.3 deg/s, as the paper's own sensors have them.
ACCEL_BIAS, GYRO_BIAS = 0.2, np.radians(0.3)
GRAVITY = 9.80665


def costs() -> dict[str, dict[str, float]]:
    """Largest error of the place by simplification and trip, m: measured in the crash.

    On the longer trips predicted, as `predicted_errors` does.
    """
    found = {}
    for name, used in SIMPLIFICATIONS.items():
        found[name] = {"crash": float(error_course(TRIPS["crash"], used)["position_m"].max())}
        for trip in LONGER:
            found[name][trip] = float(predicted_errors(TRIPS[trip], name)["position_m"])
    return found


def sensor(made: Experiments) -> dict[str, float]:
    """Error of the place that the paper's sensors make, m; on longer trips by their biases."""
    ends = np.concatenate([made.ends(n) for n in PLATFORMS])
    out = {"crash": float(np.sqrt((ends**2).sum(axis=1).mean()))}
    for name, time in zip(LONGER, (10.0, 60.0), strict=True):
        out[name] = float(np.hypot(0.5 * ACCEL_BIAS * time**2, GRAVITY * GYRO_BIAS * time**3 / 6.0))
    return out


def table(found: dict[str, dict[str, float]], sensors: dict[str, float]) -> Table:
    """What each simplification costs, beside the sensors."""
    rows = [
        (name, tuple(v if v >= 1e-5 else None for v in by_trip.values()))
        for name, by_trip in found.items()
        if name != "every term"
    ]
    rows.append(("the paper's sensors", tuple(sensors.values())))
    return Table(
        "simplifications",
        "What the paper leaves out",
        "Largest error of the place in m with perfect sensors: in 750 ms of the crash, measured; "
        "in 10 and 60 s of driving at 20 m/s to the north-east, predicted. Below 10 µm a dash. "
        "Last, the paper's sensors: in the crash the RMS of all platforms and experiments, later "
        "what biases of 0.2 m/s² and 0.3°/s make.",
        ("left out", "750 ms of the crash, m", "10 s, m", "60 s, m"),
        tuple(rows),
    )


def coriolis(found: dict[str, float], sensors: dict[str, float]) -> Statement:
    """Judge that the Coriolis correction could be left out; costs and sensors in m by trip."""
    return _neglected(
        found,
        sensors,
        "coriolis",
        "Section 2.1",
        "we did not consider Coriolis correction due to very limited sensor performance",
        "The Coriolis term left out of the paper's equations, perfect sensors, against the error "
        "of its sensors in the same time.",
    )


def earth_rate(found: dict[str, float], sensors: dict[str, float]) -> Statement:
    """Judge that the Earth's rotation may be neglected; costs and sensors in m by trip."""
    return _neglected(
        found,
        sensors,
        "earth-rate",
        "Section 2.1, Eq. (7)",
        "which can be neglected for short navigation with low performance sensors",
        "The Earth's rate left out of attitude and Coriolis term, perfect sensors, against the "
        "error of the paper's sensors in the same time.",
    )


def _neglected(
    found: dict[str, float],
    sensors: dict[str, float],
    key: str,
    place: str,
    quote: str,
    because: str,
) -> Statement:
    shares = {trip: found[trip] / sensors[trip] for trip in found}
    long = [trip for trip in LONGER if shares[trip] >= NEGLIGIBLE]
    if shares["crash"] >= NEGLIGIBLE:
        verdict, condition = DOES_NOT_HOLD, ""
    elif long:
        verdict = HOLDS_WHEN
        condition = f"it is shorter than {long[0]}, where it is {amount(100.0 * shares[long[0]])} %"
    else:
        verdict, condition = HOLDS, ""
    return Statement(
        key,
        place,
        quote,
        verdict,
        condition,
        because,
        (
            Evidence("750 ms of the crash", 1e3 * found["crash"], "mm"),
            Evidence("sensors in the same time", 1e3 * sensors["crash"], "mm"),
            *(Evidence(f"{trip} at 20 m/s", found[trip], "m") for trip in LONGER),
            *(Evidence(f"sensors, {trip}", sensors[trip], "m") for trip in LONGER),
        ),
    )
