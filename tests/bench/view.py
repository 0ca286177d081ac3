"""What the live simulator costs: stepping while being watched, frames, and how many of
both a page gets.
"""

import json
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from statistics import median
from typing import NamedTuple
from urllib.parse import urlsplit

from websockets.sync.client import connect

from sweep.spec import RecordSpec
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


def vicsek(n: int) -> ViewState:
    """N boids of vicsek1995 at the density of its preset, with its three plots."""
    size = round(5 * (n / 100) ** 0.5, 2)
    return begin("vicsek1995", "as_run").with_settings(
        {"n": n, "steps": 10**6, "width": size, "height": size}
    )


class Served(NamedTuple):
    """What a page got: frames, steps, seconds, and seconds of processor time."""

    frames: int
    steps: int
    seconds: float
    work: float


def served(shown: ViewState, overlays: tuple[str, ...], seconds: float) -> Served:
    """A run at full speed, for a page that asks for the next frame as soon as it has
    one.
    """
    server = PageServer(lambda: Live(shown))
    thread = threading.Thread(target=server.run)
    thread.start()
    address, frames, steps, first = urlsplit(server.url), 0, 0, 0
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
        began = worked = 0.0
        while steps == first or time.perf_counter() - began < seconds:
            content = socket.recv()
            if isinstance(content, bytes):
                steps = int(HEAD.unpack_from(content)[2])
                if not began:
                    began, worked = time.perf_counter(), time.process_time()
                    first = steps
                frames += 1
                socket.send('{"type": "ready"}')
        passed, work = time.perf_counter() - began, time.process_time() - worked
    server.stop()
    thread.join()
    return Served(frames, steps - first, passed, work)


def trial(shown: ViewState, every: int, steps: int) -> float:
    """Processor time of the steps of a trial that measures its plots so often."""
    record = RecordSpec(shown.plots, every=every)
    simulation = Simulation(replace(shown.job, record=record))
    began = time.process_time()
    while simulation.step < steps:
        simulation.advance(min(every, steps - simulation.step))
        simulation.take_frames()
    return time.process_time() - began


def watched(n: int, plots: int, rounds: int, seconds: float) -> str:
    """Processor time of watching at full speed, against the same steps of a trial that
    measures as many frames.
    """
    shown = vicsek(n)
    shown = shown.follow(shown.plots[:plots])
    ratios, steps, frames = [], 0.0, 0.0
    for _ in range(rounds):
        page = served(shown, (), seconds)
        every = max(1, round(page.steps / page.frames))
        ratios.append(page.work / trial(shown, every, page.steps))
        steps, frames = page.steps / page.seconds, page.frames / page.seconds
    return (
        f"{plots} plots at full speed: {median(ratios):.2f} times the processor time of"
        f" a trial; {steps:.0f} steps and {frames:.0f} frames a second"
    )


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
    for plots in (1, 3):
        n = scale.boids(5000)
        words = watched(n, plots, scale.of(ROUNDS), scale.share * SECONDS)
        print(f"view, N={n:<6,} {words}")
    for usual, overlays in ((1000, ()), (10_000, ()), (1000, OVERLAYS)):
        n = scale.boids(usual)
        page = served(state(n), overlays, scale.share * SECONDS)
        frames, steps = page.frames / page.seconds, page.steps / page.seconds
        words = " with all overlays" if overlays else ""
        print(
            f"view, N={n:<6,} over a socket{words}: {frames:.0f} frames and {steps:.0f}"
            " steps a second"
        )
