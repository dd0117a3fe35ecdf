"""What is assumed of a recorder: for all that is missing, and for nothing that is there."""

from __future__ import annotations

from strapdown.config.crash_case import AssumedSpec, CaseSpec, TriadSpec, UnitSpec
from strapdown.config.crash_checks.written import Written

__all__ = ["check_assumed"]

AXES = ("x", "y", "z")
MOST_TURN = 45.0  # deg
MOST_CHANGE = 60.0  # m/s
LONGEST = 10.0  # s


def check_assumed(k: int, spec: CaseSpec, written: Written) -> None:
    """Check a unit for axes that are missing.

    Raises
    ------
    ConfigError
        Something is missing and nothing is assumed for it, or the other way round.
    """
    unit = spec.units[k]
    no_force, no_turn = _forces_missing(k, unit, written), _turns_missing(unit)
    assumed = unit.assumed or AssumedSpec()
    if no_force and assumed.delta_v_sd_m_per_s is None:
        raise written.file.refuse(
            ("units", k, "accelerometers", 0, "channels"),
            "config.axis-not-measured",
            axes=no_force,
        )
    if no_turn and assumed.turn_sd_deg is None:
        no_gyro = unit.gyro is None
        raise written.file.refuse(
            ("units", k) if no_gyro else ("units", k, "gyro", "channels"),
            "config.no-gyro" if no_gyro else "config.turn-axis-not-measured",
            axes=no_turn,
        )
    if unit.assumed is not None:
        _check_table(k, unit, assumed, written, bool(no_force), bool(no_turn))


def _check_table(
    k: int, unit: UnitSpec, assumed: AssumedSpec, written: Written, force: bool, turn: bool
) -> None:
    at = ("units", k, "assumed")
    measured = "gyro" if unit.gyro is not None else "gyro_from"
    for name, missing, other, most in (
        ("turn_sd_deg", turn, measured, MOST_TURN),
        ("delta_v_sd_m_per_s", force, "accelerometers", MOST_CHANGE),
    ):
        given = getattr(assumed, name)
        if given is None:
            continue
        if not missing:
            raise written.contradiction(
                (*at, name), ("units", k, other), "config.assumed-though-measured"
            )
        sizes = given if isinstance(given, tuple) else (given,)
        if max(sizes) > most:
            raise written.refuse((*at, name), "config.assumed-sd-too-large", most=most)
    if not force and not turn:
        raise written.contradiction(at, ("units", k, measured), "config.nothing-to-assume")
    if not assumed.because.strip():
        raise written.missing((*at, "because"), "config.reason-of-assumption-missing")
    start, end = assumed.over_s
    if not 0.0 < end - start <= LONGEST:
        raise written.refuse((*at, "over_s"), "config.assumed-span-out-of-range", end=end - start)


def _forces_missing(k: int, unit: UnitSpec, written: Written) -> list[str]:
    first = _missing(unit.accelerometers[0])
    for n, triad in enumerate(unit.accelerometers[1:], start=1):
        if _missing(triad) != first:
            raise written.contradiction(
                ("units", k, "accelerometers", n, "channels"),
                ("units", k, "accelerometers", 0, "channels"),
                "config.range-axes-differ",
            )
    return first


def _turns_missing(unit: UnitSpec) -> list[str]:
    if unit.gyro is not None:
        return _missing(unit.gyro)
    return [] if unit.gyro_from is not None else list(AXES)


def _missing(triad: TriadSpec) -> list[str]:
    return [axis for axis in AXES if axis not in triad.channels]
