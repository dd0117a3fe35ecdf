"""How the log of a second sensor on the same body lies to the first."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["SecondLog"]

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class SecondLog:
    """How the log of a second sensor on the same body lies to the first.

    The model is ``omega_1(t) = scale R_12 omega_2(u) + bias`` with
    ``u = t + offset + drift (t - middle)``; every ``sd`` is one standard deviation from the
    residuals, with their correlation in time.

    Attributes
    ----------
    start, end : float, s
        What both logs cover, on the first one's clock.
    middle : float, s
        Instant of the first clock for which `offset` holds.
    offset, offset_sd : float, s
        Second clock less first clock.
    drift_ppm, drift_sd_ppm : float
        How much faster the second clock runs, in parts per million.
    mounting : tuple of four float
        ``q_12``: turns a vector from the second sensor's axes into the first one's.
    mounting_deg : tuple of float, deg
        The same as roll, pitch, heading.
    mounting_sd_deg : tuple of float, deg
        About the first sensor's axes; infinite where it cannot be told.
    bias, bias_sd : tuple of float, rad/s
        Bias of the first less (scaled, turned) bias of the second, in the first one's axes.
    scale, scale_sd : float
        Scale of the first over that of the second.
    axis : tuple of float or None
        Where the body turned about one axis only: that axis, in the first sensor's axes. The
        mounting about it is then the least turn that fits, and not known.
    correlation : float
        Share of the rates that the two have in common at the coarse offset, 1 at best.
    runner_up : float
        The same for the best other offset.
    residual : float, rad/s
        Root mean square of what is left, all axes together, after smoothing.
    smoothing : float, s
        Standard deviation of the Gaussian that both were smoothed with before the fit.
    cells : int
        Points that were fitted.
    """

    start: float
    end: float
    middle: float
    offset: float
    offset_sd: float
    drift_ppm: float
    drift_sd_ppm: float
    mounting: tuple[float, float, float, float]
    mounting_deg: Triple
    mounting_sd_deg: Triple
    bias: Triple
    bias_sd: Triple
    scale: float
    scale_sd: float
    axis: Triple | None
    correlation: float
    runner_up: float
    residual: float
    smoothing: float
    cells: int
