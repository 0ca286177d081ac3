"""What a wind needs of a study, and of a model."""

from pathlib import Path

import pytest

from sweep.design.design import expand
from sweep.errors import SpecError
from sweep.own_code.reading import load_spec
from sweep.spec.study import parse_spec
from tests.design.test_senses import REMEMBERS

SPEC = """\
study: my/wind
model: nguyen2024
preset: as_written
fixed: {{n: 5, steps: 2, map: empty, {settings}}}
replicates: 1
record: {{metrics: [speed]}}
"""


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ("wind_x: .inf", "spec.yaml:4: wind and gusts must be finite"),
        ("gust: 1e300", "spec.yaml:4: wind and gusts must be finite"),
        ("gust: -1", "spec.yaml:4: -1 is not allowed for gust"),
        ("gust_time: -1", "spec.yaml:4: -1 is not allowed for gust_time"),
        ("borders: torus, width: 100, wind_x: -101", "move a boid in one step"),
        ("borders: bounded, height: 100, gust: 10.1", "a boid in one step by more"),
    ],
)
def test_a_wind_that_cannot_be_is_refused(settings: str, said: str) -> None:
    with pytest.raises(SpecError) as error:
        expand(parse_spec(SPEC.format(settings=settings)))
    assert said in str(error.value)


@pytest.mark.parametrize(
    "settings",
    [
        "gust: 1, gust_time: .inf",
        "borders: open, width: 100, wind_x: -101",
        "borders: torus, width: 100, height: 100, wind_x: -50, gust: 5",
    ],
)
def test_a_wind_that_can_be_is_not(settings: str) -> None:
    assert expand(parse_spec(SPEC.format(settings=settings))).n_points == 1


@pytest.mark.parametrize("name", ["wind_x", "wind_y", "gust"])
def test_a_model_that_does_not_publish_is_told_which_line_to_change(
    name: str, tmp_path: Path
) -> None:
    """Without a wind it flies as before."""
    (tmp_path / "vortex.py").write_text(REMEMBERS, encoding="utf-8")
    path = tmp_path / "spec.yaml"
    text = "study: my/a\nmodel: ./vortex.py\nfixed: {%s}\nreplicates: 1\n"
    path.write_text(text % "gust_time: 3", encoding="utf-8")
    expand(load_spec(path))
    path.write_text(text % f"{name}: 1", encoding="utf-8")
    with pytest.raises(SpecError) as error:
        expand(load_spec(path))
    said = str(error.value)
    assert f"spec.yaml:3: {name} needs a model that lets the wind carry" in said
    assert "write publish(flock, others, work) for remember(flock, others)" in said
