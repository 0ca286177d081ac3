"""Several studies as one, in which `study` is a setting that varies: for figures that
show them together, told apart by it.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import pandas as pd
import pyarrow as pa

from sweep.analysis import Declaration, agrees
from sweep.errors import ChoiceError
from sweep.spec.recorded import Column
from sweep.store.plan_about import AxisAbout
from sweep.tables.choosing import spelled
from sweep.tables.stored_study import Looks, StoredStudy

STUDY = "study"
IDS = ("trial_id", "point")
ABOUT = ("model", "preset")
"""What studies may differ in beside settings."""


class JoinedStudies(StoredStudy):
    """The trials of several studies, which share metrics.

    `metrics` are those that all have recorded, in one unit and with one distribution
    and range; `left_out` says why others are not. A setting of one study that another
    one does not vary has there the one value of all its trials. Raises ChoiceError for
    a study that is named twice or has no stored trial, where no metric is shared, and
    for a setting that a study varies and another one has not at all.
    """

    def __init__(self, studies: Sequence[StoredStudy]) -> None:
        self._studies = tuple(studies)
        names = [one.name for one in studies]
        self.name = " and ".join(names)
        if twice := [name for name in names if names.count(name) > 1]:
            raise ChoiceError(f'study "{twice[0]}" is named twice')
        for one in studies:
            if one.trials.empty:
                raise ChoiceError("no trial of it is stored yet", one.name)
        first = studies[0]
        self.store, self.provenance = first.store, first.provenance
        of_all = [set(_restrictions(one)) for one in studies]
        self.conditions = tuple(
            text for text in _restrictions(first) if all(text in one for one in of_all)
        )
        self.whole = self
        recorded = dict.fromkeys(name for one in studies for name in one.metrics)
        why = {name: self._differing(name) for name in recorded}
        self._left_out = {name: reason for name, reason in why.items() if reason}
        self._shared = [name for name, reason in why.items() if not reason]
        if not self._shared:
            reasons = "; ".join(f"{name} {one}" for name, one in self._left_out.items())
            raise ChoiceError(
                f"no metric is the same in all of them: {reasons}", self.name
            )
        tables = [self._with_ids(one.plan.select(IDS), one.name) for one in studies]
        self.plan = pa.concat_tables(tables)

    @property
    def kept_apart(self) -> list[str]:
        """The study, and what its parts keep apart."""
        names = (name for one in self.parts for name in one.kept_apart)
        return [STUDY, *dict.fromkeys(names)]

    @property
    def parts(self) -> tuple[StoredStudy, ...]:
        """The studies."""
        return self._studies

    @property
    def left_out(self) -> dict[str, str]:
        """The metrics that are not the same in all studies, each with the reason."""
        return self._left_out

    @cached_property
    def differ(self) -> dict[str, list[Any]]:
        """The fixed settings in which the studies differ, model and preset before them,
        each with its value in every study.
        """
        first = [one.trials.iloc[0] for one in self.parts]
        varied = {name for one in self.parts for name in one.varied}
        names = (*ABOUT, *self.parts[0].settings)
        fixed = {
            name: [trial[name] for trial in first]
            for name in names
            if name not in varied and all(name in trial for trial in first)
        }
        return {
            name: values
            for name, values in fixed.items()
            if not all(agrees([values[0]], value)[0] for value in values)
        }

    @property
    def metrics(self) -> list[str]:
        """The metrics that all studies share."""
        return self._shared

    @property
    def varied(self) -> list[str]:
        """`study`, and the settings that differ within one of the studies."""
        names = (name for one in self.parts for name in one.headings)
        return [STUDY, *dict.fromkeys(names)]

    @property
    def headings(self) -> list[str]:
        """The same: `detail` is in place of the settings that an axis ablates."""
        return self.varied

    @cached_property
    def points(self) -> pd.DataFrame:
        """One row a point, by its id with the name of its study before it."""
        tables = []
        for one in self.parts:
            table = one.points.reindex(columns=self.varied[1:])
            for name in table.columns[table.isna().all()]:
                table[name] = self._same(one, str(name))
            table.insert(0, STUDY, self._labels[one.name])
            table.index = pd.Index(self._ids(table.index, one.name), name="point")
            tables.append(table)
        return pd.concat(tables)

    @cached_property
    def trials(self) -> pd.DataFrame:
        """The stored trials of all studies, ids with the name of their study."""
        tables = []
        for one in self.parts:
            ids = {name: self._ids(one.trials[name], one.name) for name in IDS}
            tables.append(one.trials.assign(study=self._labels[one.name], **ids))
        return pd.concat(tables, ignore_index=True)

    @cached_property
    def series(self) -> pd.DataFrame:
        """The recorded frames of all studies."""
        tables = [
            one.series.assign(trial_id=self._ids(one.series["trial_id"], one.name))
            for one in self.parts
        ]
        return pd.concat(tables, ignore_index=True)

    @property
    def series_metrics(self) -> list[str]:
        """The shared metrics of which all studies have series."""
        within = [set(one.series_metrics) for one in self.parts]
        return [name for name in self._shared if all(name in one for one in within)]

    @property
    def axes(self) -> dict[str, AxisAbout]:
        """`study`, and the axes of all studies; one is sampled if it is so in any."""
        found = {STUDY: AxisAbout([STUDY], None)}
        for one in self.parts:
            for axis in one.axes.values():
                before = found.get(axis.settings[0])
                if before is None or axis.sampler:
                    found[axis.settings[0]] = axis
        return found

    @cached_property
    def units(self) -> dict[str, str]:
        """The units of all columns; a metric has one in all studies."""
        return {name: unit for one in self.parts for name, unit in one.units.items()}

    @cached_property
    def distributions(self) -> dict[str, Declaration]:
        """How the values of the metrics are distributed, and what they lie in."""
        return {
            name: of for one in self.parts for name, of in one.distributions.items()
        }

    @property
    def repeated(self) -> dict[str, float]:
        """The metrics that decided how many trials there are in some study, each with
        the highest confidence of them.
        """
        found: dict[str, float] = {}
        for one in self.parts:
            for name, confidence in one.repeated.items():
                found[name] = max(confidence, found.get(name, 0.0))
        return found

    @property
    def looks(self) -> Looks | None:
        """Those of the first study with any."""
        return next((one.looks for one in self.parts if one.looks), None)

    @cached_property
    def _labels(self) -> dict[str, str]:
        """Each study as a legend has it."""
        return {
            one.name: f"{one.name} ({self._own(one)}{_done(one):,} trials)"
            for one in self.parts
        }

    def _own(self, study: StoredStudy) -> str:
        """What `where` has chosen in this study and not in all, before a number."""
        own = [one for one in _restrictions(study) if one not in self.conditions]
        return "".join(f"{text}; " for text in own)

    def _differing(self, metric: str) -> str:
        """Why a metric is not the same in all studies; "" where it is."""
        if lacking := [one.name for one in self.parts if metric not in one.metrics]:
            return f"is not recorded in {', '.join(lacking)}"
        column = str(Column(metric))
        for what, of in (
            ("in", [one.units.get(column, "no unit") for one in self.parts]),
            ("declared", [_said(one.distributions[column]) for one in self.parts]),
        ):
            if len(set(of)) > 1:
                pairs = zip(self.parts, of, strict=True)
                said = ", ".join(
                    f"{what} {about} in {one.name}" for one, about in pairs
                )
                return f"is {said}"
        return ""

    @staticmethod
    def _same(study: StoredStudy, setting: str) -> Any:
        """The one value of a setting that a study does not vary."""
        if setting not in study.chooser.columns:
            raise ChoiceError(
                f"it has no {setting}, which another study varies; choose one value"
                f" of it there, by --where or `where`",
                study.name,
            )
        return study.chooser.values(setting)[0]

    @staticmethod
    def _ids(ids: Any, study: str) -> list[str]:
        return [f"{study}:{one}" for one in ids]

    def _with_ids(self, table: pa.Table, study: str) -> pa.Table:
        columns = {name: self._ids(table[name].to_pylist(), study) for name in IDS}
        return pa.table(
            {name: pa.array(ids, pa.string()) for name, ids in columns.items()}
        )


def _restrictions(study: StoredStudy) -> list[str]:
    """What `where` has chosen in a study, each in words."""
    settings = [f"{name} = {spelled(value)}" for name, value in study.chosen.items()]
    return [*settings, *study.conditions]


def _said(values: Declaration) -> str:
    """What is declared of values, in words."""
    return f"{values.distribution} ({values.support.words})"


def _done(study: StoredStudy) -> int:
    return int((study.trials["status"] == "done").sum())
