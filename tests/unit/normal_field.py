"""The exact normal field of a level ellipsoid, in high precision: independent of the package.

The closed form in ellipsoidal coordinates (Heiskanen and Moritz 1967, sec. 2-7), differentiated
numerically in 40 digits.
"""

from __future__ import annotations

from mpmath import mp, mpf

mp.dps = 40


class NormalField:
    """Potential and its gradients, from the four figures that define a level ellipsoid."""

    def __init__(self, ellipsoid):
        self.a, inverse_flattening, self.gm, self.rate = (
            mpf(repr(number))
            for number in (
                ellipsoid.semi_major_axis,
                ellipsoid.inverse_flattening,
                ellipsoid.gravitational_constant,
                ellipsoid.rotation_rate,
            )
        )
        self.b = self.a * (1 - 1 / inverse_flattening)
        self.e2 = 1 - self.b**2 / self.a**2
        self.linear = mp.sqrt(self.a**2 - self.b**2)

    def _q(self, u):
        t = self.linear / u
        return ((1 + 3 / t**2) * mp.atan(t) - 3 / t) / 2

    def attraction_potential(self, p, z):
        """Of the masses alone, at distance p from the axis: their Eqs. (2-58), (2-62)."""
        d = p**2 + z**2 - self.linear**2
        u = mp.sqrt((d + mp.sqrt(d**2 + 4 * self.linear**2 * z**2)) / 2)
        legendre = (z / u) ** 2 - mpf(1) / 3
        spin = self.rate**2 * self.a**2 / 2 * self._q(u) / self._q(self.b)
        return self.gm / self.linear * mp.atan(self.linear / u) + spin * legendre

    def meridian_place(self, lat_deg, alt):
        """Distance from the axis, and from the equator, of a geodetic place."""
        s, c = self._angles(lat_deg)
        n = self.a / mp.sqrt(1 - self.e2 * s**2)
        return (n + alt) * c, (n * (1 - self.e2) + alt) * s

    def ecef(self, lat_deg, lon_deg, alt):
        """Earth-centered x, y, z, rounded once."""
        p, z = self.meridian_place(lat_deg, mpf(alt))
        s, c = self._angles(lon_deg)
        return [float(p * c), float(p * s), float(z)]

    def gravitation(self, lat_deg, alt):
        """North and down components of the gradient of the attraction's potential."""
        p, z = self.meridian_place(lat_deg, mpf(alt))
        return self._north_down(
            lat_deg,
            mp.diff(lambda x: self.attraction_potential(x, z), p),
            mp.diff(lambda x: self.attraction_potential(p, x), z),
        )

    def gravity(self, lat_deg, alt):
        """North and down components of the gradient of the whole potential."""
        p, z = self.meridian_place(lat_deg, mpf(alt))

        def potential(p, z):
            return self.attraction_potential(p, z) + (self.rate * p) ** 2 / 2

        return self._north_down(
            lat_deg,
            mp.diff(lambda x: potential(x, z), p),
            mp.diff(lambda x: potential(p, x), z),
        )

    def _north_down(self, lat_deg, along_p, along_z):
        s, c = self._angles(lat_deg)
        return c * along_z - s * along_p, -c * along_p - s * along_z

    @staticmethod
    def _angles(degrees):
        angle = mp.radians(mpf(float(degrees)))
        return mp.sin(angle), mp.cos(angle)
