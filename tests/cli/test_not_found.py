"""What is said where a study, a folder of results or a spec is not there: which there
are, and the way out.
"""

from pathlib import Path
from typing import Any

import pytest

from sweep.cli.app import app
from sweep.published.starting import built_in_specs
from tests.commands import sweep
from tests.studies import SMALL

READING: dict[str, tuple[str, ...]] = {
    "status": ("STUDY",),
    "table": ("STUDY",),
    "plot": ("STUDY",),
    "compare": ("STUDY", "group/small"),
    "columns": ("STUDY",),
    "posterior": ("STUDY",),
    "odds": ("STUDY", "group/small"),
    "profiles": ("STUDY",),
    "power": ("STUDY", "--half-width", "speed=1"),
    "boundary": ("STUDY",),
    "hysteresis": ("STUDY",),
    "gap": ("STUDY",),
    "resilience": ("STUDY",),
    "validity": ("STUDY",),
    "scaling": ("STUDY",),
    "replay": ("STUDY", "05d7"),
    "verify": ("STUDY",),
    "measure": ("STUDY", "speed"),
    "gc": ("STUDY", "--dry-run"),
    "rename": ("STUDY", "other"),
    "rm": ("STUDY", "--dry-run"),
    "export": ("STUDY", "--to", "file.csv"),
    "flocks": ("STUDY", "--to", "file.csv"),
    "pack": ("STUDY",),
    "cite": ("STUDY",),
    "register": ("STUDY", "--check", "registration.yaml"),
    "odd": ("STUDY",),
    "code": ("STUDY",),
    "view": ("STUDY", "--no-open"),
    "show": ("STUDY", "--to", "figure.html"),
}
"""How each command that takes a stored study is called."""
TAKE_NONE = {
    *("init", "new", "launch", "search", "plan", "reproduce", "list", "diff", "load"),
    "certify",
    *("warm", "guide", "check", "models", "maps", "metrics", "schema"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two stored studies of a group, and the specs of both."""
    folder = tmp_path_factory.mktemp("found")
    for name in ("small", "second"):
        spec = SMALL.replace("study: small", f"study: group/{name}")
        (folder / f"{name}.yaml").write_text(spec)
        assert sweep(folder, "launch", f"{name}.yaml").returncode == 0
    return folder


def said(folder: Path, *arguments: str) -> str:
    """The one line of a command that ends with exit code 2."""
    done = sweep(folder, *arguments)
    assert (done.returncode, done.stdout) == (2, "")
    (line,) = done.stderr.splitlines()
    return line


def test_every_command_that_takes_a_study_is_tried() -> None:
    """A new one is entered above."""
    commands: list[Any] = app.registered_commands
    there = {one.name or one.callback.__name__ for one in commands}
    assert there == READING.keys() | TAKE_NONE


@pytest.mark.parametrize("command", READING)
def test_every_command_says_which_studies_there_are(folder: Path, command: str) -> None:
    def of(study: str) -> list[str]:
        return [study if one == "STUDY" else one for one in READING[command]]

    there, missing = "group/second, group/small", "no study has been launched"
    assert said(folder, command, *of("group/smal")) == (
        f'results/group/smal: {missing} here; did you mean "group/small"?'
        f" Stored: {there}"
    )
    assert said(folder, command, *of("group")) == (
        f"results/group: {missing} here. Below it: {there}"
    )
    assert said(folder, command, *of("small"), "--results", "nowhere") == (
        "nowhere: no such folder of results; choose another folder, or launch a study"
        " first"
    )


@pytest.mark.parametrize(
    "command", [one for one in READING if one not in ("odd", "view")]
)
def test_a_spec_in_place_of_a_study_says_what_its_study_is(
    folder: Path, command: str
) -> None:
    """The two others take specs too."""
    given = [one.replace("STUDY", "small.yaml") for one in READING[command]]
    assert said(folder, command, *given) == (
        "results/small.yaml: no study has been launched here; small.yaml is a spec, of"
        " the study group/small"
    )


def test_there_may_be_no_study_at_all(tmp_path: Path) -> None:
    (tmp_path / "results").mkdir()
    assert said(tmp_path, "table", "small").endswith("launched here: there is none")
    assert "nothing" not in said(tmp_path, "table", "none.yaml")


@pytest.mark.parametrize("command", ["launch", "search", "plan", "diff"])
def test_a_study_in_place_of_a_spec_says_how_to_launch_it(
    folder: Path, command: str
) -> None:
    assert said(folder, command, "group/small") == (
        "group/small: no such file; a spec is a YAML file, NAME.yaml, and"
        " group/small is a stored study: sweep launch small.yaml resumes the study"
    )
    assert said(folder, command, "none.yaml") == "none.yaml: no such file"
    assert said(folder, command, "none").endswith("a spec is a YAML file, NAME.yaml")


def test_code_in_place_of_a_spec_or_a_model_says_how_it_is_named(
    tmp_path: Path,
) -> None:
    assert sweep(tmp_path, "new", "model", "vortex").returncode == 0
    assert said(tmp_path, "launch", "vortex.py") == (
        "vortex.py: is code, but a spec is a YAML file that names the code with"
        ' "model: ./vortex.py"'
    )
    for command in (("models",), ("warm",), ("init", "new.yaml", "--model")):
        assert said(tmp_path, *command, "vortex") == (
            'unknown model "vortex"; to use the file, write ./vortex.py'
        )


def test_a_folder_of_built_in_studies_has_its_studies_listed(tmp_path: Path) -> None:
    line = said(tmp_path, "init", "patel2023")
    assert line.endswith(
        "Allowed: " + ", ".join(one for one in built_in_specs() if "patel" in one)
    )


def test_a_study_whose_spec_is_not_here_has_a_copy_of_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """As one that somebody else has launched, in a folder that is not this one."""
    monkeypatch.chdir(tmp_path)
    given = ("launch", "group/small", "--results", str(folder / "results"))
    copy = folder / "results" / "group" / "small" / "spec.yaml"
    assert said(tmp_path, *given).endswith(f": to resume the study, copy {copy}")


def test_a_loaded_study_that_is_renamed_names_no_file_of_the_sender(
    folder: Path, tmp_path: Path
) -> None:
    assert sweep(folder, "pack", "group/small", "--to", "it.zip").returncode == 0
    loaded = sweep(tmp_path, "load", str(folder / "it.zip"), "--as", "theirs").stderr
    renamed = sweep(tmp_path, "rename", "theirs", "ours").stderr
    for said_then, name in ((loaded, "theirs"), (renamed, "ours")):
        assert said_then == (
            f"to resume the study, copy results/{name}/spec.yaml and change the line"
            f' "study: group/small" of the copy to "study: {name}"; without the change'
            " a launch starts study group/small\n"
        )


def test_a_folder_without_studies_is_no_mistake_and_none_is_one(tmp_path: Path) -> None:
    assert said(tmp_path, "list", "--results", "nowhere").startswith("nowhere: no such")
    (tmp_path / "file").touch()
    listed = said(tmp_path, "list", "--results", "file")
    assert listed.startswith("file: is not a folder")
    (tmp_path / "results").mkdir()
    done = sweep(tmp_path, "list")
    assert (done.returncode, done.stdout) == (0, "")
    assert done.stderr == "results: no study is stored here\n"
