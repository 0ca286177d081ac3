"""Wrong recordings: one line per mistake, with file and row, all at once."""

from pathlib import Path
from typing import Any

import pytest

from sweep.errors import SpecError
from sweep.recordings.tracks import Tracks
from tests.recordings.tracks import study_of_tracks

GOOD = "id,t,x,y\na,0,1,1\na,0.1,1.1,1\nb,0,2,2\nb,0.1,2,2.1\n"
KINDS = {"columns": {"kind": "k"}}
CASES: dict[str, tuple[str, dict[str, Any], list[str]]] = {
    "a missing column": (
        GOOD.replace("t,", "time,"),
        {},
        ['tracks.csv: unknown column "t". Allowed: id, time, x, y'],
    ),
    "another delimiter": (
        GOOD.replace(",", ";"),
        {},
        ["is the delimiter a semicolon? Then write `delimiter: semicolon`"],
    ),
    "texts": (
        GOOD + 'b,0.2,two,1\nb,0.3,"2,5",1\nb,0.4,inf,1\n',
        {},
        [
            'tracks.csv, line 6: x is "two", which is no number',
            'line 7: x is "2,5", which is no number; write a decimal point',
            "line 8: x is infinite",
        ],
    ),
    "double rows": (
        GOOD + "b,0.1,3,3\n",
        {},
        ['tracks.csv, line 6: individual "b" has two rows with equal times'],
    ),
    "times out of order": (
        GOOD + "b,0,3,3\n",
        {},
        ['line 6: individual "b" has an earlier time than before'],
    ),
    "times beside frames": (
        GOOD + "b,0.25,3,3\n",
        {},
        ['line 6: individual "b" is not at a multiple of time_step (0.1)'],
    ),
    "a jump": (
        GOOD + "b,0.2,300,3\n",
        {"fastest": 10},
        ['line 6: individual "b" moves at 2980 m/s; the largest speed allowed is 10'],
    ),
    "another unit of time": (
        "id,t,x,y\na,0,1,1\na,1000,1,1\na,2000,1,1\n",
        {},
        ["less than 1 % of the positions have a row; check the units"],
    ),
    "one frame": ("id,t,x,y\na,0,1,1\nb,0,1,1\n", {}, ["all rows have equal times"]),
    "no rows": ("id,t,x,y\n", {}, ["the files have no rows"]),
    "a short row": (GOOD + "b,0.2,3\n", {}, ["line 6: 3 values; the header has 4"]),
    "no time": (GOOD + "b,,3,3\n", {}, ["line 6: t is missing"]),
    "no name": (GOOD + ",0.2,3,3\n", {}, ["line 6: id is missing"]),
    "two kinds": (
        "id,t,x,y,k\na,0,1,1,sheep\na,0.1,1,1,dog\n",
        KINDS,
        ['individual a: "dog" and "sheep" are kinds of one individual'],
    ),
    "an individual of two kinds, of which one is read": (
        "id,t,x,y,k\na,0,1,1,sheep\na,0.1,1,1,sheep\na,0.2,1,1,dog\nb,0,1,1,dog\n",
        KINDS | {"kinds": ["sheep"]},
        ['individual a: "dog" and "sheep" are kinds of one individual'],
    ),
    "columns that belong to two individuals": (
        "t,1x,1y,1vx,1vy\n0,1,1,1,1\n0.1,1,1,1,1\n",
        {
            "columns": {"x": "*x", "y": "*y", "vx": "*vx", "vy": "*vy"},
            "velocities": "given",
        },
        ['"1vx" is the column of two individuals'],
    ),
    "a column of individuals beside stars": (
        "t,who,x1,y1\n0,a,1,1\n0.1,a,1,1\n",
        {"columns": {"x": "x*", "y": "y*", "individual": "who"}},
        ["columns with * name the individuals; remove `individual`"],
    ),
    "a kind that no column can have": (
        "id,t,x,y,k\na,0,1,1,Big Sheep\na,0.1,1,1,Big Sheep\n",
        KINDS,
        ['a kind cannot be called "big sheep"'],
    ),
    "a kind that is taken": (
        "id,t,x,y,k\na,0,1,1,working\na,0.1,1,1,working\n",
        KINDS,
        ['a kind cannot be called "working"'],
    ),
    "an unknown kind": (
        "id,t,x,y,k\na,0,1,1,sheep\na,0.1,1,1,sheep\n",
        KINDS | {"kinds": ["sheeps"]},
        ['unknown kind "sheeps"; did you mean "sheep"'],
    ),
    "columns of which one is for all": (
        "t,x1,x2,y\n0,1,1,1\n0.1,1,1,1\n",
        {"columns": {"x": "x*"}},
        ["has one *, or none has; the columns are x*, y"],
    ),
    "no columns of individuals": (
        GOOD,
        {"columns": {"x": "u*", "y": "v*"}},
        ['no column has a name such as "u*"'],
    ),
    "an individual without y": (
        "t,x1,y1,x2\n0,1,1,1\n0.1,1,1,1\n",
        {"columns": {"x": "x*", "y": "y*"}},
        ['"x*" needs the column "y2", which the file does not have'],
    ),
    "text in a column of an individual": (
        "t,x1,y1,x2,y2\n0,1,1,1,1\n0.1,1,1,one,1\n",
        {"columns": {"x": "x*", "y": "y*"}},
        ['line 3, individual 2: x* is "one", which is no number'],
    ),
    "positions beyond the Earth": (
        GOOD.replace("1,1", "100,91", 1).replace("2,2", "-181,2", 1),
        {"coordinates": "degrees"},
        ["line 2: y is 91, beyond 90 degrees", "line 4: x is -181, beyond 180 degrees"],
    ),
    "a window of three frames": (
        GOOD,
        {"smoothing": 0.2},
        ["0.2 is too short for a parabola; allowed: 0, or 0.4 and more"],
    ),
    "smoothing of given velocities": (
        GOOD.replace("t,x,y", "t,x,y,u,v"),
        {"smoothing": 1, "velocities": "given", "columns": {"vx": "u", "vy": "v"}},
        ["smoothing changes positions, not given velocities"],
    ),
    "kinds without a column": (
        GOOD,
        {"kinds": ["sheep"]},
        ["kinds need a column; write `columns: {kind: NAME}`"],
    ),
    "velocities without columns": (
        GOOD,
        {"velocities": "given"},
        ["`velocities: given` needs the columns vx and vy"],
    ),
    "columns without velocities": (
        GOOD,
        {"columns": {"vx": "x"}},
        ["the column vx has no effect with `velocities: central`"],
    ),
    "no files": (GOOD, {"files": ["*.parquet"]}, ['no file matches "*.parquet"']),
    "files of another format": (GOOD, {"files": ["*.txt"]}, ['ends with ".txt"']),
    "several patterns": (
        GOOD,
        {"files": ["*.parquet", "*.csv", "*.txt"]},
        ['no file matches "*.parquet"', 'ends with ".txt"'],
    ),
    "several columns": (
        GOOD,
        {"columns": {"x": "east", "event": "trial"}},
        ['unknown column "east"', 'unknown column "trial"'],
    ),
    "a misspelt key": (GOOD, {"gap": 1}, ['did you mean "gaps"?']),
}


@pytest.mark.parametrize("case", CASES)
def test_each_mistake_of_a_file_is_told_with_its_row(case: str, tmp_path: Path) -> None:
    text, section, messages = CASES[case]
    (tmp_path / "tracks.csv").write_text(text, encoding="utf-8")
    (tmp_path / "notes.txt").write_text(text, encoding="utf-8")
    with pytest.raises(SpecError) as raised:
        study_of_tracks(tmp_path, section)
    for message in messages:
        assert message in str(raised.value)
    assert len(raised.value.mistakes) == len(messages)


def test_only_the_first_rows_with_a_mistake_are_listed(tmp_path: Path) -> None:
    rows = "".join(f"c,{k / 10},x{k},1\n" for k in range(50))
    (tmp_path / "tracks.csv").write_text(GOOD + rows, encoding="utf-8")
    with pytest.raises(SpecError, match="47 more rows: text in place of a number"):
        study_of_tracks(tmp_path)


KEYS: dict[str, tuple[dict[str, Any], str]] = {
    "a model": ({"model": "vicsek1995"}, 'a study with "recording" takes no "model"'),
    "replicates": ({"replicates": 3}, "each event of the recording is a trial"),
    "seeds": ({"seeds": [1]}, "a recording has no random numbers"),
    "a number of boids": ({"fixed": {"n": 4}}, 'the recording gives the value of "n"'),
    "swept steps": (
        {"sweep": {"steps": [4, 5]}},
        'the recording gives the value of "steps"',
    ),
    "noise of sensing": (
        {"fixed": {"position_noise": 1}},
        '"position_noise" has no effect on recorded individuals',
    ),
    "an expression over the number of individuals": (
        {"derive": {"flock_range": "10 / n"}},
        '"n" differs from event to event',
    ),
    "more trials than events": (
        {
            "search": {
                "parameters": {"flock_range": {"uniform": [1, 2]}},
                "objectives": {"speed": {"maximize": "mean"}},
                "budget": 24,
            }
        },
        '"search" adds trials, and each event of a recording is one trial',
    ),
    "periodic borders": (
        {"fixed": {"borders": "torus"}},
        "differences of positions are no velocities at periodic borders",
    ),
    "wind": ({"fixed": {"wind_x": 1}}, '"wind_x" has no effect on recorded'),
}


@pytest.mark.parametrize("case", KEYS)
def test_keys_that_a_recording_excludes(case: str, tmp_path: Path) -> None:
    keys, message = KEYS[case]
    (tmp_path / "tracks.csv").write_text(GOOD, encoding="utf-8")
    with pytest.raises(SpecError, match=message) as raised:
        study_of_tracks(tmp_path, **keys)
    assert raised.value.line > 4  # below the section of the recording


@pytest.mark.parametrize(
    ("record", "message"),
    [
        ({"metrics": ["coverage"]}, 'metric "coverage" needs each individual'),
        ({"heatmaps": True}, "heatmaps need each individual"),
        ({"last_flocks": True}, "last_flocks need each individual"),
    ],
)
def test_counts_of_each_step_need_all_individuals(
    record: dict[str, Any], message: str, tmp_path: Path
) -> None:
    gap = GOOD + "a,0.3,1,1\nb,0.2,2,2\nb,0.3,2,2\n"
    (tmp_path / "tracks.csv").write_text(gap, encoding="utf-8")
    with pytest.raises(SpecError, match=message):
        study_of_tracks(tmp_path, record=record, fixed={"pixel": 1})
    assert study_of_tracks(tmp_path, {"gaps": 0.2}, record=record, fixed={"pixel": 1})


def test_a_metric_with_a_range_needs_its_value(tmp_path: Path) -> None:
    """The usual value is one of models in pixels."""
    (tmp_path / "tracks.csv").write_text(GOOD, encoding="utf-8")
    record = {"metrics": ["flock_count"]}
    with pytest.raises(SpecError, match='needs "flock_range" under "fixed", in m'):
        study_of_tracks(tmp_path, record=record)
    assert study_of_tracks(tmp_path, record=record, fixed={"flock_range": 1})
    assert study_of_tracks(tmp_path, record=record, sweep={"flock_range": [1, 2]})


def test_a_file_that_grows_while_it_is_read_is_an_error(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A new row has no place among the rows that were counted."""
    file = tmp_path / "tracks.csv"
    file.write_text(GOOD, encoding="utf-8")
    count = Tracks.count

    def then_grow(tracks: Tracks) -> None:
        count(tracks)
        file.write_text(f"{GOOD}b,0.2,3,3\n", encoding="utf-8")

    monkeypatch.setattr(Tracks, "count", then_grow)
    with pytest.raises(SpecError, match=r"tracks\.csv: changes while it is read"):
        study_of_tracks(tmp_path)


def test_times_beyond_all_numbers_are_an_error(tmp_path: Path) -> None:
    rows = "id,t,x,y\na,-1e308,1,1\na,1e308,1,1\n"
    (tmp_path / "tracks.csv").write_text(rows, encoding="utf-8")
    with pytest.raises(SpecError, match="check the units of time_step and times"):
        study_of_tracks(tmp_path)


@pytest.mark.parametrize(
    ("metric", "kinds", "message"),
    [
        (
            "dog_distance",
            ["dog", "sheep"],
            "write `kinds: [sheep, dog]`",
        ),
        ("dog_distance", [], "write `kinds: [sheep, dog]`"),
        ("dog_distance", ["sheep"], "needs a model with the kinds sheep, dog"),
        ("herded", ["sheep", "dog"], "needs a model with the state task_time"),
        ("potential", ["sheep", "dog"], "needs a model with a pair potential"),
    ],
)
def test_a_metric_of_a_herd_needs_its_kinds_in_its_order(
    metric: str, kinds: list[str], message: str, tmp_path: Path
) -> None:
    rows = "".join(f"{k},{t / 10},1,1,{k}\n" for k in ("sheep", "dog") for t in (0, 1))
    (tmp_path / "tracks.csv").write_text(f"id,t,x,y,k\n{rows}", encoding="utf-8")
    section = KINDS | ({"kinds": kinds} if kinds else {})
    with pytest.raises(SpecError) as raised:
        study_of_tracks(tmp_path, section, record={"metrics": [metric]})
    assert message in str(raised.value)
    whole = KINDS | {"kinds": ["sheep", "dog"]}
    study_of_tracks(tmp_path, whole, record={"metrics": ["dog_distance"]})
