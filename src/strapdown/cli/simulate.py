"""``strapdown simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

EPILOG = "Example: strapdown simulate alexiev-fig4 --rate 100 --format all --out fig4"


def simulate(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME|FILE",
            help="A scenario or a crash (see: strapdown modules), or a trajectory's file (.toml), "
            "whose values the options replace.",
        ),
    ],
    rate: Annotated[
        float | None,
        typer.Option(metavar="HZ", help="Samples a second (100; of a crash each recorder's own)."),
    ] = None,
    sampling: Annotated[
        str | None,
        typer.Option(
            metavar="KIND",
            help="instantaneous (the rate at the stamp, as without it) or mean (over the interval "
            "that ends there).",
        ),
    ] = None,
    formats: Annotated[
        str | None,
        typer.Option(
            "--format",
            metavar="F",
            help="csv, npz, h5, mat (joined by commas), or all (csv); of a crash csv, mme.",
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(metavar="N", help="Of the errors (0).")] = None,
    sensor: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help="Errors of one unit of this sensor (see: strapdown modules), instead of the "
            "scenario's own.",
        ),
    ] = None,
    units: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="Recorders of a crash, joined by commas, or all (IMU1,IMU2).",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder to make (NAME-simulated)."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a result that is there.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print the scenario as JSON alone.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Write the log of a scenario, a trajectory or a crash together with its exact truth."""
    from strapdown.cli.console import console, print_seal, progress
    from strapdown.report.simulation import simulate as write

    title = Path(name).stem if name.lower().endswith(".toml") else name
    with progress(quiet or json) as report:
        report("simulating and writing", 0.5)
        seal = write(
            name,
            out or Path(f"{title}-simulated"),
            rate=rate,
            sampling=sampling,
            seed=seed,
            sensor=sensor,
            formats=None if formats is None else formats.replace(",", " ").split(),
            units=() if units is None else units.replace(",", " ").split(),
            force=force,
        )
    if json:
        typer.echo((seal.path / "scenario.json").read_text(encoding="utf-8"), nl=False)
    elif not quiet:
        files = sorted(p.name for p in seal.path.iterdir())
        console().print(f"{title}: {', '.join(files)}")
        case = (seal.path / "case.toml").is_file()
        print_seal(seal, "case.toml" if case else "scenario.json")
        if case:
            console().print(f"Next  strapdown crash {seal.path / 'case.toml'}")
