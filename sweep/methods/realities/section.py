"""The section `realities` of a spec: imperfections that are drawn many times.

The section is an axis. The first row is the design world, with the values of `fixed`
and the preset. Each further row is a pseudo-reality: one draw of all imperfections. All
functions raise SpecError, with file and line, for values that are not allowed.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from sweep.spec import (
    Axis,
    Entry,
    Key,
    Mistakes,
    ModelSchemas,
    ReadLater,
    Schema,
    SpecContext,
    SpecSection,
    Study,
    Value,
    Whole,
    check_names,
    distinct_rows,
    read_values,
    section_schema,
)
from sweep.text import unknown

LEAST_DRAWS = 10
"""With fewer draws, the worst tenth of the draws is less than one draw."""
MOST_DRAWS = 100_000


@dataclass(frozen=True)
class Realities:
    """The keys of the section besides the imperfections."""

    draws: Annotated[
        int,
        Key(
            Whole(LEAST_DRAWS, MOST_DRAWS),
            "number of pseudo-realities; each pseudo-reality is one draw of all"
            " imperfections, common to all points of `sweep`",
            example="200",
        ),
    ]


def _form() -> Schema:
    """Return the schema of the section; the schema of a model narrows it."""
    return section_schema(Realities) | {"additionalProperties": {"type": "object"}}


KEY = Key(
    ReadLater(
        "parameters, each with a distribution, and the number of draws",
        _form,
        parts=(Realities,),
    ),
    "imperfections of robots and of the environment, each a parameter with a"
    " distribution. Each point runs in the design world, with the values of `fixed` and"
    " the preset, and in `draws` pseudo-realities. `sweep gap` compares the two",
    name="realities",
    otherwise="only the design world",
    example="{position_noise: {loguniform: [1, 10]}, draws: 200}",
)


def read_realities(root: Entry, context: SpecContext) -> Realities:
    """Return the section, with separate checks of each value."""
    entry = root.child(KEY.name)
    mistakes = Mistakes()
    entry.mapping()
    with mistakes.noted():
        if "draws" not in entry.value:
            raise entry.lacks("draws", 'missing "draws": the number of realities')
    values = read_values(Realities, entry, mistakes)
    for name, child in _imperfections(entry).items():
        with mistakes.noted():
            if name not in context.settings:
                raise child.error(
                    unknown("parameter", name, [*context.settings, "draws"])
                )
    with mistakes.noted():
        if not _imperfections(entry):
            raise entry.error(
                f'"{KEY.name}" has no imperfection: name at least one parameter with a'
                " distribution, such as packet_loss: {uniform: [0, 0.5]}"
            )
    mistakes.check()
    return Realities(**values)


def _imperfections(entry: Entry) -> dict[str, Entry]:
    """Return the distribution of each imperfection of the section."""
    return {name: child for name, child in entry.mapping() if name != "draws"}


def _axis(root: Entry, section: Realities, context: SpecContext) -> Axis:
    """Return the axis with the design world and the draws, without repetitions."""
    entry = root.child(KEY.name)
    members = _imperfections(entry)
    drawn = context.reader.draw(entry.name, members, section.draws)
    columns = {}
    for name, values in drawn.items():
        base = context.settings[name].column([_design_value(name, context)])
        columns[name] = np.concatenate([base, values])
    distinct, _ = distinct_rows([*columns.values()])
    if len(distinct) <= LEAST_DRAWS:
        raise entry.error(
            f"the {section.draws} draws have only {len(distinct) - 1} different"
            f" realities besides the design world; at least {LEAST_DRAWS} are needed:"
            ' give a parameter a range, or list the values under "sweep"'
        )
    return Axis(
        entry.name,
        {name: values[distinct] for name, values in columns.items()},
        place=entry.place,
        merged=len(next(iter(columns.values()))) - len(distinct),
        has_base=True,
    )


def _design_value(name: str, context: SpecContext) -> Value:
    """Return the value of a parameter in the design world."""
    return context.fixed.get(name, context.preset[name])


def _model_schema(forms: ModelSchemas) -> Schema:
    """Return the schema of the section for a model."""
    keys = {"properties": {"draws": True}}
    return forms.drawn | keys | {"propertyNames": {"enum": [*forms.names, "draws"]}}


def record_of(study: Study, _section: Realities) -> dict[str, Any]:
    """Return the record for a plan.

    The record has the imperfections of the design world, and the number of draws that
    repeat a reality or the design world, if any do.
    """
    axis = next(axis for axis in study.axes if axis.name == KEY.name)
    design = {name: axis.columns[name].item(0) for name in axis.columns}
    return {"design": design} | ({"repeated": axis.merged} if axis.merged else {})


def check_record(record: dict[str, Any], plan: Mapping[str, Any]) -> None:
    """Check a record of a plan. ValueError if no spec can have such a record."""
    axis = plan.get("axes", {}).get(KEY.name)
    if axis is None:
        raise ValueError(f'the plan has no axis "{KEY.name}"')
    imperfections = [*record["design"]]
    check_names("imperfection", imperfections, axis["fields"])
    if len(imperfections) < len(axis["fields"]):
        raise ValueError("an imperfection has no value in the design world")
    repeated = record.get("repeated", 0)
    if not isinstance(repeated, int) or repeated < 0:
        raise ValueError(f"{repeated!r} is no number of repeated draws")


SECTION = SpecSection(
    KEY,
    read=read_realities,
    axis=_axis,
    not_beside={
        "search": "the points of a search are no fixed controllers",
        "refine": "the boundary would be sought in each reality",
        "calibrate": "the prior is the only axis of a calibration",
    },
    model_schema=_model_schema,
    recorded=record_of,
    shape={"design": {str: bool | int | float | str}},
    check_recorded=check_record,
)
