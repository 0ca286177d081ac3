"""Settings of sensing that do not go together are refused, with the line, what was
given and what is allowed.
"""

from pathlib import Path

import pytest

from sweep.design.design import expand
from sweep.errors import SpecError
from sweep.own_code.reading import load_spec
from sweep.spec.study import parse_spec
from tests.studies import SMALL


def spec(settings: str) -> str:
    return SMALL.replace("n: 12", f"n: 12, {settings}")


def refused(text: str) -> str:
    """The message with which a design is refused."""
    with pytest.raises(SpecError) as error:
        expand(parse_spec(text))
    return str(error.value)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (
            "dt: 0.3, sensing_delay: 1",
            "sensing_delay = 1 is not a multiple of dt (use 0.9 or 1.2)"
            " where dt = 0.3, sensing_delay = 1.0",
        ),
        ("sensing_period: 2.5", "sensing_period = 2.5 is not a multiple of dt"),
        ("position_noise: .inf", "position_noise must be finite"),
        ("sensing_delay: .inf", "sensing_delay must be finite"),
        (
            "dt: 0.1, sensing_period: 1e308",
            "sensing_period must be at most 2^53 steps of dt, 9.00719925474e+14, not"
            " 1e+308",
        ),
        ("sensing_delay: 1e300", "sensing_delay must be at most 2^53 steps of dt"),
        (
            "sensing_delay: 1000000",
            "messages in transit between 12 boids need more than 256 MiB; allowed:"
            " sensing_delay up to 699049",
        ),
        (
            "noise_form: coupled, position_noise: 1",
            "coupled errors need position_noise, velocity_noise and noise_time above 0",
        ),
        ("occlusion: both", "occlusion by boids needs a body_radius above 0"),
    ],
)
def test_senses_that_cannot_be_are_refused(settings: str, said: str) -> None:
    assert refused(spec(settings)).startswith(f"spec.yaml:5: {said}")


@pytest.mark.parametrize(
    "settings",
    [
        "dt: 0.1, sensing_delay: 0.7, sensing_period: 0.3",
        "position_noise: 1, noise_time: .inf",
        "sensing_delay: 699049",
        (
            "noise_form: coupled, position_noise: 1, velocity_noise: 2, noise_time: 1,"
            " own_noise: shared"
        ),
        "packet_loss: 1, occlusion: both, body_radius: 1",
    ],
)
def test_senses_that_can_be_are_not(settings: str) -> None:
    """0.7 and 0.3 are no multiples of 0.1 to the last bit."""
    assert expand(parse_spec(spec(settings))).n_points > 0


REMEMBERS = Path("examples/vortex.py").read_text()
for old, new in (
    ("others_of(flock, work, False)", "work.before"),
    ("publish(flock, others, work)", "remember(flock, others)"),
    ("from kernels.robots.sensing import others_of, publish\n", ""),
    ("import Flock, World\n", "import Flock, World, remember\n"),
):
    assert REMEMBERS.count(old) == 1, old
    REMEMBERS = REMEMBERS.replace(old, new)


@pytest.mark.parametrize(
    "call", ["seen=others, flock=flock", "flock, seen=others", "flock, others"]
)
def test_the_line_is_told_however_it_gives_its_arguments(
    call: str, tmp_path: Path
) -> None:
    model, path = tmp_path / "vortex.py", tmp_path / "spec.yaml"
    model.write_text(REMEMBERS.replace("remember(flock, others)", f"remember({call})"))
    path.write_text(
        "study: my/a\nmodel: ./vortex.py\nfixed: {failing_share: 0.5,"
        " failing_how: blind, failing_time: 1}\nreplicates: 1\n"
        "record: {metrics: [speed]}\n"
    )
    with pytest.raises(SpecError) as error:
        expand(load_spec(path))
    said = str(error.value)
    assert "spec.yaml:3: failing_share needs a model that counts its steps" in said
    assert f"write publish(flock, others, work) for remember({call})" in said


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ("velocity_noise: 1", "velocity_noise"),
        ("sensing_delay: 1", "sensing_delay"),
        ("sensing_period: 2", "sensing_period"),
        ("radio_range: 100", "radio_range"),
        ("packet_loss: 0.1", "packet_loss"),
        ("occlusion: obstacles", "occlusion"),
    ],
)
def test_a_model_whose_boids_do_not_measure_is_told_which_line_to_change(
    settings: str, named: str, tmp_path: Path
) -> None:
    model = tmp_path / "vortex.py"
    model.write_text(REMEMBERS)
    line = 1 + REMEMBERS[: REMEMBERS.index("remember(flock, ")].count("\n")
    text = f"study: my/a\nmodel: ./vortex.py\nfixed: {{{settings}}}\nreplicates: 1\n"
    text += "record: {metrics: [speed]}\n"
    path = tmp_path / "spec.yaml"
    path.write_text(text)
    with pytest.raises(SpecError) as error:
        expand(load_spec(path))
    said = str(error.value)
    assert f"spec.yaml:3: {named} needs a model with sensing and communication" in said
    assert f"in vortex.py:{line} write publish(flock, others, work) for" in said
