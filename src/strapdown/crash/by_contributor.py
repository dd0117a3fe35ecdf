"""Sums over the unknowns of each line of an error budget."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: The line of what is independent from sample to sample.
NOISE = "sensor noise"


def by_contributor(
    values: Array, columns: Sequence[str], contributors: Sequence[str], more: Mapping[str, Array]
) -> pd.DataFrame:
    """Add up what belongs to one line.

    Parameters
    ----------
    values : ndarray, (p, k)
        Of each unknown: variances, or products.
    columns : sequence of str, (k,)
    contributors : sequence of str, (p,)
        The line that each unknown belongs to.
    more : dict of ndarray, (k,)
        What no unknown stands for, by line.

    Returns
    -------
    DataFrame
        Indexed by contributor, in the order in which they first occur.
    """
    lines = pd.DataFrame(values, columns=list(columns))
    table = lines.groupby(list(contributors), sort=False).sum()
    for name, values_of_line in more.items():
        already = table.loc[name].to_numpy() if name in table.index else np.zeros(len(columns))
        table.loc[name] = already + values_of_line
    table.index.name = "contributor"
    return table
