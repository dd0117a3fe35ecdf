"""Sums of linear algebra that do not depend on the number of threads."""

from __future__ import annotations

import subprocess
import sys

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from strapdown.systems.one_thread import one_thread

SUM = """
import hashlib
import numpy as np
from strapdown.systems.one_thread import one_thread

def sums():
    product = factor @ factor.T + np.eye(300)
    told = product.tobytes() + np.linalg.solve(product, factor).tobytes()
    return hashlib.sha256(told).hexdigest()

factor = np.random.default_rng(1).normal(size=(300, 300))
free = sums()
with one_thread():
    held = sums()
print(free, held)
"""


def test_the_number_of_threads_is_one_inside_and_as_before_outside():
    before = counts()
    if not before:
        pytest.skip("numpy rests on a library here that tells no threads")
    with threadpool_limits(limits=2, user_api="blas"):
        two = counts()
        with pytest.raises(ZeroDivisionError), one_thread():
            assert counts() == [1] * len(before)
            _ = 1 / 0
        assert counts() == two
    assert counts() == before


def counts():
    return [i["num_threads"] for i in threadpool_info() if i["user_api"] == "blas"]


def test_every_environment_gives_the_same_bytes(monkeypatch):
    """What is computed inside is what a machine with one thread computes, product and solution."""
    said = []
    for count in ("1", "2"):
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", count)
        done = subprocess.run(
            [sys.executable, "-c", SUM], capture_output=True, text=True, check=True
        )
        said.append(done.stdout.split())
    assert said[0][1] == said[1][1] == said[0][0]
