"""Derivatives of `dipole` with respect to the medium, against finite differences."""

import subprocess
import sys

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

RGB = {"sigma_s": [2.0, 3.0, 4.0], "sigma_a": [0.2, 0.1, 0.3], "g": [0.3, 0.2, 0.1]}
STEPS = {"sigma_s": 0.1, "sigma_a": 0.01, "g": 0.05}


@pytest.fixture(autouse=True)
def rgb():
    mi.set_variant("llvm_ad_rgb")


def ball(integrator, orders=-1, sky=0.3, **parameters):
    """A translucent ball that fills the picture, under a uniform sky and a lamp to the side."""
    medium = {name: {"type": "rgb", "value": value} for name, value in (RGB | parameters).items()}
    pose = mi.ScalarTransform4f().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"},
            "pixel_format": "rgb"}  # fmt: skip
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": integrator,
            "sky": {"type": "constant", "radiance": sky},
            "lamp": {"type": "sphere", "center": [4, 2, 3], "radius": 0.5,
                     "emitter": {"type": "area", "radiance": 60.0}},
            "ball": {"type": "sphere", "bsdf": {"type": "subsurface", "scale": 4.0,
                                                "level": orders, **medium}},
            "sensor": {"type": "orthographic", "to_world": pose, "film": film},
        }
    )  # fmt: skip


def gradient(scene, parameters, key, spp, seed):
    """The derivative of the mean of the picture, by reverse mode."""
    value = mi.Color3f(dr.detach(parameters[key]))
    dr.enable_grad(value)
    parameters[key] = value
    parameters.update()
    picture = mi.render(scene, parameters, spp=spp, seed=seed, seed_grad=seed + 1)
    dr.backward(dr.mean(picture, axis=None))
    found = np.array(dr.grad(value)).ravel()
    parameters[key] = dr.detach(value)
    parameters.update()
    return found


def difference(scene, parameters, key, spp, seed):
    """The same by finite differences, all channels at once, as they do not mix."""
    old, means = mi.Color3f(parameters[key]), []
    for sign in (-1, 1):
        parameters[key] = old + sign * STEPS[key.split(".")[2]]
        parameters.update()
        picture = np.array(mi.render(scene, spp=spp, seed=seed), dtype=float)
        means.append(picture.mean((0, 1)))
    parameters[key] = old
    parameters.update()
    return (means[1] - means[0]) / (2 * STEPS[key.split(".")[2]]) / 3


DIPOLE = {"type": "dipole", "max_depth": 3}
CASES = {
    "all orders, sigma_s": (DIPOLE, -1, "sigma_s"),
    "all orders, sigma_a": (DIPOLE, -1, "sigma_a"),
    "all orders, g": (DIPOLE, -1, "g"),
    "multiple": (DIPOLE, -2, "sigma_a"),
    "normalized": (DIPOLE | {"profile": "normalized"}, -1, "sigma_s"),
    "wrapped": ({"type": "samplescale", "response": 2.0, "nested": {
        "type": "dopplershift", "share": 0.0, "nested": DIPOLE}}, -2, "sigma_s"),
}


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("case", CASES)
def test_derivatives(case, chance, level):
    """Proves: derivatives are those of finite differences to 2 %, single scattering included."""
    integrator, orders, name = CASES[case]
    scene = ball(integrator, orders)
    parameters, key = mi.traverse(scene), f"ball.bsdf.{name}.value"
    runs, spp = 6, chance.samples(128)
    found = [gradient(scene, parameters, key, spp, chance.seed()) for _ in range(runs)]
    wanted = [difference(scene, parameters, key, 4 * spp, chance.seed()) for _ in range(runs)]
    chance.equal(level(found), level(wanted), allowed=0.005, of=2)
    whole = (level(np.sum(values, axis=1)) for values in (found, wanted))
    chance.equal(*whole, allowed=0.005, precision=0.02, of=2)


def test_last_depth_has_all_single_scattering():
    """Proves: paths that scatter once lose nothing at the largest depth, as they have no other."""
    pictures = []
    for depth in (2, 3):
        scene = ball({"type": "dipole", "max_depth": depth}, sigma_s=[0.2] * 3, sigma_a=[2.0] * 3)
        pictures.append(np.array(mi.render(scene, spp=256, seed=1)).mean())
    assert pictures[0] == pytest.approx(pictures[1], rel=2e-3)


def test_a_process_that_differentiated_ends_well():
    """Proves: neither derivatives nor their refusal leave an interpreter that dies at its end."""
    code = """
import relume, drjit as dr, mitsuba as mi, sys
mi.set_variant("llvm_ad_rgb")
film = {"type": "hdrfilm", "width": 4, "height": 4}
for integrator in ({"type": "dipole", "max_depth": 4},
                   {"type": "pssmlt", "nested": {"type": "path"}},
                   {"type": "erpt", "nested": {"type": "path"}}):
    scene = mi.load_dict({"type": "scene", "integrator": integrator, "sky": {"type": "constant"},
                          "ball": {"type": "sphere", "bsdf": {"type": "subsurface"}},
                          "sensor": {"type": "orthographic", "film": film}})
    parameters = mi.traverse(scene)
    dr.enable_grad(parameters["ball.bsdf.sigma_s.value"])
    parameters.update()
    try:
        dr.backward(dr.mean(mi.render(scene, parameters, spp=4), axis=None))
        print("differentiated")
    except Exception as error:
        while error.__cause__: error = error.__cause__
        print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    first, *others = done.stdout.splitlines()
    assert first == "differentiated"
    assert len(others) == 2
    assert all("chains have no derivatives" in line for line in others), others
