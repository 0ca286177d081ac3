"""Variants: which verdicts they turn, and what the page says of it."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

from kernels.catalogue import BUILT_IN
from sweep.cli.progress import ProgressBar
from sweep.errors import SpecError, StoreError
from sweep.published.clocks import converted
from sweep.published.details import details, moved
from sweep.published.publications import read_all
from sweep.published.reproducing import reproduce
from sweep.published.trying import chosen_variants, most_trials, try_all
from sweep.published.turned import (
    DocumentVariants,
    Estimated,
    Turned,
    read_turned,
)
from sweep.published.variants import Kind, Variant
from sweep.published.verdicts import Status
from sweep.spec.recorded import columns_of
from sweep.spec.settings import Setting, preset_settings
from sweep.spec.strict_yaml import parse_document
from sweep.tables.stored_study import StoredStudy
from sweep.workers.executors import Serial
from tests.commands import sweep
from tests.publications import FIGURES, PUBLISHED, SPEC, experiments

MUTANTS = """
  - id: some-speed
    where: "Figure 2"
    says: "boids fly"
    kind: reading
    registered: 2024-03-01
    spec: small
    measure: {mean: speed, frame: 0, for: {separation_weight: 1}}
    expect: {above: 0.1}
    looked: before
  - id: fitted-speed
    where: "Figure 2"
    says: "boids fly fast"
    kind: fit
    registered: 2024-03-01
    spec: small
    measure: {mean: speed, frame: 0, for: {separation_weight: 1}}
    expect: {below: 1}
    looked: before
mutants:
  fast: {about: "boids start at speed 3", change: {all: {preset: as_written,
    fixed.start_velocities: components}}}
  heavy: {about: "drag counts double", change: {small: {fixed.drag: 0.2}}}
contradictions:"""
NO_ROOM = "{small: {fixed.n_obstacles: 1, fixed.obstacle_radius: 5000,\
  fixed.start_free: true}}"
TURNED = PUBLISHED.replace("\ncontradictions:", MUTANTS).replace(
    "{replicates: 3,", "{replicates: 6,"
)

SLOW = TURNED.replace("{above: 0.1}", "{below: 0.83}")
LAST = FIGURES.replace(
    "def two_groups",
    """def last_speeds(studies):
    series = studies["small"].series
    return series[series["frame"] == 4]["speed"].to_numpy()


def two_groups""",
)
FRAMES = TURNED.replace(
    "{mean: speed, frame: 0, for: {separation_weight: 1}}\n    expect: {above: 0.1}",
    "{mean: speed, frames: [2, 4], for: {separation_weight: 1}}\n"
    "    expect: {above: 0.1}",
).replace(
    "  - id: fitted-speed",
    """  - id: counting
    where: "Figure 2"
    says: "there are boids"
    kind: reading
    registered: 2024-03-01
    spec: small
    measure: {call: last_speeds, distribution: normal}
    expect: {above: 0.1}
    looked: before
  - id: fitted-speed""",
)


@pytest.fixture(autouse=True)
def _without_mutants_of_the_program(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each would start a copy of the program: test_program_mutants.py tries some."""
    for module in ("variants", "scorecard"):
        monkeypatch.setattr(f"sweep.published.{module}.PROGRAM_MUTANTS", {})


@pytest.fixture(autouse=True)
def _with_blank_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is in them is tested in test_forest.py and test_numerics_figure.py."""
    for picture in ("forest_figure", "numerics_figure"):
        name = f"sweep.published.drawings.{picture}"
        monkeypatch.setattr(name, lambda *_: Figure((1, 1)))


def variants(
    folder: Path,
    kind: Kind,
    published: str = TURNED,
    spec: str = SPEC,
    named: tuple[str, ...] = (),
) -> dict[str, Variant]:
    """The variants of the tiny publication, by name."""
    publications = read_all(experiments(folder, published, spec, LAST), quick=True)
    [(_, found)] = chosen_variants(publications, kind, named)
    return {one.name: one for one in found}


def tried(
    folder: Path,
    published: str = TURNED,
    kind: Kind = "mutants",
    named: tuple[str, ...] = (),
) -> DocumentVariants:
    """What variants of the tiny publication turn."""
    publications = read_all(experiments(folder, published, figures=LAST), quick=True)
    chosen = chosen_variants(publications, kind, named)
    return try_all(chosen, folder / "results", Serial(), ProgressBar)["tiny"]


def rows(folder: Path, published: str = TURNED) -> dict[str, dict[str, Any]]:
    """The rows of the page for machines at the full scale, by id."""
    publications = read_all(experiments(folder, published, figures=LAST), quick=False)
    reproduce(publications, folder / "results", Serial(), ProgressBar)
    found = json.loads((folder / "results" / "scorecard.json").read_text())
    return {row["id"]: row for row in found["rows"]}


def test_a_mutant_is_killed_by_what_is_no_longer_confirmed(tmp_path: Path) -> None:
    """At speed 3 the number is refuted and "above 0.1" still holds. Drag changes no
    start. The fit is turned too, and does not count.
    """
    found = tried(tmp_path)
    assert found.confirmed == ["start-speed", "some-speed"]
    assert found.killed_by == {"fast": ["start-speed"], "heavy": []}
    assert found.noticed == 1
    assert found.summary("mutants") == (
        "1 of 2 mutants are detected; 1 of 2 confirmed claims detect a mutant;"
        " not detected: heavy (changes no number)"
    )
    assert read_turned(tmp_path / "results") == {"tiny": found}


def test_mutants_are_stored_apart_with_the_same_random_numbers(tmp_path: Path) -> None:
    tried(tmp_path)
    results = tmp_path / "results"
    assert sorted(path.name for path in results.iterdir()) == [
        "mutants",
        "quick",
        "variants.json",
    ]
    right, wrong = (
        StoredStudy(f"{where}/tiny/small", results).trials
        for where in ("quick", "mutants/heavy")
    )
    assert (list(right["drag"].unique()), list(wrong["drag"].unique())) == (
        [0.1],
        [0.2],
    )
    assert list(right["seed"]) == list(wrong["seed"])


def test_a_confirmed_claim_that_no_mutant_turns_is_weak(tmp_path: Path) -> None:
    assert rows(tmp_path)["some-speed"]["mutants"] is None
    tried(tmp_path)
    found = rows(tmp_path)
    assert (found["start-speed"]["mutants"], found["start-speed"]["weak"]) == (
        ["fast"],
        False,
    )
    assert (found["some-speed"]["mutants"], found["some-speed"]["weaknesses"]) == (
        [],
        ["no mutant changes the verdict"],
    )
    assert found["fitted-speed"]["weak"] is False
    results = tmp_path / "results"
    for name in ("scorecard.html", "scorecard.md"):
        text = (results / name).read_text(encoding="utf-8")
        assert text.count("weak: no mutant changes the verdict") == 1
        assert "1 of 2 mutants are detected" in text
    about = json.loads((results / "scorecard.json").read_text())["documents"][0]
    assert about["mutants"]["killed_by"] == {"fast": ["start-speed"], "heavy": []}


def test_mutants_of_other_claims_say_nothing(tmp_path: Path) -> None:
    """They were tried against claims that stand there no more."""
    tried(tmp_path)
    assert rows(tmp_path)["some-speed"]["mutants"] == []
    changed = TURNED.replace("{above: 0.1}", "{above: 0.7}")
    assert rows(tmp_path, changed)["some-speed"]["mutants"] is None


def test_a_mutant_without_the_trials_of_a_measure_is_an_error(tmp_path: Path) -> None:
    """It would turn the claim for nothing. Nothing is run before it is said."""
    lacking = TURNED.replace(
        "{small: {fixed.drag: 0.2}}", "{small: {sweep.separation_weight: [0.5, 2]}}"
    )
    with pytest.raises(SpecError) as caught:
        tried(tmp_path, lacking)
    for line in str(caught.value).splitlines():
        assert line.startswith("tiny/published.yaml:")
        assert line.endswith("0.5, 2, as the mutant heavy")
    assert not (tmp_path / "results").exists()


def test_a_mutant_whose_trials_fail_is_not_noticed(tmp_path: Path) -> None:
    """No place is free for its boids, which says nothing about the claims."""
    failing = TURNED.replace("{small: {fixed.drag: 0.2}}", NO_ROOM)
    found = tried(tmp_path, failing, named=("heavy",))
    assert found.killed_by == {"heavy": []}


@pytest.mark.parametrize(
    "content",
    [b"", b"[]", b"{}", b'{"version": 1, "documents": {"tiny": {}}}', b"[" * 100_000],
)
def test_a_damaged_file_of_variants_is_one_line(tmp_path: Path, content: bytes) -> None:
    results = tmp_path / "results"
    results.mkdir()
    (results / "variants.json").write_bytes(content)
    with pytest.raises(StoreError, match=r"variants.json: .*; delete the file and"):
        read_turned(results)


def test_variants_of_0_9_have_no_estimates(tmp_path: Path) -> None:
    """They are read; what stands in the place of estimates and is none is not."""
    one: dict[str, Any] = {"about": "x", "share": None, "turned": {}, "unjudged": {}}
    empty = {"mutants": {}, "details": {}, "numerics": {"seed-other": one}}
    tiny: dict[str, Any] = {"inputs": "", "before": {"a": "confirmed"}, **empty}
    file = tmp_path / "variants.json"
    file.write_text(json.dumps({"version": 1, "documents": {"tiny": tiny}}))
    found = read_turned(tmp_path)["tiny"]
    assert (found.estimates, found.tried("numerics")["seed-other"].estimates) == (
        {},
        {},
    )
    for place in (tiny, one):
        place["estimates"] = {"a": {"ours": 1.0, "low": "0", "high": 2.0, "trials": 3}}
        file.write_text(json.dumps({"version": 1, "documents": {"tiny": tiny}}))
        with pytest.raises(StoreError, match=r"the estimates .*; delete the file"):
            read_turned(tmp_path)
        del place["estimates"]


def test_what_is_not_noticed_says_what_it_changes() -> None:
    """One changes no number, one a number, and one a verdict that is not confirmed."""
    one: Estimated = {"ours": 1.0, "low": 0.5, "high": 1.5, "trials": 3}
    wide: Estimated = {**one, "high": 2.5}
    before: dict[str, Status] = {"sure": "confirmed", "open": "undecided"}
    now: dict[str, Status] = {"open": "confirmed"}
    estimates = {"sure": one, "open": wide}
    tried = {
        "nothing": Turned("x", None, {}, {}, estimates),
        "little": Turned("x", None, {}, {}, {"sure": wide, "open": wide}),
        "open": Turned("x", None, now, {}, {"sure": one, "open": one}),
    }
    found = DocumentVariants("", before, {"mutants": tried}, estimates)
    assert found.unmoved == ["nothing"]
    assert found.summary("mutants") == (
        "0 of 3 mutants are detected; 0 of 1 confirmed claims detect a mutant; not"
        " detected: nothing (changes no number), little, open (changes 1 other claim)"
    )


@pytest.mark.slow
def test_the_command_says_which_mutants_are_noticed(tmp_path: Path) -> None:
    experiments(tmp_path, TURNED)
    own = ("--variant", "fast", "--variant", "heavy")
    done = sweep(tmp_path, "reproduce", "--workers", "1", "--scale", "mutants", *own)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("tiny: 1 of 2 mutants are detected;")
    assert (tmp_path / "results" / "variants.json").is_file()


def test_each_number_is_moved_by_its_shares(tmp_path: Path) -> None:
    """Up and down, from the value of the preset or of `fixed`. What is varied, is 0 or
    cannot be moved stays; whole numbers move by 1 at least, and once each.
    """
    found = variants(
        tmp_path, "details", named=("n-*", "steps-*", "drag-*", "s*", "f*")
    )
    small = {
        name: one.publication.studies["small"]
        for name, one in found.items()
        if name.startswith(("n-", "steps-", "drag-", "separation_weight-", "fov-"))
    }
    values = {
        name: {key: study.fixed[key] for key in ("n", "steps", "drag")}
        for name, study in small.items()
        if name.startswith("drag-") and "-of-" not in name
    }
    assert values == {
        name: {"n": 40, "steps": 4, "drag": value}
        for name, value in {
            "drag-up-2": pytest.approx(0.102),
            "drag-down-2": 0.098,
            "drag-up-10": pytest.approx(0.11),
            "drag-down-10": 0.09,
        }.items()
    }
    assert {
        name: one.fixed["n"] for name, one in small.items() if name.startswith("n-")
    } == {"n-up-2": 41, "n-down-2": 39, "n-up-10": 44, "n-down-10": 36}
    steps = [name for name in small if name.startswith("steps-")]
    assert steps == ["steps-up-2", "steps-down-2"]
    assert (found["n-up-2"].description, found["n-up-2"].share) == ("n 40 to 41", 0.025)
    assert found["drag-down-10"].share == 0.1
    assert not any("separation_weight" in name for name in found)
    assert len({one.publication.studies["small"].name for one in found.values()}) == (
        len(found)
    )


@pytest.mark.parametrize(
    ("kind", "value", "percent", "new"),
    [
        ("int", 200, 2, 204),
        ("int", 149, 2, 151),
        ("int", 3, -10, 2),
        ("int", 1, -2, 1),
        ("int", 0, 10, 0),
        ("float", 95.0, 10, 100.0),
        ("float", 100.0, 2, 100.0),
        ("float", 0.0, -2, 0.0),
        ("float", 50.0, -10, 45.0),
    ],
)
def test_a_number_stays_within_its_bounds(
    kind: str, value: float, percent: int, new: float
) -> None:
    high = 100.0 if kind == "float" else 10_000
    setting = Setting("one", kind, "parameters", "a number", low=1, high=high)
    if value == 0:
        setting = replace(setting, low=0)
    assert moved(setting, value, percent) == new


@pytest.mark.slow
def test_details_of_other_presets_are_tried_one_by_one(tmp_path: Path) -> None:
    """What the spec gives stays as given, and so do numbers that a share moves so."""
    found = variants(tmp_path, "details", named=("*-of-*",))
    preset = preset_settings("nguyen2024", "as_run", BUILT_IN)
    other = preset_settings("nguyen2024", "as_written", BUILT_IN)
    given = {"n", "steps", "separation_weight"}
    differing = {name for name in preset if preset[name] != other[name]} - given
    alone = {
        name: one for name, one in found.items() if name.endswith("-of-as_written")
    }
    assert set(alone) == {f"{name}-of-as_written" for name in differing}
    for name, one in alone.items():
        setting = name.removesuffix("-of-as_written")
        small = one.publication.studies["small"]
        assert small.fixed == {"n": 40, "steps": 4, setting: other[setting]}
        assert one.share is None


def test_a_setting_that_a_spec_gives_is_no_detail_of_a_preset(tmp_path: Path) -> None:
    spec = SPEC.replace("steps: 6", "steps: 6, drag: 0.1")
    [publication] = read_all(experiments(tmp_path, TURNED, spec), quick=True)
    found = details(publication)
    assert "drag-up-10" in found
    assert "start_speed-of-as_written" in found
    assert "drag-of-as_written" not in found


def test_only_a_slight_change_is_called_so() -> None:
    found = {
        "n-up-2": Turned("n 50 to 51", 0.02, {"one": "undecided"}, {}),
        "n-up-10": Turned("n 50 to 55", 0.1, {"other": "undecided"}, {}),
        "drag-of-as_run": Turned("drag 0 to 1", None, {"third": "refuted"}, {}),
    }
    before: dict[str, Status] = dict.fromkeys(("one", "other", "third"), "confirmed")
    document = DocumentVariants("", before, {"details": found})
    assert document.summary("details") == (
        "3 of 3 verdicts change with one of 3 details, 1 of them with a change of 2 %"
    )
    shares = [document.least_share(name) for name in before]
    assert shares == [0.02, 0.1, None]


def test_a_detail_says_which_verdicts_it_turns(tmp_path: Path) -> None:
    """The start speed is proportional to its setting. Its interval ends at 0.823,
    so that with 2 % more it is no longer below 0.83. Cohesion changes no start.
    """
    names = ("start_speed-*", "cohesion_weight-up-2")
    assert rows(tmp_path, SLOW)["some-speed"]["least_share"] is None
    found = tried(tmp_path, SLOW, "details", names)
    assert found.before == {"start-speed": "confirmed", "some-speed": "confirmed"}
    turned = {name: one.turned for name, one in found.tried("details").items()}
    assert turned == {
        "start_speed-up-2": {"some-speed": "undecided"},
        "start_speed-down-2": {},
        "start_speed-up-10": {"some-speed": "undecided"},
        "start_speed-down-10": {},
        "start_speed-of-as_written": {
            "start-speed": "refuted",
            "some-speed": "refuted",
        },
        "cohesion_weight-up-2": {},
    }
    assert found.summary("details") == (
        "2 of 2 verdicts change with one of 6 details, 1 of them with a change of 2 %"
    )
    row = rows(tmp_path, SLOW)["some-speed"]
    assert list(row["details"]) == [
        "start_speed-up-2",
        "start_speed-up-10",
        "start_speed-of-as_written",
    ]
    assert (row["least_share"], row["numerics"], row["mutants"]) == (0.02, None, None)
    for name in ("scorecard.html", "scorecard.md"):
        text = (tmp_path / "results" / name).read_text(encoding="utf-8")
        plain = re.sub(r"\\(.)", r"\1", text)
        assert plain.count("a change of 2 % changes the verdict") == 1
        assert "details: start_speed-up-2 (undecided), start_speed-up-10" in plain
        assert "tiny: 2 of 2 verdicts change with one of 6 details" in plain


@pytest.mark.slow
def test_kinds_are_stored_beside_each_other(tmp_path: Path) -> None:
    """A later kind, and a later variant of a kind, leave what is there. What was tried
    with other claims goes.
    """
    tried(tmp_path)
    tried(tmp_path, kind="details", named=("n-up-2",))
    both = tried(tmp_path, kind="details", named=("n-down-2",))
    assert set(both.tried("mutants")) == {"fast", "heavy"}
    assert set(both.tried("details")) == {"n-up-2", "n-down-2"}
    other = tried(tmp_path, SLOW, "details", ("n-up-10",))
    assert {kind: set(found) for kind, found in other.kinds.items()} == {
        "details": {"n-up-10"}
    }


def test_a_part_of_the_mutants_marks_nothing_weak(tmp_path: Path) -> None:
    tried(tmp_path, named=("heavy",))
    row = rows(tmp_path)["start-speed"]
    assert (row["mutants"], row["weaknesses"]) == (None, [])


def test_half_a_time_step_keeps_the_times_of_frames(tmp_path: Path) -> None:
    """Claims stay as they are: its studies are told in the steps of the original."""
    folder = experiments(tmp_path, FRAMES, figures=LAST)
    original = read_all(folder, quick=True)[0]
    half = variants(tmp_path, "numerics", FRAMES)["dt-half"].publication
    small = half.studies["small"]
    assert {name: small.fixed[name] for name in ("dt", "steps")} == {
        "dt": 0.5,
        "steps": 8,
    }
    before = original.studies["small"].preset_settings["equilibrium_steps"]
    assert small.fixed["equilibrium_steps"] == 2 * before
    assert (small.record.every, small.record.series) == (4, ("speed", "dispersion"))
    assert half.claims == [claim for claim in original.claims if claim.counted]
    assert half.clocks == {"small": 2}
    values = small.preset_settings | small.fixed
    assert (1 - float(values["drag"])) ** 2 == pytest.approx(0.9, rel=1e-14)
    assert values["wander_range"] == pytest.approx(0.2 * 2**0.5, rel=1e-15)


def test_numerics_are_judged_at_the_same_times(tmp_path: Path) -> None:
    """The start does not depend on the time step, the order or the seed. A function
    that reads frames finds those of the same times.
    """
    found = tried(tmp_path, FRAMES, "numerics")
    assert found.before["start-speed"] == "confirmed"
    assert not any(one.unjudged for one in found.tried("numerics").values())
    assert not any(
        "start-speed" in one.turned for one in found.tried("numerics").values()
    )
    results = tmp_path / "results"
    half = "numerics/dt-half/tiny/small"
    small = variants(tmp_path, "numerics", FRAMES)["dt-half"].publication
    raw = StoredStudy(half, results)
    told = converted(small.studies["small"], raw, 2)
    assert list(raw.series["frame"].unique()) == [0, 4, 8]
    assert list(told.series["frame"].unique()) == [0, 2, 4]
    for name, value in {"dt": 1.0, "steps": 4, "drag": 0.1}.items():
        assert told.trials[name].unique() == pytest.approx([value], rel=1e-14)
    assert told.trials["drag"].dtype == raw.trials["drag"].dtype
    untold = columns_of(["turn_rate", "turn_rate_unwrapped"])
    assert told.units == {
        name: unit for name, unit in raw.units.items() if name not in untold
    }
    assert told.where(separation_weight=1).series["frame"].max() == 4
    last = raw.series[raw.series["frame"] == 8]["speed"].mean()
    counted = found.tried("numerics")["dt-half"].estimates["counting"]
    assert counted["ours"] == pytest.approx(last)
    assert counted["low"] < counted["ours"] < counted["high"]
    assert counted["trials"] == 12
    before, other = (
        StoredStudy(f"{where}tiny/small", results).trials["seed"]
        for where in ("quick/", "numerics/seed-other/")
    )
    assert not set(before) & set(other)
    row = rows(tmp_path, FRAMES)["start-speed"]
    assert (row["numerics"], row["details"]) == ({}, None)
    text = (results / "scorecard.html").read_text(encoding="utf-8")
    assert "figures/numerics-tiny.png" in text
    picture = (results / "figures" / "numerics-tiny.pdf").read_bytes()
    assert b"tiny" in picture
    about = json.loads((results / "scorecard.json").read_text())["documents"][0]
    shown = about["numerics"]["variants"]["dt-half"]["estimates"]["counting"]
    assert shown == counted


TURNING = TURNED.replace(
    "  - id: fitted-speed",
    """  - id: turning
    where: "Figure 2"
    says: "boids turn"
    kind: reading
    registered: 2024-03-01
    spec: small
    measure: {difference: [{mean: turn_rate, for: {separation_weight: 1}},
      {mean: twice_mean, for: {separation_weight: 0.5}}]}
    expect: {below: 180}
    looked: before
  - id: turning-by-hand
    where: "Figure 2"
    says: "boids turn"
    kind: reading
    registered: 2024-03-01
    spec: small
    measure: {call: turns, distribution: skewed}
    expect: {above: 0}
    looked: before
  - id: fitted-speed""",
)
TURNS = """
def turns(studies):
    return studies["small"].trials["turn_rate"].to_numpy()


"""


def test_what_is_measured_over_one_step_is_not_judged_with_half_a_step(
    tmp_path: Path,
) -> None:
    """Over half a step boids turn by another angle. So do metrics derived from it."""
    spec = SPEC.replace("every: 2}", "every: 2, derive: {twice: 2 * turn_rate}}")
    figures = FIGURES.replace("def two_groups", f"{TURNS.strip()}\n\n\ndef two_groups")
    publications = read_all(experiments(tmp_path, TURNING, spec, figures), quick=True)
    chosen = chosen_variants(publications, "numerics", ("dt-half", "seed-other"))
    found = try_all(chosen, tmp_path / "results", Serial(), ProgressBar)["tiny"]
    assert {"turning", "turning-by-hand", "some-speed"} <= set(found.before)
    tried_ones = found.tried("numerics")
    assert tried_ones["seed-other"].unjudged == {}
    unjudged = tried_ones["dt-half"].unjudged
    assert set(unjudged) == {"turning", "turning-by-hand"}
    assert unjudged["turning"] == (
        "turn_rate is measured over one step; twice is measured over one step"
    )
    assert unjudged["turning-by-hand"].startswith(
        "the measure failed: turns: KeyError: 'turn_rate'; "
    )
    assert "; turn_rate is measured over one step; " in unjudged["turning-by-hand"]


LONGER = SPEC.replace(", steps: 6}", "}").replace("sweep:\n", "sweep:\n  AXIS\n")
FEWER = TURNED.replace(", fixed.steps: 4}", "}")


@pytest.mark.parametrize(
    ("axis", "doubled"),
    [
        ("steps: [4]", {"steps": [8]}),
        (
            "length: {zip: {steps: [4], start_speed: [0.765]}}",
            {"length": {"zip": {"steps": [8], "start_speed": [0.765]}}},
        ),
    ],
)
def test_steps_on_an_axis_are_doubled(
    tmp_path: Path, axis: str, doubled: dict[str, Any]
) -> None:
    spec = LONGER.replace("AXIS", axis)
    half = variants(tmp_path, "numerics", FEWER, spec)["dt-half"].publication
    assert not any(claim.untestable for claim in half.claims)
    small = half.studies["small"]
    assert parse_document(small.text, small.path).value["sweep"] == {
        **doubled,
        "separation_weight": [0.5, 1],
    }


@pytest.mark.parametrize(
    ("axis", "more", "reason"),
    [
        (
            "more: {zip: {start_speed: [0.765], steps: {linspace: [4, 4, 1]}}}",
            "",
            '"steps" changes with the step, but its axis has more than a list or a grid'
            " of values",
        ),
        (
            "start_speed: [0.765]",
            "derive: {wander_range: 1 / steps}\n",
            '"1 / steps" uses steps, which a shorter step changes: the meaning'
            " would differ",
        ),
    ],
)
def test_half_a_step_says_why_a_claim_is_not_judged(
    tmp_path: Path, axis: str, more: str, reason: str
) -> None:
    spec = LONGER.replace("AXIS", axis) + more
    half = variants(tmp_path, "numerics", FEWER, spec)["dt-half"].publication
    said = f"small.yaml cannot have half a time step: {reason}"
    assert {claim.untestable for claim in half.claims} == {said}
    assert half.studies["small"].name == "quick/tiny/small"
    assert half.clocks == {}


def test_claims_whose_points_or_frames_go_are_not_judged(tmp_path: Path) -> None:
    """One names the value of a setting that a detail moves, one the last frame."""
    published = FRAMES.replace(
        "{mean: speed, frames: [2, 4], for: {separation_weight: 1}}",
        "{mean: speed, frame: 4, for: {separation_weight: 1, n: 40}}",
    )
    named = ("n-up-2", "steps-down-2", "drag-up-2")
    found = variants(tmp_path, "details", published, named=named)
    claims = {
        name: {claim.id: claim.untestable for claim in one.publication.claims}
        for name, one in found.items()
    }
    assert claims["n-up-2"]["some-speed"].startswith("small.yaml: no point with")
    assert claims["steps-down-2"]["some-speed"] == (
        "small.yaml records no frame from 4 to 4"
    )
    assert not any(claims["drag-up-2"].values())


def test_a_row_says_why_it_is_not_judged(tmp_path: Path) -> None:
    published = FRAMES.replace("frames: [2, 4]", "frame: 4")
    tried(tmp_path, published, "details", ("steps-down-2",))
    rows(tmp_path, published)
    text = (tmp_path / "results" / "scorecard.html").read_text(encoding="utf-8")
    said = "not judged with steps-down-2 (small.yaml records no frame from 4 to 4)"
    assert text.count(said) == 1


def test_a_detail_that_cannot_be_says_so(tmp_path: Path) -> None:
    """In a world 740 high no obstacle has a margin of 376.4. Then no trial is added."""
    spec = SPEC.replace("steps: 6", "steps: 6, obstacle_margin: 369")
    publications = read_all(experiments(tmp_path, TURNED, spec), quick=True)
    named = ("obstacle_margin-up-2",)
    chosen = chosen_variants(publications, "details", named)
    [(_, [found])] = chosen
    assert found.publication.studies == publications[0].studies
    for claim in found.publication.claims:
        assert claim.untestable.startswith("small.yaml cannot have this change: ")
    assert most_trials(chosen) == 12


def test_an_unknown_variant_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r'^unknown variant of the details "mass-\*"'):
        tried(tmp_path, TURNED, "details", ("mass-*",))
    assert not (tmp_path / "results").exists()


def test_the_command_tries_what_is_named(tmp_path: Path) -> None:
    experiments(tmp_path, TURNED)
    asked = ("reproduce", "--workers", "1", "--variant", "drag-up-*")
    done = sweep(tmp_path, *asked, "--scale", "details")
    assert done.returncode == 0, done.stderr
    assert "2 variants, with 36 trials minus stored trials" in done.stderr
    assert done.stdout == (
        "tiny: 0 of 2 verdicts change with one of 2 details, 0 of them with a change of"
        " 2 %\n"
    )
    wrong = sweep(tmp_path, *asked)
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert "--variant needs --scale mutants or details or numerics, not full" in (
        wrong.stderr
    )
