"""Consistency tests of filter innovations: scale, bias and whiteness."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import MAD_TO_SD
from strapdown.dsp.chi_square import (
    chi_square_above,
    chi_square_below,
    chi_square_quantile,
    normal_above,
    normal_quantile,
)
from strapdown.errors import ConfigError
from strapdown.navigation.innovations import Alarm, InnovationMonitor, Verdict, judge

__all__ = [
    "GROSS",
    "ComponentConsistency",
    "Inconsistency",
    "ObservationConsistency",
    "consistency_of",
    "consistency_of_all",
    "gross_of",
    "inconsistencies",
    "whiteness",
]


Array = NDArray[np.float64]

#: An innovation beyond so many standard deviations, of those that are usual in the run, is a gross
#: error: one in two million normal ones.
GROSS = 5.0
#: Fewer epochs than these allow no test.
FEWEST = 10
#: Lags of the whiteness test, if there are so many epochs for each: with fewer the tail of its
#: distribution is longer than that of chi-square.
LAGS, EPOCHS_A_LAG = 10, 25
#: Probability of the 95 % bounds.
SHARE = 0.95


@dataclass(frozen=True, eq=False)
class ComponentConsistency:
    """Normalized innovations of one component; gross errors left out unless stated.

    Attributes
    ----------
    label : str
        With its unit.
    count, gross : int
        Epochs; those among them with gross errors, which the following figures leave out.
    inside : float
        Share within 1.96 standard deviations.
    scale : float
        Root of their mean square; 1 for a consistent filter.
    scale_bounds : tuple of float
        95 % bounds of the scale for this number of epochs (chi-square).
    bias : float
        Their mean, in standard deviations.
    bias_bound : float
        95 % bound of the magnitude of the bias: ``1.96 / √n``.
    bias_in_unit : float
        Mean of the innovations themselves.
    autocorrelation : ndarray, (lags,)
        Of lags 1, 2, ... epochs, about their mean.
    autocorrelation_bound : float
        95 % bound of each lag alone: ``1.96 / √n``.
    whiteness_p : float
        Probability of as large a sum of their squares for white innovations (`whiteness`).
    lag_p : float
        Probability of as large an autocorrelation of lag 1, ``ρ √n`` as a normal number.
    scale_p, bias_p : float
        Probability of as extreme a scale or bias for a consistent filter.
    """

    label: str
    count: int
    gross: int
    inside: float
    scale: float
    scale_bounds: tuple[float, float]
    bias: float
    bias_bound: float
    bias_in_unit: float
    autocorrelation: Array
    autocorrelation_bound: float
    whiteness_p: float
    lag_p: float
    scale_p: float
    bias_p: float


@dataclass(frozen=True, eq=False)
class ObservationConsistency:
    """Consistency of the innovations of one observation.

    Attributes
    ----------
    name : str
        Of the observation.
    nis : DataFrame
        By time of the epochs: ``nis``, the sum of the squares of the normalized innovations of an
        epoch, ``components``, their number, and ``lower``, ``upper``, its 95 % bounds
        (chi-square). Includes gross errors.
    windows : DataFrame
        By time of the last epoch of each window, one after the other: ``since``, ``epochs``,
        ``nis`` over the components (1 is expected), ``lower``, ``upper``, its 95 % bounds; without
        gross errors.
    inside : float
        Share of the epochs whose NIS is inside its two bounds.
    components : tuple of ComponentConsistency
    alarms : tuple of Alarm
        Detected changes within the run (`InnovationMonitor`).
    verdicts : tuple of Verdict
        Inconsistencies, the most significant first; empty for a consistent observation.
    false_alarm : float
        Probability of any verdict, other than on gross errors, for a consistent filter.
    """

    name: str
    nis: pd.DataFrame
    windows: pd.DataFrame
    inside: float
    components: tuple[ComponentConsistency, ...]
    alarms: tuple[Alarm, ...]
    verdicts: tuple[Verdict, ...]
    false_alarm: float

    @property
    def consistent(self) -> bool:
        """Whether no verdict but on gross errors is left; those are not the filter's fault."""
        return all(one.kind == "gross" for one in self.verdicts)


def consistency_of(
    name: str, innovations: pd.DataFrame, *, window: int = 30, false_alarm: float = 0.01
) -> ObservationConsistency:
    """Test the innovations of an observation against their predicted covariance.

    Components of one epoch are decorrelated one after the other, so that, normalized, they are
    independent with mean 0 and variance 1 if the model is right. This holds for the Kalman update;
    for a robust update it holds as far as gross errors are rare.

    Parameters
    ----------
    name : str
    innovations : DataFrame
        By time in s: ``nu LABEL``, ``s LABEL``, ``weight LABEL`` (`NavigationRecord.innovations`).
    window : int
        Epochs of a window.
    false_alarm : float
        Probability of any verdict, other than on gross errors, for a consistent filter. It is
        divided evenly among the tests of each component: scale, bias, lag 1, whiteness and a
        change within the run.

    Returns
    -------
    ObservationConsistency

    Raises
    ------
    ConfigError
        The window has fewer than two epochs, or the probability is invalid.
    """
    if window < 2:
        raise ConfigError("navigation.window-too-short", quantity="window", window=window)
    if not 0.0 < false_alarm < 1.0:
        raise ConfigError(
            "navigation.no-probability-false-alarm", quantity="false_alarm", false_alarm=false_alarm
        )
    labels = [column[3:] for column in innovations.columns if column.startswith("nu ")]
    time = innovations.index.to_numpy(dtype=np.float64)
    nu = innovations[[f"nu {label}" for label in labels]].to_numpy(dtype=np.float64)
    s = innovations[[f"s {label}" for label in labels]].to_numpy(dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.where((s > 0.0) & np.isfinite(s), nu / np.sqrt(s), np.nan)
    gross = gross_of(u)
    good = np.where(gross, np.nan, u)
    components = tuple(
        _component(label, good[:, k], nu[:, k], int(gross[:, k].sum()))
        for k, label in enumerate(labels)
    )
    # Each component has five tests; the test for a change has three sums over all epochs.
    each = false_alarm / (5.0 * max(len(labels), 1))
    monitor = InnovationMonitor(threshold=math.log(3.0 * max(len(time), 1) / each))
    _, alarms = monitor.advance(monitor.begin(len(labels)), time, good)
    nis = _nis(time, u)
    inside = nis["nis"].between(nis["lower"], nis["upper"])[nis["components"] > 0]
    return ObservationConsistency(
        name,
        nis,
        _windows(time, good, window),
        float(inside.mean()) if len(inside) else math.nan,
        components,
        alarms,
        judge(time, good, gross, components, alarms, each, FEWEST),
        false_alarm,
    )


def consistency_of_all(
    innovations: Mapping[str, pd.DataFrame], *, window: int = 30, false_alarm: float = 0.01
) -> dict[str, ObservationConsistency]:
    """Return `consistency_of` each observation of a record, by name."""
    return {
        name: consistency_of(name, table, window=window, false_alarm=false_alarm)
        for name, table in innovations.items()
    }


def whiteness(values: Array, lags: int = LAGS) -> tuple[Array, float]:
    """Test whether a sequence is white.

    Parameters
    ----------
    values : ndarray, (n,)
        Approximately equally spaced; NaN for a missing value.
    lags : int

    Returns
    -------
    autocorrelation : ndarray, (lags,)
        About the mean.
    p : float
        Probability of as large a value of ``n (n + 2) sum ρ_k²/(n - k)``, which is about
        chi-square with `lags` degrees of freedom if it is white (Ljung and Box, Biometrika 65
        (1978) 297).
    """
    told = ~np.isnan(values)
    n = int(told.sum())
    x = np.where(told, values - np.nanmean(values), 0.0) if n else np.zeros(len(values))
    power = float(x @ x)
    rho = np.zeros(lags)
    if power > 0.0:
        rho = np.array([x[k:] @ x[: len(x) - k] for k in range(1, lags + 1)]) / power
    k = np.arange(1, lags + 1)
    q = n * (n + 2.0) * float(np.sum(rho**2 / np.maximum(n - k, 1)))
    return rho, float(chi_square_above(q, lags))


def gross_of(u: Array) -> NDArray[np.bool_]:
    """Innovations far beyond the usual ones by the median, which is insensitive to them."""
    out = np.zeros(u.shape, dtype=bool)
    for k, column in enumerate(u.T):
        told = np.abs(column[~np.isnan(column)])
        if told.size:
            usual = max(MAD_TO_SD * float(np.median(told)), 1.0)
            with np.errstate(invalid="ignore"):
                out[:, k] = np.abs(column) > GROSS * usual
    return out


def _component(label: str, u: Array, nu: Array, gross: int) -> ComponentConsistency:
    told = ~np.isnan(u)
    x, n = u[told], int(told.sum())
    normal = float(normal_quantile(0.5 + 0.5 * SHARE))
    if n < FEWEST:
        nothing = math.nan
        return ComponentConsistency(
            label,
            n + gross,
            gross,
            nothing,
            nothing,
            (nothing, nothing),
            nothing,
            nothing,
            nothing,
            np.empty(0),
            nothing,
            1.0,
            1.0,
            1.0,
            1.0,
        )
    square = float(x @ x)
    lags = max(1, min(LAGS, n // EPOCHS_A_LAG))
    rho, p = whiteness(u, lags)
    low, high = (float(chi_square_quantile(0.5 + s * 0.5 * SHARE, n)) / n for s in (-1.0, 1.0))
    root = math.sqrt(n)
    return ComponentConsistency(
        label=label,
        count=n + gross,
        gross=gross,
        inside=float(np.mean(np.abs(x) <= normal)),
        scale=math.sqrt(square / n),
        scale_bounds=(math.sqrt(low), math.sqrt(high)),
        bias=float(x.mean()),
        bias_bound=normal / root,
        bias_in_unit=float(nu[told].mean()),
        autocorrelation=rho,
        autocorrelation_bound=normal / root,
        whiteness_p=p,
        lag_p=2.0 * float(normal_above(abs(rho[0]) * root)),
        scale_p=2.0 * min(chi_square_above(square, n), chi_square_below(square, n)),
        bias_p=2.0 * float(normal_above(abs(x.mean()) * root)),
    )


def _nis(time: Array, u: Array) -> pd.DataFrame:
    told = ~np.isnan(u)
    count = told.sum(axis=1)
    of = np.maximum(count, 1)
    return pd.DataFrame(
        {
            "nis": (np.where(told, u, 0.0) ** 2).sum(axis=1),
            "components": count,
            "lower": chi_square_quantile(0.5 - 0.5 * SHARE, of),
            "upper": chi_square_quantile(0.5 + 0.5 * SHARE, of),
        },
        index=pd.Index(time, name="time"),
    )


def _windows(time: Array, u: Array, window: int) -> pd.DataFrame:
    cuts = np.arange(0, len(time), window)
    told = ~np.isnan(u)
    count = np.add.reduceat(told.sum(axis=1), cuts) if len(cuts) else np.empty(0)
    squares = np.where(told, u, 0.0) ** 2
    total = np.add.reduceat(squares.sum(axis=1), cuts) if len(cuts) else np.empty(0)
    ends = np.minimum(cuts + window, len(time)) - 1
    of = np.maximum(count, 1)
    return pd.DataFrame(
        {
            "since": time[cuts],
            "epochs": ends - cuts + 1,
            "nis": np.where(count > 0, total / of, np.nan),
            "lower": chi_square_quantile(0.5 - 0.5 * SHARE, of) / of,
            "upper": chi_square_quantile(0.5 + 0.5 * SHARE, of) / of,
        },
        index=pd.Index(time[ends], name="time"),
    )


# Inconsistent innovations of a run, in order of time.


#: Kinds that apply to the whole run.
THROUGHOUT = ("understated", "bias", "correlated")
#: Significant deviations count from these sizes on: a scatter, a mean in standard deviations, a
#: correlation.
SCATTERS, LEANS, REMEMBERS = 1.5, 0.5, 0.3
#: Effect of errors stated as time-correlated, relative to independent ones of the stated size.
LASTS = 2.0


@dataclass(frozen=True, eq=False)
class Inconsistency:
    """A significant and relevant inconsistency of one observation with the filter's model.

    Attributes
    ----------
    name : str
        Of the observation: ``rtk.position``.
    aid : str
    component : str
        With its unit.
    kind : {'change', 'understated', 'bias', 'correlated', 'gross'}
    since : float, s
        First epoch for which it is so.
    until : float, s
        Last one; the end of the run, for a whole run.
    epochs : ndarray, (k,), s
        Epochs of gross errors; empty for other kinds.
    factor : float
        Factor on the standard deviations that makes it consistent; 1 where none does.
    what, meaning : str
        Description and meaning as text.
    """

    name: str
    aid: str
    component: str
    kind: str
    since: float
    until: float
    epochs: Array
    factor: float
    what: str
    meaning: str

    @property
    def throughout(self) -> bool:
        """Whether it applies to the whole run."""
        return self.kind in THROUGHOUT


def inconsistencies(
    consistency: Mapping[str, ObservationConsistency],
    innovations: Mapping[str, pd.DataFrame],
    lasting: Collection[str] = (),
) -> tuple[Inconsistency, ...]:
    """Return the inconsistencies of a run in order of time.

    Significant but small deviations are left out: a scatter below 1.5 times the predicted one, a
    mean below half a standard deviation, a correlation below 0.3, and a correlation of innovations
    that scatter so little that it does no more harm than independent errors of the stated size. An
    observation that is better than stated is left out, too.

    Parameters
    ----------
    consistency : mapping of str to ObservationConsistency
        By name of the observation.
    innovations : mapping of str to DataFrame
        From which it is.
    lasting : collection of str
        Names of the aids with stated time-correlated errors: these may have twice the effect of
        independent ones.

    Returns
    -------
    tuple of Inconsistency
        In order of time, for equal epochs the least probable first. Inconsistencies of the whole
        run of an aid with gross errors come after these.
    """
    found: list[Inconsistency] = []
    chance: dict[int, float] = {}
    for name, of in consistency.items():
        parts = {one.label: one for one in of.components}
        for verdict in of.verdicts:
            part = parts[verdict.component]
            if _matters(verdict, part, _aid(name) in lasting):
                one = _inconsistency(name, of, verdict, part, innovations[name])
                found.append(one)
                chance[id(one)] = verdict.p
    # The effect of gross errors on a filter that uses them lasts for the whole run without a begin
    # of its own: it comes after them.
    gross: dict[str, float] = {}
    for one in found:
        if one.kind == "gross":
            gross[one.aid] = min(gross.get(one.aid, math.inf), one.since)

    def order(one: Inconsistency) -> tuple[float, bool, float]:
        after = one.throughout and one.aid in gross
        return gross[one.aid] if after else one.since, after, chance[id(one)]

    return tuple(sorted(found, key=order))


def _aid(name: str) -> str:
    """Aid of an observation."""
    return name.rpartition(".")[0] or name


def _matters(verdict: Verdict, part: ComponentConsistency, lasts: bool) -> bool:
    if verdict.kind in ("change", "gross"):
        return True
    if verdict.kind == "understated":
        return part.scale > SCATTERS
    if verdict.kind == "bias":
        return abs(part.bias) > LEANS
    if verdict.kind == "correlated":
        rho = float(part.autocorrelation[0])
        return rho < -REMEMBERS or (rho > REMEMBERS and _lasting(part) > (LASTS if lasts else 1.0))
    return False


def _lasting(part: ComponentConsistency) -> float:
    """Scatter of independent errors of equal effect, for a first-order process."""
    rho = min(max(float(part.autocorrelation[0]), 0.0), 1.0 - 1.0 / max(part.count, 2))
    return part.scale * math.sqrt((1.0 + rho) / (1.0 - rho))


def _inconsistency(
    name: str,
    of: ObservationConsistency,
    verdict: Verdict,
    part: ComponentConsistency,
    table: pd.DataFrame,
) -> Inconsistency:
    time = table.index.to_numpy(dtype=np.float64)
    until, epochs = float(time[-1]), np.empty(0)
    if verdict.kind == "gross":
        epochs = gross_epochs(table, part.label)
        until = float(epochs[-1]) if len(epochs) else verdict.since
    elif verdict.kind == "change":
        until = _until(of.windows, verdict.since)
    factor = 1.0
    if verdict.kind in ("understated", "correlated"):
        factor = max(1.0, _lasting(part))
    return Inconsistency(
        name=name,
        aid=_aid(name),
        component=verdict.component,
        kind=verdict.kind,
        since=verdict.since,
        until=until,
        epochs=epochs,
        factor=factor,
        what=verdict.what,
        meaning=verdict.meaning,
    )


def _until(windows: pd.DataFrame, since: float) -> float:
    """Last epoch of the consecutive windows beyond their bounds, from a change on."""
    later = windows[windows.index >= since]
    bad = (later["nis"] > later["upper"]).to_numpy()
    if not bad.any():
        return float(later.index[-1]) if len(later) else since
    first = int(np.argmax(bad))
    good = np.flatnonzero(~bad[first:])
    last = first + int(good[0]) - 1 if len(good) else len(bad) - 1
    return float(later.index[last])


def gross_epochs(table: pd.DataFrame, label: str) -> Array:
    """Epochs at which a component is a gross error, (k,), s."""
    s = table[f"s {label}"].to_numpy(dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.where(s > 0.0, table[f"nu {label}"].to_numpy(dtype=np.float64) / np.sqrt(s), np.nan)
    return np.asarray(table.index.to_numpy(dtype=np.float64)[gross_of(u[:, None])[:, 0]])
