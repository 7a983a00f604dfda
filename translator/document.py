"""The typed document: what a scene file says, before anything is made of it.

Lengths are in scene units, colours are linear RGB, and vectors are tuples of three numbers.
"""

from dataclasses import dataclass, field

from relume.translator.diagnostics import LineReports
from relume.translator.document_display import Displayed
from relume.translator.forms.coefficients import COEFFICIENTS, UNUSED_MEAN
from relume.translator.forms.names import NAME
from relume.translator.forms.numbers import (
    FLAG,
    INTEGER,
    NUMBER,
    NUMBER_ON_EITHER_LINE,
    Quadruple,
    Triple,
)
from relume.translator.forms.phase import MEAN_COSINE
from relume.translator.forms.transforms import TRANSFORM_BLOCK, Transform
from relume.translator.forms.variables import VARIABLES
from relume.translator.gravity import OUTSIDE, BlackHole, WormHole
from relume.translator.keywords import BLOCK, ENVIRONMENT, below, beside, document_fields, keyword
from relume.translator.objects import BLACK, SceneObject

MAX_SIDE = 16384
"""Longest side of a picture [pixel]."""

MAX_PIXELS = 2**26
"""Most pixels of a picture."""

MAX_SAMPLES = 2**40
"""Most samples of a pixel."""


@document_fields
@dataclass(repr=False)
class Document(Displayed):
    """A scene file."""

    image: tuple[int, int] = below(
        "IMAGE", INTEGER, 2, (320, 240), "Width and height of the picture.",
        low=1, high=MAX_SIDE, unit="pixel", environment=("IMAGE_X", "IMAGE_Y"), section="4",
    )
    output: str = below(
        "OUTPUT", NAME, 1, "output.ppm", "Name of the picture file.", section="13.5"
    )
    suffix: str = keyword(
        "SUFFIX_SYMBOL", ENVIRONMENT, NAME, 1, "",
        "Text appended to the stem of the picture's name.",
        environment=("SUFFIX_SYMBOL",), section="3",
    )
    image_dump: float = below(
        "IMAGEDUMP", NUMBER, 1, 60.0, "Interval between dumps of the picture so far; 0 for none.",
        low=0, unit="s", environment=("IMAGEDUMP",), section="4",
    )
    time_limit: float = below(
        "TIMELIMIT", NUMBER, 1, -1.0, "Time after which rendering stops; below 0 for no limit.",
        unit="h", environment=("TIMELIMIT",), section="4",
    )
    screen: Triple = below(
        "SCREEN", NUMBER, 3, (30.0, 30.0, 40.0),
        "Width (for a square picture), height and distance of the screen.",
        above=0, unit="scene unit", section="5.1",
    )
    sampling: int = below(
        "SAMPLING", INTEGER, 1, 8, "Samples of a sub-pixel; runs of a Metropolis render.",
        low=1, high=MAX_SAMPLES, environment=("SAMPLING",), section="13.1",
    )
    supersampling: int = below(
        "SUPERSAMPLING", INTEGER, 1, 2, "Sub-pixels along each side of a pixel.",
        low=1, high=2**20, environment=("SUPERSAMPLING",), section="13.1",
    )
    thread: float | None = below(
        "THREAD", NUMBER, 1, None, "Number of threads; by default one for each core.",
        low=1, environment=("OMP_NUM_THREADS",), section="4",
    )
    camera_pos: Triple = below(
        "CAMERA_POS", NUMBER, 3, (50.0, 52.0, 220.0), "Position of the camera.",
        unit="scene unit", section="5",
    )
    camera_dir: Triple = below(
        "CAMERA_DIR", NUMBER, 3, (0.0, -0.04, -1.0),
        "Viewing direction; need not be of length 1.",
        section="5",
    )
    camera_upvec: Triple = below(
        "CAMERA_UPVEC", NUMBER, 3, (0.0, 1.0, 0.0), "Up direction; need not be orthogonal.",
        section="5",
    )
    target_pos: Triple | None = below(
        "TARGET_POS", NUMBER, 3, None, "Point to look at; replaces the viewing direction.",
        unit="scene unit", section="5",
    )
    camera_angle: float | None = below(
        "CAMERA_ANGLE", NUMBER, 1, None, "Field of view; replaces the size of the screen.",
        above=0, high=179.9, unit="degree", section="5.2",
    )
    camera_matrix: list[Transform] = keyword(
        "CAMERA_MATRIX", BLOCK, TRANSFORM_BLOCK, 0, [], "Lines that turn and move the camera.",
        section="5.3",
    )
    lens: tuple[float, float] = below(
        "LENS", NUMBER, 2, (-1.0, 0.0),
        "Radius of the lens (0 or less: a pinhole) and focal distance.",
        unit="scene unit", section="5.5", in_manual=False,
    )
    variables: dict[str, float] = beside(
        "VAR", VARIABLES, 1, {},
        "Define a variable for later expressions; the first counts.",
        section="2",
    )
    depth: float = below(
        "DEPTH", NUMBER, 1, 8.0,
        "Path depth up to which roulette ends no path. Without it those that tell least may end "
        "from their second bounce on.",
        low=0, section="13.2", in_manual=False,
    )
    depth_limit: float = below(
        "DEPTH_LIMIT", NUMBER, 1, 64.0, "Depth beyond which the program's roulette hardened.",
        low=0, section="13.2", in_manual=False,
    )
    next_event_estimation: bool = below(
        "nextEventEstimation", FLAG, 1, False, "Sample lights explicitly.",
        environment=("NEXTEVENTESTIMATION",), section="13.3",
    )
    participating_media: bool = below(
        "participatingMedia", FLAG, 1, False, "Fill the space outside all objects with a medium.",
        section="10.1",
    )
    scattering: Triple = below(
        "SCATTERING", COEFFICIENTS, 3, BLACK,
        f"Scattering coefficients of the medium. {UNUSED_MEAN}",
        low=0, unit="1/scene unit", section="10.1",
    )
    absorbing: Triple = below(
        "ABSORBING", COEFFICIENTS, 3, BLACK,
        f"Absorption coefficients of the medium. {UNUSED_MEAN}",
        low=0, unit="1/scene unit", section="10.1",
    )
    phase: Triple = below(
        "PAHASE", MEAN_COSINE, 3, BLACK,
        "Mean cosine of the Henyey-Greenstein phase function: one number on the next line, or one "
        "for each channel on the same line.",
        low=-1, high=1, aliases=("PHASE",), section="10.1",
    )
    tent_filter: bool = below("tentfilter", FLAG, 1, False, "Reconstruct with a tent filter.",
                          section="13.4")
    gamma_offset: float = below(
        "gamma_offset", NUMBER, 1, 0.0, "Exponent of display files; 0 stands for 1/2.2.",
        low=0, high=10, section="13.5",
    )
    luminance_cutoff: float = below(
        "luminance_cutoff", NUMBER, 1, 0.0,
        "Largest luminance that one sample may add to a pixel's average; 0 for no limit.",
        low=0, aliases=("luminacnce_cuttoff",), environment=("LUMINANCE_CUTOFF",), section="13.4",
    )
    sensor_response: float = below(
        "sensor_response", NUMBER, 1, 1.0, "Factor of the finished picture.",
        low=0, section="4", in_manual=False,
    )
    background: Triple = below(
        "BACKGROUND", NUMBER, 3, BLACK, "Radiance of the surroundings.",
        low=0, section="4", in_manual=False,
    )
    ambient: Triple = beside(
        "ENV_LIGHT", NUMBER_ON_EITHER_LINE, 3, BLACK,
        "Radiance added at every surface that is no light.",
        low=0, aliases=("ENVLIGHT",), environment=("ENVLIGHT_R", "ENVLIGHT_G", "ENVLIGHT_B"),
        section="9.6",
    )
    background_texture: str | None = beside(
        "background_texture", NAME, 1, None, "Picture of the surroundings.", section="11.6"
    )
    map_coef: Quadruple = beside(
        "map_coef", NUMBER, 4, (1.0, 0.0, 1.0, 0.0),
        "Turn of the surroundings: theta = a theta + b, phi = c phi + d.", section="11.6",
    )
    coef: float = beside(
        "coef", NUMBER, 1, 1.0, "Factor of the picture of the surroundings.",
        low=0, section="11.6", in_manual=False,
    )
    metropolis: bool = below(
        "metropolisTransport", FLAG, 1, False, "Render with primary sample space Metropolis.",
        environment=("METROPOLIS",), section="13.6",
    )
    erpt: bool = below(
        "energyRedistributionPathTracing", FLAG, 1, False, "Render with energy redistribution.",
        environment=("ERPT",), section="13.7",
    )
    mutation: float = below(
        "mutation", NUMBER, 1, 2.0, "Mutations per pixel; with ERPT the length of a chain.",
        environment=("MUTATION",), section="13.6",
    )
    mlt_sample: float = below(
        "mlt_sample", NUMBER, 1, 0.4,
        "Bootstrap samples per pixel; at least a quarter of the mutations are drawn.", above=0,
        aliases=("pre_sample",), environment=("MLTSAMPLE",), section="13.6",
    )
    mlt_resampling: bool = below(
        "mlt_resampling", FLAG, 1, False, "Bootstrap anew for every run.",
        environment=("MLTRESAMPLE",), section="13.6",
    )
    mlt_r1r2: tuple[float, float] = below(
        "mlt_r1r2", NUMBER, 2, (0.0, 0.0), "Mutation sizes; without effect in the program.",
        section="4", in_manual=False,
    )
    velocity: Triple = below(
        "velocity", NUMBER, 3, BLACK, "Velocity of the camera, with `special_relativity_effects`.",
        unit="speed of light", **OUTSIDE,
    )
    special_relativity_effects: bool = below(
        "special_relativity_effects", FLAG, 1, False, "Aberration by the velocity of the camera.",
        **OUTSIDE,
    )
    color_doppler_factor_effect: float = below(
        "color_doppler_factor_effect", NUMBER, 1, 0.0,
        "Share of the Doppler shift in the colours: of what a moving camera sees, and of disks.",
        low=0, high=1, **OUTSIDE,
    )
    use_accretion_disk_temperature: bool = below(
        "use_accretion_disk_temperature", FLAG, 1, False,
        "Colours of disks from their temperature.", **OUTSIDE,
    )
    use_mollweide_projection: bool = below(
        "use_mollweide_projection", FLAG, 1, False, "Whole-sky camera, by Mollweide's projection.",
        **OUTSIDE,
    )
    objects: list[SceneObject] = field(default_factory=list)
    gravity: list[BlackHole | WormHole] = field(default_factory=list)
    taken: dict[str, bool] = field(default_factory=dict, compare=False)
    path: str = field(default="", compare=False)
    lines: LineReports = field(
        default_factory=lambda: LineReports(Document), compare=False, repr=False
    )
