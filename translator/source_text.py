"""From the bytes of a scene file to its lines."""

import stat
from pathlib import Path

from relume.translator.diagnostics import Problem, SceneError

MAX_BYTES = 32 * 2**20
"""Largest scene file that is read."""

MAX_LINES = 1_000_000
"""Most lines that are read."""

MAX_LINE = 65536
"""Longest line, in characters, that is read."""


def read_lines(path):
    """Read a scene file and split it into lines without line ends.

    Accepts UTF-8 with or without byte order mark and cp932, LF and CRLF, and a missing last line
    end (spec section 1.1).

    Raises:
        SceneError: the file is missing, a directory, no regular file, unreadable, too large,
            binary, in no accepted encoding, or has absurdly many or long lines.
    """
    return split(_read_bytes(path), path)


def _read_bytes(path):
    try:
        mode = Path(path).stat().st_mode
        if stat.S_ISDIR(mode):
            raise SceneError(path, [Problem(0, 0, "is a directory, expected a scene file", "file")])
        if not stat.S_ISREG(mode):
            raise SceneError(path, [Problem(0, 0, "is no regular file", "file")])
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


def split(data, name):
    """Decode the bytes of a scene file and split them into lines; errors as `read_lines`."""
    data = data.removeprefix(b"\xef\xbb\xbf")
    if (at := data.find(b"\0")) >= 0:
        line, column = _place(data, at)
        message = "a NUL byte: binary data, or text in UTF-16; expected text in UTF-8 or cp932"
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
    for k, line in enumerate(lines):
        if len(line) > MAX_LINE:
            message = f"line of {len(line)} characters, expected at most {MAX_LINE}"
            raise SceneError(name, [Problem(k + 1, MAX_LINE + 1, message, "file")])
    return lines


def _place(data, at):
    before = data[:at]
    return before.count(b"\n") + 1, at - before.rfind(b"\n")
