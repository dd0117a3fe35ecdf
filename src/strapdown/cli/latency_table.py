"""What the samples of a run took, on the terminal."""

from __future__ import annotations

from strapdown.cli.console import print_table
from strapdown.live.latency import Latency

__all__ = ["print_latency"]


def print_latency(latency: Latency, what: str) -> None:
    """Print how long it took from a sample to its state, and how often too long.

    Parameters
    ----------
    latency : Latency
    what : str
        How the samples were delivered.
    """
    missed = "-" if latency.missed is None else str(latency.missed)
    behind = "-" if latency.behind is None else _ms(latency.behind)
    print_table(
        ["sample to state, ms", "samples", "median", "99 %", "largest", "missed", "behind", ""],
        [
            [
                what,
                str(latency.samples),
                _ms(latency.median),
                _ms(latency.most),
                _ms(latency.largest),
                missed,
                behind,
                "",
            ]
        ],
    )


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.3f}"
