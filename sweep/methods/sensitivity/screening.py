"""Elementary effects of Morris's trajectories: a screening of parameters."""

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
    """Return the analysis of the elementary effects of each parameter.

    The estimates are the mean of effects, the mean of absolute values, and the standard
    deviation. An effect is a change divided by the step, a fraction of the unit
    interval.
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
    """Return the effects, (parameters, b), and their standard deviations by noise.

    The standard deviations have the shape (parameters,).
    """
    trajectories = sample.complete
    before = trajectories[:, :-1]
    after = trajectories[:, 1:]
    settings = np.stack(
        [numbers(sample.settings[setting], texts=True) for setting in sample.settings],
        axis=1,
    )
    direction = np.sign(settings[after] - settings[before])
    effects = (
        np.einsum("bsf,bs->fb", direction, sample.means[after] - sample.means[before])
        / step
    )
    starts = before.ravel()
    ends = after.ravel()
    variance = (
        sample.noise(starts, starts)
        + sample.noise(ends, ends)
        - 2.0 * sample.noise(starts, ends)
    )
    of_field = np.where(
        direction.reshape(-1, settings.shape[1]) != 0.0, variance[:, None], np.nan
    )
    noise: Floats = np.sqrt(np.maximum(known_means(of_field, 0), 0.0)) / step
    return effects, noise
