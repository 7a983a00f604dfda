"""Blocks that hold attribute lines up to the next empty line, other than `OBJECT`."""

from dataclasses import dataclass, field

from relume.translator.diagnostics import LineReports
from relume.translator.keywords import SAME_LINE, document_fields, keyword


@dataclass(frozen=True)
class Transform:
    """One line of a matrix definition (spec sections 5.3 and 6.3).

    Attributes:
        kind: `rotation` (about X, then Y, then Z, right handed), `translate` or `scale`.
        values: three numbers: degrees, scene units or factors.
    """

    kind: str
    values: tuple[float, float, float]


TRANSFORMS = {
    "rotation": "Rotate about the world's X, then Y, then Z axis, right handed [degree].",
    "translate": "Move by a vector [scene unit].",
    "scale": "Scale about the world's origin by a factor for each axis.",
}


def outside(name, kind, arity, default, doc):
    """A row of a block that the manual does not know."""
    return keyword(name, SAME_LINE, kind, arity, default, doc, section="14", in_manual=False)


@document_fields
@dataclass
class BlackHole:
    """A `BLACKHOLE [x y z]` block: outside the manual, parsed and reported as unsupported."""

    position: tuple | None = None
    dist: float = outside("dist", "number", 1, 10000.0, "Distance of the observer.")
    geodesics_max_length: float = outside(
        "geodesics_max_length", "number", 1, 10000.0, "Longest geodesic."
    )
    accretion_disk: float = outside("accretion_disk", "number", 1, 0.0, "Radius of the disk.")
    angular_momentum: float = outside("angular_momentum", "number", 1, 0.0, "Spin of the hole.")
    initial_condition: float = outside("initial_condition", "number", 1, 0.0, "Start of the ray.")
    accretion_disk_texture: str | None = outside(
        "accretion_disk_texture", "text", 1, None, "Picture of the disk."
    )
    background_texture: str | None = outside("background_texture", "text", 1, None,
                                             "Picture of the sky.")
    map_coef: tuple = outside("map_coef", "number", 4, (1.0, 0.0, 1.0, 0.0), "Turn of the sky.")
    coef: float = outside("coef", "number", 1, 1.0, "Factor of the sky.")
    lines: LineReports = field(
        default_factory=lambda: LineReports(BlackHole), compare=False, repr=False
    )


@document_fields
@dataclass
class WormHole:
    """A `WORMHOLE` block: outside the manual, parsed and reported as unsupported."""

    position: tuple | None = None
    entrance: tuple | None = outside("in", "number", 3, None, "Position of the entrance.")
    exit: tuple | None = outside("out", "number", 3, None, "Position of the exit.")
    rho: float = outside("Rho", "number", 1, 1.3, "Radius of the throat.")
    a: float = outside("a", "number", 1, 0.5, "Half length of the throat.")
    w: float = outside("W", "number", 1, 0.05, "Lensing width.")
    sign: float = outside("sign", "number", 1, 0.0, "Side of the observer.")
    dist: float = outside("dist", "number", 1, 10000.0, "Distance of the observer.")
    geodesics_max_length: float = outside(
        "geodesics_max_length", "number", 1, 10000.0, "Longest geodesic."
    )
    background_texture1: str | None = outside("background_texture1", "text", 1, None, "Near sky.")
    background_texture2: str | None = outside("background_texture2", "text", 1, None, "Far sky.")
    map_coef1: tuple = outside("map_coef1", "number", 4, (1.0, 0.0, 1.0, 0.0),
                               "Turn of the near sky.")
    map_coef2: tuple = outside("map_coef2", "number", 4, (1.0, 0.0, 1.0, 0.0),
                               "Turn of the far sky.")
    coef1: float = outside("coef1", "number", 1, 1.0, "Factor of the near sky.")
    coef2: float = outside("coef2", "number", 1, 1.0, "Factor of the far sky.")
    lines: LineReports = field(
        default_factory=lambda: LineReports(WormHole), compare=False, repr=False
    )
