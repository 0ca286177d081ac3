"""The metrics, maps, starts and samplers of a file that are checked, each with worlds
in which it is tried.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from unittest import SkipTest

import numpy as np

from kernels.catalogue import Catalogue
from kernels.metrics import Metric
from kernels.model import Model
from kernels.models import MODELS
from kernels.settings import About, Demand
from sweep.design.jobs import Job
from sweep.errors import ChoiceError
from sweep.own_code.catalogue import OwnCode, loaded
from sweep.own_code.entries import MODEL
from sweep.own_code.loading import load
from sweep.own_code.sources import SUFFIX, gather
from sweep.spec.expressions import parse
from sweep.spec.recorded import lacks
from sweep.spec.study import RecordSpec
from sweep.testing.flights import every_way
from sweep.testing.places import of_function
from sweep.testing.subject import Subject
from sweep.text import unknown
from sweep.trial.numba_errors import Place

KINDS = {"metrics": "measure", "maps": "draw", "starts": "draw", "samplers": "draw"}
"""What a file can offer besides models, and the function of each."""


@dataclass(frozen=True)
class Entrant:
    """An entry of a file: one of KINDS, its name, what it is, the file, and a catalogue
    in which it is known.
    """

    kind: str
    name: str
    entry: Any
    file: Path
    known: Catalogue

    @property
    def words(self) -> str:
        """As `metric gain`."""
        return f"{self.kind.removesuffix('s')} {self.name}"

    @property
    def function(self) -> Any:
        """What measures or draws; that within a partial function."""
        found = getattr(self.entry, KINDS[self.kind])
        while not hasattr(found, "__code__") and hasattr(found, "func"):
            found = found.func
        return found

    @property
    def place(self) -> Place:
        """The line at which its function begins."""
        return of_function(self.function)

    def jobs(self) -> Iterator[Job]:
        """Small trials of a model of ours that have it: with obstacles and without, as
        far as it demands nothing else. Raises SkipTest where there is none.
        """
        subject = self._stand_in()
        demands: tuple[Demand, ...] = getattr(self.entry, "demands", ())
        tried, broken = False, [""]
        for job in self._jobs(subject):
            broken = [
                one.message
                for one in demands
                if not _holds(one.condition, subject, job)
            ]
            if not broken:
                tried = True
                yield job
        if not tried:
            raise SkipTest(f"in the small worlds of this check {broken[0]}")

    def _jobs(self, subject: Subject) -> Iterator[Job]:
        metrics = (self.name,) if self.kind == "metrics" else ()
        record = RecordSpec(metrics, trajectories=True)
        for obstacles in (True, False):
            for job in every_way(subject, obstacles, **self._settings()):
                rocks = None if self.kind == "maps" else job.obstacles
                yield replace(job, record=record, obstacles=rocks)

    def _settings(self) -> dict[str, Any]:
        """Those by which a trial has it."""
        if self.kind == "starts":
            return {"start_draws": self.name}
        if self.kind != "maps":
            return {}
        size: tuple[float, float] | None = self.entry.size
        width, height = size or (None, None)
        sides = {"width": width, "height": height} if size else {}
        return {"map": self.name, **sides}

    def _stand_in(self) -> Subject:
        """A model of ours, with the state and kinds of boids that a metric reads."""
        models = [_with_boids(model, self.entry) for model in MODELS.values()]
        model = next(
            one
            for one in models
            if self.kind != "metrics" or not lacks(one, self.entry)
        )
        known = Catalogue(
            {model.name: model}, self.known.metrics, self.known.maps, self.known.starts
        )
        return Subject(model, known)


def entrants(reference: str) -> list[Entrant]:
    """What the file of that path offers besides models, which runs; nothing where
    `reference` is the name of a model, or asks for one of a file.

    Raises CodeError for what is no such entry.
    """
    file = Path(reference)
    if not reference.endswith(SUFFIX) or not file.is_file():
        return []
    known = loaded(OwnCode(gather(file.parent, [file.name]), ((file.name, None),)))
    return [
        Entrant(kind, name, entry, file, known)
        for kind in KINDS
        for name, entry in getattr(known.own, kind).items()
    ]


def entrant(file: str, kind: str, name: str) -> Entrant:
    """One of them. Raises ChoiceError where there is no such."""
    found = {one.name: one for one in entrants(file) if one.kind == kind}
    if name not in found:
        raise ChoiceError(unknown(kind, name, found))
    return found[name]


def has_model(reference: str) -> bool:
    """Whether a model is asked for by name, or stands in a file under the usual one."""
    file = Path(reference)
    if not reference.endswith(SUFFIX) or not file.is_file():
        return True
    return hasattr(load(gather(file.parent, [file.name]), file.name), MODEL)


def _with_boids(model: Model, entry: Any) -> Model:
    """The model in one preset, with the state and kinds of boids that an entry reads,
    if it does.
    """
    preset = next(iter(model.presets))
    model = model._replace(presets={preset: model.presets[preset]})
    if not isinstance(entry, Metric):
        return model
    state = {name: About("made up for a check") for name in entry.state}
    return model._replace(
        state=state,
        begin_state=_drawn if state else None,
        kinds=entry.kinds,
        count_kinds=_Divided(len(entry.kinds)) if entry.kinds else None,
    )


def _drawn(
    _params: Any, _flock: Any, _kind: Any, rng: np.random.Generator, state: Any
) -> None:
    """A state in which any two boids differ."""
    state[:] = rng.random(state.shape)


@dataclass(frozen=True)
class _Divided:
    """Boids in as many kinds, of about the same number each."""

    kinds: int

    def __call__(self, _params: Any, n: int) -> tuple[int, ...]:
        return tuple((n + k) // self.kinds for k in range(self.kinds))


def _holds(condition: str, subject: Subject, job: Job) -> bool:
    values: Mapping[str, Any] = job.settings
    found = parse(condition, subject.settings).evaluate(dict(values), 1)
    return bool(found.all())
