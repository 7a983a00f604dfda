"""From the attributes of an object to its BSDF (spec section 8)."""

from translator.diagnostics import Problem
from translator.dialects import note
from translator.neutral import reflectance

def check(document):
    """Problems of objects whose surface lacks its parameters."""
    problems = []
    for block in document.objects:
        for kind, field in (("ward", "ward_brdf"), ("phong", "phong_brdf")):
            if block.reflection.kind == kind and getattr(block, field) is None:
                line = block.source.line("reflection")
                message = f"'reflection {field}' needs a line '{field} ...' in the same object"
                problems.append(Problem(line, 1, message, "scene"))
    return problems


def bsdf(block, dialect="manual"):
    """The BSDF's dictionary of an object; notes go to its lines.

    Args:
        block: `SceneObject`.
        dialect: `manual` or `prender` (rows ward-diffuse and phong-diffuse).
    """
    kind = block.reflection.kind
    if kind == "glass":
        return glass(block)
    if kind == "ward":
        return twosided(ward(block, dialect))
    if kind == "phong":
        return twosided(phong(block, dialect))
    return twosided(lambert_or_mirror(block))


def twosided(inner):
    """Legacy surfaces turn their normal towards the viewer."""
    return {"type": "twosided", "bsdf": inner}


def diffuse(color):
    """Lambert's reflection, f = color / pi (section 8.2)."""
    return {"type": "diffuse", "reflectance": reflectance(color)}


def mirror(color):
    """A perfect mirror of a colour (section 8.3)."""
    return {"type": "conductor", "material": "none", "specular_reflectance": reflectance(color)}


def lambert_or_mirror(block):
    """`diffuse` and `specular`: roughness weighs Lambert against the mirror (section 8.1)."""
    if block.reflection.kind is None:
        block.source.remark("", note("no-reflection-line", "manual"))
    weight = 1.0 if block.roughness is None else block.roughness
    if block.reflection.kind is None or weight == 1:
        return diffuse(block.color)
    if weight == 0:
        return mirror(block.color)
    block.source.remark("roughness", note("roughness", "manual"))
    parts = {"bsdf_0": mirror(block.color), "bsdf_1": diffuse(block.color)}
    return {"type": "blendbsdf", "weight": weight} | parts


def glass(block):
    """Smooth glass with Schlick's Fresnel term (sections 8.4 and 8.7)."""
    tint = reflectance(block.color)
    index = block.refractive_index
    if index == 0:
        block.source.remark("refractive_index", "0 read as 1.5")
        index = 1.5
    result = {
        "type": "schlickglass",
        "int_ior": index,
        "ext_ior": 1.0,
        "specular_reflectance": tint,
        "specular_transmittance": tint,
    }
    if block.reflection.dispersion:
        block.source.becomes("refractive_index", "ignored", "the dispersion formula gives the index")
        result["dispersion"] = block.reflection.dispersion
        del result["int_ior"]
        if block.reflection.coefficients:
            result["coefficients"] = " ".join(f"{c:.17g}" for c in block.reflection.coefficients)
    return result


def products(block, weights):
    """Diffuse and specular reflectance: colour times rho_d and specular times rho_s."""
    rho_d, rho_s = weights
    return [rho_d * c for c in block.color], [rho_s * c for c in block.specular]


def ward(block, dialect):
    """Ward's reflection: the sum of both parts, or the program's blend (section 8.5)."""
    rho_d, rho_s, alpha_u, alpha_v = block.ward_brdf
    diffuse_part, lobe = products(block, (rho_d, rho_s))
    if dialect == "prender":
        total = sum(diffuse_part) + sum(lobe)
        share = sum(diffuse_part) / total if total > 0 else 0.0
        diffuse_part, lobe = blended(diffuse_part, lobe, share)
    if any(diffuse_part) and any(lobe):
        block.source.remark("ward_brdf", note("ward-diffuse", dialect))
    return {
        "type": "ward",
        "diffuse_reflectance": reflectance(diffuse_part),
        "specular_reflectance": reflectance(lobe),
        "alpha_u": alpha_u,
        "alpha_v": alpha_v,
        "tangent_frame": "world",
    }


def phong(block, dialect):
    """Phong's reflection: the sum of both parts, or the program's blend (section 8.6)."""
    rho_d, rho_s, exponent = block.phong_brdf
    diffuse_part, lobe = products(block, (rho_d, rho_s))
    if dialect == "prender":
        diffuse_part, lobe = blended(diffuse_part, lobe, block.roughness or 0.0)
    elif block.roughness is not None:
        block.source.becomes("roughness", "ignored", note("phong-diffuse", dialect))
    if any(diffuse_part) and any(lobe):
        block.source.remark("phong_brdf", note("phong-diffuse", dialect))
    return {
        "type": "phong",
        "diffuse_reflectance": reflectance(diffuse_part),
        "specular_reflectance": reflectance(lobe),
        "exponent": exponent,
    }


def blended(diffuse_part, lobe, share):
    """The two parts weighed by `share` and 1 - `share`."""
    return [share * c for c in diffuse_part], [(1 - share) * c for c in lobe]


UNUSED = {
    "specular": ("ward", "phong"),
    "ward_brdf": ("ward",),
    "phong_brdf": ("phong",),
    "refractive_index": ("glass",),
    "roughness": (None, "diffuse", "specular", "phong"),
}
"""Attributes with the kinds of surface that use them."""


def account(block):
    """Notes on attributes that the surface does not use, and on colours that gain energy."""
    kind = block.reflection.kind
    for field, kinds in UNUSED.items():
        if kind not in kinds and not (field == "refractive_index" and block.reflection.subsurface):
            block.source.becomes(field, "ignored", f"a surface of kind {kind or 'diffuse'} has no use for it")
    if kind is None and block.roughness is not None:
        block.source.becomes("roughness", "ignored", "without a reflection line the surface is diffuse")
    for field in ("color", "specular"):
        if max(getattr(block, field)) > 1:
            block.source.remark(field, "above 1: not energy conserving, kept as written")
