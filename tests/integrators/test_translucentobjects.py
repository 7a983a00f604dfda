"""What counts as one translucent object: instances, parts, names, materials."""

import mitsuba as mi
import numpy as np
import pytest

from tests.integrators.translucent_scenes import (
    ALPHA,
    SKY,
    fresnel,
    hemispherical,
    reflectance,
    scene,
    slab,
    transform,
    translucent,
    view,
)


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("llvm_ad_rgb")


def grid(x=(-500.0, 500.0), y=(-500.0, 500.0), z=0.0):
    """A PLY file's mesh: a rectangle across Z of two triangles."""
    mesh = mi.Mesh("part", 4, 2)
    corners = [(x[0], y[0], z), (x[1], y[0], z), (x[1], y[1], z), (x[0], y[1], z)]
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.ravel(corners).astype(np.float32)
    parameters["faces"] = np.array([0, 1, 2, 0, 2, 3], np.uint32)
    parameters.update()
    return mesh


@pytest.fixture
def ply(tmp_path):
    """Function from a mesh and a material to the dictionary of a shape in a PLY file."""

    def shape(mesh, bsdf, name):
        mesh.write_ply(str(tmp_path / f"{name}.ply"))
        return {"type": "ply", "filename": str(tmp_path / f"{name}.ply"), "bsdf": bsdf}

    return shape


def slab_reflectance(alpha, eta=1.3):
    """What a slab returns of a uniform sky along its normal, without its mirror."""
    return (1 - fresnel(1.0, eta)) * (1 - hemispherical(eta)) * reflectance(alpha, eta)


def instances_of(shapes, *offsets):
    group = {"type": "shapegroup"} | shapes
    return {"group": group} | {
        f"instance{i}": {
            "type": "instance",
            "group": {"type": "ref", "id": "group"},
            "to_world": transform().translate(list(offset)),
        }
        for i, offset in enumerate(offsets)
    }


@pytest.mark.false_alarms(1e-3)
def test_an_instance_diffuses(chance, radiance):
    """A slab in an instance returns the closed form's light."""
    world = scene(sky=SKY, **instances_of({"a": slab(translucent())}, (0, 0, 0)))
    chance.equal(radiance(world, 8192), slab_reflectance(ALPHA), allowed=0.005, precision=0.01)


@pytest.mark.false_alarms(1e-3)
def test_an_instance_is_what_it_repeats(chance, radiance):
    """A ball with all orders of scattering, beside another one."""
    ball = {"type": "sphere", "bsdf": translucent(0.9, level=-1, g=0.5)}
    lone = radiance(scene(sky=SKY, ball=ball))
    instanced = radiance(scene(sky=SKY, **instances_of({"ball": ball}, (0, 0, 0), (0, 9, 0))))
    chance.equal(instanced, lone, precision=0.01)


@pytest.mark.false_alarms(1e-3)
def test_two_instances_are_two_objects(chance, radiance):
    """A slab 0.1 free paths below another one takes no light from it: there is no light below."""
    shapes = {"a": slab(translucent(0.9))}
    measured = radiance(scene(sky=SKY, **instances_of(shapes, (0, 0, 0), (0, 0, -0.1))))
    chance.equal(measured, np.full(3, slab_reflectance(0.9)), allowed=0.005, precision=0.01)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("optimize", [True, False])
@pytest.mark.parametrize("grouped", [False, True])
def test_parts_of_a_surface_are_one_object(optimize, grouped, ply, chance, radiance):
    """Two halves of a slab, of two materials that differ by what makes none: no seam.

    Seen on the seam the slab returns the closed form's light. Files keep vertices apart.
    """
    halves = {
        side: ply(grid(x=x), translucent(0.9, **more), side)
        for side, x, more in (
            ("left", (-500.0, 0.0), {}),
            ("right", (0.0, 500.0), {"r_max": 1e4}),
        )
    }
    parts = instances_of(halves, (0, 0, 0)) if grouped else halves
    kind = {"type": "dipole", "rr_depth": 100}
    world = {"type": "scene", "integrator": kind, "sensor": view(), "sky": SKY}
    measured = radiance(mi.load_dict(world | parts, optimize=optimize))
    chance.equal(measured, np.full(3, slab_reflectance(0.9)), allowed=0.005, precision=0.01)


@pytest.mark.false_alarms(1e-3)
def test_objects_of_one_material_are_not_one_object(ply, chance, radiance):
    """`mi.load_dict` merges two slabs, 0.1 free paths apart, into one mesh.

    A lamp between them that shines on the lower one alone is not seen above.
    """
    slabs = {f"slab{i}": ply(grid(z=-0.1 * i), translucent(0.9), f"slab{i}") for i in (0, 1)}
    between = {"type": "point", "position": [0, 0, -0.05], "intensity": 3.0}
    kind = {"type": "dipole", "rr_depth": 100}
    world = {"type": "scene", "integrator": kind, "sensor": view(), "sky": SKY, "lamp": between}
    merged = mi.load_dict(world | slabs)
    assert len(merged.shapes()) == 1
    expected = np.full(3, slab_reflectance(0.9))
    chance.equal(radiance(merged), expected, allowed=0.005, precision=0.01)


@pytest.mark.false_alarms(1e-3)
def test_surfaces_of_one_name_are_one_object(ply, chance, radiance):
    """Two halves that do not touch, by a hair, are one object if the material says so."""
    gap = 1e-3
    kind = {"type": "dipole", "rr_depth": 100}
    world = {"type": "scene", "integrator": kind, "sensor": view((0.1, 0, 100)), "sky": SKY}
    world["sensor"]["to_world"] = transform().look_at([0.01, 0, 100], [0.01, 0, 0], [0, 1, 0])
    results = []
    for name in ("jade", ""):
        bsdf = translucent(0.9, object=name)
        halves = {
            "left": ply(grid(x=(-500.0, -gap)), bsdf, "left"),
            "right": ply(grid(x=(gap, 500.0)), bsdf, "right"),
        }
        results.append(radiance(mi.load_dict(world | halves)))
    expected = np.full(3, slab_reflectance(0.9))
    chance.equal(results[0], expected, allowed=0.005, precision=0.01)
    assert np.all(results[1].mean < 0.75 * expected)
