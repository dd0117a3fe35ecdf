"""Two channels that should tell the same."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.dsp.running_integral import running_integral
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.sensors.low_pass import low_pass

__all__ = ["RedundantComparison", "compare_redundant"]

Array = NDArray[np.float64]

# Two good sensors side by side share what the structure does; above this each has the ringing
# of its own mount.
BANDWIDTH = 300.0  # Hz
LEAST_CORRELATION = 0.98
# Sensitivities are known to one or two per cent each, and a mount adds its cosine.
GAIN_ERROR = 0.05
INTEGRAL_SHARE = 0.05


@dataclass(frozen=True)
class RedundantComparison:
    """How two channels agree.

    Attributes
    ----------
    correlation : float
        After a low-pass of 300 Hz on both.
    gain : float
        Of the second on the first, by least squares.
    rms_share : float
        Root mean square of the difference over that of the first.
    integral_difference : float
        Greatest difference of the integrals, in the unit times s.
    integral_share : float
        The same over the greatest integral of the first.
    apart_at : float, s, or None
        From when on the integrals differ by more than allowed, to the end.
    findings : tuple of Finding
        Empty where they agree.
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
        """Whether nothing was found."""
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
    """Compare two channels of one place and axis.

    Parameters
    ----------
    a, b : array_like, (n,)
        On the same stamps; where one ends early, both up to there.
    time : array_like, (n,), s
    names : pair of str
        For messages.
    rest_until : float, s, optional
        Each one's mean before this is its zero; left out, they are taken as they are.
    bandwidth : float, Hz
        Of the low-pass before they are compared.
    correlation, gain_error, integral_share : float
        What is allowed: the least correlation, the greatest error of the gain, and of the
        integral as a share of its greatest size.

    Returns
    -------
    RedundantComparison
        Which of the two is wrong cannot be told from two alone; a third, or `channel_health`,
        can.

    Raises
    ------
    DataError
        The shapes disagree, a value is not finite, or the first does not move at all.
    ConfigError
        The bandwidth is none.
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
    """Beginning of the last stretch over the limit, if it goes on to the end."""
    within = np.flatnonzero(apart <= limit)
    if not within.size:
        return float(time[0])
    if within[-1] == time.size - 1:
        return None
    return float(time[within[-1] + 1])
