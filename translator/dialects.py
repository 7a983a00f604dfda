"""Where the manual and the original program differ, one row for each place.

Every row has an id that notes refer to. `--dialect prender` exists to match an old picture and
changes the rows of kind `switch` alone; a defect of kind `never` is copied by neither dialect.
"""

from dataclasses import dataclass

DIALECTS = ("manual", "prender")


@dataclass(frozen=True)
class Difference:
    """One row: id, section of the scene language, what the manual and the program do, and kind
    (`switch`: the dialects differ; `never`: the program's defect is not copied; `same`: the program
    settles what the manual leaves open)."""

    id: str
    section: str
    manual: str
    program: str
    kind: str


DIFFERENCES = {
    row.id: row
    for row in (
        Difference("camera-angle", "5.2", "horizontal field of view", "vertical field of view",
                   "switch"),
        Difference("screen", "5.1", "garbled", "width, height and distance", "same"),
        Difference("camera-matrix-up", "5.3", "silent", "the up vector stays, scale is ignored",
                   "same"),
        Difference("uvplane-extent", "6.2", "edges U and V", "edges of squared length", "switch"),
        Difference("sphere-rotation", "6.2", "the centre turns about the origin",
                   "the angles become the centre", "never"),
        Difference("ward-diffuse", "8.5", "rho_d colour / pi + lobe", "blend by channel means",
                   "switch"),
        Difference("phong-diffuse", "8.6", "rho_d colour / pi + lobe", "diffuse weight `roughness`",
                   "switch"),
        Difference("ward-exponent", "8.5", "misprinted", "Ward 1992", "same"),
        Difference("phong-cosine", "8.6", "f is the BRDF", "weight without the cosine", "never"),
        Difference("glass-colour", "8.4", "`color` tints both", "`color` tints both", "same"),
        Difference("glass-fresnel", "8.4", "Schlick", "Schlick, angle on the outer side", "same"),
        Difference("dispersion-rgb", "8.7", "index by wavelength", "one index, at 589.3 nm",
                   "switch"),
        Difference("no-reflection-line", "8.1", "diffuse", "mirror", "never"),
        Difference("roughness", "8.1", "vague", "weight of Lambert against mirror", "same"),
        Difference("emission-units", "9.3", "silent", "irradiance pi emission", "same"),
        Difference("infinity-length", "9.4", "the vector is a direction",
                   "brightness follows its length",
                   "switch"),
        Difference("spot", "9.5", "half angle w, fall-off f", "inner cone w - f", "same"),
        Difference("several-lights", "9.2", "lights add up", "lights are averaged", "never"),
        Difference("ambient", "9.6", "light at every place", "added at every surface hit", "same"),
        Difference("medium-units", "10.1", "1/mm", "1/scene unit", "same"),
        Difference("medium-phase", "10.1", "Henyey-Greenstein", "wrong cosines", "never"),
        Difference("sss-dipole", "10.2", "standard dipole", "directional dipole", "switch"),
        Difference("sss-simulation", "10.2", "random walk", "walk with excess energy", "never"),
        Difference("sss-base", "10.2", "the surface named before", "a diffuse one is black",
                   "never"),
        Difference("sss-gate", "10.2", "the mean is a dummy", "the mean gates the coefficients",
                   "never"),
        Difference("chicken", "10.3", "absorption as published", "a tenth of it", "never"),
        Difference("texture", "11.2", "takes precedence", "replaces the colour", "same"),
        Difference("alpha", "11.4", "0 is absent", "inverted on spheres and planes", "never"),
        Difference("angular-map", "11.5", "centre is -Z, unmirrored", "centre is +Z, mirrored",
                   "switch"),
        Difference("ibl-lookup", "11.5", "silent", "by the hit point", "same"),
        Difference("shadow", "11.7", "shadow catcher", "shadow catcher", "same"),
        Difference("bump", "11.8", "turns the normal", "without effect on meshes", "never"),
        Difference("luminance-cutoff", "13.4", "default 0, off", "default 0.025", "switch"),
        Difference("gamma", "13.5", "0 is no correction", "0 is 1/2.2", "same"),
        Difference("timelimit", "4", "a time", "hours", "same"),
        Difference("roulette", "13.2", "unbiased", "biased dark", "never"),
        Difference("mlt", "13.6", "Kelemen et al. 2002", "another mutation", "switch"),
        Difference("erpt", "13.7", "Cline et al. 2005", "broken", "never"),
    )
}


def note(id, dialect):
    """The note for a line that touches a row: `id: what is done (instead of what)`."""
    row = DIFFERENCES[id]
    if row.kind == "same":
        return f"{id}: {row.program} (the manual is {row.manual})" if row.manual in (
            "garbled", "silent", "misprinted", "vague") else f"{id}: {row.program}"
    done, instead = row.manual, row.program
    if row.kind == "switch" and dialect == "prender":
        return f"{id}: {instead}, as the program; the manual says {done}"
    return f"{id}: {done}, as the manual; the program: {instead}"
