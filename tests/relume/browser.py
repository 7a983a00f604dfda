"""A headless Chromium that tests drive by its DevTools protocol."""

from __future__ import annotations

import asyncio
import base64
import json
import shutil
import subprocess
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PATIENCE = 120.0
"""Time for the browser to do something on a busy machine [s]."""

FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
    "--remote-debugging-port=0",
    "--remote-allow-origins=*",
)


def executable() -> str | None:
    """The browser of this machine, or None."""
    names = ("chromium", "chromium-browser", "google-chrome")
    return next((found for name in names if (found := shutil.which(name))), None)


class Browser:
    """One page of a browser.

    Args:
        socket: connected to it.
        loop: that the connection belongs to.

    Attributes:
        asked: addresses that the page asked for.
        errors: what its scripts complained of.
    """

    def __init__(self, socket: Any, loop: asyncio.AbstractEventLoop) -> None:
        self._socket, self._loop, self._count = socket, loop, 0
        self.asked: list[str] = []
        self.errors: list[str] = []
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.command(f"{domain}.enable")

    def command(self, method: str, **parameters: Any) -> dict[str, Any]:
        """The answer of the browser to a command."""
        return self._loop.run_until_complete(
            asyncio.wait_for(self._command(method, parameters), PATIENCE)
        )

    async def _command(self, method: str, parameters: dict[str, Any]) -> dict[str, Any]:
        self._count += 1
        message = {"id": self._count, "method": method, "params": parameters}
        await self._socket.write_message(json.dumps(message))
        while True:
            found = json.loads(await self._socket.read_message())
            if found.get("id") == self._count:
                assert "error" not in found, found
                return found["result"]
            given = found.get("params", {})
            if found.get("method") == "Network.requestWillBeSent":
                self.asked.append(given["request"]["url"])
            elif found.get("method") == "Runtime.exceptionThrown":
                self.errors.append(json.dumps(given))
            elif found.get("method") == "Log.entryAdded" and given["entry"]["level"] == "error":
                self.errors.append(given["entry"]["text"])

    def open(self, url: str) -> None:
        """Go to a page."""
        self.command("Page.navigate", url=url)
        self.wait("document.readyState === 'complete'")

    def value(self, script: str) -> Any:
        """What an expression is on the page; promises are waited for."""
        result = self.command(
            "Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def wait(self, script: str) -> None:
        """Wait until an expression is true."""
        last = time.monotonic() + PATIENCE
        while not self.value(script):
            assert time.monotonic() < last, f"never true: {script}"
            time.sleep(0.05)

    def mouse(self, kind: str, x: float, y: float, **more: Any) -> None:
        """A mouse event at a place of the window: `Pressed`, `Released`, `Moved` or `Wheel`."""
        self.command("Input.dispatchMouseEvent", type=f"mouse{kind}", x=x, y=y, **more)

    def click(self, x: float, y: float) -> None:
        """Press and release the left button."""
        for kind in ("Pressed", "Released"):
            self.mouse(kind, x, y, button="left", buttons=1, clickCount=1)

    def key(self, text: str) -> None:
        """Type a character."""
        for kind in ("keyDown", "keyUp"):
            self.command("Input.dispatchKeyEvent", type=kind, key=text, text=text)

    def screenshot(self, path: str | Path) -> None:
        """Write what is seen as PNG."""
        data = self.command("Page.captureScreenshot", format="png")["data"]
        Path(path).write_bytes(base64.b64decode(data))


@contextmanager
def browser(size: tuple[int, int] = (1300, 800)) -> Iterator[Browser]:
    """Context with a page of a new browser; needs the package tornado."""
    from tornado.websocket import websocket_connect

    program = executable()
    assert program, "there is no browser"
    window = f"--window-size={size[0]},{size[1]}"
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        process = subprocess.Popen(
            [program, *FLAGS, window, f"--user-data-dir={profile}", "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        loop = asyncio.new_event_loop()
        try:
            target = _target(Path(profile, "DevToolsActivePort"))

            async def connected() -> Any:
                return await websocket_connect(target, max_message_size=2**28)

            socket = loop.run_until_complete(asyncio.wait_for(connected(), PATIENCE))
            yield Browser(socket, loop)
            socket.close()
            loop.run_until_complete(asyncio.sleep(0.1))
        finally:
            process.terminate()
            process.wait(PATIENCE)
            loop.close()


def _target(file: Path) -> str:
    """Address of the first page's socket."""
    last = time.monotonic() + PATIENCE
    while True:
        try:
            port = file.read_text().split()[0]
            with urllib.request.urlopen(
                f"http://127.0.0.1:{port}/json", timeout=PATIENCE
            ) as answer:
                pages = [p for p in json.load(answer) if p["type"] == "page"]
            return pages[0]["webSocketDebuggerUrl"]
        except (OSError, IndexError):
            assert time.monotonic() < last, "the browser does not start"
            time.sleep(0.1)
