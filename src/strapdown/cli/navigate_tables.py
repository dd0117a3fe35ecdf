"""What ``strapdown navigate`` prints."""

from __future__ import annotations

from strapdown.cli.console import console, print_table
from strapdown.systems.sins.result import NavigationResult

__all__ = ["print_navigation"]


def print_navigation(result: NavigationResult) -> None:
    """Print where a run ended, how well, and what its aids told."""
    out = console()
    record = result.record
    time = record.trajectory.index
    out.print(
        f"{result.source.name}: {result.source.what}, {float(time[-1] - time[0]):.6g} s, "
        f"{len(time)} samples"
    )
    at, sd = record.trajectory.iloc[-1], 1.96 * record.sd.iloc[-1]
    print_table(
        ["at the end", "", "± 95 %"],
        [
            ["latitude", f"{at['lat']:.8f}°", f"{sd['north']:.2g} m"],
            ["longitude", f"{at['lon']:.8f}°", f"{sd['east']:.2g} m"],
            ["height", f"{at['alt']:.3f} m", f"{sd['down']:.2g} m"],
            ["velocity north", f"{at['VN']:.4f} m/s", f"{sd['VN']:.2g} m/s"],
            ["velocity east", f"{at['VE']:.4f} m/s", f"{sd['VE']:.2g} m/s"],
            ["velocity down", f"{at['VD']:.4f} m/s", f"{sd['VD']:.2g} m/s"],
            ["roll", f"{at['roll']:.4f}°", f"{sd['roll']:.2g}°"],
            ["pitch", f"{at['pitch']:.4f}°", f"{sd['pitch']:.2g}°"],
            ["heading", f"{at['heading']:.4f}°", f"{sd['heading']:.2g}°"],
        ],
        text=(0,),
    )
    if result.errors is not None:
        wanted = ("horizontal", "down", "velocity", "roll", "pitch", "heading")
        print_table(
            [f"less {result.source.truth_name}", "rms", "largest", "at s"],
            [
                [
                    e.quantity,
                    f"{e.rms:.4g} {e.unit}",
                    f"{e.largest:.4g} {e.unit}",
                    f"{e.largest_at:.6g}",
                ]
                for e in result.errors.errors
                if e.quantity in wanted
            ],
            text=(0,),
        )
