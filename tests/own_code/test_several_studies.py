"""Several studies in one file, as for a paper: each is what it is alone."""

from pathlib import Path

import pytest

from sweep.cli.running import launch, plan
from sweep.errors import SpecError
from sweep.methods.search.asked_trials import read_asked
from sweep.own_code.reading import load_spec, load_specs, schema_for
from sweep.spec.strict_yaml import parse_document
from sweep.tables.stored_study import StoredStudy
from tests.commands import run_trials_here
from tests.own_models import SPEC, at_hand
from tests.searches import TINY
from tests.studies import SMALL

OTHER = SMALL.replace("study: small", "study: other").replace("[0.5, 1]", "[2]")
BOTH = f"# a paper\n---\n{SMALL.strip()}\n# the second\n---\n{OTHER.strip()}\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "paper.yaml"
    path.write_text(text)
    return path


def test_each_study_has_its_own_text_and_the_lines_of_the_file(tmp_path: Path) -> None:
    one, two = load_specs(written(tmp_path, BOTH))
    assert (one.name, two.name) == ("small", "other")
    assert one.text == BOTH[: BOTH.rindex("---")]
    assert two.text == f"---\n{OTHER.strip()}\n"
    assert two.document.lines["study",] == BOTH.splitlines().index("study: other") + 1
    assert load_specs(written(tmp_path, two.text))[0].text == two.text


def test_a_file_of_one_study_is_what_it_was(tmp_path: Path) -> None:
    for text in (SMALL, "---" + SMALL, "%YAML 1.2\n---" + SMALL, SMALL + "...\n"):
        assert load_spec(written(tmp_path, text)).text == text


def test_mistakes_of_all_studies_are_said_at_once(tmp_path: Path) -> None:
    text = SMALL.replace("n: 12", "m: 12") + "---\n" + OTHER.replace("[2]", "[-x]")
    wrong = written(tmp_path, text + "---\n")
    with pytest.raises(SpecError) as error:
        load_specs(wrong)
    assert [
        (one.line, str(one).partition(": ")[2]) for one in error.value.mistakes
    ] == [
        (5, 'unknown parameter "m"'),
        (18, "'-x' is not allowed for separation_weight; allowed: a number from 0"),
        (23, "is empty"),
    ]


def test_no_two_studies_have_one_name(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r'12: study "small" is listed twice.*line 2'):
        load_specs(written(tmp_path, SMALL + "---" + SMALL))


def test_where_one_study_is_meant_a_second_one_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r"paper\.yaml:13: begins a second study"):
        load_spec(written(tmp_path, BOTH))
    with pytest.raises(SpecError, match=r"spec\.yaml:3: begins a second study"):
        parse_document("a: 1\n# b\n---\nc: 2\n", Path("spec.yaml"))


def test_the_schema_knows_the_code_of_all_studies() -> None:
    path = at_hand().with_name("several.yaml")
    path.write_text(SMALL + "---" + SPEC)
    assert schema_for(path) == schema_for(at_hand())


def test_commands_take_each_study(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    run_trials_here(monkeypatch)
    paper, results = written(tmp_path, BOTH), tmp_path / "results"
    plan(paper)
    said = capsys.readouterr().out
    assert said.index("small") < said.index("other")
    launch(paper, workers=1, results=results)
    for name, trials in (("small", 6), ("other", 3)):
        study = StoredStudy(name, results)
        assert study.statuses() == {"done": trials}
        assert f"study: {name}" in study.spec
        assert study.spec.count("study: ") == 1


def test_nothing_runs_if_one_of_them_cannot(tmp_path: Path) -> None:
    nothing = TINY + "require: [n > 1000]\n"
    paper, results = written(tmp_path, BOTH + "---" + nothing), tmp_path / "results"
    with pytest.raises(SpecError, match='reference "usual" is impossible'):
        launch(paper, workers=1, results=results)
    assert not results.exists()


def test_a_search_may_be_one_of_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run_trials_here(monkeypatch)
    paper, results = written(tmp_path, BOTH + "---" + TINY), tmp_path / "results"
    launch(paper, workers=1, results=results)
    assert len(StoredStudy("small", results).trials) == 6
    assert read_asked(StoredStudy("tiny", results)).description["finished"]
