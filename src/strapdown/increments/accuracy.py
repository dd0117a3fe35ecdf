"""The orders of accuracy of motion increments, as data; the tests fit each of them."""

from __future__ import annotations

from dataclasses import dataclass

from strapdown.errors import ConfigError

__all__ = ["MotionAccuracy", "motion_accuracy"]


@dataclass(frozen=True)
class MotionAccuracy:
    """Powers of the step with which errors fall on smooth motion, at the ends of blocks.

    Attributes
    ----------
    attitude, velocity, position : int
        Where the steps of a block are equal.
    unequal : int
        Of all three where they are not: with an even number of steps a term of the error
        cancels between the halves of a block only where these are alike.
    """

    attitude: int
    velocity: int
    position: int
    unequal: int


def _orders(equal: int, unequal: int) -> MotionAccuracy:
    return MotionAccuracy(equal, equal, equal, unequal)


# By the number of steps and the interpolation. The polynomial is wrong by a multiple of
# the product of distances to its nodes: those of n steps are n + 1 stamps, for samples and for
# the running sums of means alike, and the integral of that product over equal steps is zero
# where n is even.
_BLOCKS = {2: _orders(4, 3), 3: _orders(4, 4), 4: _orders(6, 5)}
ORDERS: dict[tuple[str, int, str], MotionAccuracy] = {
    ("instantaneous", 1, "linear"): _orders(2, 2),
    ("instantaneous", 1, "cubic"): _orders(4, 4),
    ("mean", 1, "constant"): _orders(2, 2),
    ("mean", 1, "linear"): _orders(3, 3),
    ("mean", 1, "cubic"): _orders(4, 4),
    **{(s, n, "linear"): o for s in ("instantaneous", "mean") for n, o in _BLOCKS.items()},
}


def motion_accuracy(
    sampling: str, samples: int = 1, interpolation: str = "linear"
) -> MotionAccuracy:
    """Look up the orders of accuracy of `motion_increments`.

    Parameters
    ----------
    sampling : {'instantaneous', 'mean'}
    samples, interpolation
        As `motion_increments`.

    Returns
    -------
    MotionAccuracy

    Raises
    ------
    ConfigError
        There is no such combination.
    """
    try:
        return ORDERS[sampling, samples, interpolation]
    except KeyError:
        raise ConfigError(
            "mechanization.no-motion-increments-made-samples",
            quantity="accuracy",
            sampling=sampling,
            samples=samples,
            interpolation=interpolation,
        ) from None
