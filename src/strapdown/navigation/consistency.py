"""Consistency tests of filter innovations: scale, bias and whiteness."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown.constants import MAD_TO_SD
from strapdown.dsp.chi_square import (
    chi_square_above,
    chi_square_below,
    chi_square_quantile,
    normal_above,
    normal_quantile,
)
from strapdown.errors import ConfigError, Finding
from strapdown.navigation.record import innovation_labels

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
    innovations : DataFrame
        By time in s: ``nu LABEL``, ``s LABEL``, ``weight LABEL`` (`NavigationRecord.innovations`).
    window : int
        Epochs of a window.
    false_alarm : float
        Probability of any verdict, other than on gross errors, for a consistent filter. It is
        divided evenly among the tests of each component: scale, bias, lag 1, whiteness and a
        change within the run.

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
    labels = innovation_labels(innovations)
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
    finding : Finding
        Description, with its numbers; its remedy is the meaning.
    """

    name: str
    aid: str
    component: str
    kind: str
    since: float
    until: float
    epochs: Array
    factor: float
    finding: Finding

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
        finding=verdict.finding,
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


# Monitor innovations as they arrive, and detect changes in their statistics.


@dataclass(frozen=True)
class Alarm:
    """A change in a sequence of innovations.

    Attributes
    ----------
    component : int
        Which component of the observation.
    what : {'larger', 'high', 'low'}
        Larger scatter than predicted; mean above zero; mean below zero.
    since : float, s
        Estimated first epoch after the change.
    known : float, s
        Epoch at which the change became significant.
    """

    component: int
    what: str
    since: float
    known: float


@dataclass(frozen=True, eq=False)
class MonitorState:
    """State of the monitor of a sequence; never changed in place.

    Attributes
    ----------
    sums : ndarray, (3, k)
        Of the logarithms of likelihood ratios since `since`: of larger, high and low.
    since : ndarray, (3, k), s
        First epoch after the sum was last at zero.
    raised : ndarray of bool, (3, k)
        Whether an alarm has been raised since.
    """

    sums: Array
    since: Array
    raised: NDArray[np.bool_]


@dataclass(frozen=True)
class InnovationMonitor:
    """CUSUM tests of likelihood ratios: constant memory, bounded false-alarm rate.

    For a normalized innovation u the logarithm of the likelihood ratio of a standard deviation c is
    ``(1 - 1/c²) u²/2 - ln c``, and of a mean d ``d u - d²/2``. Their sum is kept from falling below
    zero (Page, Biometrika 41 (1954) 100); an alarm is raised when it reaches `threshold`, and the
    estimated time of the change is where it was last zero. For a consistent filter,
    a ratio that begins at any one epoch is a martingale of mean 1, and ever reaches exp(threshold)
    with a probability of at most exp(-threshold) (Ville's inequality): within n epochs a sum of the
    three raises a false alarm with a probability of at most ``n exp(-threshold)``, and on average
    not before exp(threshold) epochs (Lorden, Ann. Math. Statist. 42 (1971) 1897, Theorem 2).

    The tails of the innovations need not be normal for that: one is limited to `clip` standard
    deviations, so that a single gross error raises no alarm. Stateless.

    Attributes
    ----------
    larger : float
        The standard deviation c.
    apart : float
        The mean d, in standard deviations.
    clip : float
        In standard deviations.
    """

    threshold: float = math.log(1e6)
    larger: float = 1.5
    apart: float = 0.5
    clip: float = 4.0

    def __post_init__(self) -> None:
        for name, least in (("threshold", 0.0), ("larger", 1.0), ("apart", 0.0), ("clip", 0.0)):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > least):
                raise ConfigError(
                    "navigation.monitor-option-too-small",
                    quantity=name,
                    name=name,
                    value=value,
                    least=least,
                )

    def begin(self, components: int) -> MonitorState:
        """Return the state before the first epoch."""
        shape = (3, components)
        return MonitorState(np.zeros(shape), np.full(shape, np.nan), np.zeros(shape, dtype=bool))

    def advance(
        self, state: MonitorState, time: ArrayLike, normalised: ArrayLike
    ) -> tuple[MonitorState, tuple[Alarm, ...]]:
        """Process epochs; chunks of any length give the same as the whole.

        Parameters
        ----------
        time : array_like, (n,), s
        normalised : array_like, (n, k)
            Innovations over their predicted standard deviations. NaN is ignored.

        Returns
        -------
        state : MonitorState
        alarms : tuple of Alarm
            Each once, until the sum has been at zero again.
        """
        u = np.clip(np.asarray(normalised, dtype=np.float64), -self.clip, self.clip)
        u = np.where(np.isnan(u), 0.0, u)
        told = ~np.isnan(np.asarray(normalised, dtype=np.float64))
        gain = 0.5 * (1.0 - 1.0 / self.larger**2)
        ratios = np.stack(
            [
                gain * u * u - math.log(self.larger),
                self.apart * u - 0.5 * self.apart**2,
                -self.apart * u - 0.5 * self.apart**2,
            ],
            axis=1,
        )
        ratios *= told[:, None, :]
        sums, since, raised = state.sums.copy(), state.since.copy(), state.raised.copy()
        alarms: list[Alarm] = []
        for now, ratio in zip(np.asarray(time, dtype=np.float64).tolist(), ratios, strict=True):
            fresh = sums <= 0.0
            sums += ratio
            since[fresh] = now
            down = sums <= 0.0
            sums[down] = 0.0
            raised &= ~down
            over = (sums >= self.threshold) & ~raised
            if over.any():
                alarms += [
                    Alarm(int(k), WHAT[kind], float(since[kind, k]), now)
                    for kind, k in np.argwhere(over)
                ]
                raised |= over
        return MonitorState(sums, since, raised), tuple(alarms)


#: Quantities of the three sums.
WHAT: Sequence[str] = ("larger", "high", "low")


# Inconsistent innovations.


#: A change before this part of the epochs applies to the whole run.
EARLY = 0.1
#: Epochs to which a mean and a scatter are fitted.
FEWEST_AFTER = 5


@dataclass(frozen=True)
class Verdict:
    """An inconsistency of the innovations with the filter.

    Attributes
    ----------
    kind : {'change', 'understated', 'overstated', 'bias', 'correlated', 'gross', 'few'}
    component : str
        Its label.
    since : float, s
        First epoch for which it is so.
    finding : Finding
        Description, with its numbers; its remedy is the probable cause.
    p : float
        Probability by chance; for a change an upper bound.
    """

    kind: str
    component: str
    since: float
    finding: Finding
    p: float


def judge(
    time: Array,
    normalised: Array,
    gross: NDArray[np.bool_],
    components: Sequence[ComponentConsistency],
    alarms: Sequence[Alarm],
    level: float,
    fewest: int,
) -> tuple[Verdict, ...]:
    """Return the inconsistencies of an observation.

    Parameters
    ----------
    time : ndarray, (n,), s
    normalised : ndarray, (n, k)
        NaN for missing values and gross errors.
    gross : ndarray of bool, (n, k)
    level : float
        Below this probability a deviation is significant.
    fewest : int
        Fewer epochs allow no test.

    Returns
    -------
    tuple of Verdict
        The least probable first; gross errors and too few epochs last.
    """
    found: list[Verdict] = []
    for k, one in enumerate(components):
        good = ~np.isnan(normalised[:, k])
        first = float(time[good][0]) if good.any() else math.nan
        if one.count - one.gross < fewest:
            found.append(_few(one, first, fewest))
        else:
            changed = _changes(time, normalised[:, k], k, one, alarms, level)
            found += changed or _throughout(one, first, level)
        if one.gross:
            at = time[gross[:, k]]
            found.append(_gross(one, at))
    return tuple(sorted(found, key=lambda v: (v.kind in ("gross", "few"), v.p)))


def _finding(code: str, one: ComponentConsistency, **values: float) -> Finding:
    """Finding on a component, whose label 'north, m' is its name and its unit."""
    name, _, unit = one.label.partition(", ")
    named = {"component": name, "unit": f" {unit}" if unit else ""}
    return Finding(f"navigation.innovations-{code}", severity="note", data={**named, **values})


def _changes(
    time: Array, u: Array, k: int, one: ComponentConsistency, alarms: Sequence[Alarm], level: float
) -> list[Verdict]:
    """Alarms of changes within the run, consistent before them."""
    own = [alarm for alarm in alarms if alarm.component == k]
    if not own:
        return []
    alarm = min(own, key=lambda a: a.known)
    since, better = _begun(time, u, alarm.known)
    before, after = u[time < since], u[time >= since]
    before, after = before[~np.isnan(before)], after[~np.isnan(after)]
    # Limit of the largest chance improvement among so many instants.
    if len(before) < EARLY * len(u) or better < math.log(len(u) / level):
        return []
    scale = math.sqrt(float(np.mean(after**2)))
    changed = _finding(
        {"larger": "scatter-grew", "high": "mean-rose", "low": "mean-fell"}[alarm.what],
        one,
        since=since,
        mean=float(after.mean()),
        rms=scale,
        mean_before=float(before.mean()),
        rms_before=math.sqrt(float(np.mean(before**2))),
        detected=alarm.known,
    )
    return [Verdict("change", one.label, since, changed, level)]


def _begun(time: Array, u: Array, known: float) -> tuple[float, float]:
    """Most likely begin of a change of mean and scatter to constant values.

    Among the epochs up to `known`: where ``n/2 (mean u² - 1 - ln var u)``, the logarithm of the
    likelihood ratio of the n innovations from there on, is largest; and its excess over the case
    without a change, with those values from the first epoch on.
    """
    told = ~np.isnan(u)
    t, x = time[told], u[told]
    n = np.arange(len(x), 0, -1)
    first = np.cumsum(x[::-1])[::-1] / n
    second = np.cumsum(x[::-1] ** 2)[::-1] / n
    variance = np.maximum(second - first**2, 1e-12)
    ratio = 0.5 * n * (second - 1.0 - np.log(variance))
    # A fit to a few epochs is always likely.
    ratio[(t > known) | (n < FEWEST_AFTER)] = -np.inf
    at = int(np.argmax(ratio))
    return float(t[at]), float(ratio[at] - ratio[0])


def _throughout(one: ComponentConsistency, first: float, level: float) -> list[Verdict]:
    """Inconsistencies of the whole run."""
    out = []
    n = one.count - one.gross
    correlated = min(one.lag_p, one.whiteness_p)
    # The mean of innovations with a larger scatter or a correlation deviates more by chance: by
    # (1 + rho)/(1 - rho) in variance for a first-order process.
    spread = max(1.0, math.sqrt(max(one.scale**2 - one.bias**2, 0.0)))
    rho = float(one.autocorrelation[0])
    if correlated < level and rho > 0.0:
        spread *= math.sqrt((1.0 + rho) / max(1.0 - rho, 1.0 / n))
    bias_p = 2.0 * float(normal_above(abs(one.bias) * math.sqrt(n) / spread))
    # A significant mean is not part of the scatter.
    scale, scale_p = one.scale, one.scale_p
    if bias_p < level:
        square = n * (scale**2 - one.bias**2)
        scale = math.sqrt(max(square, 0.0) / (n - 1))
        scale_p = 2.0 * min(chi_square_above(square, n - 1), chi_square_below(square, n - 1))
    if scale_p < level:
        kind = "understated" if scale > 1.0 else "overstated"
        out.append(
            Verdict(
                kind,
                one.label,
                first,
                _finding(f"noise-{kind}", one, scale=scale, inverse=1.0 / max(scale, 1e-9)),
                scale_p,
            )
        )
    if bias_p < level:
        out.append(
            Verdict(
                "bias",
                one.label,
                first,
                _finding("biased", one, bias=one.bias, bias_in_unit=one.bias_in_unit),
                bias_p,
            )
        )
    if correlated < level:
        out.append(
            Verdict(
                "correlated",
                one.label,
                first,
                _finding("colored" if rho > 0.0 else "anticorrelated", one, lag_1=rho),
                correlated,
            )
        )
    return out


def _gross(one: ComponentConsistency, at: Array) -> Verdict:
    percent = 100.0 * one.gross / max(one.count, 1)
    first = float(at[0])
    found = _finding("gross", one, gross=one.gross, count=one.count, percent=percent, first=first)
    return Verdict("gross", one.label, first, found, 0.0)


def _few(one: ComponentConsistency, first: float, fewest: int) -> Verdict:
    return Verdict(
        "few",
        one.label,
        first,
        _finding("few", one, count=one.count - one.gross, fewest=fewest),
        1.0,
    )
