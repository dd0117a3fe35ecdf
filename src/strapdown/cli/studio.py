"""``strapdown studio``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from strapdown.cli.console import console, print_findings
from strapdown.cli.shared_options import running, with_what
from strapdown.errors import Finding

if TYPE_CHECKING:
    from strapdown.studio.server import Address

EPILOG = "Example: strapdown studio records"


def studio(
    folder: Path = typer.Argument(
        Path(),
        metavar="[FOLDER]",
        help="Folder of the logs and the results; this one, if not given.",
        show_default=False,
    ),
    map_file: Path | None = with_what(
        "FILE",
        "A local map: raster tiles, .mbtiles or .pmtiles; the first in the folder, if not "
        "given. Nothing is fetched.",
        "--map",
    ),
    port: int = running("N", "Port; a free one, if not given.", min=0, max=65535, default=0),
    host: str = running(
        "ADDRESS",
        "Address of this machine (127.0.0.1, which other machines cannot reach).",
        default="127.0.0.1",
    ),
    listen: bool = running(
        None,
        "Allow an address that other machines reach: whoever knows the token may read, write "
        "and run in the folder, and nothing is encrypted.",
        "--listen",
        default=False,
    ),
    no_browser: bool = running(
        None, "Print the address, and open no browser.", "--no-browser", default=False
    ),
) -> None:
    """Look at logs, run the commands on them and compare results, in a browser on this machine.

    A server for this machine alone shows the folder: drop a log, see what doctor finds, trim it,
    fill in what is asked, run, look at the report. Each run is a command that the page shows, in a
    process of its own, and writes what the command writes. Ctrl-C ends the server; a run that has
    begun goes on to its end.
    """
    from strapdown.studio.server import serve

    out = console()

    def started(address: Address) -> None:
        if listen:
            print_findings([Finding("studio.listening", folder=address.folder)])
        out.print(f"Studio of {address.folder}")
        out.print(f"Open   {address.url}")
        if address.jobs:
            out.print(f"{address.jobs} jobs from before go on")
        out.print("End    Ctrl-C")
        if not no_browser:
            import threading
            import webbrowser

            # A browser in the terminal would hold the server.
            threading.Thread(target=webbrowser.open, args=[address.url], daemon=True).start()

    left = serve(folder, host=host, port=port, listen=listen, map_file=map_file, started=started)
    if left:
        out.print(f"\n{left} jobs go on; a studio that is started again shows them")
