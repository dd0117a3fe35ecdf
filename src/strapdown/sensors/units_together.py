"""What units of one vehicle must be together: names, options, sizes of what they measured."""

from __future__ import annotations

import math
from collections.abc import Sequence

from strapdown.errors import ConfigError, DataError, Finding
from strapdown.sensors.crash_unit import CrashUnit
from strapdown.sensors.triad_channels import TriadChannels
from strapdown.sensors.triad_numbers import finite
from strapdown.tables import SAMPLINGS

__all__ = ["METHODS", "check_options", "compare_sizes"]

METHODS = ("trigger", "correlation")
# Rates of one rigid body differ by this factor when one is in deg/s.
DEGREES_APART = (40.0, 80.0)
# And specific forces by this when one is in g; they differ from place to place, too.
G_APART = (8.0, 12.0)
# Common stamps that are closer than this make work, and no knowledge.
MOST_FASTER = 10.0


def check_options(
    units: Sequence[CrashUnit], method: str, rate: float, reference: str | None, sampling: str
) -> None:
    """Check what was asked of `synchronise`.

    Raises
    ------
    ConfigError
        There is no unit, two have one name, or an option is not understood.
    """
    if not units:
        raise ConfigError("sensors.no-units-given", quantity="units")
    names = [u.name for u in units]
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise ConfigError("sensors.two-units-called", quantity="name", twice=twice[0])
    if method not in METHODS:
        raise ConfigError(
            "sensors.no-way-synchronise",
            quantity="method",
            method=method,
            word=str(method),
            known=METHODS,
        )
    if sampling not in SAMPLINGS:
        raise ConfigError(
            "sensors.common-sampling-unknown",
            quantity="sampling",
            sampling=sampling,
            word=str(sampling),
            known=SAMPLINGS,
        )
    if not (finite(rate) and rate > 0.0):
        raise ConfigError("sensors.common-rate-not-positive", quantity="rate", rate=rate)
    if reference is not None and reference not in names:
        raise ConfigError(
            "sensors.reference-unit-not-among",
            quantity="reference",
            reference=reference,
            word=reference,
            known=names,
        )


def check_rate(rate: float, steps: Sequence[float]) -> None:
    """Refuse common stamps that no record has anything to say of.

    Parameters
    ----------
    rate : float, Hz
    steps : sequence of float, s
        Of the records.

    Raises
    ------
    ConfigError
        The rate is more than ten times that of the fastest.
    """
    fastest = 1.0 / min(steps)
    if rate > MOST_FASTER * fastest:
        raise ConfigError(
            "sensors.hz-more-than-times-hz",
            quantity="rate",
            rate=rate,
            most_faster=MOST_FASTER,
            fastest=fastest,
        )


def compare_sizes(
    units: Sequence[tuple[TriadChannels | None, tuple[TriadChannels, ...]]],
) -> list[Finding]:
    """Compare what units of one rigid body measured, for units of measurement.

    Parameters
    ----------
    units : sequence of (gyro or None, accelerometers)

    Returns
    -------
    list of Finding
        Specific forces that differ by about 9.8.

    Raises
    ------
    DataError
        Rates differ by about 57, and they are the same everywhere on the body.
    """
    turning = [(gyro.source, _spread(gyro)) for gyro, _ in units if gyro is not None]
    for one, size in turning:
        for other, more in turning:
            if size > 0.0 and DEGREES_APART[0] < more / size < DEGREES_APART[1]:
                raise DataError(
                    "sensors.rates-times-those-same-body",
                    file=other,
                    quantity="gyro",
                    more=more / size,
                    one=one,
                )
    forces = [(force[-1].source, _spread(force[-1])) for _, force in units if force]
    return [
        Finding(
            "sensors.specific-force-varies-times-much",
            file=other,
            quantity="accel",
            more=more / size,
            one=one,
        )
        for one, size in forces
        for other, more in forces
        if size > 0.0 and G_APART[0] < more / size < G_APART[1]
    ]


def _spread(channels: TriadChannels) -> float:
    return math.sqrt(sum(float(g.values.var(axis=0).sum()) for g in channels.groups))
