"""The site as it is built: it loads nothing from a network, and its links lead on."""

import re
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from docs.building.site import build

LOADED = {"script": "src", "img": "src", "iframe": "src", "source": "src"}
"""What a browser loads, and the attribute that says from where; besides links that
lead to a file for the page."""
NOT_LOADED = {"next", "prev", "search", "index", "canonical"}
FOREIGN = re.compile(r"(?:[a-z]+:)?//")
IN_STYLE = re.compile(r"""(?:url\(|@import)\s*["']?([^"')\s]+)""")


class Page(HTMLParser):
    """What a page loads, what it links to, and the names of its places."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.links: list[str] = []
        self.places: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.places.add(given.get("id", ""))
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        elif tag == "link" and given.get("rel") not in NOT_LOADED:
            self.loads.append(given["href"])
        elif given.get(LOADED.get(tag, "")):
            self.loads.append(given[LOADED[tag]])
        self.loads += IN_STYLE.findall(given.get("style", ""))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("docs")
    assert build(folder) == 0  # warnings are errors
    return folder / "site"


@pytest.mark.slow
def test_the_site_loads_nothing_from_a_network(site: Path) -> None:
    loaded = {name for path in site.rglob("*.html") for name in Page(path).loads}
    styles = {
        name
        for path in site.rglob("*.css")
        for name in IN_STYLE.findall(path.read_text(encoding="utf-8"))
    }
    assert len(loaded) > 10
    assert [name for name in loaded | styles if FOREIGN.match(name)] == []


@pytest.mark.slow
def test_links_of_the_site_lead_to_files_and_places(site: Path) -> None:
    found = {path: Page(path) for path in site.rglob("*.html")}
    wrong = []
    for path, page in found.items():
        for link in (*page.links, *page.loads):
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (
                (path.parent / unquote(parts.path)).resolve() if parts.path else path
            )
            place = unquote(parts.fragment)
            known = found[target].places if target in found else {place}
            if not target.is_file() or (place and place not in known):
                wrong.append(f"{path.relative_to(site)}: {link}")
    assert wrong == []


@pytest.mark.slow
def test_the_gallery_shows_figures_with_commands_and_verdicts(site: Path) -> None:
    page = (site / "gallery.html").read_text(encoding="utf-8")
    text = re.sub(r"<[^>]+>", "", page)
    for study in ("nguyen2024", "aziel_chen2025", "rustamani2024", "patel2023"):
        assert f"_images/{study}-" in page
        assert f"sweep reproduce --only {study}" in text
    assert re.search(r"\d+ (?:confirmed|undecided|refuted)", text)
