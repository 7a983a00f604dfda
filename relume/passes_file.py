"""Files of passes: an accumulator as an OpenEXR picture that any viewer shows.

The channels R, G, B are the picture so far. The exact sums are further channels of 32-bit integers,
two for each double: `S-20.R.0` holds the low words of the level 2^-20 of the sum of the samples in
red, `Q-20.R.0` that of their squares or `D-20.R.0` of the difference of two sequences (see `exact`
and `accumulator`). The header's attribute `relumePasses` is JSON:
which passes they are, of which render, and a checksum.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from relume.accumulator import Accumulator
from relume.exact import LEVELS, ExactSum
from relume.output import replacing
from relume.passes import PassSet

FORMAT = 2
ATTRIBUTE = "relumePasses"
RGB = "RGB"


class NoPasses(ValueError):
    """A file holds no passes, or they are damaged; the message names it."""


@dataclass(frozen=True)
class Header:
    """What a file says of its passes.

    Attributes:
        render: which render they are of, as `fingerprint.of_render`.
        spp: samples per pixel that the render is to have in the end.
        seconds: time that they took.
        gamma: the scene's `gamma_offset`, for pictures encoded for display.
        facts: what the picture says of its scene, as `metadata.of_scene`.
        size: width and height [pixel].
        passes: as `PassSet` writes itself.
        observations, lead: as `Accumulator`.
        checksum: of the sums.
        format: of the file.
    """

    render: dict[str, Any]
    spp: int
    seconds: float
    gamma: float
    facts: dict[str, str] = field(default_factory=dict)
    size: tuple[int, ...] = ()
    passes: str = ""
    observations: int = 0
    lead: int | None = None
    checksum: int = 0
    format: int = FORMAT

    @property
    def done(self) -> PassSet:
        """The `PassSet`."""
        return PassSet.parse(self.passes)


def write(path: str | Path, accumulator: Accumulator, header: Header) -> None:
    """Write an accumulator in place of the file, so that a reader sees the old or the new one.

    Args:
        path: the file.
        accumulator: what to write.
        header: its attributes from `size` on follow from the accumulator, whatever they are.

    Raises:
        OutputError: the file cannot be written; one that existed is as it was.
    """
    import OpenEXR

    image = accumulator.image()
    channels = {name: np.ascontiguousarray(image[..., i]) for i, name in enumerate(RGB)}
    sums: dict[str, np.ndarray] = {}
    for letter, total in _sums(accumulator).items():
        sums |= _words(letter, total)
    facts = asdict(header) | {
        "size": (accumulator.width, accumulator.height),
        "passes": str(accumulator.done),
        "observations": accumulator.observations,
        "lead": accumulator.lead,
        "checksum": _checksum(sums),
    }
    shape = accumulator.height, accumulator.width
    channels |= {name: words.reshape(shape) for name, words in sums.items()}
    attributes: dict[str, Any] = {
        "compression": OpenEXR.NO_COMPRESSION,
        "type": OpenEXR.scanlineimage,
    }
    attributes[ATTRIBUTE] = json.dumps(facts)
    with replacing(Path(path)) as temporary:
        OpenEXR.File(attributes, channels).write(str(temporary))


def read_header(path: str | Path) -> Header:
    """The `Header` of a file.

    Raises:
        NoPasses: the file holds none.
    """
    import OpenEXR

    if not Path(path).is_file():
        raise NoPasses(f"{path}: no such file")
    try:
        with OpenEXR.File(str(path), header_only=True) as file:
            text = file.header().get(ATTRIBUTE)
    except RuntimeError:
        raise NoPasses(f"{path}: no OpenEXR picture") from None
    if not isinstance(text, str):
        raise NoPasses(f"{path}: a picture without passes")
    try:
        header = Header(**json.loads(text))
        numbers = (*header.size, header.spp, header.observations)
        lead = 0 if header.lead is None else header.lead
        if not isinstance(lead, int) or abs(lead) > header.done.spp:
            raise ValueError("lead out of range")
        sound = len(numbers) == 4 and len(header.done) and isinstance(header.render, dict)
        sound = sound and all(isinstance(text, str) for text in header.facts.values())
        if not sound or not all(isinstance(n, int) and n > 0 for n in numbers):
            raise ValueError("numbers out of range")
        float(header.seconds), float(header.gamma)
    except (AttributeError, TypeError, ValueError) as error:
        raise NoPasses(f"{path}: passes with a damaged header: {error}") from None
    if header.format != FORMAT:
        raise NoPasses(f"{path}: passes of format {header.format}, expected {FORMAT}")
    return header


def holds_passes(path: str | Path) -> bool:
    """Whether a file holds passes, as far as its header says."""
    try:
        read_header(path)
    except NoPasses:
        return False
    return True


def read(path: str | Path) -> Accumulator:
    """Read an accumulator.

    Raises:
        NoPasses: the file holds no passes, or is damaged.
    """
    import OpenEXR

    header = read_header(path)
    width, height = header.size
    with OpenEXR.File(str(path), separate_channels=True) as file:
        read = {n: c.pixels for n, c in file.channels().items()} if file.parts else {}
    words = {name: pixels for name, pixels in read.items() if name[0] in "SQD"}
    alike = all(p.shape == (height, width) for p in words.values())
    if not read or not alike or _checksum(words) != header.checksum:
        raise NoPasses(f"{path}: the passes are damaged or incomplete")
    result = Accumulator(width, height)
    result.done = header.done
    result.observations = header.observations
    result.lead = header.lead
    for letter, total in _sums(result).items():
        _restore(letter, total, words)
    return result


def _sums(accumulator: Accumulator) -> dict[str, ExactSum]:
    """The exact sums by the letter of their channels."""
    return {"S": accumulator.sum, "Q": accumulator.squares, "D": accumulator.difference}


def _words(letter: str, total: ExactSum) -> dict[str, np.ndarray]:
    """The planes of an `ExactSum` as 32-bit words by the name of their channel."""
    total.carry()
    result = {}
    for exponent, plane in total.levels.items():
        halves = plane.astype("<f8").view("<u4")
        for c, name in enumerate(RGB):
            for half in (0, 1):
                words = np.ascontiguousarray(halves[c, half::2], np.uint32)
                result[f"{letter}{exponent:+d}.{name}.{half}"] = words
    if total.special is not None:
        special = np.ascontiguousarray(total.special, np.float32).view(np.uint32)
        result |= {f"{letter}.{name}": special[c] for c, name in enumerate(RGB)}
    return result


def _restore(letter: str, total: ExactSum, words: Mapping[str, np.ndarray]) -> None:
    """Fill an `ExactSum` from what `_words` made."""
    for exponent in LEVELS:
        if f"{letter}{exponent:+d}.R.0" in words:
            halves = np.empty((*total.shape, 2), "<u4")
            for c, name in enumerate(RGB):
                for half in (0, 1):
                    halves[c, :, half] = words[f"{letter}{exponent:+d}.{name}.{half}"].ravel()
            total.levels[exponent] = halves.view("<f8")[..., 0].astype(float)
    if f"{letter}.R" in words:
        special = [words[f"{letter}.{name}"].ravel() for name in RGB]
        total.special = np.stack(special).view(np.float32)


def _checksum(words: Mapping[str, np.ndarray]) -> int:
    total = 0
    for name in sorted(words):
        total = zlib.crc32(np.ascontiguousarray(words[name]).data.cast("B"), total)
    return total
