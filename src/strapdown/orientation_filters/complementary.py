"""The complementary orientation filter: as few operations a sample as a filter can have."""

from __future__ import annotations

from dataclasses import dataclass

from strapdown._kernels import orientation as kernel
from strapdown.orientation_filters.filter import OrientationEstimator


@dataclass(frozen=True)
class Complementary(OrientationEstimator):
    """Rates, pulled towards the vertical of the specific force and the north of the field.

    The error is the cross product of the down axis and the specific force, and the sine of the
    magnetic heading about the down axis; divided by a time constant it is added to the rate, and
    its integral is the gyro bias. At the start the time constants are the time since then.
    The correction is linear in the specific force, whatever its size, so that accelerations that
    average to zero leave no tilt; a gate or a normalization would rectify them. No standard
    deviation is stated.

    Parameters
    ----------
    tilt : float, s
        Time constant of roll and pitch.
    heading : float, s
        Time constant of the heading.
    bias : float, s
        Time constant of the bias: it is the integral of the correction, divided by this.

    declination : float, deg
        Of magnetic north, east positive: added to headings found with a magnetometer.

    Notes
    -----
    The explicit complementary filter of Mahony, Hamel and Pflimlin, IEEE Trans. Automatic Control
    53 (2008) 1203, Eq. (32), with the magnetic error projected on the vertical.
    """

    name = "complementary"
    title = "Complementary filter"
    source = "Mahony, Hamel, Pflimlin (2008) (32)"
    summary = "rates pulled towards vertical and north; fewest operations; no covariance"
    size = kernel.COMPLEMENTARY
    row = 4
    advance_kernel = staticmethod(kernel.complementary_advance)
    update_kernel = staticmethod(kernel.complementary_update)

    tilt: float = 3.0
    heading: float = 5.0
    bias: float = 60.0

    def kernel_options(self) -> tuple[float, ...]:
        """Return the three time constants, s."""
        return self.tilt, self.heading, self.bias
