"""The plan of a study: counts and estimates, without running a trial."""

import json
import math
from collections.abc import Collection, Iterator
from dataclasses import asdict, dataclass, replace
from typing import Protocol

import numpy as np

from kernels.model import Model
from kernels.robots.abilities import to_declare
from kernels.settings import COMMON
from sweep.design.cost import KNOWN_PACE, TrialPace, study_cost
from sweep.design.design import Design, Rejection, expand
from sweep.design.points import Points
from sweep.spec import TORUS, WRAPS_ONLY, GrowthRule, Study, parse, sections
from sweep.text import so_many

LEAST_SAID = 0.1
"""Shortest estimate that is printed with digits, in seconds."""


class StudyPlan(Protocol):
    """Estimates of any study, also of a study with a separate type of plan.

    The members are common to all plans; see `Plan`.
    """

    @property
    def study(self) -> str:
        """Name of the study."""

    @property
    def model(self) -> str:
        """Name of the model."""

    @property
    def preset(self) -> str:
        """Name of the preset."""

    @property
    def code(self) -> tuple[str, ...]:
        """Files with custom code that the study runs."""

    @property
    def trials(self) -> int:
        """Number of trials, or the largest number."""

    @property
    def cpu_seconds(self) -> float:
        """Processor time of all trials, in s."""

    @property
    def wall_seconds(self) -> float:
        """Time with all workers, in s."""

    @property
    def workers(self) -> int:
        """Number of workers."""

    @property
    def result_bytes(self) -> float:
        """Bytes in the store."""

    @property
    def on_error(self) -> str:
        """Failure policy, in words."""

    @property
    def probe_steps(self) -> int:
        """Steps of the probe that estimated the seconds, or 0."""

    @property
    def compiling_seconds(self) -> float:
        """Additional wall time, once, in s."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences about effects that a user might not expect."""

    def as_json(self) -> str:
        """Return the plan as a JSON object."""

    def as_text(self) -> str:
        """Return the plan as text."""


@dataclass(frozen=True)
class Plan:
    """Counts and estimates of a study.

    If a rule adds trials or points, the numbers of trials, the seconds and the bytes
    are for the largest study that the rule allows.

    Attributes
    ----------
    study, model, preset : str
    code : tuple of str
        Files with custom code that the study runs.
    points : int
        Number of points at first.
    trials_per_point, trials : int
    fewest_trials : int
        Number of trials before a rule adds trials.
    varied : list of str
        Names of the columns in which points differ.
    rejected : tuple of Rejection
        Points that conditions under `require` rejected.
    merged : int
        Number of merged duplicates.
    cpu_seconds, wall_seconds : float
    workers : int
    result_bytes : float
        Bytes in the store, including last states.
    notes : tuple of str
        Sentences about effects that a user might not expect.
    rule : GrowthRule, optional
        Rule that adds trials or points.
    on_error : str
        Failure policy in words.
    probe_steps : int
        Steps of the probe that estimated the seconds; 0 if the cost of all code is
        known.
    compiling_seconds : float
        Additional wall time, once; 0 if the model is already compiled.
    last_state_bytes : float
    continued : int
        Number of trials that resume from stored last states.
    steps_saved : int
        Sum of the steps of these last states.
    recording : str
        Events, individuals and frames of a recording, in words; "" for a model.
    positions : str
        Extent of the world of a recording, and shares of positions, in words.
    """

    study: str
    model: str
    code: tuple[str, ...]
    preset: str
    points: int
    trials_per_point: int
    trials: int
    fewest_trials: int
    varied: list[str]
    rejected: tuple[Rejection, ...]
    merged: int
    cpu_seconds: float
    wall_seconds: float
    workers: int
    result_bytes: float
    notes: tuple[str, ...]
    rule: GrowthRule | None = None
    on_error: str = ""
    probe_steps: int = 0
    compiling_seconds: float = 0.0
    last_state_bytes: float = 0.0
    continued: int = 0
    steps_saved: int = 0
    recording: str = ""
    positions: str = ""

    def as_json(self) -> str:
        """Return the plan as a JSON object."""
        members = asdict(replace(self, rule=None))
        del members["rule"]
        growing = [
            key
            for key, section in sections().items()
            if section.strategy and not section.has_own_points
        ]
        members |= {**dict.fromkeys(growing), "boundary": ""}
        if rule := self.rule:
            members["boundary"] = rule.where
            members[str(rule.place[-1])] = rule.as_json()
        return json.dumps(members, indent=2)

    def as_text(self) -> str:
        """Return the plan as aligned lines."""
        most = "at most " if self.rule else ""
        at_first = "at first " if self.rule and self.rule.adds_points else ""
        lines = [
            f"study      {self.study}",
            *(
                [f"recording  {self.recording}", f"positions  {self.positions}"]
                if self.recording
                else [f"model      {self.model}, preset {self.preset}"]
            ),
            *([f"runs code  {', '.join(self.code)}"] if self.code else []),
            f"points     {at_first}{self.points:,}"
            + (f" over {', '.join(self.varied)}" if self.varied else ""),
            f"trials     {self._trials()}",
        ]
        lines += [
            f'rejected   {rejection.count:,} points by "{rejection.expression}"'
            for rejection in self.rejected
        ]
        lines += [f"merged     {self.merged:,} equal points"] if self.merged else []
        lines += [f"on error   {self.on_error}"] if self.on_error else []
        lines += [
            (f"CPU time   {about(self.cpu_seconds, most)}{probed(self.probe_steps)}"),
            (
                f"wall time  {about(self.wall_seconds, most)} with"
                f" {so_many(self.workers, 'worker')}"
                f"{compiled(self.compiling_seconds)}"
            ),
            f"results    {most}about {size(self.result_bytes)}{self._last_states()}",
        ]
        if self.continued:
            trials = f"{self.continued:,} trials"
            steps = f"{self.steps_saved:,} steps"
            lines.append(f"resumed    {trials} from last states, {steps} less to run")
        return "\n".join(lines + [f"note       {note}" for note in self.notes])

    def _last_states(self) -> str:
        states = self.last_state_bytes
        return f", including {size(states)} of last states" if states else ""

    def _trials(self) -> str:
        if self.rule is None:
            return f"{self.trials:,} ({self.trials_per_point:,} per point)"
        return (
            f"{self.fewest_trials:,} to {self.trials:,} ({self.rule.least:,} to"
            f" {self.rule.most:,} per point{self.rule.in_words})"
        )


def make_plan(study: Study, workers: int, pace: TrialPace = KNOWN_PACE) -> Plan:
    """Return the plan of a study.

    Parameters
    ----------
    study : Study
    workers : int
        Number of worker processes.
    pace : TrialPace, default KNOWN_PACE
        Measured duration of trials as a multiple of the estimated duration.

    Returns
    -------
    Plan

    Raises
    ------
    SpecError
        If the points of the study are not valid.
    """
    design = expand(study)
    cost = study_cost(study, design, pace)
    model = study.catalogue.models[study.model]
    recording, positions = _events_in_words(model) if model.events else ("", "")
    notes = [note for axis in study.axes for note in axis.notes]
    return Plan(
        study=study.name,
        model=study.model,
        code=study.catalogue.runs,
        preset=study.preset,
        points=design.n_points,
        trials_per_point=study.trials_per_point,
        trials=study.most_trials(design.n_points),
        fewest_trials=design.n_points
        * (study.rule.least if study.rule else study.trials_per_point),
        varied=list(design.told_apart),
        rejected=design.rejected,
        merged=design.duplicates,
        cpu_seconds=cost.seconds,
        wall_seconds=cost.seconds / workers,
        workers=workers,
        result_bytes=cost.size_bytes,
        last_state_bytes=cost.last_state_bytes,
        notes=(*notes, *notes_of(study, design)),
        rule=study.rule,
        on_error=study.policy.in_words(study.most_trials(design.n_points)),
        probe_steps=pace.steps,
        recording=recording,
        positions=positions,
    )


def _events_in_words(model: Model) -> tuple[str, str]:
    """Return the extent of a recording, and of its positions, in words."""
    events = model.events
    (usual,) = model.presets.values()
    fewest = min(event.boids for event in events)
    most = max(event.boids for event in events)
    boids = so_many(most, "individual")
    if fewest < most:
        boids = f"{fewest:,} to {boids}"
    frames = np.array([event.steps + 1 for event in events])
    positions = frames * [event.boids for event in events]
    interpolated, absent = (
        np.average([getattr(event, share) for event in events], weights=positions)
        for share in ("interpolated", "absent")
    )
    return (
        f"{so_many(len(events), 'event')} of {boids},"
        f" {so_many(int(frames.sum()), 'frame')} of {usual['dt']:g} {model.time}",
        f"within {usual['width']:g} x {usual['height']:g} {model.length};"
        f" {100 * interpolated:.2g} % interpolated, {100 * absent:.2g} % absent",
    )


def notes_of(study: Study, design: Design, free: Collection[str] = ()) -> Iterator[str]:
    """Yield sentences about effects of a spec that a user might not expect.

    The sentences name parameters without an effect, a torus that is not periodic,
    ranges of metrics beyond half of the world, and missing declarations of a model.

    Parameters
    ----------
    study : Study
    design : Design
        Points of the study.
    free : collection of str, default ()
        Parameters whose values a search chooses.

    Yields
    ------
    str
    """
    unknown = {*study.derive, *free} if free else set()
    points = Points(design.base, design.columns, design.n_points, design.fineness)
    for name, setting in study.settings.items():
        only = setting.only_where
        if only is None or not (study.place_of(name) or name in free):
            continue
        condition = parse(only.condition, study.settings)
        if condition.names.isdisjoint(unknown) and not (
            points.evaluate(study, condition, ("model",)).any()
        ):
            yield f"{name} changes nothing: no point has {only.condition}"
    yield from _of_torus(study, points)
    yield from _too_long(study, points)
    if missing := to_declare(study.catalogue.models[study.model]):
        yield (
            f"the Model of {study.model} does not declare the abilities of robots: add"
            f" {missing}"
        )


def _of_torus(study: Study, points: Points) -> Iterator[str]:
    """Yield a note on a torus that wraps only positions, unless the spec asks so."""
    only_wraps = (points.column("borders") == TORUS) & ~points.column("minimum_image")
    if only_wraps.any() and not study.place_of("minimum_image"):
        torus = f"the torus of preset {study.preset} {WRAPS_ONLY}"
        yield f"{torus}; with `minimum_image: true` they do"


def _too_long(study: Study, points: Points) -> Iterator[str]:
    """Yield a note on each range of a recorded metric beyond half of the world.

    In an unbounded world only a default range from COMMON counts.
    """
    half = np.minimum(points.column("width"), points.column("height")) / 2
    is_closed = points.column("borders") != "open"
    ranges = {
        metric: study.catalogue.metrics[metric].within
        for metric in study.record.metrics
    }
    for name in dict.fromkeys(filter(None, ranges.values())):
        values = points.column(name)
        is_default = values == COMMON[name] if not study.place_of(name) else False
        beyond = (values > half) & (values < math.inf) & (is_closed | is_default)
        if beyond.any():
            metrics = [metric for metric, within in ranges.items() if within == name]
            first = int(np.argmax(beyond))
            unit = study.settings[name].unit
            yield (
                f"{name} is {values[first]:g} {unit}, more than half of the world,"
                f" {half[first]:g} {unit}: the motion of boids hardly changes"
                f" {', '.join(metrics)}"
            )


def compiled(seconds: float) -> str:
    """Return the time that compiling adds to a plan, in words."""
    return f", and once {about(seconds)} to compile the model" if seconds else ""


def probed(steps: int) -> str:
    """Return a clause on the steps of the probe that estimated the seconds."""
    return f", estimated from a probe of {steps:,} steps" if steps else ""


def about(seconds: float, most: str = "") -> str:
    """Return an estimate of seconds in words; `most` is "at most " for a bound."""
    if seconds < LEAST_SAID:
        return f"less than {LEAST_SAID} s"
    return f"{most}about {duration(seconds)}"


def duration(seconds: float) -> str:
    """Return seconds in words, to about two digits."""
    for length, unit in ((86400.0, "days"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 1.5 * length:
            return f"{seconds / length:.1f} {unit}"
    return f"{seconds:.1f} s"


def size(count: float) -> str:
    """Return a number of bytes in words."""
    for length, unit in ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")):
        if count >= length:
            return f"{count / length:.1f} {unit}"
    return f"{count:.0f} B"
