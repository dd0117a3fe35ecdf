"""An inference from numbers, with its probability and evidence."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from strapdown.errors import Finding

K = TypeVar("K", bound=Hashable)

#: Below this probability the user is asked. A wrong unit spoils a whole run while a question costs
#: one word, so a guess pays only if it fails far less than once in a hundred logs that need one.
THRESHOLD = 0.99
# Upper limit of a probability: the models idealize the physics, whatever the number of samples.
MODEL_DOUBT = 1e-4
# Less probable answers are not shown.
LEAST_SHARE = 0.005

__all__ = ["THRESHOLD", "Inference", "conclude", "evidence", "posterior"]


@dataclass(frozen=True)
class Inference:
    """Inference of one quantity from the numbers of a log.

    Attributes
    ----------
    quantity : str
        ``time_unit``, ``time_faults``, ``rate``, ``accel_unit``, ``gravity``, ``accel_form``,
        ``gyro_unit``, ``gyro_form``, ``gyro_axes``, ``up_axis``, ``accel_sign``, ``mag_unit``.
    value : str, float or None
        The most probable answer; None if no known one fits.
    confidence : float
        Its probability, 0 to 1.
    evidence : tuple of Finding
        The numbers that it is based on.
    alternatives : tuple of (value, float)
        The other answers with their probabilities, the most probable first.
    flag : str
        The option that answers the question; empty if there is none.
    """

    quantity: str
    value: str | float | None
    confidence: float
    evidence: tuple[Finding, ...] = ()
    alternatives: tuple[tuple[str | float | None, float], ...] = ()
    flag: str = ""

    @property
    def settled(self) -> bool:
        """Whether it is certain enough to be used without asking."""
        return self.value is not None and self.confidence >= THRESHOLD

    def finding(self, code: str = "io.inferred", **where: Any) -> Finding:
        """Return the inference as a note.

        Parameters
        ----------
        code : str
            Code whose message shows `value`, `confidence` and `evidence`.
        **where
            Location and further data, as for a `Finding`.
        """
        return Finding(
            code,
            severity="note",
            value=self.value,
            confidence=self.confidence,
            evidence=self.evidence or (evidence("io.no-evidence"),),
            **where,
        )

    def shares(self) -> tuple[Finding, ...]:
        """Return the answers that are not excluded, with their probabilities, as notes."""
        pairs = ((self.value, self.confidence), *self.alternatives)
        return tuple(
            evidence(
                "io.share-of-unknown" if value is None else "io.share", value=value, share=share
            )
            for value, share in pairs
            if share > LEAST_SHARE
        )

    def __str__(self) -> str:
        return self.finding().sentence()


def evidence(code: str, **values: Any) -> Finding:
    """Return a piece of evidence as a note."""
    return Finding(code, severity="note", **values)


def posterior(log_weights: dict[K, float]) -> dict[K, float]:
    """Normalize logarithms of prior times likelihood to probabilities, in descending order.

    Parameters
    ----------
    log_weights : dict
        Hypothesis to natural logarithm.

    Returns
    -------
    dict
        Hypothesis to probability. A total of 1e-4 is spread over all: the models may be wrong.
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
    evidence: tuple[Finding, ...],
    flag: str = "",
) -> Inference:
    """Make an `Inference` of the most probable answer.

    Parameters
    ----------
    quantity : str
    probabilities : dict
        The most probable first, as from `posterior`.
    evidence : tuple of Finding
    flag : str
    """
    (value, confidence), *others = probabilities.items()
    alternatives = tuple((v, p) for v, p in others if p >= 1e-4)
    return Inference(quantity, value, confidence, evidence, alternatives, flag)
