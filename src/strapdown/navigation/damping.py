"""What becomes of the estimated errors: they are fed back, or taken off what is shown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

__all__ = ["DAMPINGS", "Damping", "Feedback", "Feedforward"]


@dataclass(frozen=True)
class Damping:
    """Where estimates go."""

    kind: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]
    #: Whether mechanization and sensors are corrected by what is estimated.
    feeds_back: ClassVar[bool]


@dataclass(frozen=True)
class Feedback(Damping):
    """State and sensors are corrected at every epoch, so that errors stay small: damped."""

    kind: ClassVar[str] = "feedback"
    summary: ClassVar[str] = "errors are taken off the state and the sensors at each epoch"
    source: ClassVar[str] = "Chernodarov (2009), damping"
    feeds_back: ClassVar[bool] = True


@dataclass(frozen=True)
class Feedforward(Damping):
    """The mechanization runs free, and estimates are taken off what is shown of it.

    Errors grow as those of an unaided system, and the model of the filter is linear in them: what
    is said of its errors holds while they are small. Of a hundred drives of four minutes it did
    with a heading known to 0.2 deg and biases of 2 deg/h and 0.2 mg at the start; with ten times
    these the mean normalised square of the errors was seven times what was claimed, where feedback
    kept to it. It is for good sensors, and for comparison.
    """

    kind: ClassVar[str] = "feedforward"
    summary: ClassVar[str] = "the mechanization runs free; errors are taken off what is shown"
    source: ClassVar[str] = "Chernodarov (2009), without damping"
    feeds_back: ClassVar[bool] = False


DAMPINGS: dict[str, type[Damping]] = {"feedback": Feedback, "feedforward": Feedforward}
