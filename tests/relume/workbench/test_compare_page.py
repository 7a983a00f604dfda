"""The page of `relume compare`: what it holds, that it needs nothing else, that its views work."""

import base64
import json
import re
import shutil
import subprocess
import zlib
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from relume.workbench import comparing, pages
from relume.workbench.compare_page import ASSETS, page, write_assets
from tests.relume import browser as chromium

DOCS = Path(__file__).parents[3] / "docs" / "compare"


class Elements(HTMLParser):
    """Collects the elements of a page and the text of its scripts."""

    def __init__(self, text):
        super().__init__()
        self.found, self.scripts = [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))

    def handle_data(self, data):
        if self.found and self.found[-1][0] == "script" and data.strip():
            self.scripts.append(data)


def unpacked(text):
    return zlib.decompress(base64.b64decode(text))


@pytest.fixture
def compared(room):
    return comparing.compare(room(name="a & <b>.txt"), size=(20, 12), spp=32)


def test_the_page_needs_nothing_but_itself(compared):
    text = page(compared)
    elements = Elements(text)
    for tag, attributes in elements.found:
        assert tag not in ("link", "iframe", "object", "base")
        for name in ("src", "href", "srcset", "action"):
            assert attributes.get(name, "data:").startswith("data:")
    policy = next(a["content"] for tag, a in elements.found if "http-equiv" in a)
    assert "default-src 'none'" in policy and "http" not in policy
    assert not re.search(r"\{\{|\{%|url\(|@import|fetch\(|https?://", text)


def test_linked_pages_share_style_and_script(compared, tmp_path):
    """And nothing else: the rest is the same, and short of what stands beside it."""
    text = page(compared, linked=True)
    elements = Elements(text)
    links = [
        a.get("href") or a.get("src") for tag, a in elements.found if tag in ("link", "script")
    ]
    assert [link for link in links if link] == list(ASSETS)
    policy = next(a["content"] for tag, a in elements.found if "http-equiv" in a)
    assert "unsafe-inline" not in policy and "http" not in policy
    write_assets(tmp_path)
    shared = [(tmp_path / name).read_text(encoding="utf-8") for name in ASSETS]
    assert all(part in page(compared) and part not in text for part in shared)


def test_stored_pages_link_what_the_program_has():
    """Those of the docs, whose style and script are copies."""
    for name in ASSETS:
        assert (DOCS / name).read_text(encoding="utf-8") == pages.asset(name)
    stored = sorted(DOCS.glob("*.html"))
    assert len(stored) == 7
    for file in stored:
        elements = Elements(file.read_text(encoding="utf-8"))
        tags = [tag for tag, _ in elements.found]
        assert tags.count("link") == 2 and "style" not in tags and len(elements.scripts) == 1


def test_the_page_holds_the_pictures_without_loss(compared):
    """Linear values as half floats: relative error below 2^-11 in the range of normal halves."""
    elements = Elements(page(compared))
    data = json.loads(elements.scripts[0])
    assert (data["width"], data["height"]) == (20, 12)
    for name, side in zip(("first", "second"), compared.sides, strict=True):
        high, low = np.frombuffer(unpacked(data["arrays"][name]), np.uint8).reshape(2, -1)
        stored = (high.astype(np.uint16) << 8 | low).view(np.float16).astype(float)
        mean = side.estimate.pixels.mean
        np.testing.assert_allclose(stored.reshape(mean.shape) * data["scale"], mean, rtol=2**-11)
    assert len(unpacked(data["arrays"]["z"])) == 20 * 12 * 2
    pictures = [a["src"] for tag, a in elements.found if tag == "img"]
    for picture in pictures:
        kind, _, content = picture.partition(",")
        assert kind == "data:image/jpeg;base64"
        assert base64.b64decode(content).startswith(b"\xff\xd8\xff")
    assert len(pictures) == 2


def test_the_page_tells_verdict_figures_command_and_versions(compared):
    text = page(compared)
    report = compared.report()
    assert report["text"] in text and "mitsuba" in text and "3.9.1" in text
    assert "libLLVM" in text and "/libLLVM" not in text
    assert "--with volpath --size 20x12 --spp 32 --runs 32 --seed 0 --dialect manual" in text
    assert "a &amp; &lt;b&gt;.txt" in text and "<b>" not in text
    for figure in ("relMSE, debiased", "HDR-FLIP", "threshold", "efficiency"):
        assert figure in text


PROBE = """<script>
setTimeout(() => {
  const sums = {};
  const context = document.querySelector("canvas").getContext("2d");
  const sum = () => [...context.getImageData(0, 0, width, height).data].reduce((a, b) => a + b);
  for (const radio of document.querySelectorAll("input[name=view]")) {
    radio.click();
    sums[radio.value] = sum();
  }
  document.querySelector("input[value=split]").click();
  for (const [name, id, value] of [["right", "split", 0], ["left", "split", 1],
                                   ["bright", "exposure", 2]]) {
    find(id).value = value;
    find(id).dispatchEvent(new Event("input"));
    sums[name] = sum();
  }
  document.title = JSON.stringify(sums);
}, 500);
</script></body>"""
"""Chooses every view, moves the sliders, and leaves the sum of all bytes drawn as the title."""


@pytest.mark.skipif(not shutil.which("chromium"), reason="needs Chromium")
def test_views_and_sliders_work_in_a_browser(room, tmp_path):
    """`direct` is darker than `path`: at the ends of the split each picture stands alone."""
    found = comparing.compare(room(), integrator="direct", with_="path", size=(20, 12), spp=64)
    write_assets(tmp_path)
    (tmp_path / "linked.html").write_text(page(found, linked=True), encoding="utf-8")
    (tmp_path / "whole.html").write_text(page(found).replace("</body>", PROBE), encoding="utf-8")
    shown = {}
    for name in ("linked", "whole"):
        command = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom"]
        url = (tmp_path / f"{name}.html").as_uri()
        done = subprocess.run(
            [*command, "--virtual-time-budget=3000", f"--user-data-dir={tmp_path}/chromium", url],
            capture_output=True, text=True, timeout=600, check=True,
        )  # fmt: skip
        shown[name] = done.stdout
        assert "<canvas" in done.stdout and "<img" not in done.stdout
        assert re.search(r'id="readout">\(\d+, \d+\) · direct ', done.stdout)
    sums = json.loads(re.search(r"<title>(.*?)</title>", shown["whole"])[1])
    assert sums["left"] == sums["first"] < sums["second"] < sums["bright"]
    # The line at the edge of the split is drawn over the picture.
    assert sums["second"] < sums["right"] < 1.01 * sums["second"]
    assert len({sums[view] for view in ("split", "difference", "z", "blocks", "flip")}) == 5


@pytest.mark.skipif(not shutil.which("chromium"), reason="needs Chromium")
def test_pictures_fill_the_page_are_flipped_and_zoomed_to_their_pixels(compared, tmp_path):
    pytest.importorskip("tornado")
    (tmp_path / "page.html").write_text(page(compared), encoding="utf-8")
    first, second = (side.estimate.pixels.mean for side in compared.sides)
    with chromium.browser() as tab:
        tab.open((tmp_path / "page.html").as_uri())
        tab.wait("document.querySelector('.frame canvas') !== null")
        box = "document.querySelector('.frame canvas').getBoundingClientRect()"
        left, top, wide = (tab.value(f"{box}.{name}") for name in ("left", "top", "width"))
        assert wide > 0.55 * tab.value("innerWidth")
        maps = tab.value("document.querySelector('.maps').textContent")
        assert maps == " difference FLIP" and tab.value("maps.flip.width") == 20

        step = wide / 20
        at = left + 3.5 * step, top + 2.5 * step
        tab.mouse("Moved", *at)
        said = tab.value("find('readout').textContent").split(" · ")
        assert said[0] == "(3, 2)"
        for words, picture in zip(said[1:3], (first, second), strict=True):
            values = [float(word) for word in words.split()[-3:]]
            np.testing.assert_allclose(values, picture[2, 3], rtol=2e-3)

        seen = []
        for act in (lambda: tab.key(" "), lambda: tab.click(*at), lambda: tab.key("f")):
            act()
            pixel = "Array.from(canvas.getContext('2d').getImageData(3, 2, 1, 1).data)"
            seen.append((tab.value("view()"), tab.value(pixel)[:3]))
        assert [view for view, _ in seen] == ["first", "second", "first"]
        for (_, pixel), picture in zip(seen, (first, second, first), strict=True):
            np.testing.assert_allclose(pixel, 255 * picture[2, 3].clip(0, 1) ** (1 / 2.2), atol=1.5)

        tab.mouse("Wheel", *at, deltaX=0, deltaY=-300)
        assert tab.value(f"{box}.width") > 1.5 * wide
        tab.mouse("Moved", at[0], at[1] + 1)
        assert tab.value("find('readout').textContent").startswith("(3, 2)")
        assert not tab.errors, tab.errors
