"""axe-core, which many projects check their pages with, finds nothing on ours."""

import json
from collections.abc import Callable

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page

from tests.web.chromium import Opened
from tests.web.test_access import everything_open

Open = Callable[..., Opened]


def found(page: Page, part: str = "html") -> list[str]:
    """Each rule that a part of the page breaks, and where."""
    violations = Axe().run(page, context=part).response["violations"]
    return [
        f"{one['id']} ({one['help']}): {node['html'][:160]} {json.dumps(node['any'])}"
        for one in violations
        for node in one["nodes"]
    ]


@pytest.mark.parametrize(
    ("scheme", "width"),
    [
        pytest.param("light", 1280, marks=pytest.mark.smoke),
        *(("light", 390), ("dark", 1280), ("dark", 390)),
    ],
)
def test_axe_finds_nothing_whatever_is_open(
    opened: Open, scheme: str, width: int
) -> None:
    page = opened()
    page.page.emulate_media(color_scheme=scheme)
    page.page.set_viewport_size({"width": width, "height": 844})
    everything_open(page)
    assert found(page.page) == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_axe_finds_nothing_in_panels_and_dialogs(
    opened: Open, scheme: str, width: int
) -> None:
    page = opened()
    page.page.emulate_media(color_scheme=scheme)
    page.page.set_viewport_size({"width": width, "height": 844})
    everything_open(page)
    page.ask("boidsweep.view.panels.choose('watch')")
    assert found(page.page) == []
    for opener in ("Keys", "Choose metrics", "Copy as spec"):
        page.page.get_by_role("button", name=opener).click()
        page.until("document.querySelector('dialog[open]')")
        assert found(page.page, "dialog[open]") == []
        page.page.keyboard.press("Escape")
    page.page.get_by_role("button", name="Export").click()
    assert found(page.page, ".top") == []
    page.page.keyboard.press("Escape")
    page.page.keyboard.press("p")
    assert found(page.page) == []
    page.page.keyboard.press("p")


def test_axe_finds_what_is_wrong(opened: Open) -> None:
    page = opened(locale="en-GB")  # a page of its own
    page.ask("document.querySelector('.run button').removeAttribute('aria-label')")
    page.ask("document.querySelector('.run button').removeAttribute('title')")
    (wrong,) = found(page.page)
    assert wrong.startswith("button-name")
