"""Chernodarov (2009), reproduced: bench run and drive, every testable statement with a verdict."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import numpy as np
from threadpoolctl import threadpool_limits

from papers.chernodarov import damping, equations, robustness, signals, states
from papers.chernodarov.bench import Bench, bench
from papers.chernodarov.damping import Units, units
from papers.chernodarov.drive import Drive
from papers.reproduction import (
    CANNOT_BE_JUDGED,
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Part,
    Progress,
    Reproduction,
    put_together,
    silent,
)
from strapdown.estimation import QuaternionModel
from strapdown.mechanization import WanderAzimuth

PAPER = (
    "A. Chernodarov, Bench Development of Navigation Algorithms by Application of Object-Oriented "
    "Technologies, Transport and Telecommunication, 2009"
)

CONVENTIONS = (
    ("Bench and drive", "simulated, with the exact motion and every error of the sensors known"),
    (
        "Place",
        "55.98° N, 37.2° E, 200 m on the ellipsoid of Krassovsky (1940): the town of the author's "
        "address, for the paper prints no place, and the ellipsoid of its R",
    ),
    ("Axes of the body", "forward, right, down; the paper's “vertical” gyro is z"),
    ("Level axes", "ξ, η, ζ with ζ up, ξ turned anticlockwise from east by the wander angle A"),
    ("Errors", "computed less true; bias and drift: reading less truth"),
    ("Stages", "coarse alignment to 100 s, fine to 600 s, then an hour without aids"),
    (
        "Curves",
        "the paper's figures did not survive scanning; no curve of it is claimed to be matched",
    ),
)

# As they stand in the paper.
ORDER = (
    *("continuity", "outliers", "phase", "eq1", "eq2", "eq4", "vertical", "separate"),
    *("seventeen", "tightly-coupled", "eq5", "eq12-13", "eq14", "eq15", "primary-level"),
    *("attitude-and-drifts", "eq19-20", "comparison", "smoothed", "fig6-estimate"),
    *("fig6-predicted", "fig7", "fig8-9", "fig10-11", "delta-lambda", "radius", "v-north"),
    *("curves", "made-to-order", "organisation"),
)


class _Made:
    """What several parts stand on, each made once, when it is first asked for."""

    @cached_property
    def bench(self) -> Bench:
        return bench()

    @cached_property
    def units(self) -> Units:
        return units()

    @cached_property
    def drive(self) -> Drive:
        return Drive()


def reproduce_chernodarov(progress: Progress = silent) -> Reproduction:
    """Re-make the bench run and a drive of Chernodarov (2009) and judge its statements.

    Parameters
    ----------
    progress : callable, optional
        Called with a stage and the share that is done.

    Returns
    -------
    Reproduction
        Simulated throughout, the same numbers every time. The paper's figures did not survive
        scanning and its recordings were not published: no curve is claimed to be matched; its
        statements are judged.
    """
    made = _Made()
    parts: tuple[tuple[str, Callable[[], Part]], ...] = (
        ("bench at 1 kHz", lambda: _signals(made.bench)),
        ("Figs. 6 and 7", lambda: _drifts(made.bench)),
        ("modules exchanged", lambda: _states(made.bench)),
        ("units on the bench", lambda: _damping(made)),
        ("equations", lambda: _equations(made)),
        ("drive", lambda: _drive(made.drive)),
    )
    # OpenBLAS divides a product among its threads, and so adds in another order with each number
    # of them: on one thread the same bits come out on every machine of a kind.
    with threadpool_limits(limits=1, user_api="blas"):
        statements, tables, figures = put_together(
            parts, lambda stage, share: progress(stage, 0.9 * share)
        )
    statements.sort(key=lambda s: ORDER.index(s.key))
    whole = Reproduction(
        "chernodarov", PAPER, "", tuple(statements), tuple(tables), tuple(figures), CONVENTIONS
    )
    return replace(whole, headline=headline(whole))


def headline(made: Reproduction) -> str:
    """Say what came of it, and what follows for a system of the kind."""
    found = {s.key: s for s in made.statements}
    gains = {e.what: e.shown for e in found["fig8-9"].evidence}
    errors = {e.what: e.shown for e in found["eq12-13"].evidence}
    outliers = {e.what: e.shown for e in found["outliers"].evidence}
    return (
        f"Of {len(made.statements)} statements {made.count(HOLDS)} hold as they stand, "
        f"{made.count(HOLDS_WHEN)} within bounds that are named, {made.count(DOES_NOT_HOLD)} do "
        f"not hold, and {made.count(CANNOT_BE_JUDGED)} cannot be judged without the paper's own "
        "data. For a system of this kind: estimates of a rest, taken off the sensors, leave "
        f"{gains['gain after 300 s']} times less error of velocity after five minutes, as the "
        "covariance predicts, and nothing is left of that once the unit has turned; with a "
        f"tenth of the fixes far off the robust filter keeps {outliers['outliers, robust']} where "
        f"the plain one has {outliers['outliers, plain']}; the update as printed must not be used "
        f"({errors['printed step, Huber']} after an outage)."
    )


def _signals(made: Bench) -> Part:
    return (
        [
            signals.smoothed(made),
            signals.primary_level(*signals.primary()),
            signals.phase(),
            *robustness.unpublished(),
        ],
        [],
        signals.signal_figures(made),
    )


def _drifts(made: Bench) -> Part:
    return (
        [
            signals.follows(made),
            signals.predicted(made),
            signals.accelerometers(made),
            signals.attitude_and_drifts(made),
        ],
        [],
        signals.drift_figures(made),
    )


def _states(made: Bench) -> Part:
    found = states.chains(made)
    return (
        [
            states.seventeen(made.fine),
            states.same_organisation(found),
            states.separate_solution(found),
            states.factored(found),
            states.vertical(made),
        ],
        [],
        [],
    )


def _damping(made: _Made) -> Part:
    many = made.units
    return (
        [
            damping.damped(many, "speed"),
            damping.damped(many, "circular"),
            damping.comparison(many),
        ],
        [damping.table(many)],
        damping.figures(made.bench, many),
    )


def _equations(made: _Made) -> Part:
    hour = made.units.still.predicted["damped"]
    return (
        [
            equations.skew_symmetric(),
            equations.gravitational(),
            equations.longitude(made.bench.undamped),
            equations.radius(),
            equations.undeflated(equations.fix_after_the_hour(hour)),
            equations.once(hour),
        ],
        [],
        [],
    )


def _drive(drive: Drive) -> Part:
    made = robustness.runs(drive)
    damped, undamped = (drive.navigate(None, None, damped=which) for which in (True, False))
    clean = made.of(robustness.COARSE, "clean", "plain")
    used = drive.aligned(QuaternionModel).filter.mechanization
    assert isinstance(used, WanderAzimuth)
    north = drive.truth["VN"].to_numpy(dtype=np.float64)
    levels = used.levels(clean.history)
    return (
        [
            robustness.observed(made, damped),
            robustness.outliers(made),
            robustness.continuity(made),
            robustness.newton(made),
            robustness.turned_drive(damped, undamped),
            equations.no_turn_about_the_vertical(levels),
            equations.north_velocity(clean, levels, used.wander_angle(clean.history), north),
        ],
        [robustness.table(made)],
        robustness.figures(made),
    )
