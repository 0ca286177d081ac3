"""The types of the page's scripts: what page and session really say is of these types.

deno checks a script in which messages stand as literals. There a key that is missing,
that has another type, or that the types do not know is an error, and so is a message
that nobody says.
"""

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path
from string import Template
from typing import Any

import pytest
from deno import find_deno_bin

from kernels.models import MODELS
from sweep.spec.study import parse_spec
from sweep.web import messages
from sweep.web.filing import untold
from sweep.web.flight import fly
from sweep.web.history import Cursor
from sweep.web.live_show import Live
from sweep.web.messages import MESSAGES
from sweep.web.page import STATIC
from sweep.web.protocol import OVERLAYS, Reply
from sweep.web.recording import recording_of
from sweep.web.replaying import Replay
from sweep.web.state import begin, from_study
from sweep.web.twin import Twin
from tests import ROOT
from tests.patience import PATIENCE
from tests.specs import GAINS
from tests.studies import SMALL, launched
from tests.web.test_protocol import DISC, RIGHT
from tests.web.test_recording import data_of

CONFIG = ROOT / "deno.jsonc"
SCRIPT = Template("""
import type { Message, RecordedPage, Reply } from "$types";
export const messages: Message[] = $messages;
export const every_message: Record<Message["type"], true> = $every_message;
export const replies: Reply[] = $replies;
export const every_reply: Record<Reply["type"], true> = $every_reply;
export const recording: RecordedPage = $recording;
""")
UNASKED: list[Reply] = [
    {"type": "error", "message": "no", "answers": "1"},
    {"type": "error", "message": "a message must be JSON"},
    {"type": "info", "message": "well"},
    {"type": "progress", "kind": "gif", "doing": "drawn", "share": 0.25},
    {"type": "progress", "kind": None, "doing": "", "share": 1.0},
    {"type": "anew"},
]
"""What sweep.web.playing says by itself."""


def replies(results: Path) -> Iterator[Reply]:
    """All that is said to a page: of each model, and of a stored trial."""
    for name, model in MODELS.items():
        show = Live(begin(name, next(iter(model.presets))))
        yield from show.greeting()
        yield from show.handle(messages.Overlays(OVERLAYS))
        yield from show.handle(messages.Select(3))
        yield from show.handle(messages.Sweep("n", 10, 20, 3))
        yield from show.handle(messages.Shapes([DISC]))
        yield from show.handle(messages.Spec())
        yield from show.handle(messages.Keep())
        yield from show.handle(messages.Origin())
        yield from show.news(Cursor())[0]
        yield show.selection()
    yield show.export("png")(untold)
    yield from Live(from_study(parse_spec(GAINS))).greeting()
    study = launched(SMALL, results)
    trial = str(study.trials["trial_id"][0])
    yield from Replay(study, trial).greeting()
    yield from Twin(show, show.beside("as_run")).greeting()
    yield show.status() | {"answers": "1"}
    yield from UNASKED


def recording() -> dict[str, Any]:
    """What a page that plays a run from disk reads."""
    state = begin("nguyen2024", "as_run").with_settings({"n": 5, "steps": 3})
    flight = fly("study", state.job, state.plots)
    return data_of(
        recording_of(flight, Live(state).greeting(), state.as_text()).content
    )


@pytest.mark.slow
def test_messages_are_of_the_types_by_which_the_page_is_checked(tmp_path: Path) -> None:
    said = list(replies(tmp_path))
    script = tmp_path / "said.ts"
    text = SCRIPT.substitute(
        types=STATIC / "protocol.d.ts",
        messages=json.dumps([message | {"id": "1"} for message, _ in RIGHT]),
        every_message=json.dumps(dict.fromkeys(MESSAGES, True)),
        replies=json.dumps(said),
        every_reply=json.dumps({reply["type"]: True for reply in said}),
        recording=json.dumps(recording()),
    )
    script.write_text(text)
    done = subprocess.run(
        [find_deno_bin(), "check", "--quiet", "--config", CONFIG, script],
        env={"DENO_DIR": str(tmp_path / "deno"), "NO_COLOR": "1"},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 0, done.stderr[:4000]
