"""What Mitsuba expects of plugins, for each of ours: variants, parameters, words.

A plugin that is new is covered as soon as its package lists it: its manual page says which
parameters there are. What it needs to be seen in a scene stands in `plugin_scenes.OBJECTS`.
"""

import importlib
import re
from pathlib import Path

import relume  # noqa: F401  isort: skip  first: it points Dr.Jit at a usable LLVM

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume.parameters import children
from relume.registration import runs_under
from tests.plugin_scenes import PATH, PLUGINS, entry, page, plugin_in, scene

VARIANTS = (
    "llvm_ad_rgb",
    "llvm_ad_spectral",
    "llvm_ad_mono",
    "scalar_rgb",
    "scalar_spectral",
    "llvm_ad_spectral_polarized",
    "cuda_ad_rgb",
)

each_plugin = pytest.mark.parametrize("name", PLUGINS)


@pytest.fixture(autouse=True)
def rgb():
    mi.set_variant("llvm_ad_rgb")
    yield
    mi.set_variant("llvm_ad_rgb")


def set_variant(variant):
    if variant not in mi.variants():
        pytest.skip(f"this Mitsuba has no {variant}")
    try:
        mi.set_variant(variant)
    except ImportError:
        pytest.skip(f"{variant} does not work here")


# ------------------------------ variants ------------------------------


@pytest.mark.false_alarms(1e-3)
@each_plugin
@pytest.mark.parametrize("variant", VARIANTS[1:])
def test_works_or_refuses(name, variant, chance, level):
    """Proves: a plugin renders the mean of llvm_ad_rgb, or refuses and names what works."""
    spp = 16 if "scalar" in variant else 64
    module = f"{PLUGINS[name]}.{name}"
    if runs_under(module, variant):
        rgb = chance.runs(scene(name), 64, runs=8).mean(axis=(1, 2, 3))
        set_variant(variant)
        found = chance.runs(scene(name), spp, runs=8)
        assert np.all(np.isfinite(found))
        # Colours of spectra: the white of the lamp is D65 but for a percent.
        allowed = 0.03 if mi.is_spectral else 0.005
        chance.equal(level(found.mean(axis=(1, 2, 3))), level(rgb), allowed, precision=0.04)
        return
    set_variant(variant)
    words = f"ValueError: {name} does not work under {variant}; it works under [a-z_, ]*llvm_ad_rgb"
    with pytest.raises(RuntimeError, match=words):  # by the plugin, not by what it nests
        mi.load_dict(entry(name) | {"nested": PATH})


@each_plugin
def test_pages_name_the_variants(name):
    """Proves: the manual says under which variants a plugin works."""
    module = importlib.import_module(f"{PLUGINS[name]}.{name}")
    said = re.search(r"\*\*Variants\.\*\* ([^.;]*)", module.__doc__)[1].replace("\n", " ")
    scalar = runs_under(module.__name__, "scalar_rgb")
    polarized = runs_under(module.__name__, "llvm_ad_spectral_polarized")
    jit = "``llvm_ad_*`` and ``cuda_ad_*``"
    assert (
        said
        == {
            (True, True): "All",
            (True, False): "All but the polarized ones",
            (False, True): jit,
            (False, False): f"{jit}, without the polarized ones",
        }[scalar, polarized]
    )


# ------------------------------ parameters ------------------------------

CHANGED = {
    "r_max": 0.05,
    "attenuation": [0.0, 0.5, 0.5],
    "position": [0.3, 0.0, 3.0],
    "edge_u": [0.5, 0.0, 0.0],
    "edge_v": [0.0, 0.5, 0.0],
    "g": [0.1, -0.2, 0.3],
    "falloff_angle": 1.0,
    "direction": [0.2, 0.1, -1.0],
}
"""Values that parameters change to, where 1.3 times the old one is out of range or the same."""

NOT_RENDERED = {"sampling_weight": "alone", "shutter_open": "still", "shutter_open_time": "still"}
"""Parameters of Mitsuba's base classes that act in other scenes only."""


def leaves(thing):
    """(object, key, value) for each number of a plugin, and of its textures."""
    for key, (value, _) in children(thing).items():
        if isinstance(value, mi.Texture):
            yield from leaves(value)
        elif dr.is_array_v(value) and dr.is_float_v(value) and not dr.is_matrix_v(value):
            yield thing, key, value


@each_plugin
def test_every_parameter_acts(name):
    """Proves: whatever `mi.traverse` shows of a plugin changes the picture when it is set."""
    module = f"{PLUGINS[name]}.{name}"
    own = [key for key, (value, _) in children(plugin_in(scene(name), name)).items()
           if not isinstance(value, mi.Object) or isinstance(value, mi.Texture)]  # fmt: skip
    before = np.array(mi.render(scene(name), spp=4, seed=1))
    for key in own:
        if key in NOT_RENDERED or key == "to_world":
            continue
        world = scene(name)
        plugin = plugin_in(world, name)
        parameters = mi.traverse(world)
        names = [k for k, (_, _, node, _) in parameters.properties.items()
                 if (node is plugin and k.endswith(f".{key}")) or f".{key}." in k
                 or k.startswith(f"{key}.")]  # fmt: skip
        names = [k for k in names if not k.endswith(("to_uv", "sampling_weight"))]
        assert names, (module, key, parameters)
        for full in names:
            old = parameters[full]
            new = CHANGED.get(key)
            if new is None or (isinstance(plugin, mi.BSDF) and key == "g"):
                new = old * 1.3 + (0.1 if np.all(np.array(old) == 0) else 0)
            parameters[full] = type(old)(new)
        parameters.update()
        after = np.array(mi.render(world, spp=4, seed=1))
        assert np.all(np.isfinite(after)), key
        assert not np.array_equal(before, after), key


WRONG = {
    ("ward", "alpha_u"): -1.0,
    ("ward", "alpha_v"): float("nan"),
    ("phong", "exponent"): -3.0,
    ("schlickglass", "int_ior"): 0.0,
    ("schlickglass", "ext_ior"): -1.5,
    ("subsurface", "sigma_s"): -1.0,
    ("subsurface", "sigma_a"): -1.0,
    ("subsurface", "g"): 2.0,
    ("subsurface", "eta"): -1.0,
    ("subsurface", "scale"): -1.0,
    ("subsurface", "r_max"): -1.0,
    ("falloffspot", "position"): [float("inf"), 0.0, 0.0],
    ("falloffspot", "direction"): [0.0, 0.0, 0.0],
    ("falloffspot", "cutoff_angle"): 190.0,
    ("falloffspot", "falloff_angle"): 50.0,
    ("falloffspot", "falloff_exponent"): -1.0,
    ("falloffspot", "attenuation"): [0.0, -1.0, 0.0],
    ("parallelbeam", "origin"): [float("nan"), 0.0, 0.0],
    ("parallelbeam", "edge_u"): [0.0, 0.0, 0.0],
    ("parallelbeam", "edge_v"): [1.0, 0.0, 0.0],
    ("parallelbeam", "direction"): [0.0, 0.0, 0.0],
    ("ibldome", "scale"): -1.0,
    ("hgrgb", "g"): [5.0, 0.0, 0.0],
    ("screencamera", "width"): 0.0,
    ("screencamera", "height"): -1.0,
    ("screencamera", "aperture_radius"): -0.1,
    ("screencamera", "focus_distance"): float("inf"),
    ("relativisticcamera", "velocity"): [0.8, 0.8, 0.0],
    ("dopplershift", "velocity"): [0.0, 0.0, 1.0],
    ("dopplershift", "share"): 1.5,
    ("samplescale", "response"): -1.0,
    ("samplescale", "luminance_limit"): -1.0,
}


@pytest.mark.parametrize(("name", "key"), WRONG)
def test_ranges_hold_in_the_constructor_and_after(name, key):
    """Proves: a value out of range is refused by name, when loaded as when set."""
    with pytest.raises(RuntimeError, match=f"ValueError.*{key}"):
        mi.load_dict(entry(name, **{key: WRONG[name, key]}))
    world = scene(name)
    parameters = mi.traverse(plugin_in(world, name))
    full = next(k for k in dict(parameters) if k in (key, f"{key}.value"))
    parameters[full] = type(parameters[full])(WRONG[name, key])
    with pytest.raises(ValueError, match=key):
        parameters.update()


@each_plugin
def test_wrong_types_are_refused_in_words(name):
    """Proves: a word for a number, or the reverse, gives a sentence, not a TypeError."""
    for key, (kind, _) in page(name).items():
        numeric = re.search("float|integer|boolean|point|vector", kind)
        if numeric or kind in ("string", "transform"):
            found = entry(name)
            if key == "filename":
                del found["bitmap"]
            with pytest.raises(RuntimeError) as raised:
                mi.load_dict(found | {key: "many" if numeric else 5.0})
            last = str(raised.value).strip().rpartition("\n")[2]
            assert not re.search("TypeError|AttributeError", str(raised.value)), str(raised.value)
            assert key in last, last


@pytest.mark.parametrize("key", ["int_ior", "ext_ior"])
def test_indices_have_names(key):
    """Proves: the names of materials that the stock dielectric knows give the same index."""
    for word in ("bk7", "Water", "diamond"):
        found = mi.traverse(mi.load_dict({"type": "schlickglass", key: word}))[key][0]
        ior = mi.load_dict({"type": "dielectric", "int_ior": word, "ext_ior": 1.0})
        assert found == pytest.approx(mi.traverse(ior)["eta"], rel=1e-6)
    with pytest.raises(RuntimeError, match=r"ValueError.*bk8.*Valid choices"):
        mi.load_dict({"type": "schlickglass", key: "bk8"})


CONSUMED = {"to_world", "(nested)", "filename", "bitmap", "raw"}
"""Parameters that are gone once a plugin is made, and what it shows as an object of its own."""


@each_plugin
def test_to_string_shows_all_parameters(name):
    text = str(mi.load_dict(entry(name)))
    shown = {key for key, (kind, said) in page(name).items() if "Must be" not in said} - CONSUMED
    if name == "schlickglass":
        mi.set_variant("llvm_ad_spectral")
        text += str(mi.load_dict({"type": name, "dispersion": "formula99"}))
    for metric in ("kerr", "wormhole") if name == "curvedspace" else ():
        parameters = {"metric": metric, "nested": {"type": "surfacepath"}}
        text += str(mi.load_dict({"type": name} | parameters))
    assert [key for key in sorted(shown) if not re.search(rf"\b{key}\b", text)] == []


# ------------------------------ polarization ------------------------------


@pytest.mark.parametrize("name", ["ward", "phong"])
def test_paint_depolarizes(name):
    """Proves: of a Mueller matrix the entry for intensity alone is left, that of llvm_ad_rgb."""
    wo, values = [-0.6, 0.0, 0.8], []
    for variant in ("llvm_ad_rgb", "llvm_ad_spectral_polarized"):
        set_variant(variant)
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.wi = mi.Vector3f(0.48, 0.36, 0.8)
        if mi.is_spectral:
            si.wavelengths = dr.zeros(mi.Ray3f).wavelengths + 500.0
        bsdf, ctx = mi.load_dict({"type": name}), mi.BSDFContext()
        _, weight = bsdf.sample(ctx, si, 0.1, mi.Point2f(0.3, 0.6))
        both = bsdf.eval(ctx, si, mi.Vector3f(wo)), weight
        values.append([np.array(mi.unpolarized_spectrum(m)).ravel()[0] for m in both])
    for matrix in both:
        entries = np.array(matrix)
        others = np.ones((4, 4), bool)
        others[0, 0] = False
        assert np.all(entries[others] == 0) and np.all(entries[0, 0] > 0)
    np.testing.assert_allclose(values[1], values[0], rtol=2e-3)


# ------------------------------ the page ------------------------------

PAGE = Path(__file__).parents[1] / "docs" / "contracts.md"
HEADER = """# Contracts

What the plugins keep to as plugins of Mitsuba. `python -m tests.test_contracts` makes this page;
that file and `tests/integrators/test_metropolis_films.py` prove what it says.

"""
FILMS = """## Films

`bdpt`, `pssmlt` and `erpt` fill films themselves; the other integrators leave that to Mitsuba.

| film | result |
| --- | --- |
| `rgb`, `luminance`, `xyz`, each with or without alpha; grey variants | as stock integrators |
| filters `box`, `tent`, `gaussian`, `mitchell`, `catmullrom`, `lanczos` | drawn from, with signs |
| `sample_border`, crop window, `develop` | as stock integrators |
| `specfilm`; AOVs and moments, inside or around | refused |

"""


def table(columns, rows):
    """A table, and an empty line."""
    return (
        "".join(f"| {' | '.join(r)} |\n" for r in (columns, ["---"] * len(columns), *rows)) + "\n"
    )


def contracts():
    """The text of the page."""
    works = [
        [f"`{name}`", *("works" if runs_under(f"{package}.{name}", v) else "refuses"
                        for v in VARIANTS)]
        for name, package in PLUGINS.items()
    ]  # fmt: skip
    shown = [
        [f"`{name}`", f"`{key}`", kind, "yes" if "Differentiable." in said else "no",
         "yes" if (name, key) in WRONG else ""]
        for name in PLUGINS
        for key, (kind, said) in page(name).items()
        if re.search(r"(Differentiable|Exposed)\.$", said)
    ]  # fmt: skip
    return (
        HEADER
        + "## Variants\n\nWhere a plugin does not work, its constructor names the variants that do."
        + " Where it works, the\nmean of a picture is that under `llvm_ad_rgb`. `cuda_ad_rgb` is"
        + " tested where there is a GPU.\n\n"
        + table(["plugin", *(f"`{variant}`" for variant in VARIANTS)], works)
        + FILMS
        + "## Parameters\n\nWhat `mi.traverse` shows: setting it changes the picture. A range is"
        + " held to in the constructor and\nafter each change.\n\n"
        + table(["plugin", "parameter", "type", "derivatives", "range"], shown).rstrip("\n")
        + "\n"
    )


def test_the_page_is_up_to_date():
    """Made by `python -m tests.test_contracts`."""
    assert PAGE.read_text(encoding="utf-8") == contracts()


if __name__ == "__main__":
    mi.set_variant("llvm_ad_rgb")
    PAGE.write_text(contracts(), encoding="utf-8")
