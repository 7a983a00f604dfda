"""Scenes for the tests of the application."""

import pytest

ROOM = """\
IMAGE
{width} {height}
SAMPLING
{spp}
SUPERSAMPLING
1
DEPTH
3
CAMERA_POS
0 3 14
TARGET_POS
0 2 0
SCREEN
20 20 40
BACKGROUND
0.4 0.5 0.7
{settings}

OBJECT
plane 0 0 0
normal 0 1 0
color 0.7 0.6 0.5
reflection diffuse

OBJECT
sphere -1.5 1.5 0 1.5
color 0.2 0.4 0.8
reflection diffuse

OBJECT
sphere 2 1 1 1
color 0.9 0.8 0.6
reflection specular

OBJECT
uvplane -2 6 -2
U 4 0 0
V 0 0 4
emission 6 5 4
reflection diffuse
"""
"""A lit floor with a diffuse and a mirror ball; `{settings}` takes further keywords."""


@pytest.fixture
def room(tmp_path):
    """A function that writes the room as a scene file and returns its path."""

    def write(settings="", *, width=32, height=24, spp=4, objects="", name="room.txt"):
        text = ROOM.format(width=width, height=height, spp=spp, settings=settings)
        path = tmp_path / name
        path.write_text(f"{text}\n{objects}", encoding="utf-8")
        return path

    return write
