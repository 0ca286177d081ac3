"""Trials of aziel_chen2025 that several benchmarks measure."""

from sweep.design.jobs import Job
from tests.builders import job

MODEL = "aziel_chen2025"
BEST = {
    "cafeteria": (0.21291127681588995, 0.003341501546500625, 0.0029965674079446836),
    "dense_cafeteria": (0.476524, 0.016595, 0.001169),
}
CLUMPED = (0.25, 0.08, 0.25)
"""With these weights boids fly in dense flocks."""


def covering(
    map_name: str,
    n: int,
    steps: int,
    weights: tuple[float, float, float],
    metrics: tuple[str, ...] | None = None,
    **settings: float,
) -> Job:
    """A trial as run, with `weights` of cohesion, alignment and separation and, unless
    others are given, the metrics of the published study.
    """
    cohesion, alignment, separation = weights
    return job(
        MODEL,
        metrics=metrics,
        seed=27,
        literal=True,
        map=map_name,
        n=n,
        steps=steps,
        cohesion_weight=cohesion,
        alignment_weight=alignment,
        separation_weight=separation,
        **settings,
    )


def large(n: int, steps: int, metrics: tuple[str, ...] | None = None) -> Job:
    """N boids in an empty world at the density of 100 boids in 800 x 600."""
    scale = (n / 100) ** 0.5
    size = {"width": round(800 * scale), "height": round(600 * scale)}
    return covering("empty", n, steps, BEST["cafeteria"], metrics, **size)
