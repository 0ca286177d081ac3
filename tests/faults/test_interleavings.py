"""Whatever two processes do to one study at once, and in whichever order their steps
fall: nothing is lost or doubled.

Every pair of what shares, a launch of the whole, gc and readers do runs step by step,
in a folder and in an object store, in every order that can make a difference
(`interleavings.py`), or in those with one interruption. A step is what others can
notice, or what depends on them: a look at a folder or a file of the study, a rename, a
removal; of an object store every request.
"""

import itertools
import os
import shutil
import sys
import threading
from collections.abc import Callable, Hashable, Iterable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pyarrow as pa
import pytest

from sweep.store import folders, merging, parquet
from sweep.store import store as store_module
from sweep.store.held_store import set_aside_damaged
from sweep.store.locations import Location, ObjectPath, ObjectServer
from sweep.store.merging import Gathered
from sweep.store.store import Store
from tests.cases import slow_but
from tests.faults.interleavings import State, Step, World, explore, step
from tests.object_stores import Memory
from tests.studies import ORIGIN

WATCHED = ("parts", "damaged", "plan.parquet")
EVENTS = ("os.scandir", "os.listdir", "os.remove", "os.rmdir", "os.rename", "open")
_watched: list[str] = []
"""The folder whose steps are looked at, while there is one: a hook of the interpreter
cannot be taken back.
"""


def _heard(event: str, arguments: tuple[Any, ...]) -> None:
    if _watched and event in EVENTS:
        paths = [
            os.fsdecode(one)
            for one in arguments[:2]
            if isinstance(one, str | bytes | os.PathLike)
        ]
        inside = [path for path in paths if _is_watched(path)]
        if inside:
            step(
                Step(
                    inside,
                    writes=_changes(event, arguments),
                    look=lambda: (event, *(_look(path) for path in inside)),
                )
            )


sys.addaudithook(_heard)


def _changes(event: str, arguments: tuple[Any, ...]) -> bool:
    """Whether an event of the interpreter may change what others can notice."""
    if event == "open":
        return bool(arguments[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT))
    return event in ("os.remove", "os.rmdir", "os.rename")


def _is_watched(path: str) -> bool:
    return any(path.startswith(f"{_watched[0]}/{name}") for name in WATCHED)


def _look(path: str) -> Hashable:
    """The name of a path of the study, and what there is."""
    name = os.path.relpath(path, _watched[0])
    try:
        return name, *sorted(os.listdir(path))  # noqa: PTH208  names are enough
    except NotADirectoryError:
        return name, "a file"
    except FileNotFoundError:
        return name, "nothing"


class Requests(Memory):
    """An object store of which every request is a step."""

    def _ask(self, *keys: str, writes: bool = False) -> None:
        prefixes = tuple(key for key in keys if key.endswith("/"))
        step(
            Step(
                keys,
                writes,
                lambda: (
                    keys,
                    *sorted(
                        one
                        for one in self.objects
                        if one in keys or one.startswith(prefixes)
                    ),
                ),
            )
        )
        super()._ask(*keys, writes=writes)


class OneByOne:
    """In place of a pool of threads: what is asked at once is asked in turn."""

    def __init__(self, *_: object) -> None:
        pass

    def __enter__(self) -> "OneByOne":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    map = staticmethod(map)


@pytest.fixture
def steps(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Files of parts are opened in steps, nothing waits for a disk, and names are the
    same in every order.
    """
    stat = os.stat

    def looked_at(path: Any, *arguments: Any, **options: Any) -> os.stat_result:
        if (
            _watched
            and isinstance(path, str | os.PathLike)
            and _is_watched(os.fspath(path))
        ):
            path_of = os.fspath(path)
            step(Step([path_of], False, lambda: ("stat", _look(path_of))))
        return stat(path, *arguments, **options)

    monkeypatch.setattr(os, "stat", looked_at)
    monkeypatch.setattr(os, "fsync", lambda _: None)
    monkeypatch.setattr(parquet, "ThreadPoolExecutor", OneByOne)
    monkeypatch.setattr(store_module, "time", SimpleNamespace(time_ns=lambda: 0))
    monkeypatch.setattr(store_module.secrets, "token_hex", token)
    monkeypatch.setattr(folders, "here", lambda: TOKENS.name)
    monkeypatch.setattr(merging, "MOST_GATHERED", 2)
    yield
    _watched.clear()


TOKENS = threading.local()


def token(_bytes: int) -> str:
    """Names of parts tell who has stored them, and how many it has."""
    TOKENS.count += 1
    return f"{TOKENS.name}{TOKENS.count:x}"


def rows(*ids: str, status: str = "ok") -> dict[str, pa.Table]:
    trials = pa.table({"trial_id": list(ids), "status": [status] * len(ids)})
    return {
        "trials": trials.replace_schema_metadata(ORIGIN),
        "heatmaps": pa.table({"trial_id": list(ids), "value": [status] * len(ids)}),
    }


class Launch:
    """Who has a share of the study, or the whole, or reads; `name` is in the names of
    its parts.
    """

    def __init__(self, place: Location, name: str, operation: str) -> None:
        self.name, self.operation = name, operation
        self.store = Store(place)
        self.store.shared = operation in SHARED
        self.new, self.gone, self.read = set[str](), set[str](), list[set[str]]()
        for part in self.store.all_parts():
            if part.name.partition("-")[2].startswith(name):
                self.store._gathering.add(Gathered(part, 1, 1))

    def __call__(self) -> None:
        TOKENS.name, TOKENS.count = self.name, 1
        getattr(self, self.operation)()

    def append(self) -> None:
        """A part is stored."""
        self.store.append(rows(f"{self.name} new"))
        self.new = {f"{self.name} new"}

    def gather(self) -> None:
        """A part is stored, and merged with the last one."""
        self.append()
        self.store.gather()

    def compact(self) -> None:
        """A share comes to its end."""
        self.store.compact()

    def begin(self) -> None:
        """A share has its lock."""
        set_aside_damaged(self.store)
        self.store.tidy()

    whole_begin, whole_compact = begin, compact

    def whole_discard(self) -> None:
        """gc deletes a part none of whose trials stay."""
        self.begin()
        first, *_ = self.store.current_parts()
        self.gone = {"merged"}
        self.store.discard(first)

    def look(self) -> None:
        """A table is read."""
        ids = self.store.read("heatmaps")["trial_id"].to_pylist()
        assert sorted(ids) == sorted(set(ids))
        self.read.append(set(ids))


SHARED = ("append", "gather", "compact", "begin")
WHOLE = ("whole_begin", "whole_compact", "whole_discard")
PAIRS = [
    *itertools.combinations_with_replacement(SHARED, 2),
    *itertools.product((*SHARED, *WHOLE), ["look"]),
]
CASES = [(pair, "") for pair in PAIRS]
CASES += [((operation, "begin"), "damaged") for operation in SHARED]
WITHIN_OTHERS = [((operation, "begin"), "") for operation in SHARED]
"""All steps of these are taken also where a part is damaged: once interrupted they run
among the slow tests, and in more orders only where a part is damaged.
"""
FAST_IN_A_FOLDER = [(("append", "gather"), ""), (("compact", "look"), "")]
"""A folder has more steps than an object store, where others are fast too: in a folder
two store at once, and one deletes what another reads.
"""
SLOW_IN_AN_OBJECT_STORE = [
    (("gather", "gather"), ""),
    (("gather", "begin"), "damaged"),
    (("whole_compact", "look"), ""),
]
"""These have most steps. Each of their operations is in others, but for the last one:
of that each request may be the last in `tests/store/test_object_store.py`.
"""
FILES = ["heatmaps.parquet", "manifest.json", "trials.parquet"]
STORED = {"merged", "a old", "b old"}


def fill(place: Location, damaged: str) -> None:
    """Of two shares each has stored a part; a launch was killed before it deleted what
    it had merged.
    """
    store = Store(place)
    TOKENS.name, TOKENS.count = "f", 0
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(store, "discard", lambda _: None)
        store.append(rows("merged", status="failed"))
        store.append(rows("merged"))
        store.compact()
    for TOKENS.name in ("a", "b", *(["d"] if damaged else [])):
        TOKENS.count = 0
        store.append(rows(f"{TOKENS.name} old"))


def check(
    place: Location,
    content: Iterable[tuple[str, bytes]],
    launches: list[Launch],
    damaged: str,
    met: set[int],
) -> None:
    """Nothing is lost or doubled, for those who read meanwhile, at the end, and when
    all is merged. Of `met` ends, each with its `content`, that is known.
    """
    new = {trial for launch in launches for trial in launch.new}
    gone = {trial for launch in launches for trial in launch.gone}
    for launch in launches:
        for read in launch.read:
            assert STORED - gone <= read <= STORED | new
    kept = frozenset(STORED - gone | new)
    end = hash((kept, frozenset(content)))
    if end in met:
        return
    met.add(end)
    for _ in range(2):
        assert Store(place).trial_ids() == dict.fromkeys(kept, "ok")
        last = Launch(place, "c", "whole_compact")
        last.begin()
        last()
    assert len(last.store.all_parts()) == 1
    aside = (
        [*(place / "damaged").iterdir()]
        if (place / "damaged").exists() or isinstance(place, ObjectPath)
        else []
    )
    assert [sorted(file.name for file in part.iterdir()) for part in aside] == (
        [FILES] if damaged else []
    )


def launches_of(place: Location, pair: tuple[str, ...]) -> list[Launch]:
    return [
        Launch(place, name, operation)
        for name, operation in zip("ab", pair, strict=True)
    ]


def in_a_folder(
    pair: tuple[str, ...], damaged: str, folder: Path
) -> Callable[[], World]:
    template = folder / "template"
    numbers = itertools.count()
    met = set[int]()
    left = list[Path]()
    fill(template, damaged)
    for file in template.glob("parts/*-d1/trials.parquet"):
        os.truncate(file, 10)

    def make() -> World:
        # A world whose order was not followed to its end was not checked.
        while left:
            shutil.rmtree(left.pop())
        place = folder / f"{next(numbers)}"
        shutil.copytree(template, place)
        left.append(place)
        _watched[:] = [str(place)]
        launches = launches_of(place, pair)

        def state() -> State:
            return tuple(
                sorted(
                    f"{os.path.relpath(folder, place)}/{name}"
                    for parts in ("parts", "damaged")
                    for folder, _, names in os.walk(place / parts)
                    for name in names
                )
            )

        def checked() -> None:
            files = [file for file in place.rglob("*") if file.is_file()]
            content = {(str(one.relative_to(place)), one.read_bytes()) for one in files}
            check(place, content, launches, damaged, met)

        return World(launches, state, checked)

    return make


def in_an_object_store(
    pair: tuple[str, ...], damaged: str, _: Path
) -> Callable[[], World]:
    server, memory = ObjectServer(), Requests()
    server.known = True
    server.__dict__["files"] = memory
    place = ObjectPath(server, "bucket/study")
    fill(place, damaged)
    for key in memory.objects:
        if key.endswith("-d1/trials.parquet"):
            memory.objects[key] = memory.objects[key][:10]
    template, met = dict(memory.objects), set[int]()

    def make() -> World:
        memory.objects = dict(template)
        launches = launches_of(place, pair)
        return World(
            launches,
            lambda: tuple(sorted(memory.objects)),
            lambda: check(place, memory.objects.items(), launches, damaged, met),
        )

    return make


PLACES = {"folder": in_a_folder, "object store": in_an_object_store}


def named(place: str, case: tuple[tuple[str, ...], str]) -> str:
    pair, damaged = case
    return " ".join([place, *pair, damaged]).strip()


EVERY = {named(*one): one for one in itertools.product(PLACES, CASES)}
FAST = [
    *(named("folder", case) for case in FAST_IN_A_FOLDER),
    *(
        named("object store", case)
        for case in CASES
        if case not in WITHIN_OTHERS + SLOW_IN_AN_OBJECT_STORE
    ),
]


MANY_ORDERS = [
    *(
        named("folder", case)
        for case in (
            *((("gather", other), "") for other in ("gather", "compact")),
            *(
                ((operation, "begin"), "damaged")
                for operation in ("gather", "compact", "begin")
            ),
            (("whole_compact", "look"), ""),
        )
    ),
    *(
        named("object store", case)
        for case in (
            (("gather", "begin"), "damaged"),
            (("begin", "begin"), "damaged"),
            (("whole_compact", "look"), ""),
        )
    ),
]
"""These have hundreds of thousands of states: two interruptions there. Every order of
those in an object store took 55 minutes on 2026-11-29, and lost or doubled nothing.
"""
IN_EVERY_ORDER = [
    named(place, case)
    for place in PLACES
    for case in CASES
    if case not in WITHIN_OTHERS
]


@pytest.fixture(params=slow_but(FAST, EVERY))
def make(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[[], World]:
    place, (pair, damaged) = EVERY[request.param]
    return PLACES[place](pair, damaged, tmp_path)


class Counters:
    """Operations that look at a number and write it, each in its own time; between they
    write what nobody else looks at.
    """

    def __init__(self) -> None:
        self.numbers = {"shared": 0, "first": 0, "second": 0}

    def add(self, own: str) -> None:
        step(Step(["shared"], False, lambda: self.numbers["shared"]))
        seen = self.numbers["shared"]
        for _ in range(3):
            step(Step([own], True, lambda: self.numbers[own]))
            self.numbers[own] += 1
        step(Step(["shared"], True, lambda: self.numbers["shared"]))
        self.numbers["shared"] = seen + 1


def test_orders_that_lead_to_the_same_are_left_out_and_no_state_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where steps on different things commute, fewer worlds are made, and as many
    states are met, lost updates among them.
    """
    ends = list[tuple[int, int]]()
    made = itertools.count()

    def make() -> World:
        world = next(made)
        counters = Counters()
        return World(
            [lambda: counters.add("first"), lambda: counters.add("second")],
            lambda: tuple(counters.numbers.values()),
            lambda: ends.append((world, counters.numbers["shared"])),
        )

    with_sleep = explore(make)
    worlds = next(made)
    assert {total for _, total in ends} == {1, 2}
    monkeypatch.setattr(Step, "commutes_with", lambda *_: False)
    assert explore(make).states == with_sleep.states
    assert next(made) - worlds > 2 * worlds


@pytest.mark.usefixtures("steps")
def test_no_interruption_loses_or_doubles(make: Callable[[], World]) -> None:
    """All orders in which one operation is interrupted once, at any step, by the whole
    of the other.
    """
    assert explore(make, most_switches=1).orders > 1


@pytest.mark.slow
@pytest.mark.usefixtures("steps")
@pytest.mark.parametrize("make", IN_EVERY_ORDER, indirect=True)
def test_no_order_of_steps_loses_or_doubles(
    make: Callable[[], World], request: pytest.FixtureRequest
) -> None:
    """All orders, or where there are too many, all with two interruptions."""
    case = request.node.callspec.params["make"]
    found = explore(make, most_switches=2 if case in MANY_ORDERS else None)
    print(f"{case}: {found.orders:,} orders, {found.states:,} states")
    assert found.orders > 1
