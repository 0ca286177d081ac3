"""The pages of the site are made of all that there is, and their links lead on."""

import inspect
import re
from pathlib import PurePosixPath
from posixpath import normpath
from types import ModuleType
from typing import NamedTuple

import pytest
import typer.main

from docs.building import documents
from docs.building.api import MODULES
from docs.building.documents import COPIES, Documents, chapters, read
from docs.building.models import PICTURES
from docs.building.site import MADE, listed_for_programs, pages
from kernels.metrics import METRICS
from kernels.models import MODELS
from kernels.starts import STARTS
from kernels.worlds import MAPS
from sweep.cli import app
from sweep.cli.topics import slug
from sweep.spec.settings import GROUPS

LINK = re.compile(r"\]\((?![a-z]+:)(?P<page>[^)#\s]*)(?:#(?P<chapter>[^)\s]*))?\)")
TOCTREE = re.compile(r"^```\{toctree\}\n(.*?)^```$", re.MULTILINE | re.DOTALL)
MADE_FIGURE = re.compile(rf"^```\{{figure\}} /{MADE}/(\S+)", re.MULTILINE)
HEADING = re.compile(r"^#+ (.*)$", re.MULTILINE)


class Made(NamedTuple):
    """The pages by name, and the documents that they were made of."""

    pages: dict[str, str]
    documents: Documents

    def links(self, page: str) -> list[re.Match[str]]:
        """The links of a page, outside of its fenced blocks."""
        prose = "".join(documents.FENCED.split(self.pages[page])[::2])
        return list(LINK.finditer(prose))

    def leads(self, page: str, link: re.Match[str]) -> bool:
        """Whether a link of a page leads to a page, a heading or a file."""
        name, chapter = link["page"], link["chapter"]
        if name.startswith("/"):
            drawn = {f"{PICTURES}/{model}.png" for model in MODELS}
            return name[1:] in drawn | self.documents.copies.keys()
        place = normpath(PurePosixPath(page).parent / name.removesuffix(".md"))
        target = place if name else page
        headings = map(slug, HEADING.findall(self.pages.get(target, "")))
        return target in self.pages and (not chapter or chapter in headings)


TESTED = "## Tests against the publication"
"""Heading of a page of a model, after what a study page reports of the model."""


@pytest.fixture(scope="module")
def made() -> Made:
    found = Documents()
    return Made(dict(pages(found)), found)


def test_every_document_is_a_page(made: Made) -> None:
    found = {page for path, page in made.documents.pages.items() if path != "README.md"}
    assert found <= set(made.pages)


def test_programs_find_every_page_with_its_first_sentence(made: Made) -> None:
    text = listed_for_programs(made.pages)
    assert {link["page"].removesuffix(".md") for link in LINK.finditer(text)} == set(
        made.pages
    )
    assert (
        "- [Certificates for a paper](guide/certificates.md): This page is for authors"
        " who want to show readers that the results of a paper follow from its studies."
    ) in text.splitlines()
    # Each has a sentence, and no mark of Markdown is left in it.
    entries = [line for line in text.splitlines() if line.startswith("- ")]
    bare = [
        line for line in entries if not re.search(r"\.md\): [\w`][^\]|]{10,}$", line)
    ]
    assert bare == []


def test_every_page_is_in_a_list_of_pages(made: Made) -> None:
    listed = {"index", "gallery"}
    for page, text in made.pages.items():
        folder = PurePosixPath(page).parent
        for tree in TOCTREE.findall(text):
            for entry in tree.split():
                name = normpath(folder / entry)
                found = [one for one in made.pages if PurePosixPath(one).match(name)]
                listed |= set(found) if entry == "*" else {name}
    assert set(made.pages) - listed == set()


def test_the_first_page_is_the_beginning_of_the_readme(made: Made) -> None:
    first = chapters(read("README.md"))[""]
    assert first.splitlines()[2] in made.pages["index"]
    assert "![Speed, flock radius" in made.pages["index"]


def test_links_lead_to_pages_headings_and_files(made: Made) -> None:
    found = [(page, link) for page in made.pages for link in made.links(page)]
    wrong = [(page, link[0]) for page, link in found if not made.leads(page, link)]
    assert wrong == []
    assert len(found) > 100  # else the pattern has become one that finds none
    assert len(made.documents.copies) > 10
    assert all(path.is_file() for path in made.documents.copies.values())


def test_no_document_is_copied_instead_of_being_a_page(made: Made) -> None:
    copied = [name for name in made.documents.copies if name.endswith(".md")]
    assert copied == []


def test_figures_of_blocks_are_those_of_the_page(made: Made) -> None:
    found = {page: MADE_FIGURE.findall(text) for page, text in made.pages.items()}
    shown = {page: places for page, places in found.items() if places}
    assert len(shown) > 4
    for page, places in shown.items():
        assert all(place.startswith(f"{page}/") for place in places), page


@pytest.mark.parametrize(
    ("text", "adapted"),
    [
        ("[a](docs/guide/searching.md)", "[a](guide/searching.md)"),
        ("[a](GUIDE.md)", "[a](guide/index.md)"),
        ("[a](docs/words.md#how-it-runs)", "[a](words.md#how-it-runs)"),
        ("[a](docs/decisions)", "[a](decisions/index.md)"),
        ("![a](sweep/errors.py)", f"![a](/{COPIES}/sweep/errors.py)"),
        ("[a](sweep)", "a"),
        ("[a](https://example.org/GUIDE.md)", "[a](https://example.org/GUIDE.md)"),
        ("```\n[a](GUIDE.md)\n```\n", "```\n[a](GUIDE.md)\n```\n"),
        (
            "Also called: a, b\nc.\n",
            "```{index} !a, !b c\n```\n\nAlso called: a, b\nc.\n",
        ),
        (
            "<!-- file: a.yaml -->\n```yaml\n",
            "```{code-block} yaml\n:caption: a.yaml\n",
        ),
    ],
)
def test_a_link_of_a_document_becomes_one_of_the_site(text: str, adapted: str) -> None:
    assert Documents().adapted(text, "README.md", "index") == adapted


def test_the_commands_are_there_with_all_arguments_and_options(made: Made) -> None:
    parts = chapters(made.pages["reference/commands"])
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    assert set(parts) - {""} == set(commands)
    for name, command in commands.items():
        for one in command.params:
            argument = one.param_type_name == "argument"
            shown = one.metavar or one.name.upper() if argument else one.opts[0]
            assert shown.strip("[]").replace("|", "\\|") in parts[name]


def test_a_command_shows_what_holds_without_an_option(made: Made) -> None:
    launch = chapters(made.pages["reference/commands"])["launch"]
    rows = {line.split("`")[1]: line for line in launch.splitlines() if "| `" in line}
    assert rows["--workers WORKERS"].endswith("| `0` |")
    assert rows["--executor local\\|dask\\|cuda\\|wasm\\|NAME"].endswith("| `local` |")
    assert rows["--retry"].endswith("|  |")


def test_models_metrics_maps_and_starts_are_there_with_all_settings(made: Made) -> None:
    rows = {
        page: set(re.findall(r"^\| `(\w+)`", text.split(TESTED)[-1], re.M))
        for page, text in made.pages.items()
    }
    assert set(METRICS) <= rows["reference/metrics"]
    assert {*MAPS, *STARTS} <= rows["reference/maps-and-starts"]
    for name, model in MODELS.items():
        groups = (model.params, *(settings for _, settings in GROUPS))
        fields = {field for settings in groups for field in settings._fields}
        assert fields == rows[f"reference/models/{name}"]


def test_a_model_shows_its_equations_and_the_values_of_its_presets(made: Made) -> None:
    text = made.pages["reference/models/nguyen2024"]
    assert "| `displacement_factor` | 1 | 3 | Eq. (2) has no factor" in text
    text = text.replace(text.split(TESTED)[0].split("## Differences")[1], "")
    assert "The acceleration is a weighted sum of five rules (Eq. 3):" in text
    assert "| `separation_weight` | $w_s$ | weight of the separation rule" in text
    row = next(line for line in text.splitlines() if line.startswith("| `drag`"))
    assert row.endswith("| a number from 0 to 1 | 0 | 0.1 |")
    assert "The torus of preset as_run wraps positions only: boids do" in text
    assert "wraps positions only" not in made.pages["reference/models/vicsek1995"]


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_what_a_module_exports_is_there_with_its_docstring(
    module: ModuleType, made: Made
) -> None:
    text = made.pages[f"reference/python/{module.__name__.replace('.', '-')}"]
    public = set(getattr(module, "__all__", dir(module)))
    functions = dict(inspect.getmembers(module, inspect.isfunction))
    classes = {
        name: one
        for name, one in inspect.getmembers(module, inspect.isclass)
        if one.__module__.startswith("sweep.")
    }
    entries = [
        *(f"{{py:function}} {name}(" for name in functions.keys() & public),
        *(f"{{py:class}} {name}\n" for name in classes.keys() & public),
    ]
    assert entries
    assert [entry for entry in entries if entry not in text] == []
    for one in [functions[name] for name in functions.keys() & public]:
        assert (inspect.getdoc(one) or "").splitlines()[0] in text


def test_sections_of_docstrings_are_lists_and_examples_are_code(made: Made) -> None:
    text = made.pages["reference/python/sweep"]
    assert "**Parameters**\n\n- `study` : str\\\n  The name of the study" in text
    assert "**Examples**\n\n```text\n>>> sweep.load(" in text
    for module in MODULES:
        page = made.pages[f"reference/python/{module.__name__.replace('.', '-')}"]
        assert re.findall(r"^-{3,}$", page, re.MULTILINE) == []


def test_columns_are_those_of_what_is_stored(made: Made) -> None:
    parts = chapters(made.pages["reference/columns"])
    assert set(parts) - {""} == {"trials", "series", "heatmaps", "trajectories"}
    assert "| `coverage_mean` | double | % |" in parts["trials"]
    assert "| `vx` |" in parts["trajectories"]
