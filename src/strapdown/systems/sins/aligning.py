"""What a chain does at the end of a mode of alignment."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.aiding.aid import Aid
from strapdown.alignment.course_fixes import Antenna
from strapdown.alignment.gnss_course import GnssCourse
from strapdown.alignment.site import Site
from strapdown.ellipsoids import find_ellipsoid
from strapdown.estimation.filter_state import FilterState
from strapdown.frames import geodetic_from_ned
from strapdown.nav_state import NavState
from strapdown.prefilter.prefilter import CHANNELS
from strapdown.rotation import rotate
from strapdown.systems.sins.by_antenna import errors_by_antenna
from strapdown.systems.sins.fixes import fixes_until, here_by_fix, site_of_fixes
from strapdown.systems.sins.handover import from_alignment, from_fine
from strapdown.systems.sins.modes import CoarseMode, FineMode
from strapdown.systems.sins.piece import Aligned
from strapdown.tables import MOTION

if TYPE_CHECKING:
    from strapdown.systems.sins.chain import Chain, ChainState

__all__ = ["align", "handed_over", "unused_fixes"]

Array = NDArray[np.float64]

# An instant is come to within this, s.
INSTANT = 1e-7
# Over so much before and after it the rate at an instant is a mean, s.
STEADY = 0.1


def align(chain: Chain, state: ChainState) -> Aligned:
    """Align by what was kept of the mode that a chain is in.

    Parameters
    ----------
    chain : Chain
    state : ChainState
        In a mode of alignment.

    Returns
    -------
    Aligned

    Raises
    ------
    DataError, DivergenceError
        It is not possible.
    """
    mode = chain.modes[state.mode]
    assert chain.sensors is not None
    kept = _window(chain, state)
    imu = _table(kept[:, 1:7], kept[:, 0], CHANNELS, state)
    imu.attrs["sampling"] = chain.intake.sampling(state.intake)
    imu.attrs["axes"] = "forward-right-down"
    if isinstance(mode, FineMode):
        assert state.aligned is not None
        coarse = state.aligned.alignment
        site, _ = _site(chain, state, coarse.q_nb)
        increments = _table(kept[1:, 7:17], kept[1:, 0], MOTION, state)
        fine = mode.way.align(imu, site, chain.sensors, coarse, increments=increments)
        return Aligned(mode.name, state.begun, state.time, fine.alignment, fine)
    assert isinstance(mode, CoarseMode)
    site, _ = _site(chain, state, None)
    if isinstance(mode.way, GnssCourse):
        fixes, antenna = _fixes(chain, state), _antenna(chain)
        found = mode.way.align(imu, site, chain.sensors, fixes, antenna)
    else:
        found = mode.way.align(imu, site, chain.sensors, _fixes(chain, state))
    return Aligned(mode.name, state.begun, state.time, found)


def handed_over(chain: Chain, state: ChainState, found: Aligned) -> FilterState:
    """Return the state of the filter with which navigation begins.

    Parameters
    ----------
    chain : Chain
    state : ChainState
        At the end of a mode of alignment.
    found : Aligned

    Returns
    -------
    FilterState
    """
    filter_ = chain.navigator.filter
    rest = _window(chain, state)[:, 1:7].mean(axis=0)
    q_nb = found.alignment.q_nb
    still = np.zeros(3)
    if found.fine is not None:
        assert state.aligned is not None
        before = state.aligned.alignment.q_nb
        _, sd = _site(chain, state, before)
        shift, by_others = still, None
        if chain.site is None:
            arm = _lever_arm(chain)
            shift = rotate(before, arm) - rotate(q_nb, arm)
            by_others = _by_antenna(chain, q_nb, still, still)
        return from_fine(filter_, found.fine, rest, sd, shift, by_others)
    mode = chain.modes[state.mode]
    if isinstance(mode, CoarseMode) and isinstance(mode.way, GnssCourse):
        ellipsoid = find_ellipsoid(filter_.mechanization.ellipsoid)
        assert found.alignment.velocity is not None and found.alignment.joint is not None
        place = here_by_fix(
            _fixes(chain, state),
            state.time,
            q_nb,
            _lever_arm(chain),
            ellipsoid,
            found.alignment.velocity,
            found.alignment.joint[:3, :3],
        )
        turn = _turn(_window(chain, state), state.time)
        return from_alignment(
            filter_,
            found.alignment,
            place.state,
            place.covariance,
            rest,
            _by_antenna(chain, q_nb, place.state.v_n, turn),
        )
    site, sd = _site(chain, state, q_nb)
    start = NavState.from_degrees(site.lat_deg, site.lon_deg, site.alt, time=state.time)
    P = np.diag(np.square(np.concatenate([sd, chain.velocity_sd])))
    by_others = None if chain.site is not None else _by_antenna(chain, q_nb, still, still)
    return from_alignment(filter_, found.alignment, start, P, rest, by_others)


def unused_fixes(
    chain: Chain, state: ChainState, begun: float
) -> dict[str, tuple[pd.DataFrame, ...]]:
    """What is left of the tables of a receiver by whose fixes navigation has begun.

    Parameters
    ----------
    chain : Chain
    state : ChainState
        At the end of a mode of alignment.
    begun : float, s
        When navigation begins.

    Returns
    -------
    dict of str to tuple of DataFrame
        By name of the aid: rows that an alignment by course has not met yet. A fix at the very end
        of it has told place and velocity already, and would count twice.
    """
    mode, name = chain.modes[state.mode], chain.fixes_from
    if name is None or not (isinstance(mode, CoarseMode) and isinstance(mode.way, GnssCourse)):
        return {}
    offset = float(getattr(_receiver(chain), "time_offset", 0.0))
    out = [table[table.index - offset > begun + INSTANT] for table in state.told[name]]
    return {name: tuple(table for table in out if len(table))}


def _by_antenna(chain: Chain, q_nb: Array, velocity: Array, turn: Array) -> Array | None:
    """What other errors add to a place and velocity by the fixes of the alignment."""
    if chain.fixes_from is None:
        return None
    arm, filter_ = _lever_arm(chain), chain.navigator.filter
    return errors_by_antenna(filter_, chain.fixes_from, q_nb, arm, velocity, turn)


def _turn(kept: Array, at: float) -> Array:
    """Rate of the body about an instant, without its shaking; body axes."""
    near = np.abs(kept[:, 0] - at) <= STEADY
    if not near.any():
        near = np.arange(len(kept)) == np.argmin(np.abs(kept[:, 0] - at))
    return np.asarray(kept[near, 1:4].mean(axis=0))


def _window(chain: Chain, state: ChainState) -> Array:
    """Steps that are aligned."""
    kept, mode = state.kept.rows, chain.modes[state.mode]
    if not isinstance(mode, CoarseMode):
        return kept
    return kept[np.searchsorted(kept[:, 0], state.time - mode.window - INSTANT) :]


def _table(values: Array, time: Array, columns: list[str], state: ChainState) -> pd.DataFrame:
    table = pd.DataFrame(values.copy(), index=pd.Index(time, name="time"), columns=columns)
    table.attrs["source"] = state.intake.source
    return table


def _fixes(chain: Chain, state: ChainState) -> pd.DataFrame | None:
    name = chain.fixes_from
    if name is None:
        return None
    offset = float(getattr(chain.navigator.by_name[name], "time_offset", 0.0))
    return fixes_until(state.told[name], state.time + INSTANT, offset)


def _site(chain: Chain, state: ChainState, q_nb: Array | None) -> tuple[Site, Array]:
    """Where the sensors are, and how well that is known."""
    if chain.site is not None:
        return chain.site, np.asarray(chain.site_sd, dtype=np.float64)
    ellipsoid = find_ellipsoid(chain.navigator.filter.mechanization.ellipsoid)
    site, sd = site_of_fixes(_fixes(chain, state), state.begun, state.time, ellipsoid)
    arm = _lever_arm(chain)
    if q_nb is None or not arm.any():
        return site, sd
    antenna = np.array([site.lat_deg, site.lon_deg, site.alt])
    place = geodetic_from_ned(-rotate(q_nb, arm), antenna, ellipsoid=ellipsoid)
    lat_deg, lon_deg, alt = place.tolist()
    return Site(lat_deg, lon_deg, alt, ellipsoid), sd


def _receiver(chain: Chain) -> Aid | None:
    """That which has the fixes."""
    return chain.navigator.by_name.get(chain.fixes_from or "")


def _antenna(chain: Chain) -> Antenna:
    """Where and when the receiver measures."""
    aid = _receiver(chain)
    x, y, z = _lever_arm(chain).tolist()
    return Antenna(
        (x, y, z),
        float(getattr(aid, "velocity_delay", 0.0)),
        float(getattr(aid, "time_offset_sd", 0.0)),
    )


def _lever_arm(chain: Chain) -> Array:
    """Of its antenna."""
    arm = getattr(_receiver(chain), "lever_arm", (0.0, 0.0, 0.0))
    return np.asarray(arm, dtype=np.float64)
