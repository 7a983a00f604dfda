"""The typed `OBJECT` block: a shape with its attributes (spec sections 6 to 11)."""

from dataclasses import dataclass, field

from relume.translator.blocks import Transform
from relume.translator.diagnostics import LineReports
from relume.translator.keywords import NEXT_LINE, SAME_LINE, document_fields, keyword
from relume.translator.shapes import (
    Annulus,
    Disk,
    Hemisphere,
    InfinityLight,
    MeshFile,
    Plane,
    Sphere,
    UVPlane,
)

Shape = Sphere | Hemisphere | UVPlane | Plane | Disk | Annulus | MeshFile | InfinityLight

REFLECTIONS = {
    "diffuse": ("diffuse", "Lambert's diffuse reflection; sets `roughness` to 1."),
    "specular": ("specular", "Perfect mirror; sets `roughness` to 0."),
    "reflection": ("glass", "Smooth glass: reflection and refraction."),
    "ward_brdf": ("ward", "Ward's glossy reflection."),
    "phong_brdf": ("phong", "Phong's glossy reflection."),
    "Subsurface_Scattering": ("subsurface",
                              "Subsurface scattering behind the surface named before."),
    "reflection1": ("glass",
                    "Glass with the index of formula 1; six coefficients on the next line."),
    "reflection2": ("glass",
                    "Glass with the index of formula 2; six coefficients on the next line."),
    "reflection99": ("glass", "Glass with the index 1.4 + 50 / (lambda - 230), lambda in nm."),
}
"""What may follow `reflection`: the kind of surface and the sentence that documents it."""

DISPERSION = {"reflection1": "cauchy6", "reflection2": "sellmeier3", "reflection99": "formula99"}


@dataclass(frozen=True)
class Reflection:
    """How a surface reflects: what the `reflection` lines of an object add up to.

    Attributes:
        kind: `diffuse`, `specular`, `glass`, `ward` or `phong`; None where no line says.
        subsurface: whether light scatters below that surface.
        dispersion: None, `cauchy6`, `sellmeier3` (wavelengths in micrometres) or `formula99` (nm).
        coefficients: the six coefficients of the dispersion formula; empty for `formula99`.
    """

    kind: str | None = None
    subsurface: bool = False
    dispersion: str | None = None
    coefficients: tuple = ()

    @property
    def lets_pass(self):
        """Whether light crosses the surface."""
        return self.kind == "glass" or self.subsurface


def a(name, kind, arity, default, doc, **rest):
    """A row with its values on the same line."""
    return keyword(name, SAME_LINE, kind, arity, default, doc, **rest)


def n(name, kind, arity, default, doc, **rest):
    """A row with its values on the next line."""
    return keyword(name, NEXT_LINE, kind, arity, default, doc, **rest)


BLACK = (0.0, 0.0, 0.0)


@document_fields
@dataclass
class SceneObject:
    """An `OBJECT` block."""

    shape: Shape | None = None
    color: tuple = a("color", "number", 3, BLACK, "Reflectance; diffuse part of Ward and Phong.",
                     low=0, section="8")
    emission: tuple = a("emission", "number", 3, BLACK, "Emitted radiance.", low=0, section="9.1")
    specular: tuple = a("specular", "number", 3, BLACK, "Colour of the lobe of Ward and Phong.",
                        low=0, section="8")
    reflection: Reflection = keyword("reflection", SAME_LINE, "reflection", 1, Reflection(),
                                     "How the surface reflects.", section="8")
    roughness: float | None = a(
        "roughness", "number", 1, None,
        "Weight of the diffuse part against the mirror; not a microfacet roughness.",
        low=0, high=1, section="8.1")
    ward_brdf: tuple | None = a(
        "ward_brdf", "ward", 4, None, "Ward's rho_d, rho_s, alpha_x and alpha_y.",
        low=0, section="8.5")
    phong_brdf: tuple | None = a(
        "phong_brdf", "number", 3, None, "Phong's rho_d, rho_s and exponent.", low=0, section="8.6")
    refractive_index: float = a(
        "refractive_index", "number", 1, 1.5, "Index of refraction inside; outside it is 1.",
        low=0, section="8.4")
    r_refractive_index: float = a(
        "r_refractive_index", "number", 1, 1.0, "Relative index that the dipole uses.",
        low=0, section="7", in_manual=False)
    scattering: tuple = n("SCATTERING", "number", 3, BLACK, "Scattering coefficients inside.",
                          low=0, unit="1/scene unit", dummies=1, section="10.2")
    absorbing: tuple = n("ABSORBING", "number", 3, BLACK, "Absorption coefficients inside.",
                         low=0, unit="1/scene unit", dummies=1, section="10.2")
    phase: tuple | None = keyword(
        "PAHASE", NEXT_LINE, "phase", 3, None,
        "Mean cosine of the phase function inside: one number on the next line or three on this.",
        low=-1, high=1, aliases=("PHASE",), section="10.2")
    level: int = n("level", "integer", 1, -1,
                   "Scattering order: -2 multiple alone, -1 all, 0 none, n at most n.",
                   low=-2, high=2**20, section="10.2")
    bssrdf: bool = n("BSSRDF", "flag", 1, True, "Dipole (1) or simulation (0).",
                     environment=("USE_BSSRDF",), section="10.2")
    material_symbol: str | None = n("MATERIAL_SYMBOL", "symbol", 1, None,
                                    "Name of a measured material.", section="10.3")
    material_scale: float = n("MATERIAL_SCALE", "number", 1, 1.0, "Factor of both coefficients.",
                              low=0, section="10.2")
    material_r_max: float = n("MATERIAL_R_MAX", "number", 1, 1.0,
                              "Factor of the dipole's search radius.", above=0, section="10.2")
    normal: int = a("normal", "integer", 1, 1, "Below 0: turn the normal round.", section="7")
    smooth: bool = a("smooth", "flag", 1, False, "Interpolate the normals of a mesh.", section="7")
    shadow: bool = a("shadow", "flag", 1, False, "Show the plane only where it is shaded.",
                     section="11.7")
    back: bool = a("back", "flag", 1, True, "Back side; without effect in the program.",
                   section="7", in_manual=False)
    background: bool = a("background", "flag", 1, False,
                         "Seen by the camera, show the unlit colour.",
                         section="7", in_manual=False)
    media_ignore_front_back: float = a(
        "media_ignore_front_back", "number", 1, 0.0, "Let the medium act on back sides too.",
        section="10.1", in_manual=False)
    transforms: list[Transform] = field(default_factory=list)
    texture: str | None = a("texture", "text", 1, None, "Picture that replaces the colours.",
                            section="11.2")
    bump_texture: str | None = a("bump_texture", "text", 1, None,
                                 "Height map that turns the normal.",
                                 section="11.8", in_manual=False)
    ibl_texture: str | None = a("ibl_texture", "text", 1, None,
                                "Picture that the object emits.", section="11.5")
    ibl_texture_coef: float = a("ibl_texture_coef", "number", 1, 1.0, "Factor of that picture.",
                                low=0, section="11.5")
    hemisphere_map: bool = a("hemisphere_map", "flag", 1, False,
                             "Picture of a dome seen from above.",
                             aliases=("circle_map",), section="11.5")
    angular_map: bool = a("angular_map", "flag", 1, False, "Picture is a light probe.",
                          section="11.5")
    panoramic_map: bool = a("panoramic_map", "flag", 1, False, "Picture by latitude and longitude.",
                            section="11.5")
    equirectangular_map: bool = a("equirectangular_map", "flag", 1, False,
                                  "Picture by latitude and longitude, upside down.",
                                  section="11.5", in_manual=False)
    disk_map: bool = a("disk_map", "flag", 1, False, "Picture of a disk, cut out around it.",
                       section="11.3", in_manual=False)
    repeat: int = a("repeat", "integer", 1, 1, "How often a texture repeats along each side.",
                    low=1, high=10**6, section="11.1", in_manual=False)
    parallel_light: bool = a("parallel_light", "flag", 1, False, "Make the plane a parallel light.",
                             section="9.3")
    parallel_light_dir: tuple | None = a(
        "parallel_light_dir", "number", 3, None, "Direction of that light; by default the normal.",
        section="9.3")
    spot_light: bool = a("spot_light", "flag", 1, False, "Make the sphere a spot light.",
                         section="9.5")
    spot_light_dir: tuple = a("spot_light_dir", "number", 3, (0.0, -1.0, 0.0), "Axis of the spot.",
                              section="9.5")
    spot_light_angle: tuple = a(
        "spot_light_angle", "number", 2, (30.0, 5.0), "Half angle w and fall-off angle f.",
        low=0, high=180, unit="degree", section="9.5")
    spot_light_falloff: float = a("spot_light_falloff", "number", 1, 2.0,
                                  "Exponent of the fall-off.",
                                  low=0, section="9.5")
    spot_attenuation: tuple = a(
        "spot_attenuation", "number", 3, (0.0, 0.0, 1.0), "a, b and c of t = a + b d + c d^2.",
        low=0, section="9.5")
    blackhole_disk: bool = a("blackhole_disk", "flag", 1, False, "Disk of a black hole.",
                             section="14", in_manual=False)
    lines: LineReports = field(
        default_factory=lambda: LineReports(SceneObject, also=("subsurface",)),
        compare=False,
        repr=False,
    )


