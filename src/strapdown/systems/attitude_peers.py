"""Other libraries' filters over the log of the bench."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import Finding
from strapdown.evaluation.reference_points import score_references
from strapdown.peers import PEERS, align_heading, run_peers
from strapdown.results.runs import AttitudeRun, PeerRun
from strapdown.systems.attitude_judgement import truth_score
from strapdown.systems.attitude_source import Source
from strapdown.tables import QUATERNION, attitude_table

Array = NDArray[np.float64]

#: A filter that would take longer is left out, and a finding says so.
LONGEST = 60.0  # s


def run_beside(
    names: Sequence[str],
    source: Source,
    imu: pd.DataFrame,
    q_nb: Array,
    references: pd.DataFrame,
    findings: list[Finding],
) -> tuple[PeerRun, ...]:
    """Run the filters that are named, and compare them with what is known.

    Parameters
    ----------
    names : sequence of str
        Of `peers.PEERS`, one filter as in ``ahrs:madgwick``, or ``all``.
    source : Source
        With the truth, where there is one.
    imu : DataFrame
        The samples as used.
    q_nb : ndarray, (4,)
        Attitude at the start.
    references : DataFrame
    findings : list of Finding
        What was left out is added.

    Returns
    -------
    tuple of PeerRun
        With an accelerometer alone a filter cannot tell the heading: its own zero is turned to
        the truth at the first instant that counts, where there is one.

    Raises
    ------
    ConfigError
        A library is unknown, or not installed.
    """
    if not names:
        return ()
    wanted = list(PEERS) if [n.lower() for n in names] == ["all"] else list(names)
    runs, found = run_peers(wanted, imu, q_nb, longest_s=LONGEST)
    findings += found
    out = []
    for label, aiding, attitude in runs:
        if aiding == "gyro+accel" and source.truth is not None and source.scored is not None:
            attitude = _headed(attitude, source.truth[source.scored])
        run = AttitudeRun(label, label, "", attitude, {})
        scores = [*truth_score(run, source), *score_references(run, references, imu)]
        out.append(PeerRun(label, aiding, attitude, tuple(scores)))
    return tuple(out)


def _headed(attitude: pd.DataFrame, truth: pd.DataFrame) -> pd.DataFrame:
    inside = truth[(truth.index >= attitude.index[0]) & (truth.index <= attitude.index[-1])]
    if inside.empty:
        return attitude
    row = int(np.searchsorted(attitude.index.to_numpy(), float(inside.index[0])))
    q = align_heading(
        attitude[QUATERNION].to_numpy(), inside[QUATERNION].to_numpy(dtype=np.float64)[0], row
    )
    return attitude_table(attitude.index.to_numpy(), q)
