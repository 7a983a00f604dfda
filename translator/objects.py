"""The typed `OBJECT` block: a shape with its attributes (spec sections 6 to 11)."""

import math
from dataclasses import dataclass, field

from relume.translator.diagnostics import LineReports
from relume.translator.forms.coefficients import COEFFICIENTS, UNUSED_MEAN
from relume.translator.forms.names import MATERIAL_NAME, NAME
from relume.translator.forms.numbers import FLAG, INTEGER, NUMBER, Triple
from relume.translator.forms.phase import MEAN_COSINE
from relume.translator.forms.reflections import REFLECTION_LINES, Reflection
from relume.translator.forms.transforms import Transform
from relume.translator.forms.ward import WARD
from relume.translator.keywords import below, beside, document_fields
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

BLACK = (0.0, 0.0, 0.0)


@document_fields
@dataclass
class SceneObject:
    """An `OBJECT` block."""

    shape: Shape | None = None
    color: Triple = beside(
        "color", NUMBER, 3, BLACK, "Reflectance; diffuse part of Ward and Phong.",
        low=0, section="8",
    )
    emission: Triple = beside(
        "emission", NUMBER, 3, BLACK, "Emitted radiance.", low=0, section="9.1"
    )
    specular: Triple = beside(
        "specular", NUMBER, 3, BLACK, "Colour of the lobe of Ward and Phong.", low=0, section="8"
    )
    reflection: Reflection = beside(
        "reflection", REFLECTION_LINES, 1, Reflection(), "How the surface reflects.", section="8"
    )
    roughness: float | None = beside(
        "roughness", NUMBER, 1, None,
        "Weight of the diffuse part against the mirror; not a microfacet roughness.",
        low=0, high=1, section="8.1",
    )
    ward_brdf: tuple[float, ...] | None = beside(
        "ward_brdf", WARD, 4, None, "Ward's rho_d, rho_s, alpha_x and alpha_y.",
        low=0, section="8.5",
    )
    phong_brdf: Triple | None = beside(
        "phong_brdf", NUMBER, 3, None, "Phong's rho_d, rho_s and exponent.", low=0, section="8.6"
    )
    refractive_index: float = beside(
        "refractive_index", NUMBER, 1, 1.5, "Index of refraction inside; outside it is 1.",
        low=0, section="8.4",
    )
    r_refractive_index: float = beside(
        "r_refractive_index", NUMBER, 1, 1.0, "Relative index that the dipole uses.",
        low=0, section="7", in_manual=False,
    )
    scattering: Triple = below(
        "SCATTERING", COEFFICIENTS, 3, BLACK, f"Scattering coefficients inside. {UNUSED_MEAN}",
        low=0, unit="1/scene unit", section="10.2",
    )
    absorbing: Triple = below(
        "ABSORBING", COEFFICIENTS, 3, BLACK, f"Absorption coefficients inside. {UNUSED_MEAN}",
        low=0, unit="1/scene unit", section="10.2",
    )
    phase: Triple | None = below(
        "PAHASE", MEAN_COSINE, 3, None,
        "Mean cosine of the phase function inside: one number on the next line or three on this.",
        low=-1, high=1, aliases=("PHASE",), section="10.2",
    )
    level: int = below(
        "level", INTEGER, 1, -1,
        "Scattering order: -2 multiple alone, -1 all, 0 none, n at most n.",
        low=-2, high=2**20, section="10.2",
    )
    bssrdf: bool = below(
        "BSSRDF", FLAG, 1, True, "Dipole (1) or simulation (0).",
        environment=("USE_BSSRDF",), section="10.2",
    )
    material_symbol: str | None = below(
        "MATERIAL_SYMBOL", MATERIAL_NAME, 1, None, "Name of a measured material.", section="10.3"
    )
    material_scale: float = below(
        "MATERIAL_SCALE", NUMBER, 1, 1.0, "Factor of both coefficients.", low=0, section="10.2"
    )
    material_r_max: float = below(
        "MATERIAL_R_MAX", NUMBER, 1, 1.0, "Factor of the dipole's search radius.",
        above=0, section="10.2",
    )
    normal: int = beside("normal", INTEGER, 1, 1, "Below 0: turn the normal round.", section="7")
    smooth: bool = beside(
        "smooth", FLAG, 1, False, "Interpolate the normals of a mesh.", section="7"
    )
    shadow: bool = beside(
        "shadow", FLAG, 1, False, "Show the plane only where it is shaded.", section="11.7"
    )
    back: bool = beside(
        "back", FLAG, 1, True, "Back side; without effect in the program.",
        section="7", in_manual=False,
    )
    background: bool = beside(
        "background", FLAG, 1, False, "Seen by the camera, show the unlit colour.",
        section="7", in_manual=False,
    )
    media_ignore_front_back: float = beside(
        "media_ignore_front_back", NUMBER, 1, 0.0, "Let the medium act on back sides too.",
        section="10.1", in_manual=False,
    )
    transforms: list[Transform] = field(default_factory=list)
    texture: str | None = beside(
        "texture", NAME, 1, None, "Picture that replaces the colours.", section="11.2"
    )
    bump_texture: str | None = beside(
        "bump_texture", NAME, 1, None, "Height map that turns the normal.",
        section="11.8", in_manual=False,
    )
    ibl_texture: str | None = beside(
        "ibl_texture", NAME, 1, None, "Picture that the object emits.", section="11.5"
    )
    ibl_texture_coef: float = beside(
        "ibl_texture_coef", NUMBER, 1, 1.0, "Factor of that picture.", low=0, section="11.5"
    )
    hemisphere_map: bool = beside(
        "hemisphere_map", FLAG, 1, False, "Picture of a dome seen from above.",
        aliases=("circle_map",), section="11.5",
    )
    angular_map: bool = beside(
        "angular_map", FLAG, 1, False, "Picture is a light probe.", section="11.5"
    )
    panoramic_map: bool = beside(
        "panoramic_map", FLAG, 1, False, "Picture by latitude and longitude.", section="11.5"
    )
    equirectangular_map: bool = beside(
        "equirectangular_map", FLAG, 1, False, "Picture by latitude and longitude, upside down.",
        section="11.5", in_manual=False,
    )
    disk_map: bool = beside(
        "disk_map", FLAG, 1, False, "Picture of a disk, cut out around it.",
        section="11.3", in_manual=False,
    )
    repeat: int = beside(
        "repeat", INTEGER, 1, 1, "How often a texture repeats along each side.",
        low=1, high=10**6, section="11.1", in_manual=False,
    )
    parallel_light: bool = beside(
        "parallel_light", FLAG, 1, False, "Make the plane a parallel light.", section="9.3"
    )
    parallel_light_dir: Triple | None = beside(
        "parallel_light_dir", NUMBER, 3, None, "Direction of that light; by default the normal.",
        section="9.3",
    )
    spot_light: bool = beside(
        "spot_light", FLAG, 1, False, "Make the sphere a spot light.", section="9.5"
    )
    spot_light_dir: Triple = beside(
        "spot_light_dir", NUMBER, 3, (0.0, -1.0, 0.0), "Axis of the spot.", section="9.5"
    )
    spot_light_angle: tuple[float, float] = beside(
        "spot_light_angle", NUMBER, 2, (30.0, 5.0), "Half angle w and fall-off angle f.",
        low=0, high=180, unit="degree", section="9.5",
    )
    spot_light_falloff: float = beside(
        "spot_light_falloff", NUMBER, 1, 2.0, "Exponent of the fall-off.", low=0, section="9.5"
    )
    spot_attenuation: Triple = beside(
        "spot_attenuation", NUMBER, 3, (0.0, 0.0, 1.0), "a, b and c of t = a + b d + c d^2.",
        low=0, section="9.5",
    )
    blackhole_disk: int | None = beside(
        "blackhole_disk", INTEGER, 1, None,
        "Which `accretion_disk_texture`, from 0, a disk with `disk_map` has around a black hole; "
        "by default that of the disk before it.",
        low=0, section="14", in_manual=False,
    )

    @property
    def has_picture(self) -> bool:
        """Whether any picture lies on it."""
        return any((self.texture, self.bump_texture, self.ibl_texture))

    @property
    def is_backdrop(self) -> bool:
        """Whether it is seen in its unlit colour (row background-object)."""
        return self.background and isinstance(self.shape, Annulus | Disk | Plane | UVPlane)

    @property
    def disk_picture(self) -> str | None:
        """The picture that `disk_map` cuts out: the one that it shines with, if it has both."""
        return self.ibl_texture or self.texture

    @property
    def is_lamp(self) -> bool:
        """Whether the original program takes it for a light: it shines, is black and diffuse.

        Those that have a colour as well, or reflect another way, are surfaces that shine (9.2).
        """
        diffuse = self.reflection.kind in (None, "diffuse") and not self.reflection.subsurface
        return diffuse and math.hypot(*self.color) < 1e-3 < math.hypot(*self.emission)

    lines: LineReports = field(
        default_factory=lambda: LineReports(SceneObject, also=("subsurface",)),
        compare=False,
        repr=False,
    )


