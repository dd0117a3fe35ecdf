"""What a person should know of a fine alignment."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from strapdown.alignment.fine_result import FineResult
from strapdown.alignment.site import Site
from strapdown.alignment.stationary import velocity_of_noise
from strapdown.constants import DEG_PER_HOUR, STANDARD_GRAVITY
from strapdown.errors import Finding

#: Code of the finding of a body that rocks: no fault, where a coarse alignment lets it.
ROCKS = "alignment.body-rocks"
#: Code of the finding of a bias that is beyond what the data sheet allows; data `sensor`.
BIASED = "alignment.bias-beyond-data-sheet"
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
            "alignment.heading-hardly-observable",
            file=result.source,
            quantity="heading",
            sd=sd,
            lat_deg=site.lat_deg,
            east=east,
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
            ROCKS,
            file=result.source,
            quantity="rocking",
            turn=turn,
            velocity=velocity,
            in_bound=True,
        )
    elif moves:
        yield Finding(
            "alignment.body-moves-between-epochs",
            file=result.source,
            quantity="time",
            velocity=velocity,
            turn=turn,
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
                "alignment.innovations-inconsistent",
                file=result.source,
                quantity=str(table.columns[worst]).removeprefix("nu "),
                name=name,
                mean=mean,
                at=at,
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
                    BIASED,
                    file=result.source,
                    quantity=f"{sensor}_{axis}",
                    sensor=sensor,
                    axis=axis,
                    scale=value * scale,
                    unit=unit,
                    sd=sd * scale,
                )
