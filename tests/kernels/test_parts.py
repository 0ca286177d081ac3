"""Metrics of one kind of boids, and of those that have not failed, against metrics of
flocks that have no others.
"""

import numpy as np
import pytest

from kernels.catalogue import BUILT_IN
from kernels.flight import measure
from kernels.identity import code_of
from kernels.metrics import METRICS
from kernels.metrics.parts import has_parts
from kernels.recording import FILLED
from sweep.errors import SpecError
from sweep.spec.recorded import names_of_parts
from sweep.spec.study import parse_spec as parse
from sweep.trial.simulation import Simulation, run
from tests import builders
from tests.interpreter import interpreted

HERD = {"n": 12, "steps": 6}
WHOLE = [name for name, metric in METRICS.items() if has_parts(metric)]
FITTING = [name for name in WHOLE if not METRICS[name].potential]


def herd(**changes: object) -> Simulation:
    """Sheep and their dog, at the end of a flight all of whose frames are there."""
    job = builders.job("strombom2014", metrics=("speed",), **HERD | changes)
    return builders.to_end(Simulation(job))


def values(simulation: Simulation, name: str) -> np.ndarray:
    return measure(simulation.flight, [METRICS[name]])[0]


@pytest.mark.parametrize("name", FITTING)
def test_a_metric_of_a_kind_is_that_of_a_flock_without_the_others(name: str) -> None:
    """To the last bit, of each kind: the same boids in frames of their own."""
    flown = herd()
    flight, kinds = flown.flight, flown.flight.ground.kind
    for index, kind in enumerate(("sheep", "dog")):
        alone = np.flatnonzero(kinds == index)
        frames = flight.record.frames
        own = frames._replace(bodies=np.ascontiguousarray(frames.bodies[:, :, alone]))
        ground = flight.ground._replace(boids=alone.size, kind=kinds[alone])
        expected = np.full(flown.flight.filled, np.nan)
        METRICS[name].measure(
            own, flown.flight.filled, ground, flight.observation, expected
        )
        found = values(flown, f"{name}_of_{kind}")
        np.testing.assert_array_equal(found, expected)


def test_the_dog_is_no_sheep_of_the_herd() -> None:
    """The radius of the sheep is that which the herd has."""
    flown = herd()
    sheep = values(flown, "flock_radius_of_sheep")
    np.testing.assert_allclose(sheep, values(flown, "herd_radius"), rtol=1e-12)
    assert (values(flown, "flock_radius_of_dog") == 0.0).all()


SOME = "polarization", "speed", "nearest_neighbour_distance"


@pytest.mark.slow
@pytest.mark.parametrize("name", SOME)
def test_those_that_have_failed_do_not_count_from_then_on(name: str) -> None:
    """Half of the boids stop in step 4: from the frame after it on, the metric is that
    of the others alone. Before, it is that of all.
    """
    job = builders.job(
        "nguyen2024",
        **{"n": 12, "steps": 9, "failing_share": 0.5, "failing_how": "stop"},
        failing_time=3.0 * builders.job("nguyen2024").settings["dt"],
        metrics=("speed",),
    )
    flown = builders.to_end(Simulation(job))
    bodies = builders.trajectory(flown)
    standing = (bodies[-1, 2:4] == 0.0).all(axis=0)
    assert standing.sum() == 6
    steps = flown.flight.record.frames.step[: flown.flight.filled]
    working, every = values(flown, f"{name}_of_working"), values(flown, name)
    assert (working[steps <= 3] == every[steps <= 3]).all()
    left = flown.flight.record.frames
    own = left._replace(bodies=np.ascontiguousarray(left.bodies[:, :, ~standing]))
    ground = flown.flight.ground._replace(boids=6)
    expected = np.full(len(steps), np.nan)
    METRICS[name].measure(own, len(steps), ground, flown.flight.observation, expected)
    np.testing.assert_array_equal(working[steps > 3], expected[steps > 3])
    assert (working[steps > 3] != every[steps > 3]).all()


@pytest.mark.parametrize("name", SOME)
def test_they_do_not_in_the_interpreter(name: str) -> None:
    """Where no model has to be compiled for boids that fail."""
    interpreted(
        "from tests.kernels import test_parts as t\n"
        f"t.test_those_that_have_failed_do_not_count_from_then_on({name!r})"
    )


@pytest.mark.slow
def test_a_part_without_boids_has_no_value() -> None:
    flown = herd(failing_share=1.0, failing_how="blind")
    assert np.isnan(values(flown, "speed_of_working")[1:]).all()
    flown.flight.record.progress[FILLED] = 0
    assert values(flown, "speed_of_working").shape == (0,)


def test_a_trial_records_parts_like_any_metric() -> None:
    names = "polarization_of_sheep", "speed_of_working"
    result = run(
        builders.job("strombom2014", metrics=names, series=names, every=2, **HERD)
    )
    assert result.status == "done"
    assert all(np.isfinite(result.series[name]).all() for name in names)


def test_a_part_has_an_identity_of_its_own() -> None:
    names = ["speed", "speed_of_sheep", "speed_of_working"]
    stamps = code_of(BUILT_IN, [], names, [], []).metrics
    assert len(set(stamps.values())) == 3
    assert "" not in stamps.values()


def test_only_metrics_that_look_at_all_boids_alike_have_parts() -> None:
    assert "polarization" in WHOLE
    none = {"escapes", "coverage", "herd_radius", "fissions", "control_effort"}
    assert none.isdisjoint(WHOLE)
    for name in ("escapes_of_working", "speed_of_light", "speed_of_sheep_of_dog"):
        assert name not in METRICS
        with pytest.raises(KeyError, match=name):
            METRICS[name]
    assert "speed_of_sheep" not in list(METRICS)


def test_the_names_of_parts_are_those_of_a_model() -> None:
    herd, plain = (
        names_of_parts(BUILT_IN.models[name], BUILT_IN)
        for name in ("strombom2014", "nguyen2024")
    )
    assert plain == [f"{name}_of_working" for name in WHOLE]
    assert len(herd) == 3 * len(WHOLE)
    assert all(name in METRICS for name in herd)


SPEC = "study: herds\nmodel: {}\nfixed: {{steps: 2}}\nreplicates: 1\nrecord: {}\n"


def test_a_spec_names_parts_and_computes_with_them() -> None:
    record = "{series: [speed_of_dog], derive: {gap: speed_of_dog - speed_of_sheep}}"
    study = parse(SPEC.format("strombom2014", record))
    assert {"speed_of_dog", "speed_of_sheep", "gap"} < {*study.record.names}
    assert study.record.derive[0].unit == "m/step"


@pytest.mark.parametrize(
    ("model", "metric", "said"),
    [
        ("nguyen2024", "speed_of_sheep", "with the kind sheep. Allowed: strombom"),
        ("strombom2014", "speed_of_shep", 'did you mean "speed_of_sheep"'),
        ("strombom2014", "escapes_of_dog", 'unknown metric "escapes_of_dog"'),
    ],
)
def test_what_a_model_cannot_have_is_refused(
    model: str, metric: str, said: str
) -> None:
    with pytest.raises(SpecError, match=said):
        parse(SPEC.format(model, f"{{metrics: [{metric}]}}"))


def test_no_derived_metric_takes_the_name_of_a_part() -> None:
    taken = "{derive: {speed_of_working: 2 * speed}}"
    with pytest.raises(SpecError, match="a metric already has this name"):
        parse(SPEC.format("nguyen2024", taken))
    free = parse(SPEC.format("nguyen2024", "{derive: {speed_of_light: 2 * speed}}"))
    assert free.record.derive[0].name == "speed_of_light"


def test_no_kind_is_called_working() -> None:
    from kernels.model import flaw

    model = BUILT_IN.models["strombom2014"]
    assert not flaw(model)
    said = flaw(model._replace(kinds=("sheep", "working")))
    assert "no kind can be called" in said
