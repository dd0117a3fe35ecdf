"""``strapdown modules``."""

from __future__ import annotations

import typer

from strapdown.cli.console import console, print_findings, print_table
from strapdown.cli.shared_options import JSON

EPILOG = "Example: strapdown modules\n\nExample: strapdown modules --json"


def modules(json: bool = JSON) -> None:
    """List the modules of each slot: algorithms, pipeline modules, sensors, formats."""
    from strapdown.bundle import to_json
    from strapdown.cli.modules_list import HEADINGS, cell_text, listed_modules

    lists, findings = listed_modules()
    if json:
        typer.echo(to_json({one.key: one.rows for one in lists}), nl=False)
        print_findings(findings)
        return
    out = console()
    for one in lists:
        columns = list(one.rows[0])
        if columns == ["name"]:
            out.print(f"{one.title}: {', '.join(row['name'] for row in one.rows)}\n")
            continue
        out.print(one.title, style="bold")
        print_table(
            [HEADINGS.get(column, column) for column in columns],
            [[cell_text(row[column]) for column in columns] for row in one.rows],
            text=[k for k, column in enumerate(columns) if column not in one.numbers],
        )
    print_findings(findings)
