"""The site as it is built: it loads nothing from a network, and its links lead on."""

import re
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import quote, unquote, urlsplit

import pytest
from playwright.sync_api import Browser

from docs.building.site import build

LOADED = {"script": "src", "img": "src", "iframe": "src", "source": "src"}
"""What a browser loads, and the attribute that says from where; besides links that
lead to a file for the page."""
NOT_LOADED = {"next", "prev", "search", "index", "canonical"}
FOREIGN = re.compile(r"(?:[a-z]+:)?//")
IN_STYLE = re.compile(r"""(?:url\(|@import)\s*["']?([^"')\s]+)""")

SEARCHED = {
    "citing": ["cite", "FAIR", "license", "BibTeX"],
    "coming-from": ["Mesa", "NetLogo"],
    "comparison": ["ARGoS", "alternatives"],
    "explanations/exactness": ["deterministic", "identical results", "bitwise"],
    "explanations/intervals": ["uncertainty", "standard error"],
    "explanations/seeds": ["random seed", "common random numbers"],
    "faq": ["FAQ"],
    "glossary": ["glossary", "blind angle", "malicious", "packet loss"],
    "guide/ablation-studies": ["ablation", "imperfection"],
    "guide/actuation-and-failures": ["actuation", "actuator", "failure", "fault"],
    "guide/analysing": ["confidence interval", "quantiles", "pandas"],
    "guide/boundaries-of-the-world": ["periodic boundary", "reflecting", "torus"],
    "guide/clusters": ["HPC", "shard", "MPI", "dask", "cloud"],
    "guide/comparisons": ["multiple comparisons", "effect size", "family-wise"],
    "guide/compile-ahead": ["container", "docker"],
    "guide/custom-maps": ["domain", "arena"],
    "guide/custom-models": ["custom model", "custom metric"],
    "guide/designs-and-sampling": ["grid search", "Latin hypercube", "Sobol"],
    "guide/explore-results": ["web interface", "dashboard"],
    "guide/figures": ["figure", "Pareto", "visualise", "visualize"],
    "guide/finite-size-scaling": ["finite-size scaling", "critical exponents"],
    "guide/heterogeneous-robots": ["heterogeneous", "heterogeneity"],
    "guide/hysteresis": ["hysteresis"],
    "guide/in-scripts": ["JSON", "exit codes"],
    "guide/initial-conditions": ["initial condition", "initial state"],
    "guide/interaction-neighbourhoods": ["neighbourhood", "field of view"],
    "guide/interruptions": ["resume", "continue", "kill", "checkpoint"],
    "guide/notebooks": ["Jupyter", "notebook"],
    "guide/numerical-robustness": ["time step", "convergence"],
    "guide/obstacles": ["obstacles"],
    "guide/on-a-gpu": ["GPU", "CUDA"],
    "guide/phase-boundaries": ["phase transition"],
    "guide/power": ["statistical power", "power analysis", "sample size"],
    "guide/reality-gap": ["reality gap", "sim-to-real", "CVaR"],
    "guide/recording-and-derived-metrics": [
        *("histogram", "NaN", "time series", "order parameter")
    ],
    "guide/replicates-and-precision": [
        *("stop after enough replicates", "early stopping", "half-width")
    ],
    "guide/reproducing-publications": ["reproducibility"],
    "guide/results-storage": ["S3", "parquet"],
    "guide/searching": [
        *("optimise", "optimize", "optimisation", "hyperparameter", "optuna"),
        *("genetic algorithm", "multi-objective"),
    ],
    "guide/see-the-swarm": ["simulator", "animation", "video", "simulation"],
    "guide/sensing-and-communication": [
        *("sensor noise", "latency", "communication", "delay")
    ],
    "guide/sensitivity": ["sensitivity analysis"],
    "guide/vectorised-trials": ["SIMD", "vectorised"],
    "guide/verify-export-cite": ["CSV", "export", "ODD"],
    "guide/waypoints": ["waypoints"],
    "guide/when-trials-fail": ["crash", "timeout"],
    "guide/wind-and-gusts": ["wind"],
    "install": ["install", "upgrade", "uninstall", "conda"],
    "limits": ["3D", "UAV"],
    "own-models": ["species", "callback"],
    "reference/metrics": ["polarization", "dispersion", "turn rate"],
    "speed": ["speed", "benchmark"],
    "start": ["trial", "run", "getting started"],
    "status": ["roadmap"],
    "studies/robots": ["drone"],
    "systems": ["Windows"],
    "troubleshooting": ["troubleshooting", "error messages", "memory"],
    "trust": ["security", "untrusted", "sandbox"],
    "tutorials/cluster": ["Slurm"],
    "tutorials/index": ["tutorial"],
}
"""The words that researchers search for, by the page that each word should find."""
RESULTS = "#search-results ul.search li > a"
HREFS = "all => all.map(link => link.href)"
FINISHED = """() => /finished|not match/.test(
    document.querySelector("#search-results .search-summary")?.textContent
)"""
FIRST = 6
"""Results that a reader sees without scrolling."""


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


@pytest.mark.slow
def test_the_search_finds_the_words_of_researchers_on_the_right_pages(
    site: Path, browser: Browser
) -> None:
    wrong = []
    page = browser.new_page()
    for name, words in SEARCHED.items():
        for word in words:
            page.goto(f"{(site / 'search.html').as_uri()}?q={quote(word)}")
            page.wait_for_function(FINISHED)
            links = page.eval_on_selector_all(RESULTS, "all => all.map(a => a.href)")
            found = dict.fromkeys(
                Path(urlsplit(link).path).relative_to(site).with_suffix("")
                for link in links
            )
            if Path(name) not in list(found)[:FIRST]:
                wrong.append(f"{word}: {', '.join(map(str, list(found)[:FIRST]))}")
    page.close()
    assert wrong == []
