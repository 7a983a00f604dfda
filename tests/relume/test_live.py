"""The page of a running render: what it shows, and who may reach it."""

import http.client
import json
import re

import numpy as np
import pytest

from relume import loading
from relume.accumulator import Accumulator
from relume.cli import main
from relume.live import LivePage
from relume.options import RenderOptions
from relume.passes import Pass
from relume.progress import Progress
from relume.rendering import render_scene
from tests.relume import browser as chromium

WIDTH, HEIGHT = 32, 24

with_browser = pytest.mark.skipif(not chromium.executable(), reason="there is no Chromium")


@pytest.fixture
def page(room):
    """A page of the room after its first pass, served; `page.stopped` fills when it is stopped."""
    objects = "OBJECT\ndisk2 0 1 0 2 1\nnormal 0 1 0\n"
    translation = loading.translated(room(objects=objects), RenderOptions())
    stopped = []
    page = LivePage(translation, stopped)
    page.translation = translation
    page.stopped = stopped
    page.start()
    page.progress(Progress(1, 8, 2, 16, 2.0))
    page.offer(rendered(1), 2.0)
    yield page
    page._asked = -np.inf  # nobody is waited for
    page.close()


def rendered(passes):
    """A render of 2 samples a pass: mean x in red, 1 in green; 0.25 in blue."""
    accumulator = Accumulator(WIDTH, HEIGHT)
    x = np.tile(np.arange(WIDTH, dtype="f4"), HEIGHT)
    sums = 2 * np.stack([x, np.ones_like(x), np.full_like(x, 0.25)])
    for index in range(passes):
        accumulator.add(Pass(index, 2, sums, sums**2))
    return accumulator


def ask(page, name="state", method="GET", secret=True, **headers):
    """Status and contents of the answer to a request."""
    connection = http.client.HTTPConnection("127.0.0.1", page.port, timeout=20)
    path = "/" + page.url.split("/")[3] + f"/{name}" if secret else f"/{name}"
    host = {"Host": f"127.0.0.1:{page.port}"} | {k.replace("_", "-"): v for k, v in headers.items()}
    connection.request(method, path, headers=host)
    answer = connection.getresponse()
    found = answer.status, answer.read(), dict(answer.getheaders())
    connection.close()
    return found


def test_the_page_listens_on_the_loopback_interface_alone(page):
    assert page._server.server_address[0] == "127.0.0.1"
    assert re.fullmatch(rf"http://127\.0\.0\.1:{page.port}/[\w-]{{22}}/", page.url)


def test_state_and_picture_are_those_of_the_render(page):
    state = json.loads(ask(page)[1])
    assert (state["spp"], state["passes"], state["all_passes"], state["all_spp"]) == (2, 1, 8, 16)
    assert state["rate"] == 2 * WIDTH * HEIGHT / 2.0
    picture = np.frombuffer(ask(page, "picture")[1], "<f2").reshape(HEIGHT, WIDTH, 3)
    assert np.array_equal(picture, rendered(1).image().astype("f2"))
    page.end(rendered(3), 6.0, "done: a.png")
    state = json.loads(ask(page)[1])
    assert state["ended"] == "done: a.png" and state["spp"] == 6 and state["picture"] == 1


def test_pictures_are_taken_at_intervals(page):
    page.offer(rendered(2), 2.01)
    assert json.loads(ask(page)[1])["picture"] == 0
    page.offer(rendered(2), 1000.0)
    assert json.loads(ask(page)[1])["picture"] == 1


def test_the_rate_is_that_of_this_render_alone(page):
    """Of a render that goes on, the samples from before took none of its time."""
    going_on = LivePage(page.translation, [])
    going_on.offer(rendered(3), 0.0)
    going_on.progress(Progress(4, 8, 8, 16, 2.0))
    assert json.loads(going_on.answer("state")[1])["rate"] == 2 * WIDTH * HEIGHT / 2.0
    going_on._server.server_close()


def test_long_histories_keep_their_ends_and_every_second_between(page, monkeypatch):
    monkeypatch.setattr("relume.live.HISTORY", 6)
    for seconds in range(3, 12):
        page.end(rendered(2), float(seconds), "")
    times = [seconds for seconds, _ in json.loads(ask(page)[1])["history"]]
    assert times == sorted(times) and len(times) <= 6
    assert (times[0], times[-1]) == (2, 11) and len(times) > 3


@pytest.mark.parametrize("name", ["index.html", "live.js", "viewer.js", "live.css", ""])
def test_the_page_is_made_of_its_own_files(page, name):
    status, text, headers = ask(page, name)
    assert status == 200 and text
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert not re.search(rb"https?://|//[a-z]+\.", re.sub(rb"// [^\n]*", b"", text))


@pytest.mark.parametrize(
    "change",
    [
        {"Host": "evil.example"},
        {"Host": "evil.example:{port}"},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:1"},
        {"Sec_Fetch_Site": "cross-site"},
        {"secret": False},
    ],
)
@pytest.mark.parametrize("method, name", [("GET", "state"), ("GET", "picture"), ("POST", "stop")])
def test_no_other_origin_reads_or_drives_it(page, change, method, name):
    own = {"Origin": f"http://127.0.0.1:{page.port}"} if method == "POST" else {}
    assert ask(page, name, method, **own)[0] == 200
    page.stopped.clear()
    change = {k: v.format(port=page.port) if isinstance(v, str) else v for k, v in change.items()}
    status, text, _ = ask(page, name, method, **(own | change))
    assert status == 403 and b"spp" not in text and not page.stopped


def test_a_post_without_an_origin_is_refused(page):
    assert ask(page, "stop", "POST")[0] == 403 and not page.stopped


@pytest.mark.parametrize("name", ["../secret", "..%2f..%2fetc/passwd", "/etc/passwd", "nothing"])
def test_there_are_no_other_files(page, name):
    assert ask(page, name)[0] == 404


def test_a_render_is_stopped_from_the_page_and_keeps_its_picture(room, tmp_path, monkeypatch):
    """The page's button is pressed after the first pass; another render goes on from there."""
    import io

    from rich.console import Console

    monkeypatch.chdir(tmp_path)
    pages = []

    class Impatient(LivePage):
        def offer(self, accumulator, seconds):
            super().offer(accumulator, seconds)
            pages.append(json.loads(ask(self)[1]))
            origin = f"http://127.0.0.1:{self.port}"
            assert ask(self, "stop", "POST", Origin=origin)[0] == 200

        def close(self):
            pages.append(json.loads(ask(self)[1]))
            self._asked = -np.inf
            super().close()

    console = Console(file=io.StringIO())
    found = render_scene(room(), out="a.exr", spp=10**6, console=console, viewers=[Impatient])
    assert found.why == "interrupted" and len(pages) == 2
    assert pages[0]["ended"] == "" and pages[1]["ended"] == "interrupted: a.exr"
    assert pages[1]["noise"] == found.noise
    assert (tmp_path / "a.exr").exists() and (tmp_path / "a.passes.exr").exists()


def test_only_an_open_page_is_waited_for(page, monkeypatch):
    waits = []
    monkeypatch.setattr("relume.live.time.sleep", lambda _: waits.append(page.obey("seen")))
    unseen = LivePage(page.translation, [])
    unseen.start()
    unseen.close()
    assert not waits
    ask(page)
    page.close()
    assert waits == [True], "until it has got the last picture"


def test_the_address_is_told(room, tmp_path, monkeypatch):
    from click.testing import CliRunner

    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(main, ["render", str(room()), "-o", "a.exr", "--live"])
    assert result.exit_code == 0 and result.stdout == "a.exr\n"
    assert re.search(r"^live: http://127\.0\.0\.1:\d+/\S+/$", result.stderr, re.M)


@with_browser
def test_a_browser_shows_the_render(page):
    pytest.importorskip("tornado")
    with chromium.browser() as tab:
        tab.open(page.url)
        tab.wait("document.querySelector('#frame canvas') !== null")
        text = "document.getElementById('{}').textContent"
        tab.wait(f"{text.format('spp')} === '2 of 16'")
        assert tab.value(text.format("passes")) == "1 of 8"
        assert tab.value("Array.from(pixels.slice(3 * 5, 3 * 6))") == [5, 1, 0.25]
        assert "a ring" in tab.value("document.querySelector('.losses').textContent")

        canvas = "document.querySelector('#frame canvas').getBoundingClientRect()"
        left, top, width = (tab.value(f"{canvas}.{name}") for name in ("left", "top", "width"))
        wide = tab.value("document.getElementById('frame').clientWidth")
        assert width > 0.6 * wide, "the picture fills the page"
        step = width / WIDTH
        tab.mouse("Moved", left + 5.5 * step, top + 2.5 * step)
        assert tab.value(text.format("readout")) == "(5, 2)  5  1  0.25"
        for _ in range(4):
            tab.mouse("Wheel", left + 5.5 * step, top + 2.5 * step, deltaX=0, deltaY=-300)
        tab.mouse("Moved", left + 5.5 * step, top + 2.5 * step + 1)
        assert tab.value(f"{canvas}.width") > 1.9 * width
        assert tab.value(text.format("readout")).startswith("(5, 2)"), "zoomed about the pointer"

        drawn = "document.querySelector('#frame canvas').getContext('2d').getImageData(1, 0, 1, 1)"
        assert tab.value(f"Array.from({drawn}.data)") == [255, 255, 136, 255]
        tab.value("document.getElementById('exposure').value = -2")
        tab.value("document.getElementById('exposure').dispatchEvent(new Event('input'))")
        assert tab.value(f"{drawn}.data[1]") == 136, "a quarter of 1, encoded"

        tab.value("document.getElementById('stop').click()")
        tab.wait(f"{text.format('status')} === 'stops after this pass'")
        assert page.stopped
        page.end(rendered(3), 6.0, "interrupted: a.png")
        tab.wait(f"{text.format('status')} === 'interrupted: a.png'")
        tab.wait("document.getElementById('stop').disabled")
        assert not tab.errors, tab.errors
        assert all(url.startswith(page.url) for url in tab.asked if url != "about:blank")
