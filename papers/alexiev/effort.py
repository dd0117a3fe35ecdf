"""What the algorithms cost, and what cannot be judged without the paper's own data."""

from __future__ import annotations

from papers.alexiev.sampling import FOUR
from papers.reproduction import (
    CANNOT_BE_JUDGED,
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Evidence,
    Statement,
    Table,
    amount,
)
from strapdown.attitude import count_cost, make_algorithm
from strapdown.results import Cost


def costs() -> tuple[Cost, ...]:
    """Count the operations of the paper's four algorithms."""
    return tuple(count_cost(make_algorithm(name)) for name in FOUR)


def table(found: tuple[Cost, ...]) -> Table:
    """Return the operations of one step."""
    return Table(
        "effort",
        "What a step costs",
        "Operations counted on the code itself while it ran, without forming the increment; "
        "cycles of a Cortex-M4F as a weight for ranking; numbers kept between samples.",
        (
            *("algorithm", "add", "multiply", "divide", "root"),
            *("sine, cosine", "cycles", "memory"),
        ),
        tuple(
            (
                c.algorithm,
                (c.add, c.multiply, c.divide, c.sqrt, c.trig, c.cycles, float(c.memory)),
            )
            for c in found
        ),
    )


def compromise(found: tuple[Cost, ...]) -> Statement:
    """Judge that there is a complex compromise between complexity and accuracy."""
    cycles = {c.algorithm: c.cycles for c in found}
    cheapest_right = min(("dcm", "quaternion"), key=lambda name: cycles[name])
    # The right ones cost less than Euler-Krylov: then the choice is between two, and simple.
    simple = cycles[cheapest_right] < cycles["euler"]
    trade = cycles["naive"] < cycles[cheapest_right]
    if trade and simple:
        verdict = HOLDS_WHEN
        condition = (
            f"the choice is between naive and {cheapest_right}: Euler-Krylov is dearer than what "
            "it is less accurate than"
        )
    else:
        verdict, condition = (HOLDS if trade else DOES_NOT_HOLD), ""
    return Statement(
        "compromise",
        "Abstract",
        "The article helps to resolve the complex compromise between the complexity of the "
        "algorithm and the accuracy of work",
        verdict,
        condition,
        f"The cheapest algorithm that is right, {cheapest_right}, costs "
        f"{amount(cycles[cheapest_right] / max(cycles['naive'], 1.0))} times the naive sum and "
        f"{amount(cycles[cheapest_right] / cycles['euler'])} times Euler-Krylov. On a processor "
        "that has these cycles to spare at its rate there is nothing to compromise.",
        tuple(Evidence(f"{name}, cycles a sample", value) for name, value in cycles.items()),
    )


def unpublished() -> tuple[Statement, ...]:
    """Return the statements on data and curves that the paper does not hand on."""
    return (
        Statement(
            "real-data",
            "Section 4, Fig. 3",
            "The real measurement sets received from gyros were taken from a smart phone.",
            CANNOT_BE_JUDGED,
            "",
            "Neither the logs nor the model of the phone are published, and no error is given as "
            "a number. Simulated motions with the same reference points stand in for them here.",
            (),
        ),
        Statement(
            "modest-goals",
            "Section 2",
            "The goals here are more modest and concern only the repeatability of algorithms, "
            "convergence to real attitude, algorithm efficiency, etc.",
            CANNOT_BE_JUDGED,
            "",
            "The paper gives no number for repeatability, convergence or efficiency. What this run "
            "measures of them stands in its tables.",
            (),
        ),
    )
