"""A page and the server behind it: the spec that was opened, and what becomes of the
page when its server is started anew.
"""

import json
import socket
from collections.abc import Callable
from contextlib import ExitStack

import pytest

from sweep.errors import ChoiceError
from sweep.own_code.reading import load_spec
from sweep.web.live_show import Live
from sweep.web.messages import Hello
from sweep.web.replaying import Replay
from sweep.web.server import PageServer
from sweep.web.state import from_study
from tests import ROOT, plotted
from tests.web.chromium import Opened, in_a_thread, in_the_cafeteria, running_server

Open = Callable[..., Opened]
STEP = "boidsweep.view.shown"
VIEWED = "JSON.stringify(boidsweep.view.viewed)"
PLACES = "[...boidsweep.view.stage.frame.x, ...boidsweep.view.stage.frame.y]"
SEPARATION = ROOT / "experiments" / "nguyen2024" / "separation.yaml"


def separation() -> Live:
    """The spec of a figure, as `sweep view` opens it."""
    return Live(from_study(load_spec(SEPARATION)))


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def copied(page: Opened) -> str:
    page.page.get_by_role("button", name="Copy as spec").click()
    page.until("document.querySelector('dialog[open] textarea')?.value")
    text = page.page.get_by_label("spec.yaml").input_value()
    page.page.get_by_role("button", name="Close").click()
    return text


def test_any_trial_of_an_opened_spec_is_shown_and_its_text_stays(opened: Open) -> None:
    with running_server(separation) as server:
        page = opened(server)
        assert page.page.title().startswith("nguyen2024/separation, ")
        page.page.get_by_label("separation weight", exact=True).first.select_option("2")
        page.until("boidsweep.view.state.trial.point === 4")
        page.page.get_by_label("replicate", exact=True).fill("16")
        page.page.get_by_label("replicate", exact=True).press("Enter")
        page.until("boidsweep.view.state.trial.replicate === 16")
        assert page.ask("boidsweep.view.state.settings.separation_weight") == 2
        assert "separation weight 2, replicate 16 (of 0 to 399)" in page.page.title()
        assert copied(page) == SEPARATION.read_text()
        page.page.get_by_role("button", name="Copy as spec").click()
        words = (
            "A launch reproduces these frames as point 4 (of 0 to 4), replicate 16 (of"
            " 0 to 399)"
        )
        page.page.get_by_text(words).wait_for()
        assert page.show.state.job.replicate == 16  # type: ignore[attr-defined]
        page.page.context.close()


def test_a_page_goes_on_with_its_spec_when_its_server_is_started_anew(
    opened: Open,
) -> None:
    port = free_port()
    with ExitStack() as first:
        page = opened(first.enter_context(in_a_thread(PageServer(separation, port))))
        url = page.server.url
        page.send(type="trial", point=1, replicate=5)
        page.send(type="set", name="n", value=31)
        page.until("boidsweep.view.memory.read()?.yaml.includes('n: 31')")
        before = page.ask("boidsweep.view.state.settings")
    page.until("boidsweep.view.away && !boidsweep.view.banner.hidden")
    page.page.keyboard.press("Space")
    assert not page.ask("boidsweep.view.state.running")
    assert page.page.locator(".pickers[inert], .run[inert], aside[inert]").count() == 4
    assert "n: 31" in copied(page)
    with in_a_thread(PageServer(in_the_cafeteria, port)) as second:
        assert second.url == url
        page.server = second
        page.until("!boidsweep.view.away && boidsweep.view.banner.hidden")
        page.page.keyboard.press("Space")
        page.until("boidsweep.view.stage.frame.step > 3")
        show = page.show  # of the second server
        assert isinstance(show, Live)
        assert show.status()["settings"] == before
        assert page.ask("boidsweep.view.state.settings") == before
        assert show.state.opened
        assert (show.state.opened.point, show.state.opened.replicate) == (1, 5)
        assert page.page.locator("[inert]").count() == 0
        page.page.context.close()
    # What the browser says of the server that was away.
    page.complaints[:] = [one for one in page.complaints if "WebSocket" not in one]


def test_a_stored_trial_that_was_gone_to_is_shown_again_by_another_server(
    opened: Open,
) -> None:
    study, port = plotted.study("small"), free_port()
    ids = study.trials["trial_id"].tolist()
    trial = "boidsweep.view.state.replay.trial"

    def begin() -> Replay:
        return Replay(study, ids[0])

    with ExitStack() as first:
        page = opened(first.enter_context(in_a_thread(PageServer(begin, port))))
        page.until(f"{trial} === '{ids[0]}'")
        page.send(type="trial", point=1, replicate=2)
        page.until(f"{trial} !== '{ids[0]}'")
        gone_to = page.ask(trial)
        page.until(f"boidsweep.view.memory.read()?.kept_trial === '{gone_to}'")
    page.until("boidsweep.view.away && !boidsweep.view.banner.hidden")
    with in_a_thread(PageServer(begin, port)) as second:
        page.server = second
        page.until("!boidsweep.view.away && boidsweep.view.banner.hidden")
        page.send(type="seek", frame=3)
        page.until("boidsweep.view.stage.frame.step === 3")
        assert page.ask(trial) == gone_to
        assert isinstance(page.show, Replay)
        assert page.show.job.trial_id == gone_to
        page.page.context.close()
    page.complaints[:] = [one for one in page.complaints if "WebSocket" not in one]


def test_what_a_replay_has_kept_is_for_its_own_study_alone() -> None:
    study = plotted.study("small")
    ids = study.trials["trial_id"].tolist()
    show = Replay(study, ids[0])
    show.restore(Hello("page", kept_study="other", kept_trial=ids[1]))
    assert show.job.trial_id == ids[0]
    show.restore(Hello("page", kept_study="small", kept_trial=ids[1]))
    assert show.job.trial_id == ids[1]
    with pytest.raises(ChoiceError, match="unknown trial"):
        show.restore(Hello("page", kept_study="small", kept_trial="0" * 24))
    assert show.job.trial_id == ids[1]
    live = separation()
    before = live.state
    live.restore(Hello("page", kept_study="small", kept_trial=ids[1]))
    assert live.state is before


def test_a_port_that_was_chosen_has_its_address_and_others_a_new_one() -> None:
    port = free_port()
    urls = []
    for _ in range(2):
        server = PageServer(in_the_cafeteria, port)
        urls.append(server.url)
        server.socket.close()
    assert urls[0] == urls[1]
    others = [PageServer(in_the_cafeteria) for _ in range(2)]
    for one in others:
        one.socket.close()
    assert len({one.token for one in others} | {server.token}) == 3


def test_what_cannot_be_shown_any_more_is_said_and_the_page_opens(
    opened: Open,
) -> None:
    with running_server() as server:
        page = opened(server)
        page.page.evaluate(
            "sessionStorage.setItem('boidsweep-kept', JSON.stringify({yaml: 'study: a',"
            " point: '', replicate: 0}));"
            "sessionStorage.setItem('boidsweep-page', 'other')"
        )
        page.page.reload()
        page.until("Boolean(window.boidsweep?.view.stage.frame)")
        toast = page.page.locator(".toast")
        toast.get_by_text("the run that this page has kept cannot be").wait_for()
        assert toast.get_attribute("role") == "alert"
        toast.get_by_role("button", name="Close").click()
        assert toast.count() == 0
        assert page.ask("boidsweep.view.state.model") == "aziel_chen2025"
        page.page.context.close()


def test_a_state_has_an_address_that_opens_it_in_another_window(opened: Open) -> None:
    with running_server(separation) as server:
        page = opened(server)
        page.send(type="trial", point=3, replicate=16)
        page.send(type="set", name="n", value=31)
        page.until("boidsweep.view.memory.read()?.yaml.includes('n: 31')")
        page.send(type="metrics", names=["dispersion"])
        page.send(type="speed", steps_per_second=30)
        page.send(type="select", boid=4)
        page.send(type="step", count=17)
        page.page.get_by_label("flocks").check()
        page.page.get_by_label("headings").check()
        page.until(f"{STEP} === 17 && boidsweep.view.state.overlays.length")
        page.page.get_by_role("button", name="Copy as spec").click()
        page.page.get_by_role("button", name="Copy as link").click()
        page.page.get_by_text("The address of this state").wait_for()
        address = page.ask("navigator.clipboard.readText()")
        assert address.startswith(server.url + "#spec=")
        window = page.page.context.new_page()
        window.goto(address)
        window.get_by_label("replicate", exact=True).wait_for()
        assert window.get_by_label("replicate", exact=True).input_value() == "16"
        shown = window.evaluate("boidsweep.view.state")
        assert (shown["settings"]["n"], shown["trial"]["point"]) == (31, 3)
        window.wait_for_function(f"() => {STEP} === 17")
        assert json.loads(page.ask(VIEWED)) == {
            "step": 17,
            "speed": 30,
            "overlays": ["headings", "flocks"],
            "plots": ["dispersion"],
            "boid": 4,
        }
        window.wait_for_function(f"text => {VIEWED} === text", arg=page.ask(VIEWED))
        assert window.evaluate(PLACES) == page.ask(PLACES)


def test_a_link_of_a_run_that_was_changed_opens_at_its_start(opened: Open) -> None:
    with running_server(separation) as server:
        page = opened(server)
        page.send(type="step", count=5)
        page.until(f"{STEP} === 5")
        page.send(type="set", name="alignment_weight", value=0.25)
        page.until("!boidsweep.view.state.exact")
        page.page.get_by_role("button", name="Copy as spec").click()
        page.page.get_by_role("button", name="Copy as link").click()
        page.page.get_by_text("opens these parameters at step 0").wait_for()
        address = page.ask("navigator.clipboard.readText()")
        assert "step=" not in address
        page.page.context.close()
