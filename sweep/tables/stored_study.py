"""A stored study, as its tables: `sweep.load("nguyen2024/separation").trials`."""

from collections import Counter
from collections.abc import Iterable
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray

from kernels.identity import Code
from sweep.analysis.sequential import from_json, look
from sweep.errors import ChoiceError, StoreError
from sweep.spec.ablation import fitted_preset
from sweep.spec.maps import OwnMap, maps_from_json
from sweep.spec.study_folder import PLAN, STUDY_NAME
from sweep.store.locations import Location, location
from sweep.store.origin import plan_provenance
from sweep.store.plan_about import AxisAbout, PlanAbout
from sweep.store.store import Store
from sweep.tables.stored_plan import check_plan
from sweep.tables.stored_tables import checked
from sweep.tables.stored_trials import StoredTrial, stored_trials
from sweep.text import similar, unknown

if TYPE_CHECKING:
    from sweep.design.jobs import Job
    from sweep.trial.world import TrialWorld


class StoredStudy:
    """The results of a study's spec as last launched; each table is read when first
    asked for.

    `name` is the study's and `results` the folder or object store that holds it. Raises
    StoreError where there is none, and ChoiceError for what is no name.
    """

    def __init__(self, name: str, results: Location | str = "results") -> None:
        if not STUDY_NAME.fullmatch(name):
            raise ChoiceError(
                f'study "{name}" is not allowed:'
                ' a name of folders below the results, joined by "/"'
            )
        self.name = name
        place = location(results)
        self.store = Store(place / name, place)
        if isinstance(place, Path) and not (place / name).is_dir():
            raise StoreError(
                f"{place / name}: no study has been launched"
                f" here{similar(name, _launched(place))}"
            )
        self.plan = self.store.read_plan()
        self.provenance = plan_provenance(self.plan, self.store.folder / PLAN)
        check_plan(name, self.provenance)

    def __repr__(self) -> str:
        return f"<StoredStudy {self.name}: {self.plan.num_rows} trials>"

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
            return maps_from_json(self.about.maps)
        except ValueError as error:
            raise StoreError(
                f"study {self.name}: the stored maps are not allowed: {error}"
            ) from None

    @property
    def varied(self) -> list[str]:
        """The settings that differ between points."""
        return list(self.about.varied)

    @property
    def metrics(self) -> list[str]:
        """The recorded metrics."""
        return list(self.about.record)

    @property
    def about(self) -> PlanAbout:
        """What the plan records of the study, beside its trials."""
        return PlanAbout.read(self.provenance)

    @property
    def code(self) -> Code | None:
        """The stamps of what computes its trials, as of its last launch; None for one
        before 0.7.
        """
        stored = self.provenance.get("code")
        return Code(**stored) if stored else None

    @property
    def axes(self) -> dict[str, AxisAbout]:
        """The axes by name. Raises StoreError for a plan that does not say: of before
        0.2.
        """
        axes = self.about.axes
        if axes is None:
            raise StoreError(
                f"study {self.name}: its plan does not say what its axes sample; launch"
                " it once more"
            )
        return axes

    @property
    def rule(self) -> dict[str, Any]:
        """The rule that adds trials. Raises ChoiceError where there is none."""
        rule = self.about.until
        if rule is None:
            raise ChoiceError(
                f'study {self.name}: its number of trials is fixed; "replicates" has no'
                ' "until"'
            )
        return rule

    @property
    def repeated(self) -> dict[str, float]:
        """The metric that decided how many trials a point has, with the confidence of
        its interval at each look.

        Empty where the number of trials is fixed. `by_point` takes it.
        """
        rule = self.about.until
        return {rule["metric"]: rule["nominal_confidence"]} if rule else {}

    @cached_property
    def stopping(self) -> pd.DataFrame:
        """One row a point of a study that adds trials `until` an interval is narrow, in
        the order of the plan.

        Columns: point; n, the number of its trials, which is its last look; values, how
        many of them have a value; the half_width of the repeated interval, in the unit
        of the metric; reached, whether that is narrow enough and final; and why no
        trials follow: "half width", "max" or "too few values", or "not yet" where some
        do. Raises ChoiceError for a study with a fixed number of trials.
        """
        rule = self.rule
        until, stored = (
            from_json(rule),
            self.trials.set_index("trial_id")[rule["metric"]],
        )
        ids = self.plan["trial_id"].to_pandas()
        missing = (
            (~ids.isin(stored.index))
            .groupby(self.plan["point"].to_pandas(), sort=False)
            .sum()
        )
        trials = (
            self.plan["point"]
            .to_pandas()
            .value_counts(sort=False)[missing.index]
            .to_numpy(np.int64)
        )
        seen = look(
            until,
            rule["nominal_confidence"],
            trials,
            stored.reindex(ids).to_numpy(np.float64),
        )
        open_ = (missing.to_numpy() > 0) | (seen.further > trials)
        narrow = seen.half_width <= until.half_width
        why = np.select(
            [open_, narrow, seen.values < 2],
            ["not yet", "half width", "too few values"],
            "max",
        )
        columns = {
            "point": missing.index,
            "n": trials,
            "values": seen.values,
            "half_width": seen.half_width,
        }
        return pd.DataFrame(columns | {"reached": why == "half width", "why": why})

    @cached_property
    def trials(self) -> pd.DataFrame:
        """One row a stored trial of the spec, in its order: what it is, every setting,
        every metric.
        """
        return self._in_order(self._table("trials", (*self.varied, *self.metrics)))

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
        arrays (N,) each.
        """
        return self._in_order(self._table("trajectories"))

    def trajectory(self, trial: str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """The recorded frames (F,) of a trial, and x, y, vx and vy of its boids in
        them, shape (F, 4, N).

        Raises ChoiceError if there is no such trial, or none are stored of it.
        """
        table = self.read("trajectories", pa.array([trial]))
        if table.num_rows == 0:
            stored = self.store.trial_ids()
            if trial not in stored:
                raise ChoiceError(
                    f"study {self.name}: {unknown('trial', trial, stored)}"
                )
            raise ChoiceError(
                f"study {self.name}: no trajectory of trial {trial} is stored; record:"
                " {trajectories: true} does that"
            )
        frame = table.to_pandas()
        bodies = [np.stack(frame[name].tolist()) for name in ("x", "y", "vx", "vy")]
        return frame["frame"].to_numpy(), np.stack(bodies, axis=1)

    def trial(self, trial: str) -> StoredTrial:
        """A stored trial with its rows of all tables. Raises ChoiceError."""
        found = stored_trials(self.store, [trial])
        if not found:
            known = self.plan["trial_id"].to_pylist()
            raise ChoiceError(f"study {self.name}: {unknown('trial', trial, known)}")
        return found[0]

    def job(self, stored: StoredTrial) -> "Job":
        """The job that runs a stored trial again. Raises StoreError where no launch can
        have written its row, and where the plan has another map of that name."""
        # Here, as it brings the kernels along, which tables do without.
        from sweep.tables.stored_jobs import stored_job

        return stored_job(self.name, self.maps, stored)

    def world(self, trial: str) -> "TrialWorld":
        """The world of a stored trial, drawn again from its row. Raises as `trial` and
        `job`.
        """
        from sweep.trial.world import world_of

        return world_of(self.job(self.trial(trial)))

    @property
    def units(self) -> dict[str, str]:
        """The unit of every column of `trials` and `series` that has one."""
        tables = [self._table("trials").schema, self._table("series").schema]
        metadata = {
            column.name: column.metadata or {} for schema in tables for column in schema
        }
        return {
            name: about[b"unit"].decode(errors="replace")
            for name, about in metadata.items()
            if about.get(b"unit")
        }

    def statuses(self) -> Counter[str]:
        """How many trials of the spec have which status; `missing` are not stored."""
        stored = self.store.trial_ids()
        return Counter(
            stored.get(trial, "missing") for trial in self.plan["trial_id"].to_pylist()
        )

    def apart(self) -> int:
        """How many stored trials do not belong to the spec as last launched."""
        return len(
            self.store.trial_ids().keys() - set(self.plan["trial_id"].to_pylist())
        )

    def read(
        self, name: str, trial_ids: pa.Array, columns: Iterable[str] = ()
    ) -> pa.Table:
        """The rows of some trials in a stored table, which has at least these columns.

        Raises StoreError for what no launch writes.
        """
        return checked(
            self.name, name, self.store.read(name, trial_ids=trial_ids), columns
        )

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


def details(study: StoredStudy, preset: str) -> "pd.Series[str]":
    """What the axis that ablates `preset` has changed in each trial, in the order of
    `study.trials`, by trial_id.

    It is "" where no setting of the axis differs from the study's preset, the name of
    the setting where one detail does ("map" where the world does), "all" where all do,
    and else the names of all that do, joined by " + ". Raises ChoiceError where no axis
    of the study ablates that preset.
    """
    ablated = study.about.ablated
    if preset not in ablated:
        raise ChoiceError(
            f"study {study.name}: {unknown('ablated preset', preset, ablated)}"
        )
    trials = study.trials
    before = fitted_preset(study.provenance["model"], study.provenance["preset"])
    changed = pd.DataFrame(
        {
            names[0]: (trials[names] != [before[name] for name in names]).any(axis=1)
            for names in ablated[preset]
        }
    )
    labels = [_label(row, list(changed.columns)) for row in changed.to_numpy()]
    return pd.Series(labels, index=trials["trial_id"], name="detail", dtype=object)


def _launched(results: Path) -> list[str]:
    """The studies in a folder of results, which lie at most three folders deep."""
    plans = (
        plan for depth in range(1, 4) for plan in results.glob("*/" * depth + PLAN)
    )
    return sorted(plan.parent.relative_to(results).as_posix() for plan in plans)


def _label(changed: NDArray[np.bool_], names: list[str]) -> str:
    together = [name for name, differs in zip(names, changed, strict=True) if differs]
    return "all" if len(together) == len(names) > 1 else " + ".join(together)
