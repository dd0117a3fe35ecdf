"""Operations and memory of an algorithm, counted by hand."""

from __future__ import annotations

import pytest

from strapdown.attitude_algorithms import make_algorithm
from strapdown.attitude_algorithms.cost import count_cost

NOTHING = {"add": 0, "multiply": 0, "divide": 0, "sqrt": 0, "trig": 0}
BY_HAND = {
    "naive": {"add": 3},
    # The square of the half angle 4 and 2, series of the cosine 6 and 6, of the sine 6 and 5, by
    # the vector 3 and 0, the product 16 and 12, the norm 8, 3, a division and a root.
    "quaternion": {"add": 28, "multiply": 43, "divide": 1, "sqrt": 1},
    "quaternion:normalise=false": {"add": 25, "multiply": 35},
    # The matrix of first order: 3 of 3 products more by b = 0 than needed, as the kernel does:
    # n^2 3 and 2; diagonal 3 of 3 and 2, off it 6 of 3 and 1; the product 27 and 18.
    "dcm:order=1": {"add": 32, "multiply": 57},
    # Two products and a remainder a step: sines of roll and pitch; the wraps; before and after.
    "euler": {"multiply": 6, "divide": 3, "trig": 6},
}


@pytest.mark.parametrize("name", BY_HAND)
def test_a_count_by_hand(name):
    found = vars(count_cost(make_algorithm(name)))
    for kind, number in (NOTHING | BY_HAND[name]).items():
        if name == "euler" and kind == "add":
            continue  # a wrap adds where the angle passes 180 deg
        assert found[kind] == number, kind


def test_rotation_vector_of_four_costs_more_than_of_one():
    counts = [
        sum(getattr(count_cost(make_algorithm(f"rotvec:samples={n}")), kind) for kind in NOTHING)
        for n in (1, 2, 3, 4)
    ]
    assert counts[1:] == sorted(counts[1:])


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("naive", 3),
        ("euler", 6),
        ("dcm", 9),
        ("dcm:orthogonalise_every=5", 10),
        ("quaternion", 4),
        ("rotvec:samples=1", 9),
        ("rotvec", 17),
        ("rotvec:samples=4", 25),
    ],
)
def test_memory(name, numbers):
    assert count_cost(make_algorithm(name)).memory == numbers


def test_cycles_of_a_quaternion_by_hand():
    """28 sums and 43 products of one cycle each, a division and a root of 14 (Arm, Cortex-M4
    technical reference manual, table of the floating-point instructions), 4 numbers kept."""
    cost = count_cost(make_algorithm("quaternion"))
    assert cost.cycles == 28 + 43 + 14 + 14
    assert cost.memory == 4
    # A sine by software is put at 80; the six of Euler's angles outweigh all else there is.
    euler = count_cost(make_algorithm("euler"))
    assert euler.cycles == pytest.approx(euler.add + 6 + 3 * 14 + 6 * 80)
