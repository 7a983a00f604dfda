"""From the attributes of an object to its BSDF (spec section 8)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from relume.translator.diagnostics import Problem
from relume.translator.document import Document
from relume.translator.objects import SceneObject
from relume.translator.reflectances import Reflectance, entry, mean, times
from relume.translator.scene_values import Entry


def missing_parameters(document: Document) -> list[Problem]:
    """Problems of objects whose surface lacks its parameters."""
    problems = []
    for block in document.objects:
        for kind, field in (("ward", "ward_brdf"), ("phong", "phong_brdf")):
            if block.reflection.kind == kind and getattr(block, field) is None:
                line = block.lines.line("reflection")
                message = f"'reflection {field}' needs a line '{field} ...' in the same object"
                problems.append(Problem(line, 1, message, "scene"))
    return problems


@dataclass(frozen=True)
class Reflectances:
    """The two colours of a surface (see `reflectances`)."""

    color: Reflectance
    specular: Reflectance


def plain_reflectances(block: SceneObject) -> Reflectances:
    """The reflectances that an object's own colour lines give."""
    return Reflectances(block.color, block.specular)


def bsdf(block: SceneObject, reflectances: Reflectances, dialect: str = "manual") -> Entry:
    """The BSDF's dictionary of an object; notes go to its lines.

    Args:
        block: the object.
        reflectances: its colours.
        dialect: `manual` or `prender` (rows ward-diffuse and phong-diffuse).
    """
    kind = block.reflection.kind
    if kind == "glass":
        return glass(block, reflectances)
    if kind == "ward":
        return twosided(ward(block, reflectances, dialect))
    if kind == "phong":
        return twosided(phong(block, reflectances, dialect))
    return twosided(lambert_or_mirror(block, reflectances))


def twosided(inner: Entry) -> Entry:
    """Legacy surfaces turn their normal towards the viewer."""
    return {"type": "twosided", "bsdf": inner}


def diffuse(color: Reflectance) -> Entry:
    """Lambert's reflection, f = color / pi (section 8.2)."""
    return {"type": "diffuse", "reflectance": entry(color)}


def mirror(color: Reflectance) -> Entry:
    """A perfect mirror of a colour (section 8.3)."""
    return {"type": "conductor", "material": "none", "specular_reflectance": entry(color)}


def lambert_or_mirror(block: SceneObject, reflectances: Reflectances) -> Entry:
    """`diffuse` and `specular`: roughness weighs Lambert against the mirror (section 8.1)."""
    if block.reflection.kind is None:
        block.lines.remark("", "no-reflection-line")
    weight = block.roughness
    if weight is None:
        weight = 0.0 if block.reflection.kind == "specular" else 1.0
    if block.reflection.kind is None or weight == 1:
        return diffuse(reflectances.color)
    if weight == 0:
        return mirror(reflectances.color)
    block.lines.remark("roughness", "roughness")
    parts = {"bsdf_0": mirror(reflectances.color), "bsdf_1": diffuse(reflectances.color)}
    return {"type": "blendbsdf", "weight": weight} | parts


def boundary(block: SceneObject, reflectances: Reflectances, index: float) -> Entry:
    """The surface of an object with a medium inside (section 10.2, row sss-base).

    Smooth glass with the exact Fresnel term, which is 0 where the indices are equal; rough glass
    of the same width in place of Ward's and Phong's lobes. What passes is tinted by `color`.

    Args:
        block: the object.
        reflectances: its colours, at most 1.
        index: index of refraction inside.
    """
    kind = block.reflection.kind
    if kind in ("ward", "phong") and index != 1:
        return rough_boundary(block, reflectances, index)
    if kind not in ("glass", None):
        block.lines.becomes("reflection", "smooth-glass-boundary")
    result = glass(block, reflectances)
    if "int_ior" in result:
        result["int_ior"] = index
    return result | {"fresnel": "exact"}


def rough_boundary(block: SceneObject, reflectances: Reflectances, index: float) -> Entry:
    """Rough glass whose lobe of reflection is about as wide as Ward's or Phong's."""
    if block.reflection.kind == "ward":
        assert block.ward_brdf is not None  # see `missing_parameters`
        rho_d, rho_s, u, v = block.ward_brdf
    else:
        assert block.phong_brdf is not None
        rho_d, rho_s, exponent = block.phong_brdf
        # cos^n around the mirror direction is as wide as this distribution of normals.
        u = v = (2 / (exponent + 2)) ** 0.5
    block.lines.becomes("reflection", "rough-glass-boundary")
    return {
        "type": "roughdielectric",
        "distribution": "beckmann",
        "alpha_u": u,
        "alpha_v": v,
        "int_ior": index,
        "ext_ior": 1.0,
        "specular_reflectance": entry(times(reflectances.specular, min(rho_s, 1))),
        "specular_transmittance": entry(times(reflectances.color, min(rho_d, 1))),
    }


def glass(block: SceneObject, reflectances: Reflectances) -> Entry:
    """Smooth glass with Schlick's Fresnel term (sections 8.4 and 8.7)."""
    index = block.refractive_index
    if index == 0:
        block.lines.remark("refractive_index", "index-zero")
        index = 1.5
    result: Entry = {
        "type": "schlickglass",
        "int_ior": index,
        "ext_ior": 1.0,
        "specular_reflectance": entry(reflectances.color),
        "specular_transmittance": entry(reflectances.color),
    }
    if block.reflection.dispersion:
        block.lines.becomes("refractive_index", "index-from-dispersion")
        result["dispersion"] = block.reflection.dispersion
        del result["int_ior"]
        if block.reflection.coefficients:
            result["coefficients"] = " ".join(f"{c:.17g}" for c in block.reflection.coefficients)
    return result


def ward(block: SceneObject, reflectances: Reflectances, dialect: str) -> Entry:
    """Ward's reflection: the sum of both parts, or the program's blend (section 8.5)."""
    assert block.ward_brdf is not None  # see `missing_parameters`
    rho_d, rho_s, alpha_u, alpha_v = block.ward_brdf
    color, specular = times(reflectances.color, rho_d), times(reflectances.specular, rho_s)
    varying = not (isinstance(color, tuple) and isinstance(specular, tuple))
    if dialect == "prender" and not varying:
        total = mean(color) + mean(specular)
        color, specular = blended(color, specular, mean(color) / total if total > 0 else 0.0)
    if mean(color) > 0 and mean(specular) > 0:
        block.lines.remark("ward_brdf", "ward-diffuse", dialect=dialect)
    result: Entry = {
        "type": "ward",
        "diffuse_reflectance": entry(color),
        "specular_reflectance": entry(specular),
        "alpha_u": alpha_u,
        "alpha_v": alpha_v,
        "tangent_frame": "world",
    }
    return result | ({"blend": True} if dialect == "prender" and varying else {})


def phong(block: SceneObject, reflectances: Reflectances, dialect: str) -> Entry:
    """Phong's reflection: the sum of both parts, or the program's blend (section 8.6)."""
    assert block.phong_brdf is not None  # see `missing_parameters`
    rho_d, rho_s, exponent = block.phong_brdf
    color, specular = times(reflectances.color, rho_d), times(reflectances.specular, rho_s)
    if dialect == "prender":
        color, specular = blended(color, specular, block.roughness or 0.0)
    elif block.roughness is not None:
        block.lines.becomes("roughness", "roughness-of-phong")
    if mean(color) > 0 and mean(specular) > 0:
        block.lines.remark("phong_brdf", "phong-diffuse", dialect=dialect)
    return {
        "type": "phong",
        "diffuse_reflectance": entry(color),
        "specular_reflectance": entry(specular),
        "exponent": exponent,
    }


def blended(
    color: Reflectance, specular: Reflectance, share: float
) -> tuple[Reflectance, Reflectance]:
    """The two parts weighed by `share` and 1 - `share`."""
    return times(color, share), times(specular, 1 - share)


UNUSED: dict[str, tuple[str | None, ...]] = {
    "specular": ("ward", "phong"),
    "ward_brdf": ("ward",),
    "phong_brdf": ("phong",),
    "refractive_index": ("glass",),
    "roughness": (None, "diffuse", "specular", "phong"),
}
"""Attributes with the kinds of surface that use them."""


ENDLESS = math.sqrt(0.95)
"""Albedo above which the noise of a closed room is without bound: of the paths a share of 0.05 ends
at each bounce, so that the mean square of their weights grows by albedo² / 0.95."""


def report_surface(block: SceneObject) -> None:
    """Report attributes that the surface does not use, and colours that gain energy."""
    kind = block.reflection.kind
    for field, kinds in UNUSED.items():
        if kind not in kinds and not (field == "refractive_index" and block.reflection.subsurface):
            block.lines.becomes(field, "attribute-unused", kind=kind or "diffuse")
    if kind is None and block.roughness is not None:
        block.lines.becomes("roughness", "roughness-without-reflection")
    for field in ("color", "specular"):
        if max(getattr(block, field)) > 1:
            code = "color-cut-off" if block.reflection.subsurface else "color-above-one"
            block.lines.remark(field, code)
    if kind in (None, "diffuse", "specular") and ENDLESS < max(block.color) <= 1:
        block.lines.remark("color", "color-near-one")
