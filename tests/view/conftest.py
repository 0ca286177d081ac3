"""One browser and one server for all tests of the page in a worker; a page, and a session of its own, for each test."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser

from sweep.view.server import Server
from view.chromium import Opened, running_browser, running_server


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    with running_browser() as browser:
        yield browser


@pytest.fixture(scope="session")
def server() -> Iterator[Server]:
    with running_server() as server:
        yield server


@pytest.fixture
def opened(browser: Browser, server: Server) -> Iterator[Callable[..., Opened]]:
    """Opens pages, and sees that none of them has met an error in its script or has broken its own rules."""
    pages: list[Opened] = []

    def opened(width: int = 1280, height: int = 720, at: Server = server, **about: Any) -> Opened:
        context = browser.new_context(viewport={"width": width, "height": height}, **about)
        pages.append(Opened(context.new_page(), at))
        return pages[-1]

    yield opened
    complaints = [complaint for one in pages for complaint in one.complaints]
    for one in pages:
        one.page.context.close()
    assert complaints == []
