"""A conclusion from numbers, with its probability and what speaks for it."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

K = TypeVar("K", bound=Hashable)

#: Below this a conclusion is a question to the user. A wrong unit spoils a whole run and a
#: question costs one word, so that a guess pays only where it fails far less than once in a
#: hundred logs that need one.
THRESHOLD = 0.99
# The models here are physics with stated idealisations; no number of samples makes them surer
# than this.
MODEL_DOUBT = 1e-4

__all__ = ["THRESHOLD", "Inference", "conclude", "posterior"]


@dataclass(frozen=True)
class Inference:
    """What the numbers of a log say about one quantity.

    Attributes
    ----------
    quantity : str
        ``time_unit``, ``time_faults``, ``rate``, ``accel_unit``, ``gravity``, ``accel_form``,
        ``gyro_unit``, ``gyro_form``, ``gyro_axes``, ``up_axis``, ``accel_sign``, ``mag_unit``.
    value : str, float or None
        The most probable answer; None where none that is known fits.
    confidence : float
        Its probability, 0 to 1.
    evidence : tuple of str
        The numbers that it rests on, in words.
    alternatives : tuple of (value, float)
        The other answers with their probabilities, the most probable first.
    flag : str
        The option that answers the question; empty where there is none.
    """

    quantity: str
    value: str | float | None
    confidence: float
    evidence: tuple[str, ...] = ()
    alternatives: tuple[tuple[str | float | None, float], ...] = ()
    flag: str = ""

    @property
    def settled(self) -> bool:
        """Whether it is sure enough to be used without asking."""
        return self.value is not None and self.confidence >= THRESHOLD

    def __str__(self) -> str:
        told = "; ".join(self.evidence) or "nothing speaks for it"
        return f"inferred: {self.value} ({told}; confidence {self.confidence:.4g})"


def posterior(log_weights: dict[K, float]) -> dict[K, float]:
    """Probabilities from logarithms of prior times likelihood, the most probable first.

    Parameters
    ----------
    log_weights : dict
        Hypothesis to natural logarithm.

    Returns
    -------
    dict
        Hypothesis to probability. A share of 1e-4 is spread over all: the models may be wrong.
    """
    if not log_weights:
        return {}
    values = np.array(list(log_weights.values()))
    weights = np.exp(values - values.max())
    weights = (1.0 - MODEL_DOUBT) * weights / weights.sum() + MODEL_DOUBT / weights.size
    pairs = sorted(zip(log_weights, weights.tolist(), strict=True), key=lambda p: -p[1])
    return dict(pairs)


def conclude(
    quantity: str,
    probabilities: Mapping[str, float] | Mapping[str | None, float],
    evidence: tuple[str, ...],
    flag: str = "",
) -> Inference:
    """The most probable answer as an `Inference`.

    Parameters
    ----------
    quantity : str
    probabilities : dict
        The most probable first, as `posterior` gives them.
    evidence : tuple of str
    flag : str
    """
    (value, confidence), *others = probabilities.items()
    alternatives = tuple((v, p) for v, p in others if p >= 1e-4)
    return Inference(quantity, value, confidence, evidence, alternatives, flag)
