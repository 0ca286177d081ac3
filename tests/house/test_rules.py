"""Each rule of the house finds what breaks it, in its line."""

import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType
from typing import get_type_hints

import pytest

from tests import ROOT
from tests.house import (
    documents,
    evaluation,
    extras,
    figures,
    imports,
    kernels,
    names,
    packages,
    plain,
    prose,
    scripts,
    systems,
    writing,
)
from tests.house.__main__ import main
from tests.house.rules import RULES, SUBJECTS, findings
from tests.house.sources import Checkout, Finding, Rule
from tests.patience import PATIENCE

LISTING, PAGE = "docs/decisions/README.md", "docs/decisions/one.md"
CHAPTERS = "".join(f"## {chapter}\nx\n" for chapter in documents.CHAPTERS)
TRUST = "docs/trust.md"
TABLE = imports.TABLE
PROJECT, EXTRAS = extras.PROJECT, "[project.optional-dependencies]\na = []\n"
INEXACT = "has other bits elsewhere"

NOT_YET = """[tool.ruff.lint.per-file-ignores]
"sweep/web/*" = ["D"]
"""
LONG = " ".join(["word"] * (prose.LONGEST + 1))
BROKEN: list[tuple[Rule, dict[str, str], str]] = [
    (
        prose.documents_are_easy_to_read,
        {"docs/guide/a.md": f"# A\n\n{'What it is. ' * 40}"},
        "docs/guide/a.md:1: 667 pronouns per 1,000 words; at most 35",
    ),
    (
        prose.documents_are_easy_to_read,
        {"docs/guide/a.md": f"# A\n\nA short sentence. {LONG.capitalize()}."},
        f"docs/guide/a.md:3: a long sentence: {LONG.capitalize()}.",
    ),
    (
        prose.documents_are_easy_to_read,
        {"README.md": "# A\n\nThe trial goes on."},
        'README.md:3: "goes on" is no term of the field: resume, continue',
    ),
    (
        prose.code_is_easy_to_read,
        {"sweep/a.py": f'def f():\n    """{"Return what it is. " * 40}"""'},
        "sweep/a.py:1: 500 pronouns per 1,000 words of its docstrings; at most 35",
    ),
    (
        prose.code_is_easy_to_read,
        {"sweep/a.py": f'"""A.\n\nB\n---\nc : int\n    {LONG}.\n\n    d   1\n"""'},
        f"sweep/a.py:1: a long sentence: {LONG}.",
    ),
    (
        prose.code_is_easy_to_read,
        {"kernels/a.py": f'A = 1\n"""Number {LONG}."""'},
        f"kernels/a.py:2: a long sentence: Number {LONG}.",
    ),
    (
        prose.code_is_easy_to_read,
        {"sweep/a.py": 'print("a launch that was killed goes on")'},
        'sweep/a.py:1: "goes on" is no term of the field: resume, continue',
    ),
    (
        imports.others_import_from_the_face_of_a_package,
        {
            "sweep/cli/a.py": "\nfrom sweep.spec.study import Study",
            "sweep/spec/__init__.py": "",
        },
        "sweep/cli/a.py:2: imports from sweep.spec.study, and not from sweep.spec",
    ),
    (
        imports.a_name_of_a_face_is_no_module,
        {
            "sweep/spec/__init__.pyi": "\nfrom .study import b as b",
            "sweep/spec/b.py": "",
        },
        "sweep/spec/__init__.pyi:2: b of study is a module of sweep.spec too",
    ),
    (
        imports.no_import_is_relative,
        {"sweep/a.py": "\nfrom . import b"},
        "sweep/a.py:2: a relative import",
    ),
    (
        imports.packages_import_what_the_table_says,
        {"sweep/spec/a.py": "x = 1\nfrom sweep.cli import b", "sweep/cli/b.py": ""},
        "sweep/spec/a.py:2: spec may not import cli",
    ),
    (
        imports.packages_import_what_the_table_says,
        {"sweep/new/a.py": ""},
        f"sweep/new/a.py:1: new is missing in MAY_IMPORT of {TABLE}",
    ),
    (
        imports.packages_import_what_the_table_says,
        {"sweep/cli/a.py": ""},
        f"{TABLE}:1: cli may import web, and does not",
    ),
    (
        imports.no_files_import_each_other_in_a_circle,
        {
            "sweep/a.py": "import sweep.b",
            "sweep/b.py": "def f():\n    import sweep.c",
            "sweep/c.py": "from sweep.b import f",
        },
        "sweep/b.py:2: a circle: sweep.b -> sweep.c -> sweep.b",
    ),
    (
        imports.the_machine_knows_no_experiment,
        {"sweep/a.py": "\nfrom experiments import b"},
        "sweep/a.py:2: sweep may not import experiments.b",
    ),
    (
        imports.kernels_are_met_in_one_place,
        {"sweep/a.py": "from kernels.flight import f", "kernels/flight.py": ""},
        "sweep/a.py:1: only sweep/trial may import kernels.flight",
    ),
    (
        kernels.kernels_know_nothing_above_them,
        {"kernels/a.py": "import numpy\nimport json"},
        "kernels/a.py:2: a kernel may not import json",
    ),
    (
        kernels.kernels_have_no_input_or_output,
        {"kernels/a.py": "\nprint(1)"},
        "kernels/a.py:2: a kernel may not call print",
    ),
    (
        kernels.one_module_says_how_kernels_are_compiled,
        {"kernels/a.py": "from numba import njit"},
        "kernels/a.py:1: numba.njit is for kernels/jit.py",
    ),
    (
        kernels.kernels_call_nothing_that_a_library_rounds_as_it_likes,
        {"kernels/a.py": "\nx = math.tan(1)"},
        f"kernels/a.py:2: math.tan {INEXACT}",
    ),
    (
        kernels.kernels_call_nothing_that_a_library_rounds_as_it_likes,
        {"kernels/a.py": "\nx = rng.normal(1)"},
        f"kernels/a.py:2: .normal {INEXACT}",
    ),
    (
        kernels.kernels_call_nothing_that_a_library_rounds_as_it_likes,
        {"examples/a.py": "X = 2**3\ndef f():\n    return X**2"},
        f"examples/a.py:3: a power or a product of matrices {INEXACT}",
    ),
    (
        kernels.a_model_has_params_sight_and_advance_and_no_more,
        {"kernels/models/a.py": "def advance(): ...\ndef _own(): ..."},
        "kernels/models/a.py:1: a model has Params, advance and sight, not advance",
    ),
    (
        names.nobody_knows_a_model_a_metric_or_a_weight_by_name,
        {"kernels/a.py": '"""x"""\n\nX = "cohesion_weight"'},
        "kernels/a.py:3: knows cohesion_weight by name",
    ),
    (
        names.nobody_knows_a_model_a_metric_or_a_weight_by_name,
        {"sweep/web/live_show.py": "'coverage'"},
        "sweep/web/live_show.py:1: has no text coverage, which it is allowed",
    ),
    (
        names.no_text_of_the_machine_has_such_a_name_in_it,
        {"sweep/a.py": '\nX = "as nguyen2024 does"'},
        "sweep/a.py:2: has nguyen2024 in a text",
    ),
    (
        names.no_text_of_the_machine_has_such_a_name_in_it,
        {"sweep/cli/app.py": ""},
        "sweep/cli/app.py:1: has no nguyen2024 in a text, which it is allowed",
    ),
    (
        names.a_model_knows_no_other,
        {"kernels/models/nguyen2024.py": 'X = "nguyen2024"\nY = "vicsek1995"'},
        "kernels/models/nguyen2024.py:2: knows the model vicsek1995",
    ),
    (
        names.a_model_knows_no_other,
        {"kernels/models/nguyen2024.py": ""},
        "kernels/models/nguyen2024.py:1: does not say its own name",
    ),
    (
        names.nobody_knows_another_entry_by_name,
        {"sweep/a.py": '\nX = "loguniform"'},
        "sweep/a.py:2: knows loguniform by name",
    ),
    (
        names.nobody_knows_another_entry_by_name,
        {"sweep/text.py": "", "sweep/methods/search/section_keys.py": ""},
        "sweep/methods/search/section_keys.py:1: has no text nsga3, which it is"
        " allowed",
    ),
    (
        packages.a_package_says_what_each_of_its_modules_is_for,
        {"sweep/a/__init__.py": '"""b  one"""', "sweep/a/b.py": "", "sweep/a/c.py": ""},
        "sweep/a/__init__.py:1: does not say what c is for",
    ),
    (
        packages.a_package_says_what_each_of_its_modules_is_for,
        {"sweep/__init__.py": '"""a/"""', "sweep/a/__init__.py": ""},
        "sweep/__init__.py:1: does not say what a/ is for",
    ),
    (
        packages.a_module_says_what_it_is,
        {"sweep/a.py": "x = 1"},
        "sweep/a.py:1: a module without a docstring",
    ),
    (
        packages.public_functions_and_classes_have_a_docstring,
        {"sweep/a.py": "def _own(): ...\ndef a(): ..."},
        "sweep/a.py:2: a has no docstring",
    ),
    (
        packages.public_functions_and_classes_have_a_docstring,
        {"kernels/a.py": "\nclass A: ..."},
        "kernels/a.py:2: A has no docstring",
    ),
    (
        packages.a_class_name_occurs_once,
        {"sweep/a.py": "class A: ...", "sweep/b.py": "\nclass A: ..."},
        "sweep/b.py:2: sweep/a.py has a class A too",
    ),
    (
        packages.folders_of_tests_mirror_the_packages,
        {"tests/new/test_a.py": ""},
        "tests/new/test_a.py:1: there is no package new",
    ),
    (
        packages.folders_of_tests_mirror_the_packages,
        {"sweep/a/__init__.py": "", "tests/a/test_a.py": "import sweep.b"},
        "sweep/a/__init__.py:1: tests/a has no tests of it",
    ),
    (
        packages.folders_of_tests_mirror_the_packages,
        {"tests/bench/a.py": ""},
        "kernels/__init__.py:1: tests/kernels has no tests",
    ),
    (
        figures.no_figure_forgets_how_values_are_distributed,
        {"sweep/figures/a.py": "\ncurves(x, bounds=y)"},
        "sweep/figures/a.py:2: curves is not told the distribution",
    ),
    (
        figures.no_figure_forgets_how_values_are_distributed,
        {"experiments/a/figures.py": "half_width(x)"},
        "experiments/a/figures.py:1: half_width is for normal values only",
    ),
    (
        figures.no_figure_forgets_how_values_are_distributed,
        {},
        "tests/house/figures.py:1: no figure calls curves",
    ),
    (
        scripts.lines_of_scripts_are_short,
        {"sweep/web/a.js": "\n//" + "x" * 87},
        "sweep/web/a.js:2: a line of 89 signs",
    ),
    (
        scripts.lines_of_scripts_are_short,
        {"tests/web/a.ts": "x" * 89},
        "tests/web/a.ts:1: a line of 89 signs",
    ),
    (
        documents.links_lead_somewhere,
        {"GUIDE.md": "# A b\n[x](#a-b)\n[x](none.md)"},
        "GUIDE.md:3: leads nowhere: none.md",
    ),
    (
        documents.links_lead_somewhere,
        {"docs/a/b.md": "[x](../c.md#d)\n[x](../c.md#e)", "docs/c.md": "# D"},
        "docs/a/b.md:2: leads nowhere: ../c.md#e",
    ),
    (documents.the_main_documents_have_links, {}, "README.md:1: has no link"),
    (
        documents.files_that_are_named_exist,
        {"docs/a.md": "docs/a.md\nis beside `sweep/none.py`"},
        "docs/a.md:2: there is no sweep/none.py",
    ),
    (
        documents.files_that_are_named_exist,
        {"CONTRIBUTING.md": "`test_none.py`"},
        "CONTRIBUTING.md:1: there is no test_none.py",
    ),
    (
        documents.each_decision_is_listed_once_by_its_title,
        {LISTING: "\n- [Two](one.md)", PAGE: "# One\n"},
        f"{LISTING}:2: one.md has another title, is no page or is listed twice",
    ),
    (
        documents.each_decision_is_listed_once_by_its_title,
        {LISTING: "- [One](one.md)\n- [One](one.md)", PAGE: "# One\n"},
        f"{LISTING}:2: one.md has another title, is no page or is listed twice",
    ),
    (
        documents.each_decision_is_listed_once_by_its_title,
        {LISTING: "", PAGE: "# One\n"},
        f"{LISTING}:1: does not list one.md as One",
    ),
    (
        documents.each_decision_is_listed_once_by_its_title,
        {},
        f"{LISTING}:1: there is no page of a decision",
    ),
    (
        documents.a_decision_has_its_chapters_and_none_is_empty,
        {PAGE: "# One\n## Why\nx\n"},
        f"{PAGE}:1: its chapters are not {', '.join(documents.CHAPTERS)}",
    ),
    (
        documents.a_decision_has_its_chapters_and_none_is_empty,
        {PAGE: CHAPTERS.removesuffix("x\n")},
        f"{PAGE}:9: {documents.CHAPTERS[-1]} is empty",
    ),
    (
        documents.a_word_has_one_row,
        {"docs/words.md": "| one | x |\n| two, one | x |"},
        "docs/words.md:2: one has another row",
    ),
    (documents.a_word_has_one_row, {}, "docs/words.md:1: has no words"),
    (
        documents.a_sentence_on_trust_has_its_tests,
        {TRUST: "# Trust\n\n- It is so.\n"},
        f"{TRUST}:3: a sentence without a test",
    ),
    (
        documents.a_sentence_on_trust_has_its_tests,
        {TRUST: "- It is so.\n  <!-- tests/test_a.py::test_b -->\n"},
        f"{TRUST}:1: there is no test tests/test_a.py::test_b",
    ),
    (
        documents.only_what_is_not_promised_has_no_test,
        {TRUST: "- It is so.\n  <!-- none: x -->\n## Not promised\n"},
        f"{TRUST}:2: a promise without a test",
    ),
    (
        documents.only_what_is_not_promised_has_no_test,
        {TRUST: "\n## Not promised\n\n- It is so.\n"},
        f"{TRUST}:2: not each sentence says why it has no test",
    ),
    (
        documents.only_what_is_not_promised_has_no_test,
        {TRUST: ""},
        f"{TRUST}:1: does not say what is not promised",
    ),
    (
        documents.every_file_of_attacks_stands_behind_a_sentence,
        {TRUST: "", "tests/attacks/test_a.py": ""},
        f"tests/attacks/test_a.py:1: stands behind no sentence of {TRUST}",
    ),
    (
        extras.code_names_extras_that_there_are,
        {PROJECT: EXTRAS, "sweep/a.py": "\ninstalling('b')"},
        "sweep/a.py:2: there is no extra b",
    ),
    (
        extras.code_names_extras_that_there_are,
        {},
        "sweep/text.py:1: nobody calls installing",
    ),
    (
        extras.how_an_extra_is_installed_is_said_once,
        {"sweep/text.py": ""},
        "sweep/text.py:1: does not say how an extra is installed",
    ),
    (
        extras.how_an_extra_is_installed_is_said_once,
        {"sweep/a.py": "\nX = 'pip install boidsweep[a]'"},
        "sweep/a.py:2: installing of sweep/text.py says it",
    ),
    (
        extras.documents_name_extras_that_there_are,
        {PROJECT: EXTRAS, "GUIDE.md": "boidsweep[a]\nboidsweep[a,b]"},
        "GUIDE.md:2: there is no extra b",
    ),
    (
        extras.documents_name_extras_that_there_are,
        {"notebooks/a.ipynb": '\npip install \\".[a]'},
        "notebooks/a.ipynb:2: installs from the folder of a clone",
    ),
    (
        extras.every_extra_has_a_row,
        {PROJECT: EXTRAS, "docs/install.md": "| extra |\n"},
        "docs/install.md:1: a is no extra, or has no row",
    ),
]
WITHOUT_A_REASON = {
    writing.no_module_writes_a_file_in_a_way_of_its_own: (
        "writes a file by",
        {
            "open(path, 'w')": "open",
            "path.open('ab')": "open",
            "path.open(mode='r+b')": "open",
            "path.write_text('x')": "write_text",
            "os.open(path, os.O_WRONLY | os.O_CREAT)": "open",
            "os.open(path, NEW)": "open",
            "figure.savefig(path)": "savefig",
            "pq.ParquetWriter(path, schema)": "ParquetWriter",
            "tempfile.NamedTemporaryFile()": "NamedTemporaryFile",
            "shutil.copyfile(a, b)": "copyfile",
            "shutil.copy(a, b)": "shutil.copy",
        },
    ),
    systems.what_a_system_lacks_is_asked_for_nowhere_else: (
        "uses what some system lacks:",
        {
            "os.getuid()": "getuid",
            "signal.signal(signal.SIGHUP, f)": "SIGHUP",
            "getattr(os, 'O_NOFOLLOW')": "O_NOFOLLOW",
            "import fcntl": "fcntl",
            "from resource import getrusage": "resource",
            "from signal import pthread_sigmask": "pthread_sigmask",
            "os.mkdir(name, dir_fd=3)": "dir_fd",
            "Path('/proc/self').exists()": "/proc",
            "path.rename(other)": "rename",
            "subprocess.Popen([], preexec_fn=f)": "preexec_fn",
        },
    ),
    evaluation.no_module_evaluates_text_or_loads_pickles: (
        "runs code by",
        {
            "eval(text)": "eval",
            "import pickle": "pickle",
            "from yaml import load": "yaml",
            "pd.read_pickle(path)": "read_pickle",
            "np.load(path, allow_pickle=True)": "load",
            "subprocess.run(text, shell=True)": "run",
        },
    ),
}
BROKEN += [
    (
        rule,
        {"sweep/a.py": f"\n{line}"},
        f"sweep/a.py:2: {what} {name}, for no reason that is said",
    )
    for rule, (what, lines) in WITHOUT_A_REASON.items()
    for line, name in lines.items()
]
BROKEN += [
    (
        systems.text_has_the_same_encoding_on_every_system,
        {"kernels/a.py": f"\n{line}"},
        "kernels/a.py:2: text of an encoding that is not said",
    )
    for line in (
        "path.read_text()",
        "path.write_text('x')",
        "subprocess.run([], text=True)",
    )
]
BROKEN += [
    (
        evaluation.no_module_evaluates_text_or_loads_pickles,
        {"kernels/lanes/texts.py": "exec(one)\nexec(other)"},
        "kernels/lanes/texts.py:2: runs code by exec a second time",
    )
]
BROKEN += [
    (
        names.the_spine_knows_no_section_of_a_method,
        {"sweep/design/new.py": "f('refine')"},
        "sweep/design/new.py:1: knows refine by name",
    )
]
BROKEN += [
    (
        plain.modules_are_plain,
        {"sweep/new/a.py": f"\n{line}"},
        f"sweep/new/a.py:2: {what}",
    )
    for line, what in (
        ("found = 1", "the name found fits any value: name what it holds"),
        ("def f(_one): 1", "the name _one fits any value: name what it holds"),
        (
            "low, high = 0, 1",
            "several facts in one assignment: write a line for each",
        ),
        ("f(1, 2, 3, 4, 5)", "5 arguments without names: at most 4"),
        (
            "def f(): 'What it does.'",
            'a docstring opens with "What": take a verb or a noun',
        ),
        (
            "def f(a, b, *, c): 'Add.'",
            "f needs a section Parameters, as numpydoc has it",
        ),
    )
]
BROKEN += [
    (
        plain.what_is_plain_is_not_listed,
        {"kernels/near.py": "x = 1"},
        "kernels/near.py:1: kernels/near.py keeps the rules: take it out of IN_IDS",
    )
]
BROKEN += [
    (rule, {}, f"{file}:1: no longer {what} {name}, for which a reason is said")
    for rule, what, file, name in (
        (
            writing.no_module_writes_a_file_in_a_way_of_its_own,
            "writes a file by",
            *("notebooks/execute.py", "shutil.copy"),
        ),
        (
            systems.what_a_system_lacks_is_asked_for_nowhere_else,
            "uses what some system lacks:",
            *("sweep/store/durable.py", "fsync"),
        ),
        (
            evaluation.no_module_evaluates_text_or_loads_pickles,
            "runs code by",
            *("kernels/lanes/texts.py", "exec"),
        ),
    )
]


def made_up(files: dict[str, str], root: Path) -> Checkout:
    """A checkout with these files alone."""
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text, encoding="utf-8")
    return Checkout(root)


@pytest.mark.parametrize(
    ("rule", "files", "expected"),
    BROKEN,
    ids=[f"{number} {rule.__name__}" for number, (rule, _, _) in enumerate(BROKEN)],
)
def test_what_breaks_a_rule_is_found_in_its_line(
    rule: Rule, files: dict[str, str], expected: str, tmp_path: Path
) -> None:
    assert expected in map(str, rule(made_up(files, tmp_path)))


@pytest.mark.parametrize(
    "line",
    [
        "x, y = 0, 1",
        "low, high = high, low",
        "low, high = f()",
        "f(1, 2, 3, 4, e=5)",
        "def f(a, b): 'Add.'",
        "def _f(a, b, c): 'Add.'",
        "def f(a, b, c): 'Add.\\n\\nParameters\\n----------'",
        "@app.command()\ndef f(a, b, c): 'Add.'",
    ],
)
def test_what_is_plain_is_no_finding(line: str, tmp_path: Path) -> None:
    checkout = made_up({"sweep/new/a.py": line}, tmp_path)
    assert [*plain.modules_are_plain(checkout)] == []


def test_a_parameter_of_the_public_interface_keeps_its_name(tmp_path: Path) -> None:
    checkout = made_up({"sweep/__init__.py": "def compare(one): 1"}, tmp_path)
    assert [*plain.modules_are_plain(checkout)] == []


def test_a_file_whose_docstrings_are_not_checked_is_left_out(tmp_path: Path) -> None:
    files = {"pyproject.toml": NOT_YET, "sweep/web/a.py": "found = 1"}
    checkout = made_up(files, tmp_path)
    assert [*plain.modules_are_plain(checkout)] == []


def test_only_docstrings_of_code_in_ids_are_looked_at(tmp_path: Path) -> None:
    source = "found = 1\ndef f(): 'What it does.'"
    checkout = made_up({"kernels/near.py": source}, tmp_path)
    (finding,) = plain.modules_are_plain(checkout)
    assert finding.line == 2
    assert [*plain.what_is_plain_is_not_listed(checkout)] == []


def test_an_arrow_that_points_down_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(imports.MAY_IMPORT, "spec", "web")
    (finding,) = imports.arrows_of_the_table_point_up(Checkout(Path()))
    assert finding.what == "spec may import web, which is not above it"


def test_every_rule_runs_and_is_broken_here() -> None:
    broken = {rule.__name__ for rule, _, _ in BROKEN}
    broken.add(imports.arrows_of_the_table_point_up.__name__)
    written = {
        name
        for subject in SUBJECTS
        for name, value in vars(subject).items()
        if isinstance(value, FunctionType)
        and get_type_hints(value).get("return") == Iterator[Finding]
        and value.__module__ == subject.__name__
        and name[0] != "_"
    }
    assert {rule.__name__ for rule in RULES} == written == broken


def test_all_findings_are_printed_in_order_and_count(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    checkout = made_up({"sweep/b.py": "x = 1", "kernels/a.py": "x = 1"}, tmp_path)
    assert main(checkout) == 1
    printed = capsys.readouterr().out.splitlines()
    assert printed == [str(finding) for finding in findings(checkout)]
    assert "kernels/a.py:1: a module without a docstring" in printed
    assert "sweep/b.py:1: a module without a docstring" in printed


def test_a_checkout_without_findings_is_well(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.house.rules.RULES", [])
    assert main(Checkout(Path())) == 0


def test_what_is_no_python_is_one_finding(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    checkout = made_up({"sweep/a.py": "x = 1\ny = (", "kernels/b.py": ""}, tmp_path)
    assert main(checkout) == 1
    said = "sweep/a.py:2: no Python: '(' was never closed\n"
    assert capsys.readouterr() == (said, "")


def test_kernels_that_cannot_be_imported_are_one_finding(tmp_path: Path) -> None:
    """Some rules import them, in the checkout in which they lie."""
    shutil.copytree(ROOT / "tests" / "house", tmp_path / "tests" / "house")
    shutil.copy(ROOT / "tests" / "__init__.py", tmp_path / "tests")
    made_up({"kernels/__init__.py": "x = 1\ny = ("}, tmp_path)
    done = subprocess.run(
        [sys.executable, "-m", "tests.house"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    said = "kernels/__init__.py:2: no Python: '(' was never closed\n"
    assert (done.returncode, done.stdout, done.stderr) == (1, said, "")
