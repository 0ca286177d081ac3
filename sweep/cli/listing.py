"""Tables of what exists and of what is stored, for a terminal or for a program."""

import json
from collections import Counter
from typing import Any, NamedTuple

import pandas as pd
from rich.table import Table

from kernels.catalogue import Catalogue
from kernels.metrics import METRICS
from kernels.models import MODELS
from kernels.registry import Registry
from kernels.worlds import MAPS
from sweep.analysis import MeanKind
from sweep.analysis.notation import number, percent, plus_minus, with_interval
from sweep.cli.terminal import console
from sweep.design.plan import duration
from sweep.published.starting import built_in_studies
from sweep.spec.settings import settings_of
from sweep.tables.overview import untried
from sweep.tables.point_means import PointMeans
from sweep.tables.stored_study import NOT_YET, WHYS, StoredStudy
from sweep.tables.stored_tables import command
from sweep.text import shortened, so_many
from sweep.workers.failures import MOST_CAUSES, in_a_line

MOST_ROWS = 200
INTERVALS: dict[MeanKind | None, str] = {
    None: (
        "mean with the 95 % interval of its distribution (sweep metrics), ± half width"
        " of Student's"
    ),
    "t": "mean ± half width of the 95 % interval",
    "bootstrap": "mean and 95 % interval by the BCa bootstrap",
    "bootstrap_t": "mean and 95 % interval by the bootstrap-t",
}

POOLED = (
    "a row pools its points, each with the same weight: a value is the mean over them"
    " in one replicate, and a replicate counts where all of them have a value"
)


def model_table() -> Table:
    """Models, presets and where they come from."""
    table = Table("model", "presets", "metrics recorded by default", "source")
    for name, model in MODELS.items():
        presets, metrics = ", ".join(model.presets), ", ".join(model.metrics)
        table.add_row(name, presets, metrics, _source(MODELS, name, model.source))
    return table


def model_settings(name: str, known: Catalogue) -> Table:
    """Every setting of a model, with its unit, range and preset values."""
    presets = known.models[name].presets
    table = Table("setting", *presets, "allowed", "what it is", title=name)
    for setting in settings_of(name, known).values():
        values = [brief(preset[setting.name]) for preset in presets.values()]
        table.add_row(setting.name, *values, setting.allowed(), setting.text)
    return table


def built_in_table(workers: int) -> Table:
    """The built-in studies, and how long so many workers are about to take for each."""
    table = Table("study", "model", "trials", "time", "what it is")
    for study in built_in_studies(workers):
        plan, most = study.plan, "at most " if study.at_most else ""
        table.add_row(
            study.name,
            plan.model,
            f"{most}{plan.trials:,}",
            most + duration(plan.wall_seconds),
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
    """Metrics, their units, how their values are distributed, and their sources."""
    table = Table("metric", "unit", "distribution", "what it is", "source")
    for name, metric in METRICS.items():
        source = _source(METRICS, name, metric.source)
        about = (metric.unit, metric.distribution, metric.text)
        table.add_row(name, *about, source)
    return table


def _source(registry: Registry[Any], name: str, source: str) -> str:
    """Where an entry comes from; of one that is not ours also the package."""
    owner = registry.origins.get(name)
    return f"{source} ({owner})" if owner else source


def refusals(registry: Registry[Any]) -> list[str]:
    """A line for each entry of another package that cannot be used."""
    return [f"{name} cannot be used: {why}" for name, why in registry.refused.items()]


def point_rows(study: StoredStudy, table: PointMeans) -> pd.DataFrame:
    """The rows of a table for programs: the last column, `view`, is the command that
    shows a trial of the row.
    """
    views = [command("view", study.name, trial) for trial in table.rows["trial_id"]]
    return table.rows.drop(columns="trial_id").assign(view=views)


def table_text(study: StoredStudy, table: PointMeans) -> None:
    """Print a table of means; a half width is printed where the interval is Student's.

    A row has the number of its trials, or, where it pools points, of the replicates.
    """
    units, names = study.units, table.metrics
    headings = [f"{name}\n({units[name]})" if name in units else name for name in names]
    shown = [*table.headings, *(["points"] if table.pooled else [])]
    counted = "replicates" if table.pooled else "trials"
    printed = Table(
        *shown, *headings, counted, title=study.name, caption=_caption(study, table)
    )
    for _, row in table.rows.head(MOST_ROWS).iterrows():
        cells = [_cell(study, row, name, table) for name in names]
        printed.add_row(
            *(brief(row[name]) for name in shown), *cells, _count(row, names)
        )
    console().print(printed)
    if len(table.rows) > MOST_ROWS:
        what = "rows" if table.pooled else "points"
        console().print(
            f"{len(table.rows) - MOST_ROWS:,} more {what}: --csv and --json give all"
        )
    for trial in table.rows["trial_id"].head(1):
        what = "row" if table.pooled else "point"
        console().print(
            f"a trial of the first {what}, and in --csv and --json of each:"
            f" {command('view', study.name, trial)}",
            soft_wrap=True,
        )


def _cell(
    study: StoredStudy, row: "pd.Series[Any]", name: str, table: PointMeans
) -> str:
    """A mean with its interval, and the share of trials without a value.

    Equal values of a metric that is no event have an interval without a width: so much
    is said in its place.
    """
    mean, low, high = (float(row[name + end]) for end in ("", "_low", "_high"))
    repeated = name in study.repeated and not table.pooled
    own = table.interval is None or repeated
    students = study.distributions[name] == "normal" if own else table.interval == "t"
    if low == high:
        text = f"{number(mean)} (all equal)"
    elif students:
        text = plus_minus(mean, high - mean)
    else:
        text = with_interval(mean, low, high)
    undefined = row[f"{name}_undefined"]
    return f"{text}\n{percent(undefined)} undefined" if undefined else text


def _caption(study: StoredStudy, table: PointMeans) -> str:
    """Which intervals a table shows, how rows pool points, and what is not stored."""
    return "\n".join(filter(None, [_intervals(study, table), _missing(study)]))


def _missing(study: StoredStudy) -> str:
    """How many trials are not stored, and how many points have none; "" for none."""
    if not study.missing:
        return ""
    number = f"{study.missing:,} of {so_many(study.plan.num_rows, 'trial')} missing"
    return "; ".join(filter(None, [number, untried(study)]))


def _intervals(study: StoredStudy, table: PointMeans) -> str:
    """Which intervals a table shows, and how rows pool points. If `until` stopped at a
    narrow interval of one metric, only this metric has an interval that takes that into
    account.
    """
    if table.pooled:
        given = ", which takes the numbers of trials as given" if study.repeated else ""
        return f"{INTERVALS[table.interval]}{given}\n{POOLED}"
    if not study.repeated:
        return INTERVALS[table.interval]
    rule = study.rule
    normal = {study.distributions[name] for name in rule.widths} == {"normal"}
    return (
        f"{', '.join(rule.widths)}: mean {'± half width of' if normal else 'with'} the"
        f" repeated {100 * rule.confidence:g} % interval, by which the number of trials"
        f" of each point was chosen\nother metrics: {INTERVALS[table.interval]},"
        " which takes that as given"
    )


def _count(row: "pd.Series[Any]", names: list[str]) -> str:
    n = max((int(row[f"{name}_n"]) for name in names), default=0)
    return f"{n}" + (f" (+{row['not_done']} not done)" if row["not_done"] else "")


def brief(value: Any) -> str:
    """A setting in few characters."""
    return f"{value:.6g}" if isinstance(value, float) else shortened(str(value)) or "-"


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
            "causes": [one._asdict() for one in _causes(study)],
            "kernels_sha": study.provenance["kernels_sha"],
            "commit": study.provenance["git"].get("commit"),
        }
    )


def _settled(study: StoredStudy) -> str:
    """How many points need no more trials, by the reason."""
    why = study.stopping.groupby("point")["why"].agg(lambda of: min(of, key=WHYS.index))
    counts = Counter(why[why != NOT_YET])
    reasons = "".join(f", {count:,} by {one}" for one, count in sorted(counts.items()))
    return f"{counts.total():,} of {len(why):,} points{reasons}"


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
    lines += [f"settled   {_settled(study)}"] if study.repeated else []
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


class _Cause(NamedTuple):
    """Why trials are not done: how many have this status and this line as their error,
    and the id of the first.
    """

    status: str
    trials: int
    cause: str
    first: str


def _causes(study: StoredStudy) -> list[_Cause]:
    """Each cause once, the one of the first trial first."""
    if not study.statuses().keys() - {"done", "missing"}:
        return []
    troubled = study.trials[study.trials["status"] != "done"]
    causes = troubled["error"].fillna("").astype(str).map(in_a_line)
    groups = troubled.groupby([troubled["status"], causes], sort=False)["trial_id"]
    return [
        _Cause(str(status), len(trials), str(cause), str(trials.iloc[0]))
        for (status, cause), trials in groups
    ]
