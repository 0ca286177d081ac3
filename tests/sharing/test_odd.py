"""The ODD description says all that a model says of itself, and what it does not."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

import sweep as package
from kernels.models import MODELS
from sweep.design.design import expand
from sweep.errors import ChoiceError
from sweep.own_code.reading import load_spec
from sweep.published.creating import create
from sweep.published.model_studies import begin_with_model
from sweep.sharing.odd_document import StudyFacts, odd, of_spec, of_stored
from sweep.spec.settings import settings_of
from sweep.spec.study import parse_spec
from sweep.tables.stored_study import StoredStudy
from tests import ROOT
from tests.campaigns.test_chains import CHAINED
from tests.cases import slow_but
from tests.commands import sweep
from tests.plotted import SEARCHED as SEARCHED_SPEC
from tests.searches import asked_by
from tests.studies import DERIVING, OWN_SMALL, SMALL, launched, read

ELEMENTS = [
    "1. Purpose and patterns",
    "2. Entities, state variables and scales",
    "3. Process overview and scheduling",
    "4. Design concepts",
    "5. Initialization",
    "6. Input data",
    "7. Submodels",
    "The experiment",
    "References",
    "Gaps",
]
CONCEPTS = [
    *("Basic principles", "Emergence", "Adaptation", "Objectives", "Learning"),
    *("Prediction", "Sensing", "Interaction", "Stochasticity", "Collectives"),
    "Observation",
]
"""The eleven of Grimm et al. 2020, in their order."""
EXAMPLES = sorted(path.stem for path in (ROOT / "examples").glob("*.yaml"))


def of_text(spec: str) -> StudyFacts:
    study = read(spec)
    return of_spec(study, expand(study))


def described(name: str) -> StudyFacts:
    """A study of a built-in model, or an example."""
    if name not in MODELS:
        study = load_spec(ROOT / "examples" / f"{name}.yaml")
        return of_spec(study, expand(study))
    preset = next(iter(MODELS[name].presets))
    spec = f"study: x\nmodel: {name}\npreset: {preset}\nreplicates: 2\nseed: 1\n"
    study = parse_spec(spec)
    return of_spec(study, expand(study))


@pytest.mark.parametrize("name", [*MODELS, *EXAMPLES])
def test_a_description_has_every_element_and_all_that_a_model_says(name: str) -> None:
    about = described(name)
    text = odd(about)
    assert re.findall(r"^## (.*)$", text, re.MULTILINE) == ELEMENTS
    third = re.findall(r"^### (.*)$", text.split("## 4.")[1].split("## 5.")[0], re.M)
    assert third == CONCEPTS
    rows = text.split("\n")
    [off] = re.findall(r"have no effect on any trial: (.*)\.$", text, re.MULTILINE)
    for setting in settings_of(about.model.name, about.catalogue).values():
        if setting.name in off.split(", "):
            continue
        row, *_ = (one for one in rows if one.startswith(f"| {setting.name} | "))
        assert setting.unit in row
        assert " ".join(setting.text.split()) in row.replace("\\|", "|")
    for rule in about.model.rules:
        assert any(row.startswith(f"| {rule.name} | {rule.weight} |") for row in rows)
    for metric in about.record:
        assert about.catalogue.metrics[metric].source in text
    for state in about.model.state:
        assert any(row.startswith(f"| {state} |") for row in rows)
    assert all(kind in text for kind in about.model.kinds)
    assert about.model.source in text or name in MODELS
    if about.model.equations:
        assert about.model.equations.strip() in text.split("## 7.")[1]
    else:
        assert "`observe`" in text.split("## 7.")[1]


@pytest.mark.parametrize(
    "name", slow_but(["nguyen2024", EXAMPLES[0]], [*MODELS, *EXAMPLES])
)
def test_every_gap_is_listed_at_the_end(name: str) -> None:
    text, end = odd(described(name)).split("## Gaps")
    gaps = re.findall(r"^\*not stated: (.*)\*$", text, re.MULTILINE)
    assert [f"- {gap}" for gap in gaps] == end.strip().split("\n")
    assert "patterns by which the model is judged" in end
    assert "None" not in text


def test_one_empty_line_is_between_paragraphs() -> None:
    text = odd(described("vortex"))
    lines = text.splitlines()
    gaps = [k for k, line in enumerate(lines) if line.startswith("*not stated")]
    assert gaps
    assert all(lines[k - 1] == "" for k in gaps)
    assert "\n\n\n" not in text


def test_goals_in_turn_are_told_where_there_are_several() -> None:
    spec = "study: x\nmodel: aziel_chen2025\nreplicates: 1\nseed: 1\n"
    later = "fixed: {map: empty, next_goals: [[1, 2], [3, 4.5]]}\n"
    said = "Further goals follow, one after the other: 1 2; 3 4.5."
    assert said in odd(of_text(spec + later))
    assert "Further goals follow" not in odd(of_text(spec))


def test_the_order_of_updates_is_told_where_a_setting_or_the_model_says_it() -> None:
    gap, of_vortex = "- whether boids are updated", described("vortex")
    said = odd(described("nguyen2024"))
    assert "The parameter update sets the order: synchronous." in said
    assert gap not in said
    said = odd(of_vortex)
    assert (
        "Order of updates: all boids at once, from the flock as it was before" in said
    )
    assert gap not in said
    silent = replace(of_vortex, model=of_vortex.model._replace(update_order=""))
    assert gap in odd(silent)


def test_a_step_has_the_parts_that_have_an_effect() -> None:
    spec = "study: x\nmodel: nguyen2024\nreplicates: 1\nseed: 1\n"
    plain = numbered(odd(of_text(spec)))
    assert plain == [
        "Each boid gets a commanded velocity by the submodels below.",
        "Each boid moves, and the boundary condition `borders` applies.",
        "A frame is recorded at each step.",
    ]
    more = "record: {metrics: [speed], every: 5}\nfixed: {map: empty, "
    fixed = "wind_x: 1, packet_loss: 0.1, motor_lag: 2, failing_share: 0.1}\n"
    wind, sensing, _, changes, *_, recorded = numbered(
        odd(of_text(spec + more + fixed))
    )
    assert wind.startswith("The wind carries all boids.")
    assert sensing.startswith("Each boid perceives other boids, as the parameters")
    assert changes.startswith("The actuation and failures of the boid change")
    assert recorded == "A frame is recorded every 5 steps, and at the last step."


def numbered(text: str) -> list[str]:
    return re.findall(r"^\d+\. (.*)$", text.split("## 3.")[1].split("## 4.")[0], re.M)


@pytest.mark.parametrize(
    "spec",
    [SMALL, OWN_SMALL, DERIVING, CHAINED],
    ids=["ours", "own", "derived", "chains"],
)
def test_a_stored_study_is_described_as_its_spec(spec: str, tmp_path: Path) -> None:
    assert odd(of_stored(launched(spec, tmp_path))) == odd(of_text(spec))


def test_chains_are_described() -> None:
    said = " ".join(odd(of_text(CHAINED)).split())
    assert (
        "Trials along separation_weight are links of chains, one chain per replicate,"
        " up and then down. The first link begins as stated"
    ) in said
    assert "links of chains" not in odd(of_text(SMALL))


def test_the_experiment_is_that_of_the_spec() -> None:
    spec = SMALL.replace("[0.5, 1]", "{linspace: [0, 1, 11]}")
    text = odd(of_text(f"# Does separation matter?\n# Yes.\n{spec}"))
    assert "11 points, 3 trials per point, 33 trials in total. Preset as_run." in text
    assert "| separation_weight | 11 values from 0 to 1 |" in text
    assert "The spec of the study begins: Does separation matter? Yes." in text
    assert "Random numbers are made from the seed 5." in text
    assert "| noise | independent | random numbers during a trial |" in text
    listed = SMALL.replace("replicates: 3", "seeds: [7, 8]")
    text = odd(of_text(listed))
    assert "4 trials in total" in text
    assert "Random numbers are the seeds 7, 8." in text
    assert all(f"    {line}" in text for line in listed.strip().split("\n"))


def test_a_study_begun_by_us_has_no_purpose_before_its_author_says_one(
    tmp_path: Path,
) -> None:
    """No hint of ours and no path of a schema is quoted as one."""
    small = begin_with_model("nguyen2024", tmp_path / "small.yaml").path
    _, eddy, _ = create("model", "eddy", tmp_path)
    for path in (small, eddy):
        study = load_spec(path)
        text = odd(of_spec(study, expand(study)))
        assert "- the purpose of this study" in text.split("## Gaps")[1]
        assert "The spec of the study begins" not in text
        asked = "- who described the model eddy, and where" in text
        assert asked == (path is eddy)
        assert "file://" not in text
        for_editors, rest = study.text.split("\n", 1)
        path.write_text(f"{for_editors}\n# Why?\n{rest}", encoding="utf-8")
        study = load_spec(path)
        text = odd(of_spec(study, expand(study)))
        assert "The spec of the study begins: Why?\n" in text


def test_a_search_has_the_points_that_it_asks_for(tmp_path: Path) -> None:
    text = odd(of_text(SEARCHED_SPEC))
    assert "The study is a search, which chooses points during the run." in text
    assert " trials in total" not in text
    assert "| separation_weight | searched |" in text
    asked_by(SEARCHED_SPEC, tmp_path)
    stored = odd(of_stored(StoredStudy("searched", tmp_path)))
    assert "The study is a search, which chooses points during the run." in stored
    assert re.search(r"^\| separation_weight \| [\d., ]+ \|$", stored, re.M)


def test_code_that_may_not_run_leaves_gaps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    launched(OWN_SMALL, tmp_path)
    monkeypatch.setattr("sweep.store.stored_code.own_key", lambda: b"somebody else")
    text = odd(of_stored(StoredStudy("small", tmp_path)))
    assert text.count("the custom code of the model was not loaded") == 8
    assert "| swirl | swirl_weight |" in text
    trusted = StoredStudy("small", tmp_path, trust=True)
    assert odd(of_stored(trusted)) == odd(of_text(OWN_SMALL))


def test_a_study_without_trials_is_not_described(tmp_path: Path) -> None:
    study = launched(SMALL, tmp_path)
    for part in study.store.current_parts():
        study.store.discard(part)
    with pytest.raises(ChoiceError, match="no trials are stored"):
        of_stored(StoredStudy("small", tmp_path))


def test_the_command_takes_a_spec_or_a_study(tmp_path: Path) -> None:
    (tmp_path / "small.yaml").write_text(SMALL)
    launched(tmp_path / "small.yaml", tmp_path / "results")
    one, other = (sweep(tmp_path, "odd", name) for name in ("small.yaml", "small"))
    assert (one.returncode, one.stderr) == (0, "")
    assert one.stdout == other.stdout
    assert package.odd(SMALL) == one.stdout
    results = tmp_path / "results"
    for named in (
        "small",
        package.load("small", results),
        str(tmp_path / "small.yaml"),
    ):
        assert package.odd(named, results) == one.stdout
    assert package.odd(StoredStudy("small", results)) == one.stdout
    for given, said in (
        ("none.yaml", "none.yaml: no such file"),
        ("smal", 'did you mean "small"'),
        ("../x", "is not allowed"),
    ):
        refused = sweep(tmp_path, "odd", given)
        assert (refused.returncode, refused.stdout) == (2, "")
        assert said in refused.stderr
    (tmp_path / "own.yaml").write_text(OWN_SMALL)
    assert "no code may run" in sweep(tmp_path, "odd", "own.yaml", "--no-code").stderr


@pytest.mark.parametrize(
    ("keys", "shown", "hidden"),
    [
        ("record: {metrics: [speed]}", [], ["flock_range", "pixel", "goal_radius"]),
        ("record: {metrics: [flock_count]}", ["flock_range"], ["pixel"]),
        ("record: {metrics: [coverage]}", ["pixel", "footprint"], ["flock_range"]),
        ("sweep: {gust: [0, 1]}", ["gust", "gust_time"], ["wind_x"]),
        ("sweep: {start_radius: [0, 5]}", ["start_radius", "start_center_x"], []),
        ("fixed: {map: empty}", [], ["n_obstacles", "start_radius"]),
        ("sweep: {map: [empty, random_obstacles]}", ["obstacle_radius"], []),
    ],
)
def test_parameters_without_an_effect_are_in_one_sentence(
    keys: str, shown: list[str], hidden: list[str]
) -> None:
    spec = f"study: x\nmodel: nguyen2024\nreplicates: 2\n{keys}\n"
    study = parse_spec(spec)
    text = odd(of_spec(study, expand(study)))
    [off] = re.findall(r"have no effect on any trial: (.*)\.$", text, re.MULTILINE)
    rows = re.findall(r"^\| (\w+) \|", text, re.MULTILINE)
    assert set(shown) <= set(rows) - set(off.split(", "))
    assert set(hidden) <= set(off.split(", ")) - set(rows)
