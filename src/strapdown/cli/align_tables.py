"""Terminal output of ``strapdown align``."""

from __future__ import annotations

from strapdown.cli.console import console, print_block
from strapdown.report.alignment_document import (
    answer_table,
    bias_table,
    headline,
    limits,
    readiness_table,
)
from strapdown.report.alignment_trust import trust
from strapdown.report.values import spaced
from strapdown.systems.alignment_run import AlignmentResult

__all__ = ["print_alignment"]


def print_alignment(result: AlignmentResult) -> None:
    """Print the result of an alignment, and its limits."""
    out = console()
    site = result.site
    out.print(
        f"{result.source.name}: {result.source.what}, "
        f"{float(result.imu.index[-1] - result.imu.index[0]):.6g} s at {site.lat_deg:.5f}°, "
        f"{site.lon_deg:.5f}°"
    )
    for block in (answer_table(result), readiness_table(result), bias_table(result)):
        if block is not None:
            print_block(block)
    out.print(spaced(headline(result)), style="bold")
    found = trust(result)
    style = {"trusted": "green", "reserve": "yellow", "distrusted": "bold red"}[found.verdict]
    out.print(spaced(found.sentence), style=style)
    for head, text in limits(result):
        out.print(spaced(f"  - {head}: {text}"))
