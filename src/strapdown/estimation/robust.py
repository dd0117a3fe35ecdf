"""Robust measurement updates: M-estimators of the residual after the fit."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from strapdown._kernels import robust as kernel
from strapdown.errors import ConfigError
from strapdown.estimation.covariance import Innovations, Step, UpdateRule


@dataclass(frozen=True)
class Influence(ABC):
    """An M-estimator's rho, psi = rho' and weight = psi / residual.

    Residuals are in units of the standard deviation of a good one. All functions are those of
    least squares near zero: ``psi(u) = u + O(u^2)``; rho and the weight are even, psi is odd and
    continuous.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]

    @property
    @abstractmethod
    def linear(self) -> float:
        """Residual up to which psi is linear: ``psi(u) = u``."""

    @property
    @abstractmethod
    def knots(self) -> tuple[float, ...]:
        """Residuals above zero, rising, between which psi is convex or concave."""

    @abstractmethod
    def rho(self, u: float) -> float:
        """Loss of a residual: half its square near zero."""

    @abstractmethod
    def psi(self, u: float) -> float:
        """Influence of a residual."""

    @abstractmethod
    def psi_prime(self, u: float) -> float:
        """Slope of psi; at a bend, that of the side nearer to zero."""

    def weight(self, u: float) -> float:
        """Weight of a residual, ``psi(u) / u``, from 1 at zero down to 0."""
        return self.psi(u) / u if u else 1.0


def check_rising(name: str, **values: float) -> None:
    """Raise `ConfigError` unless parameters are finite, positive, and rise in the order given."""
    before, known = 0.0, ""
    for quantity, value in values.items():
        if not (math.isfinite(value) and value > before):
            raise ConfigError(
                "estimation.influence-bounds-not-rising"
                if known
                else "estimation.influence-bound-not-positive",
                quantity=quantity,
                parameter=quantity,
                value=value,
                name=name,
                lower=known,
                limit=before,
                order=tuple(values),
            )
        before, known = value, quantity


@dataclass(frozen=True)
class LeastSquares(Influence):
    """``psi(u) = u``: the plain Kalman filter."""

    name: ClassVar[str] = "none"
    summary: ClassVar[str] = "every observation counts in full"
    source: ClassVar[str] = "Gauss 1809"

    @property
    def linear(self) -> float:
        """Everywhere."""
        return math.inf

    @property
    def knots(self) -> tuple[float, ...]:
        """None."""
        return ()

    def rho(self, u: float) -> float:
        """Half the square."""
        return 0.5 * u * u

    def psi(self, u: float) -> float:
        """The residual."""
        return u

    def psi_prime(self, u: float) -> float:
        """1."""
        return 1.0


@dataclass(frozen=True)
class Huber(Influence):
    """``psi(u) = u`` up to k, and k beyond.

    Convex: the minimizer is unique, and no observation is rejected outright, so that a wrong
    estimate is always pulled back. A gross error keeps the influence of k standard deviations.

    Attributes
    ----------
    k : float
        1.345 has 95 % efficiency with normal errors.
    """

    k: float = 1.345

    name: ClassVar[str] = "huber"
    summary: ClassVar[str] = "bounded: a gross error pulls with k standard deviations"
    source: ClassVar[str] = "Huber 1964, Annals of Mathematical Statistics 35, 73-101"

    def __post_init__(self) -> None:
        check_rising(self.name, k=self.k)

    @property
    def linear(self) -> float:
        """Up to k."""
        return self.k

    @property
    def knots(self) -> tuple[float, ...]:
        """At k."""
        return (self.k,)

    def rho(self, u: float) -> float:
        """Half the square, then a straight line."""
        u = abs(u)
        return 0.5 * u * u if u <= self.k else self.k * (u - 0.5 * self.k)

    def psi(self, u: float) -> float:
        """The residual, limited to k."""
        return u if abs(u) <= self.k else math.copysign(self.k, u)

    def psi_prime(self, u: float) -> float:
        """1, then 0."""
        return 1.0 if abs(u) <= self.k else 0.0


#: A smaller weight counts as zero: the variance R / w of the observation must stay finite.
NO_WEIGHT = 1e-30


@dataclass(frozen=True)
class RobustUpdate:
    """The minimizer of ``(x - m)' P^-1 (x - m) / 2 + rho(residual)``, and a Kalman step to it.

    With the weight ``w = psi(beta) / beta`` of the residual beta at the minimizer, the Kalman
    update with the variance R / w goes to that minimizer. The covariance is that of the update,
    so that it is never negative, whatever the influence function is.

    Attributes
    ----------
    influence : Influence
    scale : float
        Standard deviation of a good observation relative to the stated one.
    """

    influence: Influence = field(default_factory=Huber)
    scale: float = 1.0

    name: ClassVar[str] = "robust"
    summary: ClassVar[str] = "the minimiser along P h', by the weight of its residual"
    source: ClassVar[str] = "Huber 1981, Section 7.8 (weights); Masreliez and Martin 1977"

    def __post_init__(self) -> None:
        check_scale(self.scale)

    def step(self, nu: float, s: float, r: float) -> Step:
        """Return the step to the minimiser; see `UpdateRule.step`."""
        r *= self.scale * self.scale
        linear = self.influence.linear
        # Where the loss of least squares is below rho(linear), the minimizer's residual is in the
        # linear range. Written so that an infinite range does not give infinity times zero.
        if abs(nu) <= linear * math.sqrt(s + r) or r == 0.0:
            return Step(nu, 1.0, r, 1.0)
        beta = post_fit(self.influence, abs(nu) / math.sqrt(r), s / r)
        weight = self.influence.weight(beta)
        if weight < NO_WEIGHT:
            return Step(0.0, 1.0, r, 0.0)
        return Step(nu, 1.0, r / weight, weight)


def check_scale(scale: float) -> None:
    """Raise `ConfigError` for a scale that is not finite and positive."""
    if not (math.isfinite(scale) and scale > 0.0):
        raise ConfigError("estimation.scale-update", quantity="scale", scale=scale)


@dataclass(frozen=True)
class Hampel(Influence):
    """``psi(u) = u`` up to a, a up to b, then down in a straight line to zero at c.

    Attributes
    ----------
    a, b, c : float
        The default, (1.5, 3.5, 8) times 0.9016085, has 95 % efficiency with normal errors and
        comes down at a third of the slope at zero.
    """

    a: float = 1.35241275
    b: float = 3.15562975
    c: float = 7.212868

    name: ClassVar[str] = "hampel"
    summary: ClassVar[str] = "bounded, then down in a straight line: nothing beyond c"
    source: ClassVar[str] = (
        "Hampel, Ronchetti, Rousseeuw and Stahel 1986, Robust Statistics, p. 150; "
        "constants: Koller and Stahel 2011, Computational Statistics and Data Analysis 55"
    )

    def __post_init__(self) -> None:
        check_rising(self.name, a=self.a, b=self.b, c=self.c)

    @property
    def linear(self) -> float:
        """Up to a."""
        return self.a

    @property
    def knots(self) -> tuple[float, ...]:
        """At a, b and c."""
        return (self.a, self.b, self.c)

    def rho(self, u: float) -> float:
        """Half the square, a straight line, a parabola, and then a constant."""
        u, a, b, c = abs(u), self.a, self.b, self.c
        if u <= a:
            return 0.5 * u * u
        if u <= b:
            return a * (u - 0.5 * a)
        left = max(0.0, c - u)
        return a * (b - 0.5 * a) + 0.5 * a * ((c - b) - left * left / (c - b))

    def psi(self, u: float) -> float:
        """The residual, then a, then decreasing, then zero."""
        size = abs(u)
        if size <= self.a:
            return u
        if size <= self.b:
            return math.copysign(self.a, u)
        return math.copysign(self.a * max(0.0, self.c - size) / (self.c - self.b), u)

    def psi_prime(self, u: float) -> float:
        """1, 0, ``-a / (c - b)``, 0."""
        size = abs(u)
        if size <= self.a:
            return 1.0
        return -self.a / (self.c - self.b) if self.b < size <= self.c else 0.0


@dataclass(frozen=True)
class Tukey(Influence):
    """``psi(u) = u (1 - (u / c)^2)^2`` up to c, zero beyond.

    Without a linear range: even a good observation has slightly less than full weight.

    Attributes
    ----------
    c : float
        4.685 has 95 % efficiency with normal errors.
    """

    c: float = 4.685

    name: ClassVar[str] = "tukey"
    summary: ClassVar[str] = "smooth: nothing beyond c"
    source: ClassVar[str] = (
        "Beaton and Tukey 1974, Technometrics 16, 147-185; constant: Holland and Welsch 1977, "
        "Communications in Statistics A6, 813-827"
    )

    def __post_init__(self) -> None:
        check_rising(self.name, c=self.c)

    @property
    def linear(self) -> float:
        """Nowhere but at zero."""
        return 0.0

    @property
    def knots(self) -> tuple[float, ...]:
        """Where psi'' = 0, and at c."""
        return (math.sqrt(0.6) * self.c, self.c)

    def rho(self, u: float) -> float:
        """From half the square to ``c^2 / 6``."""
        t = min(1.0, (u / self.c) ** 2)
        return self.c * self.c / 6.0 * t * (3.0 - 3.0 * t + t * t)

    def psi(self, u: float) -> float:
        """The residual times its weight."""
        return u * self.weight(u)

    def psi_prime(self, u: float) -> float:
        """``(1 - t) (1 - 5 t)`` with ``t = (u / c)^2``."""
        t = (u / self.c) ** 2
        return (1.0 - t) * (1.0 - 5.0 * t) if t < 1.0 else 0.0

    def weight(self, u: float) -> float:
        """``(1 - (u / c)^2)^2``, the biweight."""
        t = (u / self.c) ** 2
        return (1.0 - t) ** 2 if t < 1.0 else 0.0


@dataclass(frozen=True)
class Igg3(Influence):
    """Weight 1 up to k0, ``(k0 / u) ((k1 - u) / (k1 - k0))^2`` up to k1, zero beyond.

    Attributes
    ----------
    k0, k1 : float
        Published values lie from 1 to 3 and from 2.5 to 8.5; many of the pairs have far less than
        95 % efficiency with normal errors (1.5 and 3: 0.76), the default has it.
    """

    k0: float = 2.0
    k1: float = 4.976

    name: ClassVar[str] = "igg3"
    summary: ClassVar[str] = "full, reduced, nothing: the weights of geodesy"
    source: ClassVar[str] = "Yang 1994, manuscripta geodaetica 19; Yang et al. 2001, J. Geodesy 75"

    def __post_init__(self) -> None:
        check_rising(self.name, k0=self.k0, k1=self.k1)

    @property
    def linear(self) -> float:
        """Up to k0."""
        return self.k0

    @property
    def knots(self) -> tuple[float, ...]:
        """At k0 and k1."""
        return (self.k0, self.k1)

    def rho(self, u: float) -> float:
        """Half the square, a cubic, and then a constant."""
        u = abs(u)
        if u <= self.k0:
            return 0.5 * u * u
        width = self.k1 - self.k0
        left = max(0.0, self.k1 - u) / width
        return 0.5 * self.k0 * self.k0 + self.k0 * width / 3.0 * (1.0 - left**3)

    def psi(self, u: float) -> float:
        """The residual, then ``k0 ((k1 - u) / (k1 - k0))^2``, then zero."""
        size = abs(u)
        if size <= self.k0:
            return u
        left = max(0.0, self.k1 - size) / (self.k1 - self.k0)
        return math.copysign(self.k0 * left * left, u)

    def psi_prime(self, u: float) -> float:
        """1, then ``-2 k0 (k1 - u) / (k1 - k0)^2``, then 0."""
        size = abs(u)
        if size <= self.k0:
            return 1.0
        return -2.0 * self.k0 * max(0.0, self.k1 - size) / (self.k1 - self.k0) ** 2


INFLUENCES: dict[str, type[Influence]] = {
    "huber": Huber,
    "hampel": Hampel,
    "tukey": Tukey,
    "igg3": Igg3,
    "none": LeastSquares,
}


# The residual at the minimum of the sum of an observation's loss and the prior's.


#: Newton's steps approach the root from one side; they stop when they no longer change it.
STEPS = 200


def post_fit(influence: Influence, b: float, kappa: float) -> float:
    """Return the residual after the fit, in standard deviations of the observation.

    Along ``P h'`` the loss ``(x - m)' P^-1 (x - m) / 2 + rho`` is, as a function of the residual
    beta after the fit, ``(b - beta)^2 / (2 kappa) + rho(beta)``. It is stationary where
    ``F(beta) = beta + kappa psi(beta) = b``; a minimum is where F rises. A redescending psi has
    several minima; the lowest is taken.

    Between two knots F is convex or concave, and has one rising root at most. Newton's method
    finds it from the left of a concave interval and from the right of a convex one: the tangent
    then lies on the far side of F, no step goes past the root, and a slope that is not positive
    means that there is none.

    `b`: residual before the fit, >= 0. `kappa`: variance of the prediction over that of the
    observation, >= 0. Returns from 0 to b.
    """
    best, least = b, math.inf
    lo = 0.0
    for knot in (*influence.knots, math.inf):
        hi = min(knot, b)
        beta = _rising_root(influence, lo, hi, b, kappa)
        if beta is not None:
            # b - beta = kappa psi, without the cancellation.
            loss = 0.5 * kappa * influence.psi(beta) ** 2 + influence.rho(beta)
            if loss < least:
                best, least = beta, loss
        if hi >= b:
            break
        lo = hi
    return best


def _rising_root(
    influence: Influence, lo: float, hi: float, b: float, kappa: float
) -> float | None:
    """Return where F rises through b between two neighboring knots, or None."""
    psi, psi_prime = influence.psi, influence.psi_prime
    inside = math.nextafter(lo, math.inf)
    concave = psi_prime(inside) >= psi_prime(hi)
    u = lo if concave else hi
    excess = u + kappa * psi(u) - b
    if (excess > 0.0) if concave else (excess < 0.0):
        return None
    slope_at = inside if concave else hi
    for _ in range(STEPS):
        slope = 1.0 + kappa * psi_prime(slope_at)
        if slope <= 0.0:
            return None
        after = u - excess / slope
        if after > hi:
            # By rounding alone, or because F has no root before the knot.
            return hi if after <= hi * (1.0 + 1e-12) else None
        if after < lo:
            return lo if after >= lo * (1.0 - 1e-12) else None
        # All steps have the same direction, until rounding reverses one.
        if (after <= u) if concave else (after >= u):
            return u
        u = slope_at = after
        excess = u + kappa * psi(u) - b
    return u


@dataclass(frozen=True)
class PaperUpdate:
    """One Newton step on ``(x - m)' P^-1 (x - m) / 2 + rho(nu / alpha)`` from the prediction.

    Uses the residual before the fit. Where the prediction is much less certain than the
    observation that residual is large even without an error: Huber's psi' is then 0, the
    step goes far past the minimum, and the covariance is not reduced. Where psi redescends,
    psi' < 0 increases the covariance, or makes it negative. For comparison only; `RobustUpdate`
    is safe.

    Attributes
    ----------
    influence : Influence
    scale : float
        alpha over the stated standard deviation.
    """

    influence: Influence = field(default_factory=Huber)
    scale: float = 1.0

    name: ClassVar[str] = "paper"
    summary: ClassVar[str] = "one Newton step from the prediction: unsafe, for comparison"
    source: ClassVar[str] = "Chernodarov 2009, Eqs. (9)-(13)"

    def __post_init__(self) -> None:
        check_scale(self.scale)

    def step(self, nu: float, s: float, r: float) -> Step:
        """Return the Newton step; see `UpdateRule.step`."""
        r *= self.scale * self.scale
        if r == 0.0:
            return Step(nu, 1.0, r, 1.0)
        alpha = math.sqrt(r)
        beta = nu / alpha
        psi, slope = self.influence.psi(beta), self.influence.psi_prime(beta)
        return Step(alpha * psi, slope, r, self.influence.weight(beta))


# The scale of an observation's errors, learned from its innovations.


HUBER = Huber()
#: Observations in a row that show that they agree with the estimate (`kernel.HALF`).
SETTLES = 5
#: Rejections in a row that an estimate can have earned by itself, after which one is taken.
FEW = 2
#: Faults of receivers, as of a wrong ambiguity or by reflections, last this long at most, s.
DOUBT = 60.0
#: Standard deviations within which an observation that jumped agrees with the estimate again.
CONSISTENT = 2.0


@dataclass(frozen=True)
class Rejection:
    """The rule that takes nothing of an observation."""

    def step(self, nu: float, s: float, r: float) -> Step:
        """Return no step; see `UpdateRule.step`."""
        return Step(0.0, 1.0, r, 0.0)


class ScaleState(NamedTuple):
    """Learned scale of one kind of observation: numbers to keep with the filter.

    Attributes
    ----------
    log_square : float
        Logarithm of the square of the factor.
    information : float
        Effective number of observations behind it.
    rejected : int
        Number of latest observations in a row that were rejected.
    settled : int
        Number of those in a row before them that counted by half or more.
    nu, time : float
        Newest innovation, and its time, s.
    jump, held : float, s
        The innovation with which they jumped, and until when what is like it is their fault.
    since : float, s
        Since when they have agreed with the estimate, but for some that returned to it; infinite
        before the first.
    """

    log_square: float
    information: float
    rejected: int
    settled: int = 0
    nu: float = 0.0
    time: float = -math.inf
    jump: float = 0.0
    held: float = -math.inf
    since: float = math.inf

    @classmethod
    def of(cls, numbers: Sequence[float]) -> ScaleState:
        """Return the state of numbers in the order of the attributes."""
        square, information, rejected, settled, *newest = numbers
        return cls(square, information, int(rejected), int(settled), *newest)

    @property
    def factor(self) -> float:
        """Standard deviation of a good observation relative to the stated one."""
        return math.exp(0.5 * self.log_square)


@dataclass(frozen=True)
class AdaptiveScale:
    """Adaptation of the factor of a stated standard deviation to the innovations.

    An innovation nu has the variance ``s + c^2 r``. The factor c is adjusted until the clipped
    squares ``min(nu^2 / (s + c^2 r), clip^2)`` have the mean that they have with normal errors
    (Huber's second proposal, as a recursion with fading memory): a gross error counts at most as
    clip standard deviations. Each observation is weighted by the share of its own variance: after
    an outage, where ``s >> r``, almost no scale is learned or forgotten.

    An estimate with an error far beyond its covariance would make a redescending function reject
    every later observation: after an outage in which the error grew to three of its standard
    deviations, Tukey's does, one by one, though together they leave no doubt. After `patience`
    rejections in a row `rule` therefore gives Huber's function, which never rejects.

    An estimate goes wrong by degrees: a position within what it can have moved since the last
    observation, as after an outage, shows its own error, and after `FEW` rejections one is taken.
    Observations that agreed with it, and jump further than that, are faulty themselves, now or
    until now: a jump begins a fault, or ends one that the estimate had followed. For the first
    speaks how long they agreed before, for the second how long they disagree. With faults of any
    length the two are equally likely after the same time: they are rejected until they return, as
    long as they had agreed, and for `doubt` seconds at most.

    The object is stateless: its user keeps the learned `ScaleState`.

    Attributes
    ----------
    memory : float
        Observations over which the factor is a mean, fading.
    prior : float
        Observations that the stated variance is worth at the start.
    lowest, highest : float
        Bounds of the factor. Without the lower one, a receiver that repeats itself would lead
        to a variance with which everything that follows is rejected. At the upper one the
        variance is 10^4 times the stated one, and it is time to look for a failure.
    clip : float
        In standard deviations. With 1 the factor rises by 15 % if a tenth of the observations
        are gross errors.
    patience : int
        Rejections in a row after which one observation is taken by Huber's function.
    doubt : float, s
        How long observations that jumped are rejected at most: `DOUBT`.
    """

    memory: float = 100.0
    prior: float = 10.0
    lowest: float = 0.3
    highest: float = 100.0
    clip: float = 1.0
    patience: int = 10
    doubt: float = field(default=DOUBT, metadata={"unit": "s"})

    def __post_init__(self) -> None:
        for name in ("memory", "prior", "lowest", "highest", "clip", "patience", "doubt"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ConfigError(
                    "estimation.adaptive-scale-not-above", quantity=name, name=name, value=value
                )
        if self.patience != int(self.patience):
            raise ConfigError(
                "estimation.patience-not-whole", quantity="patience", value=self.patience
            )
        for below, above in (("prior", "memory"), ("lowest", "highest")):
            if getattr(self, below) > getattr(self, above):
                raise ConfigError(
                    "estimation.adaptive-scale-above",
                    quantity=below,
                    below=below,
                    value=getattr(self, below),
                    above=above,
                    value_2=getattr(self, above),
                )

    @cached_property
    def kernel_options(self) -> NDArray[np.float64]:
        """The options as kernels take them, with an infinite linear range."""
        # Mean of the clipped square of a normal number, and the part within the clip.
        k = self.clip
        inside = math.erf(k / math.sqrt(2.0))
        within = inside - k * math.sqrt(2.0 / math.pi) * math.exp(-0.5 * k * k)
        mean = within + k * k * (1.0 - inside)
        lowest, highest = 2.0 * math.log(self.lowest), 2.0 * math.log(self.highest)
        return np.array([math.inf, 1.0, 1.0, self.memory, lowest, highest, k, mean, within])

    def begin(self) -> ScaleState:
        """Return the initial state: the stated variance."""
        bounded = min(max(1.0, self.lowest), self.highest)
        return ScaleState(2.0 * math.log(bounded), self.prior, 0)

    def rule(self, state: ScaleState, influence: Influence) -> RobustUpdate:
        """Return the rule of the next observation."""
        grown = state.time > -math.inf and state.held == -math.inf
        patience = min(FEW, self.patience) if grown else self.patience
        given = HUBER if state.rejected >= patience else influence
        return RobustUpdate(given, state.factor)

    def after(
        self, state: ScaleState, nu: float, s: float, r: float, weight: float = 1.0
    ) -> ScaleState:
        """Return the scale state after an observation.

        `state`: before it. `nu`: innovation. `s`: variance of the prediction, ``h P h'``. `r`:
        variance of the observation as stated, without the factor. `weight`: weight by the rule; 0
        is a rejection.
        """
        if weight == 0.0:
            state = state._replace(rejected=state.rejected + 1)
        else:
            settled = state.settled + 1 if weight >= kernel.HALF and not state.rejected else 0
            state = state._replace(rejected=0, settled=settled)
        square, information = kernel.learned_scale(
            state.log_square, state.information, nu, s, r, self.kernel_options
        )
        return state._replace(log_square=square, information=information)

    def jumped(
        self, before: ScaleState, after: ScaleState, nu: float, time: float, reach: float
    ) -> ScaleState:
        """Return the state after an observation at a time, s, with what says that it jumped.

        `before`, `after`: states. `nu`: its innovation. `reach`: by how much the estimate may have
        moved since the last observation.
        """
        jump, held, since = after.jump, after.held, before.since
        far = abs(nu - before.nu) > max(reach, 0.5 * abs(nu))
        # One that returns and jumps again at once, as a receiver between two solutions does, is
        # doubted as it was.
        if after.rejected == 1 and before.settled >= SETTLES and far:
            jump, held = nu, time + min(self.doubt, time - since)
        elif after.rejected == 1 and abs(nu) <= reach:
            held = -math.inf
        elif after.rejected == 1 and (math.isinf(held) or not far):
            held = time
        # After rejections the observations returned, or the estimate went to them.
        went = after.rejected == 0 and before.rejected > 0 and nu * before.nu >= 0.5 * before.nu**2
        if went or math.isinf(since):
            since, held = time, -math.inf
        return after._replace(nu=nu, time=time, jump=jump, held=held, since=since)

    @staticmethod
    def is_away(state: ScaleState, nu: float, variance: float, time: float) -> bool:
        """Return whether an observation that jumped is where it jumped to.

        `nu`: its innovation, of this `variance`. An innovation that grows is that of an estimate
        that goes wrong; within its own error the estimate may be.
        """
        if state.rejected == 0 or time >= state.held or nu**2 <= CONSISTENT**2 * variance:
            return False
        near = max(0.5 * abs(state.jump), CONSISTENT * math.sqrt(variance))
        return abs(nu - state.jump) < near


#: Learned scale of each component of an observation.
Scales = tuple[ScaleState, ...]


@dataclass(frozen=True)
class AdaptiveRule:
    """`RobustUpdate` with the scale that `AdaptiveScale` learns, component by component.

    Stateless: the caller keeps the `Scales` of each observation, by its name. Without them `step`
    uses the stated variances.

    Attributes
    ----------
    influence : Influence
    scale : AdaptiveScale
    """

    influence: Influence = field(default_factory=Huber)
    scale: AdaptiveScale = field(default_factory=AdaptiveScale)

    name: ClassVar[str] = "adaptive"
    summary: ClassVar[str] = "robust, with the scale of the errors learnt from the innovations"
    source: ClassVar[str] = "Huber 1981, Sections 6.4 (second proposal) and 7.8; recursion: here"

    def step(self, nu: float, s: float, r: float) -> Step:
        """Return the step with the initial scale; see `UpdateRule.step`."""
        return RobustUpdate(self.influence).step(nu, s, r)

    def begin(self, size: int) -> Scales:
        """Return the initial scale state of so many components."""
        return (self.scale.begin(),) * size

    def rules(self, scales: Scales) -> list[RobustUpdate]:
        """Return the rule of each component of the next observation."""
        return [self.scale.rule(one, self.influence) for one in scales]

    def jumped(
        self,
        scales: tuple[Scales, Scales],
        seen: Innovations,
        time: float,
        reach: Callable[[float], float],
    ) -> Scales:
        """Return the scale state after an observation with what says that it jumped.

        `scales`: before and after it. `seen`: innovations of the observation. `time`: its own, s.
        `reach`: by how much the estimate may move in so many seconds.
        """
        return tuple(
            self.scale.jumped(one, then, nu, time, reach(time - one.time))
            for one, then, nu in zip(scales[0], scales[1], seen.nu.tolist(), strict=True)
        )

    def after(self, scales: Scales, seen: Innovations, R: NDArray[np.float64]) -> Scales:
        """Return the scale state after an observation.

        `scales`: before it. `seen`: innovations of the observation. `R` ((l,)): its stated
        variances.
        """
        return tuple(
            self.scale.after(one, nu, s - r, r, weight)
            for one, nu, s, r, weight in zip(
                scales,
                seen.nu.tolist(),
                seen.s.tolist(),
                R.tolist(),
                seen.weight.tolist(),
                strict=True,
            )
        )


def linear_range(rule: UpdateRule | None) -> NDArray[np.float64] | None:
    """Return a rule within its linear range, as kernels take it; empty for full weight.

    None for another rule.
    """
    if rule is None:
        return np.empty(0)
    # Exactly these types: a subclass may behave differently.
    if type(rule) is AdaptiveRule:
        out = rule.scale.kernel_options.copy()
    elif type(rule) is RobustUpdate:
        out = np.zeros(kernel.WITHIN + 1)
        out[kernel.FACTOR] = rule.scale
    else:
        return None
    out[kernel.LINEAR] = rule.influence.linear
    return out


UPDATE_RULES: dict[str, type[RobustUpdate] | type[PaperUpdate] | type[AdaptiveRule]] = {
    "robust": RobustUpdate,
    "paper": PaperUpdate,
    "adaptive": AdaptiveRule,
}
