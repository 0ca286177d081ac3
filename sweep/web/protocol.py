"""The messages between the page and the session behind the page.

Messages are JSON texts in each direction, and binary frames to the page.
Each message from the page has a `type`, the keys of its class, and an `id`. The state
that answers a message, or the error that rejects a message, repeats this `id` under
`answers`. So the page knows whether a state is older than the last message. Only hello
and ready have no answer of this kind. A message may have a `side` too: the number, 0 or
1, of the run among two runs side by side. Messages about the second run have side 1.

From the page:

- `hello page yaml point replicate yaml_beside point_beside replicate_beside kept_study
  kept_trial study trial beside`: the first message. The answer is controls, scene,
  state, metrics and a frame. The keys from yaml to kept_trial repeat the last `kept`,
  for a page after the end of a session. The keys study and trial name a stored trial to
  play; beside names a second trial, which is played next to the first.
- `set name value part`: a parameter, or `seed`; an infinite number is the string "inf"
- `model model preset`: another model, from the first step
- `trial point replicate`: another trial of the opened spec, by the two numbers
- `value name value`: the point at which a varying parameter has a value
- `run`, `pause`, `reset`, `continue`: continue makes a run that has ended twice as long
- `step count`
- `speed steps_per_second`: 0 is as fast as possible
- `shapes shapes part`: replaces all obstacles, in the form of a spec; [] is an empty
  world
- `goal x y index part`: index is the number of a goal, from 0; part: the gesture
  continues
- `select boid`: null for no boid
- `overlays names`: of flocks, coverage, accelerations
- `metrics names`: the plotted metrics
- `sweep name low high points`: a parameter that the copied spec sweeps; off: true ends
  the sweep
- `spec`: answered by spec: yaml, trial, exact, note
- `keep`: answered by kept: yaml, point, replicate. For two runs, kept also has the keys
  of the second run; for a stored trial, kept_study and kept_trial, as in hello
- `export kind`: png, svg, gif, mp4 or html; answered by file: name, mime, data (base64)
- `stop`: the file that is being made is no longer wanted
- `origin`: answered by origin: name, trial, about. The message is for files that the
  page saves without the server: an image of the frame, or a table
- `ready`: the last frame is drawn and the next frame may come
- `seek frame`: a step of the past, or of a stored trial
- `undo`, `redo`: the last edit
- `beside preset`: a second run next to this run. With a preset the two runs begin at
  the start; without a preset the second run is a copy, from here on
- `alone`: only this run of two runs

To the page:

- `controls model models preset others groups maps metrics overlays trials`: see
  sweep.web.controls. trials is null or the opened spec: {study, points, replicates,
  axes}. Each axis has name, values and follows; values is empty for many values, and
  follows names the axis on which the value depends, or is empty
- `state run model preset settings changed shapes seed running speed step steps past
  undo redo exact note sweeps follows selected overlays plots trial files replay ended
  answers`:

  * run is another number for each run; the frames that follow belong to this run
  * past is [first, last], the steps that can be reached
  * follows has the parameters that follow from other parameters, and the names of these
  * undo and redo have the edit in words
  * ended, for two runs, is the reason why a run has ended
  * files has the kinds of file that cannot be made, and the reasons
  * infinite parameters are the string "inf"
  * replay is null or {study, trial, frames, equal}
  * trial is null or the shown trial of the opened spec: {point, replicate, values}
- `scene width height borders length time downwards obstacles paths goal next_goals
  kinds`:

  * obstacles are [x, y, half_width, half_height, 1 for a disc]. A polygon, in the form
    of a spec, follows the numbers of the enclosing rectangle. Obstacles of built-in
    maps are included
  * paths is null, or {velocities, dt, wraps} for moving obstacles
  * goal is [x, y, radius], next_goals are [x, y] each
  * kinds are [name, number of boids], in the order of boids
- `metrics steps values restarts reset`: the values since the last metrics message, of
  the steps that were measured. The steps may be earlier than known steps. With reset:
  true the page forgets the earlier values; null is NaN, or a metric not measured.
  restarts has, for each metric of visits, the steps at which the visits restart from 0
- `selection boid x y range fov heading neighbours`: heading in radians from +x towards
  +y, null where the boid sees all round; boid is null without a selected boid
- `rules names`: the rules of the accelerations in the frames that follow
- `progress kind doing share`: the progress of the file of the run with this side: the
  work, and the finished fraction, from 0 to 1. The key kind is null for a finished or
  stopped file
- `spec`, `kept`, `file`, `origin`: as above
- `anew`: the next messages are about new runs: a single run, or two runs
- `error message answers`
- `info message`: a text on the wait of the page, until the next state

Two frames side by side are the bytes BSF2, the u32 size of the first frame, and the two
frames. A frame is little endian. A frame begins with the bytes BSF1, u32 flags,
u32 step, u32 n. Then come f32 x0, y0, x1, y1, the corners of a box. The box contains
the world, and as much around the world as boids need, but on each side no more than the
size of the world. Positions are u16 x[n], u16 y[n], from 0 at x0, y0 to 65535 at x1,
y1. A boid outside the box is put on the border of the box. Then come u8 heading[n] (256
a full turn, 0 along +x, towards +y), and padding to 4 bytes. Each flag adds a section,
in this order, padded to 4 bytes:

- `1 flocks u16 flock[n]`: the smallest index of a boid of the flock modulo 65535; 65535
  for a boid that is alone
- `2 accelerations u32 rules`, then for each rule `f32 ax[n], f32 ay[n]`
- `4 coverage u32 rows, u32 columns, u8 shares[rows * columns]`: the visited fraction of
  each cell; 254 means fully visited, 255 an obstacle. The section is sent a few times
  per second; until the next section the page shows the last section
"""

import json
import math
from collections.abc import Callable
from dataclasses import MISSING
from dataclasses import fields as members
from typing import Any, get_type_hints

from sweep.spec import Value
from sweep.text import unknown
from sweep.web.messages import MESSAGES, Message, Names, Whole, Yaml
from sweep.web.state import Shape

MOST_BYTES = 2**20
"""The largest message, in bytes, that is read from the page."""
MOST_CHARACTERS = 200
OVERLAYS = ("flocks", "coverage", "accelerations")

Reply = dict[str, Any]


class MessageError(ValueError):
    """A mistake in a message of the page, in a sentence, with the message's `id`."""

    id = ""


def parse(text: str) -> Message:
    """Return the message of a JSON text from any sender.

    Raises MessageError if the text is not a message.
    """
    try:
        content = json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError):
        raise MessageError("a message must be JSON") from None
    if not isinstance(content, dict) or not isinstance(content.get("type"), str):
        raise MessageError('a message must be an object with a "type"')
    try:
        return _message(content.pop("type"), content)
    except MessageError as error:
        message_id = content.get("id")
        error.id = message_id if isinstance(message_id, str) else ""
        raise


def _message(name: str, content: dict[str, Any]) -> Message:
    if name not in MESSAGES:
        raise MessageError(unknown("message", name, MESSAGES))
    kind = MESSAGES[name]
    hints = get_type_hints(kind, include_extras=True)
    for key in content:
        if key not in hints:
            raise MessageError(unknown(f"key of {name}", key, hints))
    for member in members(kind):
        if member.name not in content and member.default is MISSING:
            raise MessageError(f'{name}: missing key "{member.name}"')
    return kind(
        **{
            key: _read(f"{name}: {key}", hints[key], value)
            for key, value in content.items()
        }
    )


def write(reply: Reply) -> str:
    """Return the JSON text of a reply.

    Infinite parameters are already strings in the reply, and null means NaN.
    """
    return json.dumps(reply, allow_nan=False, separators=(",", ":"))


def plain(value: Value) -> Value:
    """Return a parameter value for JSON: an infinite number as the string inf."""
    return "inf" if isinstance(value, float) and math.isinf(value) else value


def _refuse(constant: str) -> None:
    raise ValueError(constant)


def _read(where: str, hint: Any, value: Any) -> Any:
    try:
        return READERS[hint](value)
    except (TypeError, ValueError) as error:
        raise MessageError(f"{where} must be {error}") from None


def _text(value: Any) -> str:
    if not isinstance(value, str) or len(value) > MOST_CHARACTERS:
        raise ValueError(f"a string of at most {MOST_CHARACTERS} characters")
    return value


def _yaml(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError("a string")
    return value


def _number(value: Any) -> float:
    if (
        isinstance(value, bool)
        or not isinstance(value, int | float)
        or not abs(value) <= 1e300
    ):
        raise ValueError("a finite number")
    return float(value)


def _whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**63:
        raise ValueError("an integer from 0")
    return value


def _whole_or_none(value: Any) -> int | None:
    return None if value is None else _whole(value)


def _truth(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError("true or false")
    return value


def _value(value: Any) -> Value:
    if isinstance(value, str) and value != "inf":
        return _text(value)
    if isinstance(value, bool):
        return value
    if isinstance(value, int) and abs(value) < 2**63:
        return value
    return math.inf if value == "inf" else _number(value)


def _names(value: Any) -> Names:
    if not isinstance(value, list) or len(value) > MOST_CHARACTERS:
        raise ValueError("a list of names")
    return tuple(dict.fromkeys(map(_text, value)))


def _shapes(value: Any) -> list[Shape]:
    """Check only the list. The shapes are checked at the placement."""
    if not isinstance(value, list):
        raise ValueError("a list of shapes")
    return value


READERS: dict[Any, Callable[[Any], Any]] = {
    str: _text,
    Yaml: _yaml,
    float: _number,
    bool: _truth,
    Whole: _whole,
    Whole | None: _whole_or_none,
    Value: _value,
    Names: _names,
    list[Shape]: _shapes,
}
