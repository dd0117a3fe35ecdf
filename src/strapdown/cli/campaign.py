"""``strapdown campaign``: many cases, on this machine or many."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from typer.core import TyperGroup

from strapdown.cli.console import console, print_blocks, print_findings, progress
from strapdown.cli.result_folder import default_folder, run_and_save
from strapdown.cli.shared_options import ReportFlags, folder_to_make, running, spread, writing
from strapdown.errors import ConfigError, Finding

if TYPE_CHECKING:
    from strapdown.bundle import Seal
    from strapdown.cli.console import Stopwatch
    from strapdown.progress import Progress

EPILOG = (
    "Example: strapdown campaign tunnel.toml\n\n"
    "Example: strapdown campaign case tunnel-campaign 4711"
)
#: Subcommands; anything else is the file of a campaign.
ACTIONS = ("run", "resume", "merge", "status", "report", "case")
DIR = "Folder of a campaign, complete or not."


class Actions(TyperGroup):
    """Subcommands, of which `run` needs no name."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put `run` before the file of a campaign."""
        if args and args[0] not in (*ACTIONS, "--help", "-h"):
            args = ["run", *args]
        return super().parse_args(ctx, args)


app = typer.Typer(
    cls=Actions,
    no_args_is_help=True,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)
WORKERS = running("N", "Cases at a time (the cores of this machine).", "--workers", min=1)
SCHEDULER = running(
    "ADDRESS",
    "Scheduler of dask, tcp://HOST:8786, instead of this machine; its workers are those of "
    "strapdown worker.",
)
DASHBOARD = running(
    None, "Serve the dashboard of dask on the loopback interface.", "--dashboard", default=False
)
FOLDER = typer.Argument(metavar="DIR", help=DIR)


@app.callback(epilog=EPILOG)
def campaign() -> None:
    """Run many cases of one configuration, or one for each log, and say how often.

    Parameters vary over a grid, a table or distributions; coverage of bounds, rates of failure and
    sensitivities have intervals. A campaign that was ended goes on where it was.
    """


@app.command("run")
@spread
def run(
    file: Path = typer.Argument(metavar="CAMPAIGN.toml", help="File of the campaign."),
    *,
    workers: int | None = WORKERS,
    scheduler: str | None = SCHEDULER,
    part: str | None = running(
        "K/N", "Run the K-th of N parts of the cases alone; merge puts them together."
    ),
    dashboard: bool = DASHBOARD,
    out: Path | None = folder_to_make("CAMPAIGN-campaign"),
    write: ReportFlags,
) -> None:
    """Run a campaign from its file."""
    from strapdown.campaign.engine import Workers
    from strapdown.campaign.run import WORKING, run_campaign

    folder = out or default_folder(file, "campaign")
    share = _part(part)
    _run(
        folder,
        write,
        lambda report, shown: run_campaign(
            file,
            workers=Workers(workers, scheduler, dashboard),
            folder=folder.with_name(folder.name + WORKING),
            part=share,
            progress=report,
            shown=shown,
        ),
        complete=share[1] == 1,
    )


@app.command("resume")
@spread
def resume(
    folder: Path = FOLDER,
    *,
    workers: int | None = WORKERS,
    scheduler: str | None = SCHEDULER,
    dashboard: bool = DASHBOARD,
    write: ReportFlags,
) -> None:
    """Go on with a campaign that was ended: the cases without a result are run."""
    from strapdown.campaign.engine import Workers
    from strapdown.campaign.run import WORKING, open_campaign
    from strapdown.campaign.run import resume as go_on

    name = folder.name.removesuffix(WORKING)
    working, made = folder.with_name(name + WORKING), folder.with_name(name)
    if not working.exists() and made.exists() and open_campaign(made).sealed:
        raise ConfigError("campaign.nothing-to-resume", file=str(made))
    _run(
        made,
        write,
        lambda report, shown: go_on(
            working,
            workers=Workers(workers, scheduler, dashboard),
            progress=report,
            shown=shown,
        ),
    )


def _run(folder: Path, write: Any, compute: Any, *, complete: bool = True) -> None:
    """Run, save and show; the working folder goes when the result is sealed."""
    import shutil

    from strapdown.campaign.run import WORKING

    working = folder.with_name(folder.name + WORKING)

    def shown(address: str) -> None:
        console(err=True).print(f"Dashboard: {address}", markup=False)

    if not complete:
        with progress(write.quiet or write.json) as show:
            made = compute(show, shown)
        if not write.quiet:
            console().print(
                f"{made.summary['cases']:,} of {made.design.total:,} cases are in {working}. "
                "Put the parts together: strapdown campaign merge DIR DIR --out DIR",
                markup=False,
            )
        return

    def clean(_: Any, seal: Seal) -> None:
        shutil.rmtree(working, ignore_errors=True)

    def run_it(report: Stopwatch) -> Any:
        return compute(_counted(report), shown)

    def print_it(result: Any) -> None:
        print_campaign(result.design.plain(), result.summary, folder.name)

    run_and_save(run_it, folder, write, "summary.json", print_it, clean)


def _counted(report: Stopwatch) -> Progress:
    """Show numbers of cases, which are one stage."""
    begun = False

    def told(stage: str, share: float) -> None:
        nonlocal begun
        if not stage[:1].isdigit():
            report(stage, share)
            return
        if not begun:
            report("cases", share)
            begun = True
        report.within(stage, share)

    return told


@app.command("merge")
def merge(
    folders: list[Path] = typer.Argument(
        metavar="DIR...", help="Folders of the parts of one campaign."
    ),
    out: Path = writing("DIR", "Folder of the merged campaign.", "--out", default=...),
) -> None:
    """Put the parts of a campaign from several machines together; resume completes it."""
    from strapdown.campaign.run import WORKING, merge_parts

    working = out.with_name(out.name + WORKING)
    missing = merge_parts(folders, working)
    left = f"{missing:,} cases are missing. " if missing else "All cases are there. "
    console().print(f"{left}Go on: strapdown campaign resume {out}", markup=False)


@app.command("status")
def status(
    folder: Path = FOLDER,
    as_json: bool = writing(None, "Print as JSON, for programs.", "--json", default=False),
) -> None:
    """Show how many cases of a campaign are done, and what became of them."""
    from strapdown.campaign.run import open_campaign

    found = open_campaign(folder)
    counts: dict[str, int] = {}
    for block in found.dataset.cases(["status"]):
        for name, count in block["status"].to_pandas().value_counts().items():
            counts[str(name)] = counts.get(str(name), 0) + int(count)
    told = {
        "campaign": found.design.spec.name,
        "complete": found.sealed,
        "cases": found.design.total,
        "run": sum(counts.values()),
        "status": counts,
    }
    if as_json:
        typer.echo(json.dumps(told, indent=1))
        return
    out = console()
    state = "complete" if found.sealed else f"{told['run']:,} of {told['cases']:,} cases run"
    out.print(f"{told['campaign']}: {state}", style="bold", markup=False)
    for name, count in sorted(counts.items()):
        out.print(f"  {name}: {count:,}", markup=False)
    if not found.sealed:
        out.print(f"Go on: strapdown campaign resume {folder}", markup=False)


@app.command("report")
def report(
    folder: Path = FOLDER,
    out: Path | None = writing("FILE.html", "Page to write (DIR-report.html).", "--out"),
) -> None:
    """Write the page of a campaign as it is now, complete or not."""
    from strapdown.campaign.run import report_now

    path = out or folder.with_name(f"{folder.name}-report.html")
    report_now(folder, path)
    console().print(f"Page: {path}", markup=False)


@app.command("case")
def case(
    folder: Path = FOLDER,
    number: int = typer.Argument(metavar="CASE", help="Number of the case.", min=0),
    out: Path | None = writing("DIR", "Folder to create (DIR-case-CASE).", "--out"),
    force: bool = writing(None, "Overwrite an existing result.", "--force", default=False),
) -> None:
    """Run one case by itself, to the same bits, with its full report."""
    from strapdown.campaign.run import case_of, differing, open_campaign, save_case

    found = open_campaign(folder)
    result, row, recorded = case_of(folder, number)
    screen = console()
    values = ", ".join(f"{name} = {value}" for name, value in row["values"].items())
    screen.print(f"Case {number}: {values or 'no parameter'}, seed {row['seed']}", markup=False)
    screen.print(f"{row['status']} {row['code']}".strip(), markup=False)
    print_findings(row["errors"])
    if result is not None:
        seal = save_case(found.design, result, out or Path(f"{folder}-case-{number}"), force)
        screen.print(f"Result: {seal.path}", markup=False)
    if recorded is None:
        print_findings((Finding("campaign.repeated-new", severity="note", number=number),))
        return
    names = differing(found.dataset.frozen, row, recorded)
    count = len(row["scalars"])
    print_findings(
        (
            Finding("campaign.repeated-differently", number=number, names=names)
            if names
            else Finding("campaign.repeated", severity="note", number=number, count=count),
        )
    )


def print_campaign(frozen: dict[str, Any], summary: dict[str, Any], name: str) -> None:
    """Print the answers that the first page of the report shows."""
    from strapdown.campaign.page import campaign_document
    from strapdown.report.document import Items, KeyFigures, Paragraph, TableBlock
    from strapdown.report.values import spaced

    out = console()
    document = campaign_document(frozen, summary, name)
    out.print(spaced(document.title), style="bold", markup=False)
    for block in document.front:
        if isinstance(block, TableBlock):
            print_blocks(block)
        elif isinstance(block, Paragraph):
            out.print(spaced(block.text), markup=False)
        elif isinstance(block, Items):
            for head, text in block.rows:
                out.print(spaced(f"{head}: {text}"), markup=False)
        elif isinstance(block, KeyFigures):
            for one in block.figures:
                out.print(spaced(f"{one.name}: {one.value}"), style="bold", markup=False)
                for text in (one.bound, one.note):
                    if text:
                        out.print(spaced(f"  {text}"), markup=False)


def _part(text: str | None) -> tuple[int, int]:
    """Part of the cases, K of N."""
    if text is None:
        return (1, 1)
    first, _, count = text.partition("/")
    if first.isdecimal() and count.isdecimal() and 1 <= int(first) <= int(count):
        return (int(first), int(count))
    raise typer.BadParameter("write K/N, as 2/4", param_hint="--part")
