"""A run of navigation as JSON: where it ended, how well, what was estimated, and how."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.alignment.alignment import Alignment
from strapdown.config.navigation_checks import STAGES
from strapdown.evaluation.plane_bound import plane_bound
from strapdown.navigation.record import NavigationRecord
from strapdown.report.navigation_agreement import Agreement
from strapdown.report.navigation_conventions import CONVENTIONS
from strapdown.report.navigation_errors import Score
from strapdown.report.navigation_found import NavigationFound, examine
from strapdown.report.navigation_result import told_of
from strapdown.report.navigation_trust import trust
from strapdown.report.navigation_values import distance_over_ground, worst_within
from strapdown.report.navigation_words import cautions, headline
from strapdown.systems.sins.result import NavigationResult
from strapdown.tables import EULER, GEODETIC, NED, VELOCITY

__all__ = ["navigation_json"]

MODULES = (*STAGES, "aiding")

Array = NDArray[np.float64]


def navigation_json(
    result: NavigationResult, found: NavigationFound | None = None
) -> dict[str, Any]:
    """Return everything that a program would ask of a run of navigation.

    Parameters
    ----------
    result : NavigationResult
    found : NavigationFound, optional
        Of `examine`, where it was worked out already.

    Returns
    -------
    dict
        Angles and their standard deviations in degrees; estimates of the sensors in SI.
    """
    record, source = result.record, result.source
    time = record.trajectory.index
    found = examine(told_of(result)) if found is None else found
    verdict = trust(found)
    return {
        "conventions": {key.lower().replace(" ", "_"): text for key, text in CONVENTIONS},
        "answer": _plain(headline(found)),
        "trust": {
            "verdict": verdict.verdict,
            "for": [f.plain() for f in verdict.supporting],
            "against": [f.plain() for f in verdict.against],
        },
        "cautions": [_plain(f"{head}: {text}") for head, text in cautions(found)],
        "record": {
            "name": source.name,
            "what": source.what,
            "samples": len(source.imu),
            "from_s": float(source.imu.index[0]),
            "to_s": float(source.imu.index[-1]),
            "read_as": [asdict(reading) for reading in source.readings],
        },
        "ellipsoid": result.ellipsoid.name,
        "trajectory": {
            "rows": len(time),
            "from_s": float(time[0]),
            "to_s": float(time[-1]),
            "travelled_m": distance_over_ground(record.trajectory),
        },
        "alignment": {
            "coarse": _alignment(result.coarse),
            "fine": None if result.fine is None else _alignment(result.fine.alignment),
        },
        "start": _state(found, 0),
        "end": _state(found, -1),
        "sensors": {
            str(name): {
                "unit": record.units.get(str(name), ""),
                "estimate": _number(record.sensors[name].iloc[-1]),
                "sd": _number(record.sensors_sd[name].iloc[-1]),
            }
            for name in record.sensors.columns
        },
        "smoothing": _smoothing(found),
        "observations": {one.name: _innovations(one) for one in found.agreements},
        "outages": _outages(record),
        "withheld": [
            {
                "aid": w.aid,
                "from_s": w.begin,
                "to_s": w.end,
                "largest_horizontal_error_m": _number(w.error_m),
                "bound_95_m": _number(w.bound_m),
                "inside": w.inside,
                "largest_horizontal_error_forward_m": (
                    None if w.forward_m is None else _number(w.forward_m)
                ),
            }
            for w in found.told.withheld
        ],
        "modes": [{"mode": s.name, "from_s": s.begin, "to_s": s.end} for s in record.modes],
        "events": [{"time_s": e.time, "kind": e.kind, "what": e.what} for e in record.events],
        "against": _against(found),
        "control_points": _points(found),
        "method": _method(result),
        "findings": [f.plain() for f in result.findings],
    }


def _smoothing(found: NavigationFound) -> dict[str, Any] | None:
    """How filter and smoother agree; None of a run that was not smoothed."""
    one = found.smoother
    if one is None:
        return None
    return {
        name: {
            "instants": int(one.instants[k]),
            "share_within_3_sd": _number(one.share[k]),
            "rms_in_sd": _number(one.rms[k]),
        }
        for k, name in enumerate(one.columns)
    }


def _method(result: NavigationResult) -> dict[str, Any]:
    """The modules and their options; where files stand is no part of it."""
    chosen: dict[str, Any] = result.spec.model_dump(
        mode="json",
        include=set(MODULES),
        exclude_none=True,
        serialize_as_any=True,
    )
    for aid in chosen["aiding"].values():
        aid.pop("path", None)
    return chosen


def _against(found: NavigationFound) -> dict[str, Any] | None:
    """Errors beside the truth, at the samples that follow the marks of the covariance."""
    errors = found.errors
    if errors is None:
        return None
    return {
        "name": found.told.truth_name,
        "instants": len(errors.time),
        "from_s": float(errors.time[0]),
        "to_s": float(errors.time[-1]),
        "mean_nees": _number(errors.nees.mean()) if errors.freedom else None,
        "nees_of": errors.freedom,
        "errors": {score.quantity: _score(score) for score in errors.scores},
    }


def _points(found: NavigationFound) -> dict[str, Any] | None:
    """The path at its control points, after the origin and heading that fit best."""
    score = found.told.points
    if score is None:
        return None
    return {
        "points": len(score.time),
        "points_given": score.given,
        "way_m": score.way,
        "rms_m": score.rms,
        "median_m": score.median,
        "largest_m": score.largest,
        "largest_at_s": score.largest_at,
        "turn_deg": score.turn_deg,
    }


def _outages(record: NavigationRecord) -> list[dict[str, Any]]:
    """Each with the largest bound at a mark in it; None where there is no mark."""
    out = []
    for aid, spans in record.outages.items():
        for span in spans:
            worst = worst_within(record, span)
            bound = None if worst is None else _number(worst[0])
            out.append(
                {
                    "aid": aid,
                    "from_s": span.begin,
                    "to_s": span.end,
                    "largest_horizontal_bound_95_m": bound,
                }
            )
    return out


def _score(score: Score) -> dict[str, Any]:
    unit = {"m": "m", "m/s": "m_per_s", "deg": "deg"}[score.unit]
    return {
        f"rms_{unit}": _number(score.rms),
        f"largest_{unit}": _number(score.largest),
        "largest_at_s": score.largest_at,
        f"bound_95_rms_{unit}": _number(score.bound),
        "share_within_bound": score.share,
    }


def _state(found: NavigationFound, row: int) -> dict[str, Any]:
    """Place, velocity and attitude with the standard deviations of the nearest mark."""
    record = found.record
    at, how = record.trajectory.iloc[row], record.sd.iloc[row]
    units = dict.fromkeys(VELOCITY, "m_per_s") | dict.fromkeys(EULER, "deg")
    units |= {"lat": "deg", "lon": "deg", "alt": "m"} | dict.fromkeys(NED, "m")
    names = [*GEODETIC, *VELOCITY, *EULER]
    return {
        "time_s": float(record.trajectory.index[row]),
        **{f"{n}_{units[n]}": _number(at[n]) for n in names},
        "sd_at_s": float(record.sd.index[row]),
        **{f"{n}_sd_{units[n]}": _number(how[n]) for n in [*NED, *VELOCITY, *EULER]},
        "horizontal_bound_95_m": _number(plane_bound(record.covariance)[row]),
    }


def _alignment(one: Alignment | None) -> dict[str, Any] | None:
    if one is None:
        return None
    angles, sd = one.roll_pitch_heading, one.sd_deg
    return {
        "method": one.method,
        "time_s": one.time,
        **{f"{a}_deg": float(angles[k]) for k, a in enumerate(EULER)},
        **{f"{a}_sd_deg": float(sd[k]) for k, a in enumerate(EULER)},
    }


def _innovations(one: Agreement) -> dict[str, Any]:
    """How often an aid was taken, and how its innovations lie to what was expected of them."""
    return {
        "components": list(one.labels),
        "epochs": one.epochs,
        "rejected": one.rejected,
        "weakened": one.weakened,
        "rms_in_sd": _number(one.ratio),
        "mean_nis": _number(one.mean_nis),
        "mean_nis_expected_95": [_number(x) for x in one.band],
        "correlation_next_epoch": _number(one.correlation),
        "correlation_by_chance_95": _number(one.correlation_bound),
        "verdicts": [
            {"kind": v.kind, "component": v.component, "since_s": v.since, "what": v.what}
            for v in one.consistency.verdicts
        ],
        "rms": {label: _number(_rms(one.nu[one.used, k])) for k, label in enumerate(one.labels)},
    }


def _rms(values: Array) -> float:
    return math.sqrt(float(np.square(values).mean())) if values.size else math.nan


def _plain(text: str) -> str:
    return text.replace("\u00a0", " ")


def _number(value: Any) -> float | None:
    number = float(value)
    return number if math.isfinite(number) else None
