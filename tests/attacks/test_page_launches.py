"""What a page may have launched: one spec, by the user's own page alone."""

import http.client
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from sweep.errors import ChoiceError, SpecError, UserError
from sweep.explorer.site import explorer
from sweep.web.launching import Launcher
from sweep.web.protocol import MOST_BYTES
from sweep.web.server import PageServer
from tests.patience import PATIENCE
from tests.studies import SMALL, launched
from tests.web.chromium import in_a_thread

MORE = SMALL.replace("replicates: 3", "replicates: 4")
OURS = "ours"
Post = Callable[..., tuple[int, Any]]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("launches")
    (folder / "spec.yaml").write_text(SMALL)
    launched(SMALL, folder / "results")
    return folder


@pytest.fixture(scope="module")
def launcher(folder: Path) -> Launcher:
    return Launcher(folder / "spec.yaml", folder / "results")


@pytest.fixture(scope="module")
def server(folder: Path, launcher: Launcher) -> Iterator[PageServer]:
    made = explorer(folder / "results", None, launcher=launcher)[0]
    with in_a_thread(made) as server:
        yield server


def sent(
    server: PageServer,
    action: str,
    content: bytes,
    *,
    method: str = "POST",
    path: str = "",
    **headers: str,
) -> tuple[int, Any]:
    """Status and content of an answer to a script of the page, but for what differs."""
    address = urlsplit(server.url)
    usual = {
        "Host": address.netloc,
        "Origin": f"http://{address.netloc}",
        "Content-Type": "application/json",
    }
    given = usual | {name.replace("_", "-"): text for name, text in headers.items()}
    kept = {name: text for name, text in given.items() if text}
    connection = http.client.HTTPConnection(address.netloc, timeout=PATIENCE)
    connection.request(method, f"{path or address.path}do/{action}", content, kept)
    response = connection.getresponse()
    said = response.read()
    connection.close()
    is_json = response.headers.get_content_type() == "application/json"
    return response.status, json.loads(said) if is_json else said


def body(**texts: Any) -> bytes:
    return json.dumps(texts).encode()


@pytest.mark.parametrize(
    ("status", "about"),
    [
        (404, {"Origin": ""}),
        (404, {"Origin": "null"}),
        (404, {"Origin": "http://evil.example"}),
        (404, {"Host": "evil.example:80", "Origin": "http://evil.example:80"}),
        (404, {"path": "/wrong/"}),
        (405, {"method": "GET"}),
        (405, {"method": "PUT"}),
        (400, {"Content_Type": "text/plain"}),
        (400, {"Content_Type": ""}),
    ],
)
@pytest.mark.parametrize("action", ["propose", "launch", "stop"])
def test_only_a_script_of_the_page_itself_is_heard(
    server: PageServer,
    folder: Path,
    launcher: Launcher,
    action: str,
    status: int,
    about: dict[str, str],
) -> None:
    content = body(yaml=MORE, seen=launcher.proposed(MORE).digest)
    assert sent(server, action, content, **about)[0] == status
    assert (folder / "spec.yaml").read_text() == SMALL
    assert launcher.started is None


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{",
        b"[]",
        b"null",
        b'"text"',
        b"\xff\xfe",
        b"[" * 100_000,
        body(),
        body(yaml=3, seen=""),
        body(yaml=MORE, seen=None),
        body(yaml=MORE, seen="", file="/tmp/other.yaml"),
        body(yaml=MORE, seen="0" * 64),
        body(yaml="a: b: c", seen=""),
        body(yaml="!!python/object/apply:os.system [ls]", seen=""),
        body(yaml="x" * (MOST_BYTES + 1), seen=""),
    ],
)
def test_a_malformed_message_is_refused_in_a_sentence(
    server: PageServer, folder: Path, launcher: Launcher, content: bytes
) -> None:
    status, said = sent(server, "launch", content)
    assert status == 400
    assert list(said) == ["error"]
    assert (folder / "spec.yaml").read_text() == SMALL
    assert launcher.started is None


def test_no_other_action_is_known(server: PageServer) -> None:
    assert sent(server, "write", body(yaml=MORE))[0] == 404


def test_a_page_that_only_reads_launches_nothing(folder: Path) -> None:
    with in_a_thread(explorer(folder / "results", None)[0]) as server:
        for action, content in (
            ("propose", body(yaml=MORE)),
            ("launch", body(yaml=MORE, seen="")),
            ("stop", body()),
        ):
            status, said = sent(server, action, content)
            assert status == 400
            assert said["error"].startswith("This page only reads")


CODE = """from pathlib import Path

Path(__file__).with_name("ran").touch()
MODEL = None
"""


@pytest.mark.parametrize("model", ["./other.py", "../other.py", "other.py:MODEL"])
def test_a_text_of_a_page_runs_no_code_that_lies_there(
    folder: Path, launcher: Launcher, model: str
) -> None:
    for place in (folder, folder.parent):
        (place / "other.py").write_text(CODE)
    text = SMALL.replace("model: nguyen2024", f"model: {model}")
    with pytest.raises(SpecError, match="unknown model"):
        launcher.launch(text, launcher.proposed(SMALL).digest)
    assert not list(folder.parent.glob("**/ran"))
    assert launcher.started is None


@pytest.mark.parametrize("name", ["../out", "/tmp/out", "a/../../out", ".out", "a//b"])
def test_no_name_of_a_study_leads_out_of_the_results(
    launcher: Launcher, name: str
) -> None:
    text = SMALL.replace("study: small", f"study: {name}")
    with pytest.raises(UserError):
        launcher.proposed(text)


def test_what_was_stored_elsewhere_is_not_launched(folder: Path) -> None:
    """A study of the results that is not that of the file: its spec is a stranger's."""
    launched(SMALL.replace("study: small", "study: theirs"), folder / "results")
    launcher = Launcher(folder / "spec.yaml", folder / "results")
    made = explorer(folder / "results", None, launcher=launcher)[0]
    with in_a_thread(made) as server:
        address = urlsplit(server.url)
        connection = http.client.HTTPConnection(address.netloc, timeout=PATIENCE)
        asked = "ask/refine?study=theirs&between=separation_weight+0+1"
        connection.request("GET", address.path + asked)
        said = json.loads(connection.getresponse().read())
        connection.close()
    assert said["command"] == (f"sweep launch spec.yaml --results {folder / 'results'}")
    assert "a spec of another study" in said["why_not"]
    assert said["seen"] == ""


def test_a_link_in_the_place_of_the_file_is_refused(folder: Path) -> None:
    (folder / "target.yaml").write_text(SMALL)
    (folder / "link.yaml").symlink_to("target.yaml")
    with pytest.raises(ChoiceError, match="is a link"):
        Launcher(folder / "link.yaml", folder / "results")
