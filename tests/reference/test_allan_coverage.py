"""Coverage of the intervals of noise terms, over simulated sensors of five grades.

``python -m tests.reference.test_allan_coverage COUNT`` counts over COUNT sensors of each: for each
term in how many it is observable, has its interval the truth in it, above it, or it is not there.
"""

from __future__ import annotations

import math
import sys
from collections import Counter

import numpy as np
import pytest
from scipy.stats import binom

from strapdown.sensors.error_chain import apply
from strapdown.sensors.noise_terms import noise_terms
from strapdown.sensors.triad_errors import TriadErrors

# Sample interval in s, samples, and the terms in rad and s.
GRADES = {
    "phone": (0.02, 180_000, {"N": 1.2e-4, "K": 4e-6}),
    "industrial": (0.02, 360_000, {"N": 1.4e-4, "B": 4e-5}),
    "tactical": (0.02, 720_000, {"N": 2.5e-5, "GM": 1e-5, "T": 300.0}),
    "navigation": (0.01, 360_000, {"Q": 1e-7, "N": 3e-7, "K": 6e-9}),
    "crash": (0.005, 360_000, {"N": 2e-4, "R": 2e-7}),
}


def simulate(grade: str, seed: int) -> tuple[np.ndarray, float]:
    """Rate of one sensor, by the error model of the package; flicker and quantization beside it."""
    dt, n, terms = GRADES[grade]
    errors = TriadErrors(
        noise_density=terms.get("N", 0.0),
        bias_instability=terms.get("GM", 0.0),
        correlation_time=terms.get("T", math.inf),
        random_walk=terms.get("K", 0.0),
        trend=terms.get("R", 0.0),
    )
    time = dt * np.arange(1, n + 1)
    rate = apply(errors, time, np.zeros((n, 3)), seed=seed, sampling="mean")[:, 0]
    draw = np.random.Generator(np.random.PCG64([seed, 27]))
    if "Q" in terms:
        rate += np.diff(draw.standard_normal(n + 1)) * terms["Q"] / dt
    if "B" in terms:
        rate += terms["B"] * flicker(n, dt, draw)
    return rate, dt


def flicker(n: int, dt: float, draw: np.random.Generator) -> np.ndarray:
    """Noise with the two-sided spectrum 1/(2 pi f), from 1/8 of the lowest frequency."""
    size = 8 * n
    frequency = np.fft.rfftfreq(size, dt)
    power = np.zeros(frequency.size)
    power[1:] = 1.0 / (2.0 * math.pi * frequency[1:])
    phases = draw.standard_normal((2, frequency.size))
    # irfft divides by size; a coefficient of variance size/dt * S gives the spectrum S.
    spectrum = np.sqrt(power * size / dt / 2.0) * (phases[0] + 1j * phases[1])
    return np.fft.irfft(spectrum, size)[:n]


def count(grade: str, seeds: range) -> Counter[tuple[str, str]]:
    """How often each term is observable, its interval contains the truth, or it is not there."""
    truth, counts = GRADES[grade][2], Counter[tuple[str, str]]()
    for seed in seeds:
        for term in noise_terms(*simulate(grade, seed)).terms:
            if term.name not in truth:
                counts[term.name, "false"] += term.observable
            elif term.observable:
                counts[term.name, "observable"] += 1
                counts[term.name, "covered"] += term.low <= truth[term.name] <= term.high
                counts[term.name, "below"] += truth[term.name] < term.low
    return counts


@pytest.mark.slow
@pytest.mark.parametrize("grade", GRADES)
def test_intervals_contain_the_truth(grade):
    counts = count(grade, range(1000, 1012))
    for term in GRADES[grade][2]:
        seen, inside = counts[term, "observable"], counts[term, "covered"]
        # Fewer would occur with a probability of 0.1 % if the coverage were 95 %.
        assert inside >= binom.ppf(1e-3, seen, 0.95), (term, seen, inside)
    assert counts["N", "observable"] == 12
    assert sum(number for (_, kind), number in counts.items() if kind == "false") <= 1


if __name__ == "__main__":
    for name in sys.argv[2:] or GRADES:
        found = count(name, range(int(sys.argv[1])))
        for one in dict.fromkeys(term for term, _ in found):
            row = [found[one, kind] for kind in ("observable", "covered", "below", "false")]
            print(name, one, *row, flush=True)
