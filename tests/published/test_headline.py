"""The headline of the readme: what is judged, and what came out where it is stored."""

import json
from pathlib import Path

import pytest

from sweep.errors import StoreError
from sweep.published.headline import (
    BLOCK,
    counted,
    headline,
    known_verdicts,
    main,
    read_verdicts,
    rows,
)
from sweep.published.publications import Publication, read_without_code
from sweep.spec.study_folder import SCORECARD
from tests import ROOT
from tests.publications import PUBLISHED, experiments

HYPOTHESIS = """
  - id: ours
    where: nowhere
    says: boids are red
    kind: hypothesis
    registered: 2024-03-01
    untestable: no colour is recorded
contradictions"""
SAME = "id: hidden\n    statement: start-speed"
OTHERS = PUBLISHED.replace("\ncontradictions", HYPOTHESIS).replace("id: hidden", SAME)


def tiny(folder: Path, published: str = PUBLISHED) -> list[Publication]:
    return read_without_code(experiments(folder, published))


def stored(folder: Path, scale: str = "full", confirmed: int = 1) -> Path:
    """The results with a scorecard of the tiny publication."""
    results = folder / "results"
    results.mkdir()
    statements = {"confirmed": confirmed, "not testable": 1, "refuted": 0}
    about = {
        "scale": scale,
        "documents": [{"study": "tiny", "asked": True, "statements": statements}],
    }
    (results / "scorecard.json").write_text(json.dumps(about))
    return results


def test_the_readme_says_what_is_judged_and_what_came_out() -> None:
    """Verdicts are held to the stored scorecard where there is one, and all else to the
    claims.
    """
    publications = read_without_code(ROOT / "experiments")
    found = BLOCK.search((ROOT / "README.md").read_text(encoding="utf-8"))
    assert found
    verdicts = known_verdicts(found[0], ROOT / "results", publications)
    assert found[0] == headline(publications, verdicts)


def test_the_readme_has_the_sums_of_its_headline() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    found = BLOCK.search(readme)
    assert found
    counts = [dict(list(row.items())[1:]) for row in rows(found[0])]
    sums = {name: sum(int(row[name]) for row in counts) for name in counts[0]}
    assert (sums["not run"], sums["partial"]) == (0, 0)
    assert (
        f"Of {sums['statements']} [statements of six of them](#the-studies),"
        f" simulations confirm {sums['confirmed']} and refute {sums['refuted']};"
        f" {sums['undecided']} are undecided, and {sums['not testable']} are"
        " not testable."
    ) in " ".join(readme.split())


def test_statements_are_counted_once(tmp_path: Path) -> None:
    (one,) = tiny(tmp_path, OTHERS)
    assert counted(one) == {"statement": 1, "exact": 0, "hypothesis": 1, "fit": 0}
    assert headline([one], {}).splitlines()[1:-1] == [
        "| publication | statements | exact results | our own hypotheses | fits |",
        "|---|---:|---:|---:|---:|",
        "| tiny | 1 | 0 | 1 | 0 |",
    ]


def test_what_is_unverified_is_no_statement_of_the_document(tmp_path: Path) -> None:
    known = "kind: number\n    unverified: nobody has the paper"
    exact = OTHERS.replace("kind: hypothesis", "kind: exact")
    (one,) = tiny(tmp_path, exact.replace("kind: number", known, 1))
    assert counted(one) == {"statement": 1, "exact": 1, "hypothesis": 1, "fit": 0}


def test_a_document_without_verdicts_beside_others_was_not_run(tmp_path: Path) -> None:
    publications, elsewhere = tiny(tmp_path), {"other": {"confirmed": 1}}
    (row,) = rows(headline(publications, elsewhere))
    assert (row["not run"], row["confirmed"]) == ("2", "0")


def test_verdicts_are_those_of_the_scorecard(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    publications, results = tiny(tmp_path), stored(tmp_path)
    (row,) = rows(headline(publications, read_verdicts(results, publications)))
    assert (row["statements"], row["confirmed"], row["not testable"]) == ("2", "1", "1")
    assert row["undecided"] == "0"
    readme = tmp_path / "README.md"
    block = headline(publications, {})
    readme.write_text(f"before\n\n{block}\n\nafter\n")
    monkeypatch.setattr(
        "sys.argv", ["", str(readme), str(tmp_path / "experiments"), str(results)]
    )
    main()
    text = readme.read_text()
    assert text.startswith("before\n\n<!-- headline")
    assert text.endswith("<!-- end of headline -->\n\nafter\n")
    assert rows(text) == [row]


def test_verdicts_stay_where_no_results_are_as_long_as_they_are_of_the_claims(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (one,) = tiny(tmp_path)
    readme, counts = tmp_path / "README.md", headline([one], {})
    kept = headline([one], {"tiny": {"confirmed": 1, "not testable": 1}})
    nowhere = str(tmp_path / "nowhere")
    monkeypatch.setattr(
        "sys.argv", ["", str(readme), str(tmp_path / "experiments"), nowhere]
    )
    for there, left in (
        (kept, kept),
        (counts, counts),
        (kept.replace("| tiny | 2 | 1 |", "| tiny | 3 | 2 |"), counts),
        (kept.replace("| tiny |", "| other |"), counts),
    ):
        readme.write_text(there)
        main()
        assert readme.read_text() == left


@pytest.mark.parametrize(("scale", "confirmed"), [("quick", 1), ("full", 2)])
def test_those_of_few_trials_or_of_other_claims_are_none(
    tmp_path: Path, scale: str, confirmed: int
) -> None:
    publications = tiny(tmp_path)
    assert read_verdicts(stored(tmp_path, scale, confirmed), publications) == {}
    assert read_verdicts(tmp_path / "nowhere", publications) == {}


def test_a_damaged_scorecard_is_one_line(tmp_path: Path) -> None:
    results = stored(tmp_path)
    (results / SCORECARD[-1]).write_text('{"scale": 3}')
    with pytest.raises(StoreError, match=r"scorecard.json: .*; delete the file and"):
        read_verdicts(results, tiny(tmp_path))
