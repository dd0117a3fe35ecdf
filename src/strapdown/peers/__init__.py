"""Comparison with filters of other libraries: one module each, and their table."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown.errors import ConfigError, Finding, add_warning, check_choice
from strapdown.peers import peer_ahrs, peer_imufusion, peer_vqf
from strapdown.peers.peer import (
    AIDINGS,
    Peer,
    PeerFilter,
    align_heading,
    needed_columns,
    steadiness,
)

__all__ = [
    "AIDINGS",
    "PEERS",
    "Peer",
    "PeerFilter",
    "align_heading",
    "available_peers",
    "run_peers",
]

PEERS: dict[str, Peer] = {
    "vqf": peer_vqf.PEER,
    "imufusion": peer_imufusion.PEER,
    "ahrs": peer_ahrs.PEER,
}


def available_peers() -> tuple[str, ...]:
    """Names of the installed libraries, in the order of `PEERS`."""
    return tuple(name for name, peer in PEERS.items() if peer.available)


def _chosen(names: Sequence[str]) -> list[tuple[Peer, str]]:
    """Pairs of library and filter selected by the names, without repetition."""
    pairs: list[tuple[Peer, str]] = []
    for word in names:
        name, _, one = word.strip().lower().partition(":")
        check_choice("peers.no-library-known-here", PEERS, quantity="peers", name=name)
        peer = PEERS[name]
        if one and one not in peer.filters:
            raise ConfigError(
                "peers.no-filter",
                quantity="peers",
                one=one,
                name=name,
                word=one,
                known=peer.filters,
            )
        _ = peer.version  # before the first, perhaps long, run: is it installed?
        pairs += [(peer, f) for f in ([one] if one else peer.filters) if (peer, f) not in pairs]
    return pairs


def run_peers(
    names: Sequence[str],
    imu: pd.DataFrame,
    q_nb: ArrayLike,
    aidings: Sequence[str] | None = None,
    *,
    longest_s: float | None = None,
    progress: Callable[[str], None] | None = None,
) -> tuple[tuple[tuple[str, str, pd.DataFrame], ...], tuple[Finding, ...]]:
    """Run filters of other libraries over a record.

    Parameters
    ----------
    names : sequence of str
        ``vqf``, ``imufusion``, ``ahrs``, or one filter of a library, as in ``ahrs:madgwick``.
    imu : DataFrame
        An Imu table, with ``mag_x..z`` in µT if there is a magnetometer.
    q_nb : array_like, (4,)
        Attitude at the first stamp.
    aidings : sequence of str, optional
        From `AIDINGS`; by default all that the columns of `imu` allow.
    longest_s : float, s, optional
        Filters with a longer expected run time are left out.
    progress : callable, optional
        Called with a sentence before each run.

    Returns
    -------
    runs : tuple of (str, str, DataFrame)
        Library with version and filter, aiding, Attitude table; ordered by aiding as in
        `AIDINGS`, since only filters with the same aiding are comparable.
    findings : tuple of Finding
        Filters left out, and records whose steps violate a library's assumption.

    Raises
    ------
    ConfigError
        A library is unknown or not installed, or a filter or an aiding is unknown.
    DataError
        The columns of a requested aiding are absent.
    DivergenceError
        A library failed.
    """
    pairs = _chosen(names)
    if aidings is None:
        wanted = [a for a in AIDINGS if set(needed_columns(a)) <= set(imu.columns)]
    else:
        wanted = sorted({a for a in aidings if needed_columns(a)}, key=AIDINGS.index)
    time = imu.index.to_numpy(dtype=np.float64)
    runs: list[tuple[str, str, pd.DataFrame]] = []
    findings: list[Finding] = []
    uneven: set[str] = set()
    for aiding in wanted:
        for peer, name in pairs:
            chosen = peer.filters[name]
            if aiding not in chosen.compute:
                continue
            label = peer.label(name)
            seconds = chosen.microseconds * 1e-6 * len(imu)
            if longest_s is not None and seconds > longest_s:
                add_warning(
                    findings,
                    "peers.left-out-samples-takes-about",
                    quantity=f"{label}, {aiding}",
                    count=len(imu),
                    seconds=seconds,
                )
                continue
            if progress is not None:
                progress(f"{label}, {aiding}: about {max(seconds, 1.0):.0f} s")
            runs.append((label, aiding, peer.run(imu, q_nb, aiding, name)))
            finding = steadiness(np.diff(time), label, imu.attrs.get("source"))
            if chosen.steady and finding is not None and label not in uneven:
                uneven.add(label)
                findings.append(finding)
    return tuple(runs), tuple(findings)
