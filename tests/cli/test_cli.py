"""The command line as a user meets it, with good and bad input."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import chdir, redirect_stderr, redirect_stdout
from functools import partial
from io import BytesIO, StringIO, TextIOWrapper
from pathlib import Path

import pandas as pd
import pytest

from kernels.catalogue import BUILT_IN
from kernels.models import MODELS
from sweep.cli import app, main
from sweep.cli.listing import model_settings, torus_text
from sweep.cli.output import check_output_stream, flush_output, spelled
from sweep.tables.means_text import INTERVALS
from sweep.workers import flying
from sweep.workers.executors import Loky
from tests import ROOT
from tests.commands import SWEEP, run_trials_here, sweep
from tests.commands import started as finished
from tests.faults.campaign import LAUNCH, workers
from tests.faults.jobs import run_or_die
from tests.patience import PATIENCE
from tests.runner_jobs import started
from tests.studies import IMPOSSIBLE, SMALL, launched

STORING_OFTEN = LAUNCH[:3]
"""The command, which stores a part five times a second."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a spec that has been launched."""
    folder = tmp_path_factory.mktemp("user")
    (folder / "spec.yaml").write_text(SMALL)
    done = sweep(folder, "launch", "spec.yaml")
    assert done.returncode == 0, done.stderr
    assert "6 new trials (6 done)" in done.stderr
    assert done.stdout == ""
    return folder


@pytest.mark.slow
def test_a_process_says_what_the_command_says_in_this_one(
    folder: Path, tmp_path: Path
) -> None:
    """Also with a worker, and of a bad spec."""
    (tmp_path / "spec.yaml").write_text(SMALL)
    done = finished(tmp_path, "launch", "spec.yaml", "--workers", "1")
    assert (done.returncode, done.stdout) == (0, "")
    assert "6 new trials (6 done)" in done.stderr
    tables = [sweep(where, "table", "small").stdout for where in (folder, tmp_path)]
    assert tables[0] == tables[1]
    (tmp_path / "spec.yaml").write_text(SMALL.replace("speed", "spead"))
    done = finished(tmp_path, "launch", "spec.yaml")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == sweep(tmp_path, "launch", "spec.yaml").stderr


def test_help_answers_without_the_heavy_libraries() -> None:
    """What is imported is tested, not the time it takes, which would be noise."""
    code = """
import sys
from sweep.cli import main
try:
    main()
except SystemExit as done:
    assert done.code == 0
heavy = "numpy numba pandas pyarrow scipy matplotlib joblib kernels".split()
assert sys.modules.keys().isdisjoint(heavy), sys.modules.keys() & heavy
"""
    done = subprocess.run(
        [sys.executable, "-c", code, "--help"],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 0, done.stderr
    assert "launch" in done.stdout


def test_the_readme_or_the_guide_names_every_command() -> None:
    files = [ROOT / "README.md", *ROOT.glob("docs/guide/*.md")]
    written = "".join(file.read_text(encoding="utf-8") for file in files)
    for command in app.registered_commands:
        assert command.callback is not None
        name = command.name or command.callback.__name__
        assert re.search(rf"\bsweep {name}\b", written), name


def test_plan_counts_without_running(folder: Path) -> None:
    done = sweep(folder, "plan", "spec.yaml", "--json")
    plan = json.loads(done.stdout)
    assert (plan["points"], plan["trials"], plan["varied"]) == (
        2,
        6,
        ["separation_weight"],
    )
    text = sweep(folder, "plan", "spec.yaml").stdout
    assert "trials     6 (3 per point)" in text


def test_a_bad_spec_is_one_line_exit_code_2_and_nothing_written(tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(SMALL.replace("speed", "spead"))
    done = sweep(tmp_path, "launch", "spec.yaml")
    assert done.returncode == 2
    assert done.stderr.startswith(
        'spec.yaml:10: unknown metric "spead"; did you mean "speed"?'
    )
    assert done.stderr.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["spec.yaml"]


def test_a_table_as_text_csv_and_json(folder: Path) -> None:
    text = sweep(folder, "table", "small").stdout
    assert "separation_weight" in text
    assert "±" in text
    csv = pd.read_csv(StringIO(sweep(folder, "table", "small", "--csv").stdout))
    assert list(csv["separation_weight"]) == [0.5, 1.0]
    assert set(csv["speed_n"]) == {3}
    records = json.loads(
        sweep(folder, "table", "small", "--json", "--over", "half").stdout
    )
    assert (
        records[0]["speed_mean_low"]
        < records[0]["speed_mean"]
        < records[0]["speed_mean_high"]
    )


def test_signs_that_an_encoding_lacks_are_spelled(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before the widths of columns are decided."""
    monkeypatch.setattr(sys, "argv", ["sweep", "table", "small"])
    buffer = BytesIO()
    stream = TextIOWrapper(buffer, encoding="ascii")
    with (
        chdir(folder),
        redirect_stdout(stream),
        pytest.raises(SystemExit) as ended,
    ):
        main()
    assert ended.value.code == 0
    text = buffer.getvalue().decode("ascii")
    assert " +- " in text
    rows = [line for line in text.splitlines() if line.startswith(("|", "+"))]
    assert len({len(row) for row in rows}) == 1
    assert spelled("px²: ± 3 → \N{SNOWMAN}", "ascii") == "px^2: +- 3 \\u2192 \\u2603"
    assert spelled("px²: ± 3 →", "utf-8") == "px²: ± 3 →"
    plain = BytesIO()
    with redirect_stdout(TextIOWrapper(plain, encoding="ascii")):
        check_output_stream()
        print("±1 →")
        flush_output()
        assert plain.getvalue() == b"+-1 \\u2192\n"


def test_the_caption_of_a_narrow_table_is_one_line(folder: Path) -> None:
    done = sweep(folder, "table", "small", "--metric", "speed")
    lines = done.stdout.splitlines()
    wanted = INTERVALS[None]
    assert wanted in lines
    assert len(wanted) > max(len(line) for line in lines if line.startswith("│"))


PRINTING = [
    ["--help"],
    ["plan", "spec.yaml"],
    ["status", "small"],
    ["table", "small"],
    ["table", "small", "--csv"],
    ["maps"],
    ["verify", "small"],
    ["diff", "spec.yaml"],
    ["gc", "small", "--dry-run"],
    ["models"],
    ["schema"],
]


@pytest.mark.parametrize("arguments", PRINTING, ids=" ".join)
def test_output_that_cannot_be_written_is_one_line(
    folder: Path, arguments: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["sweep", *arguments])
    run_trials_here(monkeypatch)
    errors = StringIO()
    with (
        Path("/dev/full").open("w") as full,
        chdir(folder),
        redirect_stdout(full),
        redirect_stderr(errors),
        pytest.raises(SystemExit) as ended,
    ):
        main()
    assert ended.value.code == 2
    assert errors.getvalue().splitlines()[-1] == (
        "standard output cannot be written (No space left on device);"
        " send it to another file or disk"
    )
    assert "Traceback" not in errors.getvalue()


@pytest.mark.slow
def test_a_full_disk_and_a_reader_who_leaves_end_a_command_quietly(
    folder: Path,
) -> None:
    """Python, which empties the buffer once more at its end, has nothing to add."""
    command = [*SWEEP, "status", "small"]
    with Path("/dev/full").open("wb") as full:
        done = subprocess.run(
            command, cwd=folder, stdout=full, stderr=subprocess.PIPE, timeout=PATIENCE
        )
    assert (done.returncode, done.stderr.count(b"\n")) == (2, 1)
    assert done.stderr.startswith(b"standard output cannot be written (")
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "wb") as pipe:
        done = subprocess.run(
            command, cwd=folder, stdout=pipe, stderr=subprocess.PIPE, timeout=PATIENCE
        )
    assert (done.returncode, done.stderr) == (0, b"")


def test_a_table_with_another_interval(folder: Path) -> None:
    from sweep.analysis import mean_interval
    from sweep.tables.stored_study import StoredStudy

    students = pd.read_csv(StringIO(sweep(folder, "table", "small", "--csv").stdout))
    csv = pd.read_csv(
        StringIO(
            sweep(folder, "table", "small", "--csv", "--interval", "bootstrap").stdout
        )
    )
    assert list(csv) == list(students)
    trials = StoredStudy("small", folder / "results").trials
    expected = mean_interval(
        trials.loc[trials["separation_weight"] == 0.5, "speed"], interval="bootstrap"
    )
    assert tuple(csv.iloc[0][["speed", "speed_low", "speed_high"]]) == pytest.approx(
        expected[:3], rel=1e-12
    )
    text = sweep(
        folder, "table", "small", "--metric", "speed", "--interval", "bootstrap"
    ).stdout
    assert "mean and 95 % confidence interval by the BCa bootstrap" in text
    assert re.search(r"\d\.\d+ \(\d\.\d+ to \d\.\d+\)", text)


def test_a_comparison_of_two_values(folder: Path) -> None:
    sides = ("small:separation_weight=0.5", "small:separation_weight=1")
    done = sweep(folder, "compare", *sides, "--metric", "speed")
    assert (done.returncode, done.stderr) == (0, "")
    assert "A and B differ in separation_weight (0.5; 1)" in done.stdout
    csv = pd.read_csv(StringIO(sweep(folder, "compare", *sides, "--csv").stdout))
    speeds = pd.read_csv(StringIO(sweep(folder, "table", "small", "--csv").stdout))[
        "speed"
    ]
    assert csv["difference"][0] == pytest.approx(speeds[1] - speeds[0])
    same = sweep(folder, "compare", sides[0], sides[0])
    assert (same.returncode, same.stderr.count("\n")) == (2, 1)
    assert "identical trials: there is nothing to compare" in same.stderr


def test_a_table_of_an_unrecorded_metric_says_which_there_are(folder: Path) -> None:
    done = sweep(folder, "table", "small", "--metric", "sped")
    assert done.returncode == 2
    assert 'unknown metric "sped"; did you mean "speed"?' in done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("launch", "spec.yaml", "--results", "res\udc80ults"),
        ("status", "small", "--results", "res\udc80ults"),
        ("export", "small", "--to", "tri\udc80als.csv"),
        ("export", "small", "--to", "tri\udc80als.parquet"),
    ],
    ids=["results of a launch", "results", "csv", "parquet"],
)
def test_a_name_that_is_no_utf_8_is_refused_before_any_work(
    folder: Path, arguments: tuple[str, ...]
) -> None:
    there = sorted(folder.iterdir())
    done = sweep(folder, *arguments)
    assert done.returncode == 2
    assert "the name is not UTF-8; choose another" in done.stderr
    assert sorted(folder.iterdir()) == there


def test_status_counts_what_is_stored(folder: Path) -> None:
    assert json.loads(sweep(folder, "status", "small", "--json").stdout)[
        "statuses"
    ] == {"done": 6}
    assert "done      6" in sweep(folder, "status", "small").stdout


def test_an_unknown_study_is_one_line(folder: Path) -> None:
    done = sweep(folder, "status", "smal")
    assert done.returncode == 2
    assert "no study has been launched here" in done.stderr
    assert "Traceback" not in done.stderr


def test_failed_trials_make_exit_code_1_and_show_how_to_replay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "spec.yaml").write_text(IMPOSSIBLE)
    done = sweep(tmp_path, "launch", "spec.yaml", "--workers", "1")
    assert done.returncode == 1
    status = sweep(tmp_path, "status", "small").stdout
    command = re.search(r"sweep (replay small \w+)", status)
    assert command is not None
    monkeypatch.setattr(sys, "argv", ["sweep", *command[1].split()])
    errors = StringIO()
    with (
        chdir(tmp_path),
        redirect_stderr(errors),
        pytest.raises(RuntimeError, match="no free place for a boid") as caught,
    ):
        main()
    assert errors.getvalue() == (
        f"small: the trial has failed: RuntimeError: {caught.value}\n"
    )


def test_replay_gives_the_stored_bits(folder: Path) -> None:
    trial = str(pd.read_json(StringIO(table_of(folder)))["trial_id"][2])
    done = sweep(folder, "replay", "small", trial)
    assert done.returncode == 0, done.stdout
    assert "bitwise identical to the stored values" in done.stdout
    assert sweep(folder, "replay", "small", trial[:12]).stdout == done.stdout


def table_of(folder: Path) -> str:
    """The trials of the launched study, as JSON."""
    from sweep.tables.stored_study import StoredStudy

    return str(
        StoredStudy("small", folder / "results").trials.to_json(orient="records")
    )


def test_replay_of_an_unknown_trial_is_one_line(folder: Path) -> None:
    done = sweep(folder, "replay", "small", "nonsense")
    assert done.returncode == 2
    assert 'unknown trial "nonsense"' in done.stderr


@pytest.mark.parametrize("command", ["models", "maps", "metrics"])
def test_listings_name_everything(folder: Path, command: str) -> None:
    from kernels.metrics import METRICS
    from kernels.worlds import MAPS

    names = {"models": MODELS, "maps": MAPS, "metrics": METRICS}[command]
    shown = sweep(folder, command).stdout
    assert all(name in shown for name in names)


def test_the_settings_of_a_model_are_listed(folder: Path) -> None:
    shown = sweep(folder, "models", "aziel_chen2025").stdout
    assert "perception_range" in shown
    assert "degrees" in shown
    below = " ".join(shown[shown.index("Differs from robot to robot") :].split())
    refused = 'parameter "dt_spread" cannot be used'
    spec = "study: a\nmodel: aziel_chen2025\nreplicates: 1\nfixed: {dt_spread: 1}\n"
    (folder / "differing.yaml").write_text(spec, encoding="utf-8")
    said = sweep(folder, "plan", "differing.yaml").stderr
    assert refused in said
    assert below.split(": ")[1] == said.strip().split("may differ: ")[1]
    assert 'unknown model "aziel"' in sweep(folder, "models", "aziel").stderr


@pytest.mark.parametrize(
    ("model", "lines"),
    [
        (
            "nguyen2024",
            [
                "The torus of preset as_run wraps positions only: boids do not"
                " perceive each other across the borders"
            ],
        ),
        ("vicsek1995", []),
        ("aziel_chen2025", []),
    ],
)
def test_a_torus_that_wraps_positions_only_is_named(
    model: str, lines: list[str]
) -> None:
    assert torus_text(MODELS[model]) == lines
    caption = str(model_settings(model, BUILT_IN).caption)
    assert caption.splitlines()[:-1] == lines


def test_the_schema_is_json(folder: Path) -> None:
    assert json.loads(sweep(folder, "schema").stdout)["$schema"].startswith(
        "http://json-schema.org/draft-07/"
    )


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_done_and_the_same_command_goes_on(tmp_path: Path) -> None:
    spec = SMALL.replace("[0.5, 1]", "[1]").replace("steps: 9", "steps: 2000")
    (tmp_path / "spec.yaml").write_text(
        spec.replace("replicates: 3", "replicates: 10000")
    )
    with started(
        [*STORING_OFTEN, "launch", "spec.yaml", "--workers", "2"], tmp_path
    ) as process:
        wait_for_part(tmp_path, process)
        os.killpg(process.pid, signal.SIGINT)
        _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130, errors
    assert errors.endswith(
        "interrupted; finished trials are stored, and the same command resumes the"
        " run\n"
    ), errors
    assert "Traceback" not in errors
    stored = json.loads(sweep(tmp_path, "status", "small", "--json").stdout)["statuses"]
    assert 0 < stored["done"] < 10_000
    (tmp_path / "spec.yaml").write_text(
        spec.replace("replicates: 3", f"replicates: {stored['done'] + 5}")
    )
    again = sweep(tmp_path, "launch", "spec.yaml")
    assert again.returncode == 0
    assert (
        json.loads(sweep(tmp_path, "status", "small", "--json").stdout)["statuses"][
            "done"
        ]
        == stored["done"] + 5
    )
    kept = re.search(r"(\d+) of them stored already", again.stderr)
    assert kept is not None
    assert int(kept[1]) > 0


def wait_for_part(folder: Path, process: "subprocess.Popen[str]") -> None:
    """Wait until the launch has stored something."""
    for _ in range(600):
        if list(folder.glob("results/small/parts/*")):
            return
        assert process.poll() is None, process.communicate()[1]
        time.sleep(0.1)
    raise AssertionError("nothing was stored in a minute")


@pytest.mark.slow
def test_a_worker_that_is_killed_loses_no_trial(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The whole study is there, after one launch."""
    quiet, engine = launched(SMALL, tmp_path / "quiet"), Loky(1)
    with monkeypatch.context() as patch:
        patch.setattr(flying, "run", partial(run_or_die, str(tmp_path / "died")))
        troubled = launched(SMALL, tmp_path / "troubled", engine)
    engine.stop()
    assert (tmp_path / "died").exists()
    pd.testing.assert_frame_equal(
        troubled.trials.drop(columns="seconds"),
        quiet.trials.drop(columns="seconds"),
        check_exact=True,
    )


@pytest.mark.slow
def test_a_worker_killed_at_any_moment_loses_no_trial(tmp_path: Path) -> None:
    """Of the command itself, from outside."""
    spec = SMALL.replace("replicates: 3", "replicates: 30").replace(
        "steps: 9", "steps: 8000"
    )
    (tmp_path / "spec.yaml").write_text(spec)
    with started(
        [*STORING_OFTEN, "launch", "spec.yaml", "--workers", "2"], tmp_path
    ) as process:
        wait_for_part(tmp_path, process)
        os.kill(workers(process.pid)[0], signal.SIGKILL)
        _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, errors
    killed = launched_again(tmp_path / "results")
    quiet = launched(spec, tmp_path / "quiet")
    pd.testing.assert_frame_equal(
        killed.drop(columns="seconds"),
        quiet.trials.drop(columns="seconds"),
        check_exact=True,
    )


def launched_again(results: Path) -> pd.DataFrame:
    """The stored trials."""
    from sweep.tables.stored_study import StoredStudy

    return StoredStudy("small", results).trials


@pytest.mark.parametrize("command", [("table", "small"), ("compare", "a", "b")])
def test_two_formats_are_refused_before_anything_is_read(
    command: tuple[str, ...], tmp_path: Path
) -> None:
    done = sweep(tmp_path, *command, "--csv", "--json")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "--csv and --json are two formats: choose one\n"
