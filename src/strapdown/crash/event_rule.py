"""By what an event is told: thresholds and windows of 49 CFR Part 563."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from strapdown.errors import ConfigError

#: km/h in m/s.
KMH = 1.0 / 3.6

ZERO_AT = ("interval", "threshold")


@dataclass(frozen=True)
class EventRule:
    """Thresholds and windows, by default those of 49 CFR 563.5(b), as amended to 89 FR 102832.

    Attributes
    ----------
    trigger, trigger_window : float, m/s and s
        *Trigger threshold*: a change of the longitudinal (or lateral) velocity of at least
        8 km/h within 150 ms makes an event.
    wake, wake_window : float, m/s and s
        *Time zero* (2)(i): the first point of the first interval of 20 ms in which the
        longitudinal velocity changes by more than 0.8 km/h. *End of event time*: the moment at
        which the resultant change within 20 ms becomes that or less.
    lateral_window : float, s
        *Time zero* (2)(ii): as above, laterally, within 5 ms.
    lateral : bool
        Whether the vehicle records the lateral change; otherwise only the longitudinal one
        counts, in the resultant too.
    wake_acceleration : float, m/s², optional
        *Time zero* (1), for systems that wake up: the acceleration, longitudinal or lateral, at
        which this recorder's algorithm is activated (the maker's figure). The 20 and 5 ms
        windows are then not used for time zero.
    zero_at : {'interval', 'threshold'}
        Whether time zero is the first point of the interval in which the wake threshold is
        reached, as the regulation has it, or the instant at which it is reached. In a hard
        impact the first is before the contact: by 12 ms where 8 ms of it suffice.
    quiet : float, s
        For how long the resultant must stay small for the event to be over; the end is then
        where that began. Zero is the regulation; 20 to 50 ms holds together an event whose
        pulse has a dip.
    multi_event : float, s
        *Multi-event crash*: events that begin not further apart belong together.

    Raises
    ------
    ConfigError
        A threshold or window is not positive and finite, a word is unknown, or the wake's
        windows are not shorter than the trigger's.

    Notes
    -----
    The regulation leaves three things open, which are settled here so. (a) The lateral window
    of 5 ms means 44 m/s²; a side impact may reach the trigger and never that. An event without
    any other time zero takes the first point of the interval of 20 ms in which the *resultant*
    changes by more than the threshold. (b) A window of the trigger does not reach back into an
    event that has ended, else one impact would make two. (c) *(3)*, the deployment of a
    restraint, is not seen by inertial sensors.
    """

    trigger: float = 8.0 * KMH
    trigger_window: float = 0.150
    wake: float = 0.8 * KMH
    wake_window: float = 0.020
    lateral_window: float = 0.005
    lateral: bool = True
    wake_acceleration: float | None = None
    zero_at: str = "interval"
    quiet: float = 0.0
    multi_event: float = 5.0

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if f.name in ("lateral", "zero_at") or (
                f.name == "wake_acceleration" and value is None
            ):
                continue
            least = 0.0 if f.name == "quiet" else math.ulp(0.0)
            if not (math.isfinite(value) and value >= least):
                raise ConfigError("crash.no-threshold-or-window", quantity=f.name, value=value)
        if self.zero_at not in ZERO_AT:
            raise ConfigError(
                "crash.no-place-time-zero",
                quantity="zero_at",
                zero_at=self.zero_at,
                word=self.zero_at,
                known=ZERO_AT,
            )
        if max(self.wake_window, self.lateral_window) >= self.trigger_window:
            raise ConfigError(
                "crash.not-longer-than-windows-time",
                quantity="trigger_window",
                trigger_window=self.trigger_window,
            )


#: The regulation, for a vehicle that records the lateral change.
PART_563 = EventRule()
