"""Rotation-vector updates with compensation of coning over 1 to 4 increments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from strapdown._kernels import rotation_vector as kernel
from strapdown.attitude_algorithms.algorithm import Accuracy, AttitudeAlgorithm
from strapdown.constants import Array
from strapdown.errors import ConfigError, check_choice

_COEFFICIENTS = {"auto": kernel.AUTO, "miller": kernel.MILLER, "fit": kernel.FIT}


@dataclass(frozen=True)
class RotationVector(AttitudeAlgorithm):
    """The quaternion, multiplied by that of the rotation vector of 1 to 4 increments.

    Increments of one block are compared with each other: the rotation of their axis is put into
    the rotation vector (Bortz 1971). Within a block, and at an incomplete end, the attitude is
    that of the increments so far. A block ends when it is full or has turned by 1 rad, or
    before a step that is more than three times longer or shorter than its first, as beside a
    gap or in a burst: there the increments are not comparable.

    Parameters
    ----------
    samples : int
        Increments of a block, 1 to 4. One alone knows its own turning only where rates at
        the stamps were given: then it is taken from their change over the step.
    coefficients : {'auto', 'miller', 'fit'}
        ``miller``: those that are best for pure coning, for equal steps. ``fit``: the
        polynomial through the increments, for steps of any lengths, with the products of
        three and more that general motion needs. ``auto``: ``miller`` where the steps of a
        block are equal to a thousandth, and ``fit`` where they are not.
    previous : bool
        Of one increment: the turning of its axis since the increment before is put into the
        rotation vector (Savage 1998), where their steps are alike within a factor of three. For
        means, increments, and rates at the stamps as chords, whose own drift it takes off, too;
        of cubics that would be too much.
    """

    name = "rotvec"
    title = "Rotation vector"
    equations = ""
    source = "Bortz (1971), Miller (1983), Savage (1998)"
    summary = "rotation vector of 1 to 4 increments, compensated for coning"
    variants = (
        "rotvec:samples=1",
        "rotvec:samples=1,previous=true",
        *(f"rotvec:samples={n}" for n in (2, 3, 4)),
    )
    advance_kernel = staticmethod(kernel.rotvec_advance)
    update_kernel = staticmethod(kernel.rotvec_update)

    samples: int = 2
    coefficients: Literal["auto", "miller", "fit"] = "auto"
    previous: bool = False

    def __post_init__(self) -> None:
        if not 1 <= self.samples <= 4:
            raise ConfigError(
                "attitude.out-range-3", quantity="rotvec:samples", samples=self.samples
            )
        check_choice(
            "attitude.no-kind-coefficients",
            _COEFFICIENTS,
            quantity="rotvec:coefficients",
            coefficients=self.coefficients,
        )
        if self.previous and self.samples != 1:
            raise ConfigError(
                "attitude.previous-of-one-increment",
                quantity="rotvec:previous",
                samples=self.samples,
            )

    def begin(self, q_nb: Array) -> Array:
        """Return the quaternion now and at the block's start, and an empty block."""
        state = np.zeros(kernel.STATE)
        state[:4] = state[4:8] = q_nb
        return state

    @property
    def accuracy(self) -> Accuracy:
        """By the number of increments; general motion needs products of three."""
        if self.previous:
            return Accuracy(increments=3, rates=2, coning=4)
        if self.samples == 1:
            return Accuracy(increments=2, rates=4, coning=2)
        if self.coefficients == "fit":
            order = {2: 4, 3: 4, 4: 6}[self.samples]
            return Accuracy(increments=order, rates=4, coning=order)
        return Accuracy(increments=4, rates=4, coning=2 * self.samples)

    def kernel_options(self) -> tuple[float, float]:
        """Return the increments of a block and the kind of coefficients."""
        kind = kernel.PREVIOUS if self.previous else _COEFFICIENTS[self.coefficients]
        return float(self.samples), kind
