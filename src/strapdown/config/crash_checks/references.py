"""What else is known of a crash: a path, or a change of velocity, and not both in one."""

from __future__ import annotations

from strapdown.config.crash_case import CaseSpec
from strapdown.config.crash_checks.units import check_names
from strapdown.config.crash_checks.written import Written

__all__ = ["check_references"]

_NO_USE = {
    "path": ("delta_v_m_per_s", "delta_v_sd_m_per_s", "axis", "over_s"),
    "delta_v": ("path",),
}
_NEEDED = {"path": "path", "delta_v": "delta_v_m_per_s"}
_UNUSED = {
    "path": "config.reference-path-no-use",
    "delta_v": "config.reference-delta-v-no-use",
}
# No crash on a road changes a velocity by more.
MOST = 90.0  # m/s


def check_references(spec: CaseSpec, written: Written) -> None:
    """Check the references.

    Raises
    ------
    ConfigError
        One lacks what its kind needs, has what it has no use for, or two have one name.
    """
    check_names("references", [r.name for r in spec.references], written)
    for k, reference in enumerate(spec.references):
        at = ("references", k)
        for name in _NO_USE[reference.kind]:
            if written.has(*at, name):
                raise written.contradiction((*at, name), (*at, "kind"), _UNUSED[reference.kind])
        needed = _NEEDED[reference.kind]
        if getattr(reference, needed) is None:
            raise written.missing(
                (*at, needed), "config.reference-value-missing", kind=reference.kind
            )
        change = reference.delta_v_m_per_s
        if change is None:
            continue
        if abs(change) > MOST:
            raise written.refuse(
                (*at, "delta_v_m_per_s"), "config.delta-v-too-large", change=3.6 * change
            )
        if reference.axis == "resultant" and change < 0.0:
            raise written.contradiction(
                (*at, "delta_v_m_per_s"), (*at, "axis"), "config.resultant-with-sign"
            )
        if reference.over_s is not None and not reference.over_s[0] < reference.over_s[1]:
            raise written.refuse((*at, "over_s"), "config.reference-end-before-begin")
