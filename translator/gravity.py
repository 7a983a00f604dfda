"""Blocks of general relativity, `BLACKHOLE` and `WORMHOLE`, which the manual does not know."""

from dataclasses import dataclass, field

from relume.translator.diagnostics import LineReports
from relume.translator.forms.names import NAME
from relume.translator.forms.numbers import NUMBER, Quadruple, Triple
from relume.translator.keywords import beside, document_fields

OUTSIDE = {"section": "14", "in_manual": False}
"""What the rows of keywords have in common that the manual does not know."""


@document_fields
@dataclass
class BlackHole:
    """A `BLACKHOLE [x y z]` block: outside the manual, parsed and reported as unsupported."""

    position: Triple | None = None
    dist: float = beside("dist", NUMBER, 1, 10000.0, "Distance of the observer.", **OUTSIDE)
    geodesics_max_length: float = beside(
        "geodesics_max_length", NUMBER, 1, 10000.0, "Longest geodesic.", **OUTSIDE
    )
    accretion_disk: float = beside(
        "accretion_disk", NUMBER, 1, 0.0, "Radius of the disk.", **OUTSIDE
    )
    angular_momentum: float = beside(
        "angular_momentum", NUMBER, 1, 0.0, "Spin of the hole.", **OUTSIDE
    )
    initial_condition: float = beside(
        "initial_condition", NUMBER, 1, 0.0, "Start of the ray.", **OUTSIDE
    )
    accretion_disk_texture: str | None = beside(
        "accretion_disk_texture", NAME, 1, None, "Picture of the disk.", **OUTSIDE
    )
    background_texture: str | None = beside(
        "background_texture", NAME, 1, None, "Picture of the sky.", **OUTSIDE
    )
    map_coef: Quadruple = beside(
        "map_coef", NUMBER, 4, (1.0, 0.0, 1.0, 0.0), "Turn of the sky.", **OUTSIDE
    )
    coef: float = beside("coef", NUMBER, 1, 1.0, "Factor of the sky.", **OUTSIDE)
    lines: LineReports = field(
        default_factory=lambda: LineReports(BlackHole), compare=False, repr=False
    )


@document_fields
@dataclass
class WormHole:
    """A `WORMHOLE` block: outside the manual, parsed and reported as unsupported."""

    position: Triple | None = None
    entrance: Triple | None = beside("in", NUMBER, 3, None, "Position of the entrance.", **OUTSIDE)
    exit: Triple | None = beside("out", NUMBER, 3, None, "Position of the exit.", **OUTSIDE)
    rho: float = beside("Rho", NUMBER, 1, 1.3, "Radius of the throat.", **OUTSIDE)
    a: float = beside("a", NUMBER, 1, 0.5, "Half length of the throat.", **OUTSIDE)
    w: float = beside("W", NUMBER, 1, 0.05, "Lensing width.", **OUTSIDE)
    sign: float = beside("sign", NUMBER, 1, 0.0, "Side of the observer.", **OUTSIDE)
    dist: float = beside("dist", NUMBER, 1, 10000.0, "Distance of the observer.", **OUTSIDE)
    geodesics_max_length: float = beside(
        "geodesics_max_length", NUMBER, 1, 10000.0, "Longest geodesic.", **OUTSIDE
    )
    background_texture1: str | None = beside(
        "background_texture1", NAME, 1, None, "Near sky.", **OUTSIDE
    )
    background_texture2: str | None = beside(
        "background_texture2", NAME, 1, None, "Far sky.", **OUTSIDE
    )
    map_coef1: Quadruple = beside(
        "map_coef1", NUMBER, 4, (1.0, 0.0, 1.0, 0.0), "Turn of the near sky.", **OUTSIDE
    )
    map_coef2: Quadruple = beside(
        "map_coef2", NUMBER, 4, (1.0, 0.0, 1.0, 0.0), "Turn of the far sky.", **OUTSIDE
    )
    coef1: float = beside("coef1", NUMBER, 1, 1.0, "Factor of the near sky.", **OUTSIDE)
    coef2: float = beside("coef2", NUMBER, 1, 1.0, "Factor of the far sky.", **OUTSIDE)
    lines: LineReports = field(
        default_factory=lambda: LineReports(WormHole), compare=False, repr=False
    )


GRAVITY_BLOCKS: dict[str, type[BlackHole | WormHole]] = {
    "BLACKHOLE": BlackHole,
    "WORMHOLE": WormHole,
}
"""The dataclass of each block by the word that opens it."""
