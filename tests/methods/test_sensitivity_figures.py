"""The figures of sensitivities name what they show, in which unit and of how many
trials.
"""

from typing import Any

import numpy as np
import pytest

from sweep.figures import sensitivity_figure
from sweep.methods.sensitivity import morris, rank_correlations, sobol
from tests.cases import slow_but
from tests.sampled import axis, study_of


def texts(
    sweep: str, analyse: object, **options: object
) -> tuple[list[str], list[str], str, str]:
    study = study_of(sweep, noise=lambda rng, shape: rng.normal(0, 2, shape), **options)
    study.trials.loc[:1, "speed"] = np.nan
    figure = sensitivity_figure(analyse(study, "speed", resamples=50))
    figure.canvas.draw()
    panel = figure.axes[0]
    rows = [label.get_text() for label in panel.get_yticklabels()]
    return (
        rows,
        [text.get_text() for text in figure.legends[0].get_texts()],
        panel.get_xlabel(),
        figure.get_supxlabel(),
    )


def test_sobol_indices_of_settings_and_pairs() -> None:
    rows, kinds, quantity, said = texts(axis("saltelli", 64), sobol)
    names = ["separation weight", "alignment weight", "cohesion weight"]
    assert rows == [
        *names,
        f"{names[0]} x {names[1]}",
        f"{names[0]} x {names[2]}",
        f"{names[1]} x {names[2]}",
    ]
    assert kinds == ["S1, alone", "ST, with all interactions", "S2, of a pair"]
    assert quantity == "fraction of the variance of speed"
    assert (
        "made_up: 63 blocks of points (1 more left out: no value), 1,024 trials;\n95 %"
        " bootstrap confidence intervals" in said
    )
    assert "without replicate noise (up to" in said


def test_raw_indices_say_that_noise_is_in_them() -> None:
    *_, said = texts(axis("saltelli", 128, second_order="false"), sobol, replicates=1)
    assert said.endswith("; replicate noise not separated")


def test_effects_have_the_unit_of_the_metric() -> None:
    _, kinds, quantity, said = texts(axis("morris", 10), morris)
    assert kinds == ["mu*, mean size", "sigma, spread", "mu, mean"]
    assert quantity == "effect of the whole range on speed (px/step)"
    assert "made_up: " in said


@pytest.mark.parametrize(
    ("sampler", "analyse", "fewest"),
    [("saltelli", sobol, 100), ("morris", morris, 10), ("random", None, 30)],
)
def test_too_few_blocks_are_said_to_say_little(
    sampler: str, analyse: Any, fewest: int
) -> None:
    *_, few = texts(axis(sampler, 4), analyse or rank_correlations)
    *_, many = texts(axis(sampler, fewest + 2), analyse or rank_correlations)
    assert f"\nfewer than {fewest} " in few
    assert "are imprecise" not in many


def test_where_resamples_have_no_value_the_note_says_that_there_is_no_interval() -> (
    None
):
    study = study_of(axis("saltelli", 2))
    study.trials["speed"] = np.arange(len(study.trials)) // (len(study.trials) // 2)
    said = sensitivity_figure(sobol(study, "speed", resamples=50)).get_supxlabel()
    assert "bootstrap" not in said
    assert "no confidence intervals: some resamples of few blocks give no value" in said


def test_rank_correlations() -> None:
    _, kinds, quantity, _ = texts(axis("random", 10), rank_correlations)
    assert (kinds, quantity) == (["spearman", "partial"], "rank correlation with speed")


@pytest.mark.parametrize("sizes", slow_but([2], [2, 4]))
def test_a_panel_each_for_the_values_of_other_axes(sizes: int) -> None:
    study = study_of(f"n: {list(range(3, 3 + sizes))}, {axis('random', 10)}")
    figure = sensitivity_figure(rank_correlations(study, "speed", resamples=20))
    figure.canvas.draw()
    assert [axes.get_title() for axes in figure.axes if axes.axison] == [
        f"n = {3 + place}" for place in range(sizes)
    ]
    assert "10 points, 20 trials per panel" in figure.get_supxlabel()
