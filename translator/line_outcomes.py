"""What becomes of keywords that set no value of their own in the Mitsuba scene.

Each row: field, condition on the document or object, outcome, note. A row applies where the
condition holds, to the lines that set the field.
"""

from relume.translator.dialects import note
from relume.translator.plan import BOOTSTRAP, metropolis, mutations
from relume.translator.shapes import InfinityLight, MeshFile, Plane, Sphere, UVPlane

GRAVITY = "general relativity is outside the manual"

ALWAYS = lambda _: True  # noqa: E731

DOCUMENT_ROWS = (
    ("depth_limit", ALWAYS, "ignored", "roulette: unbiased here, so there is nothing to harden"),
    ("mlt_r1r2", ALWAYS, "ignored", "without effect in the original program, too"),
    ("metropolis", lambda d: d.metropolis and d.erpt, "ignored", "energy redistribution wins"),
    ("supersampling", metropolis, "ignored", "Metropolis renders spread over pixels by themselves"),
    ("luminance_cutoff", metropolis, "ignored", "without effect on Metropolis renders"),
    ("mutation", lambda d: not (d.metropolis or d.erpt), "ignored",
     "no Metropolis render is asked for"),
    ("mlt_sample", lambda d: metropolis(d) != "pssmlt", "ignored",
     "only metropolisTransport has it"),
    ("mlt_sample",
     lambda d: metropolis(d) == "pssmlt" and d.mlt_sample < BOOTSTRAP * mutations(d),
     "approximated", "a quarter of the mutations are drawn at least: fewer leave spots"),
    ("mlt_resampling", lambda d: metropolis(d) != "pssmlt", "ignored",
     "only metropolisTransport has it"),
    ("scattering", lambda d: not d.participating_media, "ignored", "participatingMedia is 0"),
    ("absorbing", lambda d: not d.participating_media, "ignored", "participatingMedia is 0"),
    ("phase", lambda d: not d.participating_media, "ignored", "participatingMedia is 0"),
    ("map_coef", lambda d: not d.background_texture, "ignored", "there is no background_texture"),
    ("coef", lambda d: not d.background_texture, "ignored", "there is no background_texture"),
    ("velocity", lambda d: any(d.velocity), "unsupported", GRAVITY),
    ("special_relativity_effects", lambda d: d.special_relativity_effects, "unsupported", GRAVITY),
    ("use_accretion_disk_temperature", lambda d: d.use_accretion_disk_temperature, "unsupported",
     GRAVITY),
    ("color_doppler_factor_effect", lambda d: d.color_doppler_factor_effect, "unsupported",
     GRAVITY),
    ("use_mollweide_projection", lambda d: d.use_mollweide_projection, "unsupported", GRAVITY),
)

NO_SUBSURFACE = "the object has no subsurface scattering"


def no_subsurface(block):
    return not block.reflection.subsurface


def no_ibl(block):
    return block.ibl_texture is None


def mapped(block):
    flags = ("panoramic_map", "angular_map", "equirectangular_map", "hemisphere_map")
    return any(getattr(block, flag) for flag in flags)


def not_a_mesh(block):
    return not isinstance(block.shape, MeshFile)


OBJECT_ROWS = (
    ("back", ALWAYS, "ignored", "without effect in the original program, too"),
    ("media_ignore_front_back", ALWAYS, "ignored", "a medium fills all space outside objects"),
    ("blackhole_disk", lambda b: b.blackhole_disk, "unsupported", GRAVITY),
    ("disk_map", lambda b: b.disk_map and b.texture, "unsupported", "mapped as without disk_map"),
    ("disk_map", lambda b: b.disk_map and not b.texture, "ignored", "there is no texture"),
    ("background", lambda b: b.background, "unsupported", "shown lit"),
    ("texture", lambda b: isinstance(b.shape, Plane), "ignored",
     "an infinite plane has no texture"),
    ("texture", lambda b: b.texture and mapped(b), "unsupported",
     "mapped by the default coordinates"),
    ("shadow", lambda b: b.shadow and not isinstance(b.shape, Plane | UVPlane), "ignored",
     "only planes can catch shadows"),
    ("repeat", lambda b: b.texture is None, "ignored", "there is no texture"),
    ("ibl_texture_coef", no_ibl, "ignored", "there is no ibl_texture"),
    ("smooth", lambda b: b.smooth and not_a_mesh(b), "ignored", "the object is no mesh"),
    ("r_refractive_index", ALWAYS, "ignored", "refractive_index serves the dipole, too"),
    *((field, no_subsurface, "ignored", NO_SUBSURFACE) for field in (
        "scattering", "absorbing", "phase", "level", "bssrdf", "material_symbol", "material_scale",
        "material_r_max")),
    *((field, lambda b: b.parallel_light and not isinstance(b.shape, UVPlane), "ignored",
       "only a uvplane can be a parallel light")
      for field in ("parallel_light", "parallel_light_dir")),
    ("parallel_light_dir", lambda b: not b.parallel_light, "ignored", "parallel_light is 0"),
    ("spot_light", lambda b: b.spot_light and not isinstance(b.shape, Sphere), "ignored",
     "only a sphere can be a spot light"),
    *((field, lambda b: not (b.spot_light and isinstance(b.shape, Sphere)), "ignored",
       "the object is no spot light")
      for field in ("spot_light_dir", "spot_light_angle", "spot_light_falloff",
                    "spot_attenuation")),
)

NOTES = (
    ("next_event_estimation", "lights are always sampled; the mean picture is the same"),
    ("depth", "sets in after this depth"),
)


def several_lamps(document):
    """Whether explicit light comes from more than one lamp."""
    lamps = [b for b in document.objects if any(b.emission) and not any(b.color)]
    return document.next_event_estimation and len(lamps) > 1


DOCUMENT_DIFFERENCES = (
    ("roulette", "depth", ALWAYS),
    ("mlt", "metropolis", lambda d: d.metropolis and not d.erpt),
    ("erpt", "erpt", lambda d: d.erpt),
    ("ambient", "ambient", ALWAYS),
    ("luminance-cutoff", "luminance_cutoff", ALWAYS),
    ("several-lights", "next_event_estimation", several_lamps),
)
"""Rows of the table of dialects that a document touches: id, field, condition."""

OBJECT_DIFFERENCES = (
    ("glass-fresnel", "reflection", lambda b: b.reflection.kind == "glass" and no_subsurface(b)),
    ("dispersion-rgb", "reflection", lambda b: b.reflection.dispersion is not None),
    ("ward-exponent", "ward_brdf", lambda b: b.reflection.kind == "ward"),
    ("phong-cosine", "phong_brdf", lambda b: b.reflection.kind == "phong"),
    ("texture", "texture", ALWAYS),
)
"""The same of an object."""


def differences(target, table, dialect):
    """Name the rows of the table of dialects at the lines that touch them."""
    for id, field, applies in table:
        if applies(target):
            target.lines.remark(field, note(id, dialect))


def account(document, dialect):
    """Set the outcome of every line that the translation itself does not account for.

    Args:
        document: the document; its line reports are changed.
        dialect: `manual` or `prender`, for the notes on where the two differ.
    """
    differences(document, DOCUMENT_DIFFERENCES, dialect)
    for field, applies, outcome, text in DOCUMENT_ROWS:
        if applies(document):
            document.lines.becomes(field, outcome, text)
    for field, text in NOTES:
        document.lines.remark(field, text)
    if document.gamma_offset == 0:
        document.lines.remark("gamma_offset", note("gamma", "manual"))
    document.lines.remark("time_limit", note("timelimit", "manual"))
    for block in document.gravity:
        block.lines.whole("unsupported", GRAVITY)
    for block in document.objects:
        differences(block, OBJECT_DIFFERENCES, dialect)
        for field, applies, outcome, text in OBJECT_ROWS:
            if applies(block):
                block.lines.becomes(field, outcome, text)
        if isinstance(block.shape,
                      Plane | InfinityLight) and any(block.emission) and any(block.color):
            block.lines.remark("emission", "emits and reflects")
