"""What a person should know of a fine alignment."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from strapdown.alignment.fine_result import FineResult
from strapdown.alignment.site import Site
from strapdown.alignment.stationary import velocity_of_noise
from strapdown.constants import DEG_PER_HOUR, STANDARD_GRAVITY
from strapdown.exceptions import Finding

#: Quantity of the finding of a body that rocks: no fault, where a coarse alignment lets it.
ROCKS = "rocking"
# A heading less sure than this is no north.
NO_NORTH = 5.0  # deg
# Of what it was before, where a filter has found nothing.
UNCHANGED = 0.5
# What people, wind and an engine do to a parked vehicle stays below.
MOST_VELOCITY = 0.05  # m/s
MOST_TURN = 0.5  # deg from epoch to epoch
# Over what the noise of the sensors makes of a body that stands still.
OVER_NOISE = 3.0
# Of a normal distribution one in 16 000 is beyond four standard deviations.
BEYOND = 4.0
# Mean square of the innovations over what was expected; by epochs that are not all independent.
INCONSISTENT = 3.0


def fine_findings(result: FineResult, site: Site) -> tuple[Finding, ...]:
    """Say what does not hold, and what the sensors could not tell.

    Parameters
    ----------
    result : FineResult
    site : Site

    Returns
    -------
    tuple of Finding
    """
    return (
        *_north(result, site),
        *_stands(result),
        *_fits(result),
        *_biases(result),
    )


def _north(result: FineResult, site: Site) -> Iterator[Finding]:
    sd = float(result.alignment.sd_deg[2])
    if sd > min(NO_NORTH, UNCHANGED * result.prior_heading_sd_deg) and not result.heading_given:
        east = float(np.linalg.norm(site.earth_rate[:2])) * DEG_PER_HOUR
        yield Finding(
            f"heading is known to ± {sd:.3g} deg only (one standard deviation): the horizontal "
            f"rate of the Earth at {site.lat_deg:.4g} deg of latitude is {east:.3g} deg/h, and the "
            "gyros' biases are not much smaller, or unknown",
            file=result.source,
            quantity="heading",
            remedy="state the heading, turn the body by 180 deg about the vertical and align "
            "again, or use gyros of a better grade",
        )


def _stands(result: FineResult) -> Iterator[Finding]:
    velocity = float(result.standing.velocity.max())
    turn = float(np.degrees(result.standing.turn.max()))
    model = result.filter.model
    noise = velocity_of_noise(
        model.gyro_noise, model.accel_noise, result.interval, len(result.history) - 1
    )
    moves = velocity > max(MOST_VELOCITY, OVER_NOISE * noise)
    if not moves and turn > MOST_TURN:
        yield Finding(
            f"the body rocks: from epoch to epoch it turns by {turn:.3g} deg, and stays at its "
            f"place within {velocity:.2g} m/s (one standard deviation): this is in the stated "
            "uncertainty",
            file=result.source,
            quantity=ROCKS,
            remedy="nothing, where it is known to rock; a body that stands is aligned sooner",
        )
    elif moves:
        yield Finding(
            f"the body does not stand: from epoch to epoch it moves by {velocity:.3g} m/s and "
            f"turns by {turn:.3g} deg (one standard deviation)",
            file=result.source,
            quantity="time",
            remedy="cut the record to where the body stands; if it was parked, its estimates are "
            "weaker by this motion, and their standard deviations say by how much",
        )


def _fits(result: FineResult) -> Iterator[Finding]:
    for name, table in result.innovations.items():
        # The first tenth is where the filter settles.
        late = table.iloc[len(table) // 10 :]
        parts = len(table.columns) // 3
        nu, s = late.iloc[:, :parts].to_numpy(), late.iloc[:, parts : 2 * parts].to_numpy()
        share = np.square(nu) / s
        worst = int(share.mean(axis=0).argmax())
        mean = float(share[:, worst].mean())
        if mean > INCONSISTENT:
            at = float(late.index[int(share[:, worst].argmax())])
            yield Finding(
                f"observation '{name}' is {mean:.3g} times as far from what was expected, squared, "
                f"as its uncertainty allows, most of all at {at:.6g} s",
                file=result.source,
                quantity=str(table.columns[worst]).removeprefix("nu "),
                remedy="look at the record there: a push, a step, a burst of outliers; or at the "
                "sensors, if they are better or worse than was stated",
            )


def _biases(result: FineResult) -> Iterator[Finding]:
    gyro, accel = result.filter.model.sensors[:2]
    for block, found, unit, scale in (
        (gyro, result.alignment.gyro_bias, "deg/h", DEG_PER_HOUR),
        (accel, result.alignment.accel_bias, "mg", 1e3 / STANDARD_GRAVITY),
    ):
        assert found is not None
        for axis, value, sd in zip("xyz", found.tolist(), block.sd.tolist(), strict=True):
            if abs(value) > BEYOND * sd:
                sensor = block.block.name.split("_")[0]
                yield Finding(
                    f"{sensor} {axis} reads {value * scale:.3g} {unit} too much, and its data "
                    f"sheet gives ± {sd * scale:.3g} {unit} (one standard deviation)",
                    file=result.source,
                    quantity=f"{sensor}_{axis}",
                    remedy="a channel that is dead, stuck or exchanged shows like this, and so do "
                    "a wrong unit or another sensor than was stated",
                )
