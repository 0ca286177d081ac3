"""A page that computes its trials, in Firefox: by the protocol of browsers, WebDriver
BiDi, which it speaks itself.
"""

import asyncio
import json
import subprocess
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from pathlib import Path
from shutil import which
from typing import Any

import pytest
import websockets

from tests.explorer.supplements import FLOWN, written
from tests.patience import PATIENCE
from tests.studies import launched

PATTERN = "WebDriver BiDi listening on "


class Firefox:
    """Firefox with one empty page."""

    def __init__(self, socket: Any) -> None:
        self.socket = socket
        self.ids = count(1)
        self.page = ""

    async def command(self, method: str, **params: Any) -> dict[str, Any]:
        """The result of a command; events meanwhile are left out."""
        number = next(self.ids)
        await self.socket.send(
            json.dumps({"id": number, "method": method, "params": params})
        )
        while (said := json.loads(await self.socket.recv())).get("id") != number:
            pass
        assert said["type"] == "success", said
        result: dict[str, Any] = said["result"]
        return result

    async def open(self, address: str) -> None:
        await self.command("session.new", capabilities={})
        tree = await self.command("browsingContext.getTree")
        self.page = tree["contexts"][0]["context"]
        where = {"context": self.page, "url": address, "wait": "complete"}
        await self.command("browsingContext.navigate", **where)

    async def value(self, function: str) -> Any:
        """What a function of the page returns, waited for."""
        result = await self.command(
            "script.callFunction",
            functionDeclaration=function,
            awaitPromise=True,
            target={"context": self.page},
        )
        return result["result"]["value"]


WAIT = """() => new Promise((done) => {
  const line = document.querySelector(".verified [role=status]");
  const button = document.querySelector(".verified button");
  const settled = () => button.hidden && done(line.textContent);
  new MutationObserver(settled).observe(button, { attributes: true });
  button.click();
})"""


async def verified(file: Path, folder: Path) -> str:
    """What a page says after all of its trials were verified."""
    process = await asyncio.create_subprocess_exec(
        *("firefox-esr", "--headless", "--no-remote", "--profile", folder),
        *("--remote-debugging-port", "0", "about:blank"),
        stderr=subprocess.PIPE,
    )
    try:
        assert process.stderr
        while PATTERN not in (line := (await process.stderr.readline()).decode()):
            assert line, "Firefox has ended"
        address = f"{line.partition(PATTERN)[2].strip()}/session"
        async with websockets.connect(address, max_size=None) as socket:
            firefox = Firefox(socket)
            await firefox.open(file.as_uri())
            return str(await firefox.value(WAIT))
    finally:
        process.kill()
        await process.wait()


@pytest.mark.slow
@pytest.mark.skipif(which("firefox-esr") is None, reason="needs firefox-esr of Debian")
def test_firefox_computes_the_trials_with_their_bits(tmp_path: Path) -> None:
    study = launched(FLOWN, tmp_path)
    choice = {"compute": True, "metric": "speed", "trials": ("all",)}
    file = written(study, tmp_path / "computed.html", **choice)
    profile = tmp_path / "profile"
    profile.mkdir()
    waited = asyncio.wait_for(verified(file, profile), PATIENCE)
    # A thread of its own: Playwright may have begun a loop in this one.
    with ThreadPoolExecutor(max_workers=1) as pool:
        said = pool.submit(asyncio.run, waited).result()
    assert said == "Verified in this browser, bit for bit: 12 of 12 trials."
