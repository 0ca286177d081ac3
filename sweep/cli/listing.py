"""Tables of models, maps and metrics, and of the status of a study."""

import json
import math
from typing import Any

from rich.table import Table

from kernels.catalogue import Catalogue
from kernels.metrics import METRICS
from kernels.model import Model
from kernels.models import MODELS
from kernels.profiles import PROFILES
from kernels.registry import Registry
from kernels.worlds import MAPS
from sweep.design import about
from sweep.method import methods
from sweep.published import built_in_studies
from sweep.spec import (
    WRAPS_ONLY,
    Settings,
    Value,
    declaration_of,
    only_wrapping,
    settings_of,
)
from sweep.tables import Cause, StoredStudy, brief, causes_of, command, cut_off
from sweep.text import so_many
from sweep.workers import MOST_CAUSES


def model_table() -> Table:
    """Return the table of models with presets and sources."""
    table = Table("model", "presets", "metrics recorded by default", "source")
    for name, model in MODELS.items():
        presets = ", ".join(model.presets)
        metrics = ", ".join(model.metrics)
        table.add_row(name, presets, metrics, _source(MODELS, name, model.source))
    return table


def model_settings(name: str, catalogue: Catalogue) -> Table:
    """Return the table of the parameters of a model: unit, range and preset values.

    The caption names the parameters that may differ between robots.
    """
    model = catalogue.models[name]
    settings = settings_of(name, catalogue)
    presets = [model.preset_values(preset) for preset in model.presets]
    table = Table("setting", *model.presets, "allowed", "what it is", title=name)
    table.caption = "\n".join([*torus_text(model), spreads_text(settings)])
    for setting in settings.values():
        values = [brief(preset[setting.name]) for preset in presets]
        table.add_row(setting.name, *values, setting.allowed(), setting.text)
    return table


def model_json(name: str, catalogue: Catalogue) -> dict[str, Any]:
    """Return the content of `model_settings` for programs."""
    model = catalogue.models[name]
    settings = settings_of(name, catalogue)
    presets = {preset: model.preset_values(preset) for preset in model.presets}
    spreads = {spread.spread_of: spread.name for spread in settings.spreads.values()}
    return {
        "model": name,
        "presets": list(presets),
        "settings": [
            {
                "name": setting.name,
                "kind": setting.kind,
                "unit": setting.unit,
                "allowed": setting.allowed(),
                "text": setting.text,
                "spread": spreads.get(setting.name),
                "values": {
                    preset: _finite(values[setting.name])
                    for preset, values in presets.items()
                },
            }
            for setting in settings.values()
        ],
        "spreads": list(spreads.values()),
    }


def _finite(value: Value) -> Value:
    """Return a value that JSON can have: an infinite number as a string."""
    return str(value) if isinstance(value, float) and math.isinf(value) else value


def torus_text(model: Model) -> list[str]:
    """Return a line for each preset with a torus that wraps positions only."""
    return [
        f"The torus of preset {preset} {WRAPS_ONLY}" for preset in only_wrapping(model)
    ]


def spreads_text(settings: Settings) -> str:
    """Return the parameters that may differ between robots, in words."""
    names = [spread.spread_of for spread in settings.spreads.values()]
    if not names:
        return "No parameter may differ from robot to robot"
    return f"Differs from robot to robot by NAME_spread: {', '.join(names)}"


def built_in_table(workers: int) -> Table:
    """Return the table of built-in studies, with the estimated time of each study.

    The time is for `workers` worker processes.
    """
    table = Table(*("study", "model", "trials", "time", "what it is"))
    for study in built_in_studies(workers):
        most = "at most " if study.at_most else ""
        trials = f"{most}{study.plan.trials:,}"
        seconds = about(study.plan.wall_seconds, most)
        table.add_row(*(study.name, study.plan.model, trials, seconds, study.text))
    return table


def map_table() -> Table:
    """Return the table of environment maps with sources."""
    table = Table("map", "size", "what it is", "source")
    for name, map_ in MAPS.items():
        size = (
            f"{map_.size[0]:g} x {map_.size[1]:g} {map_.unit}" if map_.size else "any"
        )
        table.add_row(name, size, map_.text, _source(MAPS, name, map_.source))
    return table


def metric_table() -> Table:
    """Return the table of metrics: units, distributions, ranges and sources."""
    columns = ("metric", "unit", "distribution", "range", "what it is", "source")
    table = Table(*columns)
    for name, metric in METRICS.items():
        source = _source(METRICS, name, metric.source)
        values = declaration_of(metric)
        facts = (metric.unit, values.distribution, values.support.words, metric.text)
        table.add_row(name, *facts, source)
    return table


def profile_table() -> Table:
    """Return the table of profiles: axes, units and sources."""
    columns = ("profile", "axis", "unit", "what it is", "source")
    table = Table(*columns)
    for name, profile in PROFILES.items():
        source = _source(PROFILES, name, profile.source)
        facts = (profile.axis, profile.unit, profile.text)
        table.add_row(name, *facts, source)
    return table


def _source(registry: Registry[Any], name: str, source: str) -> str:
    """Return the source of an entry, with the package unless the entry is built-in."""
    owner = registry.origins.get(name)
    return f"{source} ({owner})" if owner else source


def refusals(registry: Registry[Any]) -> list[str]:
    """Return a line for each entry of an installed package that cannot be used."""
    return [f"{name} cannot be used: {why}" for name, why in registry.refused.items()]


def status_json(study: StoredStudy) -> str:
    """Return counts by status, and the causes of failures, as JSON.

    docs/json.md describes each key.
    """
    return json.dumps(
        {
            "study": study.name,
            "folder": str(study.store.folder),
            "trials": study.plan.num_rows,
            "apart": study.apart(),
            "statuses": study.statuses(),
            "cut_off": cut_off(study),
            "causes": [cause._asdict() for cause in _causes(study)],
            "kernels_sha": study.provenance["kernels_sha"],
            "commit": study.provenance["git"].get("commit"),
        }
    )


def status_text(study: StoredStudy) -> str:
    """Return counts by status, the causes of failures, and the origin of the results.

    Each cause has the command that shows the error.
    """
    statuses = study.statuses()
    origin = study.provenance
    lines = [
        f"study     {study.name}",
        f"folder    {study.store.folder}",
        f"trials    {study.plan.num_rows:,}",
    ]
    lines += [f"{status:<9} {count:,}" for status, count in sorted(statuses.items())]
    lines += (
        [f"apart     {study.apart():,} stored trials of another spec or other code"]
        if study.apart()
        else []
    )
    lines += [
        f"cut off   {so_many(count, 'trial')} of chains, not run: an earlier link"
        f" {status}"
        for status, count in sorted(cut_off(study).items())
    ]
    lines += [
        f"{label:<9} {text}"
        for method in methods().values()
        for label, text in method.status(study).items()
    ]
    lines.append(f"kernels   {origin['kernels_sha'][:16]}")
    lines.append(
        f"commit    {origin['git'].get('commit', 'unknown')}"
        + (" (modified)" if origin["git"].get("diff") else "")
    )
    if spec := origin.get("study_git"):
        modified = " (modified)" if spec["modified"] else ""
        lines.append(f"spec      {spec['path']} of commit {spec['commit']}{modified}")
    causes = _causes(study)
    for cause in causes[:MOST_CAUSES]:
        again = command("replay", study.name, cause.first)
        trials = so_many(cause.trials, "trial")
        lines.append(f"{cause.status}: {cause.cause} ({trials})\n          {again}")
    if (more := len(causes) - MOST_CAUSES) > 0:
        lines.append(f"{so_many(more, 'more cause')}: --json has all")
    return "\n".join(lines)


def _causes(study: StoredStudy) -> list[Cause]:
    """Return the causes of trials that are not done.

    Trials are read only if such trials exist.
    """
    troubled = study.statuses().keys() - {"done", "missing"}
    return causes_of(study.trials) if troubled else []
