"""Units of expressions: combined as numbers are, or refused with a way out."""

import doctest

import pytest

import sweep.spec.units
from kernels.catalogue import BUILT_IN
from sweep.spec.evaluation import ExpressionError
from sweep.spec.expressions import parse
from sweep.spec.settings import Setting, settings_of
from sweep.spec.units import parsed, unit_of, written_out

UNITS = {
    "speed": "px/step",
    "radius": "px",
    "energy": "px^2/step^2",
    "share": "%",
    "turn": "degrees",
    "polarization": "",
    "count": "boids",
}
KNOWN = settings_of("aziel_chen2025", BUILT_IN) | {
    name: Setting(name, "float", "metrics", "", unit) for name, unit in UNITS.items()
}


def unit(text: str) -> str:
    return unit_of(parse(text, KNOWN).tree, KNOWN)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("speed", "px/step"),
        ("polarization / speed", "step/px"),
        ("radius / speed", "step"),
        ("1 / speed / dt", "1/px"),
        ("speed * radius", "px^2/step"),
        ("radius * share", "px*%"),
        ("share / speed", "%*step/px"),
        ("count / n", "boids"),
        ("speed ** 2 / energy", ""),
        ("sqrt(energy) / speed", ""),
        ("sqrt(radius)", "px^0.5"),
        ("sqrt(radius) ** 2 - radius", "px"),
        ("radius ** (1 / 3)", "px^0.333333"),
        ("speed ** -2", "step^2/px^2"),
        ("speed ** 0 + polarization", ""),
        ("polarization ** n", ""),
        ("2 ** polarization", ""),
        ("speed + max_speed - 3 * speed", "px/step"),
        ("100 - share", "%"),
        ("max(radius, 2, width)", "px"),
        ("abs(-turn)", "degrees"),
        ("floor(radius) % width", "px"),
        ("radius // width", ""),
        ("log(radius / width) + exp(polarization) + pi", ""),
        ("log(2) * radius", "px"),
        ("radius if speed > 2 and not minimum_image else width", "px"),
        ("speed if map == 'empty' else 0", "px/step"),
        ("2 * pi", ""),
    ],
)
def test_units_are_combined(text: str, expected: str) -> None:
    assert unit(text) == expected


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (
            "speed + radius",
            '"speed + radius" needs equal units, but "speed" is in px/step and "radius"'
            ' is in px; divide by a value in px/step, for example "speed / max_speed"',
        ),
        (
            "polarization - radius / 2",
            '"polarization" has no unit and "radius / 2" is in px; divide by a value'
            ' in px, for example "(radius / 2) / ',
        ),
        ("min(polarization, share)", 'equal units, but "polarization" has no unit'),
        ("radius % speed", 'but "radius" is in px and "speed" is in px/step'),
        ("radius // speed", 'but "radius" is in px and "speed" is in px/step'),
        ("1 if speed > radius else 0", '"speed > radius" needs equal units'),
        ("1 if 0 < speed < 1 and radius < n else 0", '"radius < n" needs equal units'),
        ("speed if n > 3 else radius", 'but "speed" is in px/step and "radius"'),
        ("log(radius)", 'log needs a number without unit, but "radius" is in px'),
        ("exp(share)", 'exp needs a number without unit, but "share" is in %'),
        ("2 ** radius", 'a power needs a number without unit, but "radius" is in px'),
        ("radius ** n", '"radius" is in px: the power must be a literal number'),
        ("radius ** 0.123456", "an integer or a simple fraction, at most 20, not"),
        ("radius ** 21", "at most 20, not 21"),
        ("radius ** (1 / 0)", '"1 / 0" is not a finite number'),
    ],
)
def test_what_does_not_go_together_is_refused(text: str, reason: str) -> None:
    with pytest.raises(ExpressionError) as error:
        unit(text)
    assert reason in str(error.value)


def test_the_way_out_that_an_error_names_is_one() -> None:
    assert unit("speed / max_speed + radius / width") == ""


@pytest.mark.parametrize("model", ["aziel_chen2025", "rustamani2024", "patel2023"])
def test_the_unit_of_every_setting_is_read_as_it_is_written(model: str) -> None:
    units = {setting.unit for setting in settings_of(model, BUILT_IN).values()}
    assert len(units) > 5
    assert {written_out(parsed(one)) for one in units} == units


def test_the_examples_in_the_docstrings() -> None:
    assert doctest.testmod(sweep.spec.units) == (0, 2)
