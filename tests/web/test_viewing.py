"""The command `sweep view`, short of serving."""

from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import pytest
from typer.testing import CliRunner

from sweep.cli import app
from sweep.cli.viewing import _chosen
from sweep.errors import SpecError, UserError
from sweep.web.server import PageServer
from tests.own_models import MAPS, OTHER_RULE, edited, written
from tests.studies import SMALL, launched


@pytest.fixture
def told() -> list[str]:
    """What the command has said to stderr, each time."""
    return []


@pytest.fixture
def addresses() -> list[str]:
    """The addresses that the command has printed."""
    return []


@pytest.fixture
def viewed(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    told: list[str],
    addresses: list[str],
) -> Callable[..., Any]:
    """Runs `sweep view` up to the point where it would serve, and returns what it
    shows.
    """
    shown: list[Any] = []

    def run(server: PageServer) -> None:
        server.socket.close()
        shown.append(server.rooms.begin())

    monkeypatch.setattr(PageServer, "run", run)
    monkeypatch.setattr("webbrowser.open", shown.append)

    def viewed(*arguments: str) -> Any:
        shown.clear()
        done = CliRunner().invoke(app, ["view", *arguments, "--results", str(tmp_path)])
        told.append(done.stderr)
        if done.exception:
            raise done.exception
        assert done.stdout.startswith("http://127.0.0.1:")
        addresses.append(done.stdout.strip())
        assert [one for one in shown if isinstance(one, str)] == (
            [] if "--no-open" in arguments else [done.stdout.strip()]
        )
        return shown[-1]

    return viewed


def test_the_command_shows_a_preset_a_spec_a_study_and_a_trial(
    viewed: Callable[..., Any], tmp_path: Path
) -> None:
    assert (
        viewed(
            "--model", "nanobot", "--preset", "as_written", "--map", "random_obstacles"
        ).state.job.settings["map"]
        == "random_obstacles"
    )
    stored = launched(SMALL, tmp_path).trials
    (tmp_path / "spec.yaml").write_text(SMALL)
    first = stored.iloc[0]
    for arguments in (
        (str(tmp_path / "spec.yaml"),),
        ("small",),
        ("small", stored["trial_id"][4]),
    ):
        show = viewed(*arguments, "--no-open")
        assert show.state.job.point == (
            stored["point"][4] if len(arguments) == 2 else first["point"]
        )
        assert show.state.job.seed == 5
        if arguments == ("small",):
            show.show_trial(1, 2)
            assert show.state.opened.job.trial_id == stored["trial_id"][5]
    assert show.status()["replay"]["equal"]


def test_a_link_of_another_machine_opens_here(
    viewed: Callable[..., Any], addresses: list[str], tmp_path: Path
) -> None:
    point = str(launched(SMALL, tmp_path).trials["point"].iloc[-1])
    state = {"spec": SMALL, "point": point, "replicate": "1", "step": "7"}
    part = urlencode(state)
    show = viewed(f"http://127.0.0.1:1/ab/#{part}", "--no-open")
    assert (show.state.job.point, show.state.opened.replicate) == (point, 1)
    assert addresses[-1].endswith(f"/#{part}")
    assert not addresses[-1].startswith("http://127.0.0.1:1/")


@pytest.mark.parametrize(
    ("state", "words"),
    [
        ({}, "the address has no spec"),
        ({"spec": SMALL, "replicate": "-1"}, "no number of a replicate"),
        ({"spec": SMALL, "replicate": "9" * 5000}, "no number of a replicate"),
        ({"spec": SMALL, "point": "zzz"}, "has no point zzz with replicate 0"),
        ({"spec": "study: a"}, "link.yaml"),
        ({"spec": f"{SMALL}model: ./rules.py"}, "link.yaml"),
    ],
)
def test_a_link_without_a_spec_is_refused(
    viewed: Callable[..., Any], state: dict[str, str], words: str
) -> None:
    with pytest.raises(SpecError, match=words):
        viewed(f"http://127.0.0.1:1/#{urlencode(state)}")


def test_an_address_that_is_none_is_refused(viewed: Callable[..., Any]) -> None:
    with pytest.raises(SpecError, match="the address cannot be read"):
        viewed("http://[")


def test_a_link_takes_no_other_parameters(viewed: Callable[..., Any]) -> None:
    link = f"http://127.0.0.1:1/#{urlencode({'spec': SMALL})}"
    for more in (["05d7"], ["--set", "n=5"], ["--launch", "new.yaml"]):
        with pytest.raises(SystemExit):
            viewed(link, *more)


def test_without_an_argument_the_command_opens_the_demos(
    viewed: Callable[..., Any], addresses: list[str]
) -> None:
    viewed("--no-open")
    assert addresses[-1].endswith("/start.html")
    viewed("--model", "nanobot", "--no-open")
    assert addresses[-1].endswith("/")


def test_settings_are_given_on_the_command_line(
    viewed: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "spec.yaml").write_text(SMALL)
    for first in ("--model=nguyen2024", str(tmp_path / "spec.yaml")):
        show = viewed(first, "--set", "n=7", "--set", "borders=open", "--no-open")
        assert show.state.settings["n"] == 7
        assert show.state.settings["borders"] == "open"
        assert "n: 7" in show.state.as_text()
    for wrong, words in (
        ("nn=7", 'unknown parameter "nn"'),
        ("n=many", "n"),
        ("n=[", "--set"),
    ):
        with pytest.raises(SpecError, match=words):
            viewed("--set", wrong)
    for arguments in (("--set", "n"), ("small", "05d7", "--set", "n=7")):
        with pytest.raises(SystemExit):
            viewed(*arguments)


def test_the_command_shows_an_old_trial_by_the_code_of_then(
    viewed: Callable[..., Any], tmp_path: Path, told: list[str]
) -> None:
    """With a map of one's own, which nothing compiles."""
    (tmp_path / "places.py").write_text(MAPS)
    spec = tmp_path / "spec.yaml"
    spec.write_text(SMALL.replace("n: 12,", "n: 12, map: ./places.py,"))
    study = launched(spec, tmp_path)
    assert viewed(str(spec), "--no-open").state.job.settings["map"] == "pillar"
    now = study.running(study.provenance)
    edited(tmp_path, "9.0, 9.0, 1.0", "19.0, 19.0, 1.0")
    for arguments in (("small",), ("small", study.plan["trial_id"][0].as_py())):
        show = viewed(*arguments, "--no-open")
        assert show.state.job.catalogue is now
        assert "places.py: another file now; the original code runs" in told[-1]
    assert viewed(str(spec), "--no-open").state.job.catalogue is not now


def test_a_model_may_be_that_of_a_file(tmp_path: Path) -> None:
    """What the command shows, before anything is compiled for it."""
    written(tmp_path)
    state = _chosen(str(tmp_path / "drawn.py"), None, None, code=True)
    assert state.job.model == "drawn"
    with pytest.raises(UserError, match=r"drawn\.py"):
        _chosen(str(tmp_path / "drawn.py"), None, None, code=False)


@pytest.mark.slow
def test_the_command_shows_an_own_model_and_an_old_trial_by_the_code_of_then(
    viewed: Callable[..., Any], tmp_path: Path, told: list[str]
) -> None:
    spec = written(tmp_path)
    study = launched(spec, tmp_path)
    model = viewed("--model", str(tmp_path / "drawn.py"), "--no-open")
    assert model.state.job.model == "drawn"
    assert viewed(str(spec), "--no-open").state.job.settings["map"] == "pillar"
    now = study.running(study.provenance)
    edited(tmp_path, *OTHER_RULE)
    for arguments in (("drawn",), ("drawn", study.plan["trial_id"][0].as_py())):
        show = viewed(*arguments, "--no-open")
        assert show.state.job.catalogue is now
        assert "rules.py: another file now; the original code runs" in told[-1]
    assert viewed(str(spec), "--no-open").state.job.catalogue is not now


def test_the_command_says_what_is_wrong_before_it_serves(
    viewed: Callable[..., Any], tmp_path: Path
) -> None:
    launched(SMALL, tmp_path)
    for arguments, words in (
        (("--model", "nguyen"), 'unknown model "nguyen"; did you mean "nguyen2024"'),
        (("--map", "arena"), "map arena is measured in m"),
        (("none.yaml",), r"none\.yaml: no such file"),
        (("none",), "no study has been launched here"),
        (("smal",), 'no study has been launched here; did you mean "small"'),
    ):
        with pytest.raises(Exception, match=words) as refused:
            viewed(*arguments)
        assert type(refused.value).__name__ in ("SpecError", "StoreError")
    for arguments in (("small", "--model", "nanobot"), ("spec.yaml", "05d7")):
        with pytest.raises(SystemExit):
            viewed(*arguments)
