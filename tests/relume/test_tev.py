"""Pictures sent to the viewer tev: its packets, read back as its documents have them."""

import io
import socket
import struct
import threading

import numpy as np
import pytest
from rich.console import Console

from relume import tev
from relume.rendering import render_scene


def texts(data, count):
    """The first texts of some bytes, and the rest."""
    *found, rest = data.split(b"\0", count)
    return [text.decode() for text in found], rest


class Listener:
    """Takes what one viewer is sent: a list of (kind, fields)."""

    def __init__(self):
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.address = self.socket.getsockname()
        self.packets = []
        self.thread = threading.Thread(target=self.listen)
        self.thread.start()

    def listen(self):
        connection, _ = self.socket.accept()
        with connection, connection.makefile("rb") as stream:
            while head := stream.read(4):
                (length,) = struct.unpack("<I", head)
                packet = stream.read(length - 4)
                self.packets.append((packet[0], packet[1:]))
        self.socket.close()


@pytest.fixture
def console():
    return Console(file=io.StringIO(), record=True, width=200)


def test_tev_gets_the_picture_that_is_written(room, tmp_path, console):
    listener = Listener()
    path = room()
    viewer = [lambda *given: tev.Tev(*given, address=listener.address, console=console)]
    found = render_scene(path, out=tmp_path / "a.exr", console=console, viewers=viewer)
    listener.thread.join(60)
    (kind, made), *updates = listener.packets
    (name, *_), rest = texts(made[1:], 1)
    assert kind == 4 and made[0] == 1 and name == str(path)
    assert struct.unpack("<iii", rest[:12]) == (32, 24, 3)
    assert texts(rest[12:], 3) == (["R", "G", "B"], b"")
    last = {}
    for kind, fields in updates:
        (name, channel), rest = texts(fields[1:], 2)
        assert kind == 3 and name == str(path)
        assert struct.unpack("<iiii", rest[:16]) == (0, 0, 32, 24)
        last[channel] = np.frombuffer(rest[16:], "<f4").reshape(24, 32)
    from relume import developing

    image = developing.read(found.paths[0]).image
    assert np.array_equal(np.stack([last[c] for c in "RGB"], -1), image)


def test_without_tev_the_render_goes_on(room, tmp_path, console):
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = free.getsockname()
    viewer = [lambda *given: tev.Tev(*given, address=address, console=console)]
    found = render_scene(room(), out=tmp_path / "a.exr", console=console, viewers=viewer)
    assert found.paths[0].exists() and not found.why
    assert f"no tev at 127.0.0.1:{address[1]}" in console.export_text()


def test_a_viewer_that_is_gone_does_not_end_the_render(room, tmp_path, console):
    """It takes the connection, and closes it before the first picture."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        class Gone(tev.Tev):
            def start(self):
                super().start()
                connection, _ = server.accept()
                reset = struct.pack("ii", 1, 0)
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, reset)
                connection.close()

        viewer = [lambda *given: Gone(*given, address=server.getsockname(), console=console)]
        found = render_scene(room(), out=tmp_path / "a.exr", console=console, viewers=viewer)
    assert found.paths[0].exists() and not found.why
    assert console.export_text().count("no tev at 127.0.0.1") == 1
