"""Pictures in the terminal: by the protocols of kitty and iTerm2, or as sixels.

Sources: kitty, "Terminal graphics protocol"; iTerm2, "Inline images protocol"; DEC, VT330/VT340
programmer reference manual, chapter 14, "Graphics programming".
"""

from __future__ import annotations

import base64
import io
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from relume import developing, output
from relume.tone import Look

if TYPE_CHECKING:
    from PIL import Image
    from rich.console import Console

CHUNK = 4096
"""Most characters of one escape sequence of kitty."""

WIDEST = 800
"""Widest sixel picture [pixel]; wider ones are reduced."""

SIXEL_TERMINALS = ("sixel", "mlterm", "foot", "contour", "yaft")
"""Beginnings of `TERM`, or parts of it, of terminals that take sixels."""


def show(path: Path, look: Look, console: Console) -> bool:
    """Print a picture, where the terminal shows any.

    Args:
        path: of the picture, of any format that is written.
        look: exposure and tone curve of a linear one.
        console: where it is printed; nothing is printed into a pipe.

    Returns:
        Whether it was printed.
    """
    kind = protocol(os.environ) if console.is_terminal else ""
    if not kind:
        return False
    console.file.write(encoded(picture(path, look), kind) + "\n")
    console.file.flush()
    return True


def protocol(environ: Mapping[str, str]) -> str:
    """`kitty`, `iterm` or `sixel` by what a terminal says of itself; empty if it shows none."""
    term, program = environ.get("TERM", ""), environ.get("TERM_PROGRAM", "")
    if "KITTY_WINDOW_ID" in environ or "kitty" in term or "ghostty" in (term + program).lower():
        return "kitty"
    if program in ("iTerm.app", "WezTerm", "mintty", "vscode"):
        return "iterm"
    return "sixel" if any(name in term for name in SIXEL_TERMINALS) else ""


def picture(path: Path, look: Look) -> Image.Image:
    """The picture of a file as it is looked at."""
    from PIL import Image

    if not output.is_linear(path):
        with Image.open(path) as opened:
            return opened.convert("RGB")
    found = developing.read(path)
    shown = look.applied(output.repair(found.image)[0])
    return Image.fromarray(output.encode_display(shown, developing.gamma_of(found)))


def encoded(image: Image.Image, kind: str) -> str:
    """The characters that show a picture by a protocol."""
    if kind == "sixel":
        return sixels(image)
    buffer = io.BytesIO()
    image.save(buffer, format="PNG")
    data = base64.b64encode(buffer.getvalue()).decode()
    if kind == "iterm":
        return f"\x1b]1337;File=inline=1;size={len(buffer.getvalue())}:{data}\a"
    chunks = [data[i : i + CHUNK] for i in range(0, len(data), CHUNK)]
    parts = []
    for index, chunk in enumerate(chunks):
        first = "a=T,f=100," if index == 0 else ""
        more = int(index < len(chunks) - 1)
        parts.append(f"\x1b_G{first}m={more};{chunk}\x1b\\")
    return "".join(parts)


def sixels(image: Image.Image) -> str:
    """A picture of at most 256 colours as sixels: columns of six pixels, colour by colour."""
    if image.width > WIDEST:
        image = image.resize((WIDEST, max(1, image.height * WIDEST // image.width)))
    indexed = image.quantize(256)
    palette, pixels = indexed.getpalette() or [], np.asarray(indexed)
    height, width = pixels.shape
    parts = [f'\x1bPq"1;1;{width};{height}']
    for index in np.unique(pixels).tolist():
        r, g, b = (round(v / 2.55) for v in palette[3 * index : 3 * index + 3])
        parts.append(f"#{index};2;{r};{g};{b}")
    for top in range(0, height, 6):
        rows = pixels[top : top + 6]
        bit = 1 << np.arange(len(rows))
        for index in np.unique(rows).tolist():
            line = (63 + bit @ (rows == index)).astype(np.uint8).tobytes().decode()
            parts.append(f"#{index}{_runs(line)}$")
        parts.append("-")
    return "".join(parts) + "\x1b\\"


def _runs(line: str) -> str:
    """Repeated characters as `!COUNT CHARACTER`."""
    return re.sub(r"(.)\1{3,}", lambda run: f"!{len(run[0])}{run[1]}", line)
