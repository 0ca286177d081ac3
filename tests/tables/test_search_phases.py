"""A search shows the trials that chose its candidates apart from those that judge."""

import numpy as np
import pytest

from sweep.analysis import mean_interval
from sweep.cli.reporting import print_report
from sweep.errors import ChoiceError, StoreError
from sweep.figures import heatmap_figure, pareto_figure, scatter_figure
from sweep.methods.comparison import compare_sides, read_side
from sweep.tables.kept_apart import keep_apart
from sweep.tables.means import point_means
from sweep.tables.means_text import means_report
from sweep.tables.stored_study import StoredStudy
from tests.commands import sweep
from tests.plotted import legend_texts, shown, study, titles

SEARCH = "trials of phase search chose among the candidates, so the best candidates"
HELD_OUT = "trials of phase held_out judge the chosen candidates with other seeds"


@pytest.fixture(scope="module")
def searched() -> StoredStudy:
    return study("searched")


def phases(searched: StoredStudy) -> dict[str, str]:
    asked = searched.store.read_asked()
    assert asked is not None
    return {row["trial_id"]: row["phase"] for row in asked.to_pylist()}


def test_a_mean_is_over_the_trials_of_one_phase(searched: StoredStudy) -> None:
    """By hand, from what the search has stored of each trial."""
    table = point_means(searched, "speed")
    assert table.headings == ["phase", "separation_weight", "cohesion_weight"]
    trials = searched.trials.assign(
        phase=searched.trials["trial_id"].map(phases(searched))
    )
    groups = {
        key: mean_interval(part["speed"], distribution=searched.distributions["speed"])
        for key, part in trials.groupby(["phase", "point"])["speed"]
        for part in [part.to_frame()]
    }
    found = table.rows[["speed", "speed_low", "speed_high", "speed_n"]].to_numpy()
    wanted = np.array(list(groups.values()))
    order = [np.lexsort(np.nan_to_num(part).T) for part in (found, wanted)]
    np.testing.assert_allclose(found[order[0]], wanted[order[1]])
    both = trials.groupby("point")["phase"].nunique() > 1
    assert both.any()
    assert len(table.rows) == len(groups) > trials["point"].nunique()


def test_a_table_says_which_trials_it_shows(
    searched: StoredStudy, capsys: pytest.CaptureFixture[str]
) -> None:
    apart = keep_apart(searched)
    print_report(means_report(apart, point_means(apart, "speed")))
    printed = capsys.readouterr().out
    assert SEARCH in printed
    assert HELD_OUT in printed
    chosen = apart.where(phase="held_out")
    rows = point_means(chosen, "speed")
    assert rows.headings == ["separation_weight", "cohesion_weight"]
    print_report(means_report(chosen, rows))
    printed = capsys.readouterr().out
    assert SEARCH not in printed
    assert HELD_OUT in printed
    assert set(chosen.trials["trial_id"]) == {
        trial for trial, phase in phases(searched).items() if phase == "held_out"
    }
    assert chosen.whole.plan.num_rows == searched.plan.num_rows
    with pytest.raises(ChoiceError, match="phase"):
        apart.where(phase="judged")


def test_where_may_come_first(searched: StoredStudy) -> None:
    weight = searched.trials["separation_weight"].iloc[0]
    part = keep_apart(searched.where(separation_weight=weight))
    assert set(part.trials["separation_weight"]) == {weight}
    assert part.units == searched.units
    assert keep_apart(part) is part


def test_figures_tell_phases_apart(searched: StoredStudy) -> None:
    scatter = scatter_figure(searched, "speed")
    assert legend_texts(scatter) == ["search", "held out"]
    pareto = pareto_figure(searched)
    assert legend_texts(pareto) == ["search", "held out", "not dominated"]
    heatmap = heatmap_figure(searched, "speed")
    assert titles(heatmap)[:2] == ["phase = search", "phase = held out"]
    for figure in (scatter, pareto, heatmap):
        assert HELD_OUT in shown(figure)


def test_commands_choose_a_phase(searched: StoredStudy) -> None:
    folder, name = searched.store.folder.parent, searched.name
    asked = ("table", name, "--results", ".", "--where", "phase=held_out", "--csv")
    printed = sweep(folder, *asked).stdout
    judged = [one for one in phases(searched).values() if one == "held_out"]
    assert 0 < printed.count("\n") - 1 < len(judged)


def test_a_comparison_takes_trials_of_one_phase(searched: StoredStudy) -> None:
    folder, name = searched.store.folder.parent, searched.name
    chose, judged = (
        read_side(f"{name}:phase={phase}", folder) for phase in ("search", "held_out")
    )
    found = compare_sides(chose, judged, "speed").rows
    candidates = [
        set(side.trials["point"].map(side.study.undivided)) for side in (chose, judged)
    ]
    twice = candidates[0] & candidates[1]
    assert len(found) == len(twice) > 0
    trials = searched.trials.assign(
        phase=searched.trials["trial_id"].map(phases(searched))
    )
    means = trials.groupby(["point", "phase"])["speed"].mean().unstack()
    wanted = sorted((means["held_out"] - means["search"]).dropna())
    np.testing.assert_allclose(sorted(found["difference"]), wanted, rtol=1e-12)


def test_a_comparison_never_pools_phases(searched: StoredStudy) -> None:
    folder, name = searched.store.folder.parent, searched.name
    whole, judged = read_side(name, folder), read_side(f"{name}:phase=held_out", folder)
    with pytest.raises(
        ChoiceError, match=f"phase: choose a value, for example {name}:phase="
    ):
        compare_sides(whole, judged, "speed")
    with pytest.raises(ChoiceError, match="are identical trials"):
        compare_sides(judged, read_side(f"{name}:phase=held_out", folder))


def test_a_study_that_is_no_search_is_as_it_was() -> None:
    small = study("small")
    assert keep_apart(small) is small
    assert small.kept_apart == []


def test_what_no_search_has_written_is_refused(
    searched: StoredStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = searched.store.read_asked()
    assert asked is not None
    monkeypatch.setattr(
        type(searched.store), "read_asked", lambda _: asked.drop_columns("phase")
    )
    with pytest.raises(
        StoreError, match="column phase is missing; delete it and search again"
    ):
        keep_apart(searched)
