"""Wrong versions of the built-in studies are noticed by what is claimed of them."""

import shutil
from pathlib import Path

import pytest

from sweep.cli.progress import ProgressBar
from sweep.published.bibliography import FILE
from sweep.published.publications import read_all
from sweep.published.trying import chosen_variants, try_all
from sweep.published.turned import DocumentVariants
from sweep.spec.built_in import EXPERIMENTS
from sweep.spec.strict_yaml import dump, read_document
from sweep.workers.executors import Loky, Serial, core_count

NAMES = sorted(file.parent.name for file in EXPERIMENTS.glob(f"*/{FILE}"))
LEAST = 0.9
FEW = {"replicates": 5, "fixed.n": 60}
TRIED = ("no-wander", "no-drag", "half-force")


def reduced(folder: Path) -> Path:
    """nguyen2024 with the claims on the sweep of separation weights alone, few boids,
    few trials and three mutants.
    """
    shutil.copytree(EXPERIMENTS / "nguyen2024", folder / "nguyen2024")
    file = folder / "nguyen2024" / FILE
    content = read_document(file).value
    content["specs"]["separation"] = FEW
    content["claims"] = [
        claim
        for claim in content["claims"]
        if claim.get("spec") == "separation" and "call" not in claim.get("measure", {})
    ]
    content["mutants"] = {name: content["mutants"][name] for name in TRIED}
    file.write_text(dump(content), encoding="utf-8")
    return folder


def noticed(found: DocumentVariants) -> float:
    """The share of mutants that a counted claim kills."""
    return found.noticed / len(found.killed_by)


def test_wrong_flocks_are_noticed_with_few_trials(tmp_path: Path) -> None:
    """Seeds are fixed, and so is what comes out."""
    publications = read_all(reduced(tmp_path), quick=True)
    chosen = chosen_variants(publications, "mutants", TRIED)
    found = try_all(chosen, tmp_path / "results", Serial(), ProgressBar)
    assert noticed(found["nguyen2024"]) == 1.0, found["nguyen2024"]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_wrong_versions_of_each_study_are_noticed(name: str, tmp_path: Path) -> None:
    """At the quick scale, with fixed seeds."""
    publications = read_all(EXPERIMENTS, quick=True, only=(name,))
    (own,) = (one.mutants for one in publications if one.asked)
    named = [mutant.name for mutant in own]
    chosen = chosen_variants(publications, "mutants", named)
    found = try_all(chosen, tmp_path, Loky(core_count()), ProgressBar)
    assert noticed(found[name]) >= LEAST, found[name].summary("mutants")
    assert len(found[name].killed_by) >= 8
