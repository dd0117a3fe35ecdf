"""The attitude bench as plain data."""

from __future__ import annotations

import math
from typing import Any

from strapdown.report import attitude_words as words
from strapdown.report.attitude_answer_charts import share_basis
from strapdown.report.attitude_places import places_json
from strapdown.report.attitude_tables import source_of
from strapdown.results.answer import Cost, Share
from strapdown.results.attitude_bench import AttitudeBench
from strapdown.results.scores import Score
from strapdown.tables import EULER, QUATERNION

__all__ = ["attitude_json"]


def attitude_json(bench: AttitudeBench) -> dict[str, Any]:
    """Return a bench as plain data; every key carries its unit.

    Parameters
    ----------
    bench : AttitudeBench

    Returns
    -------
    dict
    """
    costs = {cost.algorithm: _cost(cost) for cost in bench.costs}
    shares = {share.algorithm: _share(share) for share in bench.shares}
    return {
        "schema": "strapdown attitude 1",
        "source": bench.source,
        "description": bench.description,
        "conventions": dict(words.CONVENTIONS),
        "initial": bench.initial,
        "gyro_bias": bench.gyro_bias,
        "headline": words.headline(bench),
        "answer": _answer(bench),
        "algorithms": [
            {
                "algorithm": run.algorithm,
                "title": run.title,
                "equations": source_of(run),
                "final": _final(run.attitude.iloc[-1], float(run.attitude.index[-1])),
                "diagnostics": run.diagnostics,
                "scores": [_score(s) for s in bench.scores if s.algorithm == run.algorithm],
                "cost": costs.get(run.algorithm),
                "share": shares.get(run.algorithm),
            }
            for run in bench.runs
        ],
        "share_basis": share_basis(bench),
        "sweep": [_plain(row) for row in bench.sweep.to_dict("records")],
        "trials": _trials(bench),
        "peers": [
            {
                "peer": peer.peer,
                "aiding": peer.aiding,
                "final": _final(peer.attitude.iloc[-1], float(peer.attitude.index[-1])),
                "scores": [_score(s) for s in peer.scores],
            }
            for peer in bench.peers
        ],
        **places_json(bench),
        "sampling_error_deg": _sampling_error(bench),
        "largest_difference_deg": {
            name: {other: float(v) for other, v in row.items()}
            for name, row in bench.differences_deg.iterrows()
        },
        "rests": [
            {
                "start_s": r.start,
                "end_s": r.end,
                "gyro_mean_rad_per_s": r.gyro_mean,
                "gyro_sd_rad_per_s": r.gyro_sd,
                "accel_mean_m_per_s2": r.accel_mean,
            }
            for r in bench.rests
        ],
        "readings": [vars(r) for r in bench.readings],
        "findings": [vars(f) for f in bench.findings],
    }


def _sampling_error(bench: AttitudeBench) -> dict[str, float] | None:
    if bench.sampling_error_deg is None:
        return None
    return dict(zip(("final", "max"), bench.sampling_error_deg, strict=True))


def _final(row: Any, time: float) -> dict[str, float]:
    return (
        {"time_s": time}
        | {q: float(row[q]) for q in QUATERNION}
        | {f"{e}_deg": float(row[e]) for e in EULER}
    )


def _answer(bench: AttitudeBench) -> dict[str, Any]:
    answer = bench.answer
    return {
        "verdict": answer.verdict,
        "sentence": answer.sentence,
        "tolerance_deg": answer.tolerance_deg,
        "algorithm": answer.algorithm,
        "meaning": answer.meaning,
        "rate_hz": answer.rate_hz,
        "why": list(answer.why),
        "helps": list(answer.helps),
    }


def _score(score: Score) -> dict[str, Any]:
    return {
        "against": score.against,
        "time_s": score.time,
        "error_deg": score.error_deg,
        "rms_deg": score.rms_deg,
        "max_deg": score.max_deg,
        "turned_deg": score.turned_deg,
        "expected_deg": score.expected_deg,
        "sd_deg": score.sd_deg,
    }


def _cost(cost: Cost) -> dict[str, float]:
    """Operations and cycles are a sample's; memory is in numbers."""
    return {
        "add_per_sample": cost.add,
        "multiply_per_sample": cost.multiply,
        "divide_per_sample": cost.divide,
        "sqrt_per_sample": cost.sqrt,
        "trig_per_sample": cost.trig,
        "cortex_m4f_cycles_per_sample": cost.cycles,
        "memory_numbers": cost.memory,
    }


def _share(share: Share) -> dict[str, Any]:
    def named(three: tuple[float, float, float]) -> dict[str, Any]:
        return _plain(dict(zip(("final", "rms", "max"), three, strict=True)))

    return {
        "own_deg": named(share.own_deg),
        "sensor_deg": None if share.sensor_deg is None else named(share.sensor_deg),
        "single_deg": named(share.single_deg),
    }


def _trials(bench: AttitudeBench) -> dict[str, Any] | None:
    if bench.trials is None:
        return None
    return {
        "names": list(bench.trials.names),
        "errors": [_plain(row) for row in bench.trials.errors.to_dict("records")],
        "ranking": [_plain(row) for row in bench.trials.ranking.to_dict("records")],
    }


def _plain(row: dict[Any, Any]) -> dict[str, Any]:
    """Without NaN, which JSON has not: what does not apply is null."""
    plain: dict[str, Any] = {}
    for key, value in row.items():
        item = value.item() if hasattr(value, "item") else value
        plain[str(key)] = None if isinstance(item, float) and not math.isfinite(item) else item
    return plain
