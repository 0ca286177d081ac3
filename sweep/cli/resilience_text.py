"""What failures do, for a reader in a terminal or for a program."""

import json

import pandas as pd
from rich.table import Table

from sweep.analysis.notation import with_interval
from sweep.cli.terminal import console
from sweep.tables.json_rows import json_rows
from sweep.tables.means_text import brief
from sweep.tables.resilience import PARTS, TIME
from sweep.tables.stored_study import StoredStudy
from sweep.text import so_many


def resilience_json(study: StoredStudy, rows: pd.DataFrame, within: float) -> str:
    """A row a point and metric; docs/json.md says what each key is."""
    about = {"study": study.name, "within": within, "confidence": 0.95}
    about["unit_of_time"] = study.units.get(TIME, "")
    return json.dumps(about | {"rows": json_rows(rows)}, indent=2)


def resilience_text(study: StoredStudy, rows: pd.DataFrame, within: float) -> None:
    """Print what is kept, how many come back, and when."""
    measured = {"metric", "pairs", "lack"}
    measured |= {part + end for part in PARTS for end in ("", "_low", "_high")}
    settings = [str(name) for name in rows.columns if name not in measured]
    notes = [
        "kept: mean after the failure, divided by that of the same trial without",
        f"recovered: share of pairs that are within {within:.0%} of that level at the"
        " end; time: from the failure until they stay there, of those",
    ]
    if lack := int(rows["lack"].max()):
        notes.append(
            f"up to {so_many(lack, 'trial')} left out, without partner or value"
        )
    *shares, time = PARTS
    table = Table(
        *settings,
        *("metric", *shares, f"{time} ({study.units.get(TIME, '')})", "pairs"),
        title=f"{study.name}: resilience",
        caption="\n".join(notes),
    )
    for _, row in rows.iterrows():
        cells = (
            with_interval(row[part], row[f"{part}_low"], row[f"{part}_high"])
            for part in PARTS
        )
        table.add_row(
            *(brief(row[name]) for name in settings),
            *(str(row["metric"]), *cells, str(row["pairs"])),
        )
    console().print(table)
