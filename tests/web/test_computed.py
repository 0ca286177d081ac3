"""Trials that a page computes: in V8, by the module of the page, they have the results
that are stored, bit for bit, and the frames of a recorded run.
"""

import base64
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from kernels.models import MODELS
from sweep.design.jobs import Job
from sweep.explorer.supplement_starts import (
    Computation,
    computed_metrics,
    computed_start,
)
from sweep.tables.stored_study import StoredStudy
from sweep.trial.simulation import run
from sweep.web import STATIC
from sweep.web.encoding import HEAD, SPAN
from tests.builders import exact_jobs
from tests.builders import job as a_job
from tests.commands import sweep
from tests.explorer.supplements import FLOWN, content_of, page_of
from tests.own_models import written
from tests.studies import launched
from tests.trial import test_all_layers
from tests.web.scripts import frames_of, printed, unpacked


def computed_runs(content: dict[str, Any], folder: Path) -> list[dict[str, Any]]:
    """What the page computes of its runs; frames are in base64."""
    about = json.dumps(
        {name: content[name] for name in ("computation", "runs", "metric", "size")}
    )
    return list(
        printed(
            f"""
import {{ Computer }} from "{(STATIC / "computed.js").as_uri()}";
const {{ computation, metric, runs, size }} = {about};
const computer = new Computer(computation);
const all = [];
for (const {{ start, every, changed }} of runs) {{
  const order = {{ every, size, metric, changed: new Map(changed ?? []) }};
  const one = await computer.run(start, order);
  const frames = Array.from(one.frames, (byte) => String.fromCharCode(byte));
  all.push({{ ...one, frames: btoa(frames.join("")) }});
}}
console.log(JSON.stringify(all));
""",
            folder,
        )
    )


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> StoredStudy:
    return launched(FLOWN, tmp_path_factory.mktemp("computed"))


def in_rows(content: bytes, count: int) -> NDArray[np.uint8]:
    return np.frombuffer(content, np.uint8).reshape(count, -1)


def test_a_page_computes_all_trials_with_their_bits(
    study: StoredStudy, tmp_path: Path
) -> None:
    content = content_of(page_of(study, compute=True, trials=("all",), metric="speed"))
    assert len(content["runs"]) == len(study.trials) == 12
    assert all(unpacked(run["frames"]) == b"" for run in content["runs"])
    size = [float(content["scenes"][0][side]) for side in ("width", "height")]
    about = content | {"metric": "speed", "size": size}
    computed = computed_runs(about, tmp_path)
    assert [one["same"] for one in computed] == [True] * 12
    recorded = content_of(page_of(study, trials=("all",), metric="speed"))["runs"]
    for one, other in zip(computed, recorded, strict=True):
        assert one["steps"] == list(range(0, 61, 2))
        assert one["values"] == other["values"][::2]
        mine = in_rows(base64.b64decode(one["frames"]), 31)
        theirs = in_rows(frames_of(other), 61)[::2]
        n = int(np.frombuffer(theirs[0, 12:16].tobytes(), "<u4")[0])
        assert (mine[:, : HEAD.size] == theirs[:, : HEAD.size]).all()
        places, others = (
            frames[:, HEAD.size : HEAD.size + 4 * n].copy().view("<u2").astype(int)
            for frames in (mine, theirs)
        )
        # Halves are rounded alike; a product may be rounded otherwise by a last bit.
        assert np.abs(places - others).max() <= 1 < SPAN
        turns, other_turns = (
            frames[:, HEAD.size + 4 * n : HEAD.size + 5 * n].astype(int)
            for frames in (mine, theirs)
        )
        apart = np.abs(turns - other_turns)
        assert np.minimum(apart, 256 - apart).max() <= 1


def test_another_result_is_noticed(study: StoredStudy, tmp_path: Path) -> None:
    content = content_of(page_of(study, compute=True, metric="speed"))
    start = content["runs"][1]["start"]
    last = np.frombuffer(base64.b64decode(start["last"])).copy()
    last[0] = np.nextafter(last[0], 1.0)
    start["last"] = base64.b64encode(last.tobytes()).decode()
    about = content | {"metric": "speed", "size": [600.0, 400.0]}
    assert [one["same"] for one in computed_runs(about, tmp_path)] == [
        True,
        False,
        True,
    ]


def test_changed_settings_have_the_bits_of_a_trial_with_them(
    study: StoredStudy, tmp_path: Path
) -> None:
    """From the same start: the generator of the trial is drawn from its seed alone."""
    content = content_of(page_of(study, compute=True, metric="speed"))
    run_ = content["runs"][0]
    job = study.job(study.trial(run_["trial"]))
    changes = {change["name"]: change for change in run_["start"]["changes"]}
    assert {"separation_weight", "alignment_weight", "max_force"} <= changes.keys()
    assert "cohesion_range" not in changes  # it decides the cells of the search
    ends = [changes["separation_weight"][end] for end in ("low", "high")]
    assert ends == [0.5, 2]  # what the study varies
    chosen = {"separation_weight": 1.3, "max_force": 0.31}
    run_["changed"] = [(changes[name]["row"], value) for name, value in chosen.items()]
    about = content | {"metric": "speed", "size": [600.0, 400.0]}
    changed = computed_runs(about | {"runs": [run_]}, tmp_path)[0]
    alone = run(replace(job, settings=job.settings | chosen))
    assert changed["values"][-1] == alone.last["speed"] != run_["stored"]
    assert not changed["same"]


def test_the_simulator_becomes_a_page_that_computes(tmp_path: Path) -> None:
    """Nothing is stored beside the file, which is not replaced."""
    chosen = ("--model", "nguyen2024", "--set", "n=12", "--set", "steps=30")
    asked = ("view", *chosen, "--to", "swarm.html")
    done = sweep(tmp_path, *asked)
    assert (done.returncode, done.stdout) == (0, "swarm.html\n")
    assert [path.name for path in tmp_path.iterdir()] == ["swarm.html"]
    content = content_of((tmp_path / "swarm.html").read_bytes())
    assert content["front"]["title"] == "The model nguyen2024"
    metric = content["figure"]["metric"]["name"]
    about = content | {"metric": metric, "size": [600.0, 400.0]}
    runs = computed_runs(about, tmp_path)
    assert [one["same"] for one in runs] == [True] * 3
    again = sweep(tmp_path, *asked)
    assert again.returncode == 2
    assert "exists already; --force replaces it" in again.stderr
    trial = sweep(tmp_path, "view", "small", "0123", "--to", "new.html")
    assert "--to writes a page of first trials" in trial.stderr
    written(tmp_path / "own")
    own = sweep(tmp_path, "view", "--model", "own/drawn.py", "--to", "new.html")
    assert "use sweep show STUDY --to new.html --compute" in own.stderr


def test_what_a_requirement_names_has_no_slider() -> None:
    """A launch refuses a path_step of more than half of look_ahead."""
    names = {one["name"] for one in computed_start(a_job("rustamani2024")).changes}
    assert "alignment_weight" in names
    assert not {"look_ahead", "path_step"} & names


def of_jobs(jobs: Sequence[Job]) -> dict[str, Any]:
    """The content of a page that computes jobs, with the results of this processor."""
    computation = Computation()
    runs = []
    for job in jobs:
        names = computed_metrics(job)
        numbers = [run(job).last[name] for name in names]
        start = computation.begun(job, computed_start(job), numbers)
        runs.append({"start": start, "every": 4})
    first = computed_metrics(jobs[0])[0]
    return {
        "computation": computation.shared(),
        "runs": runs,
        "metric": first,
        "size": [240.0, 210.0],
    }


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_every_model_has_its_bits_in_a_page(model: str, tmp_path: Path) -> None:
    """Presets, updates, borders and maps; then every layer."""
    base = test_all_layers.a_job(model)
    for jobs in (list(exact_jobs(model)), [base]):
        computed = computed_runs(of_jobs(jobs), tmp_path)
        assert [one["same"] for one in computed] == [True] * len(jobs)
