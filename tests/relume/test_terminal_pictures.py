"""Pictures in terminals, decoded as the terminals do."""

import base64
import io
import re

import numpy as np
import pytest
from PIL import Image
from rich.console import Console

from relume import terminal_pictures
from relume.output import write_image
from relume.tone import Look


@pytest.fixture
def image():
    y, x = np.mgrid[:20, :31]
    return Image.fromarray(np.stack([8 * x, 12 * y, (x * y) % 256], -1).astype("u1"))


@pytest.mark.parametrize(
    "environ, kind",
    [
        ({"TERM": "xterm-kitty"}, "kitty"),
        ({"TERM": "xterm-256color", "TERM_PROGRAM": "iTerm.app"}, "iterm"),
        ({"TERM": "foot"}, "sixel"),
        ({"TERM": "xterm-256color"}, ""),
        ({}, ""),
    ],
)
def test_terminals_are_known_by_what_they_say(environ, kind):
    assert terminal_pictures.protocol(environ) == kind


def test_kitty_gets_a_png_in_chunks(image):
    noisy = Image.fromarray(np.random.default_rng(0).integers(0, 256, (60, 60, 3), np.uint8))
    for picture in (image, noisy):
        text = terminal_pictures.encoded(picture, "kitty")
        parts = re.findall("\x1b_G([^;]*);([^\x1b]*)\x1b\\\\", text)
        assert "".join(f"\x1b_G{keys};{data}\x1b\\" for keys, data in parts) == text
        assert [keys.split(",")[-1] for keys, _ in parts] == ["m=1"] * (len(parts) - 1) + ["m=0"]
        assert parts[0][0].startswith("a=T,f=100,") and max(len(d) for _, d in parts) <= 4096
        data = base64.b64decode("".join(data for _, data in parts))
        assert np.array_equal(Image.open(io.BytesIO(data)), picture)


def test_iterm_gets_a_png(image):
    text = terminal_pictures.encoded(image, "iterm")
    size, data = re.fullmatch("\x1b]1337;File=inline=1;size=(\\d+):(.*)\a", text).groups()
    data = base64.b64decode(data)
    assert len(data) == int(size) and np.array_equal(Image.open(io.BytesIO(data)), image)


def decoded(text):
    """A picture of sixels, by the manual of the VT330: (height, width, 3)."""
    width, height, body = re.fullmatch('\x1bPq"1;1;(\\d+);(\\d+)(.*)\x1b\\\\', text, re.S).groups()
    picture = np.zeros((int(height) + 6, int(width), 3))
    palette, color, x, top = {}, 0, 0, 0
    for token in re.findall(r"#\d+(?:;2;\d+;\d+;\d+)?|!\d+.|[$-]|[?-~]", body):
        if token[0] == "#" and ";" in token:
            index, _, *rgb = map(int, token[1:].split(";"))
            palette[index] = np.array(rgb) * 2.55
        elif token[0] == "#":
            color = int(token[1:])
        elif token in "$-":
            x, top = 0, top + 6 * (token == "-")
        else:
            count = int(token[1:-1]) if token[0] == "!" else 1
            bits = ord(token[-1]) - 63
            for y in range(6):
                if bits >> y & 1:
                    picture[top + y, x : x + count] = palette[color]
            x += count
    return picture[: int(height)]


def test_sixels_show_the_picture(image):
    found = decoded(terminal_pictures.encoded(image, "sixel"))
    assert found.shape == (20, 31, 3)
    assert np.abs(found - np.asarray(image, float)).mean() < 6, "256 colours, in percent"


def test_linear_pictures_are_shown_as_they_are_looked_at(tmp_path):
    write_image(tmp_path / "a.exr", np.full((2, 3, 3), 0.25))
    assert terminal_pictures.picture(tmp_path / "a.exr", Look(2.0)).getpixel((1, 1)) == (255,) * 3


def test_wide_sixel_pictures_are_reduced():
    wide = Image.new("RGB", (3 * terminal_pictures.WIDEST, 30), (0, 255, 0))
    found = decoded(terminal_pictures.encoded(wide, "sixel"))
    assert found.shape == (10, terminal_pictures.WIDEST, 3)
    assert np.abs(found - [0, 255, 0]).max() < 3


def test_nothing_is_printed_into_a_pipe(tmp_path, monkeypatch):
    monkeypatch.setenv("TERM", "foot")
    write_image(tmp_path / "a.png", np.ones((2, 3, 3)))
    pipe = io.StringIO()
    assert not terminal_pictures.show(tmp_path / "a.png", Look(), Console(file=pipe))
    assert not pipe.getvalue()
    terminal = Console(file=pipe, force_terminal=True)
    assert terminal_pictures.show(tmp_path / "a.png", Look(), terminal) and pipe.getvalue()
