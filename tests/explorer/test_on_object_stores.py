"""The explorer of results in an object store answers what it answers of a folder."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from sweep.errors import StoreError
from sweep.explorer.site import explorer, site_of
from sweep.explorer.watching import Watched
from sweep.store.locations import Location, ObjectPath, location
from sweep.web import messages
from sweep.web.replaying import Replay
from tests.object_stores import ObjectStore, object_store
from tests.studies import SMALL, launched, relaunch

PLACES = ("folder", "processor", "commit")
"""What the origin of a study says of a place and a moment."""


@pytest.fixture(scope="module")
def server() -> Iterator[ObjectStore]:
    with object_store() as started:
        yield started


@pytest.fixture(scope="module")
def results(server: ObjectStore) -> ObjectPath:
    place = location(server.url("explored"))
    assert isinstance(place, ObjectPath)
    launched(SMALL, place)
    return place


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("explored")
    launched(SMALL, place)
    return place


def told(results: Location, question: str, *pairs: tuple[str, str]) -> Any:
    """What the page is told of the study, but for where and when."""
    answer = site_of(Watched(results)).answers[question]([("study", "small"), *pairs])
    for name in ("revision", "command"):
        answer.pop(name, None)
    for name in PLACES:
        answer.get("about", {}).pop(name, None)
    return answer


@pytest.mark.parametrize(
    ("question", "pairs"),
    [
        ("state", []),
        ("points", []),
        ("trials", [("metric", "speed")]),
        ("figure", []),
        ("figure", [("kind", "curves")]),
    ],
)
def test_an_object_store_is_explored_like_a_folder(
    results: ObjectPath, folder: Path, question: str, pairs: list[tuple[str, str]]
) -> None:
    assert told(results, question, *pairs) == told(folder, question, *pairs)


def test_a_trial_of_an_object_store_plays(results: ObjectPath) -> None:
    site = site_of(Watched(results))
    trial = told(results, "trials")["rows"][0]["trial_id"]
    shown = site.stored("small", trial)
    assert isinstance(shown, Replay)
    shown.handle(messages.Seek(4))
    assert (shown.step, shown.status()["replay"]["equal"]) == (4, True)


def test_what_is_launched_into_an_object_store_is_seen(server: ObjectStore) -> None:
    place = location(server.url("growing"))
    launched(SMALL.replace("replicates: 3", "replicates: 2"), place)
    ask = site_of(Watched(place)).answers["state"]
    first = ask([("study", "small")])
    assert ask([("study", "small"), ("seen", first["revision"])]) == {
        "revision": first["revision"],
        "running": [],
    }
    relaunch(SMALL, place)
    more = ask([("study", "small"), ("seen", first["revision"])])
    assert (first["counts"], more["counts"]) == ({"done": 4}, {"done": 6})


def test_the_page_of_an_object_store_begins_with_a_study(
    results: ObjectPath,
) -> None:
    server, address = explorer(results, "small")
    server.socket.close()
    assert address.endswith("#study=small")
    with pytest.raises(StoreError, match="no study has been launched here"):
        explorer(results, "lacking")
    with pytest.raises(StoreError, match="to begin with the list of studies needs"):
        explorer(results, None)
    with pytest.raises(StoreError, match="the list of studies needs a folder"):
        site_of(Watched(results)).answers["studies"]([])
