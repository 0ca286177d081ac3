"""An object store that lies, over the wire: each answer ends in one sentence, within
bounds, and writes nothing.
"""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from xml.sax.saxutils import escape

import pytest

from sweep.errors import StoreError
from sweep.store import locations
from sweep.store.locations import ObjectPath, location
from sweep.store.store import Store
from tests import ROOT
from tests.http_servers import Answer, HttpServer, Request
from tests.object_stores import CREDENTIALS
from tests.patience import PATIENCE

PART = "00000000000000000001-aaaaaaaaaaaa"
TIME = "2026-01-01T00:00:00.000Z"


def listing(*objects: tuple[str, int], token: str = "") -> bytes:
    """What a server says of the objects below a prefix; with a token there are said to
    be more.
    """
    each = "".join(
        f"<Contents><Key>{escape(key)}</Key><LastModified>{TIME}</LastModified>"
        f"<Size>{size}</Size></Contents>"
        for key, size in objects
    )
    more = (
        "<IsTruncated>true</IsTruncated>"
        f"<NextContinuationToken>{token}</NextContinuationToken>"
        if token
        else ""
    )
    return (
        f'<?xml version="1.0"?><ListBucketResult>{each}{more}</ListBucketResult>'
    ).encode()


class Liar:
    """A server that answers listings by `lists`, and everything else by `gives`; what
    was asked is counted.
    """

    def __init__(self, lists: Answer, gives: Answer) -> None:
        self.lists, self.gives = lists, gives
        self.asked = 0
        self.server = HttpServer(self.answer)

    def answer(self, request: Request) -> None:
        """What it says to one request."""
        if request.command == "HEAD":
            answer(b"")(request)
            return
        self.asked += 1
        (self.lists if "list-type" in request.path else self.gives)(request)

    @property
    def url(self) -> str:
        server = f"endpoint_override=127.0.0.1:{self.server.port}&scheme=http"
        return f"s3://bucket/results?{server}&region=us-east-1"


def answer(
    body: bytes, status: int = 200, size: int | None = None, **headers: str
) -> Answer:
    """An answer of so many bytes as it says, or not."""

    def said(request: Request) -> None:
        request.send_response(status)
        for name, value in headers.items():
            request.send_header(name, value)
        request.send_header("Content-Length", str(len(body) if size is None else size))
        request.end_headers()
        request.wfile.write(body)

    return said


@contextmanager
def lying(lists: Answer, gives: Answer) -> Iterator[Liar]:
    liar = Liar(lists, gives)
    try:
        yield liar
    finally:
        liar.server.close()


@pytest.fixture(autouse=True)
def _credentials(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in CREDENTIALS.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(locations, "ATTEMPTS", 1)
    monkeypatch.setattr(locations, "PATIENCE_SECONDS", 0.5)


def store_of(liar: Liar) -> Store:
    place = location(liar.url)
    assert isinstance(place, ObjectPath)
    return Store(place / "study")


BELOW = f"results/study/parts/{PART}"
WEIRD = [
    "../../../up",
    "..",
    "/etc/x",
    "a/../../../up",
    "./x",
    "a\\b",
    "\x7f",
    "%2e%2e/up",
    "x" * 900,
    "con",
    "~/x",
]


def test_names_from_a_listing_never_leave_the_folder_of_downloads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "inner" / "most"))
    (tmp_path / "inner" / "most").mkdir(parents=True)
    for name in WEIRD:
        found = listing((f"{BELOW}/manifest.json", 2), (f"{BELOW}/{name}", 2))
        with lying(answer(found), answer(b"{}")) as liar:
            store = store_of(liar)
            with (
                suppress(StoreError),
                store.place.fetched(store.all_parts()) as folders,
            ):
                inside = {path for folder in folders for path in folder.rglob("*")}
                assert {
                    path for path in tmp_path.rglob("*") if path.is_file()
                } <= inside
        assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


BOMB = (
    b'<?xml version="1.0"?><!DOCTYPE l [<!ENTITY a "aaaaaaaaaa">'
    + b"".join(
        b'<!ENTITY %c "%s">' % (c, b"&%c;" % (c - 1) * 10)
        for c in range(ord("b"), ord("k"))
    )
    + b"]><ListBucketResult><Contents><Key>&j;</Key><Size>1</Size></Contents>"
    + b"</ListBucketResult>"
)
LISTS = {
    "no xml": b"what?",
    "html": b"<html><body>Sign in</body></html>",
    "nothing": b"",
    "a bomb": BOMB,
    "an entity": (
        b"<!DOCTYPE l [<!ENTITY a SYSTEM"
        b' "file:///etc/passwd">]><ListBucketResult>&a;</ListBucketResult>'
    ),
    "sizes that are none": (
        listing((f"{BELOW}/manifest.json", 1)).replace(b"<Size>1<", b"<Size>-9e99<")
    ),
    "nesting": b"<a>" * 100_000,
}


def test_a_listing_that_is_none_is_one_sentence_or_empty() -> None:
    with ExitStack() as stack:
        liars = [
            stack.enter_context(lying(answer(found), answer(b"{}")))
            for found in LISTS.values()
        ]
        for what, sentence in zip(LISTS, said(*liars), strict=True):
            assert "\n" not in sentence, what


SCRIPT = """
import json, sys
from sweep.store import locations
from tests.memory import most_megabytes
locations.ATTEMPTS, locations.PATIENCE_SECONDS = 1, 0.5
from sweep.store.store import Store
for url in sys.argv[1:]:
    said = ""
    try:
        with Store(locations.location(url) / "study").place.fetched(
            Store(locations.location(url) / "study").all_parts()
        ):
            pass
    except locations.StoreError as error:
        said = str(error)
    print(json.dumps(said))
print(most_megabytes(), file=sys.stderr)
"""
MOST_MEGABYTES = 1500


def said(*liars: Liar) -> list[str]:
    """What reading all parts of each store says, nothing where there is none, in a
    process of its own whose memory is bounded.
    """
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, *(liar.url for liar in liars)],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        cwd=ROOT,
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stderr.splitlines()[-1]) < MOST_MEGABYTES
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_an_object_larger_than_its_listing_is_not_fetched() -> None:
    found = listing((f"{BELOW}/manifest.json", 2), (f"{BELOW}/trials.parquet", 10))
    with lying(answer(found), answer(b"x" * 50_000_000)) as liar:
        assert "not have the 2 bytes that the server listed" in said(liar)[0]
