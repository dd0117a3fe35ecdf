"""``strapdown simulate``."""

from __future__ import annotations

import json
from pathlib import Path

import typer

from strapdown.cli.console import WORDS, console, print_seal, progress
from strapdown.cli.result_folder import claim, folder_to_write
from strapdown.cli.shared_options import OutFlags, folder_to_make, running, spread, writing

EPILOG = "Example: strapdown simulate alexiev-fig4 --rate 100 --format all --out fig4"


@spread
def simulate(
    name: str = typer.Argument(
        metavar="NAME|FILE",
        help="A scenario or a crash (strapdown modules), or the file (.toml) of a scenario or "
        "a trajectory, "
        "whose values the options replace.",
    ),
    rate: float | None = running(
        "HZ", "Sample rate in Hz (100; for a crash that of each recorder)."
    ),
    sampling: str | None = running(
        "KIND",
        "instantaneous (the rate at the stamp) or mean (over the interval that ends "
        "there); instantaneous, if not given.",
    ),
    formats: str | None = writing(
        "F", "csv, npz, h5, mat (joined by commas), or all (csv); of a crash csv, mme.", "--format"
    ),
    fixes: str | None = writing(
        "FORM", "Fixes along a trajectory, of the receiver of its \\[gnss]: csv, none (csv)."
    ),
    seed: int | None = running("N", "Of the simulated errors (0)."),
    sensor: str | None = running(
        "NAME|FILE",
        "The errors are those of a unit of this sensor of the catalogue (strapdown "
        "modules), or of a .toml file of your own; the scenario's own, if not given.",
    ),
    units: str | None = running(
        "NAMES", "Recorders of a crash, joined by commas, or all (IMU1,IMU2)."
    ),
    *,
    out: Path | None = folder_to_make("NAME-simulated"),
    write: OutFlags,
) -> None:
    """Write the log of a scenario, a trajectory or a crash together with its exact truth."""
    from strapdown.api.simulation import simulate as run_simulation

    own = name.lower().endswith(".toml")
    WORDS.set("file" if own else "cli")
    title = Path(name).stem if own else name
    folder = folder_to_write(out, name, "simulated", write.force)
    claim(folder, write.force)
    with progress(write.quiet or write.json) as report:
        report("simulating", 0.1)
        made = run_simulation(
            name,
            rate_hz=rate,
            sampling=sampling,
            seed=seed,
            sensor=sensor,
            recorders=() if units is None else units.replace(",", " ").split(),
        )
        report("writing", 0.6)
        wanted = None if formats is None else formats.replace(",", " ").split()
        seal = made.save(folder, formats=wanted, fixes=fixes, force=write.force)
    if write.json:
        typer.echo((seal.path / "scenario.json").read_text(encoding="utf-8"), nl=False)
    elif not write.quiet:
        files = sorted(p.name for p in seal.path.iterdir())
        console().print(f"{title}: {', '.join(files)}")
        case = (seal.path / "case.toml").is_file()
        print_seal(seal, "case.toml" if case else "scenario.json")
        if case:
            console().print(f"Next  strapdown crash {seal.path / 'case.toml'}")
        elif (seal.path / "fixes.csv").is_file() and (seal.path / "log.csv").is_file():
            stated = json.loads((seal.path / "scenario.json").read_text(encoding="utf-8"))
            options = f" --sensor {used}" if (used := sensor or stated["sensor"]) else ""
            told = f"{seal.path / 'log.csv'} --gnss {seal.path / 'fixes.csv'}{options}"
            console().print(f"Next  strapdown navigate {told}")
