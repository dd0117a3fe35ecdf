"""Single error of one of two measuring points that would explain how they differ."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.structure import Structure, likeliest, structural_unknowns
from strapdown.errors import Finding

Array = NDArray[np.float64]

OFF_SCALE, OFF_POSITION, OFF_MOUNTING = (
    f"crash.off-{what}" for what in ("scale", "position", "mounting")
)
#: Standard deviations that are tried, zero first: of a scale factor, in m and rad.
SIZES: Mapping[str, Array] = {
    OFF_SCALE: np.array([0.0, 0.05, 0.1, 0.2, 0.4]),
    OFF_POSITION: np.array([0.0, 0.1, 0.2, 0.4, 0.8]),
    OFF_MOUNTING: np.radians([0.0, 3.0, 6.0, 12.0, 24.0]),
}


_QUANTITY = {
    OFF_SCALE: "scale factor",
    OFF_POSITION: "position",
    OFF_MOUNTING: "mounting angles",
}


@dataclass(frozen=True, eq=False)
class SingleError:
    """An error that makes the differences of two points likelier than their structure does.

    Attributes
    ----------
    code : str
        A key of `SIZES`.
    size : ndarray, (r,)
        Its conditional mean, first point less second: of the scale factor along the force; of the
        position, true less stated, m; rotation of the second into the first, rad.
    lead : float
        Twice the logarithm of the odds against structure alone.
    """

    code: str
    size: Array
    lead: float

    def finding(self, first: str, second: str) -> Finding:
        """The error as a finding on the second point."""
        shown = {OFF_SCALE: 100.0, OFF_MOUNTING: 180.0 / math.pi}
        x, y, z = (float(v) for v in np.resize(shown.get(self.code, 1.0) * self.size, 3))
        return Finding(
            "crash.one-point-off",
            file=second,
            quantity=_QUANTITY[self.code],
            first=first,
            error=Finding(self.code, severity="note", x=x, y=y, z=z),
            odds=float(np.exp(0.5 * min(self.lead, 1000.0))),
        )


def single_error(
    effects: Mapping[str, Array],
    structure: Structure,
    edges: Array,
    kept: NDArray[np.bool_],
    difference: Array,
    covariance: Array,
    level: float,
) -> SingleError | None:
    """The likeliest error of `effects` if it explains a difference much better than structure.

    Parameters
    ----------
    effects : mapping of ndarray, (3 m, r)
        Effect of a unit of each error on the difference, by the keys of `SIZES`.
    structure : Structure
        As learnt without an error; its correlation time is kept, its shares are learnt anew.
    edges, kept, difference, covariance
        As `learn_share`, of one pair.
    level : float
        The error is reported if the odds of structure alone against it are below this.

    Notes
    -----
    A chi-square of all differences dilutes a single error: with 60 degrees of freedom one of 6.3
    standard deviations has a probability of 1e-3. Here each error is one more Gaussian unknown
    whose size is estimated beside the structure's: the ratio of the two posteriors decides from
    about 4 standard deviations on, and does not let structure absorb the error. A late clock
    is not among them: it makes the difference of a hump, as structure does.
    """
    unknowns = structural_unknowns(structure, edges, kept, 1)
    _, _, alone = likeliest(unknowns, difference, covariance)
    best: SingleError | None = None
    for code, effect in effects.items():
        tried = [(effect, SIZES[code], np.inf), *unknowns]
        sizes, _, cost = likeliest(tried, difference, covariance)
        lead = alone - cost
        if sizes[0] == 0.0 or lead < (-2.0 * math.log(level) if best is None else best.lead):
            continue
        whole = covariance + sum(
            x**2 * root @ root.T for x, (root, _, _) in zip(sizes, tried, strict=True)
        )
        size = sizes[0] ** 2 * effect.T @ np.linalg.solve(whole, difference)
        best = SingleError(code, np.asarray(size), float(lead))
    return best
