"""The trials of a design, each with an id that is a hash of its content.

The id of a point covers the model, the preset and the parameters that differ from the
preset. So points with the preset value of a new axis keep the earlier ids. The id of a
trial adds the code that computes the trial, the seed, the streams and the recorded
values. Trials that could differ in a single number have different ids.
"""

import hashlib
import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from itertools import repeat
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
from numpy.random import SeedSequence
from numpy.typing import NDArray

from kernels.catalogue import BUILT_IN, Catalogue
from kernels.identity import Code
from kernels.model import Event, Model
from kernels.playback import parameters_of
from sweep.design.chains import FIRST, Links
from sweep.design.code import study_code
from sweep.design.design import Design
from sweep.design.order import coarse_first
from sweep.design.recording import Recording
from sweep.design.trial_ids import BYTES, Ids, as_texts
from sweep.spec import (
    ALL_PAIRS,
    DOWN,
    PARENT,
    Obstacles,
    OwnMap,
    RecordSpec,
    Stream,
    Streams,
    Study,
    Value,
    address,
    point_numbers,
    usual_settings,
)

if TYPE_CHECKING:
    import pyarrow as pa

Purpose = Literal["start", "world", "noise", "made", "flown"]
KIND = {"made": "start", "flown": "noise"}
"""Streams of the spec for purposes without a key.

The variability of robots uses the stream of the start, and failures of robots use the
stream of the noise.
"""
Counts = NDArray[np.int64]

SCENE = ("map", "start_draws")
"""Parameters whose values are names of code."""
Scene = tuple[Value, ...]
STEPS = "steps"
NO_MAPS: Mapping[str, OwnMap] = {}
BLOCK = 20_000
"""Maximum number of ids that are computed at once; a million would take 1 GB."""


@dataclass(frozen=True, slots=True)
class LastState:
    """Complete state at the end of a trial, as bytes with a seal."""

    trial_id: str
    content: bytes = field(repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class LastFlock:
    """Final flock of a trial with N boids.

    Attributes
    ----------
    bodies : array of float, shape (4, N)
        x, y, vx and vy.
    headings : array of float, shape (2, N)
        Last velocity of each boid that was not zero.
    state : array of float, shape (S, N)
        The S state values per boid that the model has.
    """

    bodies: NDArray[np.float64]
    headings: NDArray[np.float64]
    state: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Job:
    """One trial, with everything that is needed to run it with identical results.

    Attributes
    ----------
    trial_id : str
        24 hexadecimal digits.
    point : str
        Id of the point, 16 hexadecimal digits.
    replicate : int
        Number of the trial within the point, from 0. With `literal`, only the index in
        the list of seeds.
    seed : int
        Seed of the study; with `literal` one of the listed seeds.
    literal : bool
        Whether the spec lists seeds.
    model, preset : str
    settings : dict
        All parameters.
    record : RecordSpec
    streams : Streams
    time_limit : float, optional
        Seconds.
    obstacles : Obstacles, optional
        Obstacles of a map that the spec contains.
    catalogue : Catalogue
        Models, metrics, maps and starts by name.
    earlier : LastState, optional
        Last state of this trial with fewer steps. By default the trial begins at
        step 0.
    direction : str
        Direction of a link of a chain, "up" or "down"; "" if the trial is no link.
    parent : str
        Id of the trial with whose final flock a link begins. "" for the first link of
        a chain, which begins as its parameters define.
    begins : LastFlock, optional
        Final flock of `parent`.
    all_pairs : bool
        Whether neighbours are found without a grid; the results are bitwise identical.
    """

    trial_id: str
    point: str
    replicate: int
    seed: int
    literal: bool
    model: str
    preset: str
    settings: dict[str, Value]
    record: RecordSpec
    streams: Streams
    time_limit: float | None
    obstacles: Obstacles | None = None
    catalogue: Catalogue = BUILT_IN
    earlier: LastState | None = None
    direction: str = ""
    parent: str = ""
    begins: LastFlock | None = field(default=None, repr=False)
    all_pairs: bool = False


def stream(job: Job, purpose: Purpose) -> SeedSequence:
    """Return the seed sequence of one kind of randomness in a trial.

    A common stream is equal at all points. A lasting stream is equal at all points
    that differ only in `steps`.
    """
    replicate = 0 if job.literal else job.replicate
    kind: Stream = getattr(job.streams, KIND.get(purpose, purpose))
    point: tuple[int, ...] = ()
    if kind == "independent":
        point = point_numbers(job.point)
    elif kind == "lasting":
        point = point_numbers(_point_of_any_steps(job))
    return address(job.seed, purpose, replicate, *point)


def _point_of_any_steps(job: Job) -> str:
    """Return the id of the point of a job, with the steps of the preset."""
    usual = usual_settings(job.model, job.preset, job.catalogue)
    settings = job.settings | {STEPS: usual[STEPS]}
    return directed(point_id(job.model, job.preset, settings, usual), job.direction)


def literal_seed(job: Job, purpose: Purpose) -> int:
    """Return a seed for Python's `random.Random`.

    The result is the listed seed if the stream is common, otherwise 64 random bits.
    """
    if job.literal and getattr(job.streams, purpose) == "common":
        return job.seed
    return int(stream(job, purpose).generate_state(1, np.uint64)[0])


def point_id(
    model: str,
    preset: str,
    settings: Mapping[str, Value],
    defaults: Mapping[str, Value],
    maps: Mapping[str, OwnMap] = NO_MAPS,
) -> str:
    """Return the id of a point, a hash of the parameters that differ from the preset.

    Parameters
    ----------
    model, preset : str
    settings : mapping
        All parameters of the point.
    defaults : mapping
        All parameters of the preset.
    maps : mapping of OwnMap, default NO_MAPS
        Maps that the spec contains. The id covers the obstacles of the maps.

    Returns
    -------
    str
        16 hexadecimal digits.
    """
    values = {**settings, "map": _identity("map", settings["map"], maps)}
    different = {
        name: value for name, value in values.items() if value != defaults[name]
    }
    return _point_hash(
        json.dumps([model, preset, different], sort_keys=True, separators=(",", ":"))
    )


def directed(point: str, direction: str) -> str:
    """Return the id of a point for links of a direction.

    The ids differ, so that the decreasing branch has different random numbers.
    """
    return _point_hash(f"{point} {DOWN}") if direction == DOWN else point


def _identity(name: str, value: Value, maps: Mapping[str, OwnMap]) -> Value:
    """Return the value that the hash covers: a custom map's name and content hash."""
    return (
        f"{value} {maps[str(value)].digest}"
        if name == "map" and value in maps
        else value
    )


def _point_hash(canonical: str) -> str:
    return hashlib.sha256(canonical.encode()).hexdigest()[:16]


class LazyJobs(Sequence[Job], ABC):
    """Sequence of jobs that creates each job on access."""

    @overload
    def __getitem__(self, index: int) -> Job: ...
    @overload
    def __getitem__(self, index: slice) -> list[Job]: ...
    def __getitem__(self, index: int | slice) -> Job | list[Job]:
        places = range(len(self))[index]
        if isinstance(places, range):
            return [self.at(place) for place in places]
        return self.at(places)

    @abstractmethod
    def at(self, place: int) -> Job:
        """Return the job at an index, which is from 0 to len(self) - 1."""


class Jobs(LazyJobs):
    """All trials of a study, point after point, created on access.

    Replicate k of a point is the same trial for any number of trials.

    Parameters
    ----------
    study : Study
    design : Design
        Points of the study.
    trials : array of int, shape (n_points,), optional
        Trials per point, at least one; by default `study.trials_per_point` each.
    """

    def __init__(
        self,
        study: Study,
        design: Design,
        trials: Counts | None = None,
    ) -> None:
        self.study = study
        self.design = design
        self.trials = (
            np.full(design.n_points, study.trials_per_point)
            if trials is None
            else trials
        )
        self._ends = np.cumsum(self.trials)
        self._ids = _TrialIds(study, Recording.of(study))

    def __len__(self) -> int:
        return int(self._ends[-1])

    def at(self, place: int) -> Job:
        """Return the job at an index in the order of the study."""
        point = int(self.points_at(place))
        return self._job(point, place - int(self._ends[point] - self.trials[point]))

    def ids(self) -> Ids:
        """Return the ids of all jobs, in the order of the study."""
        return self.ids_at(np.arange(len(self)))

    def table(self) -> "pa.Table":
        """Return a table of all jobs, in the order of the study.

        The columns are `trial_id`, `point`, `replicate` and `seed`, and `parent` for
        links of chains.
        """
        return self.rows(np.arange(len(self)), self.ids())

    def rows(self, places: Counts, ids: Ids) -> "pa.Table":
        """Return some rows of `table`.

        Parameters
        ----------
        places : array of int, shape (n,)
            Indices of the jobs.
        ids : array of bytes, shape (n,)
            Ids of these jobs.

        Returns
        -------
        pyarrow.Table
        """
        import pyarrow as pa  # workers need no tables

        point, replicate = self._points_and_replicates(places)
        seeds = self.study.seeds
        parents = {PARENT: self._parents(places)} if self.links else {}
        return pa.table(
            {
                "trial_id": as_texts(ids),
                "point": pa.array(self._points[point], pa.binary()).cast(pa.string()),
                "replicate": replicate,
                "seed": np.full(len(places), self.study.seed)
                if seeds is None
                else np.array(seeds)[replicate],
            }
            | parents
        )

    def _parents(self, places: Counts) -> "pa.Array":
        """Return the ids of the parents of links, null for first links."""
        import pyarrow as pa
        import pyarrow.compute as pc

        before = self.before(places)
        texts = as_texts(self._linked_ids[before]).combine_chunks()
        nulls = pa.scalar(None, pa.string())
        return pc.if_else(pa.array(before != FIRST), texts, nulls)

    def ids_at(self, places: Counts, recording: Recording | None = None) -> Ids:
        """Return the ids of some trials.

        Parameters
        ----------
        places : array of int, shape (n,)
            Indices of the trials.
        recording : Recording, optional
            Recorded values; by default the values that the study records.

        Returns
        -------
        array of bytes, shape (n,)
        """
        if self.links:
            return (
                self._linked_ids if recording is None else self._chained(recording)
            )[places]
        ids = self._ids if recording is None else _TrialIds(self.study, recording)
        return self._unlinked(places, ids)

    def _unlinked(self, places: Counts, ids: "_TrialIds") -> Ids:
        packed = np.empty(len(places), BYTES)
        for first in range(0, len(places), BLOCK):
            block = slice(first, first + BLOCK)
            packed[block] = self._trial_ids(places[block], ids)
        return packed

    @property
    def links(self) -> Links | None:
        """Links between points; None if trials are not links of chains."""
        return self.design.links

    def before(self, places: Counts) -> Counts:
        """Return the indices of the parents of trials, FIRST for first links."""
        return self._at_point(places, "before")

    def first(self, places: Counts) -> Counts:
        """Return the indices of the first trials in the chains of trials."""
        return self._at_point(places, "first")

    def _at_point(self, places: Counts, which: Literal["before", "first"]) -> Counts:
        assert self.links
        point, replicate = self._points_and_replicates(places)
        other = getattr(self.links, which)[point]
        begins = (self._ends - self.trials)[other]
        linked: Counts = np.where(other == FIRST, FIRST, begins + replicate)
        return linked

    @cached_property
    def _linked_ids(self) -> Ids:
        return self._chained(Recording.of(self.study))

    def _chained(self, recording: Recording) -> Ids:
        """Return the ids of all links, each of which covers the id of its parent."""
        assert self.links
        ids = _TrialIds(self.study, recording)
        packed = np.zeros(len(self), BYTES)
        first = self._ends - self.trials
        for points in self.links.by_number():
            places = np.concatenate(
                [np.arange(first[point], self._ends[point]) for point in points]
            )
            parents = [
                _text(packed, parent) if parent != FIRST else ""
                for parent in self.before(places).tolist()
            ]
            packed[places] = self._trial_ids(places, ids, parents)
        return packed

    def _points_and_replicates(self, places: Counts) -> tuple[Counts, Counts]:
        point = self.points_at(places)
        return point, places - (self._ends - self.trials)[point]

    def points_at(self, indices: int | Counts) -> Any:
        """Return the index of the point of a job in the design, or of several jobs."""
        return np.searchsorted(self._ends, indices, side="right")

    def to_run(self, places: Counts) -> "SomeJobs":
        """Return the jobs at some indices, in the order in which they are to run."""
        if self.study.order == "coarse":
            point, replicate = self._points_and_replicates(places)
            first = coarse_first(self.design.fineness[point], replicate)
            places = places[first]
        return SomeJobs(self, places)

    @property
    def points(self) -> list[str]:
        """Ids of all points, in the order of the design."""
        return [point.decode() for point in self._points.tolist()]

    @cached_property
    def _points(self) -> NDArray[np.bytes_]:
        # Python's strings would take four times the memory.
        points = _point_ids(self.study, self.design)
        if self.links:
            links = zip(points.tolist(), self.links.direction.tolist(), strict=True)
            points = np.array(
                [directed(point.decode(), direction) for point, direction in links],
                "S16",
            )
        return points

    def _trial_ids(
        self, places: Counts, ids: "_TrialIds", parents: Sequence[str] = ()
    ) -> Ids:
        """Return the ids of some trials; links need the ids of their `parents`."""
        point, replicate = self._points_and_replicates(places)
        names = zip(self._points[point].tolist(), replicate.tolist(), strict=True)
        scenes = zip(*(self._values(name, point) for name in SCENE), strict=False)
        literal = self.study.seeds is not None
        after = map(_after, parents) if self.links else repeat("")
        digests = [
            ids.of(name.decode(), self._beginning(number, literal) + end, scene)
            for (name, number), scene, end in zip(names, scenes, after, strict=False)
        ]
        return np.array(digests, BYTES)

    def _job(self, point: int, replicate: int) -> Job:
        study = self.study
        settings = self.design.settings(point)
        name = self._points[point].decode()
        own = study.maps.get(str(settings["map"]))
        seed = self._seed(replicate)
        literal = study.seeds is not None
        ending = self._beginning(replicate, literal)
        model = study.catalogue.models[study.model]
        if model.events:
            settings = settings | parameters_of(model.events[replicate], model.kinds)
        direction = ""
        parent = ""
        if self.links:
            direction = str(self.links.direction[point])
            parent = self._parent(point, replicate)
            ending += _after(parent)
        return Job(
            trial_id=self._ids.of(name, ending, _scene(settings)).hex(),
            point=name,
            replicate=replicate,
            seed=seed,
            literal=literal,
            model=study.model,
            preset=study.preset,
            settings=settings,
            record=study.record,
            streams=study.streams,
            time_limit=study.time_limit,
            obstacles=own.obstacles if own else None,
            catalogue=study.catalogue,
            direction=direction,
            parent=parent,
            all_pairs=study.neighbour_search == ALL_PAIRS,
        )

    def _beginning(self, replicate: int, literal: bool) -> str:
        """Return the text of the seed and the replicate, or of the event."""
        events = self.study.catalogue.models[self.study.model].events
        return _ending(self._seed(replicate), replicate, literal, events)

    def _parent(self, point: int, replicate: int) -> str:
        """Return the id of the parent of a link; "" for a first link."""
        assert self.links
        before = int(self.links.before[point])
        if before == FIRST:
            return ""
        first = int(self._ends[before] - self.trials[before])
        return _text(self._linked_ids, first + replicate)

    def _seed(self, replicate: int) -> int:
        return (
            self.study.seed if self.study.seeds is None else self.study.seeds[replicate]
        )

    def _values(self, name: str, point: Counts) -> Iterable[Value]:
        """Return the values of a parameter at some points."""
        column = self.design.columns.get(name)
        if column is None:
            return repeat(self.design.base[name], len(point))
        values: list[Value] = column[point].tolist()
        return values


class _TrialIds:
    """Ids of the trials of a study with a recording."""

    def __init__(self, study: Study, recording: Recording) -> None:
        self.study = study
        self.recording = recording
        self.code = study_code(study)
        self._begun: dict[Scene, hashlib._Hash] = {}

    def of(self, point: str, ending: str, scene: Scene) -> bytes:
        """Return the id of a trial.

        The id of the point covers the content of a map that the spec contains.

        Parameters
        ----------
        point : str
            Id of the point.
        ending : str
            Seed and replicate, and the parent of a link.
        scene : tuple
            Values of the parameters in SCENE.

        Returns
        -------
        bytes
            12 bytes.
        """
        digest = self._common(scene).copy()
        digest.update(f" {point} {ending}".encode())
        return digest.digest()[:12]

    def _common(self, scene: Scene) -> "hashlib._Hash":
        """Return the hash of the content that all trials in a scene share."""
        if scene not in self._begun:
            content = common_content(
                self.study, self.code, self.recording, *map(str, scene)
            )
            text = json.dumps(content, sort_keys=True)
            self._begun[scene] = hashlib.sha256(text.encode())
        return self._begun[scene]


def common_content(
    study: Study, code: Code, recording: Recording, drawn: str, start: str
) -> list[Any]:
    """Return the content that the ids of all trials with a map and a start cover.

    Parameters
    ----------
    study : Study
    code : Code
        Code hashes of the study.
    recording : Recording
    drawn : str
        Name of the map.
    start : str
        Name of the start.

    Returns
    -------
    list
        Ready for JSON.
    """
    scene = [code.maps.get(drawn, ""), code.starts[start]]
    stamps = [code.flight, code.models, recording.stamps, *scene]
    return [*stamps, asdict(study.streams), recording.content]


def _scene(settings: Mapping[str, Value]) -> Scene:
    return tuple(settings[name] for name in SCENE)


def _ending(
    seed: int, replicate: int, literal: bool, events: Sequence[Event] = ()
) -> str:
    if events:  # a recording has no random numbers
        return f"event {replicate} {events[replicate].sha}, means over all frames"
    # The index of a listed seed is left out, so that the list may be reordered.
    return f"{seed} {'listed' if literal else f'replicate {replicate}'}"


def of_all_events(
    model: Model, settings: Mapping[str, Value], usual: Mapping[str, Value]
) -> Mapping[str, Value]:
    """Return the parameters of a trial as its point has them.

    Parameters
    ----------
    model : Model
    settings : mapping
        Parameters of the trial.
    usual : mapping
        Parameters of the preset, which replace those of an event of a recording.
    """
    if not model.events:
        return settings
    measured = parameters_of(model.events[0], model.kinds)
    return {**settings, **{name: usual[name] for name in measured}}


def _after(parent: str) -> str:
    """Return the text that only the id of a link covers."""
    return f" after {parent}"


def _text(ids: Ids, place: int) -> str:
    """Return the hexadecimal digits of an id."""
    return ids[place : place + 1].tobytes().hex()


class SomeJobs(LazyJobs):
    """Some of the trials of a study, created on access.

    Parameters
    ----------
    jobs : Jobs
        All trials.
    indices : array of int, shape (n,)
        Indices of the trials in `jobs`.
    """

    def __init__(self, jobs: Jobs, indices: Counts) -> None:
        self.jobs = jobs
        self.indices = indices

    def __len__(self) -> int:
        return len(self.indices)

    def at(self, place: int) -> Job:
        """Return the job of one of the indices."""
        return self.jobs.at(int(self.indices[place]))

    @property
    def points(self) -> Counts:
        """Index of each job's point in the design, shape (n,)."""
        points: Counts = self.jobs.points_at(self.indices)
        return points


def blocks_of(jobs: Sequence[Job], size: int) -> Iterator[Sequence[Job]]:
    """Yield blocks of at most `size` jobs; a block of SomeJobs creates no job."""
    for first in range(0, len(jobs), size):
        block = slice(first, first + size)
        if isinstance(jobs, SomeJobs):
            yield SomeJobs(jobs.jobs, jobs.indices[block])
        else:
            yield jobs[block]


def ids_recording(study: Study, jobs: Sequence[Job], recording: Recording) -> Ids:
    """Return the ids of jobs for another recording.

    Parameters
    ----------
    study : Study
    jobs : sequence of Job, length n
        Trials of the study.
    recording : Recording
        Recorded values that the ids cover.

    Returns
    -------
    array of bytes, shape (n,)
    """
    if isinstance(jobs, SomeJobs):  # there may be millions
        return jobs.jobs.ids_at(jobs.indices, recording)
    ids = _TrialIds(study, recording)
    digests = [
        ids.of(
            job.point,
            _ending(
                job.seed,
                job.replicate,
                job.literal,
                job.catalogue.models[job.model].events,
            )
            + (_after(job.parent) if job.direction else ""),
            _scene(job.settings),
        )
        for job in jobs
    ]
    return np.array(digests, BYTES)


def ids_of_steps(study: Study, jobs: Sequence[Job], steps: int) -> Ids:
    """Return the ids of jobs for another number of steps.

    Parameters
    ----------
    study : Study
    jobs : sequence of Job, length n
        Trials of the study.
    steps : int

    Returns
    -------
    array of bytes, shape (n,)
    """
    if isinstance(jobs, SomeJobs):  # there may be millions
        design = jobs.jobs.design.with_value(STEPS, steps)
        return Jobs(study, design, jobs.jobs.trials).ids_at(jobs.indices)
    shorter = [
        replace(
            job,
            point=point_id(
                job.model,
                job.preset,
                job.settings | {STEPS: steps},
                study.preset_settings,
                maps=study.maps,
            ),
        )
        for job in jobs
    ]
    return ids_recording(study, shorter, Recording.of(study))


def steps_of(jobs: Sequence[Job]) -> Counts:
    """Return the number of steps of each job, shape (n,)."""
    if isinstance(jobs, SomeJobs):
        design = jobs.jobs.design
        points = jobs.points
        if STEPS in design.columns:
            return np.asarray(design.columns[STEPS][points], np.int64)
        return np.full(len(points), design.base[STEPS], np.int64)
    return np.array([job.settings[STEPS] for job in jobs], np.int64)


class ContinuedJobs(LazyJobs):
    """Jobs, some of which resume from the last states of earlier trials.

    Parameters
    ----------
    jobs : sequence of Job, length n
    begun : array of int, shape (n,)
        Steps of the earlier trials, 0 for a job that begins at step 0.
    earlier : callable
        Returns the last state for the job at an index.
    """

    def __init__(
        self,
        jobs: Sequence[Job],
        begun: Counts,
        earlier: Callable[[int], LastState],
    ) -> None:
        self.jobs = jobs
        self.begun = begun
        self._earlier = earlier

    def __len__(self) -> int:
        return len(self.jobs)

    def at(self, place: int) -> Job:
        """Return the job at an index, with the last state from which it resumes."""
        if not self.begun[place]:
            return self.jobs[place]
        return replace(self.jobs[place], earlier=self._earlier(place))


class LinkedJobs(LazyJobs):
    """The next link of each of several chains of jobs.

    Parameters
    ----------
    jobs : Jobs
        All trials of the study.
    links : sequence of sequences of int
        Indices in `jobs` of the links of each chain, in the order in which they run.
    begins : sequence of LastFlock or None
        Flock with which the first of these links begins, per chain. None if the
        parameters define the start.
    """

    def __init__(
        self,
        jobs: Jobs,
        links: Sequence[Sequence[int]],
        begins: Sequence[LastFlock | None],
    ) -> None:
        self.jobs = jobs
        self.links = links
        self._done = [0] * len(links)
        self._begins = list(begins)

    def __len__(self) -> int:
        return len(self.links)

    def at(self, place: int) -> Job:
        """Return the next link of a chain."""
        job = self.jobs.at(self.links[place][self._done[place]])
        return replace(job, begins=self._begins[place])

    def go_on(self, place: int, flock: LastFlock | None) -> bool:
        """Take the final flock of the current link, and move on to the next link.

        Parameters
        ----------
        place : int
            Index of the chain.
        flock : LastFlock or None
            None if the trial did not reach the end; then the chain also ends.

        Returns
        -------
        bool
            Whether another link runs next.
        """
        if flock is None:
            return False
        self._begins[place] = flock
        self._done[place] += 1
        return self._done[place] < len(self.links[place])

    def left(self, places: Sequence[int]) -> "SomeJobs":
        """Return all links of some chains that have not run."""
        indices = [index for place in places for index in self._left(place)]
        return SomeJobs(self.jobs, np.array(indices, np.int64))

    def _left(self, place: int) -> Sequence[int]:
        return self.links[place][self._done[place] :]

    def from_links(self, jobs: Sequence[Job]) -> "LinkedJobs":
        """Return the chains of the given next links, from these links on."""
        chains = {self.at(place).trial_id: place for place in self._unfinished()}
        places = [chains[job.trial_id] for job in jobs]
        begins = [job.begins for job in jobs]
        return LinkedJobs(self.jobs, [self._left(place) for place in places], begins)

    def _unfinished(self) -> Iterator[int]:
        return (place for place in range(len(self)) if self._left(place))


def _point_ids(study: Study, design: Design) -> NDArray[np.bytes_]:
    """Return `point_id` of every point.

    The hashed text is assembled column by column, which is much faster.
    """
    blocks = range(0, design.n_points, BLOCK)
    ids = [
        _point_ids_between(study, design, first, min(first + BLOCK, design.n_points))
        for first in blocks
    ]
    return np.concatenate([np.array(block, "S16") for block in ids])


def _point_ids_between(
    study: Study, design: Design, first: int, last: int
) -> list[str]:
    preset = study.preset_settings
    columns = design.columns
    members: list[Iterable[str]] = [repeat("", last - first)]
    for name in sorted(preset):
        if name in columns:
            members.append(
                _members(
                    name, columns[name][first:last].tolist(), preset[name], study.maps
                )
            )
        elif design.base[name] != preset[name]:
            members.append(
                repeat(_members(name, [design.base[name]], preset[name], study.maps)[0])
            )
    head = json.dumps([study.model, study.preset], separators=(",", ":"))[:-1] + ",{"
    return [
        _point_hash(head + "".join(member)[1:] + "}]")
        for member in zip(*members, strict=False)
    ]


def _members(
    name: str, values: list[Value], default: Value, maps: Mapping[str, OwnMap]
) -> list[str]:
    """Return `,"name":value` as JSON for each value, "" for the default."""
    distinct = list(dict.fromkeys(values))
    texts = json.dumps(
        [_identity(name, value, maps) for value in distinct], separators=("\n", ":")
    )[1:-1].split("\n")
    key = f",{json.dumps(name)}:"
    members = {
        value: key + text for value, text in zip(distinct, texts, strict=True)
    } | {default: ""}
    return [members[value] for value in values]
