"""The paper has the form that JOSS requires, and its numbers are those of documents."""

import re
from collections import Counter

import pytest
from ruamel.yaml import YAML

from sweep.published.bibliography import bibliography_of
from tests import ROOT
from tests.test_readme import NUMBERS

PAPER = (ROOT / "paper" / "paper.md").read_text(encoding="utf-8")
BIBLIOGRAPHY = (ROOT / "paper" / "paper.bib").read_text(encoding="utf-8")
_, FRONT, BODY = PAPER.split("---\n", 2)
WORDS = " ".join(BODY.split())
CITED = re.compile(r"@(\w+)")
ENTRY = re.compile(r"^@\w+\{(\w+),\n(.*?)^\}", re.MULTILINE | re.DOTALL)
SECTIONS = [
    "Summary",
    "Statement of need",
    "State of the field",
    "Software design",
    "Research impact statement",
    "AI usage disclosure",
    "Acknowledgements",
    "References",
]
"""Of the paper format of JOSS, in the state of May 2026."""
FEWEST_WORDS = 750
MOST_WORDS = 1750
MARKED = re.compile(r"<!-- [a-z-]+ -->.*?<!-- end of [a-z-]+ -->", re.DOTALL)


def quoted(path: str, pattern: str) -> dict[str, str]:
    """The groups of a pattern in a document; the document must have the pattern."""
    text = " ".join((ROOT / path).read_text(encoding="utf-8").split())
    match = re.search(pattern, text)
    assert match, f"{path} does not state {pattern}"
    return match.groupdict()


def verdicts() -> dict[str, int]:
    """The sums of the table of verdicts in the README, and the number of studies."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    table = text.partition("<!-- headline")[2].partition("<!-- end of headline")[0]
    rows = [line.strip("| ").split(" | ") for line in table.splitlines()[1:]]
    names, _, *counts = [[cell.strip() for cell in row] for row in rows]
    sums: Counter[str] = Counter()
    for row in counts:
        for name, cell in zip(names[1:], row[1:], strict=True):
            sums[name] += int(cell)
        sums["studies"] += 1
        sums["judged"] += row[1] != "0"
    return sums


def sentences() -> list[str]:
    """The sentences with numbers, as the documents of the repository have them."""
    sums = verdicts()
    mutants = quoted(
        "docs/validation.md", r"Of (?P<all>\d+) random.*?detect (?P<n>\d+)"
    )
    later = quoted(
        "docs/decisions/mutants-are-drawn.md",
        r"tried with (?P<all>\d+) mistakes of a sample that has grown with the code."
        r" They notice (?P<n>\d+), and (?P<live>\d+) live\. (?P<rest>\w+) are not",
    )
    launch = quoted(
        "README.md",
        r"(?P<trials>[\d,]+) trials of (?P<n>[\w ]+) boids over (?P<steps>[\d,]+) steps"
        r" took (?P<time>\d+ min \d+ s) on two cores of an AMD EPYC"
        r" \(version (?P<version>[\d.]+)\)",
    )
    mesa = quoted(
        "docs/speed.md", r"in boidsweep (?P<version>[\d.]+).*?run: (?P<ratio>\d+) times"
    )
    sheep = quoted(
        "experiments/sheep/README.md",
        r"and (?P<drives>\d+) recorded drives of (?P<sheep>\d+) sheep",
    )
    studies, judged = sums["studies"], sums["judged"]
    return [
        f"{NUMBERS[studies].capitalize()} published studies of flocking",
        f"contains {NUMBERS[studies]} published studies with specs",
        f"Of {sums['statements']} statements of {NUMBERS[judged]} of them, simulations"
        f" confirm {sums['confirmed']} and refute {sums['refuted']};"
        f" {sums['undecided']} are undecided, and {sums['not testable']} are not",
        f"Of the other {NUMBERS[studies - judged]} studies only",
        f"detected {mutants['n']} of {mutants['all']} mistakes.",
        f"sample of {later['all']} they detected {later['n']}, missed {later['live']},"
        f" and left {later['rest'].lower()} undecided.",
        f"{launch['trials']} trials of {launch['n']} boids over {launch['steps']} steps"
        f" took {launch['time']} on two cores of an AMD EPYC"
        f" (version {launch['version']}).",
        f"(version {mesa['version']}), the flocking example of Mesa took"
        f" {mesa['ratio']} times as long",
        f"and {sheep['drives']} recorded drives of {sheep['sheep']} sheep",
        "means with 95 % confidence intervals",
        "FLAME GPU 2",
    ]


def test_its_front_matter_has_what_joss_requires() -> None:
    front = YAML(typ="safe").load(FRONT)
    assert front["title"].startswith("boidsweep: ")
    assert "Python" in front["tags"]
    assert (ROOT / "paper" / front["bibliography"]).is_file()
    places = {place["index"] for place in front["affiliations"]}
    assert {author["affiliation"] for author in front["authors"]} == places
    assert re.fullmatch(r"\d{1,2} [A-Z][a-z]+ \d{4}", front["date"])


def test_it_has_the_sections_of_joss_in_order_and_length() -> None:
    assert re.findall(r"^# (.*)$", BODY, re.MULTILINE) == SECTIONS
    words = MARKED.sub("", BODY).split()
    assert FEWEST_WORDS <= len(words) <= MOST_WORDS


def test_what_the_authors_must_state_is_not_made_up() -> None:
    """A section that only an author can write has the entry of pyproject.toml alone."""
    for key, section in {
        "ai-usage": "AI usage disclosure",
        "funding": "Acknow",
    }.items():
        text = BODY.partition(f"# {section}")[2].partition("\n# ")[0]
        assert f"<!-- {key} -->" in text
        assert len(MARKED.sub("", text).split()) < 5
    assert "<!-- users -->" in BODY


def test_each_citation_has_an_entry_and_each_entry_a_citation() -> None:
    entries = [key for key, _ in ENTRY.findall(BIBLIOGRAPHY)]
    assert len(entries) == len(set(entries))
    assert set(CITED.findall(BODY)) == set(entries)


@pytest.mark.parametrize(("key", "text"), ENTRY.findall(BIBLIOGRAPHY))
def test_an_entry_has_an_identifier_in_its_form(key: str, text: str) -> None:
    fields = dict(re.findall(r"^  (\w+) = \{(.*)\},?$", text, re.MULTILINE))
    assert {"author", "title", "year"} <= fields.keys()
    assert key.endswith(fields["year"]) or key == "NetLogo"
    assert text.count("{") == text.count("}")
    if doi := fields.get("doi"):
        assert re.fullmatch(r"10\.\d{4,}/\S+", doi)
    else:
        assert fields["url"].startswith("https://")


@pytest.mark.parametrize(
    ("key", "study"),
    [
        ("Vicsek1995", "vicsek1995"),
        ("Couzin2002", "couzin2002"),
        ("DOrsogna2006", "dorsogna2006"),
        ("CuckerSmale2007", "cucker_smale2007"),
        ("Strombom2014", "strombom2014"),
        ("Vasarhelyi2018", "vasarhelyi2018"),
    ],
)
def test_a_built_in_study_is_cited_as_in_its_folder(key: str, study: str) -> None:
    about = bibliography_of(study)
    text = dict(ENTRY.findall(BIBLIOGRAPHY))[key]
    assert about is not None
    assert about.title.lower() in text.lower()
    assert f"year = {{{about.year}}}" in text
    volume = re.search(r"volume = \{(\d+)\}", text)
    assert volume
    assert f" {volume[1]}, " in about.source


def test_its_numbers_are_those_of_the_documents() -> None:
    """Each number of the body is in a sentence that a document proves."""
    rest = CITED.sub("", WORDS)
    for sentence in sentences():
        assert sentence in rest, sentence
        rest = rest.replace(sentence, "")
    assert re.findall(r"\d+", rest) == []
