"""How a case is computed: windows that can be, and models that there are."""

from __future__ import annotations

from collections.abc import Sequence

from strapdown.config.crash_case import CaseSpec
from strapdown.config.crash_checks.written import Written

__all__ = ["check_options"]

# A path of the crash is told, and not a drive.
LONGEST_WINDOW = 60.0  # s
LONGEST_PEAK = 1.0  # s
#: Of the Earth, from the equator at height to the poles.
GRAVITY = (9.7, 9.9)  # m/s²


def check_options(spec: CaseSpec, written: Written) -> None:
    """Check the options.

    Raises
    ------
    ConfigError
        A window or gravity cannot be, or a model of severity is not known.
    """
    _windows(spec, written)
    options = spec.options
    if not GRAVITY[0] < options.gravity_m_per_s2 < GRAVITY[1]:
        raise written.refuse(
            ("options", "gravity_m_per_s2"),
            "config.gravity-out-of-range",
            gravity_m_per_s2=options.gravity_m_per_s2,
        )
    for k, name in enumerate(options.severity or ()):
        _model(k, name, options.severity or (), written)


def _windows(spec: CaseSpec, written: Written) -> None:
    at, peak_at = ("options", "window_s"), ("options", "peak_window_s")
    window, peak = spec.options.window_s, spec.options.peak_window_s
    if peak > LONGEST_PEAK:
        raise written.refuse(peak_at, "config.peak-window-too-long", peak=peak)
    if window is not None:
        start, end = window
        if not start < end:
            raise written.refuse(at, "config.window-end-before-begin")
        if end - start > LONGEST_WINDOW:
            raise written.refuse(at, "config.window-too-long", end=end - start)
        if end <= 0.0:
            raise written.refuse(at, "config.window-before-trigger")
        if peak > end - start:
            first, second = (peak_at, at) if written.has(*peak_at) else (at, peak_at)
            raise written.contradiction(
                first, second, "config.peak-window-longer-than-window", default=peak
            )


def _model(number: int, name: str, names: Sequence[str], written: Written) -> None:
    # Models come with the computation; a command that reads no case does not load them.
    from strapdown.crash.severity import SEVERITY_MODELS

    if name not in SEVERITY_MODELS:
        raise written.refuse(
            ("options", "severity", number),
            "config.unknown-severity-model",
            word=name,
            known=SEVERITY_MODELS,
        )
    if name in names[:number]:
        raise written.refuse(("options", "severity", number), "config.severity-model-repeated")
