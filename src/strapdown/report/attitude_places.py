"""Places and a second log, in words and numbers."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from strapdown.report.attitude_tables import TextTable
from strapdown.results.attitude_bench import AttitudeBench
from strapdown.results.second_log import SecondLog


def place_table(bench: AttitudeBench) -> TextTable | None:
    """Return how far dead-reckoned places are from what is known of them.

    Parameters
    ----------
    bench : AttitudeBench

    Returns
    -------
    TextTable or None
        None where no place was named.
    """
    if not bench.places:
        return None
    rows = tuple(
        (
            place.algorithm,
            place.against,
            f"{place.error_m:.3g}",
            f"{place.sd_m:.2g}",
            f"{place.corrected_error_m:.3g}",
            f"{place.corrected_sd_m:.2g}",
            f"{place.end_velocity_m_s:.3g}",
        )
        for place in bench.places
    )
    legs = max(place.legs for place in bench.places)
    return TextTable(
        "Places, dead-reckoned between rests",
        (
            *("algorithm", "known", "error, m", "1σ, m", "stopped, m", "1σ, m"),
            "left at the rest, m/s",
        ),
        rows,
        text=(0, 1),
        note=f"Over at most {legs} stretch{'es' if legs > 1 else ''} between rests. Stopped: with "
        "the velocity at the end of each brought to zero. The 1σ is what assumed biases, tilt and "
        "noise of a consumer sensor lead to; scale factors are not in it.",
    )


def offer_lines(bench: AttitudeBench) -> list[str]:
    """Rests that look alike, as reference points that could be given."""
    return [
        f"--reference '{offer.words}' ({offer.apart_deg:.2g}° apart by gravity, 1σ "
        f"{offer.sd_deg:.2g}°; {offer.caveat})"
        for offer in bench.offers[:4]
    ]


def places_json(bench: AttitudeBench) -> dict[str, Any]:
    """Places, offers and the second log as plain data."""
    return {
        "places": [asdict(place) for place in bench.places],
        "offered_references": [asdict(offer) for offer in bench.offers],
        "second_log": None if bench.second is None else _second_json(bench.second),
    }


# The unit of each figure stands in its key.
_UNITS = {
    **dict.fromkeys(("start", "end", "middle", "offset", "offset_sd", "smoothing"), "_s"),
    **dict.fromkeys(("bias", "bias_sd", "residual"), "_rad_per_s"),
}


def _second_json(second: SecondLog) -> dict[str, Any]:
    return {key + _UNITS.get(key, ""): value for key, value in asdict(second).items()}
