"""Code of one's own runs where its user says so, and nowhere else."""

import json
import re
import sys
from pathlib import Path

import pytest

import sweep as package
from sweep.campaigns.launching import launch
from sweep.errors import CodeError, SpecError, StoreError
from sweep.own_code.catalogue import OwnCode, _loaded
from sweep.own_code.reading import code_of, load_spec
from sweep.replays.replaying import replay
from sweep.spec.study import parse_spec
from sweep.tables.stored_study import StoredStudy
from sweep.workers.executors import Serial
from tests.commands import sweep

SPEC = """
study: given
model: nguyen2024
preset: as_run
fixed: {n: 5, steps: 4}
sweep: {separation_weight: [0.5, 1]}
replicates: 2
seed: 5
record: {metrics: [./mine.py], series: [haste], every: 2}
"""
MINE = """
from kernels.metrics import Metric
from kernels.metrics.motion import speed

with open({marks!r}, "a") as file:
    print("ran", file=file)
METRICS = {{"haste": Metric(speed, "length/time", "mean speed", "a test")}}
"""


class Given:
    """A folder with a spec and its code, which notes when it runs."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.marks = folder, folder / "marks"
        (folder / "mine.py").write_text(MINE.format(marks=str(self.marks)))
        (folder / "spec.yaml").write_text(SPEC)

    def ran(self) -> int:
        """How often the code has run since it was last asked."""
        found = self.marks.read_text().count("ran") if self.marks.exists() else 0
        self.marks.unlink(missing_ok=True)
        return found


@pytest.fixture
def given(tmp_path: Path) -> Given:
    return Given(tmp_path)


@pytest.fixture
def stranger(given: Given, monkeypatch: pytest.MonkeyPatch) -> Given:
    """The same, launched by a user with another key, and not loaded any more."""
    with monkeypatch.context() as theirs:
        theirs.setattr("sweep.store.stored_code.own_key", lambda: b"another user's")
        done = sweep(given.folder, "launch", "spec.yaml")
        assert "4 new trials (4 done)" in done.stderr
    assert given.ran() == 1
    _loaded.cache_clear()
    for name in [name for name in sys.modules if name.startswith("own_")]:
        monkeypatch.delitem(sys.modules, name)  # others may still compile its functions
    return given


def test_code_runs_only_where_a_spec_names_it(given: Given) -> None:
    (given.folder / "spec.yaml").write_text(SPEC.replace("./mine.py", "speed"))
    sweep(given.folder, "plan", "spec.yaml")
    assert given.ran() == 0


@pytest.mark.parametrize("command", ["plan", "launch", "diff", "view"])
def test_no_code_refuses_a_spec_before_anything_runs(
    command: str, given: Given
) -> None:
    done = sweep(given.folder, command, "spec.yaml", "--no-code")
    assert done.returncode == 2
    assert done.stderr == (
        'spec.yaml:9: the spec runs code from "./mine.py"; no code may run\n'
    )
    assert given.ran() == 0
    assert not (given.folder / "results").exists()


def test_a_plan_says_what_it_runs(given: Given) -> None:
    (given.folder / "near.py").write_text("")
    with (given.folder / "mine.py").open("a") as file:
        file.write("from . import near\n")
    said = sweep(given.folder, "plan", "spec.yaml").stdout
    assert "\nruns code  mine.py, near.py\n" in said
    listed = [path.name for path in code_of(given.folder / "spec.yaml")]
    assert sorted(listed) == ["mine.py", "near.py"]


@pytest.mark.parametrize(
    "path",
    ["../mine.py", "/tmp/mine.py", "./sub/../../mine.py", "mine.py", "~/mine.py"],
)
def test_no_code_comes_from_outside_the_folder_of_the_spec(
    path: str, given: Given
) -> None:
    inner = given.folder / "inner"
    inner.mkdir()
    (inner / "spec.yaml").write_text(SPEC.replace("./mine.py", path))
    with pytest.raises(SpecError, match=r"spec\.yaml:9: "):
        load_spec(inner / "spec.yaml")
    assert given.ran() == 0


def test_code_comes_from_another_folder_that_is_allowed(given: Given) -> None:
    inner = given.folder / "inner"
    inner.mkdir()
    (inner / "spec.yaml").write_text(SPEC.replace("./mine.py", "../mine.py"))
    allowed = ("--code-from", "..")
    done = sweep(inner, "launch", "spec.yaml", *allowed)
    assert "4 new trials (4 done)" in done.stderr
    verified = sweep(inner, "verify", "given", "--fraction", "1")
    assert "4 of 4" in verified.stdout
    assert "another file now" not in verified.stderr
    with (given.folder / "mine.py").open("a") as file:
        file.write("# a word more\n")
    trial = package.load("given", inner / "results").trials["trial_id"].iloc[0]
    said = sweep(inner, "replay", "given", trial).stdout
    assert "mine.py: another file now" in said
    with pytest.raises(SpecError, match="--code-from FOLDER"):
        load_spec(inner / "spec.yaml")


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("../../mine.py", "is outside .*, the only folder of code"),
        ("/tmp/mine.py", "begins neither with ./ nor with ../"),
        ("mine.py", 'write "./mine.py"'),
        ("../mane.py", 'there is no file "mane.py" in .*; did you mean "mine.py"'),
    ],
)
def test_no_code_comes_from_outside_an_allowed_folder(
    path: str, words: str, given: Given
) -> None:
    inner = given.folder / "inner"
    inner.mkdir()
    (inner / "spec.yaml").write_text(SPEC.replace("./mine.py", path))
    with pytest.raises(SpecError, match=words):
        load_spec(inner / "spec.yaml", code_from=given.folder)
    assert given.ran() == 0


def test_a_link_that_leads_out_of_the_folder_is_not_followed(given: Given) -> None:
    inner = given.folder / "inner"
    inner.mkdir()
    (inner / "spec.yaml").write_text(SPEC)
    (inner / "mine.py").symlink_to(given.folder / "mine.py")
    with pytest.raises(SpecError, match="is outside the folder of the spec"):
        load_spec(inner / "spec.yaml")
    assert given.ran() == 0


def test_a_text_of_a_page_names_no_file(given: Given) -> None:
    with pytest.raises(SpecError, match="unknown metric"):
        parse_spec(SPEC, given.folder / "spec.yaml")
    assert given.ran() == 0


def test_results_of_others_are_read_without_their_code(stranger: Given) -> None:
    for arguments in (
        ("status", "given"),
        ("table", "given"),
        ("plot", "given"),
        ("compare", "given:separation_weight=0.5", "given:separation_weight=1"),
        ("export", "given", "--to", "given.csv"),
        ("gc", "given", "--dry-run"),
        ("code", "given"),
    ):
        done = sweep(stranger.folder, *arguments)
        assert done.returncode == 0, done.stderr
    study = package.load("given", stranger.folder / "results")
    assert study.trials["haste"].notna().all()
    assert study.units["haste"] == "px/step"
    assert study.where(separation_weight=1).series["haste"].notna().all()
    assert stranger.ran() == 0


@pytest.mark.parametrize("command", ["replay", "verify", "view", "measure"])
def test_code_of_others_runs_only_with_trust(command: str, stranger: Given) -> None:
    study = StoredStudy("given", stranger.folder / "results")
    trial = [study.trials["trial_id"][0]]
    further = {"verify": [], "measure": ["double = haste + haste"]}
    done = sweep(stranger.folder, command, "given", *further.get(command, trial))
    assert done.returncode == 2
    assert "(mine.py), which you have not launched here" in done.stderr
    assert "version " in done.stderr
    assert "--trust" in done.stderr
    assert stranger.ran() == 0


def test_with_trust_it_runs(stranger: Given) -> None:
    results = stranger.folder / "results"
    study = package.load("given", results, trust=True)
    _, same = replay(study, study.trials["trial_id"][0])
    assert same
    assert stranger.ran() == 1
    done = sweep(stranger.folder, "verify", "given", "--trust", "--fraction", "1")
    assert "4 of 4 bitwise identical" in done.stdout


def test_what_is_measured_by_code_of_others_stays_theirs(stranger: Given) -> None:
    asked = ("measure", "given", "double = haste + haste")
    done = sweep(stranger.folder, *asked, "--trust")
    assert "double of 4 trials measured" in done.stderr
    study = StoredStudy("given", stranger.folder / "results")
    assert (study.trials["double"] == 2 * study.trials["haste"]).all()
    assert sweep(stranger.folder, "verify", "given").returncode == 2
    trusted = sweep(stranger.folder, "verify", "given", "--trust", "--fraction", "1")
    assert "4 of 4 bitwise identical" in trusted.stdout


def test_no_code_is_added_to_that_of_others(stranger: Given) -> None:
    (stranger.folder / "further.py").write_text("METRICS = {}")
    asked = ("measure", "given", "./further.py", "--trust")
    done = sweep(stranger.folder, *asked)
    assert done.returncode == 2
    assert "another user has launched the study with custom code" in done.stderr


def test_who_launches_the_study_too_has_said_yes(stranger: Given) -> None:
    study = StoredStudy("given", stranger.folder / "results")
    with pytest.raises(CodeError):
        study.job(study.trial(study.trials["trial_id"][0]))
    again = sweep(stranger.folder, "launch", "spec.yaml", "--retry")
    assert "nothing was missing" in again.stderr
    stranger.ran()
    # The plan is ours now; the trials are still those of somebody else.
    mine = StoredStudy("given", stranger.folder / "results")
    assert mine.running(mine.provenance).runs == ("mine.py",)
    with pytest.raises(CodeError):
        mine.job(mine.trial(mine.trials["trial_id"][0]))


def changed(folder: Path, change: dict[str, object]) -> None:
    (file,) = (folder / "results" / "given").glob("code-*.json")
    file.write_text(json.dumps(json.loads(file.read_text()) | change))


@pytest.mark.parametrize(
    "change",
    [
        {"files": {"mine.py": "import os"}},
        {"files": {"../mine.py": ""}},
        {"named": {}},
        {"named": {"other.py": None}},
        {"files": {"mine.py": "", "mine.py/": "import os"}},
        {"files": {"//mine.py": ""}},
        {"files": {"./mine.py": ""}},
        {"files": 3},
    ],
)
def test_changed_code_is_refused_even_with_trust(
    change: dict[str, object], stranger: Given
) -> None:
    changed(stranger.folder, change)
    with pytest.raises(StoreError, match=r"code-[0-9a-f]{64}\.json: the code"):
        package.load("given", stranger.folder / "results", trust=True)
    assert stranger.ran() == 0


def test_all_code_is_shown_that_trust_would_run(stranger: Given) -> None:
    """The spec as last launched may name other code than that of stored trials."""
    code = stranger.folder / "mine.py"
    code.write_text(code.read_text().replace('print("ran"', 'print("RAN"'))
    sweep(stranger.folder, "launch", "spec.yaml")
    said = sweep(stranger.folder, "code", "given").stdout
    assert said.count("# ==================== version ") == 2
    assert 'print("ran"' in said
    assert 'print("RAN"' in said
    done = sweep(stranger.folder, "code", "given", "--to", "both")
    spec, now, before = done.stdout.splitlines()
    assert (spec, now) == ("both/spec.yaml", "both/mine.py")
    assert re.fullmatch(r"both/version-[0-9a-f]{12}/mine\.py", before)
    assert 'print("RAN"' in (stranger.folder / now).read_text()
    assert 'print("ran"' in (stranger.folder / before).read_text()


@pytest.mark.parametrize(
    "about",
    [
        {},
        {"models": {}, "metrics": {"haste": {}}, "maps": {}, "starts": {}},
        {"models": {}, "metrics": {"speed": 1}, "maps": {}, "starts": {}},
        {"models": {"x": {"settings": {"a b": {}}}}, "metrics": {}, "maps": {}}
        | {"starts": {}},
        {"models": [], "metrics": [], "maps": [], "starts": []},
    ],
)
def test_a_description_that_describes_nothing_is_refused(
    about: dict[str, object], stranger: Given
) -> None:
    changed(stranger.folder, {"about": about})
    with pytest.raises(StoreError, match="the code of the trials cannot be read"):
        package.load("given", stranger.folder / "results")


def test_a_description_cannot_take_the_name_of_an_entry_of_ours(
    stranger: Given,
) -> None:
    (file,) = (stranger.folder / "results" / "given").glob("code-*.json")
    about = json.loads(file.read_text())["about"]
    about["metrics"]["speed"] = about["metrics"]["haste"]
    changed(stranger.folder, {"about": about})
    with pytest.raises(StoreError, match="built-in metrics have the names speed"):
        package.load("given", stranger.folder / "results")


def test_written_code_stays_in_its_folder(stranger: Given) -> None:
    assert "    METRICS = {" in sweep(stranger.folder, "code", "given").stdout
    done = sweep(stranger.folder, "code", "given", "--to", "theirs")
    assert done.stdout == "theirs/spec.yaml\ntheirs/mine.py\n"
    text = (stranger.folder / "theirs" / "mine.py").read_text()
    assert text == (stranger.folder / "mine.py").read_text()
    again = sweep(stranger.folder, "code", "given", "--to", "theirs")
    assert again.returncode == 2
    assert again.stderr == "theirs: exists already; name a new folder\n"


@pytest.mark.parametrize("name", [".numba_config.yaml", "spec.yaml", "matplotlibrc"])
def test_what_is_no_code_is_written_nowhere(
    name: str, stranger: Given, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Programs would read it as their settings, in the folder of a launch."""
    (file,) = (stranger.folder / "results" / "given").glob("code-*.json")
    text = (stranger.folder / "mine.py").read_text()
    changed(stranger.folder, {"files": {"mine.py": text, name: ""}})
    monkeypatch.setattr(OwnCode, "sha", file.stem.removeprefix("code-"))
    with pytest.raises(StoreError, match="a file is not code: "):
        package.load("given", stranger.folder / "results")


@pytest.mark.parametrize("folder", ["../../../..", "a/../../../../..", "/tmp", "."])
def test_a_folder_of_code_leads_out_of_no_folder_that_is_written(
    folder: str, stranger: Given
) -> None:
    """Of a stranger are the path of the spec too, and the folder of its code."""
    changed(stranger.folder, {"folder": folder})
    before = set(stranger.folder.rglob("*"))
    done = sweep(stranger.folder, "code", "given", "--to", "theirs")
    assert done.returncode == (2 if folder == "/tmp" else 0)
    new = {one for one in stranger.folder.rglob("*") if one not in before}
    theirs = stranger.folder / "theirs"
    assert all(one == theirs or one.is_relative_to(theirs) for one in new)
    assert not (stranger.folder.parent / "mine.py").exists()
    assert len([one for one in new if one.is_file()]) == (0 if done.returncode else 2)


def test_a_launch_from_python_has_said_yes(given: Given) -> None:
    study = load_spec(given.folder / "spec.yaml")
    launch(study, given.folder / "results", Serial())
    stored = StoredStudy("given", given.folder / "results")
    _, same = replay(stored, stored.trials["trial_id"][0])
    assert same
