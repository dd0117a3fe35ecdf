"""A chain for the log of a unit on a shoe, without satellites: a path from where it began."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import DataError, Finding
from strapdown.estimation.resting_sensors import resting_sd
from strapdown.estimation.stated_states import states_that_are_stated
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.systems.sins.proposal import Proposal
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import index_of, source_of, values_of

__all__ = ["STANCE", "STANDING", "first_stand", "on_foot", "second_order"]

#: Zero velocity at stances. Noise of a stance: a foot sways and the sole gives, far beyond the
#: noise of a sensor: so much a sample. The threshold begins at ten of these, 10 deg/s and 1 m/s²,
#: and goes to where stances and swings part. A speed that the filter knows better than this is no
#: stance, unless none was seen for five seconds. The shoe rolls over its sole, about the ground
#: 0.1 m below the unit, all of a stance.
STANCE: dict[str, Any] = {
    "kind": "zero_velocity",
    "detector": "shoe",
    "window_s": 0.025,
    "threshold": 10.0,
    "threshold_rule": "otsu",
    "rate_sd_deg_per_s": 1.0,
    "force_sd_m_per_s2": 0.1,
    "interval_s": 0.02,
    "largest_speed_m_per_s": 0.5,
    "gate_time_s": 5.0,
    "sd_m_per_s": 0.02,
    "pivot_m": 0.1,
    "correlation_time_s": 0.1,
}
#: No turn where the whole person stands: bias of the gyros, as well as a body that sways lets it
#: be known.
STANDING: dict[str, Any] = {
    "kind": "zero_rate",
    "detector": "variance",
    "window_s": 0.4,
    "threshold": 3.0,
    "rate_sd_deg_per_s": 0.5,
    "force_sd_m_per_s2": 0.05,
    "interval_s": 0.4,
    "largest_speed_m_per_s": 0.2,
    "sd_deg_per_s": 0.3,
}
#: A foot that has left its stance turns or pushes more than this, rad/s and m/s².
LEAVES, PUSHES = math.radians(30.0), 2.0
#: Before the first such sample it begins to, s; and so long it must stand, s.
BEFORE, LEAST = 0.2, 0.3
#: Of a stance between two steps: how long it is at least, and how much of either end rolls, s.
STEPPED, ROLLS = 0.2, 0.05
#: Of the standing start the alignment takes half, so that gyros are told their bias by the other,
#: and at most so much, s.
LONGEST = 10.0
#: Longest step of the covariance, s: in a swing of half a second a foot turns by 70 deg and back,
#: and over steps of 0.1 s the errors of a sensor would be laid to the wrong directions.
STEP = 0.02
#: Over so long, some strides, what a filter takes for linear stays what it is, s.
BENT = 10.0
#: The place is counted from the start: how well that is known itself is not in the answer, m, m/s.
HERE, STILL = 0.01, 0.01
#: The heading is counted from where the unit points at the start, deg.
FROM_START = 0.1


def first_stand(imu: pd.DataFrame) -> tuple[float, float] | None:
    """Return when a unit on a shoe first stands, and how long.

    Parameters
    ----------
    imu : DataFrame
        Imu table with specific force.

    Returns
    -------
    begin, length : float, s
        The start of the record, until it turns by 30 deg/s or feels 2 m/s² beyond gravity, less
        0.2 s; where that is less than 0.3 s, the first stance of 0.2 s or more, without 0.05 s at
        either end. None where there is none.
    """
    time = index_of(imu)
    rate = np.linalg.norm(values_of(imu, GYRO), axis=1)
    force: NDArray[np.float64] = np.linalg.norm(values_of(imu, ACCEL), axis=1)
    moves = (rate > LEAVES) | (np.abs(force - STANDARD_GRAVITY) > PUSHES)
    if not moves.any():
        return float(time[0]), float(time[-1] - time[0])
    length = float(time[np.argmax(moves)]) - BEFORE - float(time[0])
    if length >= LEAST:
        return float(time[0]), length
    edges = np.flatnonzero(np.diff(np.concatenate([[1], moves, [1]])))
    begin, end = time[edges[::2]], time[edges[1::2] - 1]
    stances = np.flatnonzero(end - begin >= STEPPED)
    if not stances.size:
        return None
    k = int(stances[0])
    return float(begin[k]) + ROLLS, float(end[k] - begin[k]) - 2.0 * ROLLS


def second_order(sensors: ImuUncertainty) -> float:
    """Return what a linear filter leaves of a tilt that accelerometers at rest do not know.

    Parameters
    ----------
    sensors : ImuUncertainty

    Returns
    -------
    float, m/s²
        ``sqrt(2) g sd²`` of the tilt's standard deviation sd: root mean square of
        ``g (x² + y²)/2``, by which gravity along a body that is tilted by x and y differs from that
        of one that is not. All that was learnt of the accelerometers before the tilt is known, as
        it is at the first corner, is off by as much after that.
    """
    _, accel = resting_sd(sensors, (0.0, 0.0, 0.0), (0.0, 0.0, -STANDARD_GRAVITY))
    return math.sqrt(2.0) * STANDARD_GRAVITY * float(max(accel[:2]) / STANDARD_GRAVITY) ** 2


def on_foot(made: Proposal) -> Proposal:
    """Return the chain for a unit on a shoe in the place of that for a vehicle.

    Parameters
    ----------
    made : Proposal

    Returns
    -------
    Proposal

    Raises
    ------
    DataError
        The log has no accelerometers, or the unit stands nowhere in it.
    """
    if ACCEL[0] not in made.imu.columns:
        raise DataError(
            "navigation.no-accelerometers",
            file=source_of(made.imu),
            quantity="accel",
        )
    stand = first_stand(made.imu)
    if stand is None:
        raise DataError(
            "navigation.never-stationary",
            file=source_of(made.imu),
            quantity="accel",
            stepped=STEPPED,
        )
    begin, rest = stand
    late = begin - float(index_of(made.imu)[0])
    length = math.floor(10.0 * min(0.5 * rest, LONGEST)) / 10.0
    length = max(length, LEAST) if not late else rest
    # Noise that shakes it is how a foot goes, and none of the sensor's. Whatever goes with rate and
    # force is at its largest on a foot: a g-sensitivity of 0.1 deg/s/g turns a run by degrees.
    named = made.table.get("sensors", {}).get("sensor")
    sensors: dict[str, Any] = {}
    states = dict(made.table.get("states", {}))
    if named is not None:
        known = ImuUncertainty.of_sensor(load_sensor(named))
        names = states_that_are_stated(known)
        sensors = {"sensor": named, "states": names}
        drift = second_order(known)
        if drift > max(known.accel_drift.triad) and "accel_drift" in names:
            rounded = float(f"{drift / STANDARD_GRAVITY * 1e6:.2g}")
            states["accel_drift"] = {"sd_ug": rounded, "correlation_time_s": BENT}
    log = made.table["log"] | ({"from_s": round(begin, 6)} if late else {})
    table = {
        **made.table,
        "log": log,
        "sensors": sensors,
        **({"states": states} if states else {}),
        "coarse": {
            "kind": "known_heading",
            "heading_deg": 0.0,
            "sd_deg": FROM_START,
            "duration_s": round(length, 3),
        },
        "fine": {"kind": "none"},
        "filter": {"kind": "error_state", "step_s": STEP},
        "recorder": {"kind": "full"},
        "aiding": {
            **made.table.get("aiding", {}),
            "stance": dict(STANCE),
            "standing": dict(STANDING),
        },
    }
    where = "The heading is counted from where the unit then points: north of the answer is there"
    how = (
        f"it stands for the first {rest:.3g} s: levelled by half of that. {where}, unless you "
        "state another"
    )
    findings = made.findings
    if late:
        how = (
            f"it begins while it moves: all before its first stance, {late:.3g} s, is left out. It "
            f"is levelled by {rest:.2g} s of that. {where}, unless you state another"
        )
        findings = (
            *findings,
            Finding(
                "navigation.moves-at-start",
                file=source_of(made.imu),
                quantity="accel",
                late=late,
                rest=rest,
            ),
        )
    return replace(made, table=table, rest=rest, drives=False, how=how, findings=findings)
