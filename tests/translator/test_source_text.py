"""From bytes to lines: encodings, line ends, and what is no scene file."""

import os
import time

import pytest

from relume.translator import read, source_text
from relume.translator.diagnostics import SceneError
from relume.translator.source_text import decode_lines, read_lines


def refused(data):
    with pytest.raises(SceneError) as caught:
        decode_lines(data, "scene.txt")
    (problem,) = caught.value.problems
    assert problem.kind == "file"
    return problem


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp932"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("last", [True, False])
def test_encodings_and_line_ends(encoding, end, last):
    """UTF-8 with and without mark, cp932, three line ends, with and without the last one."""
    lines = ["# 拡散反射", "OUTPUT", "画像/ガラス.bmp"]
    data = (end.join(lines) + end * last).encode(encoding)
    assert decode_lines(data, "") == lines + [""] * last


def test_a_backslash_inside_a_character_of_cp932():
    """`ソ` is 0x83 0x5C in cp932: the second byte is no path separator."""
    assert decode_lines("objfile ソ\\表.obj".encode("cp932"), "") == ["objfile ソ\\表.obj"]


def test_a_mark_does_not_hide_the_first_keyword(tmp_path):
    """A byte order mark is dropped: the program took it for part of the keyword."""
    path = tmp_path / "scene.txt"
    path.write_bytes(b"\xef\xbb\xbfSAMPLING\n3\n")
    assert read(path, environ={}).sampling == 3


def test_an_empty_file_is_a_scene_of_defaults(tmp_path):
    """Nothing in it, nothing wrong with it."""
    path = tmp_path / "scene.txt"
    path.write_bytes(b"")
    assert read_lines(path) == [""]
    assert read(path, environ={}).image == (320, 240)


def test_only_line_ends_split_lines():
    """Other separators of Unicode and form feeds belong to their line."""
    text = "a\x0b\x0c\x1c\x85\u2028\u2029b"
    assert decode_lines(text.encode(), "") == [text]


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be"])
def test_utf_16_with_a_byte_order_mark_is_read(encoding):
    """Windows' editor calls it Unicode."""
    text = "IMAGE\r\n320 240\r\n# \u62e1\u6563"
    data = text.encode(encoding)
    marks = {"utf-16-le": b"\xff\xfe", "utf-16-be": b"\xfe\xff"}
    data = marks.get(encoding, b"") + data
    assert decode_lines(data, "") == text.split("\r\n")
    assert "begins as text in UTF-16, but is not" in refused(data + b"\x00").message


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be", "utf-32-be"])
def test_utf_16_without_is_named(encoding):
    """Its NUL bytes give it away; the message says so, and what to do."""
    problem = refused("IMAGE\n320 240\n".encode(encoding))
    assert "NUL" in problem.message and "UTF-16" in problem.message
    assert "save it as UTF-8" in problem.message and problem.line == 1


def test_nul_is_located():
    """Line and column of the first NUL byte."""
    problem = refused(b"IMAGE\n320 240\nOUT\0PUT\n")
    assert (problem.line, problem.column) == (3, 4)


def test_bytes_of_no_encoding_are_located():
    """0x81 starts a character of cp932 that a blank cannot end; columns count bytes here."""
    problem = refused("IMAGE\nガラ".encode("cp932") + b"\x81 \n")
    assert (problem.line, problem.column) == (2, 5)
    assert "0x81" in problem.message


def test_long_lines_and_too_many_are_refused(monkeypatch):
    """Limits with the place where they are passed."""
    problem = refused(b"IMAGE\n" + b"1" * (source_text.MAX_LINE_LENGTH + 1))
    assert (problem.line, problem.column) == (2, source_text.MAX_LINE_LENGTH + 1)
    longest = "1" * source_text.MAX_LINE_LENGTH
    assert decode_lines(longest.encode(), "") == [longest]
    monkeypatch.setattr(source_text, "MAX_LINES", 10)
    assert len(decode_lines(b"1\n" * 9, "")) == 10
    assert refused(b"1\n" * 10).line == 11


def unreadable(path):
    """The message about a path that is no readable scene file, in little time."""
    start = time.monotonic()
    with pytest.raises(SceneError) as caught:
        read(path)
    assert time.monotonic() - start < 5
    (problem,) = caught.value.problems
    assert (problem.kind, problem.line) == ("file", 0)
    assert str(path) in str(caught.value)
    return problem.message


def test_missing_file(tmp_path):
    """A name without a file, and a path below a file."""
    assert unreadable(tmp_path / "none.txt") == "no such file"
    (tmp_path / "file").write_text("")
    assert "cannot be read" in unreadable(tmp_path / "file" / "none.txt")
    assert "cannot be read" in unreadable(tmp_path / ("x" * 5000))


def test_impossible_name():
    """A NUL in a name raises ValueError in Python; here it is a message."""
    with pytest.raises(SceneError, match="cannot be read"):
        read("a\0b")


def test_directory(tmp_path):
    """Where a scene is asked for, a folder is named as such."""
    assert "directory" in unreadable(tmp_path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no FIFOs on this system")
def test_fifo(tmp_path):
    """Opening one would wait for a writer for ever."""
    os.mkfifo(tmp_path / "pipe.txt")
    assert "no regular file" in unreadable(tmp_path / "pipe.txt")


@pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="no /dev/zero on this system")
def test_endless_device():
    """A file without an end."""
    assert "no regular file" in unreadable("/dev/zero")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read anything")
def test_file_without_permission(tmp_path):
    """The system's reason is passed on."""
    path = tmp_path / "scene.txt"
    path.write_text("")
    path.chmod(0)
    assert "cannot be read" in unreadable(path)


def test_too_large(tmp_path):
    """A file beyond the limit is not read to its end."""
    path = tmp_path / "scene.txt"
    with open(path, "wb") as file:
        file.truncate(source_text.MAX_BYTES + 1)
    assert "larger than" in unreadable(path)


def test_link_to_itself(tmp_path):
    """A circle of links."""
    (tmp_path / "loop.txt").symlink_to("loop.txt")
    assert "cannot be read" in unreadable(tmp_path / "loop.txt")
