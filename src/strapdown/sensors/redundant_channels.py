"""Comparison of two redundant channels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.dsp.running_integral import running_integral
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.sensors.low_pass import low_pass

__all__ = ["RedundantComparison", "compare_redundant"]

Array = NDArray[np.float64]

# Two sound adjacent sensors share the structural motion; above this frequency each has the ringing
# of its own mount.
BANDWIDTH = 300.0  # Hz
LEAST_CORRELATION = 0.98
# Sensitivities are known to 1 or 2 % each, and mounting adds its cosine.
GAIN_ERROR = 0.05
INTEGRAL_SHARE = 0.05


@dataclass(frozen=True)
class RedundantComparison:
    """Agreement of two channels.

    Attributes
    ----------
    correlation : float
        After a low-pass of 300 Hz on both.
    gain : float
        Of the second relative to the first, by least squares.
    rms_share : float
        Root mean square difference divided by that of the first.
    integral_difference : float
        Largest difference of the integrals, in the unit times s.
    integral_share : float
        The same divided by the largest integral of the first.
    apart_at : float, s, or None
        Time from which the integrals differ by more than allowed, to the end.
    findings : tuple of Finding
        Empty if they agree.
    """

    correlation: float
    gain: float
    rms_share: float
    integral_difference: float
    integral_share: float
    apart_at: float | None
    findings: tuple[Finding, ...]

    @property
    def agree(self) -> bool:
        """Whether the channels agree."""
        return not self.findings


def compare_redundant(
    a: ArrayLike,
    b: ArrayLike,
    time: ArrayLike,
    *,
    names: tuple[str, str] = ("the first", "the second"),
    rest_until: float | None = None,
    bandwidth: float = BANDWIDTH,
    correlation: float = LEAST_CORRELATION,
    gain_error: float = GAIN_ERROR,
    integral_share: float = INTEGRAL_SHARE,
) -> RedundantComparison:
    """Compare two channels at one point and along one axis.

    Parameters
    ----------
    a, b : array_like, (n,)
        On the same stamps; compared up to the end of the shorter.
    time : array_like, (n,), s
    names : pair of str
        For messages.
    rest_until : float, s, optional
        End of the time whose mean is each channel's zero; if not given, no zero is subtracted.
    bandwidth : float, Hz
        Low-pass applied before the comparison.
    correlation, gain_error, integral_share : float
        Limits: the smallest correlation, the largest gain error, and the largest integral error as
        a fraction of the largest integral.

    Returns
    -------
    RedundantComparison
        Two channels alone do not show which one is faulty; a third, or `channel_health`, can.

    Raises
    ------
    DataError
        The shapes disagree, a value is not finite, or the first channel is constant.
    ConfigError
        The bandwidth is invalid.
    """
    t, first, second = (np.asarray(x, dtype=np.float64) for x in (time, a, b))
    label = f"{names[0]} and {names[1]}"
    if t.ndim != 1 or t.size < 2 or first.shape != t.shape or second.shape != t.shape:
        raise DataError(
            "sensors.shapes-times",
            quantity=label,
            shape=first.shape,
            shape_2=second.shape,
            shape_3=t.shape,
        )
    both = np.column_stack([first, second])
    bad = np.flatnonzero(~np.isfinite(both).all(axis=1))
    if bad.size:
        raise DataError("sensors.compared-not-finite", row=int(bad[0]) + 1, quantity=label)
    if not bandwidth > 0.0:
        raise ConfigError("sensors.bandwidth-hz-none", quantity="bandwidth", bandwidth=bandwidth)
    if rest_until is not None:
        rest = t < rest_until
        if not rest.any():
            raise DataError("sensors.no-sample-before", quantity=label, rest_until=rest_until)
        both = both - both[rest].mean(axis=0)
    x, y = low_pass(t, both, bandwidth).T
    power = float(x @ x)
    if power == 0.0 or not np.any(y):
        raise DataError("sensors.them-zero-throughout", quantity=label)
    found_correlation = float(np.corrcoef(x, y)[0, 1])
    gain = float(x @ y) / power
    difference = y - x
    total = running_integral(t, both)
    apart = np.abs(total[:, 1] - total[:, 0])
    largest = float(np.abs(total[:, 0]).max())
    share = float(apart.max()) / largest if largest else float("inf")
    apart_at = _apart_for_good(t, apart, integral_share * largest)
    findings = []
    if found_correlation < correlation:
        findings.append(
            Finding(
                "sensors.they-correlate-below-hz-least",
                quantity=label,
                found_correlation=found_correlation,
                bandwidth=bandwidth,
                correlation=correlation,
            )
        )
    if abs(gain - 1.0) > gain_error:
        findings.append(Finding("sensors.gain-other", quantity=label, gain=gain))
    if share > integral_share:
        findings.append(
            Finding(
                "sensors.integrals-differ" if apart_at is None else "sensors.integrals-part",
                quantity=label,
                apart=apart.max(),
                share=100 * share,
                since=apart_at,
            )
        )
    return RedundantComparison(
        found_correlation,
        gain,
        float(np.sqrt(difference @ difference / power)),
        float(apart.max()),
        share,
        apart_at,
        tuple(findings),
    )


def _apart_for_good(time: Array, apart: Array, limit: float) -> float | None:
    """Start of the last stretch over the limit, if it continues to the end."""
    within = np.flatnonzero(apart <= limit)
    if not within.size:
        return float(time[0])
    if within[-1] == time.size - 1:
        return None
    return float(time[within[-1] + 1])
