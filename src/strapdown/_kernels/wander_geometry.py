"""How the level lies on the ellipsoid, by the Earth's axis in its axes: regular at the poles."""

from __future__ import annotations

from numba import njit


@njit(cache=True, inline="always")
def earth_axis(w, x, y, z):
    """Components in w of the unit vector of the Earth's axis, from q_ew."""
    return 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w + z * z - (x * x + y * y)


@njit(cache=True, error_model="numpy", inline="always")
def curving(w, alt, a, e2):
    """N + h, the derivative of N s by s, and the curvatures across and along the meridian.

    N is the radius of the prime vertical, `w` that over a, s the sine of the latitude; the
    curvatures are those of the level surface at the height h.
    """
    prime = a * w
    slope = prime * w * w
    return prime + alt, slope, 1.0 / (prime + alt), 1.0 / (slope * (1.0 - e2) + alt)


@njit(cache=True, error_model="numpy", inline="always")
def shift(kx, ky, s, w, far, slope, across, curvature, e2, rx, ry, rz):
    """Tilt of the normal, as tangents along xi and eta, and rise, by a straight way r.

    A point of normal n and height h is ``(N + h) n - e² N s p``, p the Earth's axis and s = p . n.
    So the new normal is along ``(N + h) zeta + r + e² d p`` with d the change of N s, of which the
    first three orders in r are taken: what is left out is of ``e² (r/R)⁴`` and ``e⁴ (r/R)³``.
    `far` is N + h, the rest as of `curving`.
    """
    north = kx * rx + ky * ry
    sine = curvature * north
    per = e2 * slope * curvature
    pull = per * north
    u = (rz + pull * s) * across
    tx, ty = (rx + pull * kx) * across, (ry + pull * ky) * across
    t2 = tx * tx + ty * ty
    lost = 0.5 * t2
    # The second and the third order of the change of s, but for what d's own have on it: that is
    # the factor (N + h) / (M + h).
    more = u * (u * sine + s * t2 - sine) - lost * (s + sine)
    sine += more
    bend = 1.5 * e2 * w * w * s * sine * sine
    pull = per * (north + far * (more + bend))
    u = (rz + pull * s) * across
    inverse = across * ((1.0 - u) * (1.0 + u * u))
    tx, ty = (rx + pull * kx) * inverse, (ry + pull * ky) * inverse
    t2 = tx * tx + ty * ty
    rise = rz + (far + rz + pull * s) * t2 * (0.5 - 0.125 * t2) - 0.5 * e2 * slope * sine * sine
    return tx, ty, t2, rise


@njit(cache=True, inline="always")
def tilt(tx, ty, t2):
    """Quaternion from the new w to the old one, less 1, of a tilt by tangents; its zeta is 0."""
    half = 0.5 - t2 * (0.1875 - 0.12109375 * t2)
    return -t2 * (0.125 - 0.0859375 * t2), -ty * half, tx * half


@njit(cache=True, inline="always")
def level_with(tx, ty, t2, x, y, z):
    """Vector in the new w, of one in the old, as `tilt` turns it; up to the sixth order."""
    less = 0.5 - 0.375 * t2
    along = tx * x + ty * y
    lean = z - t2 * less * z + less * along
    return x - tx * lean, y - ty * lean, (1.0 - t2 * less) * (z + along)
