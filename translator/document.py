"""The typed document: what a scene file says, before anything is made of it.

Lengths are in scene units, colours are linear RGB, and vectors are tuples of three numbers.
"""

from dataclasses import dataclass, field

from relume.translator.blocks import BlackHole, Transform, WormHole
from relume.translator.diagnostics import LineReports
from relume.translator.keywords import (
    BLOCK,
    ENVIRONMENT,
    NEXT_LINE,
    SAME_LINE,
    document_fields,
    keyword,
)
from relume.translator.objects import SceneObject

MAX_SIDE = 16384
"""Longest side of a picture [pixel]."""

MAX_PIXELS = 2**26
"""Most pixels of a picture."""

MAX_SAMPLES = 2**40
"""Most samples of a pixel."""


def n(name, kind, arity, default, doc, **rest):
    """A row with its values on the next line."""
    return keyword(name, NEXT_LINE, kind, arity, default, doc, **rest)


def s(name, kind, arity, default, doc, **rest):
    """A row with its values on the same line."""
    return keyword(name, SAME_LINE, kind, arity, default, doc, **rest)


OUTSIDE = {"section": "14", "in_manual": False}
BLACK = (0.0, 0.0, 0.0)


@document_fields
@dataclass
class Document:
    """A scene file."""

    image: tuple[int, int] = n(
        "IMAGE", "integer", 2, (320, 240), "Width and height of the picture.",
        low=1, high=MAX_SIDE, unit="pixel", environment=("IMAGE_X", "IMAGE_Y"), section="4",
    )
    output: str = n("OUTPUT", "text", 1, "output.ppm", "Name of the picture file.", section="13.5")
    suffix: str = keyword(
        "SUFFIX_SYMBOL", ENVIRONMENT, "text", 1, "",
        "Text appended to the stem of the picture's name.",
        environment=("SUFFIX_SYMBOL",), section="3",
    )
    image_dump: float = n(
        "IMAGEDUMP", "number", 1, 60.0, "Interval between dumps of the picture so far; 0 for none.",
        low=0, unit="s", environment=("IMAGEDUMP",), section="4",
    )
    time_limit: float = n(
        "TIMELIMIT", "number", 1, -1.0, "Time after which rendering stops; below 0 for no limit.",
        unit="h", environment=("TIMELIMIT",), section="4",
    )
    screen: tuple[float, float, float] = n(
        "SCREEN", "number", 3, (30.0, 30.0, 40.0),
        "Width (for a square picture), height and distance of the screen.",
        above=0, unit="scene unit", section="5.1",
    )
    sampling: int = n(
        "SAMPLING", "integer", 1, 8, "Samples of a sub-pixel; runs of a Metropolis render.",
        low=1, high=MAX_SAMPLES, environment=("SAMPLING",), section="13.1",
    )
    supersampling: int = n(
        "SUPERSAMPLING", "integer", 1, 2, "Sub-pixels along each side of a pixel.",
        low=1, high=2**20, environment=("SUPERSAMPLING",), section="13.1",
    )
    thread: float | None = n(
        "THREAD", "number", 1, None, "Number of threads; by default one for each core.",
        low=1, environment=("OMP_NUM_THREADS",), section="4",
    )
    camera_pos: tuple = n(
        "CAMERA_POS", "number", 3, (50.0, 52.0, 220.0), "Position of the camera.",
        unit="scene unit", section="5",
    )
    camera_dir: tuple = n(
        "CAMERA_DIR", "number", 3, (0.0, -0.04, -1.0),
        "Viewing direction; need not be of length 1.",
        section="5",
    )
    camera_upvec: tuple = n(
        "CAMERA_UPVEC", "number", 3, (0.0, 1.0, 0.0), "Up direction; need not be orthogonal.",
        section="5",
    )
    target_pos: tuple | None = n(
        "TARGET_POS", "number", 3, None, "Point to look at; replaces the viewing direction.",
        unit="scene unit", section="5",
    )
    camera_angle: float | None = n(
        "CAMERA_ANGLE", "number", 1, None, "Field of view; replaces the size of the screen.",
        above=0, high=179.9, unit="degree", section="5.2",
    )
    camera_matrix: list[Transform] = keyword(
        "CAMERA_MATRIX", BLOCK, "transforms", 0, [], "Lines that turn and move the camera.",
        section="5.3",
    )
    lens: tuple[float, float] = n(
        "LENS", "number", 2, (-1.0, 0.0),
        "Radius of the lens (0 or less: a pinhole) and focal distance.",
        unit="scene unit", section="5.5", in_manual=False,
    )
    variables: dict[str, float] = keyword(
        "VAR", SAME_LINE, "variable", 1, {},
        "Define a variable for later expressions; the first counts.",
        section="2",
    )
    depth: float = n(
        "DEPTH", "number", 1, 8.0, "Path depth up to which no path is ended by roulette.",
        low=0, section="13.2", in_manual=False,
    )
    depth_limit: float = n(
        "DEPTH_LIMIT", "number", 1, 64.0, "Depth beyond which the program's roulette hardened.",
        low=0, section="13.2", in_manual=False,
    )
    next_event_estimation: bool = n(
        "nextEventEstimation", "flag", 1, False, "Sample lights explicitly.",
        environment=("NEXTEVENTESTIMATION",), section="13.3",
    )
    participating_media: bool = n(
        "participatingMedia", "flag", 1, False, "Fill the space outside all objects with a medium.",
        section="10.1",
    )
    scattering: tuple = n(
        "SCATTERING", "number", 3, BLACK, "Scattering coefficients of the medium.",
        low=0, unit="1/scene unit", dummies=1, section="10.1",
    )
    absorbing: tuple = n(
        "ABSORBING", "number", 3, BLACK, "Absorption coefficients of the medium.",
        low=0, unit="1/scene unit", dummies=1, section="10.1",
    )
    phase: tuple = keyword(
        "PAHASE", NEXT_LINE, "phase", 3, BLACK,
        "Mean cosine of the Henyey-Greenstein phase function: one number on the next line, or one "
        "for each channel on the same line.",
        low=-1, high=1, aliases=("PHASE",), section="10.1",
    )
    tent_filter: bool = n("tentfilter", "flag", 1, False, "Reconstruct with a tent filter.",
                          section="13.4")
    gamma_offset: float = n(
        "gamma_offset", "number", 1, 0.0, "Exponent of display files; 0 stands for 1/2.2.",
        low=0, high=10, section="13.5",
    )
    luminance_cutoff: float = n(
        "luminance_cutoff", "number", 1, 0.0,
        "Largest luminance that one sample may add to a pixel's average; 0 for no limit.",
        low=0, aliases=("luminacnce_cuttoff",), environment=("LUMINANCE_CUTOFF",), section="13.4",
    )
    sensor_response: float = n(
        "sensor_response", "number", 1, 1.0, "Factor of the finished picture.",
        low=0, section="4", in_manual=False,
    )
    background: tuple = n(
        "BACKGROUND", "number", 3, BLACK, "Radiance of the surroundings.",
        low=0, section="4", in_manual=False,
    )
    ambient: tuple = keyword(
        "ENV_LIGHT", SAME_LINE, "ambient", 3, BLACK,
        "Radiance added at every surface that is no light.",
        low=0, aliases=("ENVLIGHT",), environment=("ENVLIGHT_R", "ENVLIGHT_G", "ENVLIGHT_B"),
        section="9.6",
    )
    background_texture: str | None = s(
        "background_texture", "text", 1, None, "Picture of the surroundings.", section="11.6"
    )
    map_coef: tuple = s(
        "map_coef", "number", 4, (1.0, 0.0, 1.0, 0.0),
        "Turn of the surroundings: theta = a theta + b, phi = c phi + d.", section="11.6",
    )
    coef: float = s(
        "coef", "number", 1, 1.0, "Factor of the picture of the surroundings.",
        low=0, section="11.6", in_manual=False,
    )
    metropolis: bool = n(
        "metropolisTransport", "flag", 1, False, "Render with primary sample space Metropolis.",
        environment=("METROPOLIS",), section="13.6",
    )
    erpt: bool = n(
        "energyRedistributionPathTracing", "flag", 1, False, "Render with energy redistribution.",
        environment=("ERPT",), section="13.7",
    )
    mutation: float = n(
        "mutation", "number", 1, 2.0, "Mutations per pixel; with ERPT the length of a chain.",
        environment=("MUTATION",), section="13.6",
    )
    mlt_sample: float = n(
        "mlt_sample", "number", 1, 0.4,
        "Bootstrap samples per pixel; at least a quarter of the mutations are drawn.", above=0,
        aliases=("pre_sample",), environment=("MLTSAMPLE",), section="13.6",
    )
    mlt_resampling: bool = n(
        "mlt_resampling", "flag", 1, False, "Bootstrap anew for every run.",
        environment=("MLTRESAMPLE",), section="13.6",
    )
    mlt_r1r2: tuple = n(
        "mlt_r1r2", "number", 2, (0.0, 0.0), "Mutation sizes; without effect in the program.",
        section="4", in_manual=False,
    )
    velocity: tuple = n("velocity", "number", 3, BLACK, "Velocity of the observer.", **OUTSIDE)
    special_relativity_effects: float = n(
        "special_relativity_effects", "number", 1, 0.0, "Aberration and Doppler shift.", **OUTSIDE
    )
    use_accretion_disk_temperature: float = n(
        "use_accretion_disk_temperature", "number", 1, 0.0, "Black body colour of disks.", **OUTSIDE
    )
    color_doppler_factor_effect: float = n(
        "color_doppler_factor_effect", "number", 1, 0.0, "Doppler shift of colours.", **OUTSIDE
    )
    use_mollweide_projection: float = n(
        "use_mollweide_projection", "number", 1, 0.0, "Whole-sky camera.", **OUTSIDE
    )
    objects: list[SceneObject] = field(default_factory=list)
    gravity: list[BlackHole | WormHole] = field(default_factory=list)
    path: str = field(default="", compare=False)
    lines: LineReports = field(
        default_factory=lambda: LineReports(Document), compare=False, repr=False
    )
