"""One server for all tests of the page in a worker; a page, and a session of its own,
for each test.
"""

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from sweep.web.server import PageServer
from tests.web.chromium import Opened, running_server


@pytest.fixture(scope="session")
def server() -> Iterator[PageServer]:
    with running_server() as server:
        yield server


@pytest.fixture(scope="session")
def shared() -> list[Opened]:
    """Room for the page that tests have in common."""
    return []


@pytest.fixture
def opened(
    browser: Browser, server: PageServer, shared: list[Opened]
) -> Iterator[Callable[..., Opened]]:
    """Opens pages: the common one, begun anew, or one of its own for who asks for
    something else.

    Afterwards it sees that none of them has met an error in its script or has broken
    its own rules.
    """
    used: list[Opened] = []

    def opened(at: PageServer = server, **about: Any) -> Opened:
        if at is server and not about and shared:
            used.append(shared[0].begin_anew())
            return used[-1]
        context = browser.new_context(
            **{"viewport": {"width": 1280, "height": 720}, **about}
        )
        context.grant_permissions(["clipboard-read", "clipboard-write"])
        used.append(Opened(context.new_page(), at))
        if at is server and not about:
            shared.append(used[-1])
        return used[-1]

    yield opened
    complaints = [complaint for one in used for complaint in one.complaints]
    for one in used:
        if one in shared:
            one.rest()
        else:
            one.page.context.close()
    assert complaints == []


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """A page of its own, for any address, in which nothing goes wrong."""
    complaints: list[str] = []
    page = browser.new_context(viewport={"width": 1300, "height": 900}).new_page()
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on(
        "console",
        lambda said: complaints.append(said.text) if said.type == "error" else None,
    )
    yield page
    page.context.close()
    assert complaints == []
