"""From a design to its trials, each with an id that is a hash of its content.

The id of a point covers the model, the preset and the settings that differ from the
preset's. So a new axis leaves the points with its preset value what they were. The id
of a trial adds the code that computes it, the seed, the streams and what is recorded:
trials that could differ in a single number are different trials.
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
from sweep.design.chains import FIRST, Links
from sweep.design.code import study_code
from sweep.design.design import Design
from sweep.design.order import coarse_first
from sweep.design.recording import Recording
from sweep.design.trial_ids import BYTES, Ids, as_texts
from sweep.spec.continuing import DOWN, PARENT
from sweep.spec.copied_maps import Obstacles
from sweep.spec.maps import OwnMap
from sweep.spec.seeds import address, point_numbers
from sweep.spec.settings import Value, usual_settings
from sweep.spec.study import ALL_PAIRS, RecordSpec, Stream, Streams, Study

if TYPE_CHECKING:
    import pyarrow as pa

Purpose = Literal["start", "world", "noise", "made", "flown"]
KIND = {"made": "start", "flown": "noise"}
"""Who is made how is as common as the start, what happens to robots as the noise."""
Counts = NDArray[np.int64]

SCENE = ("map", "start_draws")
"""Settings whose values have code of their own."""
Scene = tuple[Value, ...]
STEPS = "steps"
NO_MAPS: Mapping[str, OwnMap] = {}
BLOCK = 20_000
"""Points, or trials, whose ids are made at once: a million would take a gigabyte."""


@dataclass(frozen=True, slots=True)
class LastState:
    """All with which the trial `trial_id` ended, in bytes that are sealed."""

    trial_id: str
    content: bytes = field(repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class LastFlock:
    """Where the N boids of a trial are at its end: `bodies` (4, N) are x, y, vx and vy,
    `headings` (2, N) the last velocity of each that was not zero, and `state` (S, N)
    the rows of the model's state.
    """

    bodies: NDArray[np.float64]
    headings: NDArray[np.float64]
    state: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Job:
    """One trial and all that is needed to run it, anywhere and at any time, to the same
    bits.

    With `literal`, `seed` is one of the listed seeds and `replicate` only its place in
    the list. Otherwise `seed` is that of the study, and `replicate` tells apart the
    trials of a point. `obstacles` are those of a map that the spec brings, None for a
    built-in one. `known` has what names of models, metrics, maps and starts stand for.
    `earlier` is what the same trial with fewer steps has left, None to begin at step 0.
    With `all_pairs` neighbours are found without a grid, which changes no bit.

    A link of a chain has a `direction`, up or down. It begins with the flock `begins`,
    with which the trial `parent` has ended; the first link has no parent, and begins as
    its settings say.
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
    known: Catalogue = BUILT_IN
    earlier: LastState | None = None
    direction: str = ""
    parent: str = ""
    begins: LastFlock | None = field(default=None, repr=False)
    all_pairs: bool = False


def stream(job: Job, purpose: Purpose) -> SeedSequence:
    """The seed sequence of one kind of randomness in a trial; a common one is the same
    at all points, a lasting one at all that differ in `steps` alone.
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
    """The id that the point of a job would have with the steps of its preset."""
    usual = usual_settings(job.model, job.preset, job.known)
    settings = job.settings | {STEPS: usual[STEPS]}
    return directed(point_id(job.model, job.preset, settings, usual), job.direction)


def literal_seed(job: Job, purpose: Purpose) -> int:
    """A seed for Python's `random.Random`: the listed seed where the stream is common,
    else 64 bits.
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
    """16 hexadecimal digits that stand for a point: a hash of the settings that differ
    from those of the preset, `defaults`.

    Of a map that the spec brings it covers the obstacles too.
    """
    values = {**settings, "map": _identity("map", settings["map"], maps)}
    different = {
        name: value for name, value in values.items() if value != defaults[name]
    }
    return _point_hash(
        json.dumps([model, preset, different], sort_keys=True, separators=(",", ":"))
    )


def directed(point: str, direction: str) -> str:
    """The id of a point for links of a direction: on the way down it has random numbers
    of its own.
    """
    return _point_hash(f"{point} {DOWN}") if direction == DOWN else point


def _identity(name: str, value: Value, maps: Mapping[str, OwnMap]) -> Value:
    """What stands for a value in the hash: for an own map, its name and content."""
    return (
        f"{value} {maps[str(value)].digest}"
        if name == "map" and value in maps
        else value
    )


def _point_hash(canonical: str) -> str:
    return hashlib.sha256(canonical.encode()).hexdigest()[:16]


class LazyJobs(Sequence[Job], ABC):
    """Jobs of which each is made when it is asked for."""

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
        """The job at a place from 0 on, which there is."""


class Jobs(LazyJobs):
    """All trials of a study, point after point. Each is made when it is asked for.

    `trials` (n_points,) says how many each point has, at least one; by default the
    study's number of trials a point. Replicate k of a point is the same trial whatever
    that number.
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
        """The job at a place in the order of the study."""
        point = int(self.points_at(place))
        return self._job(point, place - int(self._ends[point] - self.trials[point]))

    def ids(self) -> Ids:
        """The ids of all jobs, in their order."""
        return self.ids_at(np.arange(len(self)))

    def table(self) -> "pa.Table":
        """`trial_id`, `point`, `replicate` and `seed` of all jobs, in their order."""
        return self.rows(np.arange(len(self)), self.ids())

    def rows(self, places: Counts, ids: Ids) -> "pa.Table":
        """The rows of `table` at some places, whose jobs have these ids."""
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
        """The ids of the trials where links begin, null for first links."""
        import pyarrow as pa
        import pyarrow.compute as pc

        before = self.before(places)
        texts = as_texts(self._linked_ids[before]).combine_chunks()
        nulls = pa.scalar(None, pa.string())
        return pc.if_else(pa.array(before != FIRST), texts, nulls)

    def ids_at(self, places: Counts, recording: Recording | None = None) -> Ids:
        """The ids of the trials at some places, or those that they would have if they
        recorded something else.
        """
        if self.links:
            return (
                self._linked_ids if recording is None else self._chained(recording)
            )[places]
        ids = self._ids if recording is None else _TrialIds(self.study, recording)
        return self._unlinked(places, ids)

    def _unlinked(self, places: Counts, ids: "_TrialIds") -> Ids:
        found = np.empty(len(places), BYTES)
        for first in range(0, len(places), BLOCK):
            some = slice(first, first + BLOCK)
            found[some] = self._trial_ids(places[some], ids)
        return found

    @property
    def links(self) -> Links | None:
        """How its points are linked; None where trials are no links of chains."""
        return self.design.links

    def before(self, places: Counts) -> Counts:
        """The places of the trials where those at some places begin, FIRST for first
        links.
        """
        return self._at_point(places, "before")

    def first(self, places: Counts) -> Counts:
        """The places of the first links of the chains of those at some places."""
        return self._at_point(places, "first")

    def _at_point(self, places: Counts, which: Literal["before", "first"]) -> Counts:
        assert self.links
        point, replicate = self._points_and_replicates(places)
        other = getattr(self.links, which)[point]
        begins = (self._ends - self.trials)[other]
        found: Counts = np.where(other == FIRST, FIRST, begins + replicate)
        return found

    @cached_property
    def _linked_ids(self) -> Ids:
        return self._chained(Recording.of(self.study))

    def _chained(self, recording: Recording) -> Ids:
        """The ids of all links, each of which covers that of the one before."""
        assert self.links
        ids, found = _TrialIds(self.study, recording), np.zeros(len(self), BYTES)
        first = self._ends - self.trials
        for points in self.links.by_number():
            places = np.concatenate(
                [np.arange(first[one], self._ends[one]) for one in points]
            )
            before = self.before(places)
            parents = [
                _text(found, one) if one != FIRST else "" for one in before.tolist()
            ]
            found[places] = self._trial_ids(places, ids, parents)
        return found

    def _points_and_replicates(self, places: Counts) -> tuple[Counts, Counts]:
        point = self.points_at(places)
        return point, places - (self._ends - self.trials)[point]

    def points_at(self, indices: int | Counts) -> Any:
        """The place in the design of the point of a job, or of each of several."""
        return np.searchsorted(self._ends, indices, side="right")

    def to_run(self, places: Counts) -> "SomeJobs":
        """The jobs at some places, in the order in which the study has them run."""
        if self.study.order == "coarse":
            point, replicate = self._points_and_replicates(places)
            first = coarse_first(self.design.fineness[point], replicate)
            places = places[first]
        return SomeJobs(self, places)

    @property
    def points(self) -> list[str]:
        """The ids of all points, in their order."""
        return [point.decode() for point in self._points.tolist()]

    @cached_property
    def _points(self) -> NDArray[np.bytes_]:
        # Python's texts would take four times the memory.
        points = _point_ids(self.study, self.design)
        if self.links:
            ways = zip(points.tolist(), self.links.direction.tolist(), strict=True)
            points = np.array([directed(one.decode(), way) for one, way in ways], "S16")
        return points

    def _trial_ids(
        self, places: Counts, ids: "_TrialIds", parents: Sequence[str] = ()
    ) -> Ids:
        """The ids of the trials at some places, of links with those of their
        `parents`.
        """
        point, replicate = self._points_and_replicates(places)
        names = zip(self._points[point].tolist(), replicate.tolist(), strict=True)
        scenes = zip(*(self._values(name, point) for name in SCENE), strict=False)
        literal = self.study.seeds is not None
        after = map(_after, parents) if self.links else repeat("")
        made = [
            ids.of(
                name.decode(), _ending(self._seed(number), number, literal) + end, scene
            )
            for (name, number), scene, end in zip(names, scenes, after, strict=False)
        ]
        return np.array(made, BYTES)

    def _job(self, point: int, replicate: int) -> Job:
        study, settings, name = (
            self.study,
            self.design.settings(point),
            self._points[point].decode(),
        )
        own = study.maps.get(str(settings["map"]))
        seed, literal = self._seed(replicate), study.seeds is not None
        direction, parent, ending = "", "", _ending(seed, replicate, literal)
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
            known=study.known,
            direction=direction,
            parent=parent,
            all_pairs=study.neighbour_search == ALL_PAIRS,
        )

    def _parent(self, point: int, replicate: int) -> str:
        """The id of the trial where a link begins; "" for a first link."""
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
        """The values of a setting at some points."""
        column = self.design.columns.get(name)
        if column is None:
            return repeat(self.design.base[name], len(point))
        values: list[Value] = column[point].tolist()
        return values


class _TrialIds:
    """Makes the ids of trials of a study which record something."""

    def __init__(self, study: Study, recording: Recording) -> None:
        self.study, self.recording, self.code = study, recording, study_code(study)
        self._begun: dict[Scene, hashlib._Hash] = {}

    def of(self, point: str, ending: str, scene: Scene) -> bytes:
        """The id of a trial; the id of its point has the content of a map that the spec
        brings.
        """
        digest = self._common(scene).copy()
        digest.update(f" {point} {ending}".encode())
        return digest.digest()[:12]

    def _common(self, scene: Scene) -> "hashlib._Hash":
        """The hash of what all trials in a scene have in common."""
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
    """What the ids of all trials with a map and a start cover, ready for JSON."""
    scene = [code.maps.get(drawn, ""), code.starts[start]]
    stamps = [code.flight, code.models, recording.stamps, *scene]
    return [*stamps, asdict(study.streams), recording.content]


def _scene(settings: Mapping[str, Value]) -> Scene:
    return tuple(settings[name] for name in SCENE)


def _ending(seed: int, replicate: int, literal: bool) -> str:
    # The place of a listed seed is left out, so that the list may be reordered.
    return f"{seed} {'listed' if literal else f'replicate {replicate}'}"


def _after(parent: str) -> str:
    """What the id of a link covers beside what that of any trial does."""
    return f" after {parent}"


def _text(ids: Ids, place: int) -> str:
    """The text of one of some ids."""
    return ids[place : place + 1].tobytes().hex()


class SomeJobs(LazyJobs):
    """The jobs of `jobs` at some indices; each is made when it is asked for."""

    def __init__(self, jobs: Jobs, indices: Counts) -> None:
        self.jobs, self.indices = jobs, indices

    def __len__(self) -> int:
        return len(self.indices)

    def at(self, place: int) -> Job:
        """The job of one of the indices."""
        return self.jobs.at(int(self.indices[place]))

    @property
    def points(self) -> Counts:
        """The place of each job's point in the design."""
        points: Counts = self.jobs.points_at(self.indices)
        return points


def blocks_of(jobs: Sequence[Job], size: int) -> Iterator[Sequence[Job]]:
    """Some jobs after the other, at most `size` at once; none is made for it."""
    for first in range(0, len(jobs), size):
        some = slice(first, first + size)
        if isinstance(jobs, SomeJobs):
            yield SomeJobs(jobs.jobs, jobs.indices[some])
        else:
            yield jobs[some]


def ids_recording(study: Study, jobs: Sequence[Job], recording: Recording) -> Ids:
    """The ids that some jobs of a study would have if they recorded something else."""
    if isinstance(jobs, SomeJobs):  # there may be millions
        return jobs.jobs.ids_at(jobs.indices, recording)
    ids = _TrialIds(study, recording)
    made = [
        ids.of(
            job.point,
            _ending(job.seed, job.replicate, job.literal)
            + (_after(job.parent) if job.direction else ""),
            _scene(job.settings),
        )
        for job in jobs
    ]
    return np.array(made, BYTES)


def ids_of_steps(study: Study, jobs: Sequence[Job], steps: int) -> Ids:
    """The ids that some jobs of a study would have with so many steps."""
    if isinstance(jobs, SomeJobs):  # there may be millions
        whole = jobs.jobs
        design = whole.design.with_value(STEPS, steps)
        return Jobs(study, design, whole.trials).ids_at(jobs.indices)
    shorter = [
        replace(
            job,
            point=point_id(
                job.model,
                job.preset,
                job.settings | {STEPS: steps},
                study.preset_settings,
                study.maps,
            ),
        )
        for job in jobs
    ]
    return ids_recording(study, shorter, Recording.of(study))


def steps_of(jobs: Sequence[Job]) -> Counts:
    """The steps of each job, shape (n,)."""
    if isinstance(jobs, SomeJobs):
        design, points = jobs.jobs.design, jobs.points
        if STEPS in design.columns:
            return np.asarray(design.columns[STEPS][points], np.int64)
        return np.full(len(points), design.base[STEPS], np.int64)
    return np.array([job.settings[STEPS] for job in jobs], np.int64)


class ContinuedJobs(LazyJobs):
    """`jobs`, some of which go on from the last states of earlier trials.

    `begun` (n,) are the steps that those have done, 0 where there is none; `earlier`
    gives the last state of the trial for the job at a place.
    """

    def __init__(
        self,
        jobs: Sequence[Job],
        begun: Counts,
        earlier: Callable[[int], LastState],
    ) -> None:
        self.jobs, self.begun, self._earlier = jobs, begun, earlier

    def __len__(self) -> int:
        return len(self.jobs)

    def at(self, place: int) -> Job:
        """The job at a place, with the last state from which it goes on."""
        if not self.begun[place]:
            return self.jobs[place]
        return replace(self.jobs[place], earlier=self._earlier(place))


class LinkedJobs(LazyJobs):
    """Chains of jobs that run: of each the link that runs next.

    `links` are the places of the jobs of each chain among those of `jobs`, in their
    order; `begins` (len(links),) has the flock with which the first of them begins,
    None where its settings say how.
    """

    def __init__(
        self,
        jobs: Jobs,
        links: Sequence[Sequence[int]],
        begins: Sequence[LastFlock | None],
    ) -> None:
        self.jobs, self.links, self._done = jobs, links, [0] * len(links)
        self._begins = list(begins)

    def __len__(self) -> int:
        return len(self.links)

    def at(self, place: int) -> Job:
        """The link of a chain that runs next."""
        job = self.jobs.at(self.links[place][self._done[place]])
        return replace(job, begins=self._begins[place])

    def go_on(self, place: int, flock: LastFlock | None) -> bool:
        """Learn with which flock the link of a chain has ended, None if it has not come
        to its end. Whether another link runs next.
        """
        if flock is None:
            return False
        self._begins[place] = flock
        self._done[place] += 1
        return self._done[place] < len(self.links[place])

    def left(self, places: Sequence[int]) -> "SomeJobs":
        """All links of some chains that have not run."""
        found = [one for place in places for one in self._left(place)]
        return SomeJobs(self.jobs, np.array(found, np.int64))

    def _left(self, place: int) -> Sequence[int]:
        return self.links[place][self._done[place] :]

    def from_links(self, jobs: Sequence[Job]) -> "LinkedJobs":
        """The chains of these jobs, from them on."""
        chains = {self.at(place).trial_id: place for place in self._unfinished()}
        places = [chains[job.trial_id] for job in jobs]
        begins = [job.begins for job in jobs]
        return LinkedJobs(self.jobs, [self._left(place) for place in places], begins)

    def _unfinished(self) -> Iterator[int]:
        return (place for place in range(len(self)) if self._left(place))


def _point_ids(study: Study, design: Design) -> NDArray[np.bytes_]:
    """`point_id` of every point, from the same text put together column by column,
    which is much faster.
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
    preset, columns = study.preset_settings, design.columns
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
    """`,"name":value` in JSON for each value, "" for a default; see `_identity`."""
    distinct = list(dict.fromkeys(values))
    texts = json.dumps(
        [_identity(name, value, maps) for value in distinct], separators=("\n", ":")
    )[1:-1].split("\n")
    key = f",{json.dumps(name)}:"
    members = {
        value: key + text for value, text in zip(distinct, texts, strict=True)
    } | {default: ""}
    return [members[value] for value in values]
