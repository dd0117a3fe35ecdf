"""The entry of a case: each kind with what it needs, and nothing else."""

from __future__ import annotations

import math

from strapdown.config.crash_case import CaseSpec, EntrySpec
from strapdown.config.crash_checks.written import Written

__all__ = ["check_entry"]

# Faster than any car on a road, and slower than most speeds in km/h that were taken for m/s.
FASTEST = 90.0  # m/s
MOST_ANGLE = 360.0  # deg
# What each kind has no use for; a value of zero says nothing.
_NO_USE = {
    "speed": ("path", "antenna_m", "antenna_sd_m"),
    "standstill": (
        "speed_m_per_s",
        "speed_sd_m_per_s",
        "time_s",
        "heading_deg",
        "heading_sd_deg",
        "slip_deg",
        "slip_sd_deg",
        "climb_sd_m_per_s",
        "path",
        "antenna_m",
        "antenna_sd_m",
    ),
    "gnss": (
        "speed_m_per_s",
        "speed_sd_m_per_s",
        "heading_deg",
        "heading_sd_deg",
        "slip_deg",
        "slip_sd_deg",
        "climb_sd_m_per_s",
    ),
}
_UNUSED = {
    "speed": "config.entry-speed-no-use",
    "standstill": "config.entry-standstill-no-use",
    "gnss": "config.entry-gnss-no-use",
}
_NEEDED = {
    "speed": {
        "speed_m_per_s": "config.entry-speed-missing",
        "speed_sd_m_per_s": "config.entry-speed-sd-missing",
        "source": "config.entry-source-missing",
    },
    "standstill": {},
    "gnss": {"path": "config.entry-fixes-missing"},
}


def check_entry(spec: CaseSpec, written: Written) -> None:
    """Check the entry.

    Raises
    ------
    ConfigError
        It lacks something, says what its kind has no use for, or a number is out of proportion.
    """
    entry = spec.entry
    for name in _NO_USE[entry.kind]:
        given = getattr(entry, name)
        if written.has("entry", name) and given not in (None, 0.0):
            raise written.contradiction(
                ("entry", name),
                ("entry", "kind"),
                _UNUSED[entry.kind],
                default=entry.kind,
                key=written.key("entry", name),
                kind=_kind_for(name),
            )
    for name, code in _NEEDED[entry.kind].items():
        given = getattr(entry, name)
        if given is None or (isinstance(given, str) and not given.strip()):
            raise written.missing(("entry", name), code)
    _sizes(entry, written)
    _instant(spec, written)


def _kind_for(name: str) -> str:
    return "gnss" if name.startswith(("path", "antenna")) else "speed"


def _sizes(entry: EntrySpec, written: Written) -> None:
    speed, sd = entry.speed_m_per_s, entry.speed_sd_m_per_s
    if speed is not None and abs(speed) > FASTEST:
        raise written.refuse(
            ("entry", "speed_m_per_s"), "config.entry-speed-too-large", speed=3.6 * speed
        )
    if entry.kind == "speed" and sd == 0.0:
        raise written.refuse(("entry", "speed_sd_m_per_s"), "config.entry-speed-sd-zero")
    if sd is not None and sd > FASTEST / 3.0:
        raise written.refuse(
            ("entry", "speed_sd_m_per_s"), "config.entry-speed-sd-too-large", sd=3.6 * sd
        )
    for name in ("heading_deg", "slip_deg"):
        if abs(getattr(entry, name)) > MOST_ANGLE:
            raise written.refuse(("entry", name), "config.angle-beyond-turn")
    for name in ("heading_sd_deg", "slip_sd_deg"):
        if getattr(entry, name) > MOST_ANGLE / 2.0:
            raise written.refuse(("entry", name), "config.angle-sd-too-large")


def _instant(spec: CaseSpec, written: Written) -> None:
    window, time = spec.options.window_s, spec.entry.time_s
    at, over = ("entry", "time_s"), ("options", "window_s")
    if spec.entry.kind == "standstill":
        return
    if window is not None and window[0] < window[1] and not window[0] <= time <= window[1]:
        first, second = (at, over) if written.has(*at) else (over, at)
        raise written.contradiction(first, second, "config.entry-outside-window", default=time)
    if not math.isclose(time, 0.0) and abs(time) > 600.0:
        raise written.refuse(at, "config.entry-far-from-trigger")
