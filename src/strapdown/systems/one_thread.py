"""Linear algebra on one thread: how many there are changes the last digits of a sum."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["one_thread"]


@contextmanager
def one_thread() -> Iterator[None]:
    """Run on one thread of the linear algebra library, whatever the machine allows.

    OpenBLAS divides a product or a factorisation among its threads, and so adds in another order
    with each number of them: 1e-14 of a result, which is another byte in a sealed file. Numbers
    of threads are as before afterwards.
    """
    # What is not loaded yet cannot be told.
    import numpy  # noqa: F401
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        yield
