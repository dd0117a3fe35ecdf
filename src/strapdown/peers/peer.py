"""Interface to a filter of another library: samples in, attitudes out, in our conventions."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from importlib import metadata
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown.constants import Array
from strapdown.errors import ConfigError, DataError, DivergenceError, Finding, check_choice
from strapdown.tables import ACCEL, GYRO, MAG, attitude_table, check_imu

AIDINGS = ("gyro", "gyro+accel", "gyro+accel+mag")

# Steps that differ from their mean by more than this fraction are not uniform.
STEADY = 0.01


@dataclass(frozen=True)
class Samples:
    """Samples available to a filter.

    Attributes
    ----------
    dt : ndarray, (n-1,), s
        From each stamp to the next.
    gyro : ndarray, (n, 3), rad/s
    force : ndarray, (n, 3), m/s²
        Specific force; empty, (0, 3), for the gyro alone. Body axes forward-right-down.
    mag : ndarray, (n, 3), µT
        Also empty where it is not used.
    """

    dt: Array
    gyro: Array
    force: Array
    mag: Array


@dataclass(frozen=True)
class PeerFilter:
    """One filter of a library.

    Attributes
    ----------
    compute : dict of str to callable
        For each aiding: function from samples and the initial attitude to ``q_nb``, (n, 4), the
        first row at the first stamp.
    steady : bool
        Whether it supports only a constant rate, and gets the mean rate of the record.
    microseconds : float
        Approximate run time per sample of its slowest aiding; used to decide which filters to
        leave out.
    """

    compute: dict[str, Callable[[Samples, Array], Array]]
    steady: bool
    microseconds: float


@dataclass(frozen=True)
class Peer:
    """Another library.

    Attributes
    ----------
    name : str
        Name of its distribution, its module, and the option value.
    licence : str
    filters : dict of str to PeerFilter
        The first that supports an aiding is the default for it.
    source : str
        Publication of its method.
    """

    name: str
    licence: str
    source: str
    filters: dict[str, PeerFilter]

    @property
    def available(self) -> bool:
        """Whether the library is installed."""
        return importlib.util.find_spec(self.name) is not None

    @property
    def version(self) -> str:
        """Installed version.

        Raises
        ------
        ConfigError
            The library is not installed.
        """
        load(self.name)
        return metadata.version(self.name)

    def label(self, filter_name: str) -> str:
        """Name, version and, if there are several, the filter."""
        chosen = f" {filter_name}" if len(self.filters) > 1 else ""
        return f"{self.name} {self.version}{chosen}"

    def run(
        self, imu: pd.DataFrame, q_nb: ArrayLike, aiding: str, filter_name: str | None = None
    ) -> pd.DataFrame:
        """Run a filter over a record.

        Parameters
        ----------
        imu : DataFrame
            An Imu table; ``mag_x..z`` in µT, body axes, for ``gyro+accel+mag``.
        q_nb : array_like, (4,)
            Attitude at the first stamp.
        aiding : {'gyro', 'gyro+accel', 'gyro+accel+mag'}
        filter_name : str, optional
            One of `filters`; by default the first that supports the aiding.

        Returns
        -------
        DataFrame
            Attitude table on the stamps of `imu`. With a magnetometer the heading is magnetic.
            Except for vqf with an accelerometer, the first row is `q_nb`.

        Raises
        ------
        ConfigError
            The library is not installed, or has no such filter or aiding.
        DataError
            A column that the aiding needs is absent or not finite; or as `tables.check_imu`.
        DivergenceError
            The library failed, or its result is not an attitude.
        """
        load(self.name)
        _known_aiding(aiding)
        offering = [name for name, f in self.filters.items() if aiding in f.compute]
        chosen = filter_name if filter_name is not None else next(iter(offering), "")
        if chosen not in offering:
            raise ConfigError(
                "peers.does-not-run",
                quantity=f"peers: {self.name}",
                chosen=chosen,
                aiding=aiding,
                word=chosen,
                known=offering or AIDINGS,
            )
        samples = samples_for(imu, aiding)
        unit = rotation.normalise(q_nb)
        try:
            q = self.filters[chosen].compute[aiding](samples, unit)
            return attitude_table(imu.index.to_numpy(dtype=np.float64), q, imu.attrs.get("source"))
        except (ValueError, ArithmeticError, np.linalg.LinAlgError, DataError) as error:
            raise DivergenceError(
                "peers.gave-up", quantity=f"{self.label(chosen)}, {aiding}", error=error
            ) from error


def _known_aiding(aiding: str) -> None:
    check_choice("peers.no-aiding", AIDINGS, quantity="aiding", aiding=aiding)


def load(name: str) -> Any:
    """Import a library."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise ConfigError("peers.not-installed", quantity="peers", name=name) from None


def needed_columns(aiding: str) -> list[str]:
    """Columns of the Imu table that an aiding needs."""
    _known_aiding(aiding)
    return (GYRO + ACCEL + MAG)[: 3 * (1 + AIDINGS.index(aiding))]


def samples_for(imu: pd.DataFrame, aiding: str) -> Samples:
    """Extract the data that an aiding needs from an Imu table."""
    check_imu(imu)
    columns = needed_columns(aiding)
    source = imu.attrs.get("source")
    missing = [c for c in columns if c not in imu.columns]
    if missing:
        raise DataError(
            "peers.needs-log",
            file=source,
            quantity=missing[0],
            aiding=aiding,
            missing=missing,
            columns=imu.columns,
        )
    values = imu[columns].to_numpy(dtype=np.float64)
    bad = np.argwhere(~np.isfinite(values))
    if bad.size:
        row, column = (int(i) for i in bad[0])
        raise DataError(
            "peers.not-finite-number",
            file=source,
            row=row + 1,
            quantity=columns[column],
            values=values[row, column],
        )
    blocks = [np.ascontiguousarray(values[:, k : k + 3]) for k in range(0, values.shape[1], 3)]
    blocks += [np.empty((0, 3))] * (3 - len(blocks))
    time = imu.index.to_numpy(dtype=np.float64)
    return Samples(np.diff(time), *blocks)


def steadiness(dt: Array, label: str, source: str | None) -> Finding | None:
    """Report varying steps in s of a record for a library that assumes a constant rate."""
    mean = float(dt.mean())
    off = float(np.abs(dt / mean - 1.0).max())
    if off <= STEADY:
        return None
    return Finding(
        "peers.takes-constant-rate-given-mean",
        file=source,
        quantity="time",
        label=label,
        mean=mean * 1000.0,
        dt=dt.min() * 1000.0,
        dt_2=dt.max() * 1000.0,
    )


def align_heading(q: ArrayLike, known: ArrayLike, row: int = 0) -> Array:
    """Rotate attitudes about the vertical so that one comes nearest to a known one.

    Parameters
    ----------
    q : array_like, (n, 4)
        ``q_nb`` whose heading has an arbitrary zero.
    known : array_like, (4,)
        ``q_nb`` at one instant.
    row : int
        The row of `q` at that instant.

    Returns
    -------
    ndarray, (n, 4)

    Notes
    -----
    The rotation is the twist about down of ``known q*``, ``2 atan2(z, w)``: of all rotations about
    the vertical it leaves the smallest rotation angle. It needs no Euler angles, and is ambiguous
    only where the two differ by half a turn about a level axis.
    """
    rows = np.asarray(q, dtype=np.float64)
    w, _, _, z = rotation.compose(known, rotation.conjugate(rows[row]))
    turn = rotation.quaternion_from_rotation_vector([0.0, 0.0, 2.0 * float(np.arctan2(z, w))])
    return rotation.compose(turn, rows)
