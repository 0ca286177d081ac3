"""A stored study, as its tables: `sweep.load("nguyen2024/separation").trials`."""

import copy
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import ArrayLike, NDArray

from kernels.catalogue import Catalogue
from kernels.identity import Code
from sweep.analysis import Interval, by_point, mean_interval
from sweep.analysis.mean_bounds import Declaration, in_full
from sweep.errors import ChoiceError, StoreError
from sweep.spec.ablation import fitted_preset, label
from sweep.spec.continuing import DIRECTION
from sweep.spec.derived_metrics import declared
from sweep.spec.maps import OwnMap, maps_from_json
from sweep.spec.recorded import (
    Column,
    Over,
    column_over,
    columns_of,
    declaration_of,
)
from sweep.spec.settings import Setting, settings_of
from sweep.spec.study import sections
from sweep.spec.study_folder import PLAN, STUDY_NAME
from sweep.store.locations import Location, location
from sweep.store.origin import plan_provenance, stamps
from sweep.store.placed import PlacedTrials
from sweep.store.plan_about import AxisAbout, PlanAbout
from sweep.store.recordings import measured
from sweep.store.rows import DISTRIBUTION
from sweep.store.store import Store
from sweep.store.stored_code import (
    known_with_code,
    known_without_code,
    other_now,
    stored_sources,
)
from sweep.tables.choosing import (
    Choice,
    Chooser,
    Refusals,
    Restriction,
    as_choices,
    as_names,
    spelled,
)
from sweep.tables.stored_links import check_stored_link
from sweep.tables.stored_plan import check_plan
from sweep.tables.stored_tables import checked
from sweep.tables.stored_trials import StoredTrial, origins, stored_trials
from sweep.text import shortened, so_many, unknown

if TYPE_CHECKING:
    from sweep.design.jobs import Job
    from sweep.trial.world import TrialWorld


DETAIL = "detail"
TABLES = ("trials", "series", "heatmaps", "trajectories")
ABOUT = (b"unit", b"text")
"""What is stored of a column, beside its values."""
POINT_COLUMNS = (
    *("point", "model", "preset", "replicate", "seed", "seed_listed"),
    *("status", "error"),
)
"""What is read of trials, beside their ids, for the means of points, one by one or
several together.
"""
CONFIDENCES = ("confidence", "nominal_confidence")
SHOWN_IDS = 3
"""Of trials whose ids begin alike, in an error."""


class NarrowTrials(NamedTuple):
    """Some columns of trials: where their rows lie, as a table and as a frame."""

    placed: PlacedTrials
    table: pa.Table
    trials: pd.DataFrame


class Looks(NamedTuple):
    """The metrics that decided how many trials a point has; the confidence with which
    the intervals of all looks at a point hold, and the nominal one of each of them.
    """

    metrics: tuple[str, ...]
    confidence: float
    nominal: float


class StoredStudy:
    """The results of a study's spec as last launched; each table is read when first
    asked for.

    `name` is the study's and `results` the folder or object store that holds it. Raises
    StoreError where there is none, and ChoiceError for what is no name.

    `chosen` are the settings by which `where` has restricted it, `conditions` the
    conditions; there are none at first. Tables are read without the code of the user's
    own that computed them; with `trust` it may run where trials are run again, also if
    somebody else has launched the study.
    """

    chosen: Mapping[str, Choice] = MappingProxyType({})
    conditions: tuple[str, ...] = ()

    def __init__(
        self, name: str, results: Location | str = "results", *, trust: bool = False
    ) -> None:
        if not isinstance(name, str) or not STUDY_NAME.fullmatch(name):
            raise ChoiceError(
                f"study {_quoted(name)} is not allowed:"
                ' a name of folders below the results, joined by "/"'
            )
        self.name, self.trust = name, trust
        place = location(results)
        self.store = Store(place / name, place)
        self.plan = self.store.read_plan()
        self.provenance = plan_provenance(self.plan, self.store.folder / PLAN)
        check_plan(name, self.plan, self.provenance, self.known)

    def __repr__(self) -> str:
        chosen = [f"{name} = {spelled(value)}" for name, value in self.chosen.items()]
        wanted = ", ".join([*chosen, *self.conditions])
        where = f" where {wanted}" if wanted else ""
        about = f"{self.name}{where}: {so_many(self.plan.num_rows, 'trial')}"
        return f"<StoredStudy {about}>"

    def where(self, *texts: str, **settings: object) -> Self:
        """The same study, as if its spec had only the trials with these settings.

        `study.where(n=50, map=["empty", "cafeteria"])` has the tables, units and all
        else of those trials. A list means one of its values. `detail` is what an axis
        that ablates has changed, as in `sweep table`. Numbers are equal if they agree
        in nine digits. A text is a condition, `study.where("separation_weight >= 1")`,
        or has settings as a command takes them, `"n=50,map=empty"`. Analyses and
        figures take the result as any study, and `where` restricts it further. Raises
        ChoiceError for an unknown setting, a value that no point has, and what holds at
        no point: all such mistakes together.
        """
        if not texts and not settings:
            return self
        found, asked = self._chosen_points(texts, settings)
        wanted = self.points.index[found]
        part = copy.copy(self)
        for name in vars(self):
            # A table that was read is of more trials.
            if isinstance(getattr(type(self), name, None), cached_property):
                delattr(part, name)
        part.whole = self.whole
        part.chosen = {**self.chosen, **asked.settings}
        part.conditions = (*self.conditions, *asked.conditions)
        part.plan = self.plan.filter(
            pc.is_in(self.plan["point"], value_set=pa.array(wanted, pa.string()))
        )
        part.trials = self.trials[self.trials["point"].isin(wanted)].reset_index(
            drop=True
        )
        return part

    def _chosen_points(
        self, texts: Iterable[str], settings: Mapping[str, object]
    ) -> tuple[NDArray[np.bool_], Restriction]:
        """Which points have all that is wanted, and what that is."""
        refusals, chooser = Refusals(), self.chooser
        asked = Restriction(as_choices(settings), ())
        for text in texts:
            with refusals.noted():
                asked = chooser.wanted(text, asked)
        found = np.ones(chooser.points, np.bool_)
        with refusals.noted():
            found &= chooser.having(asked.settings)
        for condition in asked.conditions:
            with refusals.noted():
                found &= chooser.holding(condition)
        refusals.check()
        if not found.any():
            what = [f"{name} = {spelled(one)}" for name, one in asked.settings.items()]
            raise ChoiceError(
                f"no point has all of: {', '.join([*what, *asked.conditions])}",
                self.name,
            )
        return found, asked

    @cached_property
    def whole(self) -> Self:
        """The study before any `where`."""
        return self

    @cached_property
    def asked(self) -> pa.Table | None:
        """What a search had asked for when this was first looked at; None where the
        study is no search.
        """
        return self.store.read_asked() if self.whole is self else self.whole.asked

    @property
    def restricted(self) -> bool:
        """Whether `where` has chosen among its trials."""
        return bool(self.chosen or self.conditions)

    def narrow(self, metrics: Sequence[str]) -> Self:
        """The same study, whose `trials` have of all columns only `POINT_COLUMNS`, the
        settings that differ and these metrics: of a million trials they are read in a
        second, and further metrics in a tenth of it.
        """
        chosen = [name for name in metrics if name in self.metrics]
        try:
            found = self._with_metrics(chosen)
        except StoreError:  # parts may have been merged since
            vars(self).pop("_settled", None)
            found = self._with_metrics(chosen)
        part = copy.copy(self)
        vars(part).pop("tried", None)
        part.trials = found.trials if len(found.trials) else self.trials
        part.points = self.points  # made once for all that are narrow
        part.distributions = self._declared(found.table.schema)
        part.units = self._units(found.table.schema)
        return part

    @cached_property
    def _settled(self) -> NarrowTrials:
        """What narrow studies always have of its trials, in the order of the spec."""
        placed = self.store.placed(self.plan["trial_id"])
        found = self.store.columns(placed, [*POINT_COLUMNS, *self.varied])
        needed = self.varied if found.num_rows else ()
        table = checked(self.name, "trials", found, self.known, needed)
        return NarrowTrials(placed, table, table.to_pandas())

    def _with_metrics(self, metrics: Sequence[str]) -> NarrowTrials:
        """The same with metrics. Texts, which are most of it, are made only once."""
        placed, table, trials = self._settled
        if not metrics:
            return self._settled
        found = self.store.columns(placed, columns_of(metrics))
        new = [name for name in found.column_names if name not in table.column_names]
        for name in new:
            table = table.append_column(found.schema.field(name), found[name])
        needed = metrics if table.num_rows else ()
        table = checked(self.name, "trials", table, self.known, needed)
        more = table.select(new).to_pandas()
        return NarrowTrials(placed, table, pd.concat([trials, more], axis=1))

    @cached_property
    def tried(self) -> NDArray[np.bool_]:
        """Which of its `points` have a stored trial."""
        there = pd.Index(self.trials["point"].unique())
        found: NDArray[np.bool_] = there.get_indexer(self.points.index) >= 0
        return found

    @property
    def done(self) -> NDArray[np.bool_]:
        """Which of its `trials` are done."""
        return (self.trials["status"] == "done").to_numpy(np.bool_)

    @cached_property
    def points(self) -> pd.DataFrame:
        """One row a point, by its id: every setting that differs between the points of
        the spec, and `detail` where an axis ablates a preset.

        Where several presets are ablated it is `detail_<preset>` of each.
        """
        varied = list(self.about.varied)
        numbers = self.plan["point"].combine_chunks().dictionary_encode().indices
        first = np.unique(numbers.to_numpy(), return_index=True)[1]
        plan = self.plan.select(["point", *varied]).take(pa.array(first))
        points: pd.DataFrame = plan.to_pandas().set_index("point")
        for preset in self.about.ablated:
            points[self.detail(preset)] = self._details(preset, points)
        return points

    @property
    def headings(self) -> list[str]:
        """What tells points apart, as tables and figures show it: the settings that
        differ, with `detail` in place of those that an axis ablates.
        """
        ablated = self.about.ablated
        switched = {
            name for groups in ablated.values() for one in groups for name in one
        }
        varied = [name for name in self.varied if name not in switched]
        return [*varied, *(self.detail(preset) for preset in ablated)]

    @cached_property
    def chooser(self) -> Chooser:
        """What `where` and commands choose points by: every setting, and `detail`."""
        points = self.points
        columns: dict[str, Any] = {
            str(name): column.to_numpy() for name, column in points.items()
        }
        if len(self.trials) and "model" in self.trials:
            same = self._first_row
            columns |= {
                name: same[name]
                for name in self.settings
                if name in same.index and name not in columns
            }
        return Chooser(columns, len(points), self.name, columns_of(self.metrics))

    def details(self, preset: str) -> "pd.Series[str]":
        """What the axis that ablates `preset` has changed in each trial, in the order
        of `trials`, by trial_id.

        It is "" where no setting of the axis differs from the study's preset, the name
        of the setting where one detail does ("map" where the world does), "all" where
        all do, "all but drag" where one of three or more does not, and else the names
        of all that do, joined by " + ". Where the spec names the details, `preset` is
        the name of the axis, and the names are its own. Raises ChoiceError where no
        axis of the study ablates that preset.
        """
        ablated = self.about.ablated
        if preset not in ablated:
            raise ChoiceError(unknown("ablated preset", preset, ablated), self.name)
        labels = self.trials["point"].map(self.points[self.detail(preset)])
        return pd.Series(
            labels.to_numpy(),
            index=self.trials["trial_id"],
            name="detail",
            dtype=object,
        )

    def detail(self, preset: str) -> str:
        """The name of the column of `points` that has the details of a preset."""
        return DETAIL if len(self.about.ablated) == 1 else f"{DETAIL}_{preset}"

    def _details(self, preset: str, points: pd.DataFrame) -> list[str]:
        """What is changed at each of `points`, as `details` has it."""
        origin = self.provenance
        before = fitted_preset(origin["model"], origin["preset"], self.known)
        groups = self.about.ablated[preset]
        changed = np.column_stack(
            [
                (points[names] != [before[name] for name in names]).any(axis=1)
                for names in groups
            ]
        )
        names = self.detail_names(preset)
        return [label(row.tolist(), names) for row in changed]

    def detail_names(self, preset: str) -> list[str]:
        """The names of the details of a preset, or of an axis that names them."""
        groups = self.about.ablated[preset]
        return self.about.details or [names[0] for names in groups]

    @cached_property
    def known(self) -> Catalogue:
        """What its names of models, metrics, maps and starts stand for, without the
        code of its own.
        """
        return known_without_code(self.store, self.provenance)

    def running(self, origin: Mapping[str, Any]) -> Catalogue:
        """What names stand for when trials of an origin run again: by the code that
        computed them. Raises CodeError where that may not run.
        """
        return known_with_code(self.store, origin, self.trust)

    def other_now(self, stored: StoredTrial) -> list[Path]:
        """The files beside the spec that are no longer the code that computed a stored
        trial; running it again takes the code of then.
        """
        return other_now(self.store, stored.provenance)

    @property
    def own_code(self) -> dict[str, Mapping[str, str]]:
        """The text of each file of the user's own, by the sha256 of all of them: those
        that compute its trials first, then those that computed other stored ones.
        """
        stored = (about for about, _ in origins(self.store, [*self.store.trial_ids()]))
        return {
            about["own"]["sha"]: stored_sources(self.store, about)
            for about in (self.provenance, *stored)
            if "own" in about
        }

    @property
    def settings(self) -> dict[str, Setting]:
        """Every setting that a study of its model may name. Up to 0.1 a plan does not
        name the model.
        """
        model = self.provenance.get("model") or str(self.trials["model"].iloc[0])
        return settings_of(model, self.known).of_study(())

    @property
    def spec(self) -> str:
        """The YAML text of the spec as last launched."""
        return str(self.provenance["spec"])

    @cached_property
    def maps(self) -> dict[str, OwnMap]:
        """The maps that the spec brings, by name. Raises StoreError for what is stored
        and is none.
        """
        try:
            return maps_from_json(self.about.maps, self.known.maps)
        except ValueError as error:
            raise StoreError(
                f"the stored maps are not allowed: {error}", self.name
            ) from None

    @property
    def varied(self) -> list[str]:
        """The settings that differ between points."""
        varied = list(self.about.varied)
        if not self.restricted:
            return varied
        differ = self.points[varied].nunique() > 1
        return [name for name in varied if differ[name]]

    def candidate(self, point: str) -> str:
        """The id of the settings of a point: its own, where no phase tells points with
        the same settings apart.
        """
        return point

    @property
    def kept_apart(self) -> list[str]:
        """The settings whose values are never averaged together, nor shown as one: the
        direction of chains.
        """
        return [DIRECTION] if DIRECTION in self.varied else []

    @property
    def parts(self) -> "tuple[StoredStudy, ...]":
        """The studies that it is made of: itself."""
        return (self,)

    @property
    def left_out(self) -> dict[str, str]:
        """The metrics that its parts do not share, each with the reason: none."""
        return {}

    @property
    def differ(self) -> dict[str, list[Any]]:
        """The fixed settings in which its parts differ, with each value: none."""
        return {}

    @property
    def metrics(self) -> list[str]:
        """The recorded metrics."""
        return list(self.about.record)

    def check_metric(self, name: str) -> None:
        """Raise ChoiceError unless a metric of that name is recorded."""
        if name in self.metrics:
            return
        column = Column.read(name)
        if column.half and column.metric in self.metrics:
            raise ChoiceError(
                f'"{name}" is the mean of {column.metric} over the last half: ask for'
                f' {column.metric} with over="half", in a command --over half',
                self.name,
            )
        raise ChoiceError(unknown("metric", name, self.metrics), self.name)

    @property
    def series_metrics(self) -> list[str]:
        """The metrics that are stored frame by frame."""
        names = self._series_schema.names
        return [name for name in names if name not in ("trial_id", "frame")]

    @property
    def _series_schema(self) -> pa.Schema:
        """The columns of `series`, of which no row is read."""
        empty = self.store.schema("series").empty_table()
        return self._of_the_spec("series", empty).schema

    @property
    def about(self) -> PlanAbout:
        """What the plan records of the study, beside its trials."""
        return PlanAbout.read(self.provenance)

    @property
    def code(self) -> Code | None:
        """The stamps of what computes its trials, as of its last launch; None for one
        before 0.7.
        """
        return stamps(self.provenance)

    @property
    def axes(self) -> dict[str, AxisAbout]:
        """The axes by name. Raises StoreError for a plan that does not say: of before
        0.2.
        """
        axes = self.about.axes
        if axes is None:
            raise StoreError(
                "its plan does not say what its axes sample; launch it once more",
                self.name,
            )
        return axes

    @property
    def looks(self) -> Looks | None:
        """By which metrics it was decided how many trials a point has, None where that
        number is fixed.
        """
        for key, record in self.about.sections.items():
            if metrics := sections()[key].looks_at(record):
                return Looks(metrics, *(record[name] for name in CONFIDENCES))
        return None

    @property
    def repeated(self) -> dict[str, float]:
        """The metrics that decided how many trials a point has, each with the
        confidence of its interval at each look.

        Empty where the number of trials is fixed. `means` uses it.
        """
        looks = self.looks
        return dict.fromkeys(looks.metrics, looks.nominal) if looks else {}

    @cached_property
    def trials(self) -> pd.DataFrame:
        """One row a stored trial of the spec, in its order: what it is, every setting,
        every metric. Before the first one is stored it has the columns of the plan,
        `status`, `error` and the metrics.
        """
        table = self._table("trials", (*self.varied, *self.metrics))
        if not table.num_rows:
            empty: pd.DataFrame = self.plan.slice(0, 0).to_pandas()
            return empty.assign(
                status=pd.Series(dtype=object),
                error=pd.Series(dtype=object),
                **dict.fromkeys(columns_of(self.metrics), pd.Series(dtype=np.float64)),
            )
        return self._in_order(table)

    @cached_property
    def series(self) -> pd.DataFrame:
        """A row a recorded frame of a trial: trial_id, frame and the series metrics."""
        return self._in_order(self._table("series"))

    @cached_property
    def heatmaps(self) -> pd.DataFrame:
        """One row a trial: trial_id and `visits`, an array (rows, columns) of counts,
        -1 in obstacles.
        """
        table = self._in_order(self._table("heatmaps"))
        if table.empty:
            return pd.DataFrame({"trial_id": [], "visits": []})
        shapes = zip(table.pop("rows"), table.pop("columns"), strict=True)
        arrays = [
            np.asarray(flat).reshape(shape)
            for flat, shape in zip(table["visits"], shapes, strict=True)
        ]
        table["visits"] = pd.Series(arrays, index=table.index, dtype=object)
        return table

    @cached_property
    def trajectories(self) -> pd.DataFrame:
        """One row a recorded frame of a trial: trial_id, frame, and x, y, vx, vy,
        arrays (N,) each; so are the rows of the model's state, under their names, and
        `kind`, where the model has any.
        """
        return self._in_order(self._table("trajectories"))

    def trajectory(self, trial: str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """The recorded frames (F,) of a trial, and x, y, vx and vy of its boids in
        them, shape (F, 4, N).

        Raises ChoiceError as `trial_id`, and if none are stored of the trial.
        """
        table = self.read("trajectories", pa.array([trial]))
        if table.num_rows == 0:
            if (whole := self.trial_id(trial)) != trial:
                return self.trajectory(whole)
            raise ChoiceError(
                f"no trajectory of trial {trial} is stored; record:"
                " {trajectories: true} does that",
                self.name,
            )
        frame = table.to_pandas()
        bodies = [np.stack(frame[name].tolist()) for name in ("x", "y", "vx", "vy")]
        return frame["frame"].to_numpy(), np.stack(bodies, axis=1)

    def trial(self, trial: str) -> StoredTrial:
        """A stored trial with its rows of all tables, by its id or the beginning of
        that. Raises ChoiceError as `trial_id`.
        """
        found = stored_trials(self.store, [trial])
        if not found:
            found = stored_trials(self.store, [self.trial_id(trial)])
        return found[0]

    def trial_id(self, beginning: str) -> str:
        """The id of the one stored trial whose id begins so, as `05d7`. Raises
        ChoiceError where there is none, and where there are several.
        """
        stored = self.store.trial_ids()
        if beginning in stored:
            return beginning
        found = [trial for trial in stored if beginning and trial.startswith(beginning)]
        if not found:
            raise ChoiceError(unknown("trial", beginning, stored), self.name)
        if len(found) > 1:
            shown = ", ".join(sorted(found)[:SHOWN_IDS])
            raise ChoiceError(
                f'the ids of {len(found):,} trials begin with "{beginning}": {shown}'
                f"{', ...' if len(found) > SHOWN_IDS else ''}; write more of it",
                self.name,
            )
        return found[0]

    def job(self, stored: StoredTrial) -> "Job":
        """The job that runs a stored trial again. Raises StoreError where no launch can
        have written its row, and where the plan has another map of that name, and
        CodeError where its code may not run.
        """
        # Here, as it brings the kernels along, which tables do without.
        from sweep.store.last_flocks import with_beginning
        from sweep.tables.stored_jobs import stored_job

        known = self.running(stored.provenance)
        check_stored_link(self.name, stored.row, self.whole.plan)
        job = stored_job(self.name, known, self.maps, stored)
        return with_beginning(self.store, job)

    def world(self, trial: str) -> "TrialWorld":
        """The world of a stored trial, drawn again from its row. Raises as `trial` and
        `job`.
        """
        from sweep.trial.world import world_of

        return world_of(self.job(self.trial(trial)))

    @cached_property
    def units(self) -> dict[str, str]:
        """The unit of every column of `trials` and `series` that has one."""
        if self.restricted:
            return self.whole.units
        return self._units(self._table("trials").schema)

    def _units(self, trials: pa.Schema) -> dict[str, str]:
        metadata = {
            column.name: column.metadata or {}
            for schema in (self._series_schema, trials)
            for column in schema
        }
        return {
            name: about[b"unit"].decode(errors="replace")
            for name, about in metadata.items()
            if about.get(b"unit")
        }

    @property
    def columns(self) -> pd.DataFrame:
        """What is stored, a row a column of a table: `table`, `column`, `type`, `unit`
        and `text`, which says what it is.
        """
        statuses, trials = self.store.trial_ids(), self.whole.plan["trial_id"]
        done = [one for one in trials.to_pylist() if statuses.get(one) == "done"][:1]
        tables = {name: self.read(name, pa.array(done, pa.string())) for name in TABLES}
        rows = [
            (name, field.name, str(field.type), *_about(field))
            for name, table in tables.items()
            for field in (table.schema if name == "trials" or table.num_rows else ())
        ]
        return pd.DataFrame(rows, columns=["table", "column", "type", "unit", "text"])

    @cached_property
    def distributions(self) -> dict[str, Declaration]:
        """How the values of each column of a metric are distributed over trials, and
        what they lie in, as the metric declares it; of derived ones as the launch has
        stored it.

        `means` uses it. Up to 0.8 nothing was stored: those are "skewed".
        """
        if self.restricted:
            return self.whole.distributions
        return self._declared(self._table("trials").schema)

    def _declared(self, schema: pa.Schema) -> dict[str, Declaration]:
        known = self.known.metrics
        stored = {
            column.name: (column.metadata or {}).get(DISTRIBUTION, b"").decode()
            for column in schema
        }
        return {
            column: declaration_of(known[name])
            if name in known
            else in_full(declared(stored.get(name, "")))
            for name in self.metrics
            for column in columns_of([name])
        }

    @cached_property
    def _first_row(self) -> "pd.Series[Any]":
        """The first stored trial with all its columns."""
        first = pa.array(self.trials["trial_id"].head(1), pa.string())
        row: pd.Series[Any] = self.read("trials", first).to_pandas().iloc[0]
        return row

    @property
    def missing(self) -> int:
        """How many trials of the spec are not stored."""
        return int(self.plan.num_rows) - len(self.trials)

    @property
    def untried(self) -> int:
        """How many points of the spec have no stored trial."""
        return int((~self.tried).sum())

    def means(
        self,
        metrics: str | Sequence[str],
        varied: str | Sequence[str] | None = None,
        *,
        over: Over = "last",
    ) -> pd.DataFrame:
        """The mean of each metric with its 95 % interval, a row a point, as `by_point`
        has it; beside them the `varied` settings, by default those of the spec. A list
        of one name may be this name. `over` is "last" or "half": the last frame of a
        trial, or its last half, whose means are also the metrics `speed_mean`.

        Each interval is that of the distribution of the metric, and the repeated one of
        a metric that decided how many trials a point has.
        """
        return by_point(
            self.trials,
            self.varied if varied is None else as_names(varied),
            [column_over(name, over) for name in as_names(metrics)],
            repeated=self.repeated,
            distributions=self.distributions,
        )

    def mean_of(self, metric: str, values: ArrayLike) -> Interval:
        """The mean of `values` of a metric (n,), one a trial, such as its means over
        some frames, with the 95 % interval of its distribution. Differences of values
        are none: their declaration is `distributions[metric].of_differences`.
        """
        return mean_interval(values, distribution=self.distributions[metric])

    def statuses(self) -> Counter[str]:
        """How many trials of the spec have which status; `missing` are not stored."""
        stored = self.store.trial_ids()
        return Counter(
            stored.get(trial, "missing") for trial in self.plan["trial_id"].to_pylist()
        )

    def apart(self) -> int:
        """How many stored trials do not belong to the spec as last launched."""
        spec = set(self.whole.plan["trial_id"].to_pylist())
        return len(self.store.trial_ids().keys() - spec)

    def read(
        self, name: str, trial_ids: pa.Array, columns: Iterable[str] = ()
    ) -> pa.Table:
        """The rows of some trials in a stored table, which has at least these columns,
        and no metrics but those of the spec: trials that record more may serve for it.

        Raises StoreError for what no launch writes.
        """
        table = self.store.read(name, trial_ids=trial_ids)
        checked_table = checked(self.name, name, table, self.known, columns)
        return self._of_the_spec(name, checked_table)

    def _of_the_spec(self, name: str, table: pa.Table) -> pa.Table:
        about = self.about
        if about.tables is None or about.series is None:  # up to 0.9 there is no other
            return table
        if name not in about.tables:
            return table.slice(0, 0)
        names, others = table.column_names, list[str]()
        if name == "trials":
            more = [one for one in measured(names, ()) if one not in about.record]
            others = columns_of(more)
        if name == "series":
            kept = ("trial_id", "frame", *about.series)
            others = [one for one in names if one not in kept]
        return table.drop_columns(others)

    def _table(self, name: str, columns: Iterable[str] = ()) -> pa.Table:
        return self.read(name, self.plan["trial_id"].combine_chunks(), columns)

    def _in_order(self, table: pa.Table) -> pd.DataFrame:
        """Rows in the order of the plan, those of one trial as stored."""
        place = pd.Series(
            np.arange(self.plan.num_rows), index=self.plan["trial_id"].to_pandas()
        )
        frame: pd.DataFrame = table.to_pandas()
        order = np.argsort(place.loc[frame["trial_id"]].to_numpy(), kind="stable")
        return frame.iloc[order].reset_index(drop=True)


def _about(field: pa.Field) -> tuple[str, str]:
    """The unit and the text of a stored column."""
    about = field.metadata or {}
    unit, text = (about.get(key, b"").decode(errors="replace") for key in ABOUT)
    return unit, text


def _quoted(given: object) -> str:
    """What was given for a name: only a text has quotation marks."""
    shown = shortened(str(given))
    return f'"{shown}"' if isinstance(given, str) else shown
