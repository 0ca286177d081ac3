"""Mistakes of the program: made in copies of it, and told apart from its own trials."""

import ast
import filecmp
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from sweep.cli.progress import ProgressBar
from sweep.errors import SpecError, WorkersError
from sweep.published.program_mutants import (
    HOLDER,
    KERNELS,
    PROGRAM_MUTANTS,
    SWEEP,
    ProgramMutant,
)
from sweep.published.publications import read_all
from sweep.published.trying import chosen_variants, most_trials, try_all
from sweep.spec.built_in import EXPERIMENTS
from sweep.tables.stored_study import StoredStudy
from sweep.workers.executors import Loky, Serial, core_count
from tests import ROOT
from tests.publications import PUBLISHED, experiments

AT_THE_END = """
  - id: faster-in-the-end
    where: "Figure 2"
    says: "boids gain speed"
    kind: reading
    registered: 2024-03-01
    spec: small
    measure: {mean: speed, for: {separation_weight: 1}}
    expect: {above: 1}
    looked: before
contradictions:"""
ENDING = PUBLISHED.replace("\ncontradictions:", AT_THE_END).replace(
    "{replicates: 3,", "{replicates: 6,"
)


def differing(folder: Path) -> Iterator[str]:
    """The files of a copy that are not as they are in the program."""
    for package in (SWEEP, KERNELS):
        for file in package.rglob("*.py"):
            place = file.relative_to(HOLDER)
            if "experiments" not in place.parts and not filecmp.cmp(
                file, folder / place, shallow=False
            ):
                yield place.as_posix()


def test_each_mistake_is_in_one_file_of_its_copy(tmp_path: Path) -> None:
    """An edit of what it replaces makes this test fail: then it is to be made anew. All
    are made in one copy, one after the other, and undone.
    """
    for name, mistake in PROGRAM_MUTANTS.items():
        mistake.write_copy(tmp_path)
        (file,) = differing(tmp_path)
        assert file == mistake.file, name
        ast.parse((tmp_path / file).read_text(encoding="utf-8"))
        shutil.copy(HOLDER / file, tmp_path / file)


def test_the_page_on_published_yaml_lists_them() -> None:
    page = (ROOT / "docs" / "published.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([a-z0-9-]+)` \| (.*) \|$", page, re.MULTILINE)
    listed = {name: about for name, about in rows if name in PROGRAM_MUTANTS}
    assert listed == {name: one.description for name, one in PROGRAM_MUTANTS.items()}
    assert len(listed) == 12  # as the pages say


def test_a_mistake_that_cannot_be_made_is_an_error(tmp_path: Path) -> None:
    gone = ProgramMutant("nothing", "sweep/text.py", "no such line", "another one")
    with pytest.raises(ValueError, match=r"sweep/text.py does not have 'no such line'"):
        gone.write_copy(tmp_path)


def test_a_copy_runs_what_its_mistake_changes() -> None:
    """Trials keep their ids where they are only prepared or summed up in another way;
    those of other kernels have other stamps.
    """
    needed = ("one", "other")
    changed = {
        name: PROGRAM_MUTANTS[name].changed(needed, same=("other",))
        for name in ("one-seed", "last-third", "n-less-1", "no-family")
    }
    assert changed == {
        "one-seed": {"one", "other"},
        "last-third": {"one", "other"},
        "n-less-1": {"one"},
        "no-family": set(),
    }


def test_no_mutant_of_a_document_has_the_name_of_one_of_the_program(
    tmp_path: Path,
) -> None:
    named = "mutants: {radians: {about: x, change: {}}}\ncontradictions:"
    folder = experiments(tmp_path, PUBLISHED.replace("contradictions:", named))
    with pytest.raises(SpecError, match='"radians" is the name of a mutant of the pro'):
        read_all(folder, quick=True)


@pytest.mark.slow
def test_a_mistake_turns_a_claim_and_no_trial_of_ours(tmp_path: Path) -> None:
    """The end is taken for the start, where boids are slower. Contacts are in no claim
    and are not recorded: no trial runs for them.
    """
    publications = read_all(experiments(tmp_path, ENDING), quick=True)
    results, named = tmp_path / "results", ("start-for-end", "contact-threshold")
    chosen = chosen_variants(publications, "mutants", named)
    assert most_trials(chosen) == 3 * 12
    found = try_all(chosen, results, Serial(), ProgressBar)["tiny"]
    assert found.confirmed == ["start-speed", "faster-in-the-end"]
    assert found.killed_by == {
        "start-for-end": ["faster-in-the-end"],
        "contact-threshold": [],
    }
    assert found.unmoved == ["contact-threshold"]
    assert found.summary("mutants") == (
        "1 of 2 mutants are detected; 1 of 2 confirmed claims detect a mutant;"
        " not detected: contact-threshold (changes no number)"
    )
    ours, theirs = (
        StoredStudy(f"{where}/tiny/small", results).trials
        for where in ("quick", "mutants/start-for-end")
    )
    assert list(ours["seed"]) == list(theirs["seed"])
    assert (ours["speed"] > theirs["speed"]).all()
    assert [one.name for one in (results / "mutants").iterdir()] == ["start-for-end"]


@pytest.mark.slow
def test_a_copy_that_fails_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is stored of it, and nothing is said to be turned."""
    broken = PROGRAM_MUTANTS["no-family"]._replace(wrong="no_such_name")
    monkeypatch.setitem(PROGRAM_MUTANTS, "no-family", broken)  # type: ignore[arg-type]
    publications = read_all(experiments(tmp_path, ENDING), quick=True)
    chosen = chosen_variants(publications, "mutants", ("no-family",))
    with pytest.raises(WorkersError, match=r"tiny: the copy .* no-family ended with"):
        try_all(chosen, tmp_path / "results", Serial(), ProgressBar)
    assert not (tmp_path / "results" / "variants.json").exists()


AS_DEFINED = "recorded-as-defined"
NOTICED = {
    "nanobot": (
        *("one-seed", "last-third", "start-for-end"),
        *("contact-threshold", "n-less-1", "largest-radius"),
    ),
    "dorsogna2006": ("one-seed", "last-third", "start-for-end", "largest-radius"),
}
"""By document the mistakes that its row on what is recorded turns."""


@pytest.mark.slow
@pytest.mark.parametrize("name", NOTICED)
def test_the_row_on_what_is_recorded_notices_mistakes(
    name: str, tmp_path: Path
) -> None:
    """At the quick scale, with fixed seeds. Nobody there turns by an angle that is
    recorded.
    """
    publications = read_all(EXPERIMENTS, quick=True, only=(name,))
    named = (*NOTICED[name], "radians")
    chosen = chosen_variants(publications, "mutants", named)
    found = try_all(chosen, tmp_path, Loky(core_count()), ProgressBar)[name]
    turning = {one for one, ids in found.killed_by.items() if AS_DEFINED in ids}
    assert turning == {*NOTICED[name]}, found.summary("mutants")
    assert found.unmoved == ["radians"]
