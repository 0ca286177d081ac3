"""Messages from anyone: read where they are right, refused in a sentence where they are
not.
"""

import json
import math
from contextlib import suppress
from typing import Any, get_args

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sweep.web import messages
from sweep.web.messages import MESSAGES, Message
from sweep.web.protocol import MessageError, parse, plain, write

DISC = {"disc": {"x": 1, "y": 2, "radius": 3}}
RIGHT: list[tuple[dict[str, Any], Message]] = [
    ({"type": "hello", "page": "a"}, messages.Hello("a")),
    ({"type": "set", "name": "n", "value": 3}, messages.Set("n", 3)),
    ({"type": "set", "name": "fov", "value": 3.5}, messages.Set("fov", 3.5)),
    ({"type": "set", "name": "map", "value": "empty"}, messages.Set("map", "empty")),
    (
        {"type": "set", "name": "start_free", "value": True},
        messages.Set("start_free", True),
    ),
    (
        {"type": "set", "name": "obstacle_range", "value": "inf"},
        messages.Set("obstacle_range", math.inf),
    ),
    (
        {"type": "model", "model": "nanobot", "preset": "as_run"},
        messages.ChooseModel("nanobot", "as_run"),
    ),
    ({"type": "run"}, messages.StartRun()),
    ({"type": "pause"}, messages.Pause()),
    ({"type": "reset"}, messages.Reset()),
    ({"type": "continue"}, messages.Continue()),
    ({"type": "step", "count": 3}, messages.Step(3)),
    ({"type": "step"}, messages.Step(1)),
    ({"type": "speed", "steps_per_second": 0}, messages.Speed(0.0)),
    ({"type": "shapes", "shapes": [DISC]}, messages.Shapes([DISC])),
    ({"type": "goal", "x": 1, "y": 2.5}, messages.Goal(1.0, 2.5)),
    ({"type": "goal", "x": 1, "y": 2, "index": 3}, messages.Goal(1.0, 2.0, 3)),
    ({"type": "select", "boid": 3}, messages.Select(3)),
    ({"type": "select", "boid": None}, messages.Select(None)),
    ({"type": "overlays", "names": ["flocks"]}, messages.Overlays(("flocks",))),
    ({"type": "metrics", "names": ["speed", "speed"]}, messages.Metrics(("speed",))),
    (
        {"type": "sweep", "name": "n", "low": 1, "high": 2, "points": 3},
        messages.Sweep("n", 1.0, 2.0, 3),
    ),
    ({"type": "sweep", "name": "n", "off": True}, messages.Sweep("n", off=True)),
    ({"type": "spec"}, messages.Spec()),
    ({"type": "keep"}, messages.Keep()),
    (
        {"type": "trial", "point": 2, "replicate": 3},
        messages.ShowTrial(2, 3),
    ),
    (
        {"type": "value", "name": "n", "value": 3},
        messages.ShowValue("n", 3),
    ),
    (
        {
            "type": "hello",
            "page": "a",
            "yaml": "a" * 300,
            "point": "b",
            "replicate": 4,
        },
        messages.Hello("a", "a" * 300, "b", 4),
    ),
    ({"type": "export", "kind": "png"}, messages.Export("png")),
    ({"type": "stop"}, messages.StopExport()),
    ({"type": "origin"}, messages.Origin()),
    ({"type": "ready"}, messages.Ready()),
    ({"type": "seek", "frame": 7}, messages.Seek(7)),
    ({"type": "undo"}, messages.Undo()),
    ({"type": "redo"}, messages.Redo()),
    ({"type": "beside", "preset": "as_run"}, messages.Beside("as_run")),
    ({"type": "alone", "side": 1}, messages.Alone(side=1)),
]
WRONG = [
    ("", "a message must be JSON"),
    ("{", "a message must be JSON"),
    ("[" * 100_000, "a message must be JSON"),
    ('{"type": "goal", "x": NaN, "y": 1}', "a message must be JSON"),
    ("7" * 5000, "a message must be JSON"),
    ("[]", 'a message must be an object with a "type"'),
    ('{"type": 7}', 'a message must be an object with a "type"'),
    ('{"type": "rnu"}', 'unknown message "rnu"; did you mean "run"?'),
    ('{"type": "__class__"}', 'unknown message "__class__"'),
    ('{"type": "run", "fast": 1}', 'unknown key of run "fast"'),
    ('{"type": "set", "name": "n"}', 'set: missing key "value"'),
    (
        '{"type": "set", "name": 7, "value": 7}',
        "set: name must be a string of at most 200 characters",
    ),
    (
        '{"type": "set", "name": "n", "value": [1]}',
        "set: value must be a finite number",
    ),
    (
        '{"type": "set", "name": "n", "value": 1e999}',
        "set: value must be a finite number",
    ),
    (
        f'{{"type": "set", "name": "n", "value": {"9" * 400}}}',
        "set: value must be a finite number",
    ),
    (
        json.dumps({"type": "hello", "page": "a" * 201}),
        "hello: page must be a string of at most 200 characters",
    ),
    ('{"type": "step", "count": -1}', "step: count must be an integer from 0"),
    ('{"type": "step", "count": 1.5}', "step: count must be an integer from 0"),
    ('{"type": "step", "count": true}', "step: count must be an integer from 0"),
    ('{"type": "goal", "x": "1", "y": 1}', "goal: x must be a finite number"),
    ('{"type": "shapes", "shapes": {}}', "shapes: shapes must be a list of shapes"),
    (
        '{"type": "overlays", "names": "flocks"}',
        "overlays: names must be a list of names",
    ),
    (
        '{"type": "overlays", "names": [1]}',
        "overlays: names must be a string of at most 200 characters",
    ),
    ('{"type": "sweep", "name": "n", "off": 1}', "sweep: off must be true or false"),
]


@pytest.mark.parametrize(("sent", "message"), RIGHT)
def test_a_message_is_read(sent: dict[str, Any], message: Message) -> None:
    assert parse(json.dumps(sent)) == message


def test_every_message_is_tried() -> None:
    assert (
        {type(message) for _, message in RIGHT}
        == set(MESSAGES.values())
        == set(get_args(Message))
    )


@pytest.mark.parametrize(("sent", "words"), WRONG)
def test_what_is_no_message_is_refused_in_a_sentence(sent: str, words: str) -> None:
    with pytest.raises(MessageError) as refused:
        parse(sent)
    assert str(refused.value).startswith(words)
    assert len(str(refused.value)) < 1000


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.text(max_size=10), inner, max_size=3)
    ),
    max_leaves=5,
)
KEYS = st.sampled_from(
    sorted({key for sent, _ in RIGHT for key in sent if key != "type"})
)


@settings(max_examples=25)
@given(st.sampled_from(sorted(MESSAGES)), st.dictionaries(KEYS, JSON, max_size=4))
def test_anything_is_a_message_or_refused(kind: str, keys: dict[str, Any]) -> None:
    with suppress(MessageError):
        assert isinstance(parse(json.dumps({"type": kind} | keys)), MESSAGES[kind])


def test_replies_are_json_that_every_page_reads() -> None:
    assert json.loads(
        write({"type": "state", "settings": {"range": plain(math.inf), "n": plain(3)}})
    ) == {
        "type": "state",
        "settings": {"range": "inf", "n": 3},
    }
    with pytest.raises(ValueError, match="not JSON compliant"):
        write({"type": "state", "value": math.nan})
