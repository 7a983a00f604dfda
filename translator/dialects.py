"""Where the manual and the original program differ, one row for each place.

Every row has an id that notes refer to. `--dialect prender` exists to match an old picture and
changes the rows of kind `switch` alone; a defect of kind `never` is copied by neither dialect.
"""

from __future__ import annotations

from dataclasses import dataclass

from relume.translator.outcome_rows import Outcome

DIALECTS = ("manual", "prender")


@dataclass(frozen=True)
class Difference:
    """One row, which is an outcome of the lines that touch it, too (see `outcomes`).

    Attributes:
        id: its name, the code of the outcome.
        section: section of the scene language.
        manual: what the manual says.
        program: what the original program does.
        kind: `switch` (the dialects differ), `never` (the program's defect is not copied) or `same`
            (the program settles what the manual leaves open).
        note: what reports say where that is not made of the columns; may have placeholders.
        outcome: kind of the outcome.
        source: what the column `manual` is from.
    """

    id: str
    section: str
    manual: str
    program: str
    kind: str
    note: str = ""
    outcome: str = "translated"
    source: str = "the manual"


def relativity(id: str, theory: str, program: str, kind: str = "never") -> Difference:
    """A row of what the manual does not know, where theory stands against the program."""
    return Difference(id, "14", theory, program, kind, source="theory")


DIFFERENCES = {
    row.id: row
    for row in (
        Difference("camera-angle", "5.2", "horizontal field of view", "vertical field of view",
                   "switch", note="read as the {axis} field of view"),
        Difference("screen", "5.1", "garbled", "width, height and distance", "same"),
        Difference("camera-matrix-up", "5.3", "silent", "the up vector stays, scale is ignored",
                   "same", note="the up vector is not turned"),
        Difference("camera-matrix-order", "5.3", "transformations in the order of the file",
                   "the direction is bent, unless there is one translation and it comes last",
                   "never"),
        Difference("hemisphere-inside", "6.1", "an open dome",
                   "from below its near half hides its inside", "never"),
        Difference("uvplane-extent", "6.2", "edges U and V", "edges of squared length", "switch"),
        Difference("uvplane-texture", "11.2", "one picture over the plane",
                   "a picture to each length of U and V", "switch"),
        Difference("uvplane-light", "9.3", "seen and lit as U x V",
                   "seen in squared lengths, direct light by `nextEventEstimation` from U x V",
                   "switch"),
        Difference("sphere-rotation", "6.2", "the centre turns about the origin",
                   "the angles become the centre", "never"),
        Difference("sphere-radius-scale", "6.2", "scales spheres and disks",
                   "scale moves their centre alone", "never"),
        Difference("ward-diffuse", "8.5", "rho_d colour / pi + lobe", "blend by channel means",
                   "switch"),
        Difference("phong-diffuse", "8.6", "rho_d colour / pi + lobe", "diffuse weight `roughness`",
                   "switch"),
        Difference("ward-exponent", "8.5", "misprinted", "Ward 1992", "same"),
        Difference("ward-nee", "8.5", "one BRDF for all light",
                   "darker under next event estimation", "never"),
        Difference("ward-colour", "8.5", "rho_d and rho_s scale the colours",
                   "a colour below `ward_brdf` is not scaled", "never"),
        Difference("phong-cosine", "8.6", "f is the BRDF", "weight without the cosine", "never"),
        Difference("glass-colour", "8.4", "`color` tints both", "`color` tints both", "same"),
        Difference("glass-fresnel", "8.4", "Schlick", "Schlick, angle on the outer side", "same"),
        Difference("glass-nee", "8.4", "weighed by Fresnel's term",
                   "lamps seen in glass count in full under next event estimation", "never"),
        Difference("dispersion-rgb", "8.7", "index by wavelength", "one index, at 589.3 nm",
                   "switch"),
        Difference("no-reflection-line", "8.1", "diffuse", "mirror", "never"),
        Difference("roughness", "8.1", "vague", "weight of Lambert against mirror", "same"),
        Difference("emission-units", "9.3", "silent", "irradiance pi emission", "same",
                   note="{quantity} pi times the emission"),
        Difference("parallel-lamp", "9.3", "a light without a surface",
                   "the rectangle is seen, and an area lamp without next event estimation",
                   "switch"),
        Difference("emission-units-glossy", "9.3", "silent",
                   "irradiance of parallel light on Ward and Phong without the factor pi", "never"),
        Difference("infinity-length", "9.4", "the vector is a direction",
                   "brightness follows its length",
                   "switch"),
        Difference("infinity-shadow", "9.4", "the vector is a direction",
                   "shadows shift unless its length is 1", "never"),
        Difference("spot", "9.5", "half angle w, fall-off f", "inner cone w - f", "same"),
        Difference("several-lights", "9.2", "lights add up", "lights are averaged", "never"),
        Difference("ambient", "9.6", "light at every place", "added at every surface hit", "same"),
        Difference("medium-units", "10.1", "1/mm", "1/scene unit", "same"),
        Difference("medium-phase", "10.1", "Henyey-Greenstein", "wrong cosines", "never"),
        Difference("fog-sky", "10.1", "a medium around everything",
                   "rays that meet nothing pass it freely", "never"),
        Difference("sss-dipole", "10.2", "standard dipole", "directional dipole", "switch"),
        Difference("sss-radius", "10.2", "`MATERIAL_R_MAX` limits the search where a file has it",
                   "it limits that of every object, by default", "switch"),
        Difference("sss-energy", "10.2", "the dipole of Jensen et al. 2001",
                   "a whole dielectric beside it, too bright", "never"),
        Difference("sss-simulation", "10.2", "random walk", "walk with excess energy", "never"),
        Difference("sss-base", "10.2", "the surface named before", "a diffuse one is black",
                   "never"),
        Difference("sss-gate", "10.2", "the mean is a dummy", "the mean gates the coefficients",
                   "never"),
        Difference("chicken", "10.3", "absorption as published", "a tenth of it", "never"),
        Difference("level-0", "10.2", "scattering of order 0",
                   "extinction by absorption and scattering, nothing scatters", "same"),
        Difference("texture", "11.2", "takes precedence", "replaces the colour", "same"),
        Difference("repeat", "11.2", "silent", "of no effect on meshes, `#REPEAT` has it", "same",
                   outcome="ignored"),
        Difference("disk-frame", "11.3", "silent",
                   "u and v along Y x n and n x (Y x n), with X for Y where n.x is 0", "same"),
        Difference("texture-maps", "11.5", "maps of IBL", "map keywords act on `texture`, too",
                   "same"),
        Difference("disk-map", "11.3", "silent",
                   "of a disk what the picture covers, shining with the emission alone", "same"),
        Difference("disk-light", "9.3", "silent", "an emitting disk shines on both sides", "same"),
        Difference("lit-uvplane", "9.3", "silent",
                   "with a colour, too, a uvplane shines on both sides", "same"),
        Difference("texture-over-map", "11.2", "`texture` before map_Kd", "`texture` before map_Kd",
                   "same"),
        Difference("alpha", "11.4", "0 is absent", "inverted on spheres and planes", "never"),
        Difference("angular-map", "11.5", "centre is -Z, unmirrored", "centre is +Z, mirrored",
                   "switch"),
        Difference("ibl-hemisphere-u", "11.5", "silent",
                   "u of a dome's picture is doubled and cut off", "never",
                   note="the picture as on a sphere; the program doubles u on a hemisphere"),
        Difference("hemisphere-map-integer", "11.5", "silent",
                   "half the size of the picture, rounded to whole texels", "never",
                   note="the very texel; the program is up to one texel off"),
        Difference("ibl-lookup", "11.5", "silent", "by the hit point", "same"),
        Difference("polygon-corners", "12.1", "polygons", "the first four corners", "never"),
        Difference("flat-vn", "12.1", "silent",
                   "`smooth 0` shades a face with the mean of its corners' `vn`", "same"),
        Difference("background-object", "7", "silent",
                   "its unlit colour, as seen by the camera, in mirrors and through glass", "same"),
        Difference("shadow", "11.7", "shadow catcher", "shadow catcher", "same"),
        Difference("bump", "11.8", "turns the normal", "without effect on meshes", "never",
                   outcome="approximated"),
        Difference("bump-shapes", "11.8", "turns the normal",
                   "scales the light, up to some 5 times, on spheres with u and v swapped", "never",
                   outcome="approximated"),
        Difference("luminance-cutoff", "13.4", "default 0, off", "default 0.025", "switch"),
        Difference("gamma", "13.5", "0 is no correction", "0 is 1/2.2", "same"),
        Difference("timelimit", "4", "a time", "hours", "same"),
        Difference("roulette", "13.2", "unbiased", "biased dark", "never"),
        Difference("mlt", "13.6", "Kelemen et al. 2002", "another mutation", "switch"),
        Difference("erpt", "13.7", "Cline et al. 2005", "broken", "never"),
        relativity("hole-observer", "a camera at rest in the field of the hole",
                   "rays leave the camera as if space were flat there", "switch"),
        relativity("hole-budget", "rays are followed to their end",
                   "rays that run out of steps show the sky, in the shadow, too"),
        relativity("hole-poles", "nothing is special about the axis of spin",
                   "streaks of colour along it"),
        relativity("disk-motion", "Doppler shift and red shift of matter in orbit, along the ray",
                   "Doppler shift alone, along the straight line to the camera", "switch"),
        relativity("disk-layout", "silent", "the middle of its picture is the inner edge, the "
                   "sides of it are half way to the radius", "same"),
        relativity("disk-opacity", "the picture covers as much as its opacity says",
                   "opacity counts again at each step of a ray, so that all is opaque"),
        relativity("disk-temperature", "colours of bodies of up to 4500 K",
                   "1000 K everywhere, in whole numbers"),
        relativity("wormhole-start", "the camera is as far from the mouth as the file says",
                   "nearer by the length of the throat"),
        relativity("wormhole-bounces", "light bounces as surfaces ask",
                   "directions after a bounce are turned by the place of the camera"),
        relativity("wormhole-mirrored", "silent", "the other side is seen mirrored", "same"),
        relativity("mollweide-order", "projection, then aberration",
                   "with the projection there is no aberration"),
        relativity("doppler-cosine", "shift of colours by the angle in the frame of the camera",
                   "by the angle in the world"),
    )
}


AGREEMENT = {
    "switch": "`--dialect prender` follows the program here, to match an old picture.",
    "never": "A defect of the program, which no dialect copies: an old picture differs here.",
    "same": "Both dialects do the same.",
}
"""What each kind of row means to the reader."""

SAYS_NOTHING = ("garbled", "silent", "misprinted", "vague")
"""What the manual is where it leaves open what the program settles."""


def outcome(row: Difference) -> Outcome:
    """The row as an outcome of a line: its note says what is done, instead of what."""
    done, instead = f"{row.manual}, as {row.source}; the program: {row.program}", ""
    if row.kind == "switch":
        instead = f"{row.program}, as the program; {row.source} says {row.manual}"
    elif row.kind == "same":
        open_ = f" (the manual is {row.manual})" if row.manual in SAYS_NOTHING else ""
        done = f"{row.program}{open_}"
    return Outcome(
        code=row.id,
        kind=row.outcome,
        section=row.section,
        note=f"{row.id}: {row.note or done}",
        picture=f"{row.source.capitalize()}: {row.manual}. The original program: {row.program}.",
        advice=AGREEMENT[row.kind],
        prender_note=f"{row.id}: {instead}" if instead and not row.note else "",
    )
