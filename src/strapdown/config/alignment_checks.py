"""What an alignment says against itself, or a module refuses: told before anything runs."""

from __future__ import annotations

from functools import partial

import numpy as np

from strapdown.alignment.fine import FineAlignment
from strapdown.alignment.site import Site
from strapdown.alignment.stationary import home_of
from strapdown.config.alignment import AlignmentSpec
from strapdown.config.choice import make_choice
from strapdown.config.crash_checks import Written
from strapdown.config.slots import SLOTS
from strapdown.config.source_checks import MOST_SAMPLES, SourceChecks
from strapdown.ellipsoids import find_ellipsoid
from strapdown.estimation.error_filter import ErrorFilter

__all__ = ["NOT_BEFORE_FINE", "check_alignment"]


def check_alignment(spec: AlignmentSpec, written: Written | None = None) -> None:
    """Refuse what cannot be meant.

    Parameters
    ----------
    spec : AlignmentSpec
    written : Written, optional
        The file that it was read from, for lines in messages.

    Raises
    ------
    ConfigError
        A module refuses an option, the place is none, a matrix is no rotation, a sensor is not
        known or says too little, or times contradict one another.
    """
    check = _Checks(written)
    site = spec.site
    check.place("site", site.lat_deg, site.lon_deg, site.alt_m)
    check.told(("site", "ellipsoid"), lambda: find_ellipsoid(site.ellipsoid))
    check.axes(spec.axes)
    check.log(spec.log)
    check.sensors(spec.sensors, spec.simulation, "config.no-sensor-for-alignment")
    check.times(spec)
    check.stages(spec)
    check.chain(spec)


class _Checks(SourceChecks):
    def times(self, spec: AlignmentSpec) -> None:
        longest = self.span(spec.log)
        if spec.simulation is not None:
            longest = spec.simulation.duration_s
            if spec.simulation.rate_hz * longest > MOST_SAMPLES:
                raise self.refuse(
                    ("simulation", "duration_s"),
                    "config.samples-too-many",
                    count=spec.simulation.rate_hz * longest,
                    most=MOST_SAMPLES,
                )
        if (
            longest is not None
            and spec.coarse.duration_s is not None
            and spec.coarse.duration_s > longest
        ):
            raise self.refuse(
                ("coarse", "duration_s"), "config.longer-than-record", longest=longest
            )

    def stages(self, spec: AlignmentSpec) -> None:
        given = {"ellipsoid": spec.site.ellipsoid}
        for name in ("prefilter", "coarse", "fine"):
            self.told((name,), partial(make_choice, getattr(spec, name), SLOTS[name], given))

    def chain(self, spec: AlignmentSpec) -> None:
        """What one stage leaves, and another needs."""
        kind = spec.coarse.kind
        if kind in NEEDS_GNSS and spec.gnss is None:
            raise self.refuse(("coarse", "kind"), "config.course-without-fixes")
        if spec.gnss is not None and kind not in NEEDS_GNSS:
            raise self.refuse(
                ("gnss", "path"),
                "config.coarse-takes-no-fixes",
                kind=kind,
                other=NEEDS_GNSS[0],
            )
        if kind in NOT_BEFORE_FINE and spec.fine.kind != "none":
            raise self.refuse(("coarse", "kind"), NOT_BEFORE_FINE[kind])
        if spec.fine.kind != "none":
            self.told(("fine",), partial(_begun, spec))


def _begun(spec: AlignmentSpec) -> None:
    """Begin the filter of a fine alignment, which refuses parts that do not go together."""
    site = Site(
        spec.site.lat_deg, spec.site.lon_deg, spec.site.alt_m, find_ellipsoid(spec.site.ellipsoid)
    )
    way: FineAlignment = make_choice(spec.fine, SLOTS["fine"], {"ellipsoid": spec.site.ellipsoid})
    if abs(spec.site.lat_deg) > way.mechanization.latitude_limit_deg:
        # Whether north can be found there is told by the alignments themselves.
        return
    filter_ = ErrorFilter(way.mechanization, way.model(), way.form, way.rule)
    filter_.begin(home_of(site, 0.0), np.zeros((filter_.model.physical_size,) * 2))


#: Coarse alignments that need satellite fixes.
NEEDS_GNSS = ("gnss_course",)
#: Coarse alignments that a filter over a rest cannot begin from, and the code that says why.
NOT_BEFORE_FINE = {
    "gnss_course": "config.course-before-fine",
    "levelling": "config.levelling-before-fine",
}
