"""All materials as plugins: XML, textures, traverse, gradients, two-sidedness, integrators."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

RGB = {"type": "rgb", "value": [0.5, 0.3, 0.1]}
WARD = {"type": "ward", "diffuse_reflectance": RGB, "specular_reflectance": 0.4, "alpha_u": 0.3}
PHONG = {"type": "phong", "diffuse_reflectance": RGB, "specular_reflectance": 0.4, "exponent": 8.0}
GLASS = {"type": "schlickglass", "int_ior": 1.4, "specular_transmittance": RGB}

BOX = {"type": "box"}

WI = np.array([[0.48, 0.36, 0.8]])


def value(material, at, uv=(0.5, 0.5)):
    """f cos theta_o for one pair of directions, one number per channel."""
    bsdf = mi.load_dict(material) if isinstance(material, dict) else material
    wo = mi.Vector3f(-0.6, 0.0, 0.8)
    return np.array(bsdf.eval(mi.BSDFContext(), at(WI, uv), wo)).ravel()


def scene(material, integrator="path", **shape):
    """A tilted square under a lamp and a dim sky."""
    T = mi.ScalarTransform4f
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": integrator, "max_depth": 3},
            "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 0.2}},
            "lamp": {
                "type": "rectangle",
                "to_world": T().look_at([0, 2, 3], [0, 0, 0], [1, 0, 0]) @ T().scale(0.7),
                "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 4.0}},
            },
            "square": {"type": "rectangle", "bsdf": material, **shape},
            "sensor": {
                "type": "perspective",
                "fov": 30,
                "to_world": T().look_at([0, -3, 3], [0, 0, 0], [0, 0, 1]),
                "film": {
                    "type": "hdrfilm",
                    "width": 16,
                    "height": 16,
                    "rfilter": BOX,
                },
            },
        }
    )


def test_xml(at):
    """The same materials from XML and from a dict, in a scalar variant too."""
    for variant in ("llvm_ad_rgb", "scalar_rgb"):
        mi.set_variant(variant)
        bsdf = mi.load_string(
            """<bsdf type="ward" version="3.0.0">
                 <rgb name="diffuse_reflectance" value="0.5, 0.3, 0.1"/>
                 <float name="alpha_u" value="0.3"/> <string name="variant" value="duer"/>
               </bsdf>"""
        )
        si = mi.SurfaceInteraction3f()
        si.wi = WI[0].tolist()
        got = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(-0.6, 0, 0.8))
        from_xml = np.array(got).ravel()
        if variant == "llvm_ad_rgb":
            expected = value({**WARD, "specular_reflectance": 0.2, "variant": "duer"}, at)
        np.testing.assert_allclose(from_xml, expected, rtol=1e-5)


def texels(*values, raw=True):
    """Nearest-texel texture, one texel after the other along u, grey."""
    image = np.array(values, dtype=np.float32).reshape(1, -1, 1)
    return {
        "type": "bitmap",
        "bitmap": mi.Bitmap(image),
        "raw": raw,
        "filter_type": "nearest",
    }


@pytest.mark.parametrize(
    ("material", "name", "values"),
    [
        (WARD, "diffuse_reflectance", (0.1, 0.9)),
        (WARD, "specular_reflectance", (0.1, 0.9)),
        (WARD, "alpha_u", (0.1, 0.6)),
        (WARD, "alpha_v", (0.1, 0.6)),
        (PHONG, "diffuse_reflectance", (0.1, 0.9)),
        (PHONG, "specular_reflectance", (0.1, 0.9)),
        (PHONG, "exponent", (1.0, 40.0)),
    ],
)
def test_textures(material, name, values, at):
    """A texture acts at its point as its value there does everywhere, and is flagged as varying."""
    textured = mi.load_dict({**material, name: texels(*values)})
    for u, x in zip((0.25, 0.75), values, strict=True):
        np.testing.assert_allclose(
            value(textured, at, (u, 0.5)), value({**material, name: x}, at), rtol=1e-4
        )
    assert mi.has_flag(textured.flags(), mi.BSDFFlags.SpatiallyVarying)
    assert not mi.has_flag(mi.load_dict(material).flags(), mi.BSDFFlags.SpatiallyVarying)


def test_vertex_colours_serve_as_reflectance():
    """`mesh_attribute` knows no mean; the choice of the lobe must not need one."""
    mesh = mi.Mesh("square", 4, 2, props=mi.Properties(), has_vertex_normals=False)
    params = mi.traverse(mesh)
    params["vertex_positions"] = [-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]
    params["faces"] = [0, 1, 2, 0, 2, 3]
    params.update()
    mesh.add_attribute("vertex_color", 3, [0.6, 0.3, 0.0] * 4)
    colour = {"type": "mesh_attribute", "name": "vertex_color"}
    for material in (WARD, PHONG):
        bsdf = mi.load_dict({**material, "diffuse_reflectance": colour})
        ray = mi.Ray3f([0.1, 0.2, 1], [0, 0, -1])
        si = mi.load_dict({"type": "scene", "mesh": mesh}).ray_intersect(ray)
        got, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, mi.Vector3f(0.6, 0, 0.8))
        plain = mi.load_dict(
            {**material, "diffuse_reflectance": {"type": "rgb", "value": [0.6, 0.3, 0.0]}}
        )
        expected, pdf_expected = plain.eval_pdf(mi.BSDFContext(), si, mi.Vector3f(0.6, 0, 0.8))
        np.testing.assert_allclose(np.array(got), np.array(expected), rtol=1e-5)
        np.testing.assert_allclose(np.array(pdf), np.array(pdf_expected), rtol=1e-5)


def test_reflectance_outside_the_unit_interval(at):
    """Unbounded colours, as old files have them, are taken as they are written."""
    colour = [1.5, 0.2, 0.0]
    wild = {"type": "srgb", "color": colour, "unbounded": True}
    for material in (WARD, PHONG):
        half = {"type": "rgb", "value": [0.75, 0.1, 0]}
        tame = value({**material, "diffuse_reflectance": half}, at)
        lobe = value({**material, "diffuse_reflectance": 0.0}, at)
        got = value({**material, "diffuse_reflectance": wild}, at)
        np.testing.assert_allclose(got - lobe, 2 * (tame - lobe), rtol=1e-4, atol=1e-7)
    bsdf = mi.load_dict({"type": "schlickglass", "specular_reflectance": wild})
    _, weight = bsdf.sample(mi.BSDFContext(), at(WI), 0.0, mi.Point2f(0.5))
    np.testing.assert_allclose(np.array(weight).ravel(), colour)


@pytest.mark.parametrize(
    ("material", "key", "name", "new"),
    [
        (WARD, "alpha_u.value", "alpha_u", 0.6),
        (WARD, "alpha_v.value", "alpha_v", 0.6),
        (WARD, "specular_reflectance.value", "specular_reflectance", 0.9),
        (PHONG, "exponent.value", "exponent", 60.0),
        (PHONG, "specular_reflectance.value", "specular_reflectance", 0.9),
    ],
)
def test_parameters_can_be_changed(material, key, name, new, at):
    bsdf = mi.load_dict(material)
    params = mi.traverse(bsdf)
    params[key] = new
    params.update()
    np.testing.assert_allclose(value(bsdf, at), value({**material, name: new}, at), rtol=1e-6)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize(
    ("material", "key", "step"),
    [
        (WARD, "diffuse_reflectance.value", 0.05),
        (WARD, "specular_reflectance.value", 0.05),
        (WARD, "alpha_u.value", 0.01),
        (WARD, "alpha_v.value", 0.01),
        ({**WARD, "variant": "duer"}, "alpha_u.value", 0.01),
        ({**WARD, "variant": "balanced"}, "alpha_u.value", 0.01),
        (PHONG, "diffuse_reflectance.value", 0.05),
        (PHONG, "specular_reflectance.value", 0.05),
        (PHONG, "exponent.value", 0.5),
    ],
)
def test_gradients(material, key, step, chance, level):
    """`prb` backwards against central differences of the same picture's mean, in twelve runs.

    Both are estimates: the differences use common random numbers, 512 samples a pixel at 256
    pixels in a run; their error in step² is below 0.5 %.
    """
    s = scene(material, "prb")
    params = mi.traverse(s)
    key = f"square.bsdf.{key}"
    centre = type(params[key])(params[key])

    def mean(x, seed):
        params[key] = x
        params.update()
        return dr.mean(mi.render(s, params, spp=chance.samples(512), seed=seed), axis=None)

    differences, gradients = [], []
    for _ in range(12):
        one, other = chance.seed(), chance.seed()
        difference = mean(centre + step, one) - mean(centre - step, one)
        differences.append(difference.array[0] / (2 * step))
        x = type(centre)(centre)
        dr.enable_grad(x)
        dr.backward(mean(x, other))
        gradients.append(np.array(dr.grad(x)).sum())
    chance.equal(level(gradients), level(differences), allowed=5e-3, precision=0.02)


def test_gradient_of_glass(at):
    """Weights follow the tints; no gradient goes through the index (its lobes are deltas)."""
    bsdf = mi.load_dict(GLASS)
    params = mi.traverse(bsdf)
    key = "specular_transmittance.value"
    dr.enable_grad(params[key])
    params.update()
    _, weight = bsdf.sample(mi.BSDFContext(), at(WI), 0.9, mi.Point2f(0.5))
    dr.backward(weight[0])
    gradient = np.array(dr.grad(params[key])).ravel()
    np.testing.assert_allclose(gradient, [1 / 1.4**2, 0, 0], rtol=1e-5)


@pytest.mark.parametrize("material", [WARD, PHONG])
def test_two_sided(material, at):
    """`twosided` shows the back as the front seen in the mirror, in the sample as in the value."""
    front, both = mi.load_dict(material), mi.load_dict({"type": "twosided", "bsdf": material})
    below, ctx = WI * [1, 1, -1], mi.BSDFContext()
    got = both.eval(ctx, at(below), mi.Vector3f(-0.6, 0, -0.8))
    np.testing.assert_allclose(np.array(got).ravel(), value(front, at), rtol=1e-6)
    assert np.all(np.array(front.eval(ctx, at(below), mi.Vector3f(-0.6, 0, -0.8))) == 0)
    for u in (0.1, 0.9):
        (a, v), (b, w) = (
            m.sample(ctx, at(wi), u, mi.Point2f(0.3, 0.6)) for m, wi in ((front, WI), (both, below))
        )
        np.testing.assert_allclose(np.array(b.wo), np.array(a.wo) * [[1], [1], [-1]], rtol=1e-6)
        np.testing.assert_allclose(np.array(w), np.array(v), rtol=1e-6)


def same_means(scenes, chance, level):
    """Judge whether all scenes have the same mean, in sixteen runs of each."""
    means = [level(chance.runs(s, 384, 16).mean(axis=(1, 2, 3))) for s in scenes]
    for other in means[1:]:
        chance.equal(other, means[0], precision=0.01, of=len(means) - 1)


@pytest.mark.false_alarms(1e-3, reduced=4)
@pytest.mark.parametrize("material", [WARD, PHONG], ids=lambda m: m["type"])
def test_integrators_agree(material, chance, level):
    """Camera paths with and without media, replayed paths, and light paths (importance)."""
    names = ("path", "volpath", "prb", "ptracer")
    same_means([scene(material, name) for name in names], chance, level)


@pytest.mark.false_alarms(1e-3, reduced=4)
def test_integrators_agree_on_glass(chance, level):
    """A floor seen from within glass, lit through the glass's surface by a lamp outside.

    Camera paths carry radiance, which the boundary scales; light paths carry importance, which it
    does not: the floor must come out the same.
    """
    T = mi.ScalarTransform4f

    def floor(integrator):
        return mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": integrator, "max_depth": 4},
                "lamp": {
                    "type": "rectangle",
                    "to_world": T().translate([0, 0, 1]) @ T().rotate([1, 0, 0], 180),
                    "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 1.0}},
                },
                "pane": {"type": "rectangle", "to_world": T().scale(4), "bsdf": GLASS},
                "floor": {
                    "type": "rectangle",
                    "to_world": T().translate([0, 0, -1]),
                    "bsdf": {"type": "diffuse"},
                },
                "sensor": {
                    "type": "perspective",
                    "to_world": T().look_at([0, -1, -0.5], [0, 0, -1], [0, 0, 1]),
                    "film": {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": BOX},
                },
            }
        )

    names = ("path", "volpath", "prb", "ptracer")
    same_means([floor(name) for name in names], chance, level)


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_mono", "llvm_ad_spectral"])
def test_other_variants(variant):
    """Grey materials have the same value in every variant, in every channel."""
    if variant not in mi.variants():
        pytest.skip(f"this Mitsuba has no {variant}")
    results = []
    for name in ("llvm_ad_rgb", variant):
        mi.set_variant(name)
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(0.48, 0.36, 0.8)
        if mi.is_spectral:
            si.wavelengths = mi.Spectrum(450.0, 500.0, 550.0, 600.0)
        row = []
        for material in (WARD, PHONG):
            bsdf = mi.load_dict({**material, "diffuse_reflectance": 0.3})
            got = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(-0.6, 0, 0.8))
            row.append(np.unique(np.array(got).round(6)))
            _, weight = bsdf.sample(mi.BSDFContext(), si, 0.1, mi.Point2f(0.3, 0.6))
            row.append(np.unique(np.array(weight).round(5)))
        _, weight = mi.load_dict({"type": "schlickglass"}).sample(
            mi.BSDFContext(), si, 0.9, mi.Point2f(0.5)
        )
        row.append(np.unique(np.array(weight).round(5)))
        results.append(row)
    for a, b in zip(*results, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-4)


BELOW = ("ward", "phong", "subsurface", "schlickglass", "shadowcatcher")


@pytest.mark.parametrize("kind", BELOW)
def test_a_direction_that_is_evaluated_does_not_touch_the_one_that_is_drawn(kind):
    """In one call, even if the former lies below the surface, and the caller's mask stays."""
    mi.set_variant("llvm_ad_rgb")
    bsdf, ctx = mi.load_dict({"type": kind}), mi.BSDFContext()
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = dr.normalize(mi.Vector3f([0.3, 0.3], 0.1, 1))
    numbers, active = (mi.Float(0.6, 0.6), mi.Point2f(0.3, 0.7)), mi.Bool(True, True)
    below = mi.Vector3f(0.1, 0, [-0.9, 0.9])
    *_, bs, weight = bsdf.eval_pdf_sample(ctx, si, below, *numbers, active)
    alone, weight_alone = bsdf.sample(ctx, si, *numbers, mi.Bool(True, True))
    assert dr.all(active)
    assert np.array(weight) == pytest.approx(np.array(weight_alone))
    assert np.array(bs.pdf) == pytest.approx(np.array(alone.pdf))
