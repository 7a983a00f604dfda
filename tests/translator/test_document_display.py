"""What a document shows of itself: one line in a console, tables in a notebook."""

from html.parser import HTMLParser

import pytest

from relume.translator import Document, read_text

BALL = "OBJECT\nsphere 0 0 0 1\ncolor 1 1 1\nreflection {}\n\n"
LAMP = "OBJECT\ndisk 0 5 0 1\nnormal 0 -1 0\nemission 1 1 1\nreflection diffuse\n"
SETTINGS = "IMAGE\n64 48\nSAMPLING\n3\nSUPERSAMPLING\n2\n"
TEXT = SETTINGS + BALL.format("ward_brdf") * 2 + BALL.format("reflection") + LAMP


def test_repr_is_one_short_line():
    document = read_text(TEXT, "some/folder/room.txt", {})
    assert repr(document) == "<Document room.txt: 64x48 pixels, 12 spp, 4 objects>"
    assert f"{document}" == repr(document)
    one = read_text(LAMP, "lamp.txt", {})
    assert repr(one) == "<Document lamp.txt: 320x240 pixels, 32 spp, 1 object>"
    assert repr(Document()) == "<Document without a name: 320x240 pixels, 32 spp, 0 objects>"


def test_samples_are_those_that_are_rendered():
    """Of a Metropolis render the mutations of all runs."""
    text = "SAMPLING\n3\nmetropolisTransport\n1\nmutation\n5\n"
    assert ", 15 spp," in repr(read_text(text, environ={}))


def test_documents_are_equal_by_their_fields_as_before():
    a, b = (read_text(TEXT, name, {}) for name in ("a.txt", "b.txt"))
    assert a == b and a is not b
    b.sampling = 4
    assert a != b
    with pytest.raises(TypeError, match="unhashable"):
        hash(a)


class Cells(HTMLParser):
    """Rows of the tables in HTML; fails where an element is not closed."""

    def __init__(self, html):
        super().__init__()
        self.open, self.rows = [], []
        self.feed(html)
        assert self.open == []

    def handle_starttag(self, tag, _attrs):
        assert tag in ("div", "b", "table", "thead", "tbody", "tr", "th", "td"), tag
        self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag == "td":
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open[-1] == "td":
            self.rows[-1][-1] += data


def test_html_shows_settings_and_kinds_of_objects():
    rows = Cells(read_text(TEXT, "room.txt", {})._repr_html_()).rows
    assert ["IMAGE", "64 48"] in rows and ["SAMPLING", "3"] in rows
    assert not any(row and row[0] in ("SUPERSAMPLING", "DEPTH") for row in rows), "defaults"
    assert ["samples of a pixel", "12: SAMPLING 3 x SUPERSAMPLING 2 squared"] in rows
    assert rows[-3:] == [
        ["2", "Sphere", "ward", ""], ["1", "Sphere", "glass", ""], ["1", "Disk", "diffuse", "yes"]
    ]  # fmt: skip


def test_text_of_a_scene_is_no_markup():
    text = f"OUTPUT\n<script>alert(1)</script>{'x' * 100}.png\n"
    html = read_text(text, "<b>&.txt", {})._repr_html_()
    assert "&lt;b&gt;&amp;.txt" in html
    (shown,) = (row[1] for row in Cells(html).rows if row and row[0] == "OUTPUT")
    assert shown.startswith("<script>alert(1)</script>xxx") and len(shown) == 60
