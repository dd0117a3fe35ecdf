"""Observations of one epoch as one update: whose rule each component has, and what each told."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from strapdown.estimation.covariance import Innovations
from strapdown.estimation.observation import Observation
from strapdown.estimation.update_rule import FullUpdate, UpdateRule

__all__ = ["Rules", "rules_of_components", "split_innovations"]

#: What an observation is believed by: one rule, one for each of its components, or none.
Rules = UpdateRule | Sequence[UpdateRule] | None


def rules_of_components(
    rules: Sequence[Rules], observations: Sequence[Observation]
) -> list[UpdateRule] | None:
    """Return one rule for each component; none at all where nothing has one.

    Parameters
    ----------
    rules : sequence of Rules
        One an observation.
    observations : sequence of Observation
    """
    if not any(rules):
        return None
    out: list[UpdateRule] = []
    for rule, one in zip(rules, observations, strict=True):
        out += rule if isinstance(rule, Sequence) else [rule or FullUpdate()] * one.z.size
    return out


def split_innovations(seen: Innovations, observations: Sequence[Observation]) -> list[Innovations]:
    """Return of each observation what all of them told together.

    Parameters
    ----------
    seen : Innovations
        Of all components, one observation after the other.
    observations : sequence of Observation
    """
    cuts = np.cumsum([one.z.size for one in observations])[:-1]
    parts = (np.split(values, cuts) for values in (seen.nu, seen.s, seen.weight))
    return [Innovations(*one) for one in zip(*parts, strict=True)]
