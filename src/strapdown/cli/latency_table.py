"""Print the latency of the samples of a run."""

from __future__ import annotations

from strapdown.cli.console import print_table
from strapdown.live.latency import Latency

__all__ = ["print_latency"]


def print_latency(latency: Latency, what: str) -> None:
    """Print the latency from a sample to its state, and the missed deadlines.

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
