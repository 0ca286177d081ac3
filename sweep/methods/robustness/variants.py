"""The variants of a study that `validate` asks for: the same study with shorter time
steps, another search for neighbours, or another order of updates.

Each is a whole spec, and its study lies in the folder of the first one.
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
from sweep.spec.axes import Axis
from sweep.spec.axis_keys import HOLD
from sweep.spec.mistakes import Mistakes
from sweep.spec.sections import SpecSection, StudyVariant, check_names
from sweep.spec.settings import NotAllowedError, Setting, Value
from sweep.spec.strict_yaml import parse_document
from sweep.spec.study import ALL_PAIRS, Study
from sweep.spec.study_folder import why_no_name
from sweep.text import shortened

WITHOUT_GRID = "all-pairs"
STEPS = "steps"


class UncutError(ValueError):
    """The steps of a study cannot be cut; the message says why."""


def named_variants(study: Study, asked: Validate) -> dict[str, str]:
    """The names of the variants of a study, with what differs in words."""
    step = time_step(study.settings)
    found = {name: f"{step} 1/{parts}" for name, parts in _shorter(asked).items()}
    if asked.search:
        found[WITHOUT_GRID] = "all pairs"
    others = _other(study, asked).items()
    return found | {name: f"{order} updates" for name, order in others}


def study_variants(study: Study, asked: Validate) -> list[StudyVariant]:
    """The variants of a study. Raises one SpecError with all that cannot be."""
    words = named_variants(study, asked)
    found, mistakes = list[tuple[str, str, dict[str, Any]]](), Mistakes()
    with mistakes.noted():
        for name, parts in _shorter(asked).items():
            found.append((name, "dt", _cut(study, name, parts)))
    if asked.search:
        spec = _named(study, WITHOUT_GRID) | {"neighbour_search": ALL_PAIRS}
        found.append((WITHOUT_GRID, "search", spec))
    with mistakes.noted():
        for name, order in _other(study, asked).items():
            found.append((name, "update", _updated(study, _named(study, name), order)))
    mistakes.check()
    return [
        StudyVariant(name, words[name], (KEY.name, key), spec)
        for name, key, spec in found
    ]


def in_parts(study: Study, parts: int) -> dict[str, Any]:
    """The spec of a study with each step cut into so many parts: frames stay at the
    same times, settings that act once in each step change by their rules, and a trial
    may take so many times as long. Raises UncutError where that cannot be.
    """
    if time_step(study.settings) is None:
        raise UncutError(
            f"model {study.model} has no time step that could be shorter: its equations"
            " are not continuous in time"
        )
    spec, changed = _own(study), changed_by_steps(study)
    for one in study.expressions:
        if used := sorted(one.names & {*changed}):
            raise UncutError(
                f'"{one.text}" uses {" and ".join(used)}, which a shorter step changes:'
                " it would mean something else"
            )
    for name, setting in changed.items():
        _change(study, spec, name, setting, parts)
    record = {"every": study.record.every * parts}
    spec["record"] = spec.get("record", {}) | record
    if study.time_limit is not None:
        spec["time_limit"] = study.time_limit * parts
    return spec


def changed_by_steps(study: Study) -> dict[str, Setting]:
    """The settings that a shorter step changes."""
    settings = study.settings.items()
    return {name: one for name, one in settings if one.in_steps or one.each_step}


def record_of(study: Study, asked: Validate) -> list[dict[str, Any]]:
    """What a plan records of the variants: their names, what differs in `words`, and
    the metrics that are `unjudged`, as they are of something else there.
    """
    return [
        {"name": name, "words": words, "unjudged": unjudged(study, asked, name)}
        for name, words in named_variants(study, asked).items()
    ]


def check_record(record: list[dict[str, Any]], about: Mapping[str, Any]) -> None:
    """Raise ValueError unless the variants have names of studies, each its own, and the
    metrics are those of the study.
    """
    check_names("variant", names := [one["name"] for one in record], names)
    for one in record:
        name = one["name"]
        if "/" in name or why_no_name(name):
            raise ValueError(f'no variant can be called "{shortened(name)}"')
        check_names("metric", one["unjudged"], about["record"])


def unjudged(study: Study, asked: Validate, variant: str) -> list[str]:
    """The recorded metrics that are of something else in a variant: with shorter steps
    those that measure what one step changes, and those derived from these or from
    settings that change with the step.
    """
    if variant not in _shorter(asked):
        return []
    known, changed = study.known.metrics, {*changed_by_steps(study)}
    found = [name for name in study.record.metrics if known[name].per_step]
    for one in study.record.derive:
        if one.expression.names & {*found, *changed}:
            found.append(one.name)
    return found


def _shorter(asked: Validate) -> dict[str, int]:
    """By the names of the variants with shorter steps, the parts of a step."""
    return {f"dt-1of{parts}": parts for parts in sorted(asked.dt) if parts > 1}


def _other(study: Study, asked: Validate) -> dict[str, str]:
    """By the names of their variants, the orders of updates that a study has not."""
    if not asked.update:
        return {}
    own = (study.preset_settings | study.fixed)[UPDATE]
    orders = [order for order in study.settings[UPDATE].choices if order != own]
    return {f"update-{order}": order for order in orders}


def _named(study: Study, name: str) -> dict[str, Any]:
    """The spec of a study without `validate`, as that of a variant."""
    return _own(study) | {"study": f"{study.name}/{name}"}


def _own(study: Study) -> dict[str, Any]:
    """The spec of a study without `validate`."""
    spec: dict[str, Any] = parse_document(study.text, study.path).value
    left = {key: value for key, value in spec.items() if key != KEY.name}
    return copy.deepcopy(left)


def _updated(study: Study, spec: dict[str, Any], order: str) -> dict[str, Any]:
    """The spec with that order of updates."""
    if study.place_of(UPDATE) not in (None, ("fixed", UPDATE)):
        raise study.document.error(
            (KEY.name, "update"),
            f'"{UPDATE}" varies in the study already: leave update out',
        )
    return spec | {"fixed": spec.get("fixed", {}) | {UPDATE: order}}


def _cut(study: Study, name: str, parts: int) -> dict[str, Any]:
    """The spec of a variant whose steps are cut. Raises SpecError where they cannot."""
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
    """Give a setting the value that it has where steps are cut. Raises UncutError, and
    NotAllowedError where the setting cannot have it, as a number of steps that is too
    large.
    """

    def cut(value: Any) -> Value:
        return setting.coerce(setting.in_parts(value, parts))

    held = next((one for one in study.axes if one.continued), None)
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
        zipped[name] = [cut(one) for one in zipped[name]]
        return
    if not _is_plain(axis, name):
        raise UncutError(
            f'"{name}" changes with the step, and stands on an axis that has more than'
            " a list or a grid of its values"
        )
    spec["sweep"][name] = [cut(one) for one in axis.columns[name].tolist()]


def _zipped(spec: dict[str, Any], axis: Axis, name: str) -> dict[str, Any] | None:
    """The lists of an axis that varies several settings together, if the values of this
    one are such a list.
    """
    given = spec["sweep"].get(axis.name) if axis.place[0] == "sweep" else None
    zipped = given.get("zip") if isinstance(given, dict) else None
    listed = isinstance(zipped, dict) and isinstance(zipped.get(name), list)
    return zipped if listed else None


def _is_plain(axis: Axis, name: str) -> bool:
    """Whether an axis has nothing but the values of one setting, in one design."""
    alone = list(axis.columns) == [name] and not axis.sampler and not axis.when
    return alone and axis.place == ("sweep", name)


def _expression(setting: Setting, given: Any, parts: int) -> str:
    """The same for what an expression computes."""
    if setting.in_steps:
        return f"({given}) * {parts}"
    return {
        "time": f"({given}) / {parts}",
        "share": f"1 - (1 - ({given})) ** (1 / {parts})",
        "noise": f"({given}) * {parts} ** 0.5",
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
