"""Builds the site: `make docs`. The sources and the site stand in build/.

`llms.txt` lists the pages for programs, in the form of llmstxt.org. Each entry leads to
the Markdown of a page, which stands beside the page.

Figures show trials that the build runs: trials of the gallery, one trial per model, and
trials of the blocks of a page. A page names the figure of a block as `/_made/PAGE/...`,
a file below the folder in which the blocks ran.
"""

import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from shutil import copyfile, rmtree

from docs.building.api import api_pages
from docs.building.blocks import BlockError, PageRun, blocks
from docs.building.documents import ROOT, Documents, read
from docs.building.gallery import gallery_page
from docs.building.models import PICTURES, draw_models, model_pages, write_computed
from docs.building.reference import reference_pages
from sweep.cli.topics import GUIDE, ONCE
from sweep.own_code.reading import study_of

BUILD = ROOT / "build"
MADE = "_made"
WIDTH = "100"
"""Of the terminal in which the commands of pages run, in signs."""
SECTIONS = {
    "": "Overview",
    "tutorials": "Tutorials",
    "guide": "Guide",
    "explanations": "Explanations",
    "reference": "Reference",
    "studies": "Published studies",
    "decisions": "Optional",
}
"""Headings of `llms.txt`, by the first folder of a page."""
TITLE = re.compile(r"^# (.+)$", re.MULTILINE)
PARAGRAPH = re.compile(r"\n\n(?!```|[#|<:!$\s-])(.+?)(?=\n\n|\Z)", re.DOTALL)
LINKED = re.compile(r"!?\[([^\]]*)\]\([^)]*\)")
SENTENCE_END = re.compile(r"(?<=[^\sA-Z][.:])\s")
"""No end is the point of an initial."""
AT_ONCE = 2
"""Pages whose blocks run at the same time, beside the trials of the gallery."""


def pages(documents: Documents) -> Iterator[tuple[str, str]]:
    """The name and the text of each page for which no trial is run."""
    yield from documents.written()
    yield from reference_pages()
    yield from api_pages()
    for page, text in model_pages():
        yield page, documents.with_chapters(text, page)


def build(folder: Path = BUILD) -> int:
    """Write the sources and the site below `folder`; return the exit code."""
    sources, site = folder / "pages", folder / "site"
    for old in (sources, site):
        rmtree(old, ignore_errors=True)
    documents = Documents()
    write(documents, sources)
    with ProcessPoolExecutor(AT_ONCE, mp_context=get_context("spawn")) as pool:
        shown = documents_with_pictures(documents)
        ran = [
            pool.submit(run_page, path, sources / MADE / page)
            for path, page in shown.items()
        ]
        draw_models(sources)
        write_computed(sources)
        name, text = gallery_page(ROOT / "experiments", folder / "results", sources)
        for one in ran:
            one.result()
    (sources / f"{name}.md").write_text(text, encoding="utf-8")
    code = sphinx(sources, site)
    write_moved(site)
    write_for_programs(sources, site)
    for page in (sources / PICTURES).glob("*.html"):
        copyfile(page, _place(site / PICTURES / page.name))
    return code


def write(documents: Documents, sources: Path) -> None:
    """Write the pages for which no trial is run, and the files that they lead to."""
    for page, text in pages(documents):
        _place(sources / f"{page}.md").write_text(text, encoding="utf-8")
    for copy, original in documents.copies.items():
        copyfile(original, _place(sources / copy))


def write_moved(site: Path) -> None:
    """Write a page at each address that a page of the guide had, which leads to it."""
    for path in sorted((ROOT / "docs" / GUIDE).glob("*.md")):
        place = f"../{GUIDE}/{path.stem}.html"
        names = ONCE.findall(path.read_text(encoding="utf-8")) or [path.stem]
        for name in names:
            _place(site / "how-to" / f"{name}.html").write_text(
                f'<!doctype html><meta charset="utf-8"><title>Moved</title>'
                f'<meta http-equiv="refresh" content="0; url={place}">'
                f'<link rel="canonical" href="{place}"><a href="{place}">Moved</a>\n',
                encoding="utf-8",
            )


def write_for_programs(sources: Path, site: Path) -> None:
    """Write `llms.txt` and the Markdown of each page beside the page."""
    texts = {
        path.relative_to(sources).with_suffix("").as_posix(): path.read_text("utf-8")
        for path in sorted(sources.rglob("*.md"))
    }
    for page, text in texts.items():
        _place(site / f"{page}.md").write_text(text, encoding="utf-8")
    (site / "llms.txt").write_text(listed_for_programs(texts), encoding="utf-8")


def listed_for_programs(texts: Mapping[str, str]) -> str:
    """Return the list of pages in the form of llmstxt.org.

    Each page has the first sentence of the text after the title.
    """
    entries: dict[str, list[str]] = {name: [] for name in SECTIONS}
    for page, text in texts.items():
        title = TITLE.search(text)
        first = PARAGRAPH.search(text, title.end() if title else 0)
        paragraph = LINKED.sub(r"\1", first[1]).replace("**", "") if first else ""
        line = " ".join(paragraph.split())
        sentence = SENTENCE_END.split(line, maxsplit=1)[0].rstrip(":")
        folder = page.partition("/")[0] if "/" in page else ""
        entry = f"- [{title[1] if title else page}]({page}.md)"
        entries[folder if folder in SECTIONS else ""].append(
            f"{entry}: {sentence}" if sentence else entry
        )
    project = tomllib.loads(read("pyproject.toml"))["project"]
    lines = [f"# {project['name']}", "", f"> {project['description']}"]
    for name, heading in SECTIONS.items():
        if entries[name]:
            lines += ["", f"## {heading}", "", *entries[name]]
    return "\n".join([*lines, ""])


def _place(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def documents_with_pictures(documents: Documents) -> dict[str, str]:
    """The documents that show what their blocks make, with the names of their pages."""
    return {
        path: page
        for path, page in documents.pages.items()
        if f"/{MADE}/{page}/" in read(path)
    }


def run_page(path: str, folder: Path) -> None:
    """Run the blocks of a document in a new folder, as a reader would."""
    folder.mkdir(parents=True)
    run = PageRun(folder, _command, study_of)
    for block in blocks(path, read(path)):
        run.run(block)


def _command(folder: Path, arguments: list[str]) -> str:
    program = [sys.executable, "-c", "from sweep.cli import main; main()"]
    environment: Mapping[str, str] = os.environ | {"COLUMNS": WIDTH}
    finished = subprocess.run(
        [*program, *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    if finished.returncode:
        raise BlockError(f"sweep {' '.join(arguments)}: {finished.stderr}")
    return finished.stdout


def sphinx(sources: Path, site: Path) -> int:
    """Make the site of the sources. All warnings are errors, also of links that lead
    nowhere. Returns the exit code.
    """
    options = ["-W", "--keep-going", "-n", "-q", "-j", "2", "-b", "html"]
    places = [
        *("-c", str(ROOT / "docs")),
        *("-d", str(site.with_name("doctrees"))),
        *(str(sources), str(site)),
    ]
    command = [sys.executable, "-m", "sphinx", *options, *places]
    return subprocess.run(command, check=False).returncode


if __name__ == "__main__":
    sys.exit(build())
