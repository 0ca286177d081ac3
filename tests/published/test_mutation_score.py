"""Wrong versions of the built-in studies are noticed by what is claimed of them.

Here with few trials. `sweep reproduce --scale mutants` tries all, in hours.
"""

import shutil
from pathlib import Path

import pytest

from sweep.cli.progress import ProgressBar
from sweep.published.bibliography import FILE
from sweep.published.judging import judged, stored_studies
from sweep.published.measures import MeanDifference
from sweep.published.publications import read_all
from sweep.published.running import run_studies
from sweep.published.trying import chosen_variants, try_all
from sweep.published.turned import DocumentVariants
from sweep.spec.built_in import EXPERIMENTS
from sweep.spec.strict_yaml import dump, read_document
from sweep.workers.executors import Serial

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


@pytest.mark.slow
def test_wrong_flocks_are_noticed_with_few_trials(tmp_path: Path) -> None:
    """Seeds are fixed, and so is what comes out."""
    publications = read_all(reduced(tmp_path), quick=True)
    chosen = chosen_variants(publications, "mutants", TRIED)
    found = try_all(chosen, tmp_path / "results", Serial(), ProgressBar)
    assert noticed(found["nguyen2024"]) == 1.0, found["nguyen2024"]


@pytest.mark.slow
def test_the_arms_of_comparisons_are_those_that_are_meant(tmp_path: Path) -> None:
    """Of nanobot, with few trials and fixed seeds. With swapped arms, in the document
    or in what reads and measures it, each would be refuted.
    """
    publications = read_all(EXPERIMENTS, quick=True, only=("nanobot",))
    (nanobot,) = (one for one in publications if one.selected)
    studies = [nanobot.studies[spec] for spec in ("rules", "dense")]
    run_studies(studies, tmp_path, Serial(), ProgressBar)
    rows, _ = judged(nanobot, stored_studies(nanobot, tmp_path))
    found = {
        row.claim.id: row.verdict.status
        for row in rows
        if isinstance(row.claim.measure, MeanDifference)
    }
    assert found == {
        "flocking": "confirmed",
        "swarm-cohesion": "undecided",
        "cohesion": "undecided",
        "separation": "confirmed",
        "alignment": "confirmed",
        "aggregation": "confirmed",
        "collisions": "confirmed",
        "collisions-dense": "confirmed",
    }
