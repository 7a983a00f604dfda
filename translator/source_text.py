"""From the bytes of a scene file to its lines."""

from __future__ import annotations

import os
import stat

from relume.translator import files_read
from relume.translator.diagnostics import Problem, SceneError

MAX_BYTES = 32 * 2**20
"""Largest scene file that is read."""

MAX_LINES = 1_000_000
"""Most lines that are read."""

MAX_LINE_LENGTH = 65536
"""Longest line that is read [characters]."""

UTF_16_MARKS = (b"\xff\xfe", b"\xfe\xff")
"""Byte order marks of UTF-16."""

FileName = str | os.PathLike[str]


def read_lines(path: FileName) -> list[str]:
    """Read a scene file and split it into lines without line ends.

    Accepts UTF-8 with or without byte order mark, UTF-16 with it, and cp932, LF and CRLF, and a
    missing last line end (spec section 1.1).

    Raises:
        SceneError: the file is missing, a directory, no regular file, unreadable, too large,
            binary, in no accepted encoding, or has absurdly many or long lines.
    """
    return decode_lines(_read_bytes(path), path)


def _read_bytes(path: FileName) -> bytes:
    try:
        mode = os.stat(path).st_mode
        if stat.S_ISDIR(mode):
            raise SceneError(path, [Problem(0, 0, "is a directory, expected a scene file", "file")])
        if not stat.S_ISREG(mode):
            raise SceneError(path, [Problem(0, 0, "is no regular file", "file")])
        files_read.record(path)
        with open(path, "rb") as file:
            data = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise SceneError(path, [Problem(0, 0, "no such file", "file")]) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise SceneError(path, [Problem(0, 0, f"cannot be read: {reason}", "file")]) from None
    if len(data) > MAX_BYTES:
        limit = f"larger than {MAX_BYTES // 2**20} MiB, no scene file"
        raise SceneError(path, [Problem(0, 0, limit, "file")])
    return data


def decode_lines(data: bytes, name: FileName) -> list[str]:
    """Decode the bytes of a scene file and split them into lines; errors as `read_lines`."""
    if data.startswith(UTF_16_MARKS):
        data = _from_utf_16(data, name)
    data = data.removeprefix(b"\xef\xbb\xbf")
    if (at := data.find(b"\0")) >= 0:
        line, column = _place(data, at)
        message = (
            "a NUL byte: binary data, or text in UTF-16 without a byte order mark; save it as UTF-8"
        )
        raise SceneError(name, [Problem(line, column, message, "file")])
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        try:
            text = data.decode("cp932")
        except UnicodeDecodeError as error:
            line, column = _place(data, error.start)
            message = f"byte 0x{data[error.start]:02x} is neither UTF-8 nor cp932"
            raise SceneError(name, [Problem(line, column, message, "file")]) from None
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n", MAX_LINES)
    if len(lines) > MAX_LINES:
        message = f"more than {MAX_LINES} lines, no scene file"
        raise SceneError(name, [Problem(MAX_LINES + 1, 1, message, "file")])
    for k, each in enumerate(lines):
        if len(each) > MAX_LINE_LENGTH:
            message = f"line of {len(each)} characters, expected at most {MAX_LINE_LENGTH}"
            raise SceneError(name, [Problem(k + 1, MAX_LINE_LENGTH + 1, message, "file")])
    return lines


def _from_utf_16(data: bytes, name: FileName) -> bytes:
    """Text in UTF-16 with a byte order mark, in UTF-8."""
    try:
        return data.decode("utf-16").encode()
    except UnicodeError as error:
        message = f"begins as text in UTF-16, but is not: {getattr(error, 'reason', error)}"
        raise SceneError(name, [Problem(1, 1, message, "file")]) from None


def _place(data: bytes, at: int) -> tuple[int, int]:
    """Line and column of a byte, both from 1."""
    before = data[:at]
    return before.count(b"\n") + 1, at - before.rfind(b"\n")
