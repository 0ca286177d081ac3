"""What a stored plan says of its study is what a spec could have said: it may come from
anyone.

Its shape is checked where it is read, in `sweep/store/origin.py`. Here it is what the
names mean, and which numbers go together.
"""

from collections.abc import Collection
from typing import Any

import pyarrow as pa

from kernels.catalogue import Catalogue
from sweep.errors import StoreError
from sweep.spec.ablation import why_no_detail
from sweep.spec.continuing import DIRECTION, WAYS
from sweep.spec.samplers import SAMPLERS, in_blocks
from sweep.spec.sections import check_names
from sweep.spec.settings import settings_of
from sweep.spec.study import sections
from sweep.tables.stored_links import check_links
from sweep.text import shortened


def check_plan(
    study: str, plan: pa.Table, about: dict[str, Any], named: Catalogue
) -> None:
    """Raise StoreError where a plan or its provenance is not what a launch writes; its
    names are those of the catalogue.
    """
    try:
        _check(about, named)
        check_links(plan, about)
    except ValueError as error:
        raise StoreError(
            f"its plan is not what a launch writes: {error}", study
        ) from None


def _check(about: dict[str, Any], named: Catalogue) -> None:
    known = _settings(about, named)
    chained = {DIRECTION} if "continued" in about else set[str]()
    check_names("setting", about["varied"], known | chained)
    check_names("metric", about["record"], set(about["record"]) - known)
    if not about["record"]:
        raise ValueError("it records nothing")
    ablated = about.get("ablated", {})
    if "details" in about:
        _check_details(about["details"], ablated, about.get("axes", {}))
    for preset, groups in ablated.items():
        presets = named.models[about["model"]].presets
        if "details" not in about and preset not in presets:
            raise ValueError(f'there is no preset "{preset}"')
        if not groups or not all(groups):
            raise ValueError(f'"{preset}" ablates nothing')
        names = [name for group in groups for name in group]
        check_names("setting", names, about["varied"])
    for name, axis in about.get("axes", {}).items():
        check_names("setting", axis["fields"], known)
        if not axis["fields"]:
            raise ValueError(f'axis "{name}" has no settings')
        if axis["sampler"] in in_blocks():
            _check_blocks(name, axis)
    if "continued" in about:
        _check_continued(about["continued"], about)
    for name, section in sections().items():
        if name in about:
            section.check_recorded(about[name], about)


def _settings(about: dict[str, Any], named: Catalogue) -> set[str]:
    """The names of the model's settings; of any model's if a plan names none."""
    models = named.models
    if "model" not in about:
        every = [settings_of(model, named) for model in models]
        return {name for one in every for name in (*one, *one.spreads)}
    if (
        about["model"] not in models
        or about["preset"] not in models[about["model"]].presets
    ):
        raise ValueError(
            f'there is no preset "{about["preset"]}" of "{about["model"]}"'
        )
    settings = settings_of(about["model"], named)
    return {*settings, *settings.spreads}


def _check_details(
    names: list[str], ablated: dict[str, Any], axes: Collection[str]
) -> None:
    """The details that a spec names are those of one of its axes."""
    if len(ablated) != 1:
        raise ValueError("one axis has details with names")
    ((axis, groups),) = ablated.items()
    check_names("axis", [axis], axes)
    if len(names) != len(groups):
        raise ValueError(f"{len(groups)} details have {len(names)} names")
    check_names("detail", names, names)
    for name in names:
        if why := why_no_detail(name):
            raise ValueError(f'no detail is called "{shortened(name)}": {why}')


def _check_blocks(name: str, axis: dict[str, Any]) -> None:
    """A sample whose points come in blocks is read so; `rows` places each point."""
    rules = SAMPLERS[axis["sampler"]].blocks
    assert rules
    count, size, levels = len(axis["fields"]), axis.get("size", 0), axis.get("levels")
    sizes = [one.of(count) for one in rules.sizes]
    rows = axis.get("rows", [])
    whole = isinstance(rows, list) and all(
        type(row) is int and row >= 0 for row in rows
    )
    if size not in sizes or not whole or len(rows) % size:
        raise ValueError(
            f'axis "{name}" has no blocks of the size of a {axis["sampler"]} sample'
        )
    if rules.leveled and not (type(levels) is int and levels >= 2):
        raise ValueError(f'axis "{name}" has no levels')


def _check_continued(rule: dict[str, Any], about: dict[str, Any]) -> None:
    """One axis is continued, in directions that a spec can have."""
    check_names("axis", [rule["axis"]], about.get("axes", {}))
    if tuple(rule["directions"]) not in WAYS.values():
        raise ValueError(f"chains have no directions {rule['directions']}")
