"""Commands that list the studies in a folder, and the columns of one study."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from sweep.cli.app import Group, Json, Results, StudyName, app

if TYPE_CHECKING:
    import pandas as pd


@app.command(name="list", rich_help_panel=Group.store)
def list_studies(results: Results = Path("results"), as_json: Json = False) -> None:
    """List the studies in a results folder and their progress.

    Examples
    --------
    sweep list
    sweep list --results other --json
    """
    from sweep.store import local_folder
    from sweep.tables import studies

    stored = studies(local_folder(results, "the list of studies needs"))
    if stored.empty and not as_json:
        print(f"{results}: no study is stored here", file=sys.stderr)
        return
    _show(stored, as_json)


@app.command(rich_help_panel=Group.store)
def columns(
    study: StudyName, results: Results = Path("results"), as_json: Json = False
) -> None:
    """List the columns of the tables of a study.

    Prints the type, the unit and the meaning of each column.

    Examples
    --------
    sweep columns my/first
    sweep columns my/first --json
    """
    from sweep.tables import StoredStudy

    _show(StoredStudy(study, results).columns, as_json)


def _show(rows: "pd.DataFrame", as_json: bool) -> None:
    if as_json:
        from sweep.tables import rows_as_json

        print(rows_as_json(rows))
        return
    from rich.table import Table

    from sweep.cli.terminal import console

    shown = rows.loc[:, (rows.notna() & (rows != "")).any()].astype(object).fillna("")
    table = Table(*shown)
    for row in shown.itertuples(index=False):
        table.add_row(*map(_cell, row))
    console().print(table)


def _cell(value: object) -> str:
    return f"{value:,.0f}" if isinstance(value, int | float) else str(value)
