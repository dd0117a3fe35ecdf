"""The drive with fixes, outliers and an outage: plain, robust, and robust as printed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from papers.chernodarov.drive import (
    ENDS,
    OUTAGE,
    OUTLIER_SDS,
    OUTLIER_SHARE,
    PRECISE,
    RECEIVER,
    RULES,
    Drive,
    Driven,
)
from papers.chernodarov.equations import one_step
from papers.reproduction import (
    CANNOT_BE_JUDGED,
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Evidence,
    Figure,
    FigurePanel,
    Statement,
    Table,
    Trace,
    amount,
)
from strapdown.estimation import RotationVectorModel
from strapdown.navigation import OpenLoop

#: Runs: receiver, what it tells, and how it is taken.
COARSE = "3 m"
FINE = "2 cm"
RUNS = (
    *((COARSE, "clean", rule) for rule in ("plain", "robust, Huber")),
    *((COARSE, "outliers", rule) for rule in ("plain", "robust, Huber", "printed, Huber")),
    *((COARSE, "outage", rule) for rule in ("plain", "robust, Huber")),
    *((COARSE, "both", rule) for rule in ("plain", "robust, Huber", "robust, Tukey")),
    *((FINE, "outage", rule) for rule in RULES),
    *((FINE, "both", rule) for rule in ("plain", "robust, Huber")),
)
#: By the rotation vector, too.
ALSO = (COARSE, "both", "robust, Huber")
# After an outage, s: by then a good filter has long forgotten it.
LATER = 60.0
# An error that is so many times what it is without outliers is spoilt; so few, kept.
SPOILT, KEPT = 3.0, 1.5
CHOSEN = (
    f"Five minutes at rest, then {1084.0 - ENDS[1]:.0f} s through streets at up to 15 m/s. Fixes "
    "at 1 Hz, place and velocity: 3 m and 0.1 m/s, or 2 cm and 2 cm/s. Outliers: "
    f"{100.0 * OUTLIER_SHARE:g} % of the places and as many of the velocities, by "
    f"{OUTLIER_SDS:g} standard deviations. Outage: {OUTAGE[0]:g} s to {OUTAGE[1]:g} s."
)


@dataclass(frozen=True, eq=False)
class Runs:
    """All runs, by receiver, what it tells, and how it is taken.

    Attributes
    ----------
    drive : Drive
    found : dict of Driven
    by_rotation_vector, fed_forward : Driven
        `ALSO` with the other error model, and with the mechanization left free.
    """

    drive: Drive
    found: dict[tuple[str, str, str], Driven]
    by_rotation_vector: Driven
    fed_forward: Driven

    def of(self, receiver: str, fixes: str, rule: str) -> Driven:
        """Return one of `RUNS`."""
        return self.found[receiver, fixes, rule]


def runs(drive: Drive) -> Runs:
    """Drive them all."""
    receivers = {COARSE: RECEIVER, FINE: PRECISE}
    found = {
        (receiver, fixes, rule): drive.navigate(
            RULES[rule], drive.fixes(fixes, receivers[receiver])
        )
        for receiver, fixes, rule in RUNS
    }
    receiver, fixes, rule = ALSO
    told = drive.fixes(fixes, receivers[receiver])
    other = drive.navigate(RULES[rule], told, RotationVectorModel)
    forward = drive.navigate(RULES[rule], told, damping=OpenLoop())
    return Runs(drive, found, other, forward)


def since_outage(run: Driven) -> tuple[float, float]:
    """Largest errors in the outage, and from a minute after it on, m."""
    return run.largest(*OUTAGE), run.largest(OUTAGE[1] + LATER, np.inf)


def table(made: Runs) -> Table:
    """Return all runs in numbers."""
    receiver, fixes, rule = ALSO
    shown = [*made.found.items()]
    shown.append(((receiver, fixes, f"{rule}, rotation vector"), made.by_rotation_vector))
    shown.append(((receiver, fixes, f"{rule}, fed forward"), made.fed_forward))
    return Table(
        "drive",
        "The drive in numbers",
        "Horizontal error of the place, m. “Printed” is the one Newton step of (9)-(13), with W "
        "deflated. A filter whose variance is negative is lost, however well it does.",
        (
            "fixes, how they are taken",
            "RMS, m",
            "largest, m",
            f"{OUTAGE[0]:g} s to {OUTAGE[1]:g} s, largest, m",
            "from a minute after it, largest, m",
            "least variance that is stated, m²",
        ),
        tuple(
            (
                f"{receiver}, {fixes}: {rule}",
                (run.rms, run.worst, *since_outage(run), run.least),
            )
            for (receiver, fixes, rule), run in shown
        ),
    )


def figures(made: Runs) -> list[Figure]:
    """Return the errors over time."""
    out = []
    for slug, title, caption, receiver, panels in (
        (
            "drive",
            "The drive: robust against plain",
            "A tenth of the fixes is 50 standard deviations off; above, the receiver tells "
            "throughout, below, with two minutes of outage.",
            COARSE,
            (
                ("outliers", ("plain", "robust, Huber", "printed, Huber")),
                ("both", ("plain", "robust, Huber", "robust, Tukey")),
            ),
        ),
        (
            "printed-step",
            "The same drive with a precise receiver: the printed step after an outage",
            "After the outage the prediction is ten times less certain than a fix. Huber's ψ′ is 0 "
            "there, the step overshoots, takes nothing off the covariance, and goes on so.",
            FINE,
            (("outage", ("plain", "robust, Huber", "printed, Huber", "printed, Tukey")),),
        ),
    ):
        out.append(
            Figure(
                slug,
                title,
                caption,
                CHOSEN,
                "time, s",
                tuple(
                    FigurePanel(
                        f"{fixes}: error, m",
                        tuple(
                            Trace(
                                rule,
                                made.of(receiver, fixes, rule).time,
                                made.of(receiver, fixes, rule).error,
                            )
                            for rule in rules
                        ),
                        log=True,
                    )
                    for fixes, rules in panels
                ),
                marks=((OUTAGE[0], "outage"), (OUTAGE[1], "")),
            )
        )
    return out


def observed(made: Runs, inertial: Driven) -> Statement:
    """Judge (19) and (20)."""
    clean = made.of(COARSE, "clean", "plain")
    stated = float(np.sqrt(np.square(clean.sd).mean()))
    return observed_from(
        clean.rms,
        stated,
        float(inertial.error[-1]),
        float(np.hypot(*RECEIVER.triad("position_noise")[:2])),
    )


def observed_from(rms: float, stated: float, inertial: float, fix: float) -> Statement:
    """Judge from the error with fixes, what the filter states, without fixes, and of a fix, m."""
    good = rms < 0.5 * fix and rms < 2.0 * stated
    return Statement(
        "eq19-20",
        "Section 4, Eqs. (19) and (20)",
        "In the navigational mode, SINS errors were estimated and compensated for from position "
        "and velocity observations",
        HOLDS if good else DOES_NOT_HOLD,
        "",
        "With fixes and their claims as they are. Differences of angles are taken as displacements "
        "north and east, the velocities turned into these axes by C₃ᵀ with the right sign.",
        (
            Evidence("place, RMS", rms, "m"),
            Evidence("as the filter states", stated, "m"),
            Evidence("a fix alone", fix, "m"),
            Evidence("without fixes, at the end", inertial, "m"),
        ),
        "drive",
    )


def outliers(made: Runs) -> Statement:
    """Judge the counteraction of outliers."""
    clean = made.of(COARSE, "clean", "plain").rms
    of = {rule: made.of(COARSE, "outliers", rule).rms for rule in ("plain", "robust, Huber")}
    printed = made.of(COARSE, "outliers", "printed, Huber").rms
    return outliers_from(clean, of["plain"], of["robust, Huber"], printed)


def outliers_from(clean: float, plain: float, robust: float, printed: float) -> Statement:
    """Judge from RMS errors of the place, m."""
    if plain < SPOILT * clean:
        verdict = DOES_NOT_HOLD
    else:
        verdict = HOLDS if robust < KEPT * clean else DOES_NOT_HOLD
    return Statement(
        "outliers",
        "Section 1",
        "provision of mutual testing and also of the counteraction of outliers and failures",
        verdict,
        "",
        f"{100.0 * OUTLIER_SHARE:g} % of the fixes by {OUTLIER_SDS:g} standard deviations. The "
        "influence function keeps what the plain filter loses. With this receiver the "
        "prediction is always better known than a fix, and there the printed step is as good.",
        (
            Evidence("no outliers, plain, RMS", clean, "m"),
            Evidence("outliers, plain", plain, "m"),
            Evidence("outliers, robust", robust, "m"),
            Evidence("outliers, the printed step", printed, "m"),
        ),
        "drive",
    )


def continuity(made: Runs) -> Statement:
    """Judge the outage."""
    clean = made.of(COARSE, "clean", "robust, Huber")
    run = made.of(COARSE, "outage", "robust, Huber")
    both = made.of(COARSE, "both", "robust, Huber")
    return continuity_from(*since_outage(run), since_outage(clean)[1], since_outage(both)[1])


def continuity_from(during: float, later: float, clean: float, both: float) -> Statement:
    """Judge from largest errors in the outage and a minute after it, m."""
    holds = later < KEPT * clean and during < 10.0 * clean
    return Statement(
        "continuity",
        "Section 1",
        "maintenance of the continuity and global character of navigational determinations",
        HOLDS if holds else DOES_NOT_HOLD,
        "",
        "Two minutes without fixes on the drive; robust, by Huber. Continuity is judged. That a "
        "wander azimuth knows no pole is shown with the mechanization.",
        (
            Evidence("largest error in two minutes of outage", during, "m"),
            Evidence("from a minute after it", later, "m"),
            Evidence("the same without the outage", clean, "m"),
            Evidence("the same with outliers", both, "m"),
        ),
        "drive",
    )


def newton(made: Runs) -> Statement:
    """Judge the update as one Newton step, on the drive and alone."""
    printed = made.of(FINE, "outage", "printed, Huber")
    robust = made.of(FINE, "outage", "robust, Huber")
    redescending = made.of(FINE, "outage", "printed, Tukey")
    return newton_from(
        one_step(),
        since_outage(printed)[1],
        since_outage(robust)[1],
        since_outage(made.of(FINE, "outage", "plain"))[1],
        redescending.least,
    )


def newton_from(
    step: tuple[float, float, float],
    printed: float,
    robust: float,
    plain: float,
    least: float,
) -> Statement:
    """Judge from steps in units of the noise, errors after an outage, m, and a variance, m²."""
    overshoot = step[0] > 2.0 * step[1]
    if printed > SPOILT * plain or least < 0.0:
        if overshoot:
            verdict = HOLDS_WHEN
            condition = (
                "the prediction is better known than the observation; after an outage the step "
                "overshoots for ever, and "
                f"{amount(printed, 'm')} come of it where the minimiser has {amount(robust, 'm')}"
            )
        else:
            verdict, condition = DOES_NOT_HOLD, ""
    else:
        verdict, condition = HOLDS, ""
    return Statement(
        "eq12-13",
        "Eqs. (9)-(13)",
        "a W - D modification of the algorithm for adaptive robust processing of observations was "
        "implemented",
        verdict,
        condition,
        "One Newton step on Huber's loss from the prediction, where ψ′ is 0: with a prediction "
        "of variance 100 and noise of 1, an innovation of 10, one sigma, moves the state "
        "past the fix. On the drive with a receiver of 2 cm, largest errors from a minute after "
        "the outage. Robust here is the minimiser along P hᵀ.",
        (
            Evidence("moved by the printed step", step[0]),
            Evidence("moved by the minimiser", step[1]),
            Evidence("moved by Kalman's update", step[2]),
            Evidence("printed step, Huber", printed, "m"),
            Evidence("minimiser, Huber", robust, "m"),
            Evidence("plain", plain, "m"),
            Evidence("printed step, Tukey: least variance that is stated", least, "m²"),
        ),
        "printed-step",
    )


def turned_drive(damped: Driven, undamped: Driven) -> Statement:
    """Judge damping on the drive without fixes."""
    return turned_drive_from(float(damped.error[-1]), float(undamped.error[-1]), damped.sd[-1])


def turned_drive_from(damped: float, undamped: float, sd: float) -> Statement:
    """Judge from the errors at the end of the drive without fixes, m."""
    gain = undamped / damped
    return Statement(
        "tightly-coupled",
        "Section 3",
        "This has enabled us to implement a tightly-coupled scheme for the damping of sensor "
        "errors, and the above scheme included a Kalman filter in the estimation loop",
        HOLDS if gain > 1.2 else HOLDS_WHEN,
        ""
        if gain > 1.2
        else "something observes the vehicle as it drives: after an alignment at "
        f"rest alone the gain is {amount(gain)}",
        "The drive without a single fix, after five minutes of alignment at rest.",
        (
            Evidence("place at the end, estimates taken off", damped, "m"),
            Evidence("place at the end, left on", undamped, "m"),
            Evidence("as the filter states", sd, "m"),
        ),
    )


# ==================================================================================================
# What rests on recordings and curves that are not there
# ==================================================================================================

FIGURES = (4, 11)


def unpublished() -> list[Statement]:
    """Return them."""
    return [
        Statement(
            "curves",
            "Section 4, Figs. 4-11",
            "Certain of the results of a testbed experiment on the estimation of accuracy "
            "characteristics of the SINS 1000 system are shown in Figs.4-7.",
            CANNOT_BE_JUDGED,
            "",
            "The curves did not survive scanning and the text gives none of their numbers: no "
            "error, no drift, no duration. The recordings were not published.",
            (Evidence("figures without a number", float(FIGURES[1] - FIGURES[0] + 1)),),
        ),
        Statement(
            "made-to-order",
            "Section 4",
            "The studies conducted have corroborated the fact that it is effective to apply the "
            "object-oriented technology to the creation of SINSs which can be made to order.",
            CANNOT_BE_JUDGED,
            "",
            "No other way of creating one was tried, and no effort is stated.",
            (Evidence("systems compared", 1.0),),
        ),
    ]
