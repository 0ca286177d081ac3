"""Verification finds every changed bit, in every table, and says what it rests on."""

import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import sweep.replays.verifying as verify_module
from sweep.design import design
from sweep.errors import StoreError
from sweep.replays.bits import differences, error_kind, ulps
from sweep.replays.replaying import replay
from sweep.replays.verifying import Verification, upper_bound, verify
from sweep.store.new_files import create
from sweep.store.parquet import table_writer
from sweep.tables.stored_study import StoredStudy
from sweep.tables.trial_rows import stored_trials
from sweep.trial.simulation import run
from sweep.workers.executors import Loky, Serial
from tests import builders, devices, oscillators
from tests.commands import sweep
from tests.studies import COVERING, IMPOSSIBLE, SMALL, launched

FLOWN = SMALL.replace("every: 2", "every: 2, trajectories: true")
ALL = COVERING.replace(
    "heatmaps: true", "heatmaps: true, trajectories: true, every: 5"
).replace("steps: 20", "steps: 10")


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> StoredStudy:
    return launched(FLOWN, tmp_path_factory.mktemp("clean"))


def checked(study: StoredStudy, **options: Any) -> Verification:
    return verify(study, Serial(), **({"fraction": 1.0} | options))


def rewrite(study: StoredStudy, table: str, column: str, change: Any) -> StoredStudy:
    """The study with the first value of a column of its first part changed."""
    path = next(study.store.folder.glob(f"parts/*/{table}.parquet"))
    old = pq.ParquetFile(path).read()
    values = old[column].to_pylist()
    values[0] = change(values[0])
    index = old.column_names.index(column)
    new = old.set_column(
        index, old.schema.field(column), pa.array(values, old.schema.field(column).type)
    )
    path.unlink()
    with create(path) as file, table_writer(file, old.schema) as writer:
        writer.write_table(new)
    return StoredStudy(study.name, study.store.folder.parent)


def next_float(value: float) -> float:
    return float(np.nextafter(value, np.inf))


def test_what_is_stored_is_the_same_in_every_table(clean: StoredStudy) -> None:
    found = checked(clean)
    assert found.same
    assert found.checked == {"done": 6}
    assert found.values["series"] == 6 * 2 * 6  # frame and speed, six frames
    assert found.values["trajectories"] == 6 * (6 + 4 * 6 * 12)
    assert found.origins.total() == 6
    text = found.as_text()
    assert "checked    6 of 6 stored trials (seed 0): 6 done" in text
    assert "0 of all 6 trials differ; every trial was checked" in text


@pytest.mark.slow
def test_two_workers_say_the_same_as_one_process(clean: StoredStudy) -> None:
    engine = Loky(2)
    try:
        assert verify(clean, engine, fraction=1.0) == checked(clean)
    finally:
        engine.stop()


CHANGES = [
    ("trials", "speed", next_float, r"trials\.speed: stored .* \(1 ulp\)$"),
    ("trials", "speed_mean", lambda value: -value, r"trials\.speed_mean: stored"),
    (
        "trials",
        "last_step",
        lambda value: value + 1,
        r"trials\.last_step: stored 10, now 9$",
    ),
    (
        "trials",
        "status",
        lambda _: "diverged",
        r"trials\.status: stored 'diverged', now 'done'",
    ),
    (
        "series",
        "speed",
        next_float,
        r"series\.speed differs in 1 of 6 values, first in row 0: .* \(1 ulp\)",
    ),
    (
        "series",
        "frame",
        lambda _: 1,
        r"series\.frame differs in 1 of 6 values, first in row 0: stored 1, now 0$",
    ),
    (
        "trajectories",
        "vx",
        lambda row: [next_float(row[0]), *row[1:]],
        r"trajectories\.vx differs in 1 of 72 values",
    ),
    (
        "trajectories",
        "y",
        lambda row: row[1:],
        r"trajectories\.y has 71 values stored, and 72 now",
    ),
    (
        "heatmaps",
        "visits",
        lambda row: [row[0] + 1, *row[1:]],
        r"heatmaps\.visits differs in 1 of 480,000 values",
    ),
    (
        "heatmaps",
        "rows",
        lambda value: value - 1,
        r"heatmaps\.rows: stored 599, now 600",
    ),
]


@pytest.mark.parametrize(("table", "column", "change", "message"), CHANGES)
def test_one_changed_bit_is_found_and_named(
    tmp_path: Path, table: str, column: str, change: Any, message: str
) -> None:
    spec = (
        ALL.replace("[0.1, 0.2]", "[0.1]").replace("[27, 729]", "[27]")
        if table == "heatmaps"
        else FLOWN.replace("[0.5, 1]", "[0.5]").replace(
            "replicates: 3", "replicates: 2"
        )
    )
    study = rewrite(launched(spec, tmp_path), table, column, change)
    found = checked(study)
    assert not found.same
    (trial,) = found.differing
    assert trial in found.as_text()
    assert len(found.differing[trial]) == 1
    assert re.search(message, str(found.differing[trial][0])), found.differing[trial]
    report, same = replay(study, trial)
    assert not same
    assert str(found.differing[trial][0]) in report


@pytest.mark.slow
@pytest.mark.parametrize(
    ("column", "change", "message"),
    [
        (
            "phase",
            lambda row: [next_float(row[0]), *row[1:]],
            r"trajectories\.phase differs in 1 of 72 values, .* \(1 ulp\)$",
        ),
        (
            "kind",
            lambda row: [1, *row[1:]],
            r"trajectories\.kind differs in 1 of 72 values, first in row 0: stored 1",
        ),
    ],
)
def test_a_changed_bit_of_state_or_kind_is_found_too(
    tmp_path: Path, column: str, change: Any, message: str
) -> None:
    with builders.entered(oscillators.MODEL, order=oscillators.ORDER):
        study = launched(oscillators.SPEC, tmp_path)
        assert checked(study).same
        assert checked(study).values["trajectories"] == 4 * 6 * (1 + 7 * 12)
        found = checked(rewrite(study, "trajectories", column, change))
    [[difference]] = found.differing.values()
    assert re.search(message, str(difference))


def test_a_changed_setting_is_found_even_where_it_has_no_effect(tmp_path: Path) -> None:
    study = rewrite(
        launched(SMALL, tmp_path),
        "trials",
        "separation_weight",
        lambda value: value + 0.25,
    )
    found = next(iter(checked(study).differing.values()))
    assert "trials.point: stored" in str(found[0])


def test_zeros_of_either_sign_and_nans_of_any_kind_are_told_apart(
    clean: StoredStudy,
) -> None:
    trial = stored_trials(clean.store, [clean.plan["trial_id"][0].as_py()])[0]
    result = run(clean.job(trial))
    odd_nan = float(np.array([0x7FF8000000000001]).view(np.float64)[0])
    for stored, found, count in [
        (0.0, -0.0, 1),
        (np.nan, odd_nan, 1),
        (np.nan, np.nan, 0),
        (0.0, 0.0, 0),
    ]:
        result.last["speed"] = found
        changed = trial._replace(row=trial.row | {"speed": stored})
        assert len(differences(clean.name, changed, result)) == count


def test_ulps_count_the_numbers_in_between() -> None:
    tiny = 5e-324
    pairs = [
        (1.0, next_float(1.0), 1),
        (-tiny, tiny, 3),
        (0.0, -0.0, 1),
        (1.0, 2.0, 2**52),
        (0.0, tiny, 1),
    ]
    assert [(ulps(a, b), ulps(b, a)) for a, b, _ in pairs] == [
        (count, count) for *_, count in pairs
    ]


def test_failed_trials_must_fail_in_the_same_way(tmp_path: Path) -> None:
    study = launched(IMPOSSIBLE, tmp_path)
    found = checked(study)
    assert found.same
    assert found.checked == {"failed": 6}
    other = rewrite(
        study, "trials", "error", lambda text: text.replace("RuntimeError", "KeyError")
    )
    (difference,) = next(iter(checked(other).differing.values()))
    assert "trials.error: stored 'KeyError', now 'RuntimeError'" in str(difference)


def test_diverged_trials_diverge_again_in_the_same_step(tmp_path: Path) -> None:
    study = launched(
        FLOWN.replace("[0.5, 1]", "[1.0e+308]").replace(
            "n: 12", "n: 30, separation_range: 1000"
        ),
        tmp_path,
    )
    found = checked(study)
    assert found.same
    assert found.checked == {"diverged": 3}
    other = checked(
        rewrite(study, "trials", "error", lambda text: text.replace("step 1", "step 2"))
    )
    (difference,) = next(iter(other.differing.values()))
    assert "trials.error: stored" in str(difference)


def test_the_kind_of_an_error_is_its_exception() -> None:
    assert (
        error_kind(
            "failed", "Traceback (most recent call last):\n  ...\nValueError: 3: no\n"
        )
        == "ValueError"
    )
    assert error_kind("failed", "worker process died") == "worker process died"
    assert (
        error_kind("diverged", "a position was not finite after step 3")
        == "a position was not finite after step 3"
    )


def test_what_depends_on_the_machine_is_left_out_and_counted(tmp_path: Path) -> None:
    study = rewrite(launched(SMALL, tmp_path), "trials", "status", lambda _: "timeout")
    found = checked(study)
    assert found.same
    assert (found.stored, found.checked, found.left_out) == (
        5,
        {"done": 5},
        {"timeout": 1},
    )
    assert "left out   1 timeout" in found.as_text()


def test_trials_whose_worker_died_are_not_run_again(tmp_path: Path) -> None:
    study = rewrite(
        launched(IMPOSSIBLE, tmp_path),
        "trials",
        "error",
        lambda _: "worker process died 3 times",
    )
    found = checked(study)
    assert (found.stored, found.checked, found.left_out) == (
        5,
        {"failed": 5},
        {"worker died": 1},
    )


def test_other_kernels_leave_nothing_to_compare(
    clean: StoredStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kernels.identity._flight_stamp", lambda: "other code")
    with pytest.raises(
        StoreError,
        match=r"computed by other code \(the flight\): .* to verify the study",
    ):
        checked(clean)


def test_a_study_without_trials_is_an_error(tmp_path: Path) -> None:
    study = launched(SMALL, tmp_path)
    for part in (study.store.folder / "parts").iterdir():
        study.store.discard(part)
    with pytest.raises(StoreError, match="the store has no trial of the spec"):
        checked(study)


@pytest.mark.parametrize(
    ("options", "count"),
    [({"fraction": 0.0}, 1), ({"fraction": 0.4}, 3), ({"most": 2}, 2)],
)
def test_the_sample_is_of_the_size_asked_for_and_at_least_one(
    clean: StoredStudy, options: dict[str, Any], count: int
) -> None:
    assert checked(clean, **options).checked.total() == count


def test_the_sample_is_drawn_by_the_seed_and_each_trial_as_often(
    clean: StoredStudy,
) -> None:
    """75 samples of 2 of 6: each is in 25 of them, within 4.4 standard deviations.
    False alarms: 6 * 1.1e-5.
    """
    drawn = Counter[str]()
    for seed in range(75):
        sample = verify_module._drawn(clean, 0.3, 1000, seed)[0]
        assert sample == verify_module._drawn(clean, 0.3, 1000, seed)[0]
        assert len(set(sample)) == 2
        drawn.update(sample)
    assert set(drawn) == set(clean.plan["trial_id"].to_pylist())
    assert all(
        abs(count - 25) < 4.4 * np.sqrt(75 / 3 * 2 / 3) for count in drawn.values()
    )


def test_the_bound_is_that_of_clopper_and_pearson() -> None:
    """Where the share is at the bound, as few differing trials as seen have a chance of
    5 % (scipy's binomial).
    """
    from scipy.stats import binom

    for checked_trials, differing in [(1, 0), (20, 0), (100, 3), (1000, 0)]:
        bound = upper_bound(checked_trials, differing)
        assert binom.cdf(differing, checked_trials, bound) == pytest.approx(
            0.05, rel=1e-9
        )
    assert upper_bound(20, 0) == pytest.approx(1 - 0.05 ** (1 / 20))
    assert upper_bound(5, 5) == 1.0


def test_the_command_says_it_and_its_exit_code_too(tmp_path: Path) -> None:
    study = launched(SMALL, tmp_path / "results")
    command = ["verify", "small", "--fraction", "1", "--workers", "1"]
    done = sweep(tmp_path, *command)
    assert done.returncode == 0, done.stderr
    assert "small: 0 of 6 trials compared" in done.stderr
    assert "result     6 of 6 bitwise identical" in done.stdout
    rewrite(study, "trials", "speed", next_float)
    done = sweep(tmp_path, *command)
    assert done.returncode == 1
    assert "trials.speed" in done.stdout


@pytest.fixture
def mixed(tmp_path: Path) -> StoredStudy:
    """Two trials that a processor has flown, and four of a device that rounds once."""
    one = FLOWN.replace("[0.5, 1]", "[0.5]").replace("replicates: 3", "replicates: 2")
    launched(one, tmp_path)
    return launched(FLOWN, tmp_path, devices.InThisProcess(device=devices.Rounds()))


def test_what_a_device_flew_is_flown_on_a_processor_and_compared(
    mixed: StoredStudy,
) -> None:
    found = checked(mixed, elsewhere=True)
    assert found.checked == {"done": 4}
    assert list(found.origins.values()) == [4]
    assert len(found.differing) == 1
    text = found.as_text()
    assert re.search(r"trials\.speed: stored .* \(1 ulp\)$", text, re.MULTILINE)
    assert "4 of 4 stored trials that a device computed (seed 0): 4 done" in text
    assert "then       Test GPU 9 (CUDA 13.0, numba-cuda 0.30.4, NVVM 13.5), " in text
    assert "now        Test GPU 9" not in text
    assert "1 of all 4 trials differ" in text


def test_without_that_the_sample_is_of_all_trials(mixed: StoredStudy) -> None:
    found = checked(mixed)
    assert (found.checked, found.among) == ({"done": 6}, "")
    assert sorted(found.origins.values()) == [2, 4]


def test_what_a_processor_flew_is_flown_on_a_device(mixed: StoredStudy) -> None:
    engine = devices.InThisProcess()
    found = verify(mixed, engine, fraction=1.0, elsewhere=True)
    assert (found.checked, found.same) == ({"done": 2}, True)
    text = found.as_text()
    assert "2 of 2 stored trials that a processor computed" in text
    assert "now        Test GPU 9 (CUDA 13.0, numba-cuda 0.30.4, NVVM 13.5), " in text


def test_where_all_flew_there_the_sample_is_of_all_trials(clean: StoredStudy) -> None:
    found = checked(clean, elsewhere=True)
    assert (found.checked, found.among, found.same) == ({"done": 6}, "", True)


def test_a_trial_that_a_device_cannot_fly_is_left_out(mixed: StoredStudy) -> None:
    def refusal(job: Any) -> str:
        return "it is too heavy" if job.replicate == 1 else ""

    engine = devices.InThisProcess(refusal=refusal)
    found = verify(mixed, engine, fraction=1.0, elsewhere=True)
    assert found.checked == {"done": 1}
    assert found.left_out == {"cannot run on a GPU (it is too heavy)": 1}
    assert "1 of 1 stored trial that a processor computed" in found.as_text()
    nowhere = devices.InThisProcess(refusal=lambda _job: "it is too heavy")
    with pytest.raises(StoreError, match="no trial can be compared; left out are 2"):
        verify(mixed, nowhere, elsewhere=True, fraction=1.0)


def test_the_command_says_where_trials_flew_and_fly(
    mixed: StoredStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = mixed.store.folder.parent.parent
    names = "verify", mixed.name, "--results", str(mixed.store.folder.parent)
    there = sweep(folder, *names, "--fraction", "1", "--executor", "cpu")
    assert (there.returncode, "that a device computed" in there.stdout) == (1, True)
    with devices.there(monkeypatch):
        monkeypatch.setattr("sweep.workers.gpu.Cuda", devices.InThisProcess)
        here = sweep(folder, *names, "--fraction", "1", "--executor", "cuda")
    assert (here.returncode, "that a processor computed" in here.stdout) == (0, True)


def test_the_command_takes_every_engine_and_says_what_one_lacks(
    mixed: StoredStudy,
) -> None:
    """What it says to give is an option of this command."""
    folder = mixed.store.folder.parent.parent
    names = "verify", mixed.name, "--results", str(mixed.store.folder.parent)
    unknown = sweep(folder, *names, "--executor", "cudda")
    assert 'unknown executor "cudda"; did you mean "cuda"?' in unknown.stderr
    lacking = sweep(folder, *names, "--executor", "dask")
    assert "--address tcp://HOST:PORT or --scheduler-file FILE" in lacking.stderr
    nowhere = "--executor", "dask", "--scheduler-file", "none.json"
    given = sweep(folder, *names, *nowhere)
    assert "none.json" in given.stderr
    assert [done.returncode for done in (unknown, lacking, given)] == [2, 2, 2]


def test_a_torus_of_an_earlier_version_stays_what_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """There a spec that named a torus, and no more, had one that wraps positions only.
    Its trials are the same again. A launch adds the periodic ones, and keeps others.
    """
    axis = "borders: [open, torus]"
    spec = SMALL.replace("separation_weight: [0.5, 1]", axis)
    with monkeypatch.context() as before:
        before.setattr(design, "across", lambda _study, _values: {})
        study = launched(spec, tmp_path)
    assert study.varied == ["borders"]
    assert not study.trials["minimum_image"].any()
    found = verify(study, Serial(), fraction=1.0)
    assert (found.checked.total(), found.differing) == (6, {})
    now = launched(spec, tmp_path)
    assert now.varied == ["borders", "minimum_image"]
    both, flat = now.trials.set_index("trial_id"), study.trials.set_index("trial_id")
    assert (both["minimum_image"] == (both["borders"] == "torus")).all()
    kept = both.index.intersection(flat.index)
    assert set(flat.loc[kept, "borders"]) == {"open"}
    assert (len(kept), now.apart()) == (3, 3)
