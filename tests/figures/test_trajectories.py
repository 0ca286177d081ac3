"""Figures of flights: trails that fade, the flock at the
end, the goal that is sought.
"""

import numpy as np
import pytest

from sweep.errors import ChoiceError
from sweep.figures import trajectories_figure
from tests.plotted import shown, study, titles


def test_the_first_trials_of_few_points_have_a_panel_each() -> None:
    figure = trajectories_figure(study("flying"))
    assert titles(figure) == [
        f"separation weight = {weight}, replicate {replicate}"
        for weight in ("0.5", "1")
        for replicate in (0, 1)
    ]
    assert (
        shown(figure)
        == "flying: one trial per panel, of 6 that are done; frames 0 to 9"
    )
    assert (figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()) == (
        "x (px)",
        "y (px)",
    )


def test_trails_fade_and_end_where_the_flock_is() -> None:
    figure = trajectories_figure(study("flying").where(separation_weight=1))
    trials = study("flying").trials
    trial = trials.loc[trials["separation_weight"] == 1, "trial_id"].iloc[0]
    _, flight = study("flying").trajectory(trial)
    obstacles, trails, flock = (
        figure.axes[0].collections[place] for place in (0, 1, 2)
    )
    assert len(obstacles.get_paths()) == len(study("flying").world(trial).obstacles)
    ends = np.array(
        [segment[-1] for segment in trails.get_segments()][-flight.shape[2] :]
    )
    np.testing.assert_allclose(ends, flight[-1, :2].T)
    alpha = np.asarray(trails.get_alpha())
    assert alpha[0] < alpha[-1] == 0.8
    centres = [path.vertices[:3].mean(axis=0) for path in flock.get_paths()]
    np.testing.assert_allclose(centres, flight[-1, :2].T)


def test_goals_in_turn_have_a_cross_and_a_number_each() -> None:
    """The study has one panel a trial, in which boids seek two goals."""
    figure = trajectories_figure(study("touring"))
    assert shown(figure).endswith("cross: goal")
    for axes in figure.axes:
        crosses = [line for line in axes.lines if line.get_marker() == "X"]
        assert [line.get_xydata().tolist() for line in crosses] == [
            [[100.0, 100.0], [300.0, 200.0]]
        ]
        assert [text.get_text() for text in axes.texts if text.get_zorder() == 5] == [
            *("1", "2")
        ]


def test_where_none_are_stored_the_error_says_what_keeps_them() -> None:
    with pytest.raises(
        ChoiceError,
        match=(
            r"study small: has no trajectories; record: \{trajectories: true\} stores"
            r" trajectories"
        ),
    ):
        trajectories_figure(study("small"))
