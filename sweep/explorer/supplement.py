"""A study as a page of HTML that opens from disk.

The page has the figure of the study with confidence intervals. Behind every mark are
stored trials that can be played. Each trial was run again, and is bitwise identical to
the stored trial. Otherwise the page is not written.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from sweep.design import Job, job_seconds
from sweep.errors import ChoiceError, StoreError
from sweep.explorer.publishing import PaperTexts
from sweep.explorer.supplement_figure import cells_of, figure_data, form_of, named_row
from sweep.explorer.supplement_front import about_page, front_of
from sweep.explorer.supplement_room import MOST_BYTES, RunLength, most_frames
from sweep.explorer.supplement_runs import (
    RecordedRun,
    RunOrder,
    not_recorded,
    record,
)
from sweep.explorer.supplement_starts import (
    Computation,
    check_computed,
    computed_metrics,
)
from sweep.explorer.supplement_trials import (
    ALL,
    MIDDLE,
    ShownTrial,
    behind,
    places,
    points_of,
    why_none,
)
from sweep.figures import has_scale, select
from sweep.replays import Report, check_code
from sweep.spec import Column
from sweep.tables import (
    PointMeans,
    StoredStudy,
    StoredTrial,
    json_rows,
    keep_apart,
    point_means,
    point_rows,
    stored_trials,
)
from sweep.text import so_many
from sweep.trial import warm
from sweep.web import document, scene_of
from sweep.workers import ExecutorFactory, drive

USUAL_FRAMES = 601
"""Maximum number of frames of a run: the start, and 10 s at 60 per second."""
MOST_POINTS = 400
"""Maximum number of marks that can be distinguished, and run again in minutes."""
SHOWN_DIFFERENCES = 3
OTHER_NOW = "has changed since the launch; this trial ran with the original file"


class SupplementChoice(NamedTuple):
    """The content of a supplement.

    Attributes
    ----------
    metric : str, default ""
        The metric of the figure; "" for the first recorded metric.
    half : bool, default False
        Use the mean over the second half of a trial instead of the last frame.
    where : tuple of str
        Conditions on points, in the form of `study.where`.
    x : str, default ""
        The parameter along the axis; "" for the parameter with the most values.
    by : str, default ""
        The parameter that is a colour; "" for a suitable parameter.
    trials : tuple of str
        The trials of a point that can be played, see `supplement_trials.ROLES`.
    frames : int
        Maximum number of frames of each trial, at least 2.
    compute : bool, default False
        Whether the page computes the trials, instead of having the frames.
    """

    metric: str = ""
    half: bool = False
    where: tuple[str, ...] = ()
    x: str = ""
    by: str = ""
    trials: tuple[str, ...] = ("median",)
    frames: int = USUAL_FRAMES
    compute: bool = False


@dataclass(frozen=True, eq=False)
class Supplement:
    """A supplement whose trials have not run yet.

    `data` is the content of the page, except the records of runs. `orders` has an order
    per run. `origin` is the origin of the page, for the metadata.
    """

    study: StoredStudy
    data: dict[str, Any]
    orders: list[RunOrder]
    origin: dict[str, str]

    def content(self, executor: ExecutorFactory, report: Report) -> bytes:
        """Return the page, after all trials were run again.

        Parameters
        ----------
        executor : ExecutorFactory
            Starts the engine that runs the trials.
        report : Report
            Receives the number of runs that are done, and of all runs.

        Raises
        ------
        StoreError
            If a trial fails, or differs from the stored results.
        """
        runs = _recorded(self.orders, executor, report)
        _check(self.study, runs)
        computation = Computation()
        shown = [
            begun | _as_data(runs[begun["trial"]], order, computation)
            for begun, order in zip(self.data["runs"], self.orders, strict=True)
        ]
        data = self.data | {"runs": shown, "computation": computation.shared()}
        page = _page(data, self.origin)
        if len(page) > MOST_BYTES:
            raise ChoiceError(
                f"the page has {len(page) / 2**20:.1f} MiB of at most"
                f" {MOST_BYTES / 2**20:.1f} MiB; select fewer points with --where, or"
                " fewer trials with --trials",
                self.study.name,
            )
        return page


def planned(
    study: StoredStudy, choice: SupplementChoice, texts: PaperTexts
) -> Supplement:
    """Return the supplement of a study, before any trial runs.

    A choice that cannot be met is an error.

    Parameters
    ----------
    study : StoredStudy
    choice : SupplementChoice
        The figure and the trials.
    texts : PaperTexts
        The texts of the publication.

    Raises
    ------
    ChoiceError
        If the study lacks a chosen item, or has no trial that can be shown. Also if
        there are more than MOST_POINTS points, or more runs than the page has room for.
    StoreError
        If other code computed the trials, or if they are damaged.
    CodeError
        If custom code of the study may not run.
    """
    chosen = keep_apart(study).where(*choice.where)
    if chosen.trials.empty:
        raise ChoiceError("no trial is stored yet; launch it first", study.name)
    column = Column(choice.metric or chosen.metrics[0], choice.half)
    at = places(chosen, column, choice.trials)
    table = point_means(chosen, [column.metric], half=column.half)
    selection = select(chosen)
    form = form_of(selection, choice.x, choice.by)
    if len(table.rows) > MOST_POINTS:
        raise ChoiceError(
            f"has {len(table.rows):,} points; a page shows up to {MOST_POINTS}; select"
            f" points with --where, such as --where '{chosen.chooser.example}'",
            study.name,
        )
    check_code(study)
    groups = points_of(chosen, table.rows["trial_id"].tolist())
    every = ALL in choice.trials
    shown = [behind(trials, column, at, every=every) for trials in groups]
    if not any(shown):
        raise ChoiceError(why_none(chosen.trials, column), study.name)
    stored = _stored(study, shown)
    jobs = {trial_id: chosen.job(trial) for trial_id, trial in stored.items()}
    scenes, scene_of_trial = _scenes(jobs)
    runs = [
        _run_begun(
            trial,
            study,
            column.metric,
            stored[trial.trial_id],
            scene=scene_of_trial[trial.trial_id],
        )
        for trials in shown
        for trial in trials
    ]
    colours = [] if not form.by else selection.values(form.by)
    data = {
        "front": front_of(chosen, texts),
        "study": study.name,
        "spec": study.spec,
        "figure": figure_data(selection, form, table, column),
        "headings": table.headings,
        "rows": json_rows(point_rows(chosen, table)),
        "points": _points(
            table,
            groups,
            shown,
            column,
            by=form.by,
            colours=colours,
            cells=cells_of(selection, form, column),
        ),
        "scenes": scenes,
        "role": MIDDLE if choice.trials[0] == ALL else choice.trials[0],
        "runs": runs,
    }
    origin = about_page(study)
    ranges = {
        str(name): (float(values.min()), float(values.max()))
        for name, values in selection.points.items()
        if has_scale(values)
    }
    lengths = [RunLength.of(jobs[run["trial"]]) for run in runs]
    if choice.compute:
        check_computed(list(jobs.values()), column.metric, study.name)
        most = choice.frames
    else:
        room = MOST_BYTES - len(_page(data, origin))
        most = most_frames(lengths, choice.frames, room)
    orders = [
        RunOrder(
            study.name,
            jobs[run["trial"]],
            stored[run["trial"]],
            column.metric,
            every=_every(length, most, jobs[run["trial"]], compute=choice.compute),
            compute=choice.compute,
            ranges=ranges,
        )
        for run, length in zip(runs, lengths, strict=True)
    ]
    return Supplement(study, data, orders, origin)


def _every(length: RunLength, most: int, job: Job, *, compute: bool) -> int:
    """Return the number of steps between two frames.

    A page that computes trials has the metrics of the recorded frames alone. Therefore
    frames are multiples of these frames.
    """
    every = length.every(most)
    recorded = job.record.every
    return math.ceil(every / recorded) * recorded if compute else every


def _stored(
    study: StoredStudy, shown: Sequence[Sequence[ShownTrial]]
) -> dict[str, StoredTrial]:
    ids = [trial.trial_id for trials in shown for trial in trials]
    return {
        str(trial.row["trial_id"]): trial for trial in stored_trials(study.store, ids)
    }


def _scenes(jobs: Mapping[str, Job]) -> tuple[list[Any], dict[str, int]]:
    """Return the scenes of trials, and the index of the scene of each trial."""
    texts = {trial: json.dumps(scene_of(job)) for trial, job in jobs.items()}
    different = list(dict.fromkeys(texts.values()))
    places_of = {trial: different.index(text) for trial, text in texts.items()}
    return [json.loads(text) for text in different], places_of


def _run_begun(
    shown: ShownTrial, study: StoredStudy, metric: str, stored: StoredTrial, scene: int
) -> dict[str, Any]:
    """Return the facts of a run that are known before the recording."""
    other = study.other_now(stored)
    return {
        "trial": shown.trial_id,
        "roles": shown.roles,
        "value": shown.value,
        "replicate": int(stored.row["replicate"]),
        "scene": scene,
        "stored": stored.row[metric],
        "notes": [f"{path.name} {OTHER_NOW}." for path in other],
    }


def _points(
    table: PointMeans,
    groups: Sequence[pd.DataFrame],
    shown: Sequence[Sequence[ShownTrial]],
    column: Column,
    by: str,
    colours: Sequence[object],
    cells: Mapping[str, dict[str, Any]],
) -> list[dict[str, Any]]:
    """Return the marks of the figure, one per row of the table.

    A mark has words, the index of a colour, and the indices of runs. A mark without
    runs has the reason. A mark of a heatmap with a value has a cell.
    """
    points = []
    first = 0
    differ = [name for name in table.headings if table.rows[name].nunique() > 1]
    rows = [row for _, row in table.rows.iterrows()]
    for row, trials, own in zip(rows, groups, shown, strict=True):
        point = {
            "words": named_row(row, differ),
            "colour": colours.index(row[by]) if by else 0,
            "runs": list(range(first, first + len(own))),
            "why": "" if own else why_none(trials, column),
            "cell": cells.get(str(trials["point"].iloc[0])),
        }
        first += len(own)
        points.append(point)
    return points


def _recorded(
    orders: Sequence[RunOrder], executor: ExecutorFactory, report: Report
) -> dict[str, RecordedRun]:
    """Run the trials of the orders again; return the records by trial."""
    once = list({order.job.trial_id: order for order in orders}.values())
    records: dict[str, RecordedRun] = {}
    report(0, len(once))
    # Compile here once. Otherwise each worker would compile the same code.
    warm(once[0].job)
    for runs in drive(
        once, record, executor=executor, costs=_seconds, failed=not_recorded
    ):
        records |= {run.trial_id: run for run in runs}
        report(len(records), len(once))
    return records


def _seconds(orders: Sequence[RunOrder]) -> np.ndarray[Any, np.dtype[np.float64]]:
    return job_seconds([order.job for order in orders])


def _check(study: StoredStudy, runs: Mapping[str, RecordedRun]) -> None:
    """Raise StoreError for runs that fail here, or differ from the stored results."""
    for run in runs.values():
        if run.error:
            why = run.error.strip().splitlines()[-1]
            raise StoreError(
                f"trial {run.trial_id} cannot be shown, because the trial fails: {why}",
                study.name,
            )
    differing = [run for run in runs.values() if run.differences]
    if not differing:
        return
    shown = "; ".join(run.differences[0] for run in differing[:SHOWN_DIFFERENCES])
    more = "; ..." if len(differing) > SHOWN_DIFFERENCES else ""
    raise StoreError(
        f"{len(differing)} of {so_many(len(runs), 'trial')}, run again, differ from the"
        f" stored results, so no page is written: {shown}{more}. Launch the study on"
        " this machine, or write the page on the machine of the launch",
        study.name,
    )


def _as_data(
    run: RecordedRun, order: RunOrder, computation: Computation
) -> dict[str, Any]:
    """Return the record of a run, ready for JSON."""
    start = None
    if run.start:
        metrics = computed_metrics(order.job)
        last = [float(order.stored.row[name]) for name in metrics]
        start = computation.begun(order.job, run.start, last)
    return {
        "every": order.every,
        "start": start,
        "steps": run.steps.tolist(),
        "values": [_finite(value) for value in run.values.tolist()],
        "senses": run.senses,
        "frames": run.frames,
    }


def _finite(value: float) -> float | None:
    """Return a number for JSON: None for a number that is not finite."""
    return value if math.isfinite(value) else None


def _page(data: dict[str, Any], origin: Mapping[str, str]) -> bytes:
    title = data["front"]["title"]
    return document(
        "supplement",
        "supplement",
        data,
        title,
        origin=origin,
        wasm=bool(data.get("computation", {}).get("modules")),
    )
