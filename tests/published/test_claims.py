"""published.yaml: what is read, and what is said about
mistakes before any trial runs.
"""

from pathlib import Path

import pytest

from kernels.models import MODELS
from sweep.errors import SpecError
from sweep.published.claims import shown
from sweep.published.measures import Call, Mean, MeanDifference, RankCorrelation
from sweep.published.publications import Publication, read_all
from sweep.published.verdicts import Above, Value, Within, region
from tests import ROOT
from tests.publications import FIGURES, PUBLISHED, SPEC, experiments

MEASURE = "{mean: speed, frame: 0, for: {separation_weight: 1}}"
EXPECT = "{value: 0.765, rounding: 0.0005, trials: 100, margin: 0.2, because: guess}"


def read(
    folder: Path, published: str = PUBLISHED, *, quick: bool = False, spec: str = SPEC
) -> Publication:
    (publication,) = read_all(experiments(folder, published, spec), quick=quick)
    return publication


def test_a_figure_finds_what_its_claims_expect(tmp_path: Path) -> None:
    """Without specs and functions, and the same as the judge."""
    publication = read(tmp_path)
    file, (first, _) = tmp_path / "experiments/tiny/published.yaml", publication.claims
    assert first.expect is not None
    (found,) = shown(file, "curves")
    assert found.region == region(first.expect)
    assert (found.kind, found.spec) == (first.kind, first.spec)
    assert found.measure["mean"] == "speed"
    assert shown(file, "other") == []


def test_a_publication_is_read(tmp_path: Path) -> None:
    publication = read(tmp_path)
    first, second = publication.claims
    assert first.measure == Mean(
        "small", "speed", (0, 0), {"separation_weight": 1.0}, "trial"
    )
    assert first.expect == Value(0.765, 0.0005, 100, 0.2, "guess")
    assert (second.measure, second.untestable) == (None, "no machine is named")
    assert publication.contradictions[0].where == "Section 2"
    assert list(publication.drawings) == ["curves"]
    assert publication.studies["small"].text == SPEC


@pytest.mark.parametrize(
    ("measure", "expected"),
    [
        (
            "{mean: speed_mean, unit: replicate}",
            Mean("small", "speed_mean", None, {}, "replicate"),
        ),
        (
            "{mean: dispersion, frames: [2, 6], unit: point}",
            Mean("small", "dispersion", (2, 6), {}, "point"),
        ),
        (
            "{rank_correlation: [separation_weight, speed]}",
            RankCorrelation("small", "separation_weight", "speed", {}),
        ),
        (
            "{call: constant, distribution: percentage}",
            Call("constant", "percentage"),
        ),
        (
            "{call: constant, distribution: normal, for: {separation_weight: 1}}",
            Call("constant", "normal", {"separation_weight": 1.0}),
        ),
        (
            (
                "{difference: [{mean: speed, spec: small, for: {separation_weight: 1}},"
                " {mean: speed, unit: trial}]}"
            ),
            MeanDifference(
                Mean("small", "speed", None, {"separation_weight": 1.0}, "trial"),
                Mean("small", "speed", None, {}, "trial"),
            ),
        ),
    ],
)
def test_every_form_of_a_measure(
    tmp_path: Path, measure: str, expected: object
) -> None:
    published = PUBLISHED.replace(MEASURE, measure).replace(EXPECT, "{above: 1}")
    claim = read(tmp_path, published).claims[0]
    assert claim.measure == expected
    assert claim.expect == Above(1.0)


def test_numbers_computed_in_another_order_are_found(tmp_path: Path) -> None:
    published = PUBLISHED.replace("weight: 1}", "weight: 0.3}").replace(
        EXPECT, "{within: [0, 1]}"
    )
    spec = SPEC.replace("[0.5, 1]", "{linspace: [0.1, 0.5, 5]}")
    claim = read(tmp_path, published, spec=spec).claims[0]
    assert claim.expect == Within(0.0, 1.0)


def test_the_quick_scale_changes_the_spec_and_its_name(tmp_path: Path) -> None:
    study = read(tmp_path, quick=True).studies["small"]
    assert (study.name, study.replicates, study.fixed["steps"]) == (
        "quick/tiny/small",
        3,
        4,
    )


MISTAKES = [
    (
        "mean: speed,",
        "mean: sped,",
        'tiny/published.yaml:14: unknown recorded series "sped"; did you mean "speed"?',
    ),
    (
        MEASURE,
        "{mean: sped, unit: trial}",
        'unknown column "sped"; did you mean "speed"?',
    ),
    (
        "frame: 0",
        "frame: 3",
        "no recorded frame; allowed: 0, 2, ... and the last frame, 6",
    ),
    ("frame: 0", "frames: [8, 9]", "no recorded frame; allowed: 0"),
    ("frame: 0", "frames: [0, 2], frame: 0", 'give either "frame" or "frames"'),
    (
        "weight: 1}",
        "weight: 2}",
        "no point has separation_weight = 2; values of separation_weight: 0.5, 1",
    ),
    (
        "separation_weight: 1}",
        "separation_wait: 1}",
        'unknown parameter "separation_wait"; did you mean',
    ),
    (
        "separation_weight: 1}",
        "n: many}",
        "'many' is not allowed for n; allowed: an integer",
    ),
    (
        ", for: {separation_weight: 1}}",
        "}",
        '2 points: "unit" must name the independent value',
    ),
    ("frame: 0,", "unit: trial, ", '"unit" has no meaning for a single point'),
    (MEASURE, "{maen: speed}", 'unknown key "maen"; did you mean "mean"?'),
    (
        MEASURE,
        "{mean: speed, call: constant}",
        "a measure needs exactly one of mean, difference,",
    ),
    (
        MEASURE,
        "{call: constant, distribution: skew}",
        'unknown distribution "skew"; did you mean "skewed"?',
    ),
    (
        MEASURE,
        "{call: constant}",
        'missing key "distribution", the distribution of the values of constant;',
    ),
    (
        MEASURE,
        "{call: constat, distribution: normal}",
        'unknown function of figures.py "constat"; did you mean "constant"?',
    ),
    (
        MEASURE,
        "{difference: [{mean: speed, unit: trial}]}",
        '"difference" must be a list of two',
    ),
    (MEASURE, "{rank_correlation: [n, speed]}", 'unknown varied number "n"'),
    (
        MEASURE,
        "{rank_correlation: [separation_weight, speed]}",
        '"trials" has no meaning for a rank correlation',
    ),
    (MEASURE, "{transition: speed}", "tiny/small has flocks of a single size"),
    (
        EXPECT,
        "{value: 1, above: 2}",
        "an expectation needs exactly one of value, above, below, within",
    ),
    (
        EXPECT,
        "{value: 1, margin: 2}",
        '"margin" needs "because", the reason, and vice versa',
    ),
    (
        EXPECT,
        "{value: 1}",
        'missing key "margin": the allowed distance from the number',
    ),
    (
        EXPECT,
        "{value: 1, margin: 0, because: x}",
        '"margin" must be more than 0, not 0',
    ),
    (
        EXPECT,
        "{value: 0, margin: 5 %, because: x}",
        '"margin" must be more than 0, not 0; the value is 0',
    ),
    (
        EXPECT,
        "{value: 1, margin: 5, because: 3}",
        '"because" must be a string, not 3',
    ),
    (
        EXPECT,
        "{value: 1, margin: 5%, because: x}",
        '"margin" must be a number, or a fraction of the value such as "5 %", not "5%"',
    ),
    (
        "kind: number",
        "kind: numbr",
        'tiny/published.yaml:10: unknown kind of claim "numbr"; did you mean "number"?',
    ),
    ("    kind: number\n", "", 'missing key "kind"'),
    (
        "registered: 2024-03-01",
        "registered: 2024-13-01",
        '"registered" must be a day such as 2026-03-01, not "2024-13-01"',
    ),
    ("    registered: 2024-03-01\n", "", 'missing key "registered"'),
    (
        "looked: before",
        "looked: never",
        'unknown time of the look "never". Allowed: before, after',
    ),
    (
        "    looked: before\n",
        "",
        'either "measure", "expect" and "looked", or "untestable" with the reason',
    ),
    (
        "    kind: number",
        '    kind: number\n    statement: "a b"',
        '"statement" must be a name of letters',
    ),
    (
        EXPECT,
        "{value: 1, rounding: -1, margin: 1, because: x}",
        '"rounding" must be a number from 0, not -1',
    ),
    (EXPECT, "{above: 1, trials: 3}", 'unknown key "trials"'),
    (EXPECT, "{within: [2, 1]}", "a list of two numbers, the smaller one first"),
    ("    spec: small\n", "", 'missing key "spec": the spec whose trials test'),
    (
        "    spec: small",
        "    spec: smal",
        'tiny/published.yaml:12: unknown spec "smal"; did you mean "small"?',
    ),
    (
        "figure: curves",
        "figure: curve",
        'unknown figure "curve"; did you mean "curves"?',
    ),
    ("id: hidden", "id: start-speed", '"start-speed" is listed twice'),
    ("id: hidden", 'id: "a b"', '"id" must be a name of letters'),
    (
        "    untestable:",
        "    expect: {above: 1}\n    untestable:",
        'either "measure", "expect" and "looked", or "untestable"',
    ),
    ("  small: {rep", "  smal: {rep", 'unknown spec "smal"; did you mean "small"?'),
    ('says: "the text', 'sais: "the text', 'unknown key "sais"; did you mean "says"?'),
]


@pytest.mark.parametrize(("right", "wrong", "message"), MISTAKES)
def test_a_mistake_is_named_with_its_line(
    tmp_path: Path, right: str, wrong: str, message: str
) -> None:
    assert right in PUBLISHED
    with pytest.raises(SpecError) as caught:
        read(tmp_path, PUBLISHED.replace(right, wrong, 1))
    assert message in str(caught.value)
    assert str(caught.value).startswith("tiny/published.yaml:")


def test_the_mistakes_of_all_claims_are_named_at_once(tmp_path: Path) -> None:
    published = PUBLISHED.replace("mean: speed,", "mean: sped,").replace(
        "untestable", "untestabel"
    )
    with pytest.raises(SpecError) as caught:
        read(tmp_path, published)
    assert len(str(caught.value).splitlines()) == 2


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            "replicats: 3",
            (
                "tiny/published.yaml:5: with these changes small.yaml is wrong: unknown"
                ' key "replicats"'
            ),
        ),
        (
            "sweep.seperation_weight.values: 3",
            'unknown mapping in the spec "seperation_weight"',
        ),
        ("fixd.steps: 4", 'unknown mapping in the spec "fixd"; did you mean "fixed"?'),
        ("sweep.separation_weight: [0.5, 2]", "no point has separation_weight = 1"),
    ],
)
def test_wrong_quick_changes_are_named(
    tmp_path: Path, change: str, message: str
) -> None:
    published = PUBLISHED.replace("replicates: 3, fixed.steps: 4", change)
    with pytest.raises(SpecError) as caught:
        read(tmp_path, published, quick=True)
    assert message in str(caught.value)
    read(tmp_path, published)


MUTANTS = """
mutants:
  heavy: {about: "boids turn slowly", change: {all: {fixed.drag: 0.2}}}
  apart: {about: "no drag", change: {small: {fixed.drag: 0, replicates: 2}}}
contradictions:"""


def test_mutants_change_specs(tmp_path: Path) -> None:
    heavy, apart = read(
        tmp_path, PUBLISHED.replace("\ncontradictions:", MUTANTS)
    ).mutants
    assert (heavy.name, heavy.description) == ("heavy", "boids turn slowly")
    changes = [
        {spec: [one.value for one in made] for spec, made in mutant.changes.items()}
        for mutant in (heavy, apart)
    ]
    assert changes == [
        {"small": [{"fixed.drag": 0.2}]},
        {"small": [{"fixed.drag": 0, "replicates": 2}]},
    ]


@pytest.mark.parametrize(
    ("right", "wrong", "message"),
    [
        (
            "fixed.drag: 0.2",
            "fixed.drga: 0.2",
            "tiny/published.yaml:24: with these changes small.yaml is wrong: unknown"
            ' parameter "drga"; did you mean "drag"?',
        ),
        ("fixed.drag: 0.2", "fixd.drag: 0.2", 'unknown mapping in the spec "fixd"'),
        ("all: ", "smal: ", 'published.yaml:24: unknown spec "smal"; did you mean'),
        ('about: "no drag", ', "", 'published.yaml:25: missing key "about"'),
        ("heavy:", '"so heavy":', '"so heavy" is not a name of letters'),
        ("{fixed.drag: 0.2}", "{}", '"all" must be a mapping with at least one'),
    ],
)
def test_wrong_mutants_are_named(
    tmp_path: Path, right: str, wrong: str, message: str
) -> None:
    assert right in MUTANTS
    published = PUBLISHED.replace("\ncontradictions:", MUTANTS.replace(right, wrong))
    with pytest.raises(SpecError) as caught:
        read(tmp_path, published)
    assert message in str(caught.value)


def test_a_fit_needs_no_margin(tmp_path: Path) -> None:
    published = PUBLISHED.replace(EXPECT, "{value: 2}").replace("number", "fit")
    assert read(tmp_path, published).claims[0].expect == Value(2.0)


def test_a_share_is_a_margin(tmp_path: Path) -> None:
    published = PUBLISHED.replace(
        EXPECT, '{value: -2, margin: 2.5 %, because: "the spread"}'
    )
    expect = read(tmp_path, published).claims[0].expect
    assert expect == Value(-2.0, margin=0.05, because="the spread")


@pytest.mark.parametrize(
    ("right", "wrong", "message"),
    [
        ('("small",)', '("big",)', 'figures.py: figure "curves": unknown spec "big"'),
        ('"curves":', '"../curves":', 'figures.py: figure "../curves" is not a name'),
        (
            "import numpy",
            "import nunpy",
            "figures.py:2: cannot be loaded: ModuleNotFoundError",
        ),
        (
            "import numpy",
            "import (",
            (
                "figures.py: cannot be loaded: SyntaxError: invalid syntax (figures.py,"
                " line 2)"
            ),
        ),
        (
            "FIGURES = ",
            "FIGURES = [] or None #",
            "figures.py: FIGURES must be a dict of drawings by name, not NoneType",
        ),
        (
            'Drawing(curves, ("small",), "Speed & dispersion")',
            "curves",
            'figures.py: figure "curves" must be Drawing(',
        ),
        (
            '("small",)',
            '"small"',
            (
                'figures.py: figure "curves" must be Drawing(function, (names of'
                " specs,), text)"
            ),
        ),
        ('"curves":', "3:", 'figures.py: figure "3" must have a string as name'),
    ],
)
def test_wrong_figures_are_named(
    tmp_path: Path, right: str, wrong: str, message: str
) -> None:
    with pytest.raises(SpecError) as caught:
        read_all(
            experiments(tmp_path, figures=FIGURES.replace(right, wrong)), quick=False
        )
    assert str(caught.value).startswith(f"tiny/{message}")


def test_a_study_belongs_to_one_spec(tmp_path: Path) -> None:
    folder = experiments(tmp_path)
    (folder / "tiny" / "other.yaml").write_text(SPEC)
    (folder / "tiny" / "published.yaml").write_text(
        PUBLISHED.replace("specs:\n", "specs:\n  other: {}\n")
    )
    with pytest.raises(
        SpecError,
        match=r'tiny/small.yaml: study "tiny/small" is already the study of tiny/other',
    ):
        read_all(folder, quick=False)


def test_a_folder_without_publications_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r"no subfolder has a published.yaml"):
        read_all(tmp_path, quick=False)


@pytest.mark.slow
@pytest.mark.parametrize("quick", [False, True])
def test_what_the_documents_published_loads_at_both_scales(quick: bool) -> None:
    """Every claim has a measure and an expectation or a reason, of specs and figures
    that exist. What a document contradicts is known of those that somebody has read,
    and of no others: a claim about a document that was not read is marked so, or is a
    consequence of the equations.
    """
    publications = read_all(ROOT / "experiments", quick=quick)
    assert {publication.name for publication in publications} == set(MODELS)
    unread = {
        publication.name
        for publication in publications
        if all(
            claim.unverified or claim.kind in ("exact", "hypothesis")
            for claim in publication.claims
        )
    }
    classics = {"couzin2002", "cucker_smale2007", "dorsogna2006"}
    assert unread == classics | {"strombom2014", "vasarhelyi2018"}
    for publication in publications:
        assert bool(publication.contradictions) == (publication.name not in unread)
