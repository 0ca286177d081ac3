"""Check that a spec can be the origin of a stored plan, which may be untrusted.

`sweep/store/origin.py` checks the shape of the provenance during reading. This module
checks the names, and the numbers that must agree.
"""

from collections.abc import Collection
from typing import Any

import pyarrow as pa

from kernels.catalogue import Catalogue
from sweep.errors import StoreError
from sweep.spec import (
    DIRECTION,
    SAMPLERS,
    WAYS,
    check_names,
    in_blocks,
    sections,
    settings_of,
    why_no_detail,
)
from sweep.tables.stored_links import check_links
from sweep.text import shortened


def check_plan(
    study: str, plan: pa.Table, provenance: dict[str, Any], named: Catalogue
) -> None:
    """Raise StoreError unless a launch can have written a plan and its provenance.

    Parameters
    ----------
    study : str
        The study, for errors.
    plan : pyarrow.Table
    provenance : dict
        The provenance of the plan.
    named : Catalogue
        The models, metrics, maps and more by name.
    """
    try:
        _check(provenance, named)
        check_links(plan, provenance)
    except ValueError as error:
        raise StoreError(
            f"its plan is not what a launch writes: {error}", study
        ) from None


def _check(provenance: dict[str, Any], named: Catalogue) -> None:
    settings = _settings(provenance, named)
    chained = {DIRECTION} if "continued" in provenance else set[str]()
    check_names("parameter", provenance["varied"], settings | chained)
    check_names("metric", provenance["record"], set(provenance["record"]) - settings)
    if not provenance["record"]:
        raise ValueError("it records no metric")
    ablated = provenance.get("ablated", {})
    axes = provenance.get("axes", {})
    if "details" in provenance:
        _check_details(provenance["details"], ablated, axes)
    for preset, groups in ablated.items():
        presets = named.models[provenance["model"]].presets
        if "details" not in provenance and preset not in presets:
            raise ValueError(f'there is no preset "{preset}"')
        if not groups or not all(groups):
            raise ValueError(f'"{preset}" ablates no parameter')
        names = [name for group in groups for name in group]
        check_names("parameter", names, provenance["varied"])
    for name, axis in axes.items():
        check_names("parameter", axis["fields"], settings)
        if not axis["fields"]:
            raise ValueError(f'axis "{name}" has no parameters')
        if axis["sampler"] in in_blocks():
            _check_blocks(name, axis)
    if "continued" in provenance:
        _check_continued(provenance["continued"], axes)
    for name, section in sections().items():
        if name in provenance:
            section.check_recorded(provenance[name], provenance)


def _settings(provenance: dict[str, Any], named: Catalogue) -> set[str]:
    """Return the parameters of the model, or of all models if a plan names none."""
    models = named.models
    if "model" not in provenance:
        every = [settings_of(model, named) for model in models]
        return {name for settings in every for name in (*settings, *settings.spreads)}
    model = provenance["model"]
    preset = provenance["preset"]
    if model not in models or preset not in models[model].presets:
        raise ValueError(f'there is no preset "{preset}" of "{model}"')
    settings = settings_of(model, named)
    return {*settings, *settings.spreads}


def _check_details(
    names: list[str], ablated: dict[str, Any], axes: Collection[str]
) -> None:
    """Raise ValueError unless named components belong to exactly one axis."""
    if len(ablated) != 1:
        raise ValueError("named components need exactly one ablated axis")
    ((axis, groups),) = ablated.items()
    check_names("axis", [axis], axes)
    if len(names) != len(groups):
        raise ValueError(f"{len(groups)} components have {len(names)} names")
    check_names("detail", names, names)
    for name in names:
        if why := why_no_detail(name):
            raise ValueError(
                f'no component can have the name "{shortened(name)}": {why}'
            )


def _check_blocks(name: str, axis: dict[str, Any]) -> None:
    """Raise ValueError unless an axis has the blocks that the sampler makes.

    `rows` of the axis has the row of the sample for each point.
    """
    rules = SAMPLERS[axis["sampler"]].blocks
    assert rules
    size = axis.get("size", 0)
    levels = axis.get("levels")
    rows = axis.get("rows", [])
    sizes = [block.of(len(axis["fields"])) for block in rules.sizes]
    valid = isinstance(rows, list) and all(
        type(row) is int and row >= 0 for row in rows
    )
    if size not in sizes or not valid or len(rows) % size:
        raise ValueError(
            f'axis "{name}" has no blocks of the size of a {axis["sampler"]} sample'
        )
    if rules.leveled and not (type(levels) is int and levels >= 2):
        raise ValueError(f'axis "{name}" has no levels')


def _check_continued(rule: dict[str, Any], axes: Collection[str]) -> None:
    """Raise ValueError unless an axis is continued, in directions of a spec."""
    check_names("axis", [rule["axis"]], axes)
    if tuple(rule["directions"]) not in WAYS.values():
        raise ValueError(f"chains cannot have the directions {rule['directions']}")
