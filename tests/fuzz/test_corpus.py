"""Every input that once broke a parser, and every seed: read or refused, in seconds."""

from __future__ import annotations

import random
import warnings

import pytest
from tests.fuzz.mutate import mutated
from tests.fuzz.targets import CORPUS, SEEDS, TARGETS, FellOverError, give

from strapdown.errors import DataError

KEPT = [(path.parent.name, path) for path in sorted(CORPUS.rglob("*")) if path.is_file()]


@pytest.fixture(autouse=True)
def numbers_too_large_for_a_double():
    # What NumPy says of them is no fault: they are refused.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        yield


@pytest.mark.parametrize(("kind", "path"), KEPT, ids=[f"{k}/{p.name}" for k, p in KEPT])
def test_a_reproducer(tmp_path, kind, path):
    name = path.name.partition("-")[2].replace("+", "/")
    give(TARGETS[kind], tmp_path, name, path.read_bytes())


@pytest.mark.parametrize("kind", TARGETS)
def test_seeds_are_read_and_changed_ones_do_not_break_the_parser(tmp_path, kind):
    seeds = list(TARGETS[kind].seeds())
    read = [give(TARGETS[kind], tmp_path / str(k), *seed) for k, seed in enumerate(seeds)]
    assert any(read)
    for number in range(20):
        chance = random.Random(f"{kind} {number}")
        name, data = chance.choice(seeds)
        give(TARGETS[kind], tmp_path / f"changed{number}", name, mutated(data, chance))


def test_seeds_are_small():
    assert sum(path.stat().st_size for path in SEEDS.rglob("*") if path.is_file()) < 100_000
    assert sum(path.stat().st_size for _, path in KEPT) < 500_000


def test_the_mutator_makes_the_same_inputs_of_the_same_seed():
    data = b"time_s,gyro_x\n0.0,1\n0.1,2\n"
    made = [mutated(data, random.Random(k)) for k in range(50)]
    assert made == [mutated(data, random.Random(k)) for k in range(50)]
    assert len(set(made)) > 40


def test_what_a_net_caught_is_a_failure(tmp_path):
    def caught(path):
        raise DataError("io.not-of-format", file=path.name, title="table", reason="KeyError('x')")

    target = TARGETS["log"]
    broken = type(target)(caught, target.seeds)
    with pytest.raises(FellOverError):
        give(broken, tmp_path, "log.csv", b"x")
