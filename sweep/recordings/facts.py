"""Facts of a recording: a text, and the model that plays the recording.

The text has all facts of a recording except the frames. The store keeps the text like
the text of custom code, so that tables need no files. Workers read the text.
"""

import json
import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

from kernels.model import WORKING, Event, Model
from kernels.playback import recorded_model
from sweep.spec import NAME, RECORDING

SUFFIX = ".recording"
"""Ending of the text in the list of the files of a study."""
SHA = re.compile("[0-9a-f]{64}")


def _is_valid(event: Event, kinds: Sequence[str]) -> bool:
    """Return whether an event can come from files: a stored text may be a stranger's.

    The hash is part of a path, and kernels read as many values as there are boids.
    """
    numbers = (event.boids, event.steps, *event.kinds)
    shares = (event.interpolated, event.absent)
    return (
        isinstance(event.name, str)
        and isinstance(event.sha, str)
        and SHA.fullmatch(event.sha) is not None
        and all(type(number) is int and number >= 0 for number in numbers)
        and all(isinstance(share, float) and 0.0 <= share <= 1.0 for share in shares)
        and all(isinstance(name, str) for name in event.individuals)
        and len(event.individuals) == event.boids
        and event.boids > 0
        and event.steps > 0
        and (len(event.kinds), sum(event.kinds) or event.boids)
        == (len(kinds), event.boids)
        and all(NAME.fullmatch(kind) and kind != WORKING for kind in kinds)
    )


@lru_cache(maxsize=64)
def as_model(text: str) -> Model:
    """Return the model that plays a recording, from the text of the recording.

    Raises ValueError if the text is not valid.
    """
    try:
        facts: Mapping[str, Any] = json.loads(text)
        events = tuple(map(Event.read, facts["events"]))
        kinds = tuple(map(str, facts["kinds"]))
        if not events or not all(_is_valid(event, kinds) for event in events):
            raise ValueError("the text of a recording lists events that are not valid")
        return recorded_model(
            RECORDING,
            source=str(facts["source"]),
            events=events,
            preset={name: facts[name] for name in ("dt", "width", "height")},
            kinds=kinds,
            length=str(facts["length"]),
            time=str(facts["time"]),
        )
    except (TypeError, KeyError, IndexError, RecursionError) as error:
        raise ValueError(f"the text of a recording is not valid: {error}") from None
