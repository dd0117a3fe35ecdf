"""Single-threaded linear algebra, as the number of threads changes the last digits of a sum."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def one_thread() -> Iterator[None]:
    """Run on one thread of the linear algebra library, whatever the machine allows.

    OpenBLAS divides a product or a factorization among its threads, and the order of additions
    depends on their number: a relative change of 1e-14, which changes bytes of a sealed file. The
    number of threads is restored afterwards.
    """
    import numpy  # noqa: F401, as only loaded libraries can be limited
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        yield
