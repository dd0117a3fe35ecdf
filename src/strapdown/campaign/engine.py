"""Engine of a campaign: batches of cases on the workers of dask, on this machine or on many.

By default the scheduler and its workers are threads of this process, without a socket; each worker
keeps one process that runs the cases. With the address of a scheduler the same batches go to the
workers that listen to it (`strapdown worker`). A batch is sized by what its cases cost.
"""

from __future__ import annotations

import itertools
import logging
import os
import queue
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any
from urllib.parse import urlsplit

from strapdown.campaign.case_process import CaseProcess
from strapdown.errors import ConfigError

#: Time that a batch is to take, s: long beside what it costs to send, short beside a campaign.
BATCH = 2.0
#: Batches in flight for each worker; the second waits while the first runs.
AHEAD = 2
#: Most cases of a batch; in bulk, in multiples of `TOGETHER`.
MOST, MOST_BULK, TOGETHER = 1000, 16_384, 64
#: How long a scheduler may be without a worker, s.
WORKERS = 60.0
#: Share of the latest batch in the estimated cost of a case.
LATEST = 0.3
#: Without its dashboard dask need not observe itself, which takes 4 % of a core.
UNOBSERVED = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "500ms",
}

#: Processes of this worker by campaign: those that wait for a batch, and all.
_IDLE: dict[str, queue.SimpleQueue[CaseProcess]] = {}
_ALL: dict[str, list[CaseProcess]] = {}


def cores() -> int:
    """Number of cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:
        return os.cpu_count() or 1


@dataclass(frozen=True)
class Workers:
    """Where cases run.

    Attributes
    ----------
    count : int, optional
        Workers of this machine; by default its cores.
    scheduler : str, optional
        Address of a scheduler of dask, ``tcp://host:8786``, instead.
    dashboard : bool
        Whether to serve the dashboard of dask on the loopback interface.
    """

    count: int | None = None
    scheduler: str | None = None
    dashboard: bool = False


def _batch(frozen: Mapping[str, Any], numbers: list[int]) -> tuple[Any, float]:
    """Run a batch in a process of this worker; returns rows, or an array in bulk, and seconds."""
    idle = _IDLE.setdefault(frozen["identity"], queue.SimpleQueue())
    try:
        keeper = idle.get_nowait()
    except queue.Empty:
        keeper = _kept(frozen)
    begun = time.monotonic()
    try:
        if frozen["base"].get("bulk"):
            return keeper.block(numbers[0], numbers[-1] + 1), time.monotonic() - begun
        return list(keeper.run(numbers)), time.monotonic() - begun
    finally:
        idle.put(keeper)


def _kept(frozen: Mapping[str, Any]) -> CaseProcess:
    keeper = CaseProcess(frozen)
    _ALL.setdefault(frozen["identity"], []).append(keeper)
    return keeper


def _end_kept(name: str) -> None:
    """End the processes of a campaign on this worker, also those that are in a batch."""
    _IDLE.pop(name, None)
    for keeper in _ALL.pop(name, ()):
        keeper.close()


def run_batches(
    frozen: Mapping[str, Any],
    numbers: Iterator[int],
    workers: Workers,
    take: Callable[[list[int], Any], bool],
    shown: Callable[[str], None] = lambda address: None,
) -> None:
    """Run cases until none is left, or `take` has enough.

    Parameters
    ----------
    frozen : mapping
        The campaign.
    numbers : iterator of int
        Cases to run, in order.
    workers : Workers
    take : callable
        Called with the cases of a batch and their rows, or in bulk their array, as they come;
        returns whether to go on.
    shown : callable
        Called with the address of the dashboard, if there is one.

    Raises
    ------
    ConfigError
        dask is not installed, or bokeh, which draws the dashboard; the scheduler does not answer,
        or is lost.
    """
    if find_spec("distributed") is None:
        raise ConfigError("campaign.no-dask")
    if workers.dashboard and workers.scheduler is None and find_spec("bokeh") is None:
        # Its pages would say so themselves, one by one.
        raise ConfigError("campaign.no-bokeh", quantity="--dashboard")
    cluster: Any = None
    client: Any = None
    try:
        if workers.scheduler is None:
            # They load what they run while dask is loaded here.
            first = list(itertools.islice(numbers, workers.count or cores()))
            for _ in first:
                keeper = _kept(frozen)
                keeper.begin()
                _IDLE.setdefault(frozen["identity"], queue.SimpleQueue()).put(keeper)
            numbers = itertools.chain(first, numbers)
        import dask
        from distributed import Client, LocalCluster
        from distributed import as_completed as arriving

        for name in ("distributed", "tornado", "asyncio"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
        try:
            if workers.scheduler is None:
                with dask.config.set({} if workers.dashboard else UNOBSERVED):
                    cluster = LocalCluster(
                        n_workers=workers.count or cores(),
                        threads_per_worker=1,
                        processes=False,
                        memory_limit=0,
                        silence_logs=logging.CRITICAL,
                        # Without an address dask would serve all interfaces.
                        dashboard_address="127.0.0.1:0",
                        worker_dashboard_address="127.0.0.1:0",
                    )
            client = Client(cluster or workers.scheduler, timeout="10s", set_as_default=False)
        except (OSError, ValueError) as error:
            raise ConfigError(
                "campaign.no-scheduler",
                quantity="--scheduler",
                address=workers.scheduler,
                reason=str(error) or type(error).__name__,
            ) from None
        if workers.dashboard:
            link = client.dashboard_link
            # In one process dask names the machine, and serves the loopback interface alone.
            local = f"http://127.0.0.1:{urlsplit(link).port}/status"
            shown(link if cluster is None else local)
        _feed(frozen, numbers, client, arriving, take, workers.scheduler)
    finally:
        # A lost scheduler answers none of this.
        with suppress(Exception):
            if client is not None:
                client.run(_end_kept, frozen["identity"])
                client.close(timeout=2.0)
        with suppress(Exception):
            if cluster is not None:
                cluster.close(timeout=5.0)
        _end_kept(frozen["identity"])


def _feed(
    frozen: Mapping[str, Any],
    numbers: Iterator[int],
    client: Any,
    arriving: Any,
    take: Callable[[list[int], Any], bool],
    address: str | None,
) -> None:
    """Keep the workers busy, and hand over what they made."""
    bulk = bool(frozen["base"].get("bulk"))
    try:
        client.wait_for_workers(1, timeout=WORKERS)
    except TimeoutError:
        raise ConfigError("campaign.no-workers", address=address) from None
    # In a list, since of a dictionary every value would be data of its own.
    (shared,) = client.scatter([dict(frozen)], broadcast=True, hash=False)
    width = max(1, sum(client.nthreads().values()))
    cost: float | None = None
    asked: dict[str, list[int]] = {}
    held: list[int] = []
    waiting = arriving(loop=client.loop)

    def size() -> int:
        if cost is None:
            return 10 * TOGETHER if bulk else 1
        count = max(1, round(BATCH / max(cost, 1e-9)))
        return (
            max(TOGETHER, min(count, MOST_BULK) // TOGETHER * TOGETHER)
            if bulk
            else min(count, MOST)
        )

    def ask() -> bool:
        batch = _next(numbers, size(), held, contiguous=bulk)
        if batch:
            future = client.submit(_batch, shared, batch, pure=False, retries=3)
            asked[future.key] = batch
            waiting.add(future)
        return bool(batch)

    try:
        for _ in range(AHEAD * width):
            if not ask():
                break
        for future in waiting:
            batch = asked.pop(future.key)
            rows, seconds = future.result()
            latest = seconds / len(batch)
            cost = latest if cost is None else LATEST * latest + (1.0 - LATEST) * cost
            if not take(batch, rows):
                waiting.clear()
                return
            ask()
    except ConfigError:
        raise
    except Exception as error:
        if type(error).__module__.partition(".")[0] not in ("distributed", "asyncio", "concurrent"):
            raise
        raise ConfigError(
            "campaign.scheduler-lost", address=address, reason=type(error).__name__
        ) from None


def _next(numbers: Iterator[int], count: int, held: list[int], *, contiguous: bool) -> list[int]:
    """Take the next cases; contiguous ones are without a gap, and end with a stream of numbers.

    `held`: one that was taken and is of the next batch.
    """
    out: list[int] = []
    for number in itertools.chain(held[:], numbers):
        if contiguous and out and number != out[-1] + 1:
            held[:] = [number]
            return out
        held.clear()
        out.append(number)
        if len(out) >= count and not (contiguous and (number + 1) % TOGETHER):
            break
    return out


def serve(address: str, count: int | None) -> None:
    """Work for a scheduler until it ends, with so many cases at a time.

    ConfigError: dask is not installed, or nobody answers.
    """
    try:
        import asyncio

        from distributed import Worker
    except ImportError:
        raise ConfigError("campaign.no-dask") from None

    async def work() -> None:
        worker = await Worker(
            address, nthreads=count or cores(), memory_limit=0, dashboard=False, death_timeout=60
        )
        await worker.finished()

    try:
        asyncio.run(work())
    except (OSError, ValueError, TimeoutError) as error:
        raise ConfigError(
            "campaign.no-scheduler",
            quantity="SCHEDULER",
            address=address,
            reason=str(error) or type(error).__name__,
        ) from None
