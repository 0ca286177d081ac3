"""What a spec would run, without running it."""

import json
import math
from collections.abc import Collection, Iterator
from dataclasses import asdict, dataclass, replace

import numpy as np

from kernels.settings import COMMON
from sweep.design.cost import KNOWN_PACE, TrialPace, study_cost
from sweep.design.design import Design, Rejection, expand
from sweep.design.points import Points
from sweep.spec.expressions import parse
from sweep.spec.sections import GrowthRule
from sweep.spec.settings import TORUS, WRAPS_ONLY
from sweep.spec.study import Study, sections
from sweep.text import so_many

LEAST_SAID = 0.1
"""Seconds: the digits of a shorter estimate mean nothing."""


@dataclass(frozen=True)
class Plan:
    """Counts and estimates of a study; `notes` says what a user might not expect, and
    `code` are the files of the user's own that it runs.

    Where a rule adds trials until an interval is narrow enough, numbers and estimates
    are for the most of them. So they are where a rule adds points; `points` are those
    at first.
    `probe_steps` is how many steps were run to estimate the seconds, 0 where the cost
    of all code is known. `compiling_seconds` come on top of the wall time, once: 0
    where the model is compiled already. Of the `result_bytes` so many are
    `last_state_bytes`. `continued` trials go on from last states that are stored, whose
    steps are `steps_saved` together.
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

    def as_json(self) -> str:
        """The plan as a JSON object."""
        about = asdict(replace(self, rule=None))
        del about["rule"]
        growing = [key for key, one in sections().items() if one.strategy]
        about |= {**dict.fromkeys(growing), "boundary": ""}
        if rule := self.rule:
            about["boundary"] = rule.where
            about[str(rule.place[-1])] = rule.as_json()
        return json.dumps(about, indent=2)

    def as_text(self) -> str:
        """The plan for a reader."""
        most = "at most " if self.rule else ""
        at_first = "at first " if self.rule and self.rule.adds_points else ""
        lines = [
            f"study      {self.study}",
            f"model      {self.model}, preset {self.preset}",
            *([f"runs code  {', '.join(self.code)}"] if self.code else []),
            f"points     {at_first}{self.points:,}"
            + (f" over {', '.join(self.varied)}" if self.varied else ""),
            f"trials     {self._trials()}",
        ]
        lines += [
            f'rejected   {one.count:,} points by "{one.expression}"'
            for one in self.rejected
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
            trials, steps = f"{self.continued:,} trials", f"{self.steps_saved:,} steps"
            lines.append(f"goes on    {trials} from last states, {steps} less to run")
        return "\n".join(lines + [f"note       {note}" for note in self.notes])

    def _last_states(self) -> str:
        kept = self.last_state_bytes
        return f", {size(kept)} of them last states" if kept else ""

    def _trials(self) -> str:
        if self.rule is None:
            return f"{self.trials:,} ({self.trials_per_point:,} a point)"
        return (
            f"{self.fewest_trials:,} to {self.trials:,} ({self.rule.least:,} to"
            f" {self.rule.most:,} a point{self.rule.in_words})"
        )


def make_plan(study: Study, workers: int, pace: TrialPace = KNOWN_PACE) -> Plan:
    """The plan of `study`. Raises SpecError for a design that cannot be."""
    design = expand(study)
    cost = study_cost(study, design, pace)
    notes = [note for axis in study.axes for note in axis.notes]
    return Plan(
        study=study.name,
        model=study.model,
        code=study.known.runs,
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
    )


def notes_of(study: Study, design: Design, free: Collection[str] = ()) -> Iterator[str]:
    """What of that which the spec gives changes nothing, and why, in words; and what of
    its world a user might not expect. A search chooses the values of settings that are
    `free`.
    """
    unknown = {*study.derive, *free} if free else set()
    points = Points(design.base, design.columns, design.n_points, design.fineness)
    for name, setting in study.settings.items():
        only, given = setting.only_where, study.place_of(name) or name in free
        if only is None or not given:
            continue
        condition = parse(only.condition, study.settings)
        if condition.names.isdisjoint(unknown) and not (
            points.evaluate(study, condition, ("model",)).any()
        ):
            yield f"{name} changes nothing: no point has {only.condition}"
    yield from _of_torus(study, points)
    yield from _too_long(study, points)


def _of_torus(study: Study, points: Points) -> Iterator[str]:
    """That a torus wraps positions only, where the spec does not say so."""
    only_wraps = (points.column("borders") == TORUS) & ~points.column("minimum_image")
    if only_wraps.any() and not study.place_of("minimum_image"):
        torus = f"the torus of preset {study.preset} {WRAPS_ONLY}"
        yield f"{torus}; with `minimum_image: true` they do"


def _too_long(study: Study, points: Points) -> Iterator[str]:
    """Which ranges of recorded metrics are beyond half of the world. In an open one
    that counts only of those that the preset has from COMMON.
    """
    half = np.minimum(points.column("width"), points.column("height")) / 2
    is_closed = points.column("borders") != "open"
    read = {one: study.known.metrics[one].within for one in study.record.metrics}
    for name in dict.fromkeys(filter(None, read.values())):
        values, usual = points.column(name), COMMON[name]
        taken = values == usual if not study.place_of(name) else False
        beyond = (values > half) & (values < math.inf) & (is_closed | taken)
        told = [one for one, within in read.items() if within == name]
        if told and beyond.any():
            first, unit = int(np.argmax(beyond)), study.settings[name].unit
            yield (
                f"{name} is {values[first]:g} {unit}, more than half of the world,"
                f" {half[first]:g} {unit}: what boids do hardly changes"
                f" {', '.join(told)}"
            )


def compiled(seconds: float) -> str:
    """What compiling adds to the time of a plan, in words."""
    return f", and once {about(seconds)} to compile the model" if seconds else ""


def probed(steps: int) -> str:
    """What follows estimated seconds that come from a probe of so many steps."""
    return f", estimated from a probe of {steps:,} steps" if steps else ""


def about(seconds: float, most: str = "") -> str:
    """An estimate of seconds in words; `most` is "at most " where it is a bound."""
    if seconds < LEAST_SAID:
        return f"less than {LEAST_SAID} s"
    return f"{most}about {duration(seconds)}"


def duration(seconds: float) -> str:
    """Seconds in words, to two figures or so."""
    for length, unit in ((86400.0, "days"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 1.5 * length:
            return f"{seconds / length:.1f} {unit}"
    return f"{seconds:.1f} s"


def size(count: float) -> str:
    """Bytes in words."""
    for length, unit in ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")):
        if count >= length:
            return f"{count / length:.1f} {unit}"
    return f"{count:.0f} B"
