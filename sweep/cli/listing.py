"""Tables of what exists and of what is stored, for a terminal or for a program."""

import json
import math
from typing import Any

from rich.table import Table

from kernels.catalogue import Catalogue
from kernels.metrics import METRICS
from kernels.model import Model
from kernels.models import MODELS
from kernels.registry import Registry
from kernels.worlds import MAPS
from sweep.design.plan import about
from sweep.method import methods
from sweep.published.starting import built_in_studies
from sweep.spec.recorded import declaration_of
from sweep.spec.settings import (
    WRAPS_ONLY,
    Settings,
    Value,
    only_wrapping,
    settings_of,
)
from sweep.tables.causes import Cause, causes_of
from sweep.tables.chains import cut_off
from sweep.tables.means_text import brief
from sweep.tables.stored_study import StoredStudy
from sweep.tables.stored_tables import command
from sweep.text import so_many
from sweep.workers.failures import MOST_CAUSES


def model_table() -> Table:
    """Models, presets and where they come from."""
    table = Table("model", "presets", "metrics recorded by default", "source")
    for name, model in MODELS.items():
        presets, metrics = ", ".join(model.presets), ", ".join(model.metrics)
        table.add_row(name, presets, metrics, _source(MODELS, name, model.source))
    return table


def model_settings(name: str, known: Catalogue) -> Table:
    """Every setting of a model, with its unit, range and preset values, and which may
    differ from robot to robot.
    """
    model, settings = known.models[name], settings_of(name, known)
    presets = [model.preset_values(preset) for preset in model.presets]
    table = Table("setting", *model.presets, "allowed", "what it is", title=name)
    table.caption = "\n".join([*torus_text(model), spreads_text(settings)])
    for setting in settings.values():
        values = [brief(preset[setting.name]) for preset in presets]
        table.add_row(setting.name, *values, setting.allowed(), setting.text)
    return table


def model_json(name: str, known: Catalogue) -> dict[str, Any]:
    """What `model_settings` shows, for programs."""
    model, settings = known.models[name], settings_of(name, known)
    presets = {preset: model.preset_values(preset) for preset in model.presets}
    spreads = {one.spread_of: one.name for one in settings.spreads.values()}
    return {
        "model": name,
        "presets": list(presets),
        "settings": [
            {
                "name": one.name,
                "kind": one.kind,
                "unit": one.unit,
                "allowed": one.allowed(),
                "text": one.text,
                "spread": spreads.get(one.name),
                "values": {
                    preset: _finite(values[one.name])
                    for preset, values in presets.items()
                },
            }
            for one in settings.values()
        ],
        "spreads": list(spreads.values()),
    }


def _finite(value: Value) -> Value:
    """A value as JSON can have it: an infinite one as text."""
    return str(value) if isinstance(value, float) and math.isinf(value) else value


def torus_text(model: Model) -> list[str]:
    """A line for each preset of a model whose torus wraps positions only."""
    return [
        f"The torus of preset {preset} {WRAPS_ONLY}" for preset in only_wrapping(model)
    ]


def spreads_text(settings: Settings) -> str:
    """Which parameters of a model may differ from robot to robot, in words."""
    names = [one.spread_of for one in settings.spreads.values()]
    if not names:
        return "No parameter may differ from robot to robot"
    return f"Differs from robot to robot by NAME_spread: {', '.join(names)}"


def built_in_table(workers: int) -> Table:
    """The built-in studies, and how long so many workers are about to take for each."""
    table = Table("study", "model", "trials", "time", "what it is")
    for study in built_in_studies(workers):
        plan, most = study.plan, "at most " if study.at_most else ""
        table.add_row(
            study.name,
            plan.model,
            f"{most}{plan.trials:,}",
            about(plan.wall_seconds, most),
            study.text,
        )
    return table


def map_table() -> Table:
    """Environment maps and where they come from."""
    table = Table("map", "size", "what it is", "source")
    for name, map_ in MAPS.items():
        size = (
            f"{map_.size[0]:g} x {map_.size[1]:g} {map_.unit}" if map_.size else "any"
        )
        table.add_row(name, size, map_.text, _source(MAPS, name, map_.source))
    return table


def metric_table() -> Table:
    """Metrics, their units, how their values are distributed and what they lie in, and
    their sources.
    """
    table = Table("metric", "unit", "distribution", "range", "what it is", "source")
    for name, metric in METRICS.items():
        source = _source(METRICS, name, metric.source)
        values = declaration_of(metric)
        about = (metric.unit, values.distribution, values.support.words, metric.text)
        table.add_row(name, *about, source)
    return table


def _source(registry: Registry[Any], name: str, source: str) -> str:
    """Where an entry comes from; of one that is not ours also the package."""
    owner = registry.origins.get(name)
    return f"{source} ({owner})" if owner else source


def refusals(registry: Registry[Any]) -> list[str]:
    """A line for each entry of another package that cannot be used."""
    return [f"{name} cannot be used: {why}" for name, why in registry.refused.items()]


def status_json(study: StoredStudy) -> str:
    """Counts by status, and why trials are not done, for programs: docs/json.md says
    what each key is.
    """
    return json.dumps(
        {
            "study": study.name,
            "folder": str(study.store.folder),
            "trials": study.plan.num_rows,
            "apart": study.apart(),
            "statuses": study.statuses(),
            "cut_off": cut_off(study),
            "causes": [one._asdict() for one in _causes(study)],
            "kernels_sha": study.provenance["kernels_sha"],
            "commit": study.provenance["git"].get("commit"),
        }
    )


def status_text(study: StoredStudy) -> str:
    """Counts by status, the errors with the commands that show them, and the origin of
    the results.
    """
    statuses, origin = study.statuses(), study.provenance
    lines = [
        f"study     {study.name}",
        f"folder    {study.store.folder}",
        f"trials    {study.plan.num_rows:,}",
    ]
    lines += [f"{status:<9} {count:,}" for status, count in sorted(statuses.items())]
    lines += (
        [f"apart     {study.apart():,} stored trials of another spec or other kernels"]
        if study.apart()
        else []
    )
    lines += [
        f"cut off   {so_many(count, 'trial')} of chains, not run: a link before"
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
    for one in causes[:MOST_CAUSES]:
        again = command("replay", study.name, one.first)
        trials = so_many(one.trials, "trial")
        lines.append(f"{one.status}: {one.cause} ({trials})\n          {again}")
    if (more := len(causes) - MOST_CAUSES) > 0:
        lines.append(f"{so_many(more, 'more cause')}: --json has all")
    return "\n".join(lines)


def _causes(study: StoredStudy) -> list[Cause]:
    """Why trials are not done; they are read only where some are not."""
    troubled = study.statuses().keys() - {"done", "missing"}
    return causes_of(study.trials) if troubled else []
