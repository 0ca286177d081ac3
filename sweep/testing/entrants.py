"""The checked metrics, maps, initial conditions and samplers of a file.

Each entry has test worlds.
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
from sweep.design import Job
from sweep.errors import ChoiceError
from sweep.own_code import MODEL, SUFFIX, OwnCode, gather, load, loaded
from sweep.spec import RecordSpec, lacks, parse
from sweep.testing.flights import every_way
from sweep.testing.places import of_function
from sweep.testing.subject import Subject
from sweep.text import unknown
from sweep.trial import Place

KINDS = {"metrics": "measure", "maps": "draw", "starts": "draw", "samplers": "draw"}
"""Kinds of entries of a file besides models, with the function of each."""


@dataclass(frozen=True)
class Entrant:
    """An entry of a file.

    `kind` is one of KINDS, `entry` is the entry as in the file, and `catalogue`
    contains the entry.
    """

    kind: str
    name: str
    entry: Any
    file: Path
    catalogue: Catalogue

    @property
    def words(self) -> str:
        """The kind and the name, such as `metric gain`."""
        return f"{self.kind.removesuffix('s')} {self.name}"

    @property
    def function(self) -> Any:
        """The function that measures or draws, also within a partial function."""
        function = getattr(self.entry, KINDS[self.kind])
        while not hasattr(function, "__code__") and hasattr(function, "func"):
            function = function.func
        return function

    @property
    def place(self) -> Place:
        """The first line of the function."""
        return of_function(self.function)

    def jobs(self) -> Iterator[Job]:
        """Yield small trials of a built-in model that use the entry.

        The trials have obstacles or no obstacles, and fulfil the conditions of the
        entry. Raises SkipTest if there is no such trial.
        """
        subject = self._stand_in()
        demands: tuple[Demand, ...] = getattr(self.entry, "demands", ())
        tried = False
        broken = [""]
        for job in self._jobs(subject):
            broken = [
                demand.message
                for demand in demands
                if not _holds(demand.condition, subject, job)
            ]
            if not broken:
                tried = True
                yield job
        if not tried:
            raise SkipTest(f"in the small test worlds, {broken[0]}")

    def _jobs(self, subject: Subject) -> Iterator[Job]:
        metrics = (self.name,) if self.kind == "metrics" else ()
        record = RecordSpec(metrics, trajectories=True)
        for obstacles in (True, False):
            for job in every_way(subject, obstacles, **self._settings()):
                rocks = None if self.kind == "maps" else job.obstacles
                yield replace(job, record=record, obstacles=rocks)

    def _settings(self) -> dict[str, Any]:
        """Return the parameters of a trial that uses the entry."""
        if self.kind == "starts":
            return {"start_draws": self.name}
        if self.kind != "maps":
            return {}
        size: tuple[float, float] | None = self.entry.size
        width, height = size or (None, None)
        sides = {"width": width, "height": height} if size else {}
        return {"map": self.name, **sides}

    def _stand_in(self) -> Subject:
        """Return a built-in model, with the state and kinds that a metric reads."""
        models = [_with_boids(model, self.entry) for model in MODELS.values()]
        model = next(
            candidate
            for candidate in models
            if self.kind != "metrics" or not lacks(candidate, self.entry)
        )
        catalogue = Catalogue(
            {model.name: model},
            self.catalogue.metrics,
            self.catalogue.maps,
            self.catalogue.starts,
            profiles=self.catalogue.profiles,
        )
        return Subject(model, catalogue)


def entrants(reference: str) -> list[Entrant]:
    """Return the entries of a file, except models.

    The file runs. The list is empty if `reference` is the name of a model, or selects
    one model of a file. Raises CodeError for an entry that is not valid.
    """
    file = Path(reference)
    if not reference.endswith(SUFFIX) or not file.is_file():
        return []
    catalogue = loaded(OwnCode(gather(file.parent, [file.name]), ((file.name, None),)))
    return [
        Entrant(kind, name, entry, file, catalogue=catalogue)
        for kind in KINDS
        for name, entry in getattr(catalogue.own, kind).items()
    ]


def entrant(file: str, kind: str, name: str) -> Entrant:
    """Return one entry of a file.

    Parameters
    ----------
    file : str
        Path of the file.
    kind : str
        One of KINDS.
    name : str
        Name of the entry.

    Raises
    ------
    ChoiceError
        If the file has no such entry.
    """
    named = {member.name: member for member in entrants(file) if member.kind == kind}
    if name not in named:
        raise ChoiceError(unknown(kind, name, named))
    return named[name]


def has_model(reference: str) -> bool:
    """Return whether a reference is the name of a model, or a file with one.

    The model in the file must have the usual name.
    """
    file = Path(reference)
    if not reference.endswith(SUFFIX) or not file.is_file():
        return True
    return hasattr(load(gather(file.parent, [file.name]), file.name), MODEL)


def _with_boids(model: Model, entry: Any) -> Model:
    """Return the model in one preset.

    For a metric, the model has the state and the kinds of boids that the metric reads.
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
    """Draw a state in which any two boids differ."""
    state[:] = rng.random(state.shape)


@dataclass(frozen=True)
class _Divided:
    """A division of boids into kinds of about equal size."""

    kinds: int

    def __call__(self, _params: Any, n: int) -> tuple[int, ...]:
        return tuple((n + k) // self.kinds for k in range(self.kinds))


def _holds(condition: str, subject: Subject, job: Job) -> bool:
    values: Mapping[str, Any] = job.settings
    holds = parse(condition, subject.settings).evaluate(dict(values), 1)
    return bool(holds.all())
