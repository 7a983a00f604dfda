"""The typed blocks of general relativity, `BLACKHOLE` and `WORMHOLE` (spec section 14)."""

from dataclasses import dataclass, field

from relume.translator.diagnostics import LineReports
from relume.translator.forms.names import NAME, NAMES
from relume.translator.forms.numbers import INTEGER, NUMBER, Quadruple, Triple
from relume.translator.keywords import beside, document_fields

OUTSIDE = {"section": "14", "in_manual": False}
"""What the rows of keywords have in common that the manual does not know."""

OF_THE_SCENE = ("background_texture", "map_coef", "coef")
"""Words of a `BLACKHOLE` block that are those of the scene: the last one in the file counts."""

STEPS = "Most steps of a ray from surface to surface; below 0 for no limit."
TURN = "Turn of the sky on {side}: theta = a theta + b, phi = c phi + d."


@document_fields
@dataclass
class BlackHole:
    """A `BLACKHOLE [x y z]` block: a hole of mass 1, with its centre at `position`."""

    position: Triple | None = None
    dist: float = beside(
        "dist", NUMBER, 1, 10000.0,
        "Distance of the centre before the camera, where the head line does not tell the centre.",
        unit="scene unit", environment=("BLACK_HOLE_Z",), **OUTSIDE,
    )
    geodesics_max_length: float = beside(
        "geodesics_max_length", NUMBER, 1, 10000.0, STEPS, **OUTSIDE
    )
    accretion_disk: float = beside(
        "accretion_disk", NUMBER, 1, 0.0, "Radius of the disk; without effect in the program.",
        unit="scene unit", **OUTSIDE,
    )
    angular_momentum: float = beside(
        "angular_momentum", NUMBER, 1, 0.0, "Spin about +Z, over the square of the mass.",
        above=-1, under=1, **OUTSIDE,
    )
    initial_condition: int = beside(
        "initial_condition", INTEGER, 1, 0, "How the program starts rays; both give the same.",
        **OUTSIDE,
    )
    accretion_disk_texture: list[str] = beside(
        "accretion_disk_texture", NAMES, 1, [], "Picture of a disk: `blackhole_disk` counts them.",
        **OUTSIDE,
    )
    lines: LineReports = field(
        default_factory=lambda: LineReports(BlackHole), compare=False, repr=False
    )


@document_fields
@dataclass
class WormHole:
    """A `WORMHOLE` block: two mouths, of one room or of two, and the throat between them."""

    entrance: Triple | None = beside(
        "in", NUMBER, 3, None, "Centre of the mouth on this side.", unit="scene unit", **OUTSIDE
    )
    exit: Triple | None = beside(
        "out", NUMBER, 3, None, "Centre of the mouth on the other side.", unit="scene unit",
        **OUTSIDE,
    )
    rho: float = beside(
        "Rho", NUMBER, 1, 1.3, "Radius of the throat.", above=0, unit="scene unit", **OUTSIDE
    )
    a: float = beside(
        "a", NUMBER, 1, 0.5, "Half length of the throat.", unit="scene unit", **OUTSIDE
    )
    w: float = beside(
        "W", NUMBER, 1, 0.05, "Width over which space bends at either end of the throat.",
        above=0, unit="scene unit", **OUTSIDE,
    )
    sign: int = beside("sign", INTEGER, 1, 0, "Below 0: exchange the two skies.", **OUTSIDE)
    dist: float = beside(
        "dist", NUMBER, 1, 10000.0,
        "Distance of this side's mouth before the camera, where there is neither `in` nor `out`.",
        unit="scene unit", environment=("WORM_HOLE_Z",), **OUTSIDE,
    )
    geodesics_max_length: float = beside(
        "geodesics_max_length", NUMBER, 1, 10000.0, STEPS, **OUTSIDE
    )
    background_texture1: str | None = beside(
        "background_texture1", NAME, 1, None, "Picture of the sky on this side.", **OUTSIDE
    )
    background_texture2: str | None = beside(
        "background_texture2", NAME, 1, None, "Picture of the sky on the other side.", **OUTSIDE
    )
    map_coef1: Quadruple = beside(
        "map_coef1", NUMBER, 4, (1.0, 0.0, 1.0, 0.0), TURN.format(side="this side"), **OUTSIDE
    )
    map_coef2: Quadruple = beside(
        "map_coef2", NUMBER, 4, (1.0, 0.0, 1.0, 0.0), TURN.format(side="the other side"), **OUTSIDE
    )
    coef1: float = beside(
        "coef1", NUMBER, 1, 1.0, "Factor of the sky on this side.", low=0, **OUTSIDE
    )
    coef2: float = beside(
        "coef2", NUMBER, 1, 1.0, "Factor of the sky on the other side.", low=0, **OUTSIDE
    )
    lines: LineReports = field(
        default_factory=lambda: LineReports(WormHole), compare=False, repr=False
    )


GRAVITY_BLOCKS: dict[str, type[BlackHole | WormHole]] = {
    "BLACKHOLE": BlackHole,
    "WORMHOLE": WormHole,
}
"""The dataclass of each block by the word that opens it."""
