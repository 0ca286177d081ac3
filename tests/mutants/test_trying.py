"""Mistakes in a made-up checkout, whose tests are functions of this file."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from tests.mutants import __main__ as running
from tests.mutants import drawing, results
from tests.mutants.copies import NO_SUCH_TEST, Copy, Outcome, UnsoundSuiteError
from tests.mutants.drawing import Mutant, mutants
from tests.mutants.nearest import nearest, of_package
from tests.mutants.results import KILLED, OPEN, SURVIVED, Result
from tests.mutants.trying import groups, near, together

PATH = "sweep/text/tiny.py"
SOURCE = "def least(a, b):\n    return a if a < b else b\n\n\nUNSEEN = 1\n"
TESTS = "tests/text/test_tiny.py"

Tests = dict[str, Callable[[dict[str, object]], bool]]


def check(names: dict[str, object]) -> bool:
    least = names["least"]
    assert callable(least)
    return bool(least(1, 2) == 1)


NEAR: Tests = {f"{TESTS}::test_least": check, f"{TESTS}::test_broken": lambda _: False}


class Checkout:
    """Runs made-up tests, and keeps the arguments of each run."""

    def __init__(self, folder: Path, tests: Tests) -> None:
        self.folder, self.tests = folder, tests
        self.runs: list[Sequence[str]] = []

    def __call__(self, _folder: Path, arguments: Sequence[str], _: float) -> Outcome:
        self.runs.append(arguments)
        named = [one for one in arguments if one.startswith("tests/")]
        names: dict[str, object] = {}
        exec((self.folder / PATH).read_text(), names)
        failed = [
            test
            for test, passes in self.tests.items()
            if not named or {test, test.split("::")[0]} & set(named)
            if f"--deselect={test}" not in arguments
            if not passes(names)
        ]
        return Outcome(1 if failed else 0, failed[:1] if "-x" in arguments else failed)


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Checkout:
    for name, text in {PATH: SOURCE, TESTS: "from sweep.text import tiny\n"}.items():
        (tmp_path / name).parent.mkdir(parents=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(drawing, "read", lambda _path: SOURCE)
    return Checkout(tmp_path, dict(NEAR))


def those(checkout: Checkout) -> tuple[Copy, list[Mutant]]:
    return Copy(checkout.folder, checkout), [*mutants(PATH, SOURCE)]


def test_a_mistake_that_a_test_notices_is_killed_and_made_good(
    checkout: Checkout,
) -> None:
    copy, found = those(checkout)
    verdicts = [near(copy, one, "")[4:] for one in found]
    noticed = KILLED, f"{TESTS}::test_least"
    assert sorted(verdicts) == sorted([noticed, (OPEN, ""), (OPEN, "")])
    assert copy.unsound == {f"{TESTS}::test_broken"}
    assert (checkout.folder / PATH).read_text() == SOURCE


def test_what_noticed_a_mistake_earlier_is_tried_first(checkout: Checkout) -> None:
    copy, found = those(checkout)
    (checkout.folder / TESTS).write_text("def test_least(): ...\n")
    near(copy, found[0], f"{TESTS}::test_least[a]")
    assert checkout.runs[0][-1] == f"{TESTS}::test_least"
    runs = len(checkout.runs)
    near(copy, found[0], f"{TESTS}::test_gone")
    assert f"{TESTS}::test_gone" not in {one for run in checkout.runs for one in run}
    assert len(checkout.runs) > runs


def test_tests_that_cannot_begin_tell_nothing(tmp_path: Path) -> None:
    copy = Copy(tmp_path, lambda *_: Outcome(NO_SUCH_TEST, []))
    assert copy.sound([f"{TESTS}::test_of_a_mistake"], 1.0)
    with pytest.raises(UnsoundSuiteError):
        copy.sound([TESTS, "tests/text/test_other.py"], 1.0)


def test_all_that_are_left_are_tried_together(checkout: Checkout) -> None:
    copy, found = those(checkout)
    told: list[Result] = []
    together([copy], found, told.append)
    assert {one.wrong: one.verdict for one in told} == {
        "return a if a <= b else b": SURVIVED,
        "return a if not (a < b) else b": KILLED,
        "UNSEEN = 2": SURVIVED,
    }
    assert sum(run[-2:] == ["-n", "2"] for run in checkout.runs) == len(groups(found))
    assert (checkout.folder / PATH).read_text() == SOURCE


def test_a_group_that_breaks_off_is_halved(checkout: Checkout) -> None:
    copy, found = those(checkout)

    def run(folder: Path, arguments: Sequence[str], seconds: float) -> Outcome:
        """The whole suite cannot begin where the function is wrong."""
        outcome = checkout(folder, arguments, seconds)
        whole = not any(one.startswith("tests/") for one in arguments)
        wrong = f"{TESTS}::test_least" in outcome.failed
        return Outcome(3, []) if whole and wrong else outcome

    told: list[Result] = []
    together([Copy(copy.folder, run)], found, told.append)
    assert sorted(one.verdict for one in told) == [KILLED, SURVIVED, SURVIVED]


def test_a_file_is_made_good_after_an_error(checkout: Checkout) -> None:
    copy, found = those(checkout)

    def interrupted() -> None:
        with copy.mistaken(found[:1]):
            assert (checkout.folder / PATH).read_text() != SOURCE
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert (checkout.folder / PATH).read_text() == SOURCE


def test_mistakes_that_overlap_are_in_no_group_together(checkout: Checkout) -> None:
    _, found = those(checkout)
    assert sorted(len(group) for group in groups(found)) == [1, 2]


def test_the_nearest_tests_import_a_module_and_little_else(tmp_path: Path) -> None:
    files = {
        "tests/web/test_far.py": "from sweep.text import tiny",
        "tests/text/test_much.py": "import sweep.text.tiny\nfrom sweep.web import x",
        "tests/text/test_only.py": "from sweep.text import (\n    other,\n    tiny,\n)",
        "tests/text/test_none.py": "from sweep.text.tiny_one import a",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    assert nearest(tmp_path, PATH) == [
        "tests/text/test_only.py",
        "tests/text/test_much.py",
        "tests/web/test_far.py",
    ]
    of_folder = sorted(name for name in files if name.startswith("tests/text"))
    assert nearest(tmp_path, "sweep/text/lonely.py") == []
    assert nearest(tmp_path, "sweep/web/much.py") == ["tests/text/test_much.py"]
    assert of_package(tmp_path, "sweep/text/lonely.py") == of_folder


def test_results_outlive_a_line_that_was_cut(
    checkout: Checkout, tmp_path: Path
) -> None:
    _, found = those(checkout)
    file = tmp_path / "build/mutants/0123.jsonl"
    both = [Result.of(found[0], KILLED, f"{TESTS}::test_least")]
    results.append(file, both[0])
    with file.open("a") as end:
        end.write(json.dumps(both[0]._asdict())[:20])
    assert results.stored(file) == both
    both.append(Result.of(found[1], OPEN))
    results.append(file, both[1])
    assert results.stored(file) == both
    assert results.killers(file.parent) == {both[0].key: both[0].test}


def test_the_table_counts_and_lists(
    checkout: Checkout, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, (first, second, third) = those(checkout)
    same = {results.key(third)[:3]: "nobody reads it"}
    monkeypatch.setattr(results, "equivalents", lambda: same)
    done = [Result.of(first, KILLED, "x"), Result.of(second, SURVIVED)]
    text = results.table([first, second, third], done)
    assert text.split("\n")[1].split() == ["text", "3", "1", "1", "1", "50%"]
    assert f"survived:\n{second}\n" in text
    assert text.endswith(f"{third}\n    nobody reads it")


def test_a_run_goes_on_where_it_was(
    checkout: Checkout, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy, found = those(checkout)
    file = checkout.folder / "build/mutants/0123.jsonl"
    monkeypatch.setattr(running, "FOLDER", file.parent)
    monkeypatch.setattr(running, "file_of", lambda _revision: file)
    monkeypatch.setattr(running, "made", lambda *_: copy)
    known = Result.of(max(found), SURVIVED)  # which nobody reads
    results.append(file, known)
    running.tried(found, "0123", 1)
    last = {one.key: one.verdict for one in results.stored(file)}
    assert last.pop(known.key) == SURVIVED
    assert sorted(last.values()) == [KILLED, SURVIVED]
    assert (checkout.folder / PATH).read_text() == SOURCE
    so_far = len(checkout.runs)
    running.tried(found, "0123", 1)
    assert len(checkout.runs) == so_far


def test_each_equivalent_mutant_has_a_reason() -> None:
    for (_, right, wrong), reason in results.equivalents().items():
        assert right != wrong
        assert reason
