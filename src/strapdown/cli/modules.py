"""``strapdown modules``."""

from __future__ import annotations

EPILOG = "Example: strapdown modules"
# What stands in a slot that a file leaves out, where that is none of the modules.
_UNSAID = {"update_rule": "; where none is named, every observation counts in full"}


def modules() -> None:
    """List what can stand in each slot: algorithms, the modules of a chain, sensors, formats."""
    from dataclasses import fields

    from strapdown.aiding.standstill_detectors import STANDSTILL_DETECTORS
    from strapdown.aiding.standstill_thresholds import STANDSTILL_THRESHOLDS
    from strapdown.attitude import ALGORITHMS
    from strapdown.cli.console import console, print_table
    from strapdown.config.motions import KINDS
    from strapdown.config.slots import SLOTS, options_of
    from strapdown.ellipsoids import ELLIPSOIDS
    from strapdown.formats import READERS
    from strapdown.formats.log_writers import LOG_WRITERS
    from strapdown.formats.trajectory_writers import TRAJECTORY_WRITERS
    from strapdown.mechanization import MECHANIZATIONS, Mechanization
    from strapdown.sensors.catalogue import SENSORS, load_sensor
    from strapdown.simulation import SCENARIOS
    from strapdown.simulation.crash_cases import CASES
    from strapdown.simulation.crash_scenarios import CRASHES

    out = console()
    out.print("Attitude algorithms", style="bold")
    print_table(
        ["name", "source", "options", "what it does"],
        [
            [
                name,
                f"{cls.source} {cls.equations}".strip(),
                ", ".join(f"{f.name}={f.default}".lower() for f in fields(cls)) or "–",
                cls.summary,
            ]
            for name, cls in ALGORITHMS.items()
        ],
    )
    out.print("Mechanizations", style="bold")
    print_table(
        ["name", "source", "own options", "what it does"],
        [
            [
                name,
                cls.source,
                ", ".join(f.name for f in fields(cls)[len(fields(Mechanization)) :]) or "–",
                cls.summary,
            ]
            for name, cls in MECHANIZATIONS.items()
        ],
    )
    for name, slot in SLOTS.items():
        if name == "mechanization":
            continue
        out.print(f"{slot.title} ([{name}] of a chain{_UNSAID.get(name, '')})", style="bold")
        print_table(
            ["name", "source", "options", "what it does"],
            [
                [
                    kind,
                    getattr(entry, "source", "") or "–",
                    ", ".join(o.key for o in options_of(entry)) or "–",
                    getattr(entry, "summary", "") or (entry.__doc__ or "").partition("\n")[0],
                ]
                for kind, entry in slot.entries.items()
            ],
            text=(0, 1, 2, 3),
        )
    out.print("Detectors of a standstill (detector = … of an aid that watches)", style="bold")
    print_table(
        ["name", "source", "what it does"],
        [[name, one.source, one.summary] for name, one in STANDSTILL_DETECTORS.items()],
        text=(0, 1, 2),
    )
    out.print("What becomes of its threshold (threshold_rule = …)", style="bold")
    print_table(
        ["name", "source", "what it does"],
        [[name, one.source, one.summary] for name, one in STANDSTILL_THRESHOLDS.items()],
        text=(0, 1, 2),
    )
    out.print("Ellipsoids", style="bold")
    print_table(
        ["name", "a, m", "1/f", "source"],
        [
            [name, f"{e.semi_major_axis:.10g}", f"{e.inverse_flattening:.12g}", e.source]
            for name, e in ELLIPSOIDS.items()
        ],
    )
    out.print(f"Motions of a trajectory's file: {', '.join(KINDS)}\n")
    out.print("Scenarios with exact attitude", style="bold")
    print_table(
        ["name", "s", "what it is"],
        [
            [name, f"{s.motion.duration:g}", f"{s.title} ({s.origin})"]
            for name, s in SCENARIOS.items()
        ],
    )
    out.print("Crashes with exact truth, and what is none", style="bold")
    print_table(
        ["name", "s", "kind", "what it is"],
        [
            [name, f"{c.motion.duration:.3g}", c.kind or "–", f"{c.summary} ({c.source})"]
            for name, c in CRASHES.items()
        ],
    )
    out.print("The same crashes with recorders of their own", style="bold")
    print_table(
        ["name", "crash", "recorders", "what it is"],
        [
            [name, c.crash.name, ", ".join(c.usual), c.summary]
            for name, c in CASES.items()
            if name not in CRASHES
        ],
        text=(0, 1, 2, 3),
    )
    out.print("Sensors that can be simulated", style="bold")
    print_table(
        ["name", "class", "what it is"],
        [[s.name, s.grade, f"{s.title}: {s.summary}"] for s in map(load_sensor, SENSORS)],
    )
    out.print("Formats that are read", style="bold")
    print_table(["name", "what it is"], [[name, r.title] for name, r in READERS.items()])
    out.print(f"Formats that logs are written in: {', '.join(LOG_WRITERS)}")
    out.print(f"Formats that trajectories are written in: {', '.join(TRAJECTORY_WRITERS)}")
