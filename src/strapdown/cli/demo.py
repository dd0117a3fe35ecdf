"""``strapdown demo``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

EPILOG = "Example: strapdown demo --out demo"
_TURNS = "mpu6050_turns"


def demo(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where the results go.")] = Path("demo"),
    force: Annotated[bool, typer.Option("--force", help="Replace results that are there.")] = False,
) -> None:
    """Show the main jobs: a scenario with exact truth, a crash, and a real recording.

    The recording is looked for in the folder that STRAPDOWN_DATA names, by default
    ../shared/data.
    """
    from strapdown.cli.attitude import attitude
    from strapdown.cli.console import console
    from strapdown.cli.crash import crash
    from strapdown.cli.simulate import simulate

    page = console()
    page.print(
        "A turn through a pitch near 90°, where one algorithm fails and another was never right.\n",
        style="italic",
    )
    attitude(["alexiev-fig4"], rate=100.0, out=out / "alexiev-fig4", force=force)
    page.print(
        "\nA car against a pole, as two cheap recorders have it: their records, and the report.\n",
        style="italic",
    )
    records = out / "crash-pole-records"
    simulate("pole", out=records, force=force, quiet=True)
    crash(records / "case.toml", out=out / "crash-pole", force=force)
    page.print(f"The records and the truth are in {records}.")
    data = Path(os.environ.get("STRAPDOWN_DATA", "../shared/data")) / _TURNS
    turn = data / "rotate-360ccw-around-z-pointing-up"
    if not turn.is_dir():
        page.print(f"\nNo recording at {data}: set STRAPDOWN_DATA to see a real turn, too.")
        return
    page.print(
        "\nA cheap sensor, turned twice about the vertical by hand: the end is the start.\n",
        style="italic",
    )
    attitude(
        [str(turn)],
        reference=["end 2 turns about up since start"],
        gyro_bias=str(data / "unmoved-10min"),
        out=out / "turn-about-z",
        force=force,
    )
