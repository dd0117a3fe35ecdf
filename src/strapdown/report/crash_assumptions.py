"""What a crash report takes for given, and its conventions."""

from __future__ import annotations

from strapdown.constants import TWO_SIDED_95
from strapdown.report.crash_values import instant, speed
from strapdown.systems.crash_case import CaseResult

__all__ = ["CONVENTIONS", "assumptions", "how_to_verify", "method"]

CONVENTIONS = (
    ("Vehicle axes", "forward, right, down, turning with the vehicle"),
    ("Time", "s from the trigger; a recorder's own clock may show anything"),
    (
        "Path",
        "north, east, down from the place of the reference point at the entry; where no heading "
        "is stated, forward and right of the vehicle at the entry take the place of north and east",
    ),
    ("Attitude", "roll, pitch, heading (3-2-1): right side down, nose up, clockwise are positive"),
    (
        "Delta-V",
        "the change of velocity, so that a frontal crash has a negative forward part; along the "
        "turning axes of the vehicle, as recorders integrate it, where nothing else is said",
    ),
    (
        "Direction of force (PDOF)",
        "where the force came from: atan2(−ΔV right, −ΔV forward); 0° the front, positive "
        "clockwise seen from above, 90° the right side; on the clock 12 is the front",
    ),
    (
        "Event, time zero, end",
        "49 CFR 563.5(b): 8 km/h within 150 ms make an event; it begins with 0.8 km/h within 20 ms "
        "and ends when the resultant change within 20 ms becomes that or less",
    ),
    (
        "Bounds",
        "hold the truth in 95 of 100 cases (1.96 standard deviations) where everything that is "
        "stated and assumed here is right; of a direction, Fieller's interval",
    ),
    ("Units", "SI, with km/h for changes of velocity and g = 9.80665 m/s² for accelerations"),
)


def assumptions(result: CaseResult) -> tuple[tuple[str, str], ...]:
    """Return what is taken for given in this case.

    Returns
    -------
    tuple of (head, text)
    """
    spec = result.spec
    options, entry = spec.options, spec.entry
    found = [
        (
            "Rigid vehicle",
            "Between each recorder and the reference point the vehicle keeps its shape.",
        ),
        (
            "Errors of the sensors",
            "are normal, of mean zero, and independent from recorder to recorder, with the "
            "standard deviations of the table under Sensors; within the record they do not drift.",
        ),
        (
            "Gravity",
            f"is {options.gravity_m_per_s2:g} m/s² and vertical throughout; the turning of the "
            "Earth over the record is computed and not assumed away.",
        ),
        (
            "Samples",
            f"The records are brought to {options.rate_hz:g} Hz as "
            + (
                "true means over each step."
                if options.sampling == "mean"
                else "values of a band-limited signal; each low-pass is taken to be late by its "
                "time constant."
            ),
        ),
        (
            "Clocks",
            "are tied by each recorder's trigger, as well as it is stated."
            if options.clock == "trigger"
            else "are tied by what the recorders felt, laid over each other.",
        ),
    ]
    if entry.kind == "speed":
        assert entry.speed_m_per_s is not None and entry.speed_sd_m_per_s is not None
        half = TWO_SIDED_95 * entry.speed_sd_m_per_s
        direction = TWO_SIDED_95 * entry.slip_sd_deg
        found.append(
            (
                "Entry",
                f"At {instant(entry.time_s)} the vehicle moved at "
                f"{speed(entry.speed_m_per_s, half)}, {entry.slip_deg:g} ± {direction:.2g}° "
                f"clockwise of where it pointed, and horizontally within "
                f"{TWO_SIDED_95 * entry.climb_sd_m_per_s:.2g} m/s. Source: "
                f"{entry.source or 'not stated'}.",
            )
        )
    elif entry.kind == "standstill":
        found.append(("Entry", "The vehicle stood still when the record began."))
    else:
        found.append(
            (
                "Entry",
                "The fixes are believed as far as they say, never beyond 50 m/s² or 20 m/s³, nor "
                "from the impact on.",
            )
        )
    reasons: dict[str, list[str]] = {}
    for unit in spec.units:
        if unit.assumed is not None and unit.assumed.because:
            reasons.setdefault(unit.assumed.because, []).append(unit.name)
    for because, names in reasons.items():
        found.append((", ".join(names), f"What was not measured is assumed because: {because}"))
    return tuple(found)


def method(result: CaseResult) -> tuple[str, ...]:
    """Return the steps from the records to the answers, in order."""
    steps = [
        "The clocks of the recorders are tied to the trigger, and all channels are brought to "
        "common stamps without aliasing; the delay of each low-pass is taken off.",
        "The stationary stretch before the crash tells the bias of the gyro, that of a high "
        "range against a low one, and roll and pitch; where there is none, what is stated is used.",
        "Ranges are merged: the low one while it is clear of its end, the high one beyond.",
        "Each recorder is turned into vehicle axes and moved to the reference point.",
        "Events are found, and their changes of velocity integrated along the turning axes and, "
        "with gravity taken off, over ground.",
        "The path runs from the entry, forward and backward, by strapdown navigation.",
        "Every unknown of the sensors, mounting, clocks and entry is carried through all of this, "
        "linearly"
        + (
            "."
            if result.samples is None
            else f", and by {len(result.samples.errors)} complete runs with drawn errors."
        ),
    ]
    if len(result.units) > 1:
        steps.append(
            "The recorders are compared at the reference point"
            + (
                ", and their weighted mean is reconstructed as well."
                if result.reconstruction.combined is not None
                else "."
            )
        )
    return tuple(steps)


def how_to_verify() -> tuple[tuple[str, str], ...]:
    """Return how anybody checks the report, beside the command."""
    return (
        (
            "Run it again",
            "Install strapdown in the version named on page one (pip install strapdown) and give "
            "the command below. It checks every file against the seal, runs the whole case again "
            "from the records, and compares each byte; it names every file and every option that "
            "was changed.",
        ),
        (
            "The seal",
            "is the SHA-256 of manifest.json, which holds that of every file of the folder. It was "
            "printed when the report was made: write it into the file of the case, apart from the "
            "folder, since who changes a file and the manifest too would not be found otherwise.",
        ),
        (
            "By other means",
            "The records stand under inputs/, the path in trajectory.csv and all numbers in "
            "crash.json, with their units in the names.",
        ),
    )
