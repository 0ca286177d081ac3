"""The package as a wheel, in an empty folder."""

import json
import os
import re
import subprocess
import sys
import sysconfig
from pathlib import Path
from tarfile import TarFile
from urllib.parse import unquote, urlsplit
from zipfile import ZipFile

import pytest

from kernels.identity import kernels_sha
from sweep.cli.topics import all_topics, readable
from sweep.published.starting import built_in_specs
from sweep.spec.schema import json_schema
from sweep.store.repository import built_from, git_state
from tests import ROOT
from tests.commands import SWEEP
from tests.patience import PATIENCE
from tests.studies import SMALL

MOST_BYTES = 2_850_000
"""Of code (2.1 MB), published data (0.5 MB), all topics of sweep guide (0.2 MB) and
the recording of a tutorial (0.04 MB).
"""
NOT_PACKED = {".png", ".gif", ".svg", ".parquet", ".ipynb", ".nbi", ".nbc", ".pyc"}
"""Endings of what pictures, results and caches would bring along."""


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what the wheel brings, and nothing else."""
    folder = tmp_path_factory.mktemp("wheel")
    return unpacked(ROOT, folder)


def build(kind: str, source: Path, folder: Path) -> None:
    command = [sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", folder]
    subprocess.run(
        command, cwd=source, check=True, capture_output=True, timeout=PATIENCE
    )


def unpacked(source: Path, folder: Path) -> Path:
    """What a wheel brings that is built of `source`."""
    build("wheel", source, folder)
    (wheel,) = folder.glob("*.whl")
    assert wheel.stat().st_size < MOST_BYTES
    with ZipFile(wheel) as packed:
        assert not {Path(name).suffix for name in packed.namelist()} & NOT_PACKED
        packed.extractall(folder / "site")
    return folder / "site"


def run(site: Path, folder: Path, *command: str) -> str:
    """The output of a command that imports the package from `site`; it must succeed."""
    environment = os.environ | {"PYTHONPATH": str(site), "PYTHONSAFEPATH": "1"}
    done = subprocess.run(
        command,
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


CLEAN = """
import sys
sys.path += {paths!r}
import sweep, kernels
from kernels.identity import kernels_sha
print(sweep.__file__, kernels.__file__, kernels_sha(), sep="\\n")
sweep.run({spec!r}, {results!r}, workers=1)
sys.argv = ["sweep", "table", "small", "--csv", "--results", {results!r}]
from sweep.cli import main
main()
"""


def test_a_wheel_runs_where_nothing_of_the_checkout_can_be_imported(
    installed: Path, tmp_path: Path
) -> None:
    """Nor is another package `kernels` in its way, in whatever order both came there.

    A process with -S reads no .pth files, and so does not find the checkout. It has the
    dependencies from the folder of this environment.
    """
    other = tmp_path / "other" / "kernels" / "__init__.py"
    other.parent.mkdir(parents=True)
    other.write_text("raise ModuleNotFoundError('huggingface_hub')", encoding="utf-8")
    paths = [str(tmp_path / "other"), str(installed), sysconfig.get_path("purelib")]
    code = CLEAN.format(paths=paths, spec=SMALL, results=str(tmp_path / "results"))
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", code],
        cwd=tmp_path,
        capture_output=True,
        encoding="utf-8",
        timeout=PATIENCE,
    )
    assert done.returncode == 0, done.stderr
    ours, theirs, sha, *table = done.stdout.splitlines()
    assert Path(ours) == installed / "sweep" / "__init__.py"
    assert Path(theirs) == installed / "sweep/bundled/kernels/__init__.py"
    assert sha == kernels_sha()
    assert len(table) == 3
    assert table[0].startswith("separation_weight,speed,speed_low")


def test_editors_and_type_checkers_find_the_kernels_of_a_wheel(installed: Path) -> None:
    """By the .pth file, whose folder Python and they take for one of packages."""
    named = (installed / "boidsweep.pth").read_text(encoding="utf-8").strip()
    assert [path.name for path in (installed / named).iterdir()] == ["kernels"]
    assert not (installed / "kernels").exists()
    assert (installed / named / "kernels" / "py.typed").is_file()
    assert (installed / "sweep" / "py.typed").is_file()


def test_a_wheel_has_the_pages_that_are_topics_and_no_others(installed: Path) -> None:
    docs = installed / "sweep" / "docs"
    brought = {path.relative_to(docs).as_posix() for path in docs.rglob("*.*")}
    topics = {topic.path.removeprefix("docs/") for topic in all_topics().values()}
    assert brought == topics


@pytest.mark.slow
def test_a_wheel_has_every_built_in_study_and_begins_one_of_your_own(
    installed: Path, tmp_path: Path
) -> None:
    code = (
        "from sweep.published.starting import begin, built_in_specs;"
        " from sweep.own_code.reading import load_spec; names = list(built_in_specs());"
        " [load_spec(begin(name, force=True).path) for name in names];"
        " from sweep.web.controls import EXPERIMENTS, published;"
        " assert published('nguyen2024', 'as_run', EXPERIMENTS);"
        " print(*names)"
    )
    listed = run(installed, tmp_path, sys.executable, "-c", code).split()
    assert listed == list(built_in_specs())
    first, *_ = (tmp_path / "quickstart.yaml").read_text().splitlines()
    assert "version" in (installed / "sweep" / "CITATION.cff").read_text()
    schema = urlsplit(first.removeprefix("# yaml-language-server: $schema="))
    found = json.loads(Path(unquote(schema.path)).read_text(encoding="utf-8"))
    assert found == json_schema()


@pytest.mark.slow
def test_a_wheel_teaches_in_an_empty_folder(installed: Path, tmp_path: Path) -> None:
    """The guide and its pages, and a study of a model that runs."""
    listed = run(installed, tmp_path, *SWEEP, "guide")
    topics = all_topics()
    assert set(topics) == {line.split()[0] for line in listed.splitlines()}
    page = readable("one-question", topics)
    assert run(installed, tmp_path, *SWEEP, "guide", "one-question") == page
    run(installed, tmp_path, *SWEEP, "init", "a.yaml", "--model", "nguyen2024")
    said = run(installed, tmp_path, *SWEEP, "launch", "a.yaml")
    assert "my/a: 96 new trials (96 done)" in said


@pytest.mark.slow
def test_a_wheel_knows_the_commit_that_it_was_built_from(
    installed: Path, tmp_path: Path
) -> None:
    """And so does one that is built of an sdist, where git knows nothing."""
    then = git_state(ROOT / "sweep")
    assert then["commit"]
    assert built_from(installed / "sweep") == then
    build("sdist", ROOT, tmp_path)
    (sdist,) = tmp_path.glob("*.tar.gz")
    with TarFile.open(sdist) as packed:
        packed.extractall(tmp_path, filter="data")
    (source,) = tmp_path.glob("boidsweep-*/")
    assert git_state(source / "sweep") == {}
    assert built_from(unpacked(source, tmp_path) / "sweep") == then
    assert built_from(ROOT / "sweep") == {}  # nothing is left here


@pytest.mark.slow
def test_a_wheel_begins_a_model_of_your_own_which_flies_at_once(
    installed: Path, tmp_path: Path
) -> None:
    run(installed, tmp_path, *SWEEP, "new", "model", "eddy")
    said = run(installed, tmp_path, *SWEEP, "launch", "eddy.yaml")
    assert "32 new trials (32 done)" in said


@pytest.mark.slow
def test_a_wheel_reproduces_a_publication_in_an_empty_folder(
    installed: Path, tmp_path: Path
) -> None:
    wanted = ("reproduce", "--only", "patel2023", "--scale", "quick")
    said = run(installed, tmp_path, *SWEEP, *wanted)
    assert "the built-in studies are reproduced, into results" in said
    assert "this runs code" not in said
    assert (tmp_path / "results" / "quick" / "scorecard.html").is_file()
    assert [path.name for path in tmp_path.iterdir()] == ["results"]


def test_its_description_leads_to_no_file_that_a_registry_lacks(
    installed: Path,
) -> None:
    """Links to files of the repository are their words, pictures what they show."""
    (about,) = installed.glob("*.dist-info/METADATA")
    head, _, text = about.read_text(encoding="utf-8").partition("\n\n")
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert "Description-Content-Type: text/markdown" in head
    targets = re.findall(r"\]\(([^)]*)\)", re.sub(r"```.*?```", "", text, flags=re.S))
    assert [one for one in targets if not one.startswith("https://")] == []
    assert "![" not in text
    assert "](" in readme
    assert "*(Picture: The first 240 steps of that run, as an animation that " in text
    assert "writes a custom model, a file of about 100 lines" in text
    blocks = re.findall(r"```.*?```", readme, re.DOTALL)
    assert blocks == re.findall(r"```.*?```", text, re.DOTALL)
    assert len(blocks) > 3
