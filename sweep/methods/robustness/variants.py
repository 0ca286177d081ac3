"""The variants of a study: a copy of the study with other numerics, from `validate`.

Variants have shorter time steps, another search for neighbours, or another order of
updates. Each variant is a complete spec, and its study is stored in the folder of the
first study.
"""

import copy
from collections.abc import Mapping
from typing import Any

from sweep.methods.robustness.section import (
    KEY,
    UPDATE,
    Validate,
    check_validate,
    read_validate,
    time_step,
)
from sweep.spec import (
    ALL_PAIRS,
    HOLD,
    Axis,
    Mistakes,
    NotAllowedError,
    Setting,
    SpecSection,
    Study,
    StudyVariant,
    Value,
    check_names,
    parse_document,
    why_no_name,
)
from sweep.text import shortened

WITHOUT_GRID = "all-pairs"
STEPS = "steps"


class UncutError(ValueError):
    """The steps of a study cannot be cut into parts; the message has the reason."""


def named_variants(study: Study, section: Validate) -> dict[str, str]:
    """Return the difference of each variant in words, by name."""
    step = time_step(study.settings)
    descriptions = {
        name: f"{step} 1/{parts}" for name, parts in _shorter(section).items()
    }
    if section.search:
        descriptions[WITHOUT_GRID] = "all pairs"
    orders = _other_orders(study, section).items()
    return descriptions | {name: f"{order} updates" for name, order in orders}


def study_variants(study: Study, section: Validate) -> list[StudyVariant]:
    """Return the variants of a study. One SpecError reports all impossible variants."""
    descriptions = named_variants(study, section)
    specs = list[tuple[str, str, dict[str, Any]]]()
    mistakes = Mistakes()
    with mistakes.noted():
        for name, parts in _shorter(section).items():
            specs.append((name, "dt", _cut(study, name, parts)))
    if section.search:
        spec = _named(study, WITHOUT_GRID) | {"neighbour_search": ALL_PAIRS}
        specs.append((WITHOUT_GRID, "search", spec))
    with mistakes.noted():
        for name, order in _other_orders(study, section).items():
            specs.append((name, "update", _updated(study, _named(study, name), order)))
    mistakes.check()
    return [
        StudyVariant(name, descriptions[name], (KEY.name, key), spec)
        for name, key, spec in specs
    ]


def in_parts(study: Study, parts: int) -> dict[str, Any]:
    """Return the spec of a study with each time step cut into parts.

    Frames keep their times. Parameters that act once per step change by their rules,
    and the time limit of a trial becomes `parts` times as long. UncutError if steps
    cannot be cut.
    """
    if time_step(study.settings) is None:
        raise UncutError(
            f"model {study.model} has no time step that could be shorter: the equations"
            " are not continuous in time"
        )
    spec = _own(study)
    changed = changed_by_steps(study)
    for expression in study.expressions:
        if used := sorted(expression.names & {*changed}):
            raise UncutError(
                f'"{expression.text}" uses {" and ".join(used)}, which a shorter step'
                " changes: the meaning would differ"
            )
    for name, setting in changed.items():
        _change(study, spec, name, setting, parts=parts)
    record = {"every": study.record.every * parts}
    spec["record"] = spec.get("record", {}) | record
    if study.time_limit is not None:
        spec["time_limit"] = study.time_limit * parts
    return spec


def changed_by_steps(study: Study) -> dict[str, Setting]:
    """Return the parameters that change with a shorter time step, by name."""
    return {
        name: setting
        for name, setting in study.settings.items()
        if setting.in_steps or setting.each_step
    }


def record_of(study: Study, section: Validate) -> list[dict[str, Any]]:
    """Return the record of the variants for a plan.

    Each record has `name`, the difference in `words`, and `unjudged`, the metrics with
    a different meaning in the variant.
    """
    return [
        {"name": name, "words": description, "unjudged": unjudged(study, section, name)}
        for name, description in named_variants(study, section).items()
    ]


def check_record(record: list[dict[str, Any]], plan: Mapping[str, Any]) -> None:
    """Check a record: unique names of studies, and metrics of the study.

    ValueError if a name or a metric is not allowed. `plan` is the description of the
    study in the plan.
    """
    check_names("variant", names := [variant["name"] for variant in record], names)
    for variant in record:
        name = variant["name"]
        if "/" in name or why_no_name(name):
            raise ValueError(f'no variant can have the name "{shortened(name)}"')
        check_names("metric", variant["unjudged"], plan["record"])


def unjudged(study: Study, section: Validate, variant: str) -> list[str]:
    """Return the recorded metrics with a different meaning in a variant.

    Parameters
    ----------
    study : Study
    section : Validate
    variant : str
        Name of the variant.

    Returns
    -------
    list of str
        Empty unless the variant has shorter steps. Then the metrics that measure the
        change in one step, and metrics derived from them or from parameters that change
        with the step.
    """
    if variant not in _shorter(section):
        return []
    declared = study.catalogue.metrics
    changed = {*changed_by_steps(study)}
    metrics = [name for name in study.record.metrics if declared[name].per_step]
    for derived in study.record.derive:
        if derived.expression.names & {*metrics, *changed}:
            metrics.append(derived.name)
    return metrics


def _shorter(section: Validate) -> dict[str, int]:
    """Return the parts of a step by the names of variants with shorter steps."""
    return {f"dt-1of{parts}": parts for parts in sorted(section.dt) if parts > 1}


def _other_orders(study: Study, section: Validate) -> dict[str, str]:
    """Return the orders of updates that a study lacks, by the names of variants."""
    if not section.update:
        return {}
    own = (study.preset_settings | study.fixed)[UPDATE]
    orders = [order for order in study.settings[UPDATE].choices if order != own]
    return {f"update-{order}": order for order in orders}


def _named(study: Study, name: str) -> dict[str, Any]:
    """Return the spec of a study without `validate`, with the name of a variant."""
    return _own(study) | {"study": f"{study.name}/{name}"}


def _own(study: Study) -> dict[str, Any]:
    """Return the spec of a study without `validate`."""
    spec: dict[str, Any] = parse_document(study.text, study.path).value
    left = {key: value for key, value in spec.items() if key != KEY.name}
    return copy.deepcopy(left)


def _updated(study: Study, spec: dict[str, Any], order: str) -> dict[str, Any]:
    """Return the spec with an order of updates."""
    if study.place_of(UPDATE) not in (None, ("fixed", UPDATE)):
        raise study.document.error(
            (KEY.name, "update"),
            f'"{UPDATE}" already varies in the study: leave update out',
        )
    return spec | {"fixed": spec.get("fixed", {}) | {UPDATE: order}}


def _cut(study: Study, name: str, parts: int) -> dict[str, Any]:
    """Return the spec of a variant with cut steps. SpecError if impossible."""
    place = (KEY.name, "dt")
    try:
        return in_parts(study, parts) | {"study": f"{study.name}/{name}"}
    except UncutError as error:
        raise study.document.error(place, f"{error}; leave dt out") from None
    except NotAllowedError as error:
        raise study.document.error(place, str(error)) from None


def _change(
    study: Study, spec: dict[str, Any], name: str, setting: Setting, parts: int
) -> None:
    """Change a parameter in a spec to its value with cut steps.

    UncutError if the value cannot be changed. NotAllowedError if the parameter does not
    allow the new value, such as a number of steps that is too large.
    """

    def cut(value: Any) -> Value:
        return setting.coerce(setting.in_parts(value, parts))

    held = next((axis for axis in study.axes if axis.continued), None)
    if name == STEPS and held and held.continued and held.continued.hold:
        spec["sweep"][held.name][HOLD.name] = cut(held.continued.hold)
        return
    place = study.place_of(name)
    if place is None or place[0] == "fixed":
        value = (study.preset_settings | study.fixed)[name]
        new = cut(value)
        if new != value:
            spec["fixed"] = spec.get("fixed", {}) | {name: new}
        return
    if place[0] == "derive":
        spec["derive"][name] = _expression(setting, spec["derive"][name], parts)
        return
    axis = next(axis for axis in study.axes if name in axis.columns)
    if zipped := _zipped(spec, axis, name):
        zipped[name] = [cut(value) for value in zipped[name]]
        return
    if not _is_plain(axis, name):
        raise UncutError(
            f'"{name}" changes with the step, but its axis has more than a list or a'
            " grid of values"
        )
    spec["sweep"][name] = [cut(value) for value in axis.columns[name].tolist()]


def _zipped(spec: dict[str, Any], axis: Axis, name: str) -> dict[str, Any] | None:
    """Return the lists of an axis that varies several parameters together.

    None if the parameter has no list of values.
    """
    written = spec["sweep"].get(axis.name) if axis.place[0] == "sweep" else None
    zipped = written.get("zip") if isinstance(written, dict) else None
    listed = isinstance(zipped, dict) and isinstance(zipped.get(name), list)
    return zipped if listed else None


def _is_plain(axis: Axis, name: str) -> bool:
    """Return whether an axis has only the values of one parameter, in one design."""
    alone = list(axis.columns) == [name] and not axis.sampler and not axis.when
    return alone and axis.place == ("sweep", name)


def _expression(setting: Setting, expression: Any, parts: int) -> str:
    """Return an expression of a parameter, changed for cut steps."""
    if setting.in_steps:
        return f"({expression}) * {parts}"
    return {
        "time": f"({expression}) / {parts}",
        "share": f"1 - (1 - ({expression})) ** (1 / {parts})",
        "noise": f"({expression}) * {parts} ** 0.5",
    }[setting.each_step]


SECTION = SpecSection(
    KEY,
    read=read_validate,
    check=check_validate,
    not_beside={"search": "", "refine": ""},
    needs={"required": ["sweep"]},
    variants=study_variants,
    recorded=record_of,
    shape=[{"name": str, "words": str, "unjudged": [str]}],
    check_recorded=check_record,
)
