"""A stored study as tables: `sweep.load("nguyen2024/separation").trials`."""

import copy
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from kernels.catalogue import Catalogue
from kernels.identity import Code
from kernels.metrics import Metric
from sweep.analysis import Declaration, in_full
from sweep.errors import ChoiceError, StoreError
from sweep.spec import (
    DIRECTION,
    PLAN,
    STUDY_NAME,
    OwnMap,
    Setting,
    averaged_frames,
    columns_of,
    declaration_of,
    declared,
    fitted_preset,
    label,
    maps_from_json,
    sections,
    settings_of,
)
from sweep.store import (
    DISTRIBUTION,
    AxisAbout,
    Location,
    PlacedTrials,
    PlanAbout,
    Store,
    known_with_code,
    known_without_code,
    location,
    measured,
    other_now,
    plan_provenance,
    stamps,
    stored_sources,
)
from sweep.tables.choosing import (
    Chooser,
    Refusals,
    Restriction,
    as_choices,
    spelled,
)
from sweep.tables.results import Looks, Results
from sweep.tables.stored_links import check_stored_link
from sweep.tables.stored_plan import check_plan
from sweep.tables.stored_tables import checked
from sweep.tables.trial_rows import StoredTrial, origins, stored_trials
from sweep.text import shortened, so_many, unknown

if TYPE_CHECKING:
    from sweep.design import Job
    from sweep.trial import TrialWorld


DETAIL = "detail"
TABLES = ("trials", "series", "heatmaps", "profiles", "trajectories")
ABOUT = (b"unit", b"text")
"""Metadata of a stored column."""
POINT_COLUMNS = (
    *("point", "model", "preset", "replicate", "seed", "seed_listed"),
    *("status", "error"),
)
"""Columns of trials, in addition to ids, for means of points."""
OF_POINTS = ("points", "tried", "chooser", "whole")
"""Cached properties, besides `trials`, that depend on the ids of points."""
CONFIDENCES = ("confidence", "nominal_confidence")
SHOWN_IDS = 3
"""Maximum number of ids with a common beginning in an error."""


class NarrowTrials(NamedTuple):
    """Some columns of trials: the location of the rows, a table, and a DataFrame."""

    placed: PlacedTrials
    table: pa.Table
    trials: pd.DataFrame


class Split(NamedTuple):
    """The column that divides points into parts, and a sentence for some values."""

    column: str
    notes: Mapping[str, str]


class Conversion(NamedTuple):
    """A function that converts each table, and the omitted metrics with the reasons."""

    table: Callable[[pa.Table], pa.Table]
    left_out: Mapping[str, str]


IDLE = ("sensing", "actuation", "failures", "medium", "start")
"""Groups of parameters of boids that a model steers."""


class StoredStudy(Results):
    """The stored results of the spec of a study as last launched.

    Each table is read on first access, without custom code that computed the table.

    Parameters
    ----------
    name : str
        The name of the study.
    results : Location or str, default "results"
        The folder or object store of the results.
    trust : bool, default False
        Allow custom code of a study that somebody else launched, when trials run again.

    Attributes
    ----------
    split
        The division of points by `divided`, if any.
    conversion
        The conversion of tables by `converted`, if any.

    Raises
    ------
    ChoiceError
        If `name` cannot be the name of a study.
    StoreError
        If the study is not stored there.

    Examples
    --------
    >>> study = sweep.load("my/first")
    >>> study.metrics, study.varied, len(study.trials)
    (['speed', 'polarization'], ['separation_weight'], 30)
    """

    split: Split | None = None
    conversion: Conversion | None = None

    def __init__(
        self, name: str, results: Location | str = "results", *, trust: bool = False
    ) -> None:
        if not isinstance(name, str) or not STUDY_NAME.fullmatch(name):
            raise ChoiceError(
                f"study {_quoted(name)} is not allowed;"
                ' allowed: names of folders below the results, joined by "/"'
            )
        self.name = name
        self.trust = trust
        place = location(results)
        self.store = Store(place / name, place)
        self.plan = self.store.read_plan()
        self.provenance = plan_provenance(self.plan, self.store.folder / PLAN)
        check_plan(name, self.plan, self.provenance, self.known)

    def __repr__(self) -> str:
        chosen = [f"{name} = {spelled(value)}" for name, value in self.chosen.items()]
        requirements = ", ".join([*chosen, *self.conditions])
        where = f" where {requirements}" if requirements else ""
        trials = so_many(self.plan.num_rows, "trial")
        return f"<StoredStudy {self.name}{where}: {trials}>"

    def where(self, *texts: str, **settings: object) -> Self:
        """Select the points that satisfy all requirements.

        Parameters
        ----------
        *texts : str
            Conditions such as `"separation_weight >= 1"`, or parameters in the form of
            a command, such as `"n=50,map=empty"`.
        **settings
            Parameter values; a list means any value of the list. Numbers are equal if
            nine digits agree. `detail` selects a component of an ablation study, as in
            `sweep table`.

        Returns
        -------
        StoredStudy
            The study, as if the spec had only these points. Analyses and figures accept
            the result like any study, and `where` can restrict the result further.

        Raises
        ------
        ChoiceError
            If a parameter is unknown, a value or condition fits no point, or no point
            satisfies all requirements. All mistakes are reported together.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.where("separation_weight >= 1")
        <StoredStudy my/first where separation_weight >= 1: 20 trials>
        >>> study.where(separation_weight=[0.5, 2])
        <StoredStudy my/first where separation_weight = 0.5 or 2: 20 trials>
        """
        if not texts and not settings:
            return self
        selected, restriction = self._chosen_points(texts, settings)
        points = self.points.index[selected]
        part = self._without_tables()
        part.whole = self.whole
        part.chosen = {**self.chosen, **restriction.settings}
        part.conditions = (*self.conditions, *restriction.conditions)
        part.plan = self.plan.filter(
            pc.is_in(self.plan["point"], value_set=pa.array(points, pa.string()))
        )
        part.trials = self.trials[self.trials["point"].isin(points)].reset_index(
            drop=True
        )
        return part

    def divided(
        self, column: str, labels: "pd.Series[str]", notes: Mapping[str, str]
    ) -> Self:
        """Divide points by a label of trials, over which nothing is averaged.

        Parameters
        ----------
        column : str
            The new parameter that has the labels.
        labels : Series of str
            The label of each trial by id, "" for trials without a label.
        notes : mapping of str to str
            A sentence for each label, for tables and figures that show the label.

        Returns
        -------
        StoredStudy
            The study, in which a point with several labels becomes several points with
            ids `label:point`.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> is_fast = study.trials.set_index("trial_id")["speed"] > 1
        >>> pace = is_fast.map({True: "fast", False: "slow"})
        >>> divided = study.divided("pace", pace, {"slow": "Some trials are slow."})
        >>> divided.varied, divided.apart_notes
        (['pace', 'separation_weight'], ['Some trials are slow.'])
        """
        part = copy.copy(self)
        for name in OF_POINTS:
            vars(part).pop(name, None)
        part.split = Split(column, notes)
        if self.restricted:
            part.whole = self.whole.divided(column, labels, notes)
        planned = self.plan.select(["trial_id", "point"]).to_pandas()
        label = planned["trial_id"].map(labels).fillna("").astype(str)
        points = pa.array(label + ":" + planned["point"], pa.string())
        place = self.plan.column_names.index("point")
        plan = self.plan.set_column(place, "point", points)
        part.plan = plan.append_column(column, pa.array(label, pa.string()))
        if "trials" in vars(self):  # the table may have few columns, see `narrow`
            part.trials = part._with_labels(self.trials)
        return part

    def converted(
        self, table: Callable[[pa.Table], pa.Table], left_out: Mapping[str, str]
    ) -> Self:
        """Return the study with tables converted to the form of another study.

        Parameters
        ----------
        table : callable
            A function that converts a stored table, or the plan.
        left_out : mapping of str to str
            Metrics that cannot be converted, each with the reason.

        Returns
        -------
        StoredStudy
            The study, without the metrics of `left_out`.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> same = study.converted(lambda table: table, {"speed": "other unit"})
        >>> same.metrics, same.left_out
        (['polarization'], {'speed': 'other unit'})
        """
        part = self._without_tables()
        part.conversion = Conversion(table, left_out)
        part.plan = table(self.plan)
        return part

    def _without_tables(self) -> Self:
        """Return a copy that has read no table, for new rows or columns."""
        part = copy.copy(self)
        for name in vars(self):
            if isinstance(getattr(type(self), name, None), cached_property):
                delattr(part, name)
        return part

    def _with_labels(self, trials: pd.DataFrame) -> pd.DataFrame:
        """Return trials with the points of the plan and the labels of the split."""
        if self.split is None:
            return trials
        column = self.split.column
        plan = self.plan.select(["trial_id", "point", column]).to_pandas()
        planned = plan.set_index("trial_id").loc[trials["trial_id"]]
        return trials.assign(
            **{name: planned[name].to_numpy(object) for name in ("point", column)}
        )

    def _chosen_points(
        self, texts: Iterable[str], settings: Mapping[str, object]
    ) -> tuple[NDArray[np.bool_], Restriction]:
        """Return a mask of the points that satisfy all requirements, and these."""
        refusals = Refusals()
        chooser = self.chooser
        restriction = Restriction(as_choices(settings), ())
        for text in texts:
            with refusals.noted():
                restriction = chooser.restriction(text, restriction)
        selected = np.ones(chooser.points, np.bool_)
        with refusals.noted():
            selected &= chooser.having(restriction.settings)
        for condition in restriction.conditions:
            with refusals.noted():
                selected &= chooser.holding(condition)
        refusals.check()
        if not selected.any():
            choices = restriction.settings.items()
            listed = [f"{name} = {spelled(choice)}" for name, choice in choices]
            raise ChoiceError(
                "no point satisfies all of:"
                f" {', '.join([*listed, *restriction.conditions])}",
                self.name,
            )
        return selected, restriction

    @cached_property
    def whole(self) -> Self:
        """The study before any `where`.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.where(separation_weight=1).whole
        <StoredStudy my/first: 30 trials>
        """
        return self

    @cached_property
    def asked(self) -> pa.Table | None:
        """The stored requests of a search at the time of the first access.

        A calibration has requests too. None if a spec lists all trials.

        Examples
        --------
        >>> study = sweep.load("my/gains")
        >>> study.asked.column_names
        ['run', 'phase', 'candidate', 'batch', 'block', 'scenario', 'trial_id']
        """
        return self.store.read_asked() if self.whole is self else self.whole.asked

    def narrow(self, metrics: Sequence[str]) -> Self:
        """Return the study with few columns of trials.

        `trials` has `POINT_COLUMNS`, the parameters that differ and these metrics. For
        a million trials the first reading takes a second, and a reading of further
        metrics a tenth of a second.

        Parameters
        ----------
        metrics : sequence of str
            Names of metrics; a name that is not recorded is ignored.

        Returns
        -------
        StoredStudy
            The study, whose other tables have all columns.

        Raises
        ------
        StoreError
            If a column is missing.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.narrow(["speed"]).trials.columns.tolist()
        ['trial_id', 'point', 'model', ..., 'separation_weight', 'speed', 'speed_mean']
        """
        chosen = [name for name in metrics if name in self.metrics]
        try:
            narrow = self._with_metrics(chosen)
        except StoreError:  # parts may have been merged in the meantime
            vars(self).pop("_settled", None)
            narrow = self._with_metrics(chosen)
        part = copy.copy(self)
        vars(part).pop("tried", None)
        trials = narrow.trials if len(narrow.trials) else self.trials
        part.trials = self._with_labels(trials)
        part.points = self.points  # computed once for all narrow studies
        part.distributions = self._declared(narrow.table.schema)
        part.units = self._units(narrow.table.schema)
        return part

    @cached_property
    def _settled(self) -> NarrowTrials:
        """The columns of trials of all narrow studies, in the order of the spec."""
        placed = self.store.placed(self.plan["trial_id"])
        stored = self._stored_settings
        table = self.store.columns(placed, [*POINT_COLUMNS, *stored])
        needed = stored if table.num_rows else ()
        table = checked(self.name, "trials", table, self.known, columns=needed)
        return NarrowTrials(placed, table, table.to_pandas())

    def _with_metrics(self, metrics: Sequence[str]) -> NarrowTrials:
        """Return the columns of narrow studies, and these metrics.

        Strings, which take most of the time, are converted only once.
        """
        placed, table, trials = self._settled
        if not metrics:
            return self._settled
        stored = self.store.columns(placed, columns_of(metrics))
        new = [name for name in stored.column_names if name not in table.column_names]
        for name in new:
            table = table.append_column(stored.schema.field(name), stored[name])
        needed = metrics if table.num_rows else ()
        table = checked(self.name, "trials", table, self.known, columns=needed)
        more = table.select(new).to_pandas()
        return NarrowTrials(placed, table, pd.concat([trials, more], axis=1))

    @cached_property
    def points(self) -> pd.DataFrame:
        """One row per point, by the id.

        The columns are the labels of the split, and every parameter that differs
        between the points of the spec. If an axis ablates a preset, there is a column
        `detail`, or `detail_<preset>` for each of several ablated presets.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.points["separation_weight"].tolist()
        [0.5, 1.0, 2.0]
        """
        varied = [*([self.split.column] if self.split else []), *self.about.varied]
        numbers = self.plan["point"].combine_chunks().dictionary_encode().indices
        first = np.unique(numbers.to_numpy(), return_index=True)[1]
        plan = self.plan.select(["point", *varied]).take(pa.array(first))
        points: pd.DataFrame = plan.to_pandas().set_index("point")
        for preset in self.about.ablated:
            points[self.detail(preset)] = self._details(preset, points)
        return points

    @property
    def headings(self) -> list[str]:
        """The columns that distinguish points in tables and figures.

        The columns are the parameters that differ; `detail` replaces the parameters
        that an axis ablates.

        Examples
        --------
        >>> study = sweep.load("my/ablation")
        >>> study.varied, study.headings
        (['motor_lag', 'sensing_delay', 'sensing_period'], ['detail'])
        """
        ablated = self.about.ablated
        switched = {
            name for groups in ablated.values() for group in groups for name in group
        }
        varied = [name for name in self.varied if name not in switched]
        return [*varied, *(self.detail(preset) for preset in ablated)]

    @cached_property
    def chooser(self) -> Chooser:
        """The chooser of points by every parameter and `detail`, for `where`.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.chooser.having({"separation_weight": 1.0}).tolist()
        [False, True, False]
        """
        points = self.points
        columns: dict[str, Any] = {
            str(name): column.to_numpy() for name, column in points.items()
        }
        if len(self.trials) and "model" in self.trials:
            fixed = self._first_row
            columns |= {
                name: fixed[name]
                for name in self.settings
                if name in fixed.index and name not in columns
            }
        return Chooser(columns, len(points), self.name, columns_of(self.metrics))

    def details(self, preset: str) -> "pd.Series[str]":
        """Return the components that an ablation has changed in each trial.

        Parameters
        ----------
        preset : str
            The ablated preset, or the name of the axis if the spec names the
            components.

        Returns
        -------
        Series of str
            By trial_id, in the order of `trials`. The value is "" if no parameter of
            the axis differs from the preset of the study. If one component differs, the
            value is the name of the parameter ("map" for the world). The value is "all"
            if all components differ, and "all but drag" if one of three or more does
            not. Else the value has all names, joined by " + ". Names of components in
            the spec are used instead of parameters.

        Raises
        ------
        ChoiceError
            If no axis of the study ablates that preset.

        Examples
        --------
        >>> study = sweep.load("my/ablation")
        >>> study.details("real").unique().tolist()
        ['', 'slow', 'late', 'all']
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
        """Return the column of `points` that has the components of a preset.

        Parameters
        ----------
        preset : str
            The ablated preset, or the name of the axis if the spec names the
            components.

        Returns
        -------
        str
            "detail", or `detail_<preset>` if several presets are ablated.

        Examples
        --------
        >>> study = sweep.load("my/ablation")
        >>> study.detail("real")
        'detail'
        """
        return DETAIL if len(self.about.ablated) == 1 else f"{DETAIL}_{preset}"

    def _details(self, preset: str, points: pd.DataFrame) -> list[str]:
        """Return the changed components of each of `points`, see `details`."""
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
        """Return the names of the components of a preset, or of an axis with names.

        Parameters
        ----------
        preset : str
            The ablated preset, or the name of the axis.

        Returns
        -------
        list of str
            The names in the spec, or the first parameter of each component.

        Examples
        --------
        >>> study = sweep.load("my/ablation")
        >>> study.detail_names("real")
        ['slow', 'late']
        """
        groups = self.about.ablated[preset]
        return self.about.details or [names[0] for names in groups]

    @cached_property
    def known(self) -> Catalogue:
        """The models, metrics, maps and starts of the study, by name.

        Custom code is not loaded.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> "cafeteria" in study.known.maps
        True
        """
        return known_without_code(self.store, self.provenance)

    def running(self, origin: Mapping[str, Any]) -> Catalogue:
        """Return the catalogue of names for trials of an origin that run again.

        The catalogue has the custom code that computed the trials.

        Parameters
        ----------
        origin : mapping
            The provenance of the trials.

        Returns
        -------
        Catalogue
            The models, metrics, maps and starts by name.

        Raises
        ------
        CodeError
            If the code is not allowed to run.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> "nguyen2024" in study.running(study.provenance).models
        True
        """
        return known_with_code(self.store, origin, self.trust)

    def other_now(self, stored: StoredTrial) -> list[Path]:
        """Return the files of custom code that changed since a stored trial.

        The files are next to the spec. The trial runs again with the original code.

        Parameters
        ----------
        stored : StoredTrial
            The trial that `trial` returns.

        Returns
        -------
        list of Path
            The changed files.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> trial = study.trial(study.trials["trial_id"][0])
        >>> study.other_now(trial)  # the study has no custom code
        []
        """
        return other_now(self.store, stored.provenance)

    @property
    def own_code(self) -> dict[str, Mapping[str, str]]:
        """The text of each file of custom code, by the sha256 of the files together.

        Files of the spec come first, then files that computed further stored trials.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.own_code  # the study has no custom code
        {}
        """
        stored = origins(self.store, [*self.store.trial_ids()])
        return {
            origin["own"]["sha"]: stored_sources(self.store, origin)
            for origin in (self.provenance, *(origin for origin, _ in stored))
            if "own" in origin
        }

    @property
    def settings(self) -> dict[str, Setting]:
        """The parameters that a study of the model may name.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.settings["separation_weight"].text
        'weight of the separation rule (Eq. 3)'
        """
        # Up to 0.1 a plan does not name the model.
        model = self.provenance.get("model") or str(self.trials["model"].iloc[0])
        return settings_of(model, self.known).of_study(())

    @property
    def idle(self) -> set[str]:
        """The parameters that mean nothing for a recording; none for a model.

        A recording has a world and ranges of metrics, but no senses, no start and no
        drawn obstacles.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.idle
        set()
        """
        model = self.provenance.get("model")
        if model is None or not self.known.models[model].events:
            return set()
        metrics = [self.known_metrics.get(name) for name in self.metrics]
        read = {name for metric in metrics if metric for name in metric.parameters}
        return {
            name
            for name, setting in self.settings.items()
            if setting.group in IDLE
            or setting.only_where
            or (setting.group == "observation" and name not in read)
        }

    @property
    def spec(self) -> str:
        """The YAML text of the spec as last launched.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> print(study.spec)
        study: my/first
        model: nguyen2024
        ...
        """
        return str(self.provenance["spec"])

    @cached_property
    def maps(self) -> dict[str, OwnMap]:
        """The maps in the spec, by name.

        Raises
        ------
        StoreError
            If a stored map is not valid.

        Examples
        --------
        >>> study = sweep.load("my/map")
        >>> study.maps  # the map is a built-in map
        {}
        """
        try:
            return maps_from_json(self.about.maps, self.known.maps)
        except ValueError as error:
            raise StoreError(
                f"the stored maps are not allowed: {error}", self.name
            ) from None

    @property
    def varied(self) -> list[str]:
        """The labels of the split, and the parameters that differ between points.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.varied
        ['separation_weight']
        >>> study.where(separation_weight=1).varied
        []
        """
        varied = self.about.varied
        if self.restricted:
            differ = self.points[varied].nunique() > 1
            varied = [name for name in varied if differ[name]]
        if self.split and self.points[self.split.column].nunique() > 1:
            return [self.split.column, *varied]
        return list(varied)

    @property
    def _stored_settings(self) -> list[str]:
        """The parameters that differ between points and are columns of trials."""
        return [name for name in self.varied if name in self.about.varied]

    def undivided(self, point: str) -> str:
        """Return the id that a point has before `divided`.

        Parameters
        ----------
        point : str
            The id `label:point`.

        Returns
        -------
        str
            The id without the label.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.undivided("fast:9c97")
        '9c97'
        """
        return point.rpartition(":")[2]

    @property
    def kept_apart(self) -> list[str]:
        """The columns whose values are never averaged or shown as one.

        The columns are the labels of the split and the direction of chains, if present.

        Examples
        --------
        >>> study = sweep.load("my/loop")
        >>> study.kept_apart
        ['direction']
        """
        split = [self.split.column] if self.split else []
        return [*split, *([DIRECTION] if DIRECTION in self.varied else [])]

    @property
    def apart_notes(self) -> list[str]:
        """Sentences about the parts that the split keeps apart.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.apart_notes  # the study is not divided
        []
        """
        if self.split is None:
            return []
        labels = set(self.points[self.split.column])
        return [text for label, text in self.split.notes.items() if label in labels]

    @property
    def left_out(self) -> Mapping[str, str]:
        """The metrics that the conversion leaves out, each with the reason.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.left_out  # the study is not converted
        {}
        """
        return self.conversion.left_out if self.conversion else {}

    @property
    def metrics(self) -> list[str]:
        """The recorded metrics, without the omitted metrics.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.metrics
        ['speed', 'polarization']
        """
        left_out = self.left_out
        return [name for name in self.about.record if name not in left_out]

    @property
    def known_metrics(self) -> Mapping[str, Metric]:
        """The metrics that this version or the custom code defines, by name.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.known_metrics["polarization"].text
        'length of the mean unit velocity'
        """
        return self.known.metrics

    @property
    def series_metrics(self) -> list[str]:
        """The metrics that are stored frame by frame.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.series_metrics
        ['speed', 'polarization']
        """
        names = self._series_schema.names
        return [name for name in names if name not in ("trial_id", "frame")]

    @property
    def _series_schema(self) -> pa.Schema:
        """The columns of `series`; no row is read."""
        empty = self.store.schema("series").empty_table()
        return self._of_the_spec("series", empty).schema

    @property
    def about(self) -> PlanAbout:
        """The properties of the study that the plan records besides trials.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.about.tables
        ['trials', 'series']
        """
        return PlanAbout.read(self.provenance)

    @property
    def code(self) -> Code | None:
        """The hashes of the code of the last launch; None before version 0.7.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> list(study.code.models)
        ['nguyen2024 as_run']
        """
        return stamps(self.provenance)

    @property
    def axes(self) -> dict[str, AxisAbout]:
        """The axes by name; the labels of the split are listed values of an axis.

        Raises
        ------
        StoreError
            For a plan before version 0.2, which does not record axes.

        Examples
        --------
        >>> axis = sweep.load("my/weights").axes["weights"]
        >>> axis.sampler, axis.settings
        ('lhs', ['separation_weight', 'cohesion_weight'])
        """
        axes = self.about.axes
        if axes is None:
            raise StoreError(
                "the plan does not contain the axes; launch the study again",
                self.name,
            )
        if self.split:
            return {self.split.column: AxisAbout([self.split.column], None), **axes}
        return axes

    @property
    def looks(self) -> Looks | None:
        """The metrics that decided the number of trials of a point.

        None if the number is fixed.

        Examples
        --------
        >>> study = sweep.load("my/until")
        >>> study.looks
        Looks(metrics=('speed',), confidence=0.95, nominal=0.98...)
        """
        for key, record in self.about.sections.items():
            if metrics := sections()[key].looks_at(record):
                return Looks(metrics, *(record[name] for name in CONFIDENCES))
        return None

    @cached_property
    def trials(self) -> pd.DataFrame:
        """One row per stored trial of the spec, in the order of the plan.

        The columns are every parameter and every metric. Before the first trial is
        stored, the columns are the columns of the plan, `status`, `error` and the
        metrics.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.trials.groupby("separation_weight")["speed"].mean().round(2).tolist()
        [1.86, 0.38, 2.61]
        """
        table = self._table("trials", (*self._stored_settings, *self.metrics))
        if not table.num_rows:
            empty: pd.DataFrame = self.plan.slice(0, 0).to_pandas()
            return empty.assign(
                status=pd.Series(dtype=object),
                error=pd.Series(dtype=object),
                **dict.fromkeys(columns_of(self.metrics), pd.Series(dtype=np.float64)),
            )
        return self._with_labels(self._in_order(table))

    @cached_property
    def series(self) -> pd.DataFrame:
        """One row per recorded frame of a trial.

        Columns: `trial_id`, `frame` and the metrics that are stored frame by frame.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> mean = study.series.groupby("frame")["polarization"].mean()
        >>> mean.iloc[[0, 50, 100]].round(2).tolist()
        [0.17, 0.36, 0.49]
        """
        return self._in_order(self._table("series"))

    @cached_property
    def heatmaps(self) -> pd.DataFrame:
        """One row per trial: `trial_id` and `visits`.

        `visits` is an array of counts, (rows, columns), with -1 in obstacles.

        Examples
        --------
        >>> study = sweep.load("my/map")
        >>> study.heatmaps["visits"][0].shape
        (600, 800)
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
    def profiles(self) -> pd.DataFrame:
        """One row per trial: `trial_id`, and two arrays per recorded profile, (K,).

        The column with the name of the profile has the values. The column with the
        ending `_at` has their positions along the axis. `sweep profiles` prints means.

        Examples
        --------
        >>> study = sweep.load("my/profiles")
        >>> first = study.profiles.iloc[0]
        >>> first["pair_distribution_at"].shape == first["pair_distribution"].shape
        True
        """
        return self._in_order(self._table("profiles"))

    @cached_property
    def trajectories(self) -> pd.DataFrame:
        """One row per recorded frame of a trial.

        Columns: `trial_id`, `frame`, and the arrays `x`, `y`, `vx` and `vy`, (N,). Each
        row of the state of a model is an array by name, and `kind` has the types of
        boids.

        Examples
        --------
        >>> study = sweep.load("my/map")
        >>> study.trajectories.columns.tolist()
        ['trial_id', 'frame', 'x', 'y', 'vx', 'vy']
        >>> study.trajectories["x"][0].shape
        (20,)
        """
        return self._in_order(self._table("trajectories"))

    def trajectory(self, trial: str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return the recorded frames of a trial, and the boids in the frames.

        Parameters
        ----------
        trial : str
            The id of a trial, or the beginning of the id.

        Returns
        -------
        frames : array of int
            Numbers of the frames, (F,).
        bodies : array of float
            x, y, vx and vy of N boids, (F, 4, N).

        Raises
        ------
        ChoiceError
            If `trial_id` raises it, or no trajectory of the trial is stored.

        Examples
        --------
        >>> study = sweep.load("my/map")
        >>> frames, bodies = study.trajectory(study.trials["trial_id"][0])
        >>> frames.tolist(), bodies.shape
        ([0, 10, 20, 30, 40, 50, 60], (7, 4, 20))
        """
        table = self.read("trajectories", pa.array([trial]))
        if table.num_rows == 0:
            if (full_id := self.trial_id(trial)) != trial:
                return self.trajectory(full_id)
            raise ChoiceError(
                f"no trajectory of trial {trial} is stored; record:"
                " {trajectories: true} in the spec stores trajectories",
                self.name,
            )
        frame = table.to_pandas()
        bodies = [np.stack(frame[name].tolist()) for name in ("x", "y", "vx", "vy")]
        return frame["frame"].to_numpy(), np.stack(bodies, axis=1)

    def trial(self, trial: str) -> StoredTrial:
        """Return a stored trial with the rows of all tables.

        Parameters
        ----------
        trial : str
            The id of a trial, or the beginning of the id.

        Returns
        -------
        StoredTrial
            With the `row` of `trials` as a dict, and the other `tables` by name.

        Raises
        ------
        ChoiceError
            If `trial_id` raises it.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> stored = study.trial(study.trials["trial_id"][0])
        >>> stored.row["separation_weight"], list(stored.tables)
        (0.5, ['series'])
        """
        trials = stored_trials(self.store, [trial])
        if not trials:
            trials = stored_trials(self.store, [self.trial_id(trial)])
        return trials[0]

    def trial_id(self, beginning: str) -> str:
        """Return the id of the single stored trial with a beginning such as `05d7`.

        Parameters
        ----------
        beginning : str
            The beginning of the id, or the id.

        Returns
        -------
        str
            The id.

        Raises
        ------
        ChoiceError
            If no stored trial or several have this beginning.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> first = study.trials["trial_id"][0]
        >>> study.trial_id(first[:8]) == first
        True
        """
        stored = self.store.trial_ids()
        if beginning in stored:
            return beginning
        ids = [trial for trial in stored if beginning and trial.startswith(beginning)]
        if not ids:
            raise ChoiceError(unknown("trial", beginning, stored), self.name)
        if len(ids) > 1:
            shown = ", ".join(sorted(ids)[:SHOWN_IDS])
            raise ChoiceError(
                f'the ids of {len(ids):,} trials begin with "{beginning}": {shown}'
                f"{', ...' if len(ids) > SHOWN_IDS else ''}; give more digits",
                self.name,
            )
        return ids[0]

    def job(self, stored: StoredTrial) -> "Job":
        """Return the job that runs a stored trial again.

        Parameters
        ----------
        stored : StoredTrial
            The trial that `trial` returns.

        Returns
        -------
        Job
            The job, with the model, the seed and all parameters.

        Raises
        ------
        StoreError
            If no launch can have written the row, or if the plan has a different map of
            that name.
        CodeError
            If the code is not allowed to run.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> job = study.job(study.trial(study.trials["trial_id"][0]))
        >>> job.model, job.seed, job.settings["n"]
        ('nguyen2024', 0, 30)
        """
        # Imported here: the module imports the kernels, which tables do not need.
        from sweep.store import with_beginning
        from sweep.tables.stored_jobs import stored_job

        catalogue = self.running(stored.provenance)
        check_stored_link(self.name, stored.row, self.whole.plan)
        job = stored_job(self.name, catalogue, self.maps, stored)
        return with_beginning(self.store, job)

    def world(self, trial: str) -> "TrialWorld":
        """Return the world of a stored trial, drawn again from the row.

        Parameters
        ----------
        trial : str
            The id of a trial, or the beginning of the id.

        Returns
        -------
        TrialWorld
            The size of the world, the obstacles and the goals.

        Raises
        ------
        ChoiceError
            As `trial`.
        StoreError
            As `job`.
        CodeError
            As `job`.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> world = study.world(study.trials["trial_id"][0])
        >>> world.width, world.height, len(world.obstacles)
        (1280.0, 740.0, 6)
        """
        from sweep.trial import world_of

        return world_of(self.job(self.trial(trial)))

    @cached_property
    def units(self) -> dict[str, str]:
        """The unit of every column of `trials` and `series` that has one.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.units["speed"], study.units["frame"]
        ('px/step', 'step')
        """
        if self.restricted:
            return self.whole.units
        return self._units(self._table("trials").schema)

    @property
    def averaged(self) -> str:
        """The frames of a trial that the columns `<metric>_mean` cover.

        Examples
        --------
        >>> sweep.load("my/first").averaged
        'the second half'
        """
        return averaged_frames(self.known.models[self.provenance["model"]])

    def _units(self, trials: pa.Schema) -> dict[str, str]:
        metadata = {
            column.name: column.metadata or {}
            for schema in (self._series_schema, trials)
            for column in schema
        }
        return {
            name: column[b"unit"].decode(errors="replace")
            for name, column in metadata.items()
            if column.get(b"unit")
        }

    @property
    def columns(self) -> pd.DataFrame:
        """The columns of all tables: `table`, `column`, `type`, `unit` and `text`.

        `text` describes the column.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> columns = study.columns.query("table == 'series' and unit != ''")
        >>> columns[["column", "unit", "text"]].values.tolist()
        [['frame', 'step', 'steps done'], ['speed', 'px/step', 'mean speed']]
        """
        statuses = self.store.trial_ids()
        trials = self.whole.plan["trial_id"].to_pylist()
        done = [trial for trial in trials if statuses.get(trial) == "done"][:1]
        tables = {name: self.read(name, pa.array(done, pa.string())) for name in TABLES}
        rows = [
            (name, field.name, str(field.type), *_about(field))
            for name, table in tables.items()
            for field in (table.schema if name == "trials" or table.num_rows else ())
        ]
        return pd.DataFrame(rows, columns=["table", "column", "type", "unit", "text"])

    @cached_property
    def distributions(self) -> dict[str, Declaration]:
        """The declared distribution and range of the values of each metric column.

        A derived metric has the declaration that the launch has stored. Up to version
        0.8 no launch stored declarations, and derived metrics are "skewed". `means`
        uses the declarations.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.distributions["polarization"].distribution
        'normal'
        >>> study.distributions["polarization"].support
        Support(low=0.0, high=1.0)
        """
        if self.restricted:
            return self.whole.distributions
        return self._declared(self._table("trials").schema)

    def _declared(self, schema: pa.Schema) -> dict[str, Declaration]:
        metrics = self.known.metrics
        stored = {
            column.name: (column.metadata or {}).get(DISTRIBUTION, b"").decode()
            for column in schema
        }
        return {
            column: declaration_of(metrics[name])
            if name in metrics
            else in_full(declared(stored.get(name, "")))
            for name in self.metrics
            for column in columns_of([name])
        }

    @cached_property
    def _first_row(self) -> "pd.Series[Any]":
        """The first stored trial with all columns."""
        first = pa.array(self.trials["trial_id"].head(1), pa.string())
        row: pd.Series[Any] = self.read("trials", first).to_pandas().iloc[0]
        return row

    def statuses(self) -> Counter[str]:
        """Return the number of trials by status; `missing` trials are not stored.

        Returns
        -------
        Counter
            The number by status, such as "done".

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.statuses()
        Counter({'done': 30})
        """
        stored = self.store.trial_ids()
        return Counter(
            stored.get(trial, "missing") for trial in self.plan["trial_id"].to_pylist()
        )

    def apart(self) -> int:
        """Return the number of stored trials that the spec as last launched lacks.

        Returns
        -------
        int
            The number of trials.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.apart()
        0
        """
        spec = set(self.whole.plan["trial_id"].to_pylist())
        return len(self.store.trial_ids().keys() - spec)

    def read(
        self, name: str, trial_ids: pa.Array, columns: Iterable[str] = ()
    ) -> pa.Table:
        """Return rows of a stored table without metrics that the spec does not record.

        Stored trials may have more metrics than the spec.

        Parameters
        ----------
        name : str
            The table.
        trial_ids : pyarrow.Array
            The trials.
        columns : iterable of str, optional
            Columns that the table must have.

        Returns
        -------
        pyarrow.Table
            The rows.

        Raises
        ------
        StoreError
            If a column is missing, or no launch writes such a table.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> first = study.plan["trial_id"].combine_chunks().slice(0, 1)
        >>> study.read("series", first).shape
        (101, 4)
        """
        table = self.store.read(name, trial_ids=trial_ids)
        checked_table = checked(self.name, name, table, self.known, columns=columns)
        recorded = self._of_the_spec(name, checked_table)
        if self.conversion is None:
            return recorded
        left_out = {*columns_of(self.left_out)}.intersection(recorded.column_names)
        return self.conversion.table(recorded.drop_columns(list(left_out)))

    def _of_the_spec(self, name: str, table: pa.Table) -> pa.Table:
        """Return a table without rows and metrics that the spec does not record."""
        plan = self.about
        if plan.tables is None or plan.series is None:  # up to 0.9: nothing to remove
            return table
        if name not in plan.tables:
            return table.slice(0, 0)
        columns = table.column_names
        surplus = list[str]()
        if name == "trials":
            metrics = measured(columns, ())
            surplus = columns_of([name for name in metrics if name not in plan.record])
        if name == "series":
            recorded = ("trial_id", "frame", *plan.series)
            surplus = [column for column in columns if column not in recorded]
        return table.drop_columns(surplus)

    def _table(self, name: str, columns: Iterable[str] = ()) -> pa.Table:
        return self.read(name, self.plan["trial_id"].combine_chunks(), columns)

    def _in_order(self, table: pa.Table) -> pd.DataFrame:
        """Return rows in the order of the plan; rows of a trial keep their order."""
        place = pd.Series(
            np.arange(self.plan.num_rows), index=self.plan["trial_id"].to_pandas()
        )
        frame: pd.DataFrame = table.to_pandas()
        order = np.argsort(place.loc[frame["trial_id"]].to_numpy(), kind="stable")
        return frame.iloc[order].reset_index(drop=True)


def _about(field: pa.Field) -> tuple[str, str]:
    """Return the unit and the text of a stored column."""
    stored = field.metadata or {}
    unit, text = (stored.get(key, b"").decode(errors="replace") for key in ABOUT)
    return unit, text


def _quoted(name: object) -> str:
    """Return an object in place of a name for an error; a string gets quotes."""
    shown = shortened(str(name))
    return f'"{shown}"' if isinstance(name, str) else shown
