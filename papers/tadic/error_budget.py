"""What makes the errors of Fig. 9, and the paper's words on their causes."""

from __future__ import annotations

import numpy as np
import pandas as pd

from papers.reproduction import (
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Evidence,
    Statement,
    Table,
    amount,
)
from papers.tadic.experiment import AXES, IMUS, LABS, Experiments
from strapdown.tables import NED


def budget(made: Experiments, names: tuple[str, ...]) -> pd.DataFrame:
    """Mean variance that each contributor adds to the place after 750 ms, m²."""
    parts = [e.platform(n).path.variances()[NED] for e in made.all for n in names]
    return pd.concat(parts).groupby(level=0, sort=False).sum() / len(parts)


def budget_table(made: Experiments) -> Table:
    """Standard deviations that each contributor adds, for both kinds of platforms."""
    labs, imus = budget(made, LABS), budget(made, IMUS)
    names = list(dict.fromkeys([*imus.index, *labs.index]))
    rows: list[tuple[str, tuple[float | None, ...]]] = []
    for name in names:
        cells: list[float | None] = []
        for part in (labs, imus):
            have = name in part.index
            own = part.loc[name].to_numpy(dtype=np.float64) if have else None
            cells += [None] * 3 if own is None else (1e3 * np.sqrt(own)).tolist()
        rows.append((str(name), tuple(cells)))
    sums = [1e3 * float(np.sqrt(v)) for part in (labs, imus) for v in part.sum().tolist()]
    rows.append(("all", tuple(sums)))
    return Table(
        "fig9-budget",
        "Fig. 9: what makes the errors",
        "Standard deviations in mm that each contributor adds to the place after 750 ms, as the "
        "reconstruction tells them; quadratic mean over the experiments.",
        ("contributor", *(f"{kind}, {a}" for kind in ("LAB", "IMU") for a in AXES)),
        tuple(rows),
    )


def error_causes(made: Experiments) -> Statement:
    """Judge alignment, biases and scale factors as the causes."""
    return causes_from(_shares(made, IMUS), _shares(made, LABS))


def _shares(made: Experiments, names: tuple[str, ...]) -> dict[str, float]:
    """Shares of the variance of the place, all axes together, %."""
    total = budget(made, names).sum(axis=1)
    groups = {
        "levelling": ("levelling",),
        "axes": ("misalignment", "gyro misalignment", "mounting"),
        "biases": ("accelerometer bias", "gyro bias"),
        "scale factors": ("scale factor", "gyro scale factor"),
        "bends": ("nonlinearity", "gyro nonlinearity", "gyro g-sensitivity"),
        "entry speed": ("entry speed",),
    }
    return {
        group: 100.0 * float(total.reindex(lines).fillna(0.0).sum() / total.sum())
        for group, lines in groups.items()
    }


def causes_from(imu: dict[str, float], lab: dict[str, float]) -> Statement:
    """Judge from the shares of the variance, %."""
    named = imu["levelling"] + imu["axes"] + imu["biases"] + imu["scale factors"]
    if not (named > 50.0 and imu["biases"] > 5.0 and imu["scale factors"] > 5.0):
        verdict, condition = DOES_NOT_HOLD, ""
    elif imu["levelling"] > 5.0:
        verdict, condition = HOLDS, ""
    else:
        verdict = HOLDS_WHEN
        condition = (
            "the alignment of the IMUs means how their axes lie in the car; the levelling, for "
            "which time was short, counts for the laboratory's platforms alone, which began 100 ms "
            "before the impact"
        )
    return Statement(
        "error-causes",
        "Section 4",
        "As testing was limited to a very short time of the initial sensor platform alignment, "
        "among causes of errors there are surely imperfect alignment and inaccurate removal of "
        "sensor biases and the scale factors.",
        verdict,
        condition,
        "Shares of the variance of the place after 750 ms, all axes together, as the "
        "reconstruction tells them. The table has them by axis: scale factors lead along the "
        "vehicle, axes and mounting across, the bias that no rest tells from gravity downward.",
        tuple(
            Evidence(f"{kind}: {name}", share, "%")
            for kind, shares in (("IMU", imu), ("LAB", lab))
            for name, share in shares.items()
        ),
        "fig9",
    )


def extra_sources(made: Experiments) -> Statement:
    """Judge nonlinearity and sensitivity to g."""
    imus = budget(made, IMUS).sum(axis=1)
    parts = {
        name: float(np.sqrt(imus[line])) if line in imus.index else 0.0
        for name, line in (
            ("nonlinearity of the accelerometers", "nonlinearity"),
            ("nonlinearity of the gyros", "gyro nonlinearity"),
            ("sensitivity of the gyros to g", "gyro g-sensitivity"),
        )
    }
    return extra_from(parts, float(np.sqrt(imus.sum())))


def extra_from(parts: dict[str, float], whole: float) -> Statement:
    """Judge from what each adds to the place after 750 ms, m, and all errors together."""
    added = float(np.sqrt(sum(p * p for p in parts.values())))
    share = 100.0 * (added / whole) ** 2
    if share > 10.0:
        verdict, condition = HOLDS, ""
    elif added > 0.0:
        verdict = HOLDS_WHEN
        condition = (
            f"no more than their presence is meant: they are {amount(share, '%')} of the variance "
            "after 750 ms"
        )
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "extra-sources",
        "Section 2.2",
        "At crash conditions, nonlinearity and “g-sensitivity” are extra error sources.",
        verdict,
        condition,
        "Standard deviations that the budget of the IMUs has for them, with the data sheets' 0.5 % "
        "and 1 % of full scale and 0.1°/s per g.",
        (
            *(Evidence(n, 1e3 * p, "mm") for n, p in parts.items()),
            Evidence("all errors", 1e3 * whole, "mm"),
            Evidence("share of the variance", share, "%"),
        ),
    )
