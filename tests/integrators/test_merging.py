"""`bdpt` with `merge_radius`: light that mirrors hide from both ends, against the same scene
unfolded, in which emitter sampling finds it."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume import (
    bsdfs,  # noqa: F401  registers the plugins
    emitters,  # noqa: F401
    integrators,  # noqa: F401
)
from relume.integrators import merging
from relume.session import Session

MIRROR = {"type": "conductor", "material": "none"}
LENS = {"type": "thinlens", "aperture_radius": 0.2, "focus_distance": 5.0}


@pytest.fixture(autouse=True)
def variant(request):
    mi.set_variant(getattr(request, "param", "llvm_ad_rgb"))
    yield
    mi.set_variant("llvm_ad_rgb")


def wall(x, towards, scale, **parts):
    """A rectangle across the x axis that faces along it."""
    view = mi.ScalarTransform4f().look_at([x, 2.5, 0], [x + towards, 2.5, 0], [0, 1, 0])
    return {"type": "rectangle", "to_world": view.scale(scale)} | parts


def lamp(kind, x, towards):
    """A lamp that shines along the x axis."""
    if kind == "spot":
        return {"type": "falloffspot", "position": [x, 2.5, 0], "direction": [towards, -0.42, 0],
                "cutoff_angle": 15, "intensity": {"type": "rgb", "value": 20.0}}  # fmt: skip
    black = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
    radiance = {"type": "rgb", "value": 9.0}
    return wall(x, towards, 0.7, bsdf=black, emitter={"type": "area", "radiance": radiance})


def floor(light="wall", sensor=None, mirrors="both"):
    """A floor lit by way of a mirror and seen by way of another ("both"); each end is behind its
    mirror where there is none. Or ("above") both see the floor, and a mirror is above it."""
    lit = seen = mirrors == "both"
    x, to = (-1, -3) if seen else (-5, -3)
    camera = {
        "type": "perspective", "fov": 14,
        "to_world": mi.ScalarTransform4f().look_at([x, 2.5, 0], [to, 1.3, 0], [0, 1, 0]),
        "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"},
                 "pixel_format": "luminance" if mi.is_monochromatic else "rgb"},
    } | (sensor or {})  # fmt: skip
    d = {
        "type": "scene",
        "sensor": camera,
        "floor": {
            "type": "rectangle", "bsdf": {"type": "diffuse"},
            "to_world": mi.ScalarTransform4f().rotate([1, 0, 0], -90).scale(3),
        },
        "lamp": lamp(light, 1 if lit else 5, 1 if lit else -1),
    }  # fmt: skip
    if mirrors == "above":
        down = mi.ScalarTransform4f().translate([0, 3, 0]).rotate([1, 0, 0], 90)
        d["lamp"] = lamp(light, -5, 1)
        d["above"] = {"type": "rectangle", "to_world": down.scale(3), "bsdf": MIRROR}
    if lit:
        d["by lamp"] = wall(3, -1, 2.5, bsdf=MIRROR)
    if seen:
        d["by camera"] = wall(-3, 1, 2.5, bsdf=MIRROR)
    return mi.load_dict(d)


def integrator(n=4, only=None, **options):
    known = {"type": "bdpt", "min_depth": n, "max_depth": n, "merge_radius": 0.3}
    made = mi.load_dict(known | options)
    made.only = only
    return made


def truth(light, sensor, chance, level):
    """Mean of the unfolded scene."""
    made = mi.load_dict({"type": "surfacepath", "min_depth": 2, "max_depth": 2})
    scene = floor(light, sensor, "none")
    return level(chance.runs(scene, 256, 6, integrator=made).mean((1, 2, 3)))


CASES = {
    "spot": ("llvm_ad_rgb", None),
    "wavelengths": ("llvm_ad_spectral", None),
    "lens": ("llvm_ad_mono", LENS),
}


@pytest.mark.false_alarms(1e-3, reduced=4)
@pytest.mark.parametrize(("variant", "sensor"), CASES.values(), ids=CASES, indirect=["variant"])
def test_merging_alone_is_exact(variant, sensor, chance, level):
    """Light of a spot, which nothing else finds; 2 % too much of it is found."""
    made = integrator()
    found = level(chance.runs(floor("spot", sensor), 1024, 12, integrator=made).mean((1, 2, 3)))
    chance.equal(found, truth("spot", sensor, chance, level), precision=0.007)


@pytest.mark.false_alarms(1e-3, reduced=4)
@pytest.mark.parametrize("only", [None, (3, 3)])
def test_hits_and_merges_share_the_light_of_a_lamp(only, chance, level):
    """All ways, of which two find this light, and merging alone."""
    made = integrator(only=only)
    found = level(chance.runs(floor(), 4096, 6, integrator=made).mean((1, 2, 3)))
    chance.equal(found, truth("wall", None, chance, level), precision=0.03)


def test_each_vertex_counts_once(monkeypatch):
    """Also where all cells share one entry of the table, which then has each vertex eight times."""
    scene, made = floor("spot"), integrator()
    few = np.array(mi.render(scene, spp=16, seed=1, integrator=made))
    monkeypatch.setattr(merging.LightGrid, "entry", lambda self, cell, group: group * self.last)
    one = np.array(mi.render(scene, spp=16, seed=1, integrator=made))
    assert one == pytest.approx(few, rel=1e-4)


def cornell(*blocks):
    """The Cornell box with a wide lamp and two materials for its blocks."""
    d = mi.cornell_box()
    d["sensor"]["film"] |= {"width": 16, "height": 16, "rfilter": {"type": "box"}}
    d["small-box"]["bsdf"], d["large-box"]["bsdf"] = blocks
    ceiling = mi.ScalarTransform4f().translate([0, 0.99, 0]).rotate([1, 0, 0], 90).scale(0.5)
    emitter = {"type": "area", "radiance": {"type": "rgb", "value": 8.0}}
    d["light"] = {"type": "rectangle", "to_world": ceiling, "emitter": emitter}
    return mi.load_dict(d)


DIFFUSE = {"type": "diffuse"}


HIDES_NOTHING = {
    "no mirrors": (lambda: cornell(DIFFUSE, DIFFUSE), 6),
    "mirrors, paths of three edges": (lambda: cornell(MIRROR, MIRROR), 3),
    "a mirror that the camera does not see": (lambda: floor("spot", None, "above"), 4),
}


@pytest.mark.parametrize(("scene", "n"), HIDES_NOTHING.values(), ids=HIDES_NOTHING)
def test_nothing_changes_where_nothing_is_hidden(scene, n):
    """Bit for bit: no light is merged, and no weight differs, where an edge of each vertex can be
    connected."""
    with_merging, without = (
        np.array(mi.render(scene(), spp=32, seed=2, integrator=made))
        for made in (integrator(n, min_depth=1, merge_radius=r) for r in (2.0, 0.0))
    )
    assert without.any()
    assert np.array_equal(with_merging, without)


@pytest.mark.false_alarms(1e-3, reduced=4)
def test_is_surfacepath(chance, level):
    """All light, part of it merged, in quarters of the picture."""
    scene = cornell(MIRROR, {"type": "schlickglass"})

    def quarters(made, spp):
        pictures = chance.runs(scene, spp, 6, integrator=made)
        return level(pictures.reshape(6, 2, 8, 2, 8, -1).mean(axis=(2, 4, 5)))

    path = mi.load_dict({"type": "surfacepath", "max_depth": 6})
    both = quarters(integrator(6, min_depth=1, merge_radius=0.3), 128), quarters(path, 1024)
    chance.equal(*both, precision=0.02)


def test_without_a_radius_there_is_no_grid(monkeypatch):
    """Nothing of merging is traced into a kernel."""

    def called(*args):
        raise AssertionError

    for name in ("LightGrid", "pixel_width"):
        monkeypatch.setattr(f"relume.integrators.bdpt.{name}", called)
    for name in ("merged", "unconnected"):
        monkeypatch.setattr(f"relume.integrators.eyesubpaths.{name}", called)
    picture = mi.render(floor(), spp=4, integrator=integrator(merge_radius=0.0))
    assert dr.all(dr.isfinite(picture.array))


def test_a_pass_depends_on_its_index_alone():
    """Passes in another order are the same, bit for bit, by the same kernels; radii fall with
    their index."""
    scene, made = floor("spot"), integrator()
    session = Session(scene, 24, seed=5, integrator=made, per_pass=8)
    first = [session.render_pass(i, 8).sum for i in (0, 1, 2)]
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        again = [session.render_pass(i, 8).sum for i in (2, 0, 1)]
        kernels = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
    assert all(np.array_equal(first[i], x) for i, x in zip((2, 0, 1), again, strict=True))
    assert all(kernel["cache_hit"] for kernel in kernels)
    made.pass_index = 0
    seed = session._seed(1)
    picture = np.array(mi.render(scene, spp=8, seed=seed, integrator=made)).reshape(-1, 3).T
    assert not np.array_equal(picture * np.float32(8), first[1])


def test_the_radius_falls_so_that_the_mean_of_all_passes_is_right():
    """Radii r_i: the mean of r_i^2, the bias, and of 1 / (n r_i^2), the noise, both fall."""
    i = np.arange(10**5)
    area = np.array([merging.radius_of(2.0, k) ** 2 for k in i])
    assert area[0] == 4
    for few, many in ((10, 100), (1000, 10**5)):
        assert area[:many].mean() < 0.7 * area[:few].mean()
        assert (1 / area[:many]).mean() / many < 0.5 * (1 / area[:few]).mean() / few


def test_refuses_a_negative_radius():
    with pytest.raises(RuntimeError, match="merge_radius is -1"):
        integrator(merge_radius=-1.0)
