"""Variants: which verdicts they turn, and what the page says of it."""

import json
from pathlib import Path
from typing import Any

import pytest

from sweep.cli.progress import ProgressBar
from sweep.errors import SpecError, StoreError
from sweep.published.publications import read_all
from sweep.published.reproduce import reproduce
from sweep.published.trying import chosen_variants, try_all
from sweep.published.turned import DocumentVariants, read_turned
from sweep.published.variants import Kind, Variant
from sweep.tables.stored_study import StoredStudy
from sweep.workers.executors import Serial
from tests.commands import sweep
from tests.publications import PUBLISHED, SPEC, experiments

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
  fast: {about: "boids start at speed 3", change: {all: {preset: as_written}}}
  heavy: {about: "drag counts double", change: {small: {fixed.drag: 0.2}}}
contradictions:"""
NO_ROOM = "{small: {fixed.n_obstacles: 4000, fixed.obstacle_radius: 250,\
  fixed.start_free: true}}"
TURNED = PUBLISHED.replace("\ncontradictions:", MUTANTS).replace(
    "{replicates: 3,", "{replicates: 6,"
)


def variants(
    folder: Path, kind: Kind, published: str = TURNED, spec: str = SPEC
) -> dict[str, Variant]:
    """The variants of the tiny publication, by name."""
    publications = read_all(experiments(folder, published, spec), quick=True)
    [(_, found)] = chosen_variants(publications, kind)
    return {one.name: one for one in found}


def tried(
    folder: Path,
    published: str = TURNED,
    kind: Kind = "mutants",
    named: tuple[str, ...] = (),
) -> DocumentVariants:
    """What variants of the tiny publication turn."""
    publications = read_all(experiments(folder, published), quick=True)
    chosen = chosen_variants(publications, kind, named)
    return try_all(chosen, folder / "results", Serial(), ProgressBar)["tiny"]


def rows(folder: Path, published: str = TURNED) -> dict[str, dict[str, Any]]:
    """The rows of the page for machines at the full scale, by id."""
    publications = read_all(experiments(folder, published), quick=False)
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
        "1 of 2 mutants are noticed; 1 of 2 confirmed claims notice one;"
        " not noticed: heavy"
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
    assert (right["drag"].unique(), wrong["drag"].unique()) == ([0.1], [0.2])
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
        ["no mutant turns it"],
    )
    assert found["fitted-speed"]["weak"] is False
    results = tmp_path / "results"
    for name in ("scorecard.html", "scorecard.md"):
        text = (results / name).read_text(encoding="utf-8")
        assert text.count("weak: no mutant turns it") == 1
        assert "1 of 2 mutants are noticed" in text
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
    assert tried(tmp_path, failing).killed_by["heavy"] == []


@pytest.mark.parametrize(
    "content",
    [b"", b"[]", b"{}", b'{"version": 1, "documents": {"tiny": {}}}', b"[" * 100_000],
)
def test_a_damaged_file_of_variants_is_one_line(tmp_path: Path, content: bytes) -> None:
    results = tmp_path / "results"
    results.mkdir()
    (results / "variants.json").write_bytes(content)
    with pytest.raises(StoreError, match=r"variants.json: .*; remove it and try the"):
        read_turned(results)


def test_the_command_says_which_mutants_are_noticed(tmp_path: Path) -> None:
    experiments(tmp_path, TURNED)
    done = sweep(tmp_path, "reproduce", "--workers", "1", "--scale", "mutants")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("tiny: 1 of 2 mutants are noticed;")
    assert (tmp_path / "results" / "variants.json").is_file()
