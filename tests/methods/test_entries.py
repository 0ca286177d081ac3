"""A method is one entry: its reports are commands, and reports of a loaded study."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pyarrow as pa
import pytest

import sweep
from sweep.cli.app import app
from sweep.errors import ChoiceError
from sweep.method import methods
from sweep.spec.study import parse_spec
from sweep.store.plan_about import PlanAbout
from sweep.tables import StoredStudy
from tests import ROOT
from tests.commands import started_in_turn
from tests.other_packages import install
from tests.patience import PATIENCE
from tests.studies import SMALL, launched

COUNTING = '''"""How many trials there are, and whether they are many."""

from typing import Annotated

import typer

from sweep.method import Method


def count(
    study,
    many: Annotated[int, typer.Option(help="So many trials are many.")] = 100,
):
    """How many trials a study has."""
    import pandas as pd

    from sweep.tables.reports import Report, TextTable

    trials = len(study.trials)
    rows = pd.DataFrame({"study": [study.name], "trials": [trials]})
    table = TextTable(["study", "trials"], [[study.name, str(trials)]])
    verdict = "many" if trials >= many else "few"
    return Report(rows, {"trials": trials, "verdict": verdict}, [table, verdict])


def studies(results):
    """How many studies a folder has."""
    import pandas as pd

    from sweep.tables.reports import Report

    names = sorted(path.name for path in results.iterdir())
    return Report(pd.DataFrame({"name": names}), names, names)


METHOD = Method(reports=(count,), reports_of_results=(studies,))
'''
REPEATING = '''"""A study again with other seeds: its section, variants and report."""

from dataclasses import dataclass
from typing import Annotated

from sweep.method import Method


def repeats(study):
    """How often a study was run."""
    import pandas as pd

    from sweep.tables.reports import Report, TextTable

    seeds = study.about.sections["repeat"]
    rows = pd.DataFrame({"seed": seeds})
    table = TextTable(["seed"], [[str(seed)] for seed in seeds])
    return Report(rows, {"seeds": seeds}, [table])


def sections():
    from sweep.errors import SpecError
    from sweep.spec.contents import ListOf, Whole
    from sweep.spec.keys import Key, LaterSectionOf, read_section
    from sweep.spec.section import SpecSection, StudyVariant
    from sweep.spec.strict_yaml import parse_document

    @dataclass(frozen=True)
    class Repeat:
        seeds: Annotated[
            tuple[int, ...], Key(ListOf(Whole(0), "seeds"), "seeds", example="[1]")
        ]

    key = Key(
        LaterSectionOf(Repeat), "runs it again", name="repeat", otherwise="once"
    )

    def read(root, context):
        return read_section(Repeat, root.child("repeat"))

    def check(root, value, context):
        if context.replication.replicates == 1:
            raise root.child("repeat").error("one trial is nothing to repeat")

    def variants(study, value):
        spec = parse_document(study.text, study.path).value
        del spec["repeat"]
        return [
            StudyVariant(
                f"seed-{seed}",
                f"seed {seed}",
                ("repeat", "seeds"),
                spec | {"study": f"{study.name}/seed-{seed}", "seed": seed},
            )
            for seed in value.seeds
        ]

    def check_recorded(seeds, about):
        if len(seeds) > len(set(seeds)):
            raise ValueError("a seed stands twice")

    return [
        SpecSection(
            key,
            read=read,
            check=check,
            not_beside={"search": "it looks for one best"},
            needs={"required": ["replicates"]},
            variants=variants,
            recorded=lambda study, value: [study.seed, *value.seeds],
            shape=[int],
            check_recorded=check_recorded,
        )
    ]


METHOD = Method(reports=(repeats,), sections=sections)
'''
DOUBLING = '''"""A section whose strategy doubles the trials of each point."""

import os
from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np
import pandas as pd
from sweep.campaigns.design_plan import plan_tables
from sweep.campaigns.progress import Progress
from sweep.campaigns.strategy import Round
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.method import Method
from sweep.spec.contents import Whole
from sweep.spec.keys import Key, LaterSectionOf, read_section
from sweep.spec.section import SpecSection, recorded_rule
from sweep.tables import Report


@dataclass(frozen=True)
class Keys:
    times: Annotated[int, Key(Whole(1, 3), "how often", example="1")]


@dataclass(frozen=True)
class Rule:
    least: int
    times: int
    place = ("double",)
    adds_points = False
    counted = "its trials are counted at their most"
    where = ""
    in_words = ", doubled"
    nominal = 0.95

    @property
    def most(self):
        return self.least * 2**self.times

    def most_trials(self, points):
        return points * self.most

    @property
    def looks(self):
        return tuple(self.least * 2**k for k in range(self.times + 1))

    def as_json(self):
        return {"times": self.times, "confidence": 0.95}


class Doubling:
    grows = True
    looks_at = ("speed",)

    def __init__(self, study, rule, _results):
        self.study, self.rule = study, rule
        self.design = expand(study)
        points = self.design.n_points
        self.progress = Progress(points, points * rule.most, settled=0)

    def rounds(self, look):
        had = 0
        for count in self.rule.looks:
            trials = np.full(self.design.n_points, count)
            jobs = Jobs(self.study, self.design, trials)
            ids = jobs.ids()
            new = np.flatnonzero(np.tile(np.arange(count) >= had, len(trials)))
            run = lambda some, jobs=jobs, new=new: jobs.to_run(new[some])
            yield Round(ids[new], run, partial(plan_tables, ids, jobs))
            assert look()["speed"].to_numpy().min() > 0
            had = count
            if os.environ.get("KILLED_AFTER") == str(count):
                os._exit(9)
        self.progress.settled = self.design.n_points


def read(root, context):
    times = read_section(Keys, root.child("double")).times
    return Rule(context.replication.replicates, times)


def status(study):
    record = study.about.sections.get("double")
    return {"doubled": f"{record['times']} times"} if record else {}


def doubled(study):
    """How often trials were doubled."""
    times = study.about.sections["double"]["times"]
    rows = pd.DataFrame({"times": [times], "trials": [len(study.trials)]})
    return Report(rows, {"times": times}, [f"{times} times"])


SECTION = SpecSection(
    Key(LaterSectionOf(Keys), "more trials", name="double", otherwise="none"),
    read=read,
    strategy=Doubling,
    recorded=lambda study, rule: recorded_rule(rule),
    shape={"times": int},
    looks_at=lambda record: ("speed",),
)
METHOD = Method(sections=lambda: [SECTION], status=status, reports=(doubled,))
'''
DOUBLED = '''"""Its kind of figure."""

from sweep.figures import FigureKind
from sweep.figures.curves import marks, plan

KIND = FigureKind("curves of doubled trials", ("by",), plan, marks=marks)
'''
EXPLORED = """
import json
from pathlib import Path
from sweep.explorer.asking import AskFigure
from sweep.explorer.drawn import figure
from sweep.explorer.watching import Watched

answer = figure(Watched(Path("results")), AskFigure(study="small", kind="doubled"))
print(json.dumps([answer["kinds"]["doubled"], answer["command"]]))
"""
BROKEN = "import nowhere_to_be_found"


LAUNCHED = """
import sys
from sweep.cli import main

sys.argv = ["sweep", "launch", "small.yaml", "--workers", "1"]
main()
"""


def python_with(
    packages: Path, folder: Path, code: str
) -> subprocess.CompletedProcess[str]:
    """What some code does in a folder, in a process that finds the packages too."""
    path = os.pathsep.join([str(packages), str(ROOT)])
    return subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )


def test_a_method_of_a_package_is_a_command(tmp_path: Path) -> None:
    launched(SMALL, tmp_path / "results")
    offered = {"counting": "counting.method:METHOD", "broken": "counting.broken:METHOD"}
    files = {"__init__.py": "", "method.py": COUNTING, "broken.py": BROKEN}
    packages = install(tmp_path, {"boidsweep.methods": offered}, files, name="counting")
    text, as_json, csv, latex, restricted, of_results, helped = started_in_turn(
        tmp_path,
        packages,
        ("count", "small"),
        ("count", "small", "--many", "3", "--json"),
        ("count", "small", "--csv"),
        ("count", "small", "--latex"),
        ("count", "small", "--where", "separation_weight=1", "--json"),
        ("studies", "--json"),
        ("count", "--help"),
    )
    assert text.stdout.splitlines()[-1] == "few"
    assert json.loads(as_json.stdout) == {"trials": 6, "verdict": "many"}
    assert csv.stdout == "study,trials\nsmall,6\n"
    assert "small & 6" in latex.stdout
    assert json.loads(restricted.stdout)["trials"] == 3
    assert json.loads(of_results.stdout) == ["small"]
    assert "How many trials a study has." in helped.stdout
    assert "So many trials are many." in helped.stdout
    why = "broken cannot be used: counting 1.0 has it in counting.broken"
    assert why in text.stderr


@pytest.fixture
def repeating(tmp_path: Path) -> Path:
    """A package whose method has a section."""
    offered = {"repeating": "repeating.method:METHOD"}
    files = {"__init__.py": "", "method.py": REPEATING}
    return install(tmp_path, {"boidsweep.methods": offered}, files, name="repeating")


@pytest.mark.slow
def test_a_section_of_a_package_is_read_run_and_recorded(
    tmp_path: Path, repeating: Path
) -> None:
    """From the spec to its report, with what an editor knows of it."""
    spec = tmp_path / "small.yaml"
    spec.write_text(f"{SMALL}repeat: {{seeds: [7, 8]}}\n", encoding="utf-8")
    plan, launch, again, report, variant, schema, odd, pack = started_in_turn(
        tmp_path,
        repeating,
        ("plan", "small.yaml"),
        ("launch", "small.yaml", "--workers", "1"),
        ("launch", "small.yaml", "--workers", "1"),
        ("repeats", "small", "--json"),
        ("table", "small/seed-8", "--csv"),
        ("schema",),
        ("odd", "small"),
        ("pack", "small"),
    )
    assert [one.returncode for one in (plan, launch, again, odd, pack)] == [0] * 5
    assert "small/seed-7" in plan.stdout
    assert json.loads(report.stdout) == {"seeds": [5, 7, 8]}
    assert variant.stdout.count("\n") == 3
    known = json.loads(schema.stdout)
    assert known["properties"]["repeat"]["properties"]["seeds"]["type"] == "array"
    assert known["dependencies"]["repeat"] == {"required": ["replicates"]}


@pytest.mark.slow
def test_what_is_wrong_with_a_section_of_a_package_is_said_with_all_else(
    tmp_path: Path, repeating: Path
) -> None:
    spec = tmp_path / "small.yaml"
    wrong = f"{SMALL}repeat: {{seed: [7], seeds: [-1]}}\nsearch: {{}}\n"
    spec.write_text(wrong, encoding="utf-8")
    alone = SMALL.replace("replicates: 3", "replicates: 1")
    (tmp_path / "alone.yaml").write_text(f"{alone}repeat: {{seeds: [7]}}\n")
    refused, of_one = started_in_turn(
        tmp_path, repeating, ("plan", "small.yaml"), ("plan", "alone.yaml")
    )
    assert 'unknown key "seed"; did you mean "seeds"?' in refused.stderr
    assert "an integer" in refused.stderr
    why = 'a study with "repeat" takes no "search": it looks for one best'
    assert why in refused.stderr
    assert "one trial is nothing to repeat" in of_one.stderr


@pytest.mark.slow
def test_a_study_with_a_section_of_a_package_that_is_gone_is_read(
    tmp_path: Path, repeating: Path
) -> None:
    """What its plan records of the section stays, and its trials are read; a launch of
    the spec says that nobody knows the key.
    """
    spec = tmp_path / "small.yaml"
    spec.write_text(f"{SMALL}repeat: {{seeds: [7]}}\n", encoding="utf-8")
    (launch,) = started_in_turn(
        tmp_path, repeating, ("launch", "small.yaml", "--workers", "1")
    )
    assert launch.returncode == 0
    nothing = tmp_path / "no packages"
    table, again = started_in_turn(
        tmp_path, nothing, ("table", "small", "--csv"), ("launch", "small.yaml")
    )
    assert table.stdout.count("\n") == 3
    assert 'unknown key "repeat"' in again.stderr


@pytest.fixture(scope="module")
def doubled(
    tmp_path_factory: pytest.TempPathFactory,
) -> list[subprocess.CompletedProcess[str]]:
    """What commands do with a package whose section adds trials, and which also offers
    sections that cannot be.
    """
    folder = tmp_path_factory.mktemp("doubled")
    offered = {
        "doubling": "doubling.method:METHOD",
        "seeding": "doubling.seeding:METHOD",
        "forming": "doubling.forming:METHOD",
        "shapeless": "doubling.shapeless:METHOD",
    }
    files = {
        "__init__.py": "",
        "method.py": DOUBLING,
        "seeding.py": DOUBLING.replace('name="double"', 'name="seed"'),
        "forming.py": DOUBLING.replace('name="double"', 'name="again"').replace(
            "read=read", 'form_of="replicates", read=read'
        ),
        "shapeless.py": DOUBLING.replace('name="double"', 'name="loose"').replace(
            '    shape={"times": int},\n', ""
        ),
    }
    packages = install(folder, {"boidsweep.methods": offered}, files, name="doubling")
    spec = f"{SMALL}double: {{times: 2}}\n"
    until = "replicates: {until: {metric: speed, half_width: 0.1}, min: 3, max: 9}"
    (folder / "small.yaml").write_text(spec, encoding="utf-8")
    (folder / "fewer.yaml").write_text(spec.replace("times: 2", "times: 1"))
    (folder / "two.yaml").write_text(spec.replace("replicates: 3", until))
    return started_in_turn(
        folder,
        packages,
        ("plan", "small.yaml"),
        ("plan", "two.yaml"),
        ("plan", "small.yaml", "--json"),
        ("launch", "small.yaml", "--shard", "1/2"),
        ("launch", "fewer.yaml", "--workers", "1"),
        ("launch", "small.yaml", "--workers", "1"),
        ("launch", "small.yaml", "--workers", "1"),
        ("status", "small"),
        ("table", "small", "--csv"),
    )


def test_a_section_of_a_package_decides_which_trials_run(
    doubled: list[subprocess.CompletedProcess[str]],
) -> None:
    """Its strategy looks at what is stored, and asks for more: in one launch, or after
    one that was cut off.
    """
    plan, _, as_json, share, fewer, more, again, status, table = doubled
    assert "6 to 24 (3 to 12 per point, doubled)" in plan.stdout
    told = json.loads(as_json.stdout)
    assert told["double"] == {"times": 2, "confidence": 0.95}
    assert (told["trials"], told["until"], told["refine"]) == (24, None, None)
    assert "small.yaml:11: the next trials depend" in share.stderr
    assert [one.returncode for one in (fewer, more, again)] == [0, 0, 0]
    assert "24 trials, 12 of them stored already" in more.stderr
    assert "doubled   2 times" in status.stdout
    assert "trials    24" in status.stdout
    assert table.stdout.count("\n") == 3


@pytest.mark.slow
def test_a_method_of_a_package_goes_through_a_kill_and_to_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its study is killed and resumed, packed and loaded; its report and its figure
    are commands and pages.
    """
    offered = {
        "boidsweep.methods": {"doubling": "doubling.method:METHOD"},
        "boidsweep.figures": {"doubled": "doubling.figure:KIND"},
    }
    files = {"__init__.py": "", "method.py": DOUBLING, "figure.py": DOUBLED}
    packages = install(tmp_path, offered, files, name="doubling")
    (tmp_path / "small.yaml").write_text(f"{SMALL}double: {{times: 2}}\n")
    with monkeypatch.context() as killing:
        killing.setenv("KILLED_AFTER", "6")
        killed = python_with(packages, tmp_path, LAUNCHED)
    assert killed.returncode == 9
    assert len(StoredStudy("small", tmp_path / "results").trials) == 12
    launch, pack, load, report, plot = started_in_turn(
        tmp_path,
        packages,
        ("launch", "small.yaml", "--workers", "1"),
        ("pack", "small", "--to", "small.zip"),
        ("load", "small.zip", "--results", "elsewhere"),
        ("doubled", "small", "--results", "elsewhere", "--csv"),
        ("plot", "small", "doubled", "--metric", "speed"),
    )
    assert "24 trials, 12 of them stored already" in launch.stderr
    assert [one.returncode for one in (pack, load, plot)] == [0, 0, 0]
    assert report.stdout == "times,trials\n2,24\n"
    assert "doubled-speed.png" in plot.stdout
    explored = python_with(packages, tmp_path, EXPLORED)
    kind, command = json.loads(explored.stdout)
    assert kind["text"] == "curves of doubled trials"
    assert command.startswith("sweep plot small doubled")


def test_a_section_that_cannot_be_and_a_second_rule_are_said(
    doubled: list[subprocess.CompletedProcess[str]],
) -> None:
    """A package can bring no section under a key of ours, and a study has one rule."""
    plan, refused, *_ = doubled
    assert plan.returncode == 0
    assert 'the section "seed" of seeding: the key is taken' in plan.stderr
    assert 'the section "again" of forming: the key is taken' in plan.stderr
    said = 'the section "loose" of shapeless: the record has no "shape"'
    assert said in plan.stderr
    assert 'two.yaml:11: at most one section may add trials or points: "double"' in (
        refused.stderr
    )


def test_the_record_of_a_section_replaces_nothing_of_a_plan() -> None:
    about = PlanAbout.of(parse_spec(SMALL), [], [])
    taken = replace(about, sections={"varied": [1], "double": {"times": 2}})
    with pytest.raises(ValueError, match=r"reserved for the plan: varied$"):
        taken.into(pa.table({}), {})


def test_every_report_is_a_command() -> None:
    names = [
        make.__name__
        for method in methods().values()
        for make in (*method.reports, *method.reports_of_results)
    ]
    assert len(names) >= 7
    commands = [
        one.callback.__name__ for one in app.registered_commands if one.callback
    ]
    assert sorted(set(names) & set(commands)) == sorted(names)


def test_a_loaded_study_has_the_reports_of_its_commands(tmp_path: Path) -> None:
    launched(SMALL, tmp_path)
    study = sweep.load("small", tmp_path)
    with pytest.raises(ChoiceError, match="continue: both"):
        study.report("hysteresis", metric=["speed"], over="half")
    with pytest.raises(ChoiceError, match='unknown report "hysteresys"; did you mean'):
        study.report("hysteresys")


@pytest.mark.parametrize("name", list(methods()))
def test_each_name_of_the_face_of_a_method_is_there(name: str) -> None:
    face = __import__(f"sweep.methods.{name}", fromlist=["__all__"])
    assert face.__all__
    assert all(getattr(face, one) is not None for one in face.__all__)
