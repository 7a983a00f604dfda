"""A small scene for each plugin in which its work is visible."""

import importlib
import inspect

import mitsuba as mi
import numpy as np
from docutils import nodes
from docutils.core import publish_doctree

from relume import plugins
from relume.parameters import children

KINDS = {"relume.bsdfs": "bsdf", "relume.emitters": "lamp", "relume.integrators": "integrator",
         "relume.phasefunctions": "phase", "relume.sensors": "sensor",
         "relume.textures": "texture", "relume.samplers": "sampler"}  # fmt: skip
PLUGINS = {name: package.__name__ for package in plugins.PACKAGES for name in package.PLUGINS}
PATH = {"type": "path", "max_depth": 4}
OBJECTS = {
    "ibldome": {"map": "angular"},
    "falloffspot": {"position": [0.0, 0.0, 3.0], "direction": [0.0, 0.1, -1.0],
                    "cutoff_angle": 40.0, "falloff_angle": 20.0},
    "parallelbeam": {"origin": [-0.6, -0.5, 3.0], "direction": [0.1, 0.0, -1.0]},
    "hgrgb": {"g": [0.5, 0.5, 0.5]},
    "screencamera": {"width": 0.7, "height": 0.7, "aperture_radius": 0.1, "focus_distance": 3.0},
    "subsurface": {"sigma_s": 5.0, "sigma_a": 0.5},
    "dipole": {"max_depth": 4},
    "pssmlt": {"fallback": False, "bootstrap": 1.0},
    "samplescale": {"luminance_limit": 0.4},
    "curvedspace": {"center": [0.0, 1.5, 0.0], "mass": 0.05,
                    "nested": {"type": "surfacepath", "max_depth": 4}},
    "dopplershift": {"velocity": [0.02, 0.0, 0.0], "share": 0.0},
    "relativisticcamera": {"width": 0.7, "height": 0.7, "aperture_radius": 0.1,
                           "focus_distance": 3.0},
    "accretiondisk": {"quantity": "reflectance", "mass": 0.05, "outer_radius": 2.0},
    "schlickglass": {"int_ior": 1.4},
    "domesun": {"direction": [0.1, 0.0, -1.0], "radius": 5.0},
    "apparentlamp": {"origin": [-0.5, -0.5, 3.0], "edge_u": [0.0, 1.0, 0.0],
                     "edge_v": [1.0, 0.0, 0.0]},
}  # fmt: skip
"""Parameters that make a plugin's work visible in the scene."""


def page(name):
    """Type and description of each parameter that a plugin's manual page lists, by name."""
    text = inspect.getdoc(importlib.import_module(f"{PLUGINS[name]}.{name}"))
    tree = publish_doctree(text, settings_overrides={"report_level": 4})
    rows = next(tree.findall(nodes.table)).findall(nodes.row)
    cells = [[" ".join(cell.astext().split()) for cell in row] for row in rows][1:]
    return {name: tuple(rest) for names, *rest in cells for name in names.split(", ")}


def entry(name, **parameters):
    """The dictionary of a plugin."""
    found = {"type": name} | OBJECTS.get(name, {}) | parameters
    if name == "spheremap":
        picture = np.linspace(0.2, 1, 6 * 6, dtype=np.float32).reshape(6, 6, 1)
        found["nested"] = {"type": "bitmap", "bitmap": mi.Bitmap(picture), "raw": True}
    elif "(nested)" in page(name):
        found.setdefault("nested", {"type": "path", "max_depth": 4})
    if name == "accretiondisk":
        picture = np.linspace(0.2, 1, 6 * 6, dtype=np.float32).reshape(6, 6, 1)
        found["picture"] = {"type": "bitmap", "bitmap": mi.Bitmap(picture), "raw": True}
    if name == "ibldome":
        picture = np.linspace(0.2, 1, 6 * 6 * 3, dtype=np.float32).reshape(6, 6, 3).mean(2)
        found["bitmap"] = mi.Bitmap(np.repeat(picture[..., None], 3, 2))
    return found


def scene(name, film=None, **parameters):
    """A grey floor and ball under a lamp and a dim sky; one of them is, or has, the plugin."""
    T = mi.ScalarTransform4f
    view = T().look_at([0, -3, 3], [0, 0, 0], [0, 0, 1])
    box = {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"},
           "pixel_format": "rgb"}  # fmt: skip
    above = T().look_at([0, 2, 3], [0, 0, 0], [1, 0, 0])
    d = {
        "type": "scene",
        "integrator": PATH,
        "sky": {"type": "constant", "radiance": 0.2},
        "lamp": {"type": "rectangle", "to_world": above,
                 "emitter": {"type": "area", "radiance": 3.0}},
        "floor": {"type": "rectangle", "bsdf": {"type": "diffuse"}},
        "ball": {"type": "sphere", "radius": 0.7},
        "sensor": {"type": "perspective", "fov": 40, "to_world": view, "film": film or box},
    }  # fmt: skip
    own, kind = entry(name, **parameters), KINDS[PLUGINS[name]]
    if kind == "bsdf":
        d["ball"]["bsdf"] = own
        if name == "subsurface":
            d["integrator"] = {"type": "dipole", "max_depth": 4}
    elif kind == "phase":
        d["ball"] |= {
            "bsdf": {"type": "null"},
            "interior": {"type": "homogeneous", "sigma_t": 1.0, "phase": own},
        }
        d["integrator"] = {"type": "volpath", "max_depth": 4}
    elif kind == "integrator":
        d["integrator"] = own
        if name == "dipole":
            d["ball"]["bsdf"] = {"type": "subsurface", "sigma_s": 5.0}
    elif kind == "sensor":
        d["sensor"] = own | {"to_world": view, "film": d["sensor"]["film"]}
    elif name == "ibldome":
        black = {"type": "conductor", "specular_reflectance": 0.0}
        d["lamp"] = {"type": "sphere", "radius": 20.0, "bsdf": black, "emitter": own}
    elif kind == "sampler":
        d["sensor"]["sampler"] = own
    elif kind == "texture":
        d["ball"]["bsdf"] = {"type": "diffuse", "reflectance": own}
    elif name in ("falloffspot", "parallelbeam", "domesun"):
        d["lamp"] = own
    else:
        d["lamp"]["emitter"] = own
    return mi.load_dict(d)


def plugin_in(thing, name):
    """The plugin in a scene."""
    if type(thing).__module__ == f"{PLUGINS[name]}.{name}":
        return thing
    for child, _ in children(thing).values():
        if isinstance(child, mi.Object) and (found := plugin_in(child, name)):
            return found
    return None
