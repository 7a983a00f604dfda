"""Balls of measured materials, dipole against simulation: means, relMSE, time; prints a table.

Balls of 1, 3, 10 and 30 mean free paths (of the three channels' mean) lie under a dim sky and a
square lamp. The simulation is `volpathmis` in a `dielectric`, without roulette: with it a few rare
pixels carry much of the light of dense balls, and means come out low. relMSE is that of the means
of all pictures, less what their noise adds; the time is that of 5 % noise in a pixel (root mean
square relative to the mean), from CPU seconds, with the tracing of the kernel in Python.
"""

import math

import mitsuba as mi
import numpy as np

from relume.translator.materials_table import MATERIALS
from studies.subsurface import (
    METHODS,
    dipole,
    film,
    heading,
    look_at,
    pictures_of,
    rgb,
    row,
    simulated,
    triple,
)

BALLS = ("Marble", "Skin1", "Ketchup", "Wholemilk")


def scaling(factor):
    return mi.ScalarTransform4f().scale([factor, factor, 1])


def ball(name, radius, method, size=32):
    """A ball of `radius` mean free paths under a dim sky and a square lamp."""
    m = MATERIALS[name]
    sigma_s, sigma_a = np.array(m.sigma_s), np.array(m.sigma_a)
    R = radius / np.mean(sigma_s + sigma_a)
    lamp = look_at((-4 * R, -3 * R, 4 * R), (0, 0, 0)) @ scaling(2 * R)
    camera = look_at((0, -10 * R, 0), (0, 0, 0)) @ scaling(1.1 * R)
    shine = {"type": "area", "radiance": rgb(6)}
    scene = {
        "type": "scene",
        "sky": {"type": "constant", "radiance": rgb(0.3)},
        "lamp": {"type": "rectangle", "to_world": lamp, "emitter": shine},
        "sensor": {"type": "orthographic", "to_world": camera, "film": film(size)},
        "ball": {"type": "sphere", "radius": R},
    }  # fmt: skip
    if method is None:
        scene["integrator"] = {"type": "volpathmis", "rr_depth": 10_000}
        scene["ball"] |= simulated(sigma_s, sigma_a, m.eta)
    else:
        profile, level = method
        scene["integrator"] = {"type": "dipole", "profile": profile, "rr_depth": 50}
        scene["ball"]["bsdf"] = dipole(sigma_s, sigma_a, m.eta, level)
    x = (np.arange(size) + 0.5) / size * 2.2 - 1.1
    return mi.load_dict(scene), np.hypot(*np.meshgrid(x, x)) < 0.95


def run(options):
    mi.set_variant("llvm_ad_rgb")
    heading("Balls, radius in mean free paths", (
        "material", "radius", "profile", "level", "mean of simulation", "ratio of means", "relMSE",
        "simulation to 5 % [CPU s]", "dipole to 5 %", "times faster", "largest / median",
    ))  # fmt: skip
    for name in BALLS:
        for radius in (1, 3, 10, 30):
            scene, disk = ball(name, radius, None)
            reference, seconds = pictures_of(scene, 32, options.runs)
            truth, variance = estimate(reference[:, disk])
            reference_time = seconds * noise(reference[:, disk]) ** 2 / 0.05**2
            for method in METHODS:
                pictures, seconds = pictures_of(ball(name, radius, method)[0], 128, 4)
                value, spread = estimate(pictures[:, disk])
                # What chance adds to the squared difference is known and subtracted.
                squares = (value - truth) ** 2 - spread - variance
                error = np.mean(squares / (truth**2 + 0.01 * truth.mean() ** 2))
                needed = seconds * noise(pictures[:, disk]) ** 2 / 0.05**2
                largest = pictures.max() / np.median(pictures)
                row((name, radius, *method, triple(truth.mean(axis=0)),
                             triple(value.mean(axis=0) / truth.mean(axis=0), ".2f"), f"{error:.3f}",
                             f"{reference_time:.3g}", f"{needed:.3g}",
                             f"{reference_time / needed:.3g}", f"{largest:.1f}"))  # fmt: skip


def estimate(pictures):
    """Mean pixels of independent pictures and the variance of these means."""
    return pictures.mean(axis=0), pictures.var(axis=0, ddof=1) / len(pictures)


def noise(pictures):
    """Root mean square noise of one picture relative to its mean."""
    return math.sqrt(pictures.var(axis=0, ddof=1).mean()) / pictures.mean()


def add_arguments(parser):
    parser.add_argument("--runs", type=int, default=4, help="pictures of each simulation")
