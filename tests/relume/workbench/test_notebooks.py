"""Results in a notebook: a short `repr`, a picture that decodes, HTML that is whole and small."""

import base64
import dataclasses
import io
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image

import relume

SMALL = {"size": (16, 12)}
VOID = {"img", "br", "hr", "meta", "input"}


class Checked(HTMLParser):
    """Takes HTML apart: its text, the sources of its pictures; elements must be closed in turn."""

    def __init__(self, text):
        super().__init__()
        self.open, self.text, self.sources, self.tags = [], "", [], set()
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        attributes = dict(attributes)
        assert not {"onload", "onerror", "href"} & set(attributes)
        self.sources += [attributes["src"]] if "src" in attributes else []
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A closed box that emits 1 and reflects half: radiance 2. Its name needs escaping."""
    path = tmp_path_factory.mktemp("notebook") / "a & <b>.txt"
    walls = ""
    for axis in range(3):
        for sign in (-1, 1):
            normal = [0, 0, 0]
            normal[axis] = -sign
            point = [-2 * x for x in normal]
            walls += (
                f"OBJECT\nplane {' '.join(map(str, point))}\nnormal {' '.join(map(str, normal))}\n"
                "emission 1 1 1\ncolor 0.5 0.5 0.5\nreflection diffuse\n\n"
            )
    camera = "CAMERA_POS\n0 0 1\nTARGET_POS\n0 0 0\nCAMERA_ANGLE\n60\n"
    path.write_text(f"IMAGE\n32 24\nSAMPLING\n4\nSUPERSAMPLING\n1\nDEPTH\n8\n{camera}\n{walls}")
    return path


@pytest.fixture(scope="module")
def results(scene, tmp_path_factory):
    """A comparison, a chart and a stability report of the box."""
    cache = tmp_path_factory.mktemp("references")
    document = relume.read(scene, {})
    return {
        "Comparison": relume.compare(document, spp=64, **SMALL),
        "Chart": relume.chart(
            document, methods=("path",), seconds=0.3, runs=4, cache=cache, **SMALL
        ),
        "Stability": relume.stability(document, expected=2.0, methods=("path",), **SMALL),
    }


KINDS = ("Comparison", "Chart", "Stability")


@pytest.mark.parametrize("kind", KINDS)
def test_the_repr_is_short_and_holds_the_verdict(results, kind):
    text = repr(results[kind])
    assert text.startswith(f"<{kind}") and results[kind].verdict() in text
    assert len(text) < 300 and "\n" not in text


@pytest.mark.parametrize("kind", KINDS)
def test_the_picture_decodes(results, kind):
    data = results[kind]._repr_png_()
    picture = Image.open(io.BytesIO(data))
    picture.load()
    assert picture.format == "PNG" and 80 < min(picture.size) <= max(picture.size) < 1500
    assert len(np.unique(np.asarray(picture.convert("L")))) > 10
    assert len(data) < 300_000


@pytest.mark.parametrize("kind", KINDS)
def test_the_html_is_whole_small_and_escaped(results, kind):
    """It shows the verdict and the picture, and loads nothing."""
    text = results[kind]._repr_html_()
    found = Checked(text)
    assert results[kind].verdict() in found.text
    assert not found.tags & {"script", "link", "iframe", "b"} and "table" in found.tags
    (source,) = found.sources
    kind_of, _, content = source.partition(",")
    assert kind_of == "data:image/png;base64"
    Image.open(io.BytesIO(base64.b64decode(content))).load()
    assert len(text) < 500_000 and "http" not in text


def test_html_of_a_hostile_note(results):
    """What the scene file says reaches the page as text."""
    found = results["Comparison"]
    note = "line 1, X: unsupported: <script>alert('x')</script> & more"
    changed = dataclasses.replace(found, settings=found.settings | {"notes": [note]})
    shown = Checked(changed._repr_html_())
    assert note in shown.text and "script" not in shown.tags


def test_verdicts_of_what_is_known(results):
    assert results["Comparison"].agree
    assert results["Stability"].verdict() == "1 cell: 1 exact" and not results["Stability"].silent
    assert results["Chart"].verdict().startswith("path is the first at 5 % noise, after ")
