"""Reference ellipsoids and their normal gravity, as data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError


@dataclass(frozen=True)
class Ellipsoid:
    """A rotating ellipsoid of revolution with its field of normal gravity.

    Attributes
    ----------
    name : str
    semi_major_axis : float, m
    inverse_flattening : float
    gravitational_constant : float, m³/s²
        Product GM of the Earth with its atmosphere.
    rotation_rate : float, rad/s
    gravity_at_equator, gravity_at_pole : float, m/s²
        Normal gravity on the surface.
    source : str
        Publication of the figures.
    derived : tuple of str
        Names of the attributes that no publication gives to these digits: calculated from the
        others, as `gravity_at_equator` from ``GM/(a b) (1 - m - m e' q0'/(6 q0))`` and
        `gravity_at_pole` from ``GM/a² (1 + m e' q0'/(3 q0))``, with ``m = rate² a² b/GM``
        (Heiskanen and Moritz 1967, Eqs. (2-73), (2-74)), unless `note` says otherwise.
    note : str
        Notes on the figures.
    """

    name: str
    semi_major_axis: float
    inverse_flattening: float
    gravitational_constant: float
    rotation_rate: float
    gravity_at_equator: float
    gravity_at_pole: float
    source: str
    derived: tuple[str, ...] = ()
    note: str = ""

    @property
    def flattening(self) -> float:
        """Flattening ``f = (a - b)/a``."""
        return 1.0 / self.inverse_flattening

    @property
    def semi_minor_axis(self) -> float:
        """Semi-minor axis ``b`` in m."""
        return self.semi_major_axis * (1.0 - self.flattening)

    @property
    def eccentricity_squared(self) -> float:
        """First eccentricity squared, ``f (2 - f)``."""
        return self.flattening * (2.0 - self.flattening)

    @property
    def somigliana(self) -> float:
        """Somigliana's constant ``k = b gamma_p / (a gamma_e) - 1``."""
        return (
            self.semi_minor_axis
            * self.gravity_at_pole
            / (self.semi_major_axis * self.gravity_at_equator)
            - 1.0
        )

    @property
    def centrifugal_ratio(self) -> float:
        """Ratio ``rate² a / gamma_e`` of centrifugal acceleration to gravity at the equator."""
        return self.rotation_rate**2 * self.semi_major_axis / self.gravity_at_equator

    def parameters(self) -> NDArray[np.float64]:
        """The numbers of the kernels, in the order of `_kernels.earth`, (7,)."""
        return np.array(
            [
                self.semi_major_axis,
                self.eccentricity_squared,
                self.gravity_at_equator,
                self.somigliana,
                self.rotation_rate,
                self.flattening,
                self.centrifugal_ratio,
            ]
        )


WGS84 = Ellipsoid(
    name="wgs84",
    semi_major_axis=6378137.0,
    inverse_flattening=298.257223563,
    gravitational_constant=3.986004418e14,
    rotation_rate=7.292115e-5,
    gravity_at_equator=9.7803253359,
    gravity_at_pole=9.8321849379,
    source="NGA.STND.0036_1.0.0_WGS84 (2014), tables 3.1 and 3.6",
)

#: Name to ellipsoid; the first is the default.
ELLIPSOIDS: dict[str, Ellipsoid] = {
    "wgs84": WGS84,
    "grs80": Ellipsoid(
        name="grs80",
        semi_major_axis=6378137.0,
        inverse_flattening=298.257222101,
        gravitational_constant=3.986005e14,
        rotation_rate=7.292115e-5,
        gravity_at_equator=9.7803267715,
        gravity_at_pole=9.8321863685,
        source="Moritz, Geodetic Reference System 1980, J. Geodesy 74 (2000) 128-133",
    ),
    "pz90.11": Ellipsoid(
        name="pz90.11",
        semi_major_axis=6378136.0,
        inverse_flattening=298.25784,
        gravitational_constant=3.986004418e14,
        rotation_rate=7.292115e-5,
        gravity_at_equator=9.7803283584,
        gravity_at_pole=9.8321880050,
        source="GLONASS ICD L1, L2, edition 5.1 (2008), table 3.2; Parametry Zemli 1990 goda "
        "(PZ-90.11), Moscow 2014",
        derived=("gravity_at_equator", "gravity_at_pole"),
        note="The ICD gives 978032.84 mGal at the equator, which is the derived value rounded.",
    ),
    "krassovsky1940": Ellipsoid(
        name="krassovsky1940",
        semi_major_axis=6378245.0,
        inverse_flattening=298.3,
        gravitational_constant=3.986004418e14,
        rotation_rate=7.292115e-5,
        gravity_at_equator=9.78030,
        gravity_at_pole=9.8321551506,
        source="axis and flattening: EPSG 7024; gravity: Helmert 1901-1909, "
        "9.78030 (1 + 0.005302 sin² - 0.000007 sin² 2lat); GM and rate: those of PZ-90.11",
        derived=("gravity_at_pole",),
        note="An ellipsoid without a field of its own: gravity is Helmert's, as is usual with it, "
        "and not what a GM would give. Helmert's formula is in the Potsdam system, 14 mGal above "
        "later absolute values; as published it is within 3.3 mGal of WGS 84's, and it stays so "
        "here. The pole is the formula's; Somigliana's form through both ends differs by at most "
        "1.2 mGal in between.",
    ),
}


def find_ellipsoid(name: str) -> Ellipsoid:
    """Return an ellipsoid by its name.

    Parameters
    ----------
    name : str
        One of `ELLIPSOIDS`.

    Returns
    -------
    Ellipsoid

    Raises
    ------
    ConfigError
        The name is unknown.
    """
    try:
        return ELLIPSOIDS[name.lower()]
    except (AttributeError, KeyError):
        given = name.name if isinstance(name, Ellipsoid) else str(name)
        raise ConfigError(
            "geodesy.no-ellipsoid" if not isinstance(name, str) else "geodesy.no-ellipsoid-2",
            quantity="ellipsoid",
            name=name,
            word=given,
            known=ELLIPSOIDS,
        ) from None
