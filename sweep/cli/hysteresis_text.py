"""The loops of chains, for a reader in a terminal or for a program."""

import json
from collections.abc import Sequence

from rich.table import Table

from sweep.analysis.notation import with_interval
from sweep.cli.terminal import console
from sweep.tables.hysteresis import FoundLoop, loop_rows
from sweep.tables.json_rows import json_rows
from sweep.tables.means_text import brief
from sweep.tables.stored_study import StoredStudy
from sweep.text import so_many


def hysteresis_json(study: StoredStudy, loops: Sequence[FoundLoop]) -> str:
    """A row a loop; docs/json.md says what each key is."""
    rows = json_rows(loop_rows(loops))
    about = {"study": study.name, "axis": axis_of(study), "confidence": 0.95}
    return json.dumps(about | {"loops": rows}, indent=2)


def axis_of(study: StoredStudy) -> str:
    """The axis that is continued."""
    assert study.about.continued
    return str(study.about.continued["axis"])


def hysteresis_text(study: StoredStudy, loops: Sequence[FoundLoop]) -> None:
    """Print the area of each loop, and where both directions differ."""
    axis = axis_of(study)
    others = list(loops[0].settings)
    notes = [
        f"area: integral of down less up over {axis}, mean with its 95 % interval"
        " over whole chains (Student)",
        "differ: between these values the intervals of the differences exclude 0, all"
        " of them together with 95 %",
    ]
    if most := max(one.incomplete for one in loops):
        notes.append(f"up to {so_many(most, 'chain')} left out, which lack a link")
    table = Table(
        *others,
        *("metric", "area", "differ", "width", "chains"),
        title=f"{study.name}: loops over {axis}",
        caption="\n".join(notes),
    )
    for one in loops:
        table.add_row(*map(brief, one.settings.values()), *_cells(one))
    console().print(table)


def _cells(one: FoundLoop) -> list[str]:
    area, apart = one.found.area, one.values[one.found.apart]
    differ = "nowhere"
    if len(apart):
        differ = f"{brief(float(apart.min()))} to {brief(float(apart.max()))}"
    return [
        one.metric,
        with_interval(area.value, area.low, area.high),
        differ,
        brief(one.found.width),
        str(one.found.chains),
    ]
