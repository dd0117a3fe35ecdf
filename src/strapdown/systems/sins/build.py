"""A chain made of its configuration."""

from __future__ import annotations

import math

import numpy as np

from strapdown.alignment.site import Site
from strapdown.config.choice import make_choice
from strapdown.config.navigation import (
    CoarseModeSpec,
    FineModeSpec,
    NavigationSpec,
    StartTable,
)
from strapdown.config.navigation_modules import given_of, make_aids, make_filter
from strapdown.config.slots import SLOTS
from strapdown.ellipsoids import find_ellipsoid
from strapdown.nav_state import NavState
from strapdown.navigation.navigator import Navigator, with_states
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.systems.sins.chain import Chain
from strapdown.systems.sins.gaps import GapPolicy
from strapdown.systems.sins.intake import Intake
from strapdown.systems.sins.known_start import KnownStart
from strapdown.systems.sins.modes import CoarseMode, Command, FineMode, Mode, Navigation, Until
from strapdown.systems.sins.saturated import ends_of

__all__ = ["make_chain"]

Three = tuple[float, float, float]


def make_chain(spec: NavigationSpec, sensors: ImuUncertainty) -> Chain:
    """Make the chain of a specification.

    Parameters
    ----------
    spec : NavigationSpec
        Samples and tables are given to the chain in body axes and on one clock.
    sensors : ImuUncertainty

    Returns
    -------
    Chain

    Raises
    ------
    ConfigError
        A module refuses an option, or its parts do not go together.
    """
    given = given_of(spec)
    aids = make_aids(spec)
    options = make_choice(spec.filter, SLOTS["filter"], given)
    navigator = Navigator(
        with_states(make_filter(spec, sensors), aids),
        aids,
        options.mark_interval,
        make_choice(spec.damping, SLOTS["damping"], given),
        make_choice(spec.smoother, SLOTS["smoother"], given),
    )
    prefilter = None
    if spec.prefilter.kind != "none":
        prefilter = make_choice(spec.prefilter, SLOTS["prefilter"], given)
    gaps = spec.gaps
    site, site_sd, velocity_sd = None, (1.0, 1.0, 1.0), (0.1, 0.1, 0.1)
    if spec.site is not None:
        site = Site(
            spec.site.lat_deg, spec.site.lon_deg, spec.site.alt_m, find_ellipsoid(spec.ellipsoid)
        )
        site_sd = _three(spec.site.position_sd_m)
        velocity_sd = _three(spec.site.velocity_sd_m_per_s)
    return Chain(
        navigator=navigator,
        intake=Intake(
            prefilter=prefilter,
            gaps=GapPolicy(gaps.usual, gaps.coast_s, gaps.beyond),
            ends=ends_of(sensors),
        ),
        modes=_modes(spec),
        start=None if spec.start is None else _known(spec.start),
        sensors=sensors,
        site=site,
        commands=tuple(Command(one.time_s, one.mode) for one in spec.commands),
        site_sd=site_sd,
        velocity_sd=velocity_sd,
    )


def _modes(spec: NavigationSpec) -> tuple[Mode, ...]:
    given = given_of(spec)
    modes: list[Mode] = []
    coarse = make_choice(spec.coarse, SLOTS["coarse"], given)
    if coarse is not None:
        window = math.inf if spec.coarse.window_s is None else spec.coarse.window_s
        modes.append(CoarseMode("coarse", _until(spec.coarse), way=coarse, window=window))
    fine = make_choice(spec.fine, SLOTS["fine"], given)
    if fine is not None:
        modes.append(FineMode("fine", _until(spec.fine), fine))
    return (*modes, Navigation())


def _until(mode: CoarseModeSpec | FineModeSpec) -> Until:
    return Until(
        duration=math.inf if mode.duration_s is None else mode.duration_s,
        heading_sd_deg=mode.until_heading_sd_deg,
        tilt_sd_deg=mode.until_tilt_sd_deg,
    )


def _known(start: StartTable) -> KnownStart:
    return KnownStart(
        NavState.from_degrees(
            start.lat_deg,
            start.lon_deg,
            start.alt_m,
            v_n=start.v_ned_m_per_s,
            roll_deg=start.roll_deg,
            pitch_deg=start.pitch_deg,
            heading_deg=start.heading_deg,
        ),
        position_sd=_three(start.position_sd_m),
        velocity_sd=_three(start.velocity_sd_m_per_s),
        attitude_sd_deg=(start.tilt_sd_deg, start.tilt_sd_deg, start.heading_sd_deg),
        at_first_sample=True,
    )


def _three(value: float | Three) -> Three:
    x, y, z = (float(v) for v in np.broadcast_to(value, 3))
    return x, y, z
