"""What no rest can tell, and a filter must not claim: where errors are too large for it."""

from __future__ import annotations

import math

import numpy as np

from strapdown import rotation
from strapdown.alignment.fine_result import FineResult
from strapdown.alignment.site import Site
from strapdown.errors import DataError

__all__ = ["heading_floor_deg", "refuse_false_claims"]

#: Part of the least standard deviation below which a heading is claimed and not found. Rocking, by
#: which the drifts go through other directions, gains less.
CLAIMED = 0.7
#: A body that turns by more than this does not rest at one attitude, and its drifts show.
TURNED_DEG = 30.0
#: So many standard deviations from what it was before, a heading was wrong before.
BEYOND = 4.0
DEG_PER_HOUR = math.degrees(3600.0)


def heading_floor_deg(result: FineResult, site: Site) -> float:
    """Least standard deviation of a heading that a rest can give, however long it is.

    A heading and an east drift look alike, ``b_E = omega cos(lat) psi``, and so the information on
    the heading is what was known before and what is known of the drift:
    ``1/s^2 = 1/s_0^2 + (omega cos(lat) / s_E)^2``.

    Parameters
    ----------
    result : FineResult
    site : Site

    Returns
    -------
    float, deg
    """
    gyro = np.asarray(result.filter.model.sensors[0].sd[:3], dtype=np.float64)
    east = float(np.linalg.norm(rotation.dcm_from_quaternion(result.alignment.q_nb)[1] * gyro))
    across = float(np.linalg.norm(site.earth_rate[:2]))
    before = 1.0 / math.radians(result.prior_heading_sd_deg) ** 2
    found = (across / east) ** 2 if east > 0.0 else math.inf
    return math.degrees(1.0 / math.sqrt(before + found))


def refuse_false_claims(result: FineResult, site: Site) -> None:
    """Refuse a heading that is stated to be better known than the sensors can tell.

    A filter is linear: where biases are so large that the second order of tilt, heading and bias
    is beyond the noise, it takes that for knowledge.

    Parameters
    ----------
    result : FineResult
    site : Site

    Raises
    ------
    DataError
    """
    heading = result.history["heading"].to_numpy()
    moved = float(heading[-1] - heading[0])
    if result.heading_given and abs(moved) > BEYOND * result.prior_heading_sd_deg:
        raise DataError(
            "alignment.heading-contradicted-by-gyros",
            file=result.source,
            quantity="heading",
            moved=moved,
            prior_heading_sd_deg=result.prior_heading_sd_deg,
        )
    if float(np.ptp(heading[len(heading) // 10 :])) > TURNED_DEG:
        return
    floor = heading_floor_deg(result, site)
    sd = float(result.alignment.sd_deg[2])
    if not sd < CLAIMED * floor:
        return
    gyro = DEG_PER_HOUR * float(np.max(result.filter.model.sensors[0].sd[:3]))
    raise DataError(
        "alignment.heading-claimed-beyond-gyros",
        file=result.source,
        quantity="heading",
        sd=sd,
        gyro=gyro,
        floor=floor,
    )
