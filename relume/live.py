"""A page that shows a running render, served on the loopback interface alone.

Nothing but this machine reaches it, and of this machine's web pages none but its own: the address
holds a secret, requests must name the loopback host (another name that resolves to it is refused),
and what stops the render must come from the page's own origin. It loads nothing from elsewhere.
"""

from __future__ import annotations

import json
import math
import secrets
import threading
import time
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np

from relume import metadata
from relume.accumulator import Accumulator
from relume.progress import Progress
from relume.translator import Translation
from relume.workbench import pages

HOST = "127.0.0.1"
HALF_MAX = 65504.0

INTERVAL, SHARE = 0.3, 0.03
"""Least time between two pictures [s], and share of the time that they may take."""

END_POLL = 0.05
"""Time between two looks at whether the server is to end [s]."""

PATIENCE = 3.0
"""Time after the end in which an open page gets the last picture [s]."""

HISTORY = 400
"""Most points of noise over time; of more, every second is left out."""

POLICY = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'"
TYPES = {"js": "text/javascript", "css": "text/css", "html": "text/html"}


class LivePage:
    """What the page shows, and its server.

    Args:
        translation: the scene, of whose lines the page tells.
        stop: gets an entry when somebody presses the button.
        announce: called with the page's address once it is served.

    Attributes:
        url: its address, with the secret.
    """

    def __init__(
        self,
        translation: Translation,
        stop: list[int],
        announce: Callable[[str], object] = lambda url: None,
    ) -> None:
        self._stop, self._announce = stop, announce
        self._lock = threading.Lock()
        self._picture = b""
        self._asked = self._seen = -math.inf
        self._next = 0.0
        self._pixels = translation.plan.width * translation.plan.height
        self._known = 0
        self._state: dict[str, Any] = {
            "width": translation.plan.width,
            "height": translation.plan.height,
            "picture": -1,
            "history": [],
            "ended": "",
            "spp": 0,
            "all_spp": 0,
            "passes": 0,
            "all_passes": 0,
            "rate": 0.0,
            "seconds": 0.0,
            "noise": None,
        }
        self._files = page_files(translation)
        self._secret = secrets.token_urlsafe(16)
        self._server = ThreadingHTTPServer((HOST, 0), _handler(self))
        self._server.daemon_threads = True
        self._thread = threading.Thread(
            target=self._server.serve_forever, args=(END_POLL,), daemon=True
        )
        self.port = int(self._server.server_address[1])
        self.url = f"http://{HOST}:{self.port}/{self._secret}/"

    def start(self) -> None:
        """Serve the page from now on."""
        self._thread.start()
        self._announce(self.url)

    def close(self) -> None:
        """End, once an open page has seen the last picture."""
        last = time.monotonic() + PATIENCE
        while self._asked > last - 2 * PATIENCE and self._seen < 0 and time.monotonic() < last:
            time.sleep(0.05)
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    # ---- what the render tells

    def progress(self, progress: Progress) -> None:
        """Take over how far the render is."""
        with self._lock:
            state = self._state
            self._known = self._known or state["spp"]
            taken = progress.spp - self._known
            state |= {"passes": progress.passes, "all_passes": progress.all_passes}
            state |= {"all_spp": progress.all_spp, "spp": progress.spp}
            state["seconds"] = progress.seconds
            state["rate"] = taken * self._pixels / max(progress.seconds, 1e-9)

    def offer(self, accumulator: Accumulator, seconds: float) -> None:
        """Take over the picture so far, if it is time."""
        if seconds >= self._next:
            start = time.perf_counter()
            self._take(accumulator, seconds)
            took = time.perf_counter() - start
            self._next = seconds + max(INTERVAL, took / SHARE)

    def end(self, accumulator: Accumulator, seconds: float, said: str) -> None:
        """Take over the last picture.

        Args:
            accumulator: what was rendered.
            seconds: that it took.
            said: how the render ended.
        """
        self._take(accumulator, seconds)
        with self._lock:
            self._state["ended"] = said

    def _take(self, accumulator: Accumulator, seconds: float) -> None:
        if not accumulator.done:
            return
        image, noise = accumulator.image(), accumulator.noise()
        halves = np.clip(np.nan_to_num(image), -HALF_MAX, HALF_MAX).astype("<f2").tobytes()
        with self._lock:
            state = self._state
            self._picture = halves
            state["picture"] += 1
            state["spp"] = accumulator.spp
            if math.isfinite(noise):
                state["noise"] = noise
                state["history"].append((round(seconds, 3), noise))
                if len(state["history"]) > HISTORY:
                    del state["history"][1:-1:2]

    # ---- what the page asks for

    def answer(self, name: str) -> tuple[str, bytes] | None:
        """Type and contents of what the page asks for; None if there is no such thing."""
        self._asked = time.monotonic()
        with self._lock:
            if name == "state":
                return "application/json", json.dumps(self._state).encode()
            if name == "picture":
                return "application/octet-stream", self._picture
        if name in self._files:
            kind = TYPES[name.rpartition(".")[2]]
            return f"{kind}; charset=utf-8", self._files[name]
        return None

    def obey(self, name: str) -> bool:
        """Do what the page posts; whether there is such a thing."""
        if name == "stop":
            if not self._stop:
                self._stop.append(0)
        elif name == "seen":
            self._seen = time.monotonic()
        else:
            return False
        return True

    def path_of(self, path: str) -> str | None:
        """The name that a path asks for; None where the secret is wrong."""
        secret, _, name = path.removeprefix("/").partition("?")[0].partition("/")
        if not secrets.compare_digest(secret.encode(), self._secret.encode()):
            return None
        return name or "index.html"

    def hosts(self) -> tuple[str, ...]:
        """Hosts under which the page may be asked for."""
        return f"{HOST}:{self.port}", f"localhost:{self.port}"


def page_files(translation: Translation) -> dict[str, bytes]:
    """The files of the page by name."""
    lines = sorted(translation.document.lines.all, key=lambda line: line.line)
    name = Path(translation.document.path).name or "a scene"
    page = pages.filled(
        "live.html",
        title=f"{name}, {translation.plan.width}x{translation.plan.height}",
        losses=metadata.losses(translation),
        lines=[line.as_dict() for line in lines],
    )
    style = pages.asset("viewer.css") + pages.asset("live.css")
    scripts = {name: pages.asset(name) for name in ("viewer.js", "live.js")}
    texts = {"index.html": page, "live.css": style, **scripts}
    return {name: str(text).encode() for name, text in texts.items()}


def _handler(page: LivePage) -> type[BaseHTTPRequestHandler]:
    """The class that answers requests for a page."""

    class Handler(BaseHTTPRequestHandler):
        server_version, sys_version = "relume", ""

        def do_GET(self):
            name = self._allowed()
            if name is not None:
                found = page.answer(name)
                if found is None:
                    self.send_error(HTTPStatus.NOT_FOUND)
                else:
                    self._send(*found)

        def do_POST(self):
            name = self._allowed(own_origin=True)
            if name is not None:
                if page.obey(name):
                    self._send("text/plain", b"")
                else:
                    self.send_error(HTTPStatus.NOT_FOUND)

        def _allowed(self, own_origin=False):
            """The name asked for; None, and an error sent, where the request is not the page's."""
            host, origin = self.headers.get("Host", ""), self.headers.get("Origin")
            name = page.path_of(self.path)
            foreign = origin is not None and origin != f"http://{host}"
            if self.headers.get("Sec-Fetch-Site", "same-origin") not in ("same-origin", "none"):
                foreign = True
            if own_origin and origin is None:
                foreign = True
            if host not in page.hosts() or foreign or name is None:
                self.send_error(HTTPStatus.FORBIDDEN)
                return None
            return name

        def _send(self, kind, contents):
            self.send_response(HTTPStatus.OK)
            for name, value in {
                "Content-Type": kind,
                "Content-Length": str(len(contents)),
                "Cache-Control": "no-store",
                "Content-Security-Policy": POLICY,
                "Cross-Origin-Resource-Policy": "same-origin",
                "Referrer-Policy": "no-referrer",
                "X-Content-Type-Options": "nosniff",
                "X-Frame-Options": "DENY",
            }.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(contents)

        def log_message(self, *_):
            pass

    return Handler
