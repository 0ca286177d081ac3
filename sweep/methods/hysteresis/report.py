"""The report of chains: the loops between way up and way down."""

from collections.abc import Sequence

from sweep.analysis import with_interval
from sweep.methods.hysteresis.analysis import FoundLoop, loop_rows
from sweep.tables import Report, StoredStudy, TextTable, brief, json_rows
from sweep.text import so_many


def hysteresis_report(study: StoredStudy, loops: Sequence[FoundLoop]) -> Report:
    """Return the area of each loop, and the values at which the directions differ.

    docs/json.md describes each key.
    """
    axis = _axis_of(study)
    rows = loop_rows(loops)
    facts = {"study": study.name, "axis": axis, "confidence": 0.95}
    notes = [
        f"area: integral of down minus up over {axis}, mean with 95 % confidence"
        " interval over complete chains (Student)",
        "differ: range of values at which the simultaneous 95 % confidence intervals of"
        " the differences exclude 0",
    ]
    if most := max(loop.incomplete for loop in loops):
        notes.append(f"up to {so_many(most, 'chain')} left out, which lack a link")
    table = TextTable(
        columns=[*loops[0].settings, "metric", "area", "differ", "width", "chains"],
        rows=[_cells(loop) for loop in loops],
        title=f"{study.name}: loops over {axis}",
        caption="\n".join(notes),
    )
    return Report(rows, facts | {"loops": json_rows(rows)}, [table])


def _axis_of(study: StoredStudy) -> str:
    """Return the axis that is continued."""
    assert study.about.continued
    return str(study.about.continued["axis"])


def _cells(loop: FoundLoop) -> list[str]:
    area = loop.loop.area
    apart = loop.values[loop.loop.apart]
    differ = "nowhere"
    if len(apart):
        differ = f"{brief(float(apart.min()))} to {brief(float(apart.max()))}"
    return [
        *map(brief, loop.settings.values()),
        loop.metric,
        with_interval(area.value, area.low, area.high),
        differ,
        brief(loop.loop.width),
        str(loop.loop.chains),
    ]
