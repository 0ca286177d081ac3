"""What commands print for programs is what docs/json.md says, and nothing else."""

import json
import logging
import re
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from kernels.catalogue import BUILT_IN
from kernels.models import MODELS
from sweep.cli import app
from sweep.spec.settings import settings_of
from tests import ROOT
from tests.commands import sweep
from tests.own_models import METRICS
from tests.searches import TINY
from tests.studies import IMPOSSIBLE, SMALL

PAGE = (ROOT / "docs" / "json.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| `(\w+)` \| (.+?) \|", re.MULTILINE)
ALSO = re.compile(r"A search has the same of (.*?), and those", re.DOTALL)


def is_count(value: object) -> bool:
    return type(value) is int


def is_mapping(value: object) -> bool:
    return isinstance(value, dict)


def is_list(value: object) -> bool:
    return isinstance(value, list)


def is_text(value: object) -> bool:
    return isinstance(value, str)


TYPES = {
    "text": is_text,
    "whole number": is_count,
    "number": lambda value: isinstance(value, float),
    "mapping": is_mapping,
    "truth": lambda value: isinstance(value, bool),
    "counts": lambda value: is_mapping(value) and all(map(is_count, value.values())),
    "list of texts": lambda value: is_list(value) and all(map(is_text, value)),
    "list of mappings": lambda value: is_list(value) and all(map(is_mapping, value)),
    "null": lambda value: value is None,
}


def chapters() -> dict[str, dict[str, str]]:
    """The types of the keys by the heading that they stand under."""
    _, *parts = re.split(r"^## ", PAGE, flags=re.MULTILINE)
    return {part.partition("\n")[0]: dict(ROW.findall(part)) for part in parts}


def agree(printed: str, documented: dict[str, str]) -> dict[str, Any]:
    """The object that was printed: it has all keys, and each a value of its type."""
    (line,) = [json.loads(printed)]
    assert line.keys() == documented.keys()
    for key, types in documented.items():
        assert any(TYPES[one](line[key]) for one in types.split(" or ")), key
    return dict(line)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, spec in (("small", SMALL), ("wrong", IMPOSSIBLE), ("search", TINY)):
        (tmp_path / f"{name}.yaml").write_text(spec, encoding="utf-8")
    return tmp_path


def plan_keys(*, search: bool) -> dict[str, str]:
    """Those of a plan: the second table is that of a search."""
    page = PAGE.partition("## sweep plan --json")[2]
    plain, own = map(dict, map(ROW.findall, ALSO.split(page)[::2]))
    shared = re.findall(r"`(\w+)`", ALSO.search(page)[1])  # type: ignore[index]
    return own | {key: plain[key] for key in shared} if search else plain


def test_every_command_with_json_has_a_chapter() -> None:
    commands = get_command(app).commands  # type: ignore[attr-defined]
    printing = [
        name
        for name, one in commands.items()
        if any("--json" in parameter.opts for parameter in one.params)
    ]
    assert {f"sweep {name} --json" for name in printing} == chapters().keys()


def rows_agree(printed: str, chapter: str, settings: str, *metrics: str) -> None:
    """The rows that were printed, whose keys name this setting and these metrics."""
    keys = chapters()[f"sweep {chapter} --json"]
    wanted = {
        key.replace("METRIC", metric).replace("SETTING", settings): types
        for metric in metrics or ("",)
        for key, types in keys.items()
    }
    rows = json.loads(printed)
    assert rows
    for row in rows:
        agree(json.dumps(row), wanted)


def test_tables_of_what_is_stored(folder: Path) -> None:
    spec = SMALL.replace("replicates: 3", "replicates: 6")
    (folder / "small.yaml").write_text(spec, encoding="utf-8")
    sweep(folder, "launch", "small.yaml", "--quiet")
    axis, asked = "separation_weight", ("--json", "--metric", "speed")
    plain = json.loads(sweep(folder, "table", "small", *asked).stdout)
    rows = [row | {"points": 1} for row in plain]  # where a row has several
    rows_agree(json.dumps(rows), "table", axis, "speed")
    said = sweep(folder, "power", "small", "--half-width", "speed=5%", "--json").stdout
    rows_agree(said, "power", axis)
    rows_agree(sweep(folder, "columns", "small", "--json").stdout, "columns", "")
    sides = (f"small:{axis}=0.5", f"small:{axis}=1")
    compared = sweep(folder, "compare", *sides, *asked, "--margin", "1").stdout
    found = agree(compared, chapters()["sweep compare --json"])
    page = PAGE.partition("## sweep compare --json")[2].partition("\n## ")[0]
    named = set(re.findall(r"`(\w+)`", page))
    told = {key.removesuffix("_b") for key in found["rows"][0]} | found["a"].keys()
    ends = {f"{name}{end}" for name in named for end in ("_low", "_high")}
    short = {name.removesuffix("_a") for name in named}
    assert told <= named | ends | short
    assert found["method"].keys() <= named


def test_a_registration_and_its_check(folder: Path) -> None:
    """The rows below the second heading are those of a fact."""
    page = PAGE.partition("## sweep register --json")[2].partition("\n## ")[0]
    whole, of_fact = (dict(ROW.findall(part)) for part in page.split("A fact has"))
    done = sweep(folder, "register", "small.yaml", "--json").stdout
    facts = agree(done, whole)["facts"]
    sweep(folder, "launch", "small.yaml", "--quiet")
    file = "small-registration.yaml"
    checked = sweep(folder, "register", "small", "--check", file, "--json").stdout
    facts += agree(checked, whole)["facts"]
    for fact in facts:
        agree(json.dumps(fact), of_fact)


def test_a_search_and_its_report(folder: Path) -> None:
    done = sweep(folder, "search", "search.yaml", "--json", "--quiet")
    agree(done.stdout, chapters()["sweep search --json"])


def test_what_a_change_of_a_spec_would_do(folder: Path) -> None:
    sweep(folder, "launch", "small.yaml", "--quiet")
    other = SMALL.replace("[0.5, 1]", "[0.5, 2]")
    (folder / "small.yaml").write_text(other, encoding="utf-8")
    said = sweep(folder, "diff", "small.yaml", "--json").stdout
    found = agree(said, chapters()["sweep diff --json"])
    assert found["changes"][0].keys() == {"key", "before", "after"}
    assert found["points"].keys() == {"added", "kept", "dropped"}


def test_a_check(folder: Path) -> None:
    (folder / "mine.py").write_text(METRICS, encoding="utf-8")
    rows_agree(sweep(folder, "check", "mine.py", "--json").stdout, "check", "")


def test_a_plan(folder: Path) -> None:
    keys = plan_keys(search=False)
    plan = agree(sweep(folder, "plan", "small.yaml", "--json").stdout, keys)
    assert (plan["points"], plan["trials"], plan["until"]) == (2, 6, None)


def test_the_plan_of_a_search(folder: Path) -> None:
    agree(sweep(folder, "plan", "search.yaml", "--json").stdout, plan_keys(search=True))


def test_a_launch_and_its_status(folder: Path) -> None:
    keys = chapters()
    done = sweep(folder, "launch", "small.yaml", "--json", "--quiet")
    assert (done.returncode, done.stderr) == (0, "")
    launched = agree(done.stdout, keys["sweep launch --json"])
    assert (launched["new"], launched["stored"]) == ({"done": 6}, 0)
    again = sweep(folder, "launch", "small.yaml", "--json", "--shard", "1/2")
    assert json.loads(again.stdout)["share"] == "1/2"
    assert "nothing was missing" in again.stderr
    said = sweep(folder, "status", "small", "--json", "--quiet")
    status = agree(said.stdout, keys["sweep status --json"])
    assert status["folder"] == launched["folder"]
    assert (status["statuses"], status["causes"]) == ({"done": 6}, [])
    asked = ("measure", "small", "quick = speed + speed", "--json", "--quiet")
    measured = agree(sweep(folder, *asked).stdout, keys["sweep measure --json"])
    assert (measured["metrics"], measured["measured"]) == (["quick"], 6)


def test_a_boundary(folder: Path) -> None:
    spec = SMALL.replace("[0.5, 1]", "[0, 2]").replace("small", "refined")
    rule = "{metric: speed, at: 3, axes: [separation_weight], until: 0.5, budget: 20}"
    (folder / "refined.yaml").write_text(f"{spec}refine: {rule}\n")
    assert sweep(folder, "launch", "refined.yaml").returncode == 0
    run = sweep(folder, "boundary", "refined", "--json")
    said = agree(run.stdout, chapters()["sweep boundary --json"])
    text = sweep(folder, "boundary", "refined").stdout
    assert "mean speed = 3" in text
    crossings = said["crossings"]
    assert text.count(" yes ") == sum(one["resolved"] for one in crossings)
    assert text.count(" no ") == sum(not one["resolved"] for one in crossings)
    table = sweep(folder, "boundary", "refined", "--csv").stdout
    assert table.startswith("estimate,low,high")


def test_a_posterior(folder: Path) -> None:
    axis = "prior: {sample: random, points: 60, separation_weight: {uniform: [0, 2]}}"
    spec = SMALL.replace("study: small", "study: fit")
    spec = spec.replace("separation_weight: [0.5, 1]", axis)
    spec = spec.replace("replicates: 3", "replicates: 1")
    rule = (
        '{to: "small:separation_weight=1", summaries: [speed], population: 50,'
        " generations: 1, checks: 1}"
    )
    (folder / "fit.yaml").write_text(f"{spec}calibrate: {rule}\n")
    (folder / "small.yaml").write_text(SMALL)
    assert sweep(folder, "launch", "small.yaml").returncode == 0
    assert sweep(folder, "launch", "fit.yaml").returncode == 0
    run = sweep(folder, "posterior", "fit", "--json")
    said = agree(run.stdout, chapters()["sweep posterior --json"])
    assert said["checked"]
    text = sweep(folder, "posterior", "fit").stdout
    assert "(3 trials), checked below" in text
    table = sweep(folder, "posterior", "fit", "--csv").stdout
    assert table.startswith("weight,distance,generation,separation_weight")
    assert table.count("\n") == 51
    table = sweep(folder, "posterior", "fit", "--every", "--csv").stdout
    assert table.startswith("distance,generation,separation_weight")
    assert table.count("\n") == 1 + 60 + 50
    spec = spec.replace("[0, 2]", "[0, 3]").replace("study: fit", "study: other")
    (folder / "other.yaml").write_text(f"{spec}calibrate: {rule}\n")
    assert sweep(folder, "launch", "other.yaml").returncode == 0
    run = sweep(folder, "odds", "fit", "other", "--json")
    said = agree(run.stdout, chapters()["sweep odds --json"])
    assert sum(row["probability"] for row in said["models"]) == pytest.approx(1.0)
    table = sweep(folder, "odds", "fit", "other", "--csv").stdout
    assert table.count("\n") == 3


def test_a_loop(folder: Path) -> None:
    axis = "{values: [0.5, 1], continue: both, hold: 9}"
    spec = SMALL.replace("[0.5, 1]", axis).replace("n: 12, steps: 9", "n: 12")
    (folder / "chained.yaml").write_text(spec.replace("study: small", "study: chained"))
    assert sweep(folder, "launch", "chained.yaml").returncode == 0
    run = sweep(folder, "hysteresis", "chained", "--json")
    agree(run.stdout, chapters()["sweep hysteresis --json"])
    assert "loops over" in sweep(folder, "hysteresis", "chained").stdout
    table = sweep(folder, "hysteresis", "chained", "--csv").stdout
    assert table.startswith("metric,area,low,high,chains")


def test_the_reality_gap(folder: Path) -> None:
    realities = "realities: {packet_loss: {uniform: [0, 1]}, draws: 30}\n"
    (folder / "small.yaml").write_text(SMALL + realities)
    assert sweep(folder, "launch", "small.yaml").returncode == 0
    run = sweep(folder, "gap", "small", "--json")
    said = agree(run.stdout, chapters()["sweep gap --json"])
    assert [len(said[key]) for key in ("controllers", "pairs")] == [2, 1]
    assert said["controllers"][0]["indices"][0]["parameter"] == "packet_loss"


def test_the_resilience(folder: Path) -> None:
    axis = "failing_share: [0, 0.5]"
    spec = SMALL.replace("separation_weight: [0.5, 1]", axis).replace("small", "failed")
    (folder / "failed.yaml").write_text(spec)
    assert sweep(folder, "launch", "failed.yaml").returncode == 0
    run = sweep(folder, "resilience", "failed", "--json")
    agree(run.stdout, chapters()["sweep resilience --json"])
    assert json.loads(run.stdout)["unit_of_time"] == "step"
    printed = sweep(folder, "resilience", "failed").stdout
    assert "failed: resilience" in printed
    assert "time (step)" in printed
    table = sweep(folder, "resilience", "failed", "--csv").stdout
    assert table.startswith("failing_share,metric,kept,kept_low,kept_high")


def test_the_validity_of_conclusions(folder: Path) -> None:
    spec = SMALL.replace("study: small", "study: held")
    asked = "validate: {dt: [1/2], search: all_pairs, update: both}\n"
    (folder / "held.yaml").write_text(spec + asked)
    planned = sweep(folder, "plan", "held.yaml").stdout
    assert planned.count("trials     6 (3 per point)") == 4
    assert sweep(folder, "launch", "held.yaml").returncode == 0
    run = sweep(folder, "validity", "held", "--json")
    found = agree(run.stdout, chapters()["sweep validity --json"])
    assert [one["same_bits"] for one in found["variants"]] == [None, 6, None]
    text = sweep(folder, "validity", "held").stdout
    assert "all pairs: 6 of 6 trials bitwise identical" in text
    assert "6 conclusions: not decided 6" in text
    table = sweep(folder, "validity", "held", "--csv").stdout
    assert table.startswith("metric,unit,axis,separation_weight,against,variant")


def test_the_studies_that_there_are(folder: Path) -> None:
    keys = chapters()["sweep list --json"]
    sweep(folder, "launch", "small.yaml", "--quiet")
    (folder / "results" / "damaged").mkdir()
    (folder / "results" / "damaged" / "plan.parquet").write_bytes(b"no parquet")
    listed = json.loads(sweep(folder, "list", "--json").stdout)
    damaged, small = (agree(json.dumps(one), keys) for one in listed)
    assert (small["study"], small["trials"], small["error"]) == ("small", 6, "")
    assert {key for key, value in damaged.items() if value is not None} == {
        "study",
        "error",
    }


def test_the_models_and_what_can_differ_from_robot_to_robot(folder: Path) -> None:
    """A spec may name each of these spreads, and no other."""
    keys = chapters()["sweep models --json"]
    listed = json.loads(sweep(folder, "models", "--json").stdout)
    found = {one["model"]: agree(json.dumps(one), keys) for one in listed}
    assert list(found) == list(MODELS)
    assert (
        agree(sweep(folder, "models", "vicsek1995", "--json").stdout, keys)
        == (found["vicsek1995"])
    )
    for name, model in found.items():
        settings = settings_of(name, BUILT_IN)
        assert [one["name"] for one in model["settings"]] == list(settings)
        assert model["spreads"] == list(settings.spreads)
        for one in model["settings"]:
            spread = f"{one['name']}_spread"
            named = spread in settings.of_study(())
            assert one["spread"] == (spread if named else None)
            assert one["values"].keys() == set(model["presets"])
    vicsek = {one["name"]: one for one in found["vicsek1995"]["settings"]}
    assert vicsek["max_speed"]["spread"] == "max_speed_spread"
    assert vicsek["dt"]["spread"] is None
    assert vicsek["radio_range"]["values"] == dict.fromkeys(
        found["vicsek1995"]["presets"], "inf"
    )


def test_what_to_cite(folder: Path) -> None:
    keys = chapters()["sweep cite --json"]
    sweep(folder, "launch", "small.yaml", "--quiet")
    works = json.loads(sweep(folder, "cite", "small", "--json").stdout)
    assert [work["type"] for work in works] == ["software", "report", "dataset"]
    for work in works:
        said = {key: types for key, types in keys.items() if key in work}
        agree(json.dumps(work), said)
    assert {key for work in works for key in work} == keys.keys()


def test_failed_trials(folder: Path) -> None:
    """One cause is said once, with its trials."""
    done = sweep(folder, "launch", "wrong.yaml", "--json", "--quiet")
    assert (done.returncode, done.stderr) == (1, "")
    assert json.loads(done.stdout)["new"] == {"failed": 6}
    said = sweep(folder, "status", "small", "--json").stdout
    status = agree(said, chapters()["sweep status --json"])
    (cause,) = status["causes"]
    assert [(key, type(value)) for key, value in cause.items()] == [
        ("status", str),
        ("trials", int),
        ("cause", str),
        ("first", str),
    ]
    assert (cause["status"], cause["trials"]) == ("failed", 6)
    assert "no free place for a boid" in cause["cause"]
    text = sweep(folder, "status", "small").stdout
    assert text.count("no free place") == 1
    assert f"failed: {cause['cause']} (6 trials)\n" in text
    assert f"sweep replay small {cause['first']}" in text


def test_quiet_leaves_errors(folder: Path) -> None:
    """And the next command is as loud as ever."""
    done = sweep(folder, "launch", "small.yml", "--quiet", "--json")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "small.yml: no such file\n"
    assert logging.getLogger("sweep").isEnabledFor(logging.WARNING)
    assert "6 new trials" in sweep(folder, "launch", "small.yaml").stderr
    loud = sweep(folder, "launch", "wrong.yaml", "--results", "other")
    assert "small: 6 new trials (6 failed)" in loud.stderr
    assert loud.stdout == ""
