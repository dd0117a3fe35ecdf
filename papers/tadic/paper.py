"""Tadic and Vukajlovic (2016), reproduced: every testable statement with a verdict from numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

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
from papers.tadic import directions, displacement, equations, experiment, mounting, sensors
from papers.tadic.experiment import RUNS, Experiments, run_experiment

PAPER = (
    "S. Tadic, M. B. Vukajlovic, Experimental Verification of Inertial Navigation with MEMS for "
    "Forensic Investigation of Vehicle Collision, Radioengineering, 2016"
)

CONVENTIONS = (
    (
        "Crash",
        "simulated, with the exact motion at every instant; the paper's recordings were not "
        "published",
    ),
    ("Platforms", "LAB1/2 and IMU1/2 of Table 1; REF1/2 and LCEDR1/2 of Table 2 are the same"),
    ("Axes", "forward, right, down; over ground north, east, down, heading north at the impact"),
    (
        "PDOF",
        "where the force came from: atan2(−ΔV_y, −ΔV_x), 0 the front, positive from the right; "
        "vertical positive from above. The paper gives no convention",
    ),
    ("Time", "s from the common trigger; time zero and end of the event as 49 CFR 563 has them"),
    ("Bounds", "hold 95 %, with everything that is not known of sensors, mounting, clock, entry"),
    (
        "Curves",
        "the paper's figures did not survive scanning; no curve of it is claimed to be matched",
    ),
)

# As they stand in the paper.
ORDER = (
    *("decimetre-level", "gnss-limits", "gyros-more-stable", "reference-10", "pulse-magnitude"),
    *("above-100-hz", "earth-rate", "eq8", "eq16-17", "eq19", "eq20", "coriolis"),
    *("time-and-distance", "ranking", "extra-sources", "vibrations", "piezoelectric"),
    *("same-entry", "own-biases", "worst-bias", "high-g-range", "ground-truth"),
    *("low-g-saturated", "low-g-calibrates", "bias-proportional", "severity-30-ms", "urgency"),
    *("vertical-consistent", "lateral-peak", "causes", "body-and-ned", "all-four-cases"),
    *("error-causes", "satellites"),
)


TABLES = (
    *("table1", "table2", "pdof-candidates", "fig9-errors", "fig9-budget", "sampling-rate"),
    *("simplifications", "better-units"),
)


def reproduce_tadic(progress: Progress = silent) -> Reproduction:
    """Re-make the crash test of Tadic and Vukajlovic (2016) and judge its statements.

    Parameters
    ----------
    progress : callable, optional
        Called with a stage and the share that is done.

    Returns
    -------
    Reproduction
        Simulated throughout, the same numbers every time: the four platforms of the paper and
        its cameras on the pole impact, reconstructed by `reconstruct_crash`. The paper's figures
        did not survive scanning and its recordings were not published: no curve is claimed to be
        matched; its statements are judged.
    """
    tests = []
    for seed in range(RUNS):
        progress(f"crash test {seed + 1} of {RUNS}", 0.5 * seed / RUNS)
        tests.append(run_experiment(seed))
    made = Experiments(tuple(tests))
    parts: tuple[tuple[str, Callable[[], Part]], ...] = (
        ("equations", _equations),
        ("Earth and time", lambda: _longer(made)),
        ("sampling rate", _sampling),
        ("Table 1", lambda: _sensors(made)),
        ("Fig. 6", lambda: _raw(made)),
        ("Figs. 7 and 8, Table 2", lambda: _directions(made)),
        ("mounting", _mounting),
        ("Fig. 9", lambda: _displacement(made)),
        ("better sensors", _better),
    )
    statements, tables, figures = put_together(
        parts, lambda stage, share: progress(stage, 0.5 + 0.4 * share)
    )
    statements.sort(key=lambda s: ORDER.index(s.key))
    tables.sort(key=lambda t: TABLES.index(t.slug))
    whole = Reproduction(
        "tadic", PAPER, "", tuple(statements), tuple(tables), tuple(figures), CONVENTIONS
    )
    return replace(whole, headline=headline(whole))


def headline(made: Reproduction) -> str:
    """Say what came of it, and what follows for an investigator."""
    found = {s.key: s for s in made.statements}
    largest = found["all-four-cases"].evidence[-1].shown
    ring = found["decimetre-level"].evidence[-1].shown
    turn = {e.what: e.shown for e in found["lateral-peak"].evidence}
    return (
        f"Of {len(made.statements)} statements {made.count(HOLDS)} hold as they stand, "
        f"{made.count(HOLDS_WHEN)} within bounds that are named, {made.count(DOES_NOT_HOLD)} do "
        f"not hold, and {made.count(CANNOT_BE_JUDGED)} cannot be judged without the paper's own "
        f"data. For an investigator: over 750 ms the place is good to decimetres, {largest} at the "
        f"worst of all platforms and tests, unless the structure rings faster than the samples "
        f"follow ({ring}); a direction of force that is taken at the first sign of a crash says "
        f"nothing, and over the largest 30 ms such ringing turns it by "
        f"{turn['200 Hz, largest 30 ms']} at most."
    )


def _equations() -> Part:
    return (
        [
            equations.transport_as_printed(),
            equations.matrix_as_printed(),
            equations.increments_missing(),
            equations.small_angles(),
        ],
        [],
        [],
    )


def _longer(made: Experiments) -> Part:
    costs, own = equations.costs(), equations.sensor(made)
    return (
        [
            equations.coriolis(costs["no Coriolis term"], own),
            equations.earth_rate(costs["no Earth rate"], own),
            equations.ranking(equations.ranked()),
            equations.time_and_distance(equations.growth()),
        ],
        [equations.table(costs, own)],
        [],
    )


def _sampling() -> Part:
    still, ring = mounting.rates()
    return (
        [
            mounting.above_100(still, ring),
            mounting.pulses(),
            mounting.receiver(),
        ],
        [mounting.rate_table(still, ring)],
        [],
    )


def _sensors(made: Experiments) -> Part:
    return (
        [
            sensors.gyros_stable(),
            sensors.piezoelectric(made),
            sensors.own_biases(made),
            sensors.worst_bias(made),
            sensors.high_g_range(made),
            sensors.proportional(),
        ],
        [sensors.table()],
        [],
    )


def _better() -> Part:
    found = tuple(sensors.short(name) for name in sensors.COMPARED)
    return (
        [
            sensors.reference_10(found),
            sensors.satellites(sensors.tied()),
        ],
        [sensors.short_table(found)],
        [],
    )


def _raw(made: Experiments) -> Part:
    return (
        [experiment.saturated(made), experiment.low_g_calibrates(made)],
        [],
        [experiment.figure(made.first)],
    )


def _directions(made: Experiments) -> Part:
    return (
        [
            directions.severity(made),
            directions.urgency(made),
            directions.vertical_consistent(made),
            directions.frames_agree(made),
        ],
        [directions.table(made.first)],
        [
            directions.figure(made.first),
            directions.points_figure(made.first),
            directions.speed_figure(made.first),
        ],
    )


def _mounting() -> Part:
    found = mounting.candidates()
    return (
        [mounting.lateral_peak(found), mounting.causes(found)],
        [mounting.table(found)],
        [mounting.figure(), mounting.ringing_speed_figure()],
    )


def _displacement(made: Experiments) -> Part:
    rings = displacement.rung()
    return (
        [
            displacement.decimetre(made, rings),
            displacement.extra_sources(made),
            displacement.vibrations(rings, displacement.silent()),
            experiment.same_entry(made),
            experiment.ground_truth(made),
            displacement.all_four(made),
            displacement.error_causes(made),
        ],
        [displacement.errors_table(made), displacement.budget_table(made)],
        [experiment.camera_figure(made.first), displacement.figure(made.first)],
    )
