"""Gyro of another unit on the same rigid body, rotated into the borrower's axes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import ConfigError
from strapdown.sensors.crash_unit import CrashUnit, Mounting, RecordedTriad
from strapdown.sensors.triad_errors import Triad, triad_of
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.sensors.unit_clocks import TriadAtStamps
from strapdown.tables import GYRO

Array = NDArray[np.float64]


# A component with a smaller share of an axis is not affected by that axis's range limit.
FEELS = 1e-3


def check_lenders(units: dict[str, CrashUnit]) -> None:
    """Check that every borrowed gyro exists.

    ConfigError: a unit borrows from itself, from an unknown unit, or from one without a gyro.
    """
    for unit in units.values():
        if unit.gyro is not None or unit.gyro_from is None:
            continue
        having = [u.name for u in units.values() if u.gyro is not None]
        if unit.gyro_from not in units:
            raise ConfigError(
                "sensors.lender-unknown" if having else "sensors.mounted-lender-unknown",
                quantity="gyro_from",
                name=unit.name,
                gyro_from=unit.gyro_from,
                word=unit.gyro_from,
                known=having,
            )
        if units[unit.gyro_from].gyro is None:
            raise ConfigError(
                "sensors.lender-without-gyro" if having else "sensors.mounted-lender-without-gyro",
                quantity="gyro_from",
                name=unit.name,
                gyro_from=unit.gyro_from,
                having=having,
            )


def turned_gyro(lent: TriadAtStamps, lender: Mounting, borrower: Mounting) -> TriadAtStamps:
    """Rotate a gyro through both mountings into the borrower's sensor axes.

    `lent`: in the lender's sensor axes. Returns ``ω_b = C_vb^T C_va ω_a``. Standard deviations are
    rotated as for independent axes, ``sd_b² = (C ∘ C) sd_a²``. The range of an axis is the least of
    the contributing ranges, and the axis is clipped where one of those is.
    """
    C_ba = borrower.C_vs.T @ lender.C_vs
    square = C_ba**2
    feels = np.abs(C_ba) > FEELS
    told = turned_uncertainty(lent.triad.uncertainty, C_ba)
    table = lent.triad.table
    turned = pd.DataFrame(table[GYRO].to_numpy() @ C_ba.T, index=table.index, columns=GYRO)
    turned.attrs = dict(table.attrs)
    return TriadAtStamps(
        RecordedTriad(turned, told, lent.triad.name),
        np.sqrt(lent.noise_factor**2 @ square.T),
        np.sqrt(lent.noise**2 @ square.T),
        np.asarray((lent.clipped[:, None, :] & feels).any(axis=2)),
        lent.whole,
        lent.method,
    )


def turned_uncertainty(uncertainty: TriadUncertainty, C: Array) -> TriadUncertainty:
    """Rotate the stated uncertainty of a triad into other axes.

    `C` ((3, 3)): rotates vectors from the axes of the triad into the others. Returns standard
    deviations rotated as for independent axes, ``sd² -> (C ∘ C) sd²``; the range of an axis is the
    least of the contributing ranges.
    """
    square, feels = C**2, np.abs(C) > FEELS

    def turned(name: str) -> Triad:
        return triad_of(np.sqrt(square @ np.square(uncertainty.axis(name))))

    limits = np.array(uncertainty.axis("full_scale"))
    return replace(
        uncertainty,
        noise_density=turned("noise_density"),
        bias=turned("bias"),
        scale=turned("scale"),
        misalignment=turned("misalignment"),
        nonlinearity_2=turned("nonlinearity_2"),
        g_sensitivity=turned("g_sensitivity"),
        vibration_rectification=turned("vibration_rectification"),
        quantization=turned("quantization"),
        full_scale=triad_of(np.where(feels, limits, np.inf).min(axis=1)),
    )
