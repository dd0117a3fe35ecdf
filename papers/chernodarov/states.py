"""Seventeen states, what they mean, and whether another choice of modules finds the same."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from papers.chernodarov.bench import ELLIPSOID, END, FINE_END, SITE, Bench, align, go
from papers.reproduction import (
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Evidence,
    Statement,
    amount,
)
from strapdown.alignment import FineResult
from strapdown.constants import DEG_PER_HOUR
from strapdown.estimation import QuaternionModel, RotationVectorModel
from strapdown.mechanization import MECHANIZATIONS

Array = NDArray[np.float64]

#: Mechanization, error model (the quaternions' is of the wander azimuth alone), covariance.
CHAINS = (
    ("wander_azimuth", QuaternionModel, "wd"),
    ("wander_azimuth", QuaternionModel, "ud"),
    ("wander_azimuth", QuaternionModel, "joseph"),
    ("wander_azimuth", RotationVectorModel, "wd"),
    ("ned", RotationVectorModel, "wd"),
)
# Covariances in factors and whole.
FORMS = ("wd", "ud", "joseph")
# Apart by less than this part of a standard deviation, two estimates are one.
SAME = 0.05


def seventeen(fine: FineResult) -> Statement:
    """Judge the number of the states."""
    model, used = fine.filter.model, fine.filter.mechanization
    assert isinstance(model, QuaternionModel)
    null = model.null_directions(used, fine.state.time, fine.state.row)
    T = model.to_physical(used, fine.state.time, fine.state.row)
    size = np.linalg.norm(T, axis=1).max()
    P = fine.filter.form.matrix(fine.state.covariance)
    left = np.abs(null @ P @ null.T).max() / np.abs(P).max()
    return seventeen_from(
        model.layout.size,
        int(np.linalg.matrix_rank(T / np.maximum(np.linalg.norm(T, axis=1, keepdims=True), 1e-30))),
        float(np.abs(T @ null.T).max() / size),
        float(left),
    )


def seventeen_from(states: int, rank: int, told: float, variance: float) -> Statement:
    """Judge from the number of states, what of them is physical, and what is left of the rest."""
    if rank == states:
        verdict, condition = HOLDS, ""
    else:
        verdict = HOLDS_WHEN
        condition = (
            f"{states - rank} of them, the norms of two quaternions and a turn of the wander axes "
            "about the vertical, are known to mean nothing and given no variance"
        )
    return Statement(
        "seventeen",
        "Section 3",
        "The basic vector x(t) was comprised of 17 parameters",
        verdict if states == 17 else DOES_NOT_HOLD,
        condition if states == 17 else "",
        "Three of velocity, eight of two quaternions, six of sensors, none of height. Consistency "
        "is to be judged on the physical ones.",
        (
            Evidence("states", float(states)),
            Evidence("physical errors in them", float(rank)),
            Evidence("what the other three tell of the physical ones", told),
            Evidence("their share of the covariance after the alignment", variance),
        ),
    )


# --- the same by other modules -----------------------------------------------------------------


def chains(made: Bench) -> dict[str, FineResult]:
    """Align the record of the bench by each of `CHAINS`."""
    found = {}
    for name, model, form in CHAINS:
        used = MECHANIZATIONS[name](ellipsoid=ELLIPSOID.name, height="free")
        found[f"{name}, {model.name}, {form}"] = align(made.imu, made.increments, model, form, used)
    return found


def same_organisation(found: dict[str, FineResult]) -> Statement:
    """Judge that modules can be exchanged without the rest."""
    heading = _spread(found, lambda r: float(r.alignment.roll_pitch_heading[2]))
    own = next(iter(found.values())).alignment
    drift = DEG_PER_HOUR * _spread(found, lambda r: float(_bias(r)[2]))
    return same_organisation_from(len(found), heading, float(own.sd_deg[2]), drift)


def _spread(found: dict[str, FineResult], of: Callable[[FineResult], float]) -> float:
    return float(np.ptp([of(r) for r in found.values()]))


def _bias(result: FineResult) -> Array:
    assert result.alignment.gyro_bias is not None
    return result.alignment.gyro_bias


def same_organisation_from(count: int, heading: float, sd: float, drift: float) -> Statement:
    """Judge from how far the chains are apart, in heading, deg, and drift, deg/h."""
    return Statement(
        "organisation",
        "Section 5",
        "it is apparently possible to keep the MSS&HS organization unchanged when different "
        "attitude parameters and different navigation parameters are used and also when "
        "mathematical models of sensor errors are updated",
        HOLDS if heading < SAME * sd else DOES_NOT_HOLD,
        "",
        "The record of the bench, aligned by the same program with the mechanization in wander "
        "azimuth and in north-east-down, errors as quaternions and as a rotation vector, and the "
        "covariance as W-D, as U-D and whole. Each is a name in a table.",
        (
            Evidence("chains", float(count)),
            Evidence("headings apart", heading, "°"),
            Evidence("standard deviation of the heading", sd, "°"),
            Evidence("drifts of the vertical gyro apart", drift, "deg/h"),
        ),
    )


def separate_solution(found: dict[str, FineResult]) -> Statement:
    """Judge that solving (1) and (2) separately lets sensors' errors be estimated."""
    paper = found["wander_azimuth, quaternions, wd"]
    other = found["ned, rotation_vector, wd"]
    sd = paper.alignment.gyro_bias_sd
    assert sd is not None
    apart = np.abs(_bias(paper) - _bias(other)) / sd
    return separate_from(
        float(apart.max()), paper.filter.model.layout.size, other.filter.model.layout.size
    )


def separate_from(apart: float, states: int, others: int) -> Statement:
    """Judge from drifts by both, apart in standard deviations, and from the numbers of states."""
    if apart < SAME:
        verdict = HOLDS_WHEN
        condition = (
            "no more is meant than that it can be done so: one attitude relative to the level, "
            f"and {others} states, find the same drifts to {amount(apart)} of their standard "
            "deviation"
        )
    else:
        verdict, condition = HOLDS, ""
    return Statement(
        "separate",
        "Section 3",
        "Separate solution of Eqs.(1) and (2) has made it possible to bring the depth of "
        "estimation of SINS errors to the level of sensors: gyroscopes and accelerometers.",
        verdict,
        condition,
        "The record of the bench by the paper's states in a wander azimuth, and by displacement, "
        "velocity, rotation vector and biases in north-east-down.",
        (
            Evidence("states of the paper", float(states)),
            Evidence("states of the other", float(others)),
            Evidence("drifts apart, standard deviations", apart),
        ),
    )


def factored(found: dict[str, FineResult]) -> Statement:
    """Judge W-D and U-D beside Joseph's form on the record of the bench."""
    sds = {
        form: np.sqrt(np.diagonal(_physical(found[f"wander_azimuth, quaternions, {form}"])))
        for form in FORMS
    }
    # What the model does not hold, the height, has no standard deviation.
    held = sds["joseph"] > 0.0
    off = {
        form: float(np.abs(sds[form][held] / sds["joseph"][held] - 1.0).max())
        for form in ("wd", "ud")
    }
    P = found["wander_azimuth, quaternions, wd"]
    d = np.linalg.eigvalsh(P.filter.form.matrix(P.state.covariance))
    whole = found["wander_azimuth, quaternions, joseph"]
    e = np.linalg.eigvalsh(whole.filter.form.matrix(whole.state.covariance))
    return factored_from(off, float(d.min() / d.max()), float(e.min() / e.max()))


def _physical(result: FineResult) -> Array:
    return result.filter.physical_covariance(result.state)


def factored_from(off: dict[str, float], least: float, whole: float) -> Statement:
    """Judge from standard deviations apart, and from the least eigenvalues over the largest."""
    return Statement(
        "eq5",
        "Eq. (5)",
        "Procedures for such processing rely on an U - D modification of the Kalman-Joseph filter, "
        "which is characterized by computational stability",
        HOLDS if max(off.values()) < 1e-6 else DOES_NOT_HOLD,
        "",
        "500 epochs of the alignment, the covariance singular on purpose in three directions. "
        "Standard deviations against Joseph's form; the least eigenvalue over the largest is "
        "rounding, and a product of factors has none below it.",
        (
            *(Evidence(f"{form} apart from Joseph's form", v) for form, v in off.items()),
            Evidence("least eigenvalue over the largest, W-D", least),
            Evidence("the same, Joseph", whole),
        ),
    )


# --- the vertical ------------------------------------------------------------------------------


def vertical(made: Bench) -> Statement:
    """Judge the third component of (4) over the hour on the bench."""
    free = go(made.fine.filter, made.fine.state, made.increments)
    later = free.time > END - 1200.0
    slope = np.polyfit(free.time[later], np.log(np.abs(free.alt[later])), 1)[0]
    radius = 6371000.0
    return vertical_from(
        float(free.alt[free.at(FINE_END + 60.0)]),
        float(free.alt[free.at(FINE_END + 600.0)]),
        float(free.alt[-1]),
        1.0 / float(slope),
        math.sqrt(radius / (2.0 * float(SITE.gravity[2]))),
    )


def vertical_from(
    minute: float, ten: float, hour: float, folding: float, expected: float
) -> Statement:
    """Judge from the height's error in m over times, and from the time in which it grows by e."""
    if abs(hour) < 100.0:
        verdict, condition = HOLDS, ""
    else:
        verdict = HOLDS_WHEN
        condition = (
            "the run is of minutes, or the height is held: nothing else bounds V_ζ, and its error "
            f"grows by e every {amount(folding, 's')}"
        )
    return Statement(
        "vertical",
        "Eq. (4)",
        "is the ground velocity vector of IMU motion, given by its components along the axes of "
        "the reference navigation frame",
        verdict,
        condition,
        "The hour on the bench with (4) as it stands, the vertical bias estimated before; gravity "
        "falls with height, and so a height that is too large goes on growing. No word on it is "
        "in the paper, whose figures are horizontal. Our figures hold the height.",
        (
            Evidence("height off after a minute", minute, "m"),
            Evidence("after ten minutes", ten, "m"),
            Evidence("after an hour", hour, "m"),
            Evidence("time in which it grows by e", folding, "s"),
            Evidence("√(R/2g)", expected, "s"),
        ),
    )
