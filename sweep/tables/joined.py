"""Several studies as one, in which `study` is a parameter that varies.

Figures show the studies together and distinguish studies by this parameter.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import pandas as pd
import pyarrow as pa

from kernels.metrics import Metric
from sweep.analysis import Declaration, agrees
from sweep.errors import ChoiceError
from sweep.spec import Column
from sweep.store import AxisAbout
from sweep.tables.choosing import spelled
from sweep.tables.results import Looks, Results
from sweep.tables.stored_study import StoredStudy

STUDY = "study"
IDS = ("trial_id", "point")
ABOUT = ("model", "preset")
"""Properties besides parameters in which studies may differ."""


class JoinedStudies(Results):
    """The trials of several studies, which share metrics.

    `metrics` are the metrics that all studies have recorded, with an equal unit,
    distribution and range. `left_out` has the reason for each other metric. A
    parameter that a study does not vary has the value of all trials of the study.

    Raises ChoiceError if a study is named twice or has no stored trial, if no metric is
    shared, and if a study lacks a parameter that another study varies.
    """

    def __init__(self, studies: Sequence[StoredStudy]) -> None:
        self._studies = tuple(studies)
        names = [study.name for study in studies]
        self.name = " and ".join(names)
        if twice := [name for name in names if names.count(name) > 1]:
            raise ChoiceError(f'study "{twice[0]}" is named twice')
        for study in studies:
            if study.trials.empty:
                raise ChoiceError("no trial is stored yet", study.name)
        restrictions = [set(_restrictions(study)) for study in studies]
        self.conditions = tuple(
            text
            for text in _restrictions(studies[0])
            if all(text in texts for texts in restrictions)
        )
        recorded = dict.fromkeys(name for study in studies for name in study.metrics)
        why = {name: self._differing(name) for name in recorded}
        self._left_out = {name: reason for name, reason in why.items() if reason}
        self._shared = [name for name, reason in why.items() if not reason]
        if not self._shared:
            reasons = "; ".join(f"{name} {why[name]}" for name in self._left_out)
            raise ChoiceError(
                f"the studies have no metric in common: {reasons}", self.name
            )
        plans = [self._with_ids(study.plan, study.name) for study in studies]
        self.plan = pa.concat_tables(plans)

    @property
    def kept_apart(self) -> list[str]:
        """`study`, and the parameters over which results are never averaged."""
        names = (name for study in self.parts for name in study.kept_apart)
        return [STUDY, *dict.fromkeys(names)]

    @property
    def apart_notes(self) -> list[str]:
        """Sentences about the parts that are kept apart, each once."""
        notes = (text for study in self.parts for text in study.apart_notes)
        return [*dict.fromkeys(notes)]

    @property
    def parts(self) -> tuple[StoredStudy, ...]:
        """The studies."""
        return self._studies

    @property
    def left_out(self) -> dict[str, str]:
        """The metrics that differ between studies, each with the reason."""
        return self._left_out

    @cached_property
    def differ(self) -> dict[str, list[Any]]:
        """The model, preset and fixed parameters that differ, with the value per study.

        The model and the preset come first. Parameters that mean nothing for a study
        are left out.
        """
        idle = {name for study in self.parts for name in study.idle}
        first = [study.trials.iloc[0] for study in self.parts]
        varied = {name for study in self.parts for name in study.varied}
        names = (*ABOUT, *self.parts[0].settings)
        fixed = {
            name: [trial[name] for trial in first]
            for name in names
            if name not in varied | idle and all(name in trial for trial in first)
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
    def known_metrics(self) -> Mapping[str, Metric]:
        """The metrics that at least one study knows."""
        return {
            name: metric
            for study in reversed(self.parts)
            for name, metric in study.known_metrics.items()
        }

    @property
    def varied(self) -> list[str]:
        """`study`, and the parameters that differ within a study.

        `detail` replaces the parameters that an axis ablates.
        """
        headings = (name for study in self.parts for name in study.headings)
        return [STUDY, *dict.fromkeys(headings)]

    @property
    def headings(self) -> list[str]:
        """The names in `varied`."""
        return self.varied

    @cached_property
    def points(self) -> pd.DataFrame:
        """One row per point, by the name of the study and the id, `study:point`."""
        tables = []
        for study in self.parts:
            table = study.points.reindex(columns=self.varied[1:])
            for name in table.columns[table.isna().all()]:
                table[name] = self._fixed_value(study, str(name))
            table.insert(0, STUDY, self.labels[study.name])
            table.index = pd.Index(self._ids(table.index, study.name), name="point")
            tables.append(table)
        return pd.concat(tables)

    @cached_property
    def trials(self) -> pd.DataFrame:
        """The stored trials of all studies; ids begin with the name of the study."""
        tables = []
        for study in self.parts:
            ids = {name: self._ids(study.trials[name], study.name) for name in IDS}
            tables.append(study.trials.assign(study=self.labels[study.name], **ids))
        return pd.concat(tables, ignore_index=True)

    @cached_property
    def series(self) -> pd.DataFrame:
        """The recorded frames of all studies."""
        tables = [
            study.series.assign(
                trial_id=self._ids(study.series["trial_id"], study.name)
            )
            for study in self.parts
        ]
        return pd.concat(tables, ignore_index=True)

    @property
    def series_metrics(self) -> list[str]:
        """The shared metrics of which all studies have series."""
        recorded = [set(study.series_metrics) for study in self.parts]
        return [
            name for name in self._shared if all(name in names for names in recorded)
        ]

    @property
    def axes(self) -> dict[str, AxisAbout]:
        """`study`, and the axes of all studies by the first parameter.

        An axis that is sampled in a study is sampled here.
        """
        axes = {STUDY: AxisAbout([STUDY], None)}
        for study in self.parts:
            for axis in study.axes.values():
                before = axes.get(axis.settings[0])
                if before is None or axis.sampler:
                    axes[axis.settings[0]] = axis
        return axes

    @cached_property
    def units(self) -> dict[str, str]:
        """The units of all columns; a metric has an equal unit in all studies."""
        return {
            name: unit for study in self.parts for name, unit in study.units.items()
        }

    @cached_property
    def distributions(self) -> dict[str, Declaration]:
        """The declared distribution and range of the values of each metric column."""
        return {
            name: declaration
            for study in self.parts
            for name, declaration in study.distributions.items()
        }

    @property
    def repeated(self) -> dict[str, float]:
        """The metrics that decided the number of trials of a study.

        Each metric has the highest confidence of the studies.
        """
        highest: dict[str, float] = {}
        for study in self.parts:
            for name, confidence in study.repeated.items():
                highest[name] = max(confidence, highest.get(name, 0.0))
        return highest

    @property
    def averaged(self) -> str:
        """The frames that means of a trial cover, of all studies."""
        return " or ".join(dict.fromkeys(study.averaged for study in self.parts))

    @property
    def looks(self) -> Looks | None:
        """The looks of the first study that has looks."""
        return next((study.looks for study in self.parts if study.looks), None)

    @cached_property
    def labels(self) -> dict[str, str]:
        """The text for each study in a legend."""
        return {
            study.name: f"{study.name} ({self._own(study)}{_done(study):,} trials)"
            for study in self.parts
        }

    def _own(self, study: StoredStudy) -> str:
        """Return the restrictions that not all studies have, before a number."""
        own = [text for text in _restrictions(study) if text not in self.conditions]
        return "".join(f"{text}; " for text in own)

    def _differing(self, metric: str) -> str:
        """Return why a metric differs between studies; "" if all studies agree."""
        lacking = [study.name for study in self.parts if metric not in study.metrics]
        if lacking:
            return f"is not recorded in {', '.join(lacking)}"
        column = str(Column(metric))
        units = [study.units.get(column, "no unit") for study in self.parts]
        declared = [_in_words(study.distributions[column]) for study in self.parts]
        for verb, texts in (("in", units), ("declared", declared)):
            if len(set(texts)) > 1:
                pairs = zip(self.parts, texts, strict=True)
                listed = [f"{verb} {text} in {study.name}" for study, text in pairs]
                return f"is {', '.join(listed)}"
        return ""

    def _fixed_value(self, study: StoredStudy, setting: str) -> Any:
        """Return the value of a parameter that a study does not vary."""
        if setting not in study.chooser.columns:
            varying = next(part for part in self.parts if setting in part.headings)
            value = spelled(varying.chooser.values(setting)[0])
            raise ChoiceError(
                f"no parameter {setting}, which {varying.name} varies; choose one"
                f" value, for example {varying.name}:{setting}={value}",
                study.name,
            )
        return study.chooser.values(setting)[0]

    @staticmethod
    def _ids(ids: Any, study: str) -> list[str]:
        return [f"{study}:{trial_or_point}" for trial_or_point in ids]

    def _with_ids(self, table: pa.Table, study: str) -> pa.Table:
        columns = {name: self._ids(table[name].to_pylist(), study) for name in IDS}
        return pa.table(
            {name: pa.array(ids, pa.string()) for name, ids in columns.items()}
        )


def stored_parts(study: Results) -> tuple[StoredStudy, ...]:
    """Return the stored studies that results consist of, one or several."""
    if isinstance(study, StoredStudy):
        return (study,)
    assert isinstance(study, JoinedStudies)
    return study.parts


def _restrictions(study: StoredStudy) -> list[str]:
    """Return the restrictions of a study by `where`, each in words."""
    settings = [f"{name} = {spelled(value)}" for name, value in study.chosen.items()]
    return [*settings, *study.conditions]


def _in_words(values: Declaration) -> str:
    return f"{values.distribution} ({values.support.words})"


def _done(study: StoredStudy) -> int:
    return int((study.trials["status"] == "done").sum())
