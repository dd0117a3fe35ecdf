"""One unit of a triad, drawn from what is not known of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.sensors.error_draws import Seed, child
from strapdown.sensors.triad_errors import Matrix, Triad, TriadErrors, triad_of
from strapdown.sensors.triad_uncertainty import TriadUncertainty

Array = NDArray[np.float64]

# Places of the quantities in the tree of seeds; a number is never given to another quantity.
BIAS, SCALE, MISALIGNMENT, G_SENSITIVITY, NONLINEARITY, RECTIFICATION = range(6)
# The slope 1 + s + 2 n2 x must stay positive within the range, |x| <= 1; at 0.5 it just vanishes.
MOST_NONLINEARITY = 0.49


def draw_errors(uncertainty: TriadUncertainty, seed: Seed, *streams: int) -> TriadErrors:
    """Draw the errors of one unit.

    Parameters
    ----------
    uncertainty : TriadUncertainty
    seed : int or SeedSequence
        The unit.
    *streams : int
        Place below the seed, where one seed serves several triads.

    Returns
    -------
    TriadErrors
        All draws are normal and independent, each quantity and axis from a stream of its own: a
        spread that is set to zero leaves the other draws as they were. The second order of the
        curve is held to 0.49 of the slope, so that no reading has two inputs; a draw gets there
        only where the standard deviation is tenths of full scale. Noise, range, step and
        low-pass are those of the uncertainty.

    Raises
    ------
    ConfigError
        The draw is no sensor: a scale factor of -1 or less, or angles that sum to a radian.
    """
    bias = _numbers(uncertainty.axis("bias"), seed, *streams, BIAS)[:, 0]
    scale = _numbers(uncertainty.axis("scale"), seed, *streams, SCALE)[:, 0]
    turned = _numbers(uncertainty.axis("misalignment"), seed, *streams, MISALIGNMENT)
    np.fill_diagonal(turned, 0.0)
    pulled = _numbers(uncertainty.axis("g_sensitivity"), seed, *streams, G_SENSITIVITY)
    bent = _numbers(uncertainty.axis("nonlinearity_2"), seed, *streams, NONLINEARITY)[:, 0]
    most = MOST_NONLINEARITY * (1.0 + scale)
    shaken = _numbers(uncertainty.axis("vibration_rectification"), seed, *streams, RECTIFICATION)[
        :, 0
    ]
    return TriadErrors(
        noise_density=uncertainty.noise_density,
        bias=triad_of(bias),
        scale=triad_of(scale),
        misalignment=_matrix(turned),
        g_sensitivity=_matrix(pulled),
        nonlinearity_2=triad_of(np.clip(bent, -most, most)),
        vibration_rectification=triad_of(shaken),
        quantization=uncertainty.quantization,
        full_scale=uncertainty.full_scale,
        bandwidth=uncertainty.bandwidth,
    )


def _numbers(sd: Triad, seed: Seed, *place: int) -> Array:
    """Three numbers an axis, (3, 3), each axis with its standard deviation."""
    rows = np.empty((3, 3))
    for axis in range(3):
        generator = np.random.Generator(np.random.PCG64(child(seed, *place, axis)))
        rows[axis] = sd[axis] * generator.standard_normal(3)
    return rows


def _matrix(rows: Array) -> Matrix:
    return (triad_of(rows[0]), triad_of(rows[1]), triad_of(rows[2]))
