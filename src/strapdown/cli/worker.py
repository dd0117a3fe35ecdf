"""``strapdown worker``: work for the campaigns of another machine."""

from __future__ import annotations

import typer

from strapdown.cli.shared_options import running

EPILOG = "Example: strapdown worker tcp://192.168.1.5:8786"


def worker(
    scheduler: str = typer.Argument(metavar="ADDRESS", help="Scheduler of dask, tcp://HOST:8786."),
    workers: int | None = running("N", "Cases at a time (the cores of this machine).", min=1),
) -> None:
    """Run cases of campaigns for a scheduler of dask, until it ends.

    A worker runs what its scheduler sends: connect only to one of your own, in a network of your
    own, or by TLS as dask describes it.
    """
    from strapdown.campaign.engine import serve

    serve(scheduler, workers)
