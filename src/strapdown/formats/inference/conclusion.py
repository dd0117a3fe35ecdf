"""A conclusion from numbers, with its probability and what speaks for it."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from strapdown.errors import Finding

K = TypeVar("K", bound=Hashable)

#: Below this a conclusion is a question to the user. A wrong unit spoils a whole run and a
#: question costs one word, so that a guess pays only where it fails far less than once in a
#: hundred logs that need one.
THRESHOLD = 0.99
# The models here are physics with stated idealisations; no number of samples makes them surer
# than this.
MODEL_DOUBT = 1e-4
# An answer less probable than this is not shown.
LEAST_SHARE = 0.005

__all__ = ["THRESHOLD", "Inference", "conclude", "evidence", "posterior"]


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
    evidence : tuple of Finding
        The numbers that it rests on.
    alternatives : tuple of (value, float)
        The other answers with their probabilities, the most probable first.
    flag : str
        The option that answers the question; empty where there is none.
    """

    quantity: str
    value: str | float | None
    confidence: float
    evidence: tuple[Finding, ...] = ()
    alternatives: tuple[tuple[str | float | None, float], ...] = ()
    flag: str = ""

    @property
    def settled(self) -> bool:
        """Whether it is sure enough to be used without asking."""
        return self.value is not None and self.confidence >= THRESHOLD

    def finding(self, code: str = "io.inferred", **where: Any) -> Finding:
        """Return it as a note.

        Parameters
        ----------
        code : str
            Whose sentence shows `value`, `confidence` and `evidence`.
        **where
            Location and further data, as of a `Finding`.
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
        """Return the answers that are not excluded, each with its probability, as notes."""
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
    """Return what speaks for a conclusion, as a note."""
    return Finding(code, severity="note", **values)


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
    evidence: tuple[Finding, ...],
    flag: str = "",
) -> Inference:
    """The most probable answer as an `Inference`.

    Parameters
    ----------
    quantity : str
    probabilities : dict
        The most probable first, as `posterior` gives them.
    evidence : tuple of Finding
    flag : str
    """
    (value, confidence), *others = probabilities.items()
    alternatives = tuple((v, p) for v, p in others if p >= 1e-4)
    return Inference(quantity, value, confidence, evidence, alternatives, flag)
