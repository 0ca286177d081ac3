"""The server as a page meets it, over real sockets, without a browser."""

import asyncio
import http.client
import json
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Coroutine, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from kernels.models import MODELS
from sweep.design.jobs import Job
from sweep.errors import SpecError
from sweep.trial import compiled_for
from sweep.trial.state import Taken
from sweep.web import compiling, messages, playing, rooms
from sweep.web.encoding import HEAD
from sweep.web.live_show import Live
from sweep.web.outbox import MOST_WAITING, Outbox
from sweep.web.playing import Player
from sweep.web.protocol import Reply
from sweep.web.rooms import REFUSED, TAKEN
from sweep.web.server import PageServer
from sweep.web.state import begin
from tests.patience import PATIENCE
from tests.studies import launched
from tests.web.chromium import in_a_thread


class Watched(Live):
    """A live run that keeps every frame in full."""

    def advance(self, steps: int) -> Taken:
        taken = super().advance(steps)
        self.kept += list(taken.bodies)
        return taken

    def _begin(self, *arguments: Any) -> None:
        super()._begin(*arguments)
        self.kept = [self.bodies]


SHOWS: list[Watched] = []


def watched() -> Watched:
    SHOWS.append(
        Watched(begin("nguyen2024", "as_run").with_settings({"n": 20, "steps": 200}))
    )
    return SHOWS[-1]


@pytest.fixture(scope="module")
def server() -> Iterator[PageServer]:
    with pytest.MonkeyPatch.context() as patch, in_a_thread(PageServer(watched)) as one:
        patch.setattr(rooms, "PATIENCE", PATIENCE)  # the first show loads the kernels
        yield one


@pytest.fixture(autouse=True)
def _empty(server: PageServer) -> Iterator[None]:
    """Every test has the server to itself."""
    yield
    until(lambda: all(player.task is None for player in server.rooms.players.values()))
    server.rooms.players.clear()
    SHOWS.clear()


def until(condition: Callable[[], bool]) -> None:
    """Wait for a condition."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, "it never came"
        time.sleep(0.005)


class Page:
    """The other end: says hello, takes what comes, and keeps the last message of each
    type.
    """

    def __init__(self, server: PageServer, name: str = "one", **options: Any) -> None:
        address = urlsplit(server.url)
        about = {
            "origin": f"http://{address.netloc}",
            "open_timeout": PATIENCE,
        } | options
        self.connection = connect(f"ws://{address.netloc}{address.path}socket", **about)
        self.name = name
        self.last: dict[str, dict[str, Any]] = {}
        self.frames: list[bytes] = []

    def __enter__(self) -> "Page":
        self.socket: ClientConnection = self.connection.__enter__()
        self.say("hello", page=self.name)
        return self

    def __exit__(self, *error: Any) -> None:
        self.connection.__exit__(*error)

    def say(self, kind: str, /, **keys: Any) -> None:
        self.socket.send(json.dumps({"type": kind} | keys))

    def hear(self) -> str:
        """Take one message, and return its type."""
        content = self.socket.recv(PATIENCE)
        if isinstance(content, bytes):
            self.frames.append(content)
            return "frame"
        message = json.loads(content)
        self.last[message["type"]] = message
        return str(message["type"])

    def wait(
        self, kind: str, fits: Callable[[dict[str, Any]], bool] = lambda _: True
    ) -> dict[str, Any]:
        """Take messages until one of this type fits."""
        while self.hear() != kind or not fits(self.last.get(kind, {})):
            pass
        return self.last.get(kind, {})

    def ask(self, kind: str, /, **keys: Any) -> dict[str, Any]:
        """Say something that is answered by the state."""
        self.say(kind, **keys)
        return self.wait("state")

    def go(self, step: int) -> dict[str, Any]:
        """From the start to this step."""
        self.say("step", count=step)
        return self.wait("state", lambda state: state["step"] == step)

    @property
    def step(self) -> int:
        """The step of the last frame."""
        return int(HEAD.unpack_from(self.frames[-1])[2])


def test_hello_is_answered_by_controls_scene_state_metrics_and_a_frame(
    server: PageServer,
) -> None:
    with Page(server) as page:
        heard = [page.hear() for _ in range(6)]
        assert heard == ["controls", "scene", "state", "metrics", "selection", "frame"]
        assert page.last["state"]["settings"]["n"] == 20
        assert len(page.last["scene"]["obstacles"]) == 6
        assert page.last["metrics"]["steps"] == [0]
        assert page.step == 0


def test_who_waits_for_the_compiler_is_told(
    server: PageServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rooms, "PATIENCE", 0.01)
    told = threading.Event()

    def compiled() -> Live:
        assert told.wait(PATIENCE)
        return watched()

    monkeypatch.setattr(server.rooms, "begin", compiled)
    with Page(server) as page:
        assert page.hear() == "info"
        assert page.last["info"]["message"] == "preparing the run"
        monkeypatch.setattr(compiling, "IN_PROGRESS", ["compiling nguyen2024"])
        assert page.hear() == "info"
        assert page.last["info"]["message"] == "compiling nguyen2024"
        told.set()
        assert page.hear() == "controls"


def test_other_pages_go_on_while_a_model_or_a_metric_is_compiled(
    server: PageServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The compiler works until it is told to end, and the page that waits for it is
    told so at once.
    """
    ended, begun = threading.Event(), list[str]()

    def compiler(job: Job) -> None:
        begun.append(f"{job.model} {' '.join(job.record.metrics)}")
        assert ended.wait(PATIENCE)

    with Page(server, "one") as one, Page(server, "two") as two:
        one.wait("frame")
        two.wait("frame")
        two.go(3)
        compiling.PREPARED.clear()
        monkeypatch.setattr(compiling, "_apart", compiler)
        monkeypatch.setattr(compiling, "is_compiled", lambda _: False)
        two.say("metrics", names=["elongation"])
        assert two.wait("info")["message"] == "compiling elongation, once: some seconds"
        assert one.go(5)["step"] == 5
        ended.set()
        assert two.wait("state")["plots"] == ["elongation"]
        ended.clear()
        monkeypatch.setattr(compiling, "compiling_seconds", lambda _: 15.0)
        two.say("model", model="patel2023", preset="as_run")
        assert two.wait("info")["message"] == (
            "compiling patel2023, once: about 15 s on an idle core"
        )
        one.say("step", count=4)
        assert one.wait("state", lambda state: state["step"] == 9)
        ended.set()
        assert two.wait("state")["model"] == "patel2023"
    assert [name for name in begun if name.startswith("nguyen")] == [
        "nguyen2024 elongation"
    ]
    assert begun[1].startswith("patel2023")


def test_what_is_compiled_is_what_the_spec_needs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Not what the preset of its model needs: layers of robots, goals in turn, polygons
    and moving obstacles are other kernels.
    """
    begun = list[Job]()
    monkeypatch.setattr(compiling, "_apart", begun.append)
    monkeypatch.setattr(compiling, "_take_one_step", lambda _: None)
    monkeypatch.setattr(compiling, "waiting", lambda job, _: compiled_for(job))
    monkeypatch.setattr(compiling, "PREPARED", set())
    state = begin("aziel_chen2025", "as_run").with_settings({"n": 5})
    polygon = {"polygon": {"vertices": [[30.0, 20.0], [36.0, 21.0], [33.0, 27.0]]}}
    lossy = state.with_settings({"packet_loss": 0.2, "motor_max_speed": 4.0})
    for shown in (
        state,
        state.with_settings({"cohesion_weight": 0.1}),
        lossy,
        lossy.place([polygon]).with_settings({"next_goals": "10 10; 20 20"}),
    ):
        compiling.prepare(shown.job, ("speed",))
    assert [compiled_for(job) for job in begun] == [
        "aziel_chen2025",
        "aziel_chen2025 with sensing, actuation",
        "aziel_chen2025 with sensing, actuation, waypoints, polygons",
    ]


def test_messages_that_need_other_kernels_say_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    show = Live(begin("aziel_chen2025", "as_run").with_settings({"n": 5}))
    polygon = {"polygon": {"vertices": [[30.0, 20.0], [36.0, 21.0], [33.0, 27.0]]}}
    monkeypatch.setattr(compiling, "compiling_seconds", lambda _: 15.0)
    for message, words in (
        (messages.Set("packet_loss", 0.2), "aziel_chen2025 with sensing"),
        (messages.Set("motor_max_speed", 4.0), "aziel_chen2025 with actuation"),
        (messages.Shapes([polygon]), "aziel_chen2025 with polygons"),
        (messages.ChooseModel("vicsek1995", "as_run"), "vicsek1995"),
        (messages.Beside("as_written"), "aziel_chen2025"),
    ):
        about = "once: about 15 s on an idle core"
        assert show.waiting(message) == f"compiling {words}, {about}"
    assert show.waiting(messages.Select(1)) == ""


def test_the_compiler_of_a_page_works_in_a_process_of_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ended = []
    run = subprocess.run

    def noted(*given: Any, **about: Any) -> object:
        ended.append(run(*given, **about))
        return ended[-1]

    monkeypatch.setattr(subprocess, "run", noted)
    monkeypatch.setattr(compiling, "is_compiled", lambda _: False)
    compiling.PREPARED.clear()
    compiling.prepare(begin("nguyen2024", "as_run").job, ("speed",))
    assert [(one.returncode, one.stderr) for one in ended] == [(0, b"")]


def test_a_session_over_the_socket_has_the_bits_of_a_launch_of_its_spec(
    server: PageServer, tmp_path: Path
) -> None:
    with Page(server) as page:
        page.wait("frame")
        page.go(3)
        page.ask("set", name="cohesion_weight", value=0.4)
        assert not page.last["state"]["exact"]
        page.ask("reset")
        page.say("speed", steps_per_second=0)
        page.say("overlays", names=["flocks", "accelerations", "coverage"])
        page.say("select", boid=3)
        page.say("run")
        while page.last["state"]["step"] < 200:
            if page.hear() == "frame":
                page.say("ready")
        assert page.last["state"]["exact"]
        page.say("spec")
        stored = launched(page.wait("spec")["yaml"], tmp_path)
    frames = [
        np.stack(stored.trajectories[name].to_list()) for name in ("x", "y", "vx", "vy")
    ]
    np.testing.assert_array_equal(np.array(SHOWS[0].kept).transpose(1, 0, 2), frames)
    assert stored.trials["trial_id"][0] == SHOWS[0].state.job.trial_id


def test_the_state_after_a_message_has_its_id_whether_it_was_refused_or_not(
    server: PageServer,
) -> None:
    with Page(server) as page:
        page.wait("frame")
        assert page.ask("set", name="drag", value=0.2, id="a")["answers"] == "a"
        assert page.ask("set", name="drag", value=2, id="b")["answers"] == "b"
        assert page.ask("jump", id="c")["answers"] == "c"
        assert page.ask("spec", id="d")["answers"] == "d"
        assert page.ask("run")["answers"] == ""


def test_steps_asked_for_in_a_row_are_all_taken(server: PageServer) -> None:
    with Page(server) as page:
        page.wait("frame")
        for _ in range(5):
            page.say("step")
        page.say("step", count=5)
        page.wait("state", lambda state: state["step"] == 10)


def test_stepping_does_not_wait_for_a_page_that_draws_nothing(
    server: PageServer,
) -> None:
    """Which gets one frame, and the latest one when it is ready again. At full speed
    only these are measured.
    """
    with Page(server) as page:
        page.wait("frame")
        page.say("speed", steps_per_second=0)
        page.say("run")
        page.wait("state", lambda state: state["step"] == 200)
        assert len(page.frames) == 1
        assert len(SHOWS[0].kept) == 201
        page.say("ready")
        page.wait("frame")
        assert page.step == 200
        assert page.last["metrics"]["steps"] == [200]


class Stuck:
    """A line to a page that asks and asks, and takes nothing."""

    def __init__(self) -> None:
        self.heard, self.flooded = 0, asyncio.Event()

    async def hear(self) -> str:
        self.heard += 1
        if self.heard > 2 * MOST_WAITING:
            self.flooded.set()
        return '{"type": "pause"}'

    async def tell(self, _reply: Reply) -> None:
        await asyncio.Event().wait()

    async def show(self, _frame: bytes) -> None:
        await asyncio.Event().wait()


def test_a_page_that_takes_nothing_is_not_listened_to_for_ever(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def play() -> int:
        line, player, full = Stuck(), Player(watched()), asyncio.Event()

        class Noted(Outbox):
            async def room(self) -> None:
                if not self._room.is_set():
                    full.set()
                await super().room()

        monkeypatch.setattr(playing, "Outbox", Noted)
        task = asyncio.create_task(player.play(line))
        ends = [asyncio.create_task(one.wait()) for one in (full, line.flooded)]
        await asyncio.wait(ends, timeout=PATIENCE, return_when=asyncio.FIRST_COMPLETED)
        for _ in range(1000):  # what is ready to run runs
            await asyncio.sleep(0)
        assert full.is_set()
        assert not line.flooded.is_set()
        for one in (task, *ends):
            one.cancel()
        return line.heard

    # In this thread the browser of other tests may have its event loop.
    with ThreadPoolExecutor() as threads:
        assert 1 < threads.submit(asyncio.run, play()).result() <= MOST_WAITING


def test_a_run_keeps_to_its_pace_or_is_slower(server: PageServer) -> None:
    with Page(server) as page:
        page.wait("frame")
        page.say("speed", steps_per_second=50)
        began = time.monotonic()
        page.say("run")
        until(lambda: SHOWS[0].step >= 10)
        assert SHOWS[0].step <= 2 + 50 * (time.monotonic() - began)


def test_a_page_that_comes_back_finds_its_session(server: PageServer) -> None:
    with Page(server) as page:
        page.wait("frame")
        page.go(5)
        page.ask("set", name="drag", value=0.2)
        page.socket.socket.close()
    with Page(server) as again, Page(server, "other") as other:
        assert again.wait("state")["settings"]["drag"] == 0.2
        again.wait("frame")
        assert again.step == 5
        assert again.last["metrics"]["reset"]
        assert again.last["metrics"]["steps"] == [0, 1, 2, 3, 4, 5]
        assert other.wait("state")["settings"]["drag"] == 0.1


def test_a_session_stands_still_while_nobody_looks_and_goes_on_afterwards(
    server: PageServer,
) -> None:
    with Page(server) as page:
        page.wait("frame")
        page.say("speed", steps_per_second=20)
        page.ask("run")
        until(lambda: SHOWS[0].step > 0)  # or no run has begun that could stop
    until(lambda: server.rooms.players["one"].task is None)
    before = SHOWS[0].step
    time.sleep(0.2)
    assert SHOWS[0].step == before
    with Page(server) as page:
        assert page.wait("state")["running"]
        until(lambda: SHOWS[0].step > before)


def test_a_session_that_another_page_takes_is_closed_for_the_first(
    server: PageServer,
) -> None:
    with Page(server) as first:
        first.wait("frame")
        with Page(server) as second:
            second.wait("frame")
            with pytest.raises(ConnectionClosed) as closed:
                first.wait("nothing")
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == TAKEN
            assert second.go(1)["exact"]


@pytest.mark.parametrize(
    ("sent", "words"),
    [
        ("{", "a message must be JSON"),
        (b"\x00\x01", "a message must be JSON"),
        ('{"type": "rnu"}', 'unknown message "rnu"; did you mean "run"'),
        ('{"type": "undo"}', "there is nothing to undo"),
        ('{"type": "run", "side": 1}', "there is no second run next to this run"),
        (
            '{"type": "set", "name": "darg", "value": 1}',
            'unknown parameter "darg"; did you mean "drag"',
        ),
        (
            '{"type": "set", "name": "drag", "value": 2}',
            "2 is not allowed for drag; allowed: a number from 0 to 1",
        ),
        (
            '{"type": "set", "name": "start_margin", "value": 900}',
            "start_margin leaves boids no room",
        ),
        (
            '{"type": "shapes", "shapes": [{"disc": {"x": {"y": 1}}}]}',
            'missing key "y"',
        ),
        ('{"type": "export", "kind": "exe"}', 'unknown kind of file "exe"'),
    ],
)
def test_what_is_wrong_is_said_in_a_sentence_and_harms_nobody(
    server: PageServer, sent: str | bytes, words: str
) -> None:
    with Page(server) as page, Page(server, "other") as other:
        for one in (page, other):
            one.wait("frame")
        page.socket.send(sent)
        message = page.wait("error")["message"]
        assert message.startswith(words)
        assert "\n" not in message
        for one in (page, other):
            assert one.go(2)["exact"]


@pytest.mark.parametrize(
    ("names", "plots"),
    [
        ([], []),
        (["speed", "speed"], ["speed"]),
        (["sped"], None),
        ([""], None),
        ([[]], None),
        ({}, None),
        (None, None),
        (["speed"] * 201, None),
    ],
)
def test_no_list_of_plots_ends_a_run(
    server: PageServer, names: object, plots: list[str] | None
) -> None:
    """None, or one twice, is shown; what is no list of metrics is refused."""
    with Page(server) as page:
        page.wait("frame")
        usual = page.go(2)["plots"]
        assert page.ask("metrics", names=names)["plots"] == (
            usual if plots is None else plots
        )
        assert ("error" in page.last) is (plots is None)
        page.say("step")
        page.wait("state", lambda state: state["step"] == 3)
        page.ask("reset")
        assert page.go(5)["exact"]


def broken(*_: object) -> None:
    raise ZeroDivisionError("secret")


def test_a_bug_is_told_without_its_traceback_and_logged(
    server: PageServer,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    with Page(server) as page:
        page.wait("frame")
        monkeypatch.setattr(SHOWS[0], "handle", broken)
        page.say("run")
        assert (
            page.wait("error")["message"]
            == "the simulator failed: ZeroDivisionError; the simulator continues, and"
            " its terminal shows the details"
        )
        monkeypatch.undo()
        page.go(1)
    assert "secret" in caplog.text


def test_a_bug_in_drawing_closes_the_socket_and_is_logged(
    server: PageServer,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    with Page(server) as page:
        page.wait("frame")
        monkeypatch.setattr(SHOWS[0], "picture", broken)
        page.say("ready")
        page.say("select", boid=2)
        with pytest.raises(ConnectionClosed):
            page.wait("nothing")
    until(lambda: "secret" in caplog.text)
    monkeypatch.undo()
    with Page(server) as page:
        page.wait("frame")
        assert page.last["state"]["selected"] == 2


def in_a_loop(work: Coroutine[Any, Any, None]) -> None:
    """Run something in an event loop of its own: playwright has one in this thread."""
    with ThreadPoolExecutor(1) as thread:
        thread.submit(asyncio.run, work).result()


class Leaving:
    """The other end of the server's application, without a server between them: it says
    all at once, and leaves when it has been sent so many messages.
    """

    def __init__(
        self,
        server: PageServer,
        said: list[dict[str, Any]],
        most: int,
        error: Exception,
    ) -> None:
        self.said: list[dict[str, Any]] = [{"type": "websocket.connect"}]
        self.said += [
            {"type": "websocket.receive", "text": json.dumps(one)} for one in said
        ]
        self.most, self.error = most, error
        self.sent = 0
        self.gone = asyncio.Event()
        address = urlsplit(server.url)
        host = address.netloc.encode()
        self.scope = {
            "type": "websocket",
            "path": f"{address.path}socket",
            "query_string": b"",
            "headers": [(b"host", host), (b"origin", b"http://" + host)],
        }

    async def receive(self) -> dict[str, Any]:
        if self.said:
            return self.said.pop(0)
        await self.gone.wait()
        return {"type": "websocket.disconnect", "code": 1001}

    async def send(self, _: object) -> None:
        if self.sent >= self.most:
            self.gone.set()
            raise self.error
        self.sent += 1


HELLO = {"type": "hello", "page": "one"}
BUSY = [{"type": "ready"}, {"type": "step"}, {"type": "export", "kind": "svg"}]


@pytest.mark.parametrize("error", [OSError(), RuntimeError("after websocket.close")])
@pytest.mark.parametrize("most", range(14))
def test_a_page_may_leave_at_any_message(
    caplog: pytest.LogCaptureFixture, most: int, error: Exception
) -> None:
    """Before it is let in, in the greeting, between frames, while a file is made."""
    server = PageServer(watched)

    async def leave() -> None:
        page = Leaving(server, [HELLO, *(20 * BUSY)], most, error)
        await server.app(page.scope, page.receive, page.send)
        assert page.sent == most

    in_a_loop(leave())
    server.socket.close()
    assert caplog.text == ""


@pytest.mark.parametrize("error", [OSError(), RuntimeError("after websocket.close")])
def test_a_page_may_leave_while_it_is_refused_or_while_another_takes_its_place(
    caplog: pytest.LogCaptureFixture, error: Exception
) -> None:
    def refused() -> Watched:
        raise SpecError("no such model")

    async def refuse(server: PageServer) -> None:
        page = Leaving(server, [HELLO], 2, error)  # let in, and told why
        await server.app(page.scope, page.receive, page.send)

    async def replace(server: PageServer) -> None:
        first = Leaving(server, [HELLO], 5, error)
        playing = asyncio.create_task(
            server.app(first.scope, first.receive, first.send)
        )
        while "one" not in server.rooms.players:
            await asyncio.sleep(0)
        first.most = 0  # its last message is that it is closed
        second = Leaving(server, [HELLO, *BUSY], 3, error)
        await server.app(second.scope, second.receive, second.send)
        await playing

    for begun, leave in ((refused, refuse), (watched, replace)):
        server = PageServer(begun)
        in_a_loop(leave(server))
        server.socket.close()
    assert caplog.text == ""


def test_a_page_may_leave_while_its_run_is_compiled_and_come_back(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Told that it waits, it is gone; what was begun for it is there for its return."""
    monkeypatch.setattr(rooms, "PATIENCE", 0.0)
    left = threading.Event()

    def begun() -> Watched:
        assert left.wait(PATIENCE)
        return watched()

    server = PageServer(begun)

    async def leave() -> None:
        page = Leaving(server, [HELLO], 1, OSError())

        async def send(message: object) -> None:
            try:
                await page.send(message)
            finally:
                if page.gone.is_set():
                    left.set()

        await server.app(page.scope, page.receive, send)
        again = Leaving(server, [HELLO], 6, OSError())
        await server.app(again.scope, again.receive, again.send)
        assert again.sent == 6

    in_a_loop(leave())
    server.socket.close()
    assert len(SHOWS) == 1
    assert caplog.text == ""


def test_a_message_too_long_closes_the_socket_and_leaves_the_session(
    server: PageServer,
) -> None:
    with Page(server) as page:
        page.wait("frame")
        page.go(4)
        page.socket.send(" " * (2**20 + 1))
        with pytest.raises(ConnectionClosed):
            page.wait("nothing")
    with Page(server) as again:
        again.wait("frame")
        assert again.step == 4


def test_a_page_says_hello_first(server: PageServer) -> None:
    address = urlsplit(server.url)
    with connect(
        f"ws://{address.netloc}{address.path}socket", origin=f"http://{address.netloc}"
    ) as plain:  # type: ignore[arg-type]
        plain.send('{"type": "run"}')
        assert json.loads(plain.recv(PATIENCE)) == {
            "type": "error",
            "message": "the first message of a page must be hello",
        }
        assert SHOWS == []


@pytest.mark.parametrize(
    "change",
    [
        {"origin": "http://evil.example"},
        {"origin": None},
        {"origin": "null"},
        {"path": "/wrong/socket"},
        {"path": "/socket"},
        {"host": "evil.example:80", "origin": "http://evil.example:80"},
        {
            "host": "127.0.0.1.evil.example:80",
            "origin": "http://127.0.0.1.evil.example:80",
        },
    ],
)
def test_a_socket_from_elsewhere_is_refused(
    server: PageServer, change: dict[str, str | None]
) -> None:
    address = urlsplit(server.url)
    about = {
        "origin": f"http://{address.netloc}",
        "path": f"{address.path}socket",
        "host": address.netloc,
    } | change
    uri = f"ws://{about['host']}{about['path']}"
    options = {"address": (address.hostname, address.port), "origin": about["origin"]}
    with pytest.raises(InvalidStatus) as refused, connect(uri, **options):  # type: ignore[arg-type]
        pass
    assert (
        refused.value.response.status_code == 403
        if "origin" in change or "path" in change
        else 404
    )
    assert SHOWS == []


def fetched(
    server: PageServer, path: str, host: str | None = None
) -> http.client.HTTPResponse:
    """The answer to a GET below the token."""
    address = urlsplit(server.url)
    assert address.hostname
    connection = http.client.HTTPConnection(
        address.hostname, address.port, timeout=PATIENCE
    )
    connection.request("GET", path, headers={"Host": host or address.netloc})
    response = connection.getresponse()
    response.content = response.read()  # type: ignore[attr-defined]
    connection.close()
    return response


def test_the_files_of_the_page_are_served_with_a_policy(server: PageServer) -> None:
    path = urlsplit(server.url).path
    for name, kind in (
        ("", "text/html"),
        ("view.js", "text/javascript"),
        ("view.css", "text/css"),
    ):
        response = fetched(server, path + name)
        assert (response.status, response.headers.get_content_type()) == (200, kind)
        assert "default-src 'none'" in response.headers["Content-Security-Policy"]
        assert response.headers["X-Content-Type-Options"] == "nosniff"
        assert response.headers["Referrer-Policy"] == "no-referrer"
    page = fetched(server, path, f"localhost:{urlsplit(server.url).port}")
    assert page.status == 200


@pytest.mark.parametrize(
    "path",
    [
        "/",
        "/wrong/",
        "/wrong/view.js",
        "{}/../server.py",
        "{}/..%2fserver.py",
        "{}/x.js",
    ],
)
def test_nothing_else_is_served(server: PageServer, path: str) -> None:
    assert fetched(server, path.format(f"/{server.token}")).status == 404


@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        "evil.example:80",
        "127.0.0.1.evil.example:80",
        "127.0.0.1",
        ":80",
    ],
)
def test_another_name_of_this_machine_is_refused(server: PageServer, host: str) -> None:
    assert fetched(server, urlsplit(server.url).path, host).status == 404


def test_it_listens_on_this_machine_only(server: PageServer) -> None:
    """And without Nagle's algorithm, for which asyncio asks
    sockets of TCP that say so.
    """
    assert server.socket.getsockname()[0] == "127.0.0.1"
    assert server.socket.proto == socket.IPPROTO_TCP
    with pytest.raises(
        SpecError, match=r"port \d+ cannot be used .*; --port 0 takes a free port"
    ):
        PageServer(watched, server.socket.getsockname()[1])


def test_sessions_are_few_and_the_one_left_first_makes_room(
    server: PageServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rooms, "MOST_SESSIONS", 2)
    for name in ("first", "second"):
        with Page(server, name) as page:
            page.wait("frame")
        until(lambda name=name: server.rooms.players[name].task is None)  # type: ignore[misc]
    with Page(server, "third") as page, Page(server, "fourth") as fourth:
        page.wait("frame")
        fourth.wait("frame")
        assert set(server.rooms.players) == {"third", "fourth"}
        with Page(server, "fifth") as fifth:
            message = fifth.wait("error")["message"]
            assert message == "2 pages are open already; close a page"
            with pytest.raises(ConnectionClosed) as closed:
                fifth.wait("nothing")
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == REFUSED


def test_sessions_that_nobody_comes_back_to_are_forgotten(
    server: PageServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Page(server, "first") as page:
        page.wait("frame")
    until(lambda: server.rooms.players["first"].task is None)
    monkeypatch.setattr(rooms, "KEPT_SECONDS", 0)
    with Page(server, "second") as page:
        page.wait("frame")
        assert set(server.rooms.players) == {"second"}


@pytest.mark.parametrize("kind", ["png", "svg"])
def test_a_picture_of_the_frame_is_made_while_it_runs(
    server: PageServer, kind: str
) -> None:
    with Page(server) as page:
        page.wait("frame")
        page.say("run")
        page.say("export", kind=kind)
        file = page.wait("file")
        assert file["name"].endswith(f".{kind}")
        assert len(file["data"]) > 1000


class Slow(Watched):
    """A run whose first step ends when another page has been answered."""

    answered = threading.Event()

    def advance(self, steps: int) -> Taken:
        if self.state.seed == 2:
            assert self.answered.wait(PATIENCE)
        return super().advance(steps)


def test_a_long_step_of_one_page_makes_no_other_wait(
    server: PageServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Kernels hold no lock of Python."""
    for model in MODELS.values():
        assert model.advance.targetoptions["nogil"]  # type: ignore[attr-defined]
    state = begin("nguyen2024", "as_run").with_settings({"n": 20, "steps": 200})
    monkeypatch.setattr(server.rooms, "begin", lambda: Slow(state))
    with Page(server, "slow") as slow, Page(server, "other") as other:
        slow.wait("state")
        slow.ask("set", name="seed", value=2)
        slow.say("step", count=1)
        other.wait("state")
        assert other.go(3)["step"] == 3
        Slow.answered.set()
        assert slow.wait("state", lambda state: state["step"] == 1)
