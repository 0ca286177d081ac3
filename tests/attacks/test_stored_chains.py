"""Links of a stranger's plan, or of a damaged one, begin at the link before them, or
one sentence says where they do not. Nothing runs in a circle.
"""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from sweep.errors import StoreError
from sweep.replays.replaying import replay
from sweep.replays.verifying import verify
from sweep.sharing.content import content_hash
from sweep.tables.stored_study import StoredStudy
from sweep.workers.executors import Serial
from tests.attacks.hostile import give, give_plan
from tests.campaigns.test_chains import CHAINED
from tests.commands import sweep
from tests.studies import launched, relaunch

Rows = list[dict[str, object]]


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("honest")
    launched(CHAINED, folder / "results")
    return folder


@pytest.fixture
def folder(honest: Path, tmp_path: Path) -> Path:
    shutil.copytree(honest, tmp_path, dirs_exist_ok=True)
    return tmp_path


def links(folder: Path) -> Rows:
    """Those of one chain, in its order."""
    plan = pq.read_table(folder / "results" / "small" / "plan.parquet").to_pylist()
    chain = [row for row in plan if row["replicate"] == 1]
    return sorted(
        chain,
        key=lambda row: (
            row["direction"] == "down",
            row["separation_weight"] * (-1 if row["direction"] == "down" else 1),
        ),
    )


def with_parents(folder: Path, parents: dict[object, object]) -> pa.Array:
    """The column of the plan, with the parents of some trials changed."""
    plan = pq.read_table(folder / "results" / "small" / "plan.parquet").to_pylist()
    return pa.array(
        [parents.get(row["trial_id"], row["parent"]) for row in plan], pa.string()
    )


def itself(chain: Rows) -> dict[object, object]:
    return {chain[2]["trial_id"]: chain[2]["trial_id"]}


def a_circle(chain: Rows) -> dict[object, object]:
    return {chain[1]["trial_id"]: chain[3]["trial_id"]}


def a_whole_circle(chain: Rows) -> dict[object, object]:
    return {chain[0]["trial_id"]: chain[-1]["trial_id"]}


def nothing(chain: Rows) -> dict[object, object]:
    return {chain[2]["trial_id"]: "0" * 24}


def none(chain: Rows) -> dict[object, object]:
    return {chain[2]["trial_id"]: None}


def another_point(chain: Rows) -> dict[object, object]:
    return {chain[4]["trial_id"]: chain[0]["trial_id"]}


ENDED = "where trial [0-9a-f]{24} ended"
REQUIRED = ", but its parameters require a beginning"
PARENTS: dict[str, tuple[Callable[[Rows], dict[object, object]], str]] = {
    "itself": (itself, f"begins {ENDED}{REQUIRED} {ENDED}"),
    "a circle": (a_circle, f"begins {ENDED}{REQUIRED} {ENDED}"),
    "a whole circle": (
        a_whole_circle,
        f"begins {ENDED}{REQUIRED} with a new flock",
    ),
    "a trial that is not there": (
        nothing,
        f"begins {ENDED}, which is not in the plan{REQUIRED}",
    ),
    "none": (none, f"begins with a new flock{REQUIRED} {ENDED}"),
    "another point": (another_point, f"begins {ENDED}{REQUIRED} {ENDED}"),
}


@pytest.mark.parametrize("name", PARENTS)
def test_links_that_begin_elsewhere_are_refused(folder: Path, name: str) -> None:
    change, message = PARENTS[name]
    parents = with_parents(folder, change(links(folder)))
    give_plan(folder / "results" / "small", parent=parents)
    said = f"study small: its plan is not what a launch writes: trial .* {message}"
    with pytest.raises(StoreError, match=said):
        StoredStudy("small", folder / "results")


def test_links_of_another_replicate_are_refused(folder: Path) -> None:
    plan = pq.read_table(folder / "results" / "small" / "plan.parquet").to_pylist()
    there = {(row["point"], row["replicate"]): row["trial_id"] for row in plan}
    link = next(row for row in plan if row["parent"] and row["replicate"] == 0)
    before = next(row for row in plan if row["trial_id"] == link["parent"])
    parents = {link["trial_id"]: there[before["point"], 2]}
    give_plan(folder / "results" / "small", parent=with_parents(folder, parents))
    with pytest.raises(StoreError, match=f"begins {ENDED}{REQUIRED} {ENDED}"):
        StoredStudy("small", folder / "results")


def test_a_trial_that_stands_twice_leads_into_no_circle(folder: Path) -> None:
    """Each row of such a plan begins at the row before, and there is a circle."""
    chain = links(folder)
    (first, *_), again = chain, chain[3]
    plan = pq.read_table(folder / "results" / "small" / "plan.parquet").to_pylist()
    trials = [
        first["trial_id"] if row["trial_id"] == again["trial_id"] else row["trial_id"]
        for row in plan
    ]
    give_plan(folder / "results" / "small", trial_id=pa.array(trials))
    with pytest.raises(StoreError, match="launch writes: a trial is listed twice"):
        StoredStudy("small", folder / "results")


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"parent": list(range(18))}, 'column "parent" holds int64, not string'),
        ({"direction": "sideways"}, "the direction of a link differs from its chain"),
        (
            {"separation_weight": ["1"] * 18},
            "column .* has values that are not numbers",
        ),
    ],
)
def test_columns_of_links_hold_what_a_launch_writes(
    folder: Path, columns: dict[str, object], message: str
) -> None:
    arrays = {
        name: pa.array(value) if isinstance(value, list) else value
        for name, value in columns.items()
    }
    give_plan(folder / "results" / "small", **arrays)
    with pytest.raises(StoreError, match=f"launch writes: {message}"):
        StoredStudy("small", folder / "results")


def test_links_without_an_axis_that_is_continued_are_refused(folder: Path) -> None:
    path = folder / "results" / "small" / "plan.parquet"
    plan = pq.read_table(path)
    about = json.loads(plan.schema.metadata[b"boidsweep"])
    del about["continued"]
    about["varied"].remove("direction")
    metadata = {b"boidsweep": json.dumps(about).encode()}
    pq.write_table(plan.replace_schema_metadata(metadata), path)
    with pytest.raises(StoreError, match="links of chains, but no continued axis"):
        StoredStudy("small", folder / "results")


@pytest.mark.parametrize(
    "words",
    [("status", "small"), ("compare", "small:direction=up", "small:direction=down")],
    ids=lambda words: words[0],
)
def test_commands_say_so_in_one_line(folder: Path, words: tuple[str, ...]) -> None:
    """All of them open the study."""
    chain = links(folder)
    give_plan(
        folder / "results" / "small", parent=with_parents(folder, a_circle(chain))
    )
    done = sweep(folder, *words)
    assert done.returncode == 2
    assert "study small: its plan is not what a launch writes: trial" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_launch_writes_the_plan_anew(folder: Path) -> None:
    """It takes parents from the spec and not from the plan."""
    chain = links(folder)
    before = content_hash(StoredStudy("small", folder / "results"))
    give_plan(
        folder / "results" / "small", parent=with_parents(folder, a_whole_circle(chain))
    )
    assert not relaunch(CHAINED, folder / "results").statuses
    assert content_hash(StoredStudy("small", folder / "results")) == before


def test_a_stored_link_that_begins_elsewhere_than_in_the_plan_is_refused(
    folder: Path,
) -> None:
    """Each of them says that it begins at the second link of one chain."""
    second = links(folder)[1]["trial_id"]
    give(folder / "results" / "small", parent=pa.array([second] * 18))
    study = StoredStudy("small", folder / "results")
    found = verify(study, Serial(), fraction=1.0)
    assert len(found.differing) == 17  # the one after the second is as it was
    said = f"begins where trial {second} ended in the table of trials, but"
    assert said in found.as_text()
    with pytest.raises(StoreError, match=said):
        replay(study, str(second))
