"""`sweep guide`, the first help, and what a shell completes."""

import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

import pytest
from rich.console import Console

import sweep.cli.guide as guide
from kernels.models import MODELS
from sweep.cli.app import FIRST
from sweep.cli.topics import Topic, all_topics, earlier_names, readable, search
from sweep.design.design import expand
from sweep.spec.study import parse_spec
from tests import ROOT
from tests.commands import python, sweep
from tests.studies import SMALL, launched

GUIDE = (ROOT / "GUIDE.md").read_text(encoding="utf-8")
PAGES = ROOT / "docs" / "guide"


def test_the_topics_are_the_pages(tmp_path: Path) -> None:
    done = sweep(tmp_path, "guide")
    lines = done.stdout.splitlines()
    listed = dict(line.split(maxsplit=1) for line in lines)
    begin = {len(line) - len(line.split(maxsplit=1)[1]) for line in lines}
    assert begin == {2 + max(map(len, listed))}
    assert listed["writing-a-spec"] == "Writing a spec"
    assert listed["own-models"] == "Interface for custom models"
    assert listed["intervals"] == "Which interval a mean has"
    assert listed["tutorials"] == "Tutorials"
    lists = ("guide", "tutorials", "explanations")
    folders = ("docs", *(f"docs/{name}" for name in lists))
    pages = {page.stem for one in folders for page in ROOT.glob(f"{one}/*.md")}
    assert len(pages) > 50
    assert set(listed) == pages - {"index"} | set(lists)


@pytest.mark.parametrize("asked", ["searching", "Searching", "searchi"])
def test_a_topic_is_the_text_of_its_page(asked: str, tmp_path: Path) -> None:
    said = sweep(tmp_path, "guide", asked).stdout
    assert said == readable("searching", all_topics())
    assert said.startswith("# Parameter search and optimisation\n")


def test_every_page_of_the_guide_is_listed_once_in_both_lists() -> None:
    pages = sorted(path.name for path in PAGES.glob("*.md") if path.stem != "index")
    listed = (PAGES / "index.md").read_text(encoding="utf-8")
    assert sorted(re.findall(r"^- \[.*\]\((.*)\)$", listed, re.MULTILINE)) == pages
    led = re.findall(r"^- .*\]\(docs/guide/(.*)\)$", GUIDE, re.MULTILINE)
    assert sorted(led) == pages


def test_names_and_addresses_of_before_lead_to_the_pages(tmp_path: Path) -> None:
    once = earlier_names(all_topics())
    assert len(once) > 15
    for earlier, name in once.items():
        led = f'<a id="{earlier}"></a>'
        [line] = [line for line in GUIDE.splitlines() if led in line]
        assert line.endswith(f"(docs/guide/{name}.md)")
    said = sweep(tmp_path, "guide", "what-boids-sense").stdout
    assert said.startswith("# Sensing and communication\n")


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (
            "serching",
            'unknown topic (see `sweep guide`) "serching"; did you mean "searching"?',
        ),
        ("a", "Allowed: actuation-and-failures, ablation-studies"),
        ("w", "Allowed: writing-a-spec, when-trials-fail"),
    ],
)
def test_an_unknown_topic_is_one_line(asked: str, message: str, tmp_path: Path) -> None:
    done = sweep(tmp_path, "guide", asked)
    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_word_that_is_no_topic_leads_to_those_that_have_it(tmp_path: Path) -> None:
    done = sweep(tmp_path, "guide", "polarisations", "torus")
    assert 'unknown topic (see `sweep guide`) "polarisations torus"' in done.stderr
    done = sweep(tmp_path, "guide", "mirrored")
    assert (done.returncode, done.stdout) == (2, "")
    assert 'no topic is called "mirrored"; topics that contain' in done.stderr
    assert "boundaries-of-the-world" in done.stderr


@pytest.mark.parametrize("words", [("packet", "LOSS"), ("packet loss",)])
def test_a_search_prints_topic_heading_and_line(
    words: tuple[str, ...], tmp_path: Path
) -> None:
    found = sweep(tmp_path, "guide", "--search", *words).stdout
    topic, line = found.splitlines()[:2]
    assert topic == "sensing-and-communication  Sensing and communication"
    assert line.startswith("    Sensing and communication: | `packet_loss`")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("polarisations", "torus"), 'has "polarisations torus"; did you mean "polar'),
        (("qqqqqqqq",), 'no paragraph of the guide has "qqqqqqqq"\n'),
        ((), "--search needs a word, for example sweep guide --search torus"),
    ],
)
def test_a_search_that_finds_nothing_is_one_line(
    words: tuple[str, ...], message: str, tmp_path: Path
) -> None:
    done = sweep(tmp_path, "guide", "--search", *words)
    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


def test_words_of_a_search_may_stand_on_two_lines_of_a_paragraph() -> None:
    text = "# A\n\nOne red\nlarge Fox_tail.\n\n## B\n\nA red\n\n- fox\n"
    topics = {"a": Topic("docs/a.md", text)}
    assert list(search("fox red", topics)) == [("a", "A", "large Fox_tail.")]
    assert list(search("tail", topics)) == [("a", "A", "large Fox_tail.")]
    assert [found.heading for found in search("red", topics)] == ["A", "B"]
    assert list(search("ox", topics)) == []


MARKUP = re.compile(r":::|<!--|\{grid|\{figure|\{toctree|!\[|\]\((?!https:)|:alt:")


@pytest.mark.parametrize(
    "topics",
    [
        pytest.param(lambda: ["writing-a-spec", "start", "guide"], id="some"),
        pytest.param(all_topics, id="every one", marks=pytest.mark.slow),
    ],
)
def test_a_terminal_gets_every_topic_without_marks(
    topics: Callable[[], Iterable[str]],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    terminal = partial_terminal()
    monkeypatch.setattr("sweep.cli.terminal.console", lambda: terminal)
    for topic in topics():
        guide.guide([topic])
    said = capsys.readouterr().out
    assert "Writing a spec" in said
    assert "\n## " not in said
    assert "sweep guide own-models" in said  # where a link leads
    assert MARKUP.findall(said) == []


def test_a_pipe_gets_every_topic_without_markup_and_dead_links() -> None:
    """Each link leads to a topic, or is its words alone; code stays as it is."""
    topics = all_topics()
    texts = {name: readable(name, topics) for name in topics}
    code = re.compile(r"```.*?```|`[^`]*`", re.DOTALL)
    marks = {name: MARKUP.findall(code.sub("", text)) for name, text in texts.items()}
    assert {name for name, found in marks.items() if found} == set()
    led = re.findall(r"\(`sweep guide ([^`]*)`\)", "".join(texts.values()))
    assert len(led) > 50
    assert set(led) <= set(topics)
    assert "one question (`sweep guide one-question`)" in texts["start"]
    assert "*(Figure: Each line" in texts["start"]
    assert "`first.yaml`:\n\n```yaml\nstudy: my/first" in texts["start"]
    assert "has no value, such as" in texts["faq"]


def partial_terminal() -> Console:
    return Console(file=sys.stdout, force_terminal=True, width=100, color_system=None)


def test_the_first_help_has_a_spec_that_runs(tmp_path: Path) -> None:
    text = FIRST.read_text(encoding="utf-8")
    study = parse_spec(text)
    assert expand(study).n_points == 3
    said = sweep(tmp_path, "--help").stdout
    for line in text.splitlines():
        assert line in said
    assert f"sweep table {study.name}" in said
    assert "sweep guide" in said


def completed(folder: Path, *words: str) -> list[str]:
    """What bash would offer for the last of these words."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("_SWEEP_COMPLETE", "complete_bash")
        patch.setenv("COMP_WORDS", " ".join(["sweep", *words]))
        patch.setenv("COMP_CWORD", str(len(words)))
        return sweep(folder, *words).stdout.split()


def test_a_shell_completes_studies_models_and_topics(tmp_path: Path) -> None:
    launched(SMALL, tmp_path / "results")
    launched(SMALL.replace("study: small", "study: my/slow"), tmp_path / "other")
    assert completed(tmp_path, "sta") == ["status"]
    assert completed(tmp_path, "status", "s") == ["small"]
    assert completed(tmp_path, "table", "--results", "other", "") == ["my/slow"]
    assert completed(tmp_path, "models", "na") == ["nanobot"]
    assert completed(tmp_path, "models", "") == sorted(MODELS)
    assert completed(tmp_path, "view", "--model", "ngu") == ["nguyen2024"]
    topics = ["search", "searching", "see-the-swarm", "seeds"]
    topics += ["sensing-and-communication", "sensitivity"]
    assert sorted(completed(tmp_path, "guide", "se")) == topics


def test_names_that_a_shell_could_read_as_more_are_left_out(tmp_path: Path) -> None:
    launched(SMALL, tmp_path / "results")
    (tmp_path / "results" / "small").rename(tmp_path / "results" / "s$(touch x)")
    assert completed(tmp_path, "status", "s") == []


def test_completion_loads_no_kernels() -> None:
    code = "import sys; from sweep.cli.completing import *; model_names('');"
    code += "print(sys.modules.keys() & {'numpy', 'numba', 'pandas', 'kernels'})"
    assert python(code).strip() == "set()"


def test_a_shell_gets_its_script(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "--install-completion" in sweep(tmp_path, "--help").stdout
    monkeypatch.setenv("_SWEEP_COMPLETE", "source_bash")
    assert "_SWEEP_COMPLETE=complete_bash" in sweep(tmp_path).stdout
