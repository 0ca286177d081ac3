"""What the live simulator costs: stepping while being watched, frames, and how many of
both a page gets.
"""

import json
import threading
import time
from collections.abc import Callable
from statistics import median
from urllib.parse import urlsplit

from websockets.sync.client import connect

from sweep.trial.simulation import Simulation
from sweep.web.encoding import HEAD
from sweep.web.live_show import Live
from sweep.web.server import PageServer
from sweep.web.state import ViewState, begin
from tests.bench.scale import FULL, Scale

ROUNDS = 5
SECONDS = 3.0
OVERLAYS = ("flocks", "coverage", "accelerations")


def state(n: int) -> ViewState:
    """N boids of aziel_chen2025 in an empty world at the density of 100 boids in 800 x
    600.
    """
    scale = (n / 100) ** 0.5
    size = {
        "width": round(800 * scale),
        "height": round(600 * scale),
        "pixel": max(1.0, scale / 4),
    }
    return begin("aziel_chen2025", "as_run").with_settings(
        {"map": "empty", "n": n, "steps": 10**6, **size}
    )


def milliseconds(work: Callable[[], object], rounds: int) -> float:
    """The median time of one call."""
    work()
    times = []
    for _ in range(rounds):
        began = time.perf_counter()
        work()
        times.append((time.perf_counter() - began) * 1e3)
    return median(times)


def served(n: int, overlays: tuple[str, ...], seconds: float) -> tuple[float, float]:
    """Frames and steps a second at full speed, for a page that asks for the next frame
    as soon as it has one.
    """
    server = PageServer(lambda: Live(state(n)))
    thread = threading.Thread(target=server.run)
    thread.start()
    address, frames, steps = urlsplit(server.url), 0, 0
    with connect(
        f"ws://{address.netloc}{address.path}socket", origin=f"http://{address.netloc}"
    ) as socket:  # type: ignore[arg-type]
        asked = [
            {"type": "hello", "page": "bench"},
            {"type": "speed", "steps_per_second": 0},
        ]
        asked += [{"type": "overlays", "names": overlays}, {"type": "run"}]
        for message in asked:
            socket.send(json.dumps(message))
        began = 0.0
        while not began or time.perf_counter() - began < seconds:
            content = socket.recv()
            if isinstance(content, bytes):
                began = began or time.perf_counter()
                frames, steps = frames + 1, int(HEAD.unpack_from(content)[2])
                socket.send('{"type": "ready"}')
    server.stop()
    thread.join()
    return frames / seconds, steps / seconds


def cost(n: int, rounds: int) -> str:
    """Of a step, alone and watched, and of a frame, alone and with overlays."""
    live, alone = Live(state(n)), Simulation(state(n).job)
    steps = max(4, 2000 // n)
    live.run()

    def sweep() -> None:
        alone.advance(steps)
        alone.take_frames()

    plain, watched = (
        milliseconds(sweep, rounds) / steps,
        milliseconds(lambda: live.advance(steps), rounds) / steps,
    )
    frame = milliseconds(live.picture, rounds)
    live.pause()
    live.overlays = OVERLAYS
    words = f"a step {watched:.2f} ms, {watched / plain:.1f} times that of a sweep"
    return (
        f"{words}; a frame {frame:.2f} ms, with all overlays"
        f" {milliseconds(live.picture, rounds):.2f} ms"
    )


def view(scale: Scale = FULL) -> None:
    """Per step and per frame, and over a socket."""
    for n in map(scale.boids, (100, 1000, 10_000)):
        print(f"view, N={n:<6,} {cost(n, scale.of(ROUNDS))}")
    for usual, overlays in ((1000, ()), (10_000, ()), (1000, OVERLAYS)):
        n = scale.boids(usual)
        frames, steps = served(n, overlays, scale.share * SECONDS)
        words = " with all overlays" if overlays else ""
        print(
            f"view, N={n:<6,} over a socket{words}: {frames:.0f} frames and {steps:.0f}"
            " steps a second"
        )
