"""Figs. 4 and 5: signals at 1 kHz, and what the robust digital filter makes of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from papers.chernodarov.bench import (
    AVERAGE,
    COARSE_END,
    END,
    FINE_END,
    OUTLIER_SDS,
    OUTLIER_SHARE,
    OUTPUT_RATE,
    RATE,
    SHOWN,
    Bench,
)
from papers.chernodarov.damping import covariance_after
from papers.chernodarov.drive import ROAD_SPEED
from papers.reproduction import (
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Evidence,
    Figure,
    FigurePanel,
    Statement,
    Trace,
    amount,
)
from strapdown import rotation
from strapdown.alignment import FineResult
from strapdown.constants import DEG_PER_HOUR
from strapdown.estimation import PHYSICAL
from strapdown.prefilter import Grid, RobustFir, RobustWd
from strapdown.tables import ACCEL, GYRO, imu_table

Array = NDArray[np.float64]

PRIMARY, PRIMARY_SEED = 4.0, 1  # s
TURN_DEG_S = 10.0
ARC_SECONDS = DEG_PER_HOUR  # deg/h are arc seconds a second
CHOSEN = (
    "Sensors of the catalogue's fog-1000, unit 1, at rest at 55.98° north with roll 0.5°, pitch "
    "−0.8°, heading 40°. One sample in 10 000 of each channel is knocked off by 50 standard "
    "deviations. The filter: outliers replaced, linear-phase low-pass, 100 Hz."
)


def signal_figures(made: Bench) -> list[Figure]:
    """Return Figs. 4 and 5."""
    time = made.imu.index.to_numpy(dtype=np.float64)
    shown = (time >= SHOWN[0]) & (time <= SHOWN[1])
    wd = RobustWd(rate=OUTPUT_RATE).apply(
        imu_table(made.raw_time, made.raw[:, :3], made.raw[:, 3:], sampling="mean")
    )
    out = []
    for slug, title, channel, column, factor, label in (
        (
            "fig4",
            "Fig. 4: the “vertical” gyro, as it comes and smoothed",
            GYRO[2],
            2,
            ARC_SECONDS,
            "turn rate, arcsec/s",
        ),
        (
            "fig5",
            "Fig. 5: a horizontal accelerometer, as it comes and smoothed",
            ACCEL[0],
            3,
            1.0,
            "specific force, m/s²",
        ),
    ):
        smooth = made.imu[channel].to_numpy(dtype=np.float64)[shown]
        kalman = wd.imu[channel]
        traces = (
            Trace("1 kHz", made.raw_time, factor * made.raw[:, column]),
            Trace("smoothed, 100 Hz", time[shown], factor * smooth),
            Trace(
                "W-D filter, 100 Hz",
                kalman.index.to_numpy(dtype=np.float64),
                factor * kalman.to_numpy(dtype=np.float64),
            ),
        )
        out.append(
            Figure(
                slug,
                title,
                "The robust digital filter takes the outliers and most of the noise; so does the "
                "W-D filter of (6)-(15) on the same samples, as primary processing.",
                CHOSEN,
                "time, s",
                (FigurePanel(label, traces),),
            )
        )
    return out


@dataclass(frozen=True)
class Primary:
    """A prefilter on 1 kHz samples of a gyro at rest and in a turn.

    Attributes
    ----------
    noise : float
        Standard deviation that is left at rest, relative to that of a sample.
    doubted, turning : int
        Samples that it takes for outliers, at rest and in the turn.
    angle : float, deg
        Error of the turn's angle.
    """

    noise: float
    doubted: int
    turning: int
    angle: float


def primary() -> tuple[Primary, Primary, int]:
    """Filter four seconds by the digital filter and by (6)-(15).

    Returns
    -------
    digital, wd : Primary
    outliers : int
        How many there are, in each of the two.
    """
    rng = np.random.default_rng(PRIMARY_SEED)
    time = np.arange(round(PRIMARY * RATE) + 1) / RATE
    sd = np.repeat([1e-5, 1e-3], 3)  # rad/s, m/s²: the ratios below do not depend on them
    still = sd * rng.standard_normal((len(time), 6))
    outliers = still[250::500]  # away from both ends, which the filters do not see alike
    outliers += OUTLIER_SDS * sd
    middle = time - 0.5 * PRIMARY
    rate = np.radians(TURN_DEG_S) * np.where(
        np.abs(middle) < 1.0, 0.5 * (1.0 + np.cos(np.pi * middle)), 0.0
    )
    turned = still.copy()
    turned[:, 2] += rate
    found = []
    for prefilter in (RobustFir(rate=OUTPUT_RATE), RobustWd(rate=OUTPUT_RATE)):
        rest, turn = (
            prefilter.apply(imu_table(time, v[:, :3], v[:, 3:], sampling="mean"))
            for v in (still, turned)
        )
        quiet = rest.imu[GYRO[2]].to_numpy(dtype=np.float64)
        change = turn.imu[GYRO[2]].to_numpy(dtype=np.float64) - quiet
        found.append(
            Primary(
                float(quiet.std()) / sd[2],
                len(rest.report.replaced),
                len(turn.report.replaced),
                float(np.degrees(abs(change.sum() / OUTPUT_RATE - rate.sum() / RATE))),
            )
        )
    return found[0], found[1], outliers.size


def primary_level(digital: Primary, wd: Primary, outliers: int) -> Statement:
    """Judge (6)-(15) as primary processing, from the digital filter's run and its own."""
    quiet = wd.noise < 1.05 * digital.noise and wd.doubted >= outliers
    # Of all samples a robust filter may doubt a few that are sound.
    calm = wd.turning < 2 * outliers
    if quiet and calm:
        verdict, condition = HOLDS, ""
    elif quiet:
        verdict = HOLDS_WHEN
        condition = (
            f"the unit does not turn: in a turn of {TURN_DEG_S:g}°/s the filter takes "
            f"{wd.turning} samples for outliers where there are {outliers}"
        )
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "primary-level",
        "Section 3",
        "Algorithm (6) – (15) has been implemented at the level of primary and second processing "
        "of signals.",
        verdict,
        condition,
        "Level and slope of each channel, estimated by (6)-(15) from the samples at 1 kHz, beside "
        "the robust digital filter on the same samples. At rest it leaves less noise. Its model "
        "of the motion is a slope that changes slowly: samples of a faster motion look like "
        "outliers to it, though the angle of this turn is kept.",
        (
            Evidence("noise left, digital filter", digital.noise),
            Evidence("noise left, W-D filter", wd.noise),
            Evidence("outliers put in", float(outliers)),
            Evidence("taken for outliers at rest, W-D filter", float(wd.doubted)),
            Evidence("taken for outliers in the turn, digital filter", float(digital.turning)),
            Evidence("taken for outliers in the turn, W-D filter", float(wd.turning)),
            Evidence("error of the turn's angle, W-D filter", wd.angle, "°"),
        ),
        "fig4",
    )


def smoothed(made: Bench) -> Statement:
    """Judge the filter of Figs. 4 and 5 on the whole record."""
    rest = made.imu[made.imu.index <= FINE_END]
    ratios = {}
    for name, channel, k in (("gyro", GYRO[2], 2), ("accelerometer", ACCEL[0], 3)):
        values = rest[channel].to_numpy(dtype=np.float64)
        # Differences over a second: the drift is nothing in them.
        apart = values[round(OUTPUT_RATE) :] - values[: -round(OUTPUT_RATE)]
        ratios[name] = float(apart.std() / np.sqrt(2.0) / made.raw_sd[k])
    whole = int(made.outliers.sum())
    return smoothed_from(ratios, made.noise_factor, made.found / whole, made.wrongly, whole)


def smoothed_from(
    ratios: dict[str, float], designed: float, found: float, wrongly: int, outliers: int
) -> Statement:
    """Judge from the noise that is left, by design, and from the outliers that were found."""
    quiet = all(r < 1.05 * designed for r in ratios.values())
    holds = quiet and found > 0.99 and wrongly < 0.01 * outliers
    return Statement(
        "smoothed",
        "Section 4, Figs. 4 and 5",
        "the output signal (a dark-colored graph) of the same gyro, which was smoothed by means "
        "of a robust digital filter",
        HOLDS if holds else DOES_NOT_HOLD,
        "",
        f"One sample in {1.0 / OUTLIER_SHARE:.0f} was knocked off by {OUTLIER_SDS:g} standard "
        "deviations. What is left of the noise is what the weights of the filter leave of white "
        "noise, as if there had been no outliers.",
        (
            *(Evidence(f"noise left, {name}", r) for name, r in ratios.items()),
            Evidence("noise left, by design", designed),
            Evidence("outliers put in", float(outliers)),
            Evidence("found", 100.0 * found, "%"),
            Evidence("good samples replaced", float(wrongly)),
        ),
        "fig4",
    )


def phase() -> Statement:
    """Judge that phases are not distorted."""
    low_pass = RobustFir(rate=OUTPUT_RATE).low_pass(Grid(0.0, 1.0 / RATE, True))
    weights = low_pass.weights
    return phase_from(float(np.abs(weights - weights[::-1]).max()), low_pass.delay)


def phase_from(asymmetry: float, delay: float) -> Statement:
    """Judge from the asymmetry of the weights and from the delay in s that the stamps take off."""
    if asymmetry > 1e-12:
        verdict, condition = DOES_NOT_HOLD, ""
    else:
        verdict = HOLDS_WHEN
        condition = "the filter's delay is taken off the stamps, as it is here"
    return Statement(
        "phase",
        "Section 1",
        "Such an organization must exclude phase distortions and must provide the required "
        "frequency of determining the parameters of Acft motion.",
        verdict,
        condition,
        "The weights are symmetric and the same for all six channels: one delay for every "
        "frequency, and none between gyros and accelerometers.",
        (
            Evidence("asymmetry of the weights", asymmetry),
            Evidence("delay", delay, "s"),
            Evidence(f"way in it at {ROAD_SPEED:g} m/s", ROAD_SPEED * delay, "m"),
        ),
    )


# ==================================================================================================
# Figs. 6 and 7: drifts and biases estimated at rest, beside what they are
# ==================================================================================================

# A standard deviation that falls by less tells that nothing was learnt.
LEARNT = 0.8


@dataclass(frozen=True)
class Learnt:
    """Standard deviations before and after the alignment, level axes: north, east, down.

    Attributes
    ----------
    drift_before, drift_after : tuple of float, deg/h
    bias_before, bias_after : tuple of float, m/s²
    heading_drift, tilt_bias : float
        Correlation of the heading with the east drift, of the tilt about east with the bias north.
    """

    drift_before: tuple[float, ...]
    drift_after: tuple[float, ...]
    bias_before: tuple[float, ...]
    bias_after: tuple[float, ...]
    heading_drift: float
    tilt_bias: float


def learnt(fine: FineResult) -> Learnt:
    """Ask the covariance of an alignment what it has learnt."""
    C = rotation.dcm_from_quaternion(fine.alignment.q_nb)
    P = covariance_after(fine)
    turn = np.eye(len(P))
    for at in (PHYSICAL, PHYSICAL + 3):
        turn[at : at + 3, at : at + 3] = C
    P = turn @ P @ turn.T
    sd = np.sqrt(np.diagonal(P))
    # The error model has no height: its error has no standard deviation.
    sd[sd == 0.0] = 1.0
    R = P / np.outer(sd, sd)
    before = np.sqrt(np.square(C) @ np.square(fine.filter.model.stacked.sd.reshape(2, 3)).T)
    drift, bias = slice(PHYSICAL, PHYSICAL + 3), slice(PHYSICAL + 3, PHYSICAL + 6)
    return Learnt(
        tuple((DEG_PER_HOUR * before[:, 0]).tolist()),
        tuple((DEG_PER_HOUR * sd[drift]).tolist()),
        tuple(before[:, 1].tolist()),
        tuple(sd[bias].tolist()),
        float(R[8, PHYSICAL + 1]),
        float(R[7, PHYSICAL + 3]),
    )


def drift_figures(made: Bench) -> list[Figure]:
    """Return Figs. 6 and 7."""
    history = made.fine.history
    time = np.append(history.index.to_numpy(dtype=np.float64), END)
    out = []
    for slug, title, caption, label, factor, means, true, columns in (
        (
            "fig6",
            "Fig. 6: drifts of the gyros and their estimates",
            "Means of 10 s scatter by the noise. The estimate of the vertical gyro finds its "
            "drift; that of a horizontal one finds it as far as it does not look like a heading.",
            "deg/h",
            DEG_PER_HOUR,
            made.drift_means,
            made.drift,
            [f"gyro_bias_{axis}" for axis in "xyz"],
        ),
        (
            "fig7",
            "Fig. 7: biases of the accelerometers and their estimates",
            "That of a horizontal accelerometer is taken for a tilt: its estimate stays where it "
            "was. The vertical one is found.",
            "m/s²",
            1.0,
            made.bias_means,
            made.bias,
            [f"accel_bias_{axis}" for axis in "xyz"],
        ),
    ):
        panels = []
        for k, axis in enumerate("xyz"):
            estimate = factor * history[columns[k]].to_numpy(dtype=np.float64)
            panels.append(
                FigurePanel(
                    f"{axis}, {label}",
                    (
                        Trace(f"mean of {AVERAGE:g} s", made.mean_time, factor * means[:, k]),
                        Trace("without noise", made.mean_time, factor * true[:, k], reference=True),
                        Trace("estimate", time, np.append(estimate, estimate[-1])),
                    ),
                )
            )
        out.append(
            Figure(
                slug,
                title,
                caption,
                CHOSEN,
                "time, s",
                tuple(panels),
                marks=((COARSE_END, "fine alignment"), (FINE_END, "autonomous")),
            )
        )
    return out


def follows(made: Bench) -> Statement:
    """Judge the estimate of Fig. 6 against the means of 10 s."""
    during = (made.mean_time > COARSE_END + 1.0) & (made.mean_time < FINE_END + 1.0)
    means = DEG_PER_HOUR * made.drift_means[during, 2]
    alignment = made.fine.alignment
    assert alignment.gyro_bias is not None and alignment.gyro_bias_sd is not None
    estimate = DEG_PER_HOUR * float(alignment.gyro_bias[2])
    error = estimate - DEG_PER_HOUR * float(made.drift[during][-1, 2])
    return follows_from(
        estimate,
        float(means.mean()),
        float(means.std(ddof=1)),
        error,
        DEG_PER_HOUR * float(alignment.gyro_bias_sd[2]),
        len(means),
        learnt(made.fine),
    )


def follows_from(
    estimate: float,
    mean: float,
    scatter: float,
    error: float,
    sd: float,
    count: int,
    known: Learnt,
) -> Statement:
    """Judge from the vertical gyro's estimate, the means of 10 s and its error, deg/h."""
    near = abs(estimate - mean) < 3.0 * scatter / np.sqrt(count) + 3.0 * sd and abs(error) < 3 * sd
    east = known.drift_after[1] / known.drift_before[1]
    if not near:
        verdict, condition = DOES_NOT_HOLD, ""
    elif east > LEARNT:
        verdict = HOLDS_WHEN
        condition = (
            "the gyro's axis is not east: of an eastward drift a rest tells nothing (its standard "
            f"deviation stays at {amount(100.0 * east, '%')}), for a heading that is off looks "
            "the same"
        )
    else:
        verdict, condition = HOLDS, ""
    return Statement(
        "fig6-estimate",
        "Section 4, Fig. 6",
        "its estimate which was obtained both in the processing of observations (16)-(18) with a "
        "frequency of 1 Hz during the fine initial alignment (100-600 sec)",
        verdict,
        condition,
        "The vertical gyro of the unit on the bench, whose drift is known; the standard deviations "
        "of drifts north, east and down are those of the filter.",
        (
            Evidence("estimate at 600 s", estimate, "deg/h"),
            Evidence("mean of the means of 10 s", mean, "deg/h"),
            Evidence("scatter of the means of 10 s", scatter, "deg/h"),
            Evidence("estimate less true drift", error, "deg/h"),
            Evidence("its standard deviation", sd, "deg/h"),
            *(
                Evidence(f"left of what was unknown, drift {axis}", 100.0 * a / b, "%")
                for axis, a, b in zip(
                    ("north", "east", "down"), known.drift_after, known.drift_before, strict=True
                )
            ),
        ),
        "fig6",
    )


def predicted(made: Bench) -> Statement:
    """Judge what (6) makes of the estimate in the hour after the alignment."""
    later = made.mean_time > FINE_END + 1.0
    alignment = made.fine.alignment
    assert alignment.gyro_bias is not None
    off = DEG_PER_HOUR * (made.drift[later, 2] - alignment.gyro_bias[2])
    without = DEG_PER_HOUR * made.drift[later, 2]
    return predicted_from(
        float(np.sqrt(np.square(off).mean())),
        float(np.sqrt(np.square(without).mean())),
        float(off[-1]),
        DEG_PER_HOUR * float(made.fine.filter.model.stacked.drive[2]) * np.sqrt(END - FINE_END),
    )


def predicted_from(off: float, without: float, last: float, moved: float) -> Statement:
    """Judge from the RMS of the drift with and without the estimate taken off, deg/h."""
    if off < 0.7 * without:
        verdict = HOLDS_WHEN
        condition = (
            "the drift does not move: (6) keeps the estimate, and what moves is missed, "
            f"{amount(moved, 'deg/h')} in an hour (one sigma)"
        )
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "fig6-predicted",
        "Section 4, Fig. 6",
        "when predicting such an estimate in the navigational mode with the aid of algorithm (6)",
        verdict,
        condition,
        "The vertical gyro's drift in the hour after the alignment, without its noise.",
        (
            Evidence("drift, RMS over the hour", without, "deg/h"),
            Evidence("the same, less the prediction", off, "deg/h"),
            Evidence("at the end of the hour", last, "deg/h"),
            Evidence("what a drift moves in an hour", moved, "deg/h"),
        ),
        "fig6",
    )


def accelerometers(made: Bench) -> Statement:
    """Judge Fig. 7."""
    alignment = made.fine.alignment
    assert alignment.accel_bias is not None
    at = int(np.searchsorted(made.mean_time, FINE_END - 1.0))
    return accelerometers_from(
        made.bias[at].tolist(), alignment.accel_bias.tolist(), learnt(made.fine)
    )


def accelerometers_from(true: list[float], estimate: list[float], known: Learnt) -> Statement:
    """Judge from biases and their estimates, m/s², and from what was learnt."""
    left = [a / b for a, b in zip(known.bias_after, known.bias_before, strict=True)]
    if left[0] > LEARNT and left[2] < LEARNT:
        verdict, condition = HOLDS_WHEN, "the accelerometer is the vertical one"
    elif max(left) < LEARNT:
        verdict, condition = HOLDS, ""
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "fig7",
        "Section 4, Fig. 7",
        "In Fig.7, an estimate of the accelerometer bias is shown.",
        verdict,
        condition,
        "Its label is that of x. A horizontal bias and the tilt that it makes are one thing to a "
        "body at rest: what such an estimate shows is what was assumed before.",
        (
            Evidence("true bias, x", true[0], "m/s²"),
            Evidence("its estimate", estimate[0], "m/s²"),
            Evidence("true bias, z", true[2], "m/s²"),
            Evidence("its estimate, z", estimate[2], "m/s²"),
            *(
                Evidence(f"left of what was unknown, bias {axis}", 100.0 * share, "%")
                for axis, share in zip(("north", "east", "down"), left, strict=True)
            ),
        ),
        "fig7",
    )


def attitude_and_drifts(made: Bench) -> Statement:
    """Judge that attitude and drifts were both estimated."""
    return attitude_and_drifts_from(learnt(made.fine))


def attitude_and_drifts_from(known: Learnt) -> Statement:
    """Judge from the correlations that are left."""
    tied = min(abs(known.heading_drift), abs(known.tilt_bias))
    if tied > 0.9:
        verdict = HOLDS_WHEN
        condition = (
            "three combinations are left out: two tilts with the horizontal biases that make them, "
            "the heading with a drift east; no time at rest tells them apart"
        )
    else:
        verdict, condition = HOLDS, ""
    return Statement(
        "attitude-and-drifts",
        "Section 4, Eqs. (16)-(18)",
        "estimation of and compensation for both the errors of the angular position of IMU sensors "
        "and IMU sensor drifts were carried out",
        verdict,
        condition,
        "(16) strengthens what (17) and (18) tell of the drifts, and adds no direction to it: an "
        "attitude that is off by φ, with the drift and the bias that keep it so, reads as rest.",
        (
            Evidence("correlation of the heading with the drift east", known.heading_drift),
            Evidence("correlation of the tilt about east with the bias north", known.tilt_bias),
        ),
    )
