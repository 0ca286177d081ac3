"""Settings take values of their type and range only, one at a time and by the column
alike.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernels.catalogue import BUILT_IN
from kernels.models import MODELS
from sweep.spec.settings import (
    NotAllowedError,
    Setting,
    preset_settings,
    settings_of,
    spelled,
)

SETTINGS = settings_of("nguyen2024", BUILT_IN)
NUMBERS = st.one_of(
    st.floats(),
    st.integers(-(2**40), 2**40),
    st.sampled_from([0.0, -0.0, 1, 0.5, math.inf]),
)


@pytest.mark.parametrize("model", MODELS)
def test_every_preset_is_allowed(model: str) -> None:
    for preset in MODELS[model].presets:
        assert set(preset_settings(model, preset, BUILT_IN)) == set(
            settings_of(model, BUILT_IN)
        )


def test_equal_numbers_are_the_same_value() -> None:
    assert repr(SETTINGS["drag"].coerce(1)) == "1.0"
    assert repr(SETTINGS["drag"].coerce(-0.0)) == "0.0"
    assert repr(SETTINGS["n"].coerce(2.0)) == "2"


def is_allowed(setting: Setting, number: float) -> bool:
    try:
        setting.coerce(number)
    except NotAllowedError:
        return False
    return True


@settings(deadline=None)
@given(
    st.sampled_from(["drag", "n", "width", "n_obstacles", "footprint_radius"]),
    st.lists(NUMBERS, min_size=1),
)
def test_column_agrees_with_single_values(name: str, numbers: list[float]) -> None:
    setting, array = SETTINGS[name], np.array(numbers)
    allowed = [is_allowed(setting, number) for number in array.tolist()]
    if all(allowed):
        expected = [setting.coerce(number) for number in array.tolist()]
        assert list(map(repr, setting.column(array).tolist())) == list(
            map(repr, expected)
        )
    else:
        with pytest.raises(NotAllowedError) as error:
            setting.column(array)
        assert error.value.index == allowed.index(False)


def test_units_are_those_of_the_model(monkeypatch: pytest.MonkeyPatch) -> None:
    assert (
        SETTINGS["width"].unit,
        SETTINGS["start_speed"].unit,
        SETTINGS["footprint_radius"].unit,
    ) == (
        "px",
        "px/step",
        "pixels",
    )
    monkeypatch.setitem(
        MODELS, "metric", MODELS["nguyen2024"]._replace(length="m", time="s")
    )
    assert settings_of("metric", BUILT_IN)["start_speed"].unit == "m/s"
    assert (
        spelled("length/time^2 at times of any lengths", MODELS["metric"])
        == "m/s^2 at times of any lengths"
    )


def test_error_names_the_first_wrong_value() -> None:
    with pytest.raises(NotAllowedError) as error:
        SETTINGS["map"].column(["empty", "cafeteria", "nowhere", "elsewhere"])
    assert error.value.index == 2
    assert str(error.value).startswith('unknown map "nowhere". Allowed: ')
