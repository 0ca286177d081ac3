"""Which settings matter at all: elementary effects of Morris's trajectories."""

import numpy as np

from sweep.methods.sensitivity.sampled import (
    Analysis,
    Blocks,
    Floats,
    SampledAxis,
    known_means,
    numbers,
)


def effect_analysis(sample: SampledAxis) -> Analysis:
    """Mean, mean of the absolute values and standard deviation of the elementary
    effects of each setting.

    An effect is a change over the step, which is a part of the unit interval.
    """
    assert sample.levels is not None
    step = sample.levels / (2.0 * (sample.levels - 1))
    effects, noise = _effects(sample, step)

    def estimate(drawn: Blocks) -> Floats:
        chosen = effects[:, drawn]
        deviation = (
            chosen.std(axis=1, ddof=1)
            if len(drawn) > 1
            else np.full_like(chosen[:, 0], np.nan)
        )
        return np.stack([chosen.mean(axis=1), np.abs(chosen).mean(axis=1), deviation])

    rows = [
        {"setting": setting, "noise": float(size)}
        for setting, size in zip(sample.settings, noise, strict=True)
    ]
    return Analysis(rows, ("mu", "mu_star", "sigma"), estimate)


def _effects(sample: SampledAxis, step: float) -> tuple[Floats, Floats]:
    """The effects (settings, b), and by setting their standard deviation from noise."""
    whole = sample.whole
    before, after = whole[:, :-1], whole[:, 1:]
    settings = np.stack(
        [numbers(sample.settings[setting], texts=True) for setting in sample.settings],
        axis=1,
    )
    direction = np.sign(settings[after] - settings[before])
    effects = (
        np.einsum("bsf,bs->fb", direction, sample.means[after] - sample.means[before])
        / step
    )
    one, other = before.ravel(), after.ravel()
    variance = (
        sample.noise(one, one)
        + sample.noise(other, other)
        - 2.0 * sample.noise(one, other)
    )
    of_field = np.where(
        direction.reshape(-1, settings.shape[1]) != 0.0, variance[:, None], np.nan
    )
    noise: Floats = np.sqrt(np.maximum(known_means(of_field, 0), 0.0)) / step
    return effects, noise
