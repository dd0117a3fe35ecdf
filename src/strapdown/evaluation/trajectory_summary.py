"""The differences of two trajectories in a few numbers."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.evaluation.trajectory_differences import ROTATION_ERROR
from strapdown.tables import EULER, NED, VELOCITY, check_trajectory_error

Array = NDArray[np.float64]

__all__ = ["DifferenceSummary", "QuantityError", "summarise_differences"]


@dataclass(frozen=True)
class QuantityError:
    """Error of one quantity over time.

    Attributes
    ----------
    quantity : str
        A column, or what is made of several: ``horizontal`` and ``position`` (the lengths in two
        and three dimensions), ``horizontal velocity``, ``velocity``, ``rotation`` (the angle
        between the attitudes).
    unit : str
    rms : float
        Over the instants, each with the same weight.
    largest : float
        Of the magnitude.
    largest_at : float, s
        When that is.
    final : float
        With its sign.
    """

    quantity: str
    unit: str
    rms: float
    largest: float
    largest_at: float
    final: float


@dataclass(frozen=True)
class DifferenceSummary:
    """Errors of a trajectory: root mean square, largest, final.

    Attributes
    ----------
    source, reference : str or None
        What was compared with what.
    samples : int
    start, end : float, s
    errors : tuple of QuantityError
    findings : tuple of Finding
        What a person should know about the comparison.
    """

    source: str | None
    reference: str | None
    samples: int
    start: float
    end: float
    errors: tuple[QuantityError, ...]
    findings: tuple[Finding, ...]

    def __getitem__(self, quantity: str) -> QuantityError:
        """Error of one quantity.

        Raises
        ------
        DataError
            There is none of that name.
        """
        for error in self.errors:
            if error.quantity == quantity:
                return error
        raise DataError(
            "evaluation.no-error",
            of_what=quantity,
            word=quantity,
            known=[e.quantity for e in self.errors],
        )

    def to_pandas(self) -> pd.DataFrame:
        """One row a quantity: ``unit rms largest largest_at final``."""
        return pd.DataFrame([vars(e) for e in self.errors]).set_index("quantity")

    @property
    def title(self) -> str:
        """What was compared, over what."""
        named = f"{self.source or 'estimate'} minus {self.reference or 'reference'}"
        span = f"{self.start:.9g} to {self.end:.9g} s, {self.samples} instants"
        return f"{named}, {span}"

    def __str__(self) -> str:
        lines = [self.title, f"{'':24}{'rms':>11}{'largest':>11}{'at s':>11}{'final':>11}"]
        lines += [
            f"{e.quantity + ' ' + e.unit:24}{e.rms:11.4g}{e.largest:11.4g}{e.largest_at:11.6g}"
            f"{e.final:11.4g}"
            for e in self.errors
        ]
        return "\n".join([*lines, *(f"note: {f}" for f in self.findings)])

    def _repr_html_(self) -> str:
        """The table for a notebook."""
        head = "".join(f"<th>{h}</th>" for h in ("", "rms", "largest", "at s", "final"))
        rows = "".join(
            f"<tr><th>{escape(e.quantity)} {escape(e.unit)}</th>"
            + "".join(
                f"<td>{v}</td>"
                for v in (
                    f"{e.rms:.4g}",
                    f"{e.largest:.4g}",
                    f"{e.largest_at:.6g}",
                    f"{e.final:.4g}",
                )
            )
            + "</tr>"
            for e in self.errors
        )
        notes = "".join(f"<div><small>{escape(str(f))}</small></div>" for f in self.findings)
        return (
            f"<div><div><b>{escape(self.title)}</b></div><table><thead><tr>{head}</tr></thead>"
            f"<tbody>{rows}</tbody></table>{notes}</div>"
        )


def summarise_differences(differences: pd.DataFrame) -> DifferenceSummary:
    """Root mean square, largest and final error of each component and of their lengths.

    Parameters
    ----------
    differences : DataFrame
        As `trajectory_differences` returns it, or any TrajectoryError table; without
        ``phi_N phi_E phi_D`` there is no ``rotation``.

    Returns
    -------
    DifferenceSummary

    Raises
    ------
    DataError
        The table is not valid, or has no rows.
    """
    check_trajectory_error(differences)
    if differences.empty:
        raise DataError("evaluation.table-no-rows", file=differences.attrs.get("source"))
    time = differences.index.to_numpy(dtype=np.float64)
    groups = [
        (NED, "m", {"horizontal": NED[:2], "position": NED}),
        (VELOCITY, "m/s", {"horizontal velocity": VELOCITY[:2], "velocity": VELOCITY}),
        (EULER, "deg", {}),
    ]
    if set(ROTATION_ERROR) <= set(differences.columns):
        groups.append((ROTATION_ERROR, "deg", {"rotation": ROTATION_ERROR}))
    errors = []
    for columns, unit, lengths in groups:
        series = {c: differences[c].to_numpy(dtype=np.float64) for c in columns}
        series |= {
            name: np.sqrt(np.square([series[c] for c in parts]).sum(axis=0))
            for name, parts in lengths.items()
        }
        errors += [_error(name, unit, values, time) for name, values in series.items()]
    return DifferenceSummary(
        differences.attrs.get("source"),
        differences.attrs.get("reference"),
        len(time),
        float(time[0]),
        float(time[-1]),
        tuple(errors),
        tuple(differences.attrs.get("findings", ())),
    )


def _error(name: str, unit: str, values: Array, time: Array) -> QuantityError:
    worst = int(np.argmax(np.abs(values)))
    return QuantityError(
        name,
        unit,
        float(np.sqrt(np.mean(np.square(values)))),
        float(abs(values[worst])),
        float(time[worst]),
        float(values[-1]),
    )
