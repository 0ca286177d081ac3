"""All samplers of points, by names in specs."""

from kernels.registry import Registry
from sweep.spec.sampling import (
    Analyses,
    Sampler,
    halton,
    latin_hypercube,
    powers_of_two,
    random,
    sobol,
)
from sweep.spec.whole_samples import MORRIS, SALTELLI

SAMPLERS = Registry(
    "boidsweep.samplers",
    Sampler,
    {
        "random": Sampler(random, "independent draws"),
        "lhs": Sampler(
            latin_hypercube, "Latin hypercube: one draw in each of as many intervals"
        ),
        "sobol": Sampler(sobol, "the scrambled Sobol sequence", powers_of_two),
        "halton": Sampler(halton, "the scrambled Halton sequence"),
        "saltelli": SALTELLI,
        "morris": MORRIS,
    },
)
ALONE = "random"
"""Sampler of an axis of a single parameter, which names no sampler."""


def in_blocks() -> list[str]:
    """Return the samplers whose points come in blocks."""
    return [name for name, sampler in SAMPLERS.items() if sampler.blocks]


def made_for(analysis: Analyses) -> tuple[str, ...]:
    """Return the samplers whose samples an analysis needs."""
    return tuple(
        name for name, sampler in SAMPLERS.items() if sampler.analysis == analysis
    )
