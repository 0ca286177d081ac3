"""What the layers between a model and its boids cost: processor time of a boid-step of
robots against that of ideal boids, in turns, beside what the cost model expects; and
that of all points of two ablations.
"""

import time
from dataclasses import replace
from itertools import product
from statistics import median

import numpy as np

from kernels.catalogue import BUILT_IN
from sweep.design.cost import job_seconds, trial_seconds
from sweep.design.design import expand
from sweep.design.jobs import Job, Jobs
from sweep.spec.settings import Value
from sweep.spec.study import RecordSpec, parse_spec
from sweep.trial import looking
from sweep.trial.simulation import Simulation
from tests import ROOT
from tests.bench.scale import FULL, Scale
from tests.bench.timing import alone
from tests.builders import job

STUDIES = "flock.yaml", "coverage.yaml"
MODELS, SIZES = ("nguyen2024", "aziel_chen2025", "vicsek1995"), (50, 200)
LAYERS: dict[str, dict[str, Value]] = {
    "noise": {"position_noise": 1.0, "noise_time": 5.0},
    "own noise": {"position_noise": 1.0, "own_noise": "independent"},
    "delay": {"sensing_delay": 10.0},
    "rare samples": {"sensing_period": 10.0},
    "radio range": {"radio_range": 1000.0},
    "packet loss": {"packet_loss": 0.3},
    "obstacles hide": {"occlusion": "obstacles"},
    "bodies hide": {"occlusion": "boids", "body_radius": 1.0},
    "lag": {"motor_lag": 3.0},
    "motor noise": {"motor_noise": 0.1},
    "wheels": {"wheels": True, "motor_turn_rate": 30.0},
    "stopped": {"failing_share": 0.2, "failing_time": 0.0, "failing_how": "stop"},
    "blind": {"failing_share": 0.2, "failing_time": 0.0, "failing_how": "blind"},
}
ALL = {
    **LAYERS["noise"],
    **LAYERS["delay"],
    **LAYERS["packet loss"],
    **LAYERS["bodies hide"],
    **LAYERS["lag"],
    **LAYERS["motor noise"],
}
ROUNDS, SETTLED, BOID_STEPS = 5, 100, 50_000


def robots(scale: Scale = FULL) -> None:
    """Print for each model, size and layer what a boid-step costs, how many times as
    much as that of ideal boids, and how many times the cost model says.
    """
    print(f"{'robots':40} {'ns':>6} {'found':>6} {'times':>6} {'model':>6}")
    models, boid_steps = MODELS[: scale.of(len(MODELS))], scale.of(BOID_STEPS)
    for model, n in product(models, SIZES):
        ideal = ready(model, n, {}, scale.of(SETTLED))
        for layer, settings in {"ideal": {}, **LAYERS, "all": ALL}.items():
            one = ready(model, n, settings, scale.of(SETTLED))
            pairs = [
                (cost(one, boid_steps), cost(ideal, boid_steps))
                for _ in range(scale.of(ROUNDS))
            ]
            mine = median(mine for mine, _ in pairs)
            times = median(mine / theirs for mine, theirs in pairs)
            expected = boid_step(one.job) / boid_step(ideal.job)
            about = f"{model}, N={n}, {layer}"
            print(
                f"{about:40} {mine:6.0f} {found(one):6.1f} {times:6.2f} {expected:6.2f}"
            )
    for name in STUDIES:
        ablation(name, scale)


def ablation(name: str, scale: Scale) -> None:
    """Print what the points of a study of experiments/robots cost, a trial each, and
    how many times as much the cost model says: of all, and the least and the most.
    """
    path = ROOT / "experiments" / "robots" / name
    study = replace(parse_spec(path.read_text(), path), replicates=1)
    first = [
        _shorter(one, scale.of(int(one.settings["steps"])))
        for one in Jobs(study, expand(study))
    ]
    rounds = range(scale.of(ROUNDS))
    measured = np.array([min(alone(one) for _ in rounds) for one in first])
    ratios = job_seconds(first) / measured
    print(
        f"{name}: {measured.sum():.2f} s, the plan {job_seconds(first).sum():.2f};"
        f" of a point {ratios.min():.2f} to {ratios.max():.2f} times"
    )


def _shorter(one: Job, steps: int) -> Job:
    return replace(one, settings={**one.settings, "steps": steps})


def ready(model: str, n: int, settings: dict[str, Value], settled: int) -> Simulation:
    """A trial that has settled for so many steps, in a world of the density of the
    preset.
    """
    preset = BUILT_IN.models[model].presets["as_run"]
    larger = (n / float(preset["n"])) ** 0.5
    size = {side: float(preset[side]) * larger for side in ("width", "height")}
    mapped = "empty" if settings.get("occlusion") != "obstacles" else "cafeteria"
    given = {"map": mapped, "n": n, "update": "synchronous", **size, **settings}
    if mapped == "cafeteria":
        given |= {"width": 800.0, "height": 600.0}
    simulation = Simulation(
        job(model, metrics=("speed",), every=10**9, steps=10**9, **given)
    )
    simulation.take_frames()
    assert simulation.advance(settled)
    return simulation


def found(simulation: Simulation) -> float:
    """How many boids a boid hears of, in the mean."""
    n = simulation.schedule.n
    boids = range(0, n, max(1, n // 50))
    return float(
        np.mean([len(looking.seen_by(simulation, boid).neighbours) for boid in boids])
    )


def cost(simulation: Simulation, boid_steps: int) -> float:
    """Nanoseconds of processor time of a step of one boid."""
    n = simulation.schedule.n
    steps = max(1, boid_steps // n)
    began = time.thread_time()
    assert simulation.advance(steps)
    return (time.thread_time() - began) / (n * steps) * 1e9


def boid_step(one: Job) -> float:
    """The seconds of a boid-step of a trial by the cost model."""
    steps = 10**6
    settings = one.settings | {"steps": steps}
    record = RecordSpec(("speed",), every=steps)
    seconds = trial_seconds(one.model, one.catalogue, settings, record)
    return seconds / (steps * float(one.settings["n"]))
