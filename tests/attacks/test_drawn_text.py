"""Hostile text in figures, pages and files for other programs: it is shown, and does
nothing.
"""

import json
import re
import shutil
from itertools import cycle
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
import xarray as xr
from matplotlib.figure import Figure
from PIL import Image

from sweep.errors import SpecError
from sweep.figures.drawing import as_text, words
from sweep.figures.saving import FORMATS, save
from sweep.figures.scales import _document
from sweep.published.scorecard_markdown import _text
from sweep.tables.exporting import export
from sweep.tables.stored_study import StoredStudy
from sweep.web.page_text import document
from tests.attacks.hostile import give, give_plan
from tests.cases import slow_but
from tests.commands import sweep
from tests.studies import launched

MATHS = [
    "$\\frac{1$",
    "$\\evil$",
    "$$",
    "$",
    "a$b$c",
    "\\$",
    "$x^{y^{z$",
    "${}^{" * 4 + "$",
    "\\\\$a$",
]
SWEEPS = """
study: maps
model: aziel_chen2025
preset: as_run
fixed: {n: 3, steps: 4}
sweep:
  map: [cafeteria, empty]
  cohesion_weight: [0.1, 0.2, 0.3]
replicates: 2
seed: 5
record: {series: [speed], every: 2}
"""
HOSTILE = (
    "$\\frac{1$ $\\evil$ <script>alert(1)</script> </svg>]]> --> \x1b[2J\u202e &amp;"
    " %s {n}"
)


@pytest.mark.parametrize(
    ("text", "kind"),
    [*zip(MATHS, cycle(FORMATS), strict=False)],
    ids=range(len(MATHS)),
)
def test_no_text_of_a_figure_is_mathematics(
    text: str, kind: str, tmp_path: Path
) -> None:
    """Unfinished mathematics would end the figure in a traceback, wherever in it the
    text stands.
    """
    figure = Figure()
    axes = figure.subplots()
    axes.plot([1, 2], label=text)
    axes.set_xscale("log")
    axes.set(title=text, xlabel=text, ylabel=text)
    axes.yaxis.set_ticks([1, 2], [words(text), words(text)])
    axes.legend(title=text)
    figure.suptitle(text)
    axes.annotate(text, (1, 1))
    [written] = save(figure, tmp_path / "x", {"Study": text}, formats=(kind,))
    assert written.suffix == f".{kind}"
    assert as_text(as_text(text)) == as_text(text)


def test_mathematics_of_the_axes_stays(tmp_path: Path) -> None:
    """A logarithmic axis writes its powers of ten so."""
    figure = Figure()
    axes = figure.subplots()
    axes.loglog([1, 1000], [1, 1000])
    save(figure, tmp_path / "x", formats=("svg",))
    assert "$\\mathdefault{10^{3}}$" in (tmp_path / "x.svg").read_text()


@pytest.fixture(scope="module")
def launched_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of results with the study, of which tests change copies."""
    return launched(SWEEPS, tmp_path_factory.mktemp("maps")).store.folder.parent


@pytest.fixture
def maps(launched_once: Path, tmp_path: Path) -> Path:
    """The folder of the study in a folder of results."""
    shutil.copytree(launched_once, tmp_path / "results")
    return tmp_path / "results" / "maps"


@pytest.fixture
def evil(maps: Path, tmp_path: Path) -> Path:
    """A folder with results/maps, in which a map and the
    kernels have a hostile name.
    """
    names = [HOSTILE[:24], "$\\evil$"]
    plan = StoredStudy("maps", tmp_path / "results").plan
    which = {"cafeteria": names[0], "empty": names[1]}
    give(
        maps,
        map=[
            which[name]
            for name in StoredStudy("maps", tmp_path / "results").trials["map"]
        ],
    )
    give_plan(
        maps,
        {"kernels_sha": HOSTILE},
        map=[which[name] for name in plan["map"].to_pylist()],
    )
    return tmp_path


@pytest.mark.parametrize(
    "kind", slow_but(["heatmap"], ["curves", "scatter", "heatmap"])
)
def test_figures_of_a_stored_study_show_it(evil: Path, kind: str) -> None:
    formats = [word for name in FORMATS for word in ("--format", name)]
    done = sweep(evil, "plot", "maps", kind, "--metric", "speed", *formats)
    assert done.returncode == 0, done.stderr
    figures = evil / "results" / "maps" / "figures"
    for path in figures.glob("*.svg"):
        root = ElementTree.parse(path).getroot()
        assert not [
            element for element in root.iter() if element.tag.endswith("script")
        ]
        assert "\x1b" not in path.read_text(encoding="utf-8")
    for path in figures.glob("*.png"):
        with Image.open(path) as image:
            assert "\x1b" not in "".join(map(str, image.info.values()))
    assert len(list(figures.glob("*.pdf"))) == len(list(figures.glob("*.svg"))) >= 1


BOMB = "a: &a [x, x]\n" + "".join(
    f"{b}: &{b} [*{a}, *{a}]\n"
    for a, b in zip("abcdefghijklmnopqrstuvwx", "bcdefghijklmnopqrstuvwxy", strict=True)
)


@pytest.mark.parametrize(
    "spec",
    [BOMB, "[" * 600, "a: !!python/object/apply:os.system [x]", "\x00", "- ]"],
)
def test_a_stored_spec_is_read_as_strictly_as_one_to_launch(spec: str) -> None:
    """Figures look in it which axes are logarithmic; of a bomb they would have walked
    every branch.
    """
    with pytest.raises(SpecError, match="the stored spec"):
        _document(spec)


def test_netcdf_and_csv_hold_hostile_text_as_it_is(evil: Path) -> None:
    study = StoredStudy("maps", evil / "results")
    export(study, evil / "x.nc")
    with xr.open_dataset(evil / "x.nc", engine="netcdf4") as data:
        assert set(data["map"].values.tolist()) == {HOSTILE[:24], "$\\evil$"}
        assert json.loads(str(data["provenance"].values))["kernels_sha"] == HOSTILE
    export(study, evil / "x.csv")
    assert (
        json.loads((evil / "x.csv.json").read_text())["provenance"]["kernels_sha"]
        == HOSTILE
    )


@pytest.mark.parametrize(
    "column", ["a/b", "", "=1+1", "\x1b[2J", "a b", "../x", "<script>"]
)
def test_a_column_of_another_name_than_a_metric_s_is_refused(
    maps: Path, tmp_path: Path, column: str
) -> None:
    """netCDF would make groups of some names, and others are formulas."""
    give(maps, **{column: 1.0})
    done = sweep(tmp_path, "export", "maps", "--to", "x.nc")
    assert done.returncode == 2
    assert "no column can have the name" in done.stderr


TAGS = (
    "</script><script>alert(1)</script><!--<script>\"'><img src=x"
    " onerror=alert(1)>\u2028"
)


def page_of(data: dict[str, Any], title: str, about: dict[str, str]) -> str:
    return document("recording", "recorded", data, title, about).decode()


def test_a_recorded_page_has_no_element_of_its_data() -> None:
    said = dict.fromkeys(("Study", "Trial", "Model", "kernels_sha", "Software"), TAGS)
    recording: dict[str, Any] = {
        "about": said,
        "spec": TAGS,
        "state": {"map": TAGS, TAGS: [TAGS]},
    }
    page = page_of(recording, TAGS, said)
    harmless = page_of({"spec": "x"}, "x", dict.fromkeys(said, "x"))
    assert re.findall(r"</?\w+|<!-*", page) == re.findall(r"</?\w+|<!-*", harmless)
    data = re.search(
        r'<script type="application/json" id="data">(.*?)</script>',
        page,
        re.DOTALL,
    )
    assert data
    assert json.loads(data[1]) == recording


def test_a_text_is_one_line_of_markdown_without_marks() -> None:
    text = _text("a\r# x\n- [l](http://e) <b>&lt;b&gt; ~~x~~ `c` ![i](u)\x1b\u2028|")
    assert "\n" not in text
    assert "\r" not in text
    assert "\x1b" not in text
    assert re.findall(r"(?<!\\)[\[\]<>`~|&*_#]", text) == []
