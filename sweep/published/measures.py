"""Quantities that claims measure in the trials of a study.

Measures are read from `published.yaml` and checked against the design of the study.
Every mistake in a measure is reported before any trial runs: unknown parameters, values
that no point has, metrics and frames that are not recorded.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import cast, get_args

import numpy as np
from numpy.typing import NDArray

from sweep.analysis import Distribution, Unit
from sweep.design import Design
from sweep.errors import ChoiceError
from sweep.methods.calibration import Calibration
from sweep.spec import Entry, NotAllowedError, Study, Value, columns_of
from sweep.tables import Chooser

KINDS = (
    *("mean", "difference", "rank_correlation"),
    *("call", "transition", "calibrated"),
)


@dataclass(frozen=True)
class Mean:
    """The mean of a metric: of a column of the trials, or of a series over `frames`.

    `frames` includes the first and the last frame. `unit` is the independent unit: a
    trial, the mean over the trials of a point, or the mean over the trials of a
    replicate.
    """

    spec: str
    metric: str
    frames: tuple[int, int] | None
    settings: Mapping[str, Value]
    unit: Unit


@dataclass(frozen=True)
class MeanDifference:
    """The first mean minus the second."""

    first: Mean
    second: Mean


@dataclass(frozen=True)
class RankCorrelation:
    """Spearman's correlation between a parameter and the mean of a column.

    The correlation is over points. The mean of a point is over trials.
    """

    spec: str
    setting: str
    column: str
    settings: Mapping[str, Value]


@dataclass(frozen=True)
class Call:
    """The independent values that a function of figures.py returns.

    For a difference the function returns two arrays. The arguments of the function are
    the studies, and `settings` as keyword arguments. `distribution` is the distribution
    of the values, in the words of metrics.
    """

    function: str
    distribution: Distribution
    settings: Mapping[str, Value] = field(default_factory=dict)


@dataclass(frozen=True)
class Transition:
    """The order of a transition, by a recorded series of flocks of several sizes.

    The order is the result of `sweep scaling` for the points.
    """

    spec: str
    series: str
    settings: Mapping[str, Value]


@dataclass(frozen=True)
class CalibratedParameter:
    """The posterior of a parameter of a calibrated study."""

    spec: str
    parameter: str
    settings: Mapping[str, Value] = field(default_factory=dict, init=False)


Measure = (
    Mean | MeanDifference | RankCorrelation | Call | Transition | CalibratedParameter
)


def specs_of(measure: Measure, specs: Iterable[str]) -> list[str]:
    """Return the specs whose trials a measure needs.

    A function of figures.py needs all `specs`.
    """
    if isinstance(measure, Call):
        return list(specs)
    if isinstance(measure, MeanDifference):
        return list(dict.fromkeys([measure.first.spec, measure.second.spec]))
    return [measure.spec]


@dataclass(frozen=True)
class MeasuredTrials:
    """Trials that a measure reads: a spec, and the parameters of points.

    `column` is None for frames of a series, and for an unknown column.
    """

    spec: str
    column: str | None
    settings: Mapping[str, Value]


def trials_read(measure: Measure, spec: str) -> list[MeasuredTrials]:
    """Return the trials that a measure of a claim of `spec` reads, by side."""
    if isinstance(measure, MeanDifference):
        return [*trials_read(measure.first, spec), *trials_read(measure.second, spec)]
    if isinstance(measure, Mean):
        column = None if measure.frames else measure.metric
        return [MeasuredTrials(measure.spec, column, measure.settings)]
    if isinstance(measure, RankCorrelation):
        return [MeasuredTrials(measure.spec, measure.column, measure.settings)]
    if isinstance(measure, Transition | CalibratedParameter):
        return [MeasuredTrials(measure.spec, None, measure.settings)]
    return [MeasuredTrials(spec, None, measure.settings)]


def columns_read(measure: Measure) -> list[tuple[str, str]]:
    """Return the columns that a measure reads, each after the spec.

    The columns that a function of figures.py reads are not known.
    """
    if isinstance(measure, Mean):
        return [(measure.spec, measure.metric)]
    if isinstance(measure, MeanDifference):
        return [*columns_read(measure.first), *columns_read(measure.second)]
    if isinstance(measure, RankCorrelation):
        return [(measure.spec, measure.column)]
    if isinstance(measure, Transition):
        return [(measure.spec, measure.series)]
    return []


def misfit(
    measure: Measure, spec: str, designs: Mapping[str, tuple[Study, Design]]
) -> str:
    """Return why a measure does not fit other designs of the specs; "" for a fit.

    A measure does not fit if no point has the parameters, or if frames are not
    recorded.

    Parameters
    ----------
    measure : Measure
        A measure that was read with the original designs.
    spec : str
        Spec of the claim.
    designs : mapping of str to tuple of (Study, Design)
        Other designs by spec.
    """
    sides: list[Mean] = []
    if isinstance(measure, Mean):
        sides = [measure]
    elif isinstance(measure, MeanDifference):
        sides = [measure.first, measure.second]
    else:
        spec = spec if isinstance(measure, Call) else measure.spec
        return _without_points(spec, measure.settings, designs)
    reasons = (
        _without_points(side.spec, side.settings, designs)
        or _without_frames(side, designs)
        for side in sides
    )
    return next(filter(None, reasons), "")


def _without_points(
    spec: str,
    settings: Mapping[str, Value],
    designs: Mapping[str, tuple[Study, Design]],
) -> str:
    if spec in designs:
        try:
            _chooser(designs[spec][1]).having(settings)
        except ChoiceError as error:
            return f"{spec}.yaml: {error.reason}"
    return ""


def _without_frames(mean: Mean, designs: Mapping[str, tuple[Study, Design]]) -> str:
    if mean.frames is None or mean.spec not in designs:
        return ""
    study, design = designs[mean.spec]
    chooser = _chooser(design)
    taken = np.unique(chooser.values("steps")[chooser.having(mean.settings)])
    first, last = mean.frames
    if all(_recorded(first, last, int(steps), study.record.every) for steps in taken):
        return ""
    return f"{mean.spec}.yaml records no frame from {first} to {last}"


class MeasureReader:
    """Reads measures, and checks them against designs and functions.

    Parameters
    ----------
    designs : mapping of str to tuple of (Study, Design)
        Designs by spec.
    functions : collection of str
        Names of the functions of figures.py.
    """

    def __init__(
        self, designs: Mapping[str, tuple[Study, Design]], functions: Collection[str]
    ) -> None:
        self.designs = designs
        self.functions = functions

    def read(self, entry: Entry, spec: str) -> Measure:
        """Return the measure that an entry describes.

        Parameters
        ----------
        entry : Entry
            The mapping under `measure`.
        spec : str
            Spec of the claim.

        Raises
        ------
        SpecError
            If the measure is not valid.
        """
        entry.keys([*KINDS, "for", "unit", "frame", "frames", "distribution"])
        kinds = [kind for kind in KINDS if kind in entry.value]
        if len(kinds) != 1:
            raise entry.error(f"a measure needs exactly one of {', '.join(KINDS)}")
        kind = entry.child(kinds[0])
        if kinds == ["mean"]:
            return self._mean(entry, spec)
        if kinds == ["difference"]:
            entry.keys(["difference"])
            first, second = self._two(kind)
            return MeanDifference(self._side(first, spec), self._side(second, spec))
        if kinds == ["rank_correlation"]:
            return self._rank_correlation(entry, spec)
        if kinds == ["transition"]:
            return self._transition(entry, spec)
        if kinds == ["calibrated"]:
            return self._calibrated(entry, spec)
        return self._call(entry, spec)

    def _call(self, entry: Entry, spec: str) -> Call:
        study, design = self.designs[spec]
        settings = _settings(entry.get("for"), study, _chooser(design))
        function = entry.child("call").one_of("function of figures.py", self.functions)
        distributions = get_args(Distribution)
        declared = entry.get("distribution")
        if declared is None:
            raise entry.error(
                'missing key "distribution", the distribution of the values of'
                f" {function}; allowed: {', '.join(distributions)}"
            )
        distribution = declared.one_of("distribution", distributions)
        return Call(function, cast(Distribution, distribution), settings)

    def _two(self, entry: Entry) -> list[Entry]:
        children = entry.entries()
        if len(children) != 2:
            raise entry.expected("a list of two")
        return children

    def _side(self, entry: Entry, spec: str) -> Mean:
        entry.keys(
            ["mean", "for", "unit", "frame", "frames", "spec"], required=["mean"]
        )
        named = entry.get("spec")
        return self._mean(entry, named.one_of("spec", self.designs) if named else spec)

    def _mean(self, entry: Entry, spec: str) -> Mean:
        study, design = self.designs[spec]
        chooser = _chooser(design)
        settings = _settings(entry.get("for"), study, chooser)
        chosen = chooser.having(settings)
        steps = np.unique(chooser.values("steps")[chosen])
        frames = self._frames(entry, study, steps)
        metric = entry.child("mean")
        name = self._series(metric, study) if frames else self._column(metric, study)
        unit = self._unit(entry, int(chosen.sum()))
        return Mean(spec, name, frames, settings, unit=unit)

    def _rank_correlation(self, entry: Entry, spec: str) -> RankCorrelation:
        entry.keys(["rank_correlation", "for"])
        study, design = self.designs[spec]
        setting, column = self._two(entry.child("rank_correlation"))
        numbers = [
            name for name, values in design.columns.items() if values.dtype.kind in "if"
        ]
        name = setting.one_of("varied number", numbers)
        settings = _settings(entry.get("for"), study, _chooser(design))
        return RankCorrelation(spec, name, self._column(column, study), settings)

    def _transition(self, entry: Entry, spec: str) -> Transition:
        entry.keys(["transition", "for"])
        study, design = self.designs[spec]
        chooser = _chooser(design)
        series = entry.child("transition")
        settings = _settings(entry.get("for"), study, chooser)
        numbers = chooser.values("n")[chooser.having(settings)]
        if len(np.unique(numbers)) < 2:
            raise series.error(f"{study.name} has flocks of a single size; use several")
        return Transition(spec, self._series(series, study), settings)

    def _calibrated(self, entry: Entry, spec: str) -> CalibratedParameter:
        entry.keys(["calibrated"])
        study, design = self.designs[spec]
        child = entry.child("calibrated")
        if not isinstance(study.rule, Calibration):
            raise child.error(
                f'{study.name} has no "calibrate", so it has no posterior'
            )
        numbers = [
            name
            for name in study.rule.priors
            if design.columns[name].dtype.kind in "if"
        ]
        return CalibratedParameter(spec, child.one_of("calibrated number", numbers))

    def _column(self, entry: Entry, study: Study) -> str:
        return entry.one_of(
            "column",
            columns_of(study.record.names),
        )

    def _series(self, entry: Entry, study: Study) -> str:
        if not study.record.series:
            raise entry.error(f"{study.name} records no series")
        return entry.one_of("recorded series", study.record.series)

    def _frames(
        self, entry: Entry, study: Study, steps_taken: NDArray[np.int64]
    ) -> tuple[int, int] | None:
        frame = entry.get("frame")
        frames = entry.get("frames")
        if frame and frames:
            raise frame.error('give either "frame" or "frames"')
        if frame:
            first = last = frame.whole(0)
        elif frames:
            first, last = (child.whole(0) for child in self._two(frames))
        else:
            return None
        for steps in steps_taken:
            if not _recorded(first, last, int(steps), study.record.every):
                where = cast(Entry, frame or frames)
                raise where.error(
                    f"no recorded frame; allowed: 0, {study.record.every}, ... and the"
                    f" last frame, {steps}"
                )
        return first, last

    def _unit(self, entry: Entry, points: int) -> Unit:
        unit = entry.get("unit")
        if points == 1 and unit:
            raise unit.error('"unit" has no meaning for a single point; delete "unit"')
        if points > 1 and not unit:
            raise entry.error(
                f'{points:,} points: "unit" must name the independent value (trial,'
                " point or replicate)"
            )
        return cast(Unit, unit.one_of("unit", get_args(Unit))) if unit else "trial"


def _recorded(first: int, last: int, steps: int, every: int) -> bool:
    """Return True if a recorded frame is between `first` and `last`.

    Frames 0, `every`, 2 `every`, ... and `steps` are recorded.
    """
    next_frame = -(-first // every) * every
    return first <= last and (next_frame <= min(last, steps) or first <= steps <= last)


def _chooser(design: Design) -> Chooser:
    """Return a chooser among the points of a design, by any parameter."""
    return Chooser(design.base | design.columns, design.n_points)


def _settings(entry: Entry | None, study: Study, chooser: Chooser) -> dict[str, Value]:
    """Return the parameters under `for`.

    Raises SpecError, with a list of existing values, if no point has the parameters.
    """
    settings: dict[str, Value] = {}
    for name, child in entry.mapping() if entry else ():
        try:
            chooser.values(name)
            settings[name] = study.settings[name].coerce(child.value)
            chooser.having(settings)
        except ChoiceError as error:
            raise child.error(error.reason) from None
        except NotAllowedError as error:
            raise child.error(str(error)) from None
    return settings
