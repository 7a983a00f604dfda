"""Variance and speed of the emitter plugins; prints a table, fails if a target is missed.

Run it on an idle machine.

1. Variance with and without emitter sampling at equal time,
   (variance x time without) / (variance x time with), at least 10:
   a dome with one sun-like texel of 1e5, and a spot light behind a small hole. Without emitter
   sampling a point light cannot be found at all; the spot is then a small ball of the same power.
2. CPU time of falloffspot and parallelbeam over the stock spot and directional in the same scene,
   medians of interleaved pairs, at most 1.1. The other two are printed for information.
"""

import statistics
import time

import mitsuba as mi
import numpy as np

from relume import emitters  # noqa: F401  registers the plugins

MINIMUM_GAIN = 10.0
MAXIMUM_SLOWDOWN = 1.1


def t():
    return mi.ScalarTransform4f()


def sensor(size):
    return {
        "type": "perspective",
        "fov": 45,
        "to_world": t().look_at(origin=[0, 3, 7], target=[0, 0.7, 0], up=[0, 1, 0]),
        "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}},
    }


def room(size, **more):
    """A floor, two balls and what `more` adds."""
    return {
        "type": "scene",
        "floor": {
            "type": "rectangle",
            "to_world": t().rotate([1, 0, 0], -90).scale(4),
            "bsdf": {"type": "diffuse", "reflectance": 0.7},
        },
        "left": {"type": "sphere", "center": [-1, 0.7, 0], "radius": 0.7},
        "right": {"type": "sphere", "center": [1, 0.5, 1], "radius": 0.5},
        "sensor": sensor(size),
        **more,
    }


def timed_picture(scene, integrator, spp, seed):
    start = time.process_time()
    picture = np.array(mi.render(scene, spp=spp, seed=seed, integrator=integrator))
    return picture, time.process_time() - start


def cost_of_noise(scene, integrator, reference, spp, runs):
    """Mean squared error per picture times CPU seconds per picture, kernels already compiled."""
    timed_picture(scene, integrator, spp, 0)
    errors, seconds = [], []
    for seed in range(1, runs + 1):
        picture, duration = timed_picture(scene, integrator, spp, seed)
        errors.append(np.mean((picture - reference) ** 2))
        seconds.append(duration)
    return np.mean(errors) * statistics.median(seconds)


def gain(with_scene, without_scene, runs, spp=256, reference_spp=4096):
    """Variance without over variance with emitter sampling, at equal time, direct light only."""
    path = mi.load_dict({"type": "path", "max_depth": 2})
    scattering = mi.load_dict({"type": "direct", "bsdf_samples": 1, "emitter_samples": 0})
    costs = []
    for scene, integrator in ((with_scene, path), (without_scene, scattering)):
        reference = np.array(mi.render(scene, spp=reference_spp, seed=999, integrator=path))
        costs.append(cost_of_noise(scene, integrator, reference, spp, runs))
    return costs[1] / costs[0]


def sun_gain(runs):
    height, width = 128, 256
    v = np.linspace(0, 1, height)[:, None, None]
    sky = np.broadcast_to([0.4, 0.6, 1.0] * (1 - v) + [0.3, 0.25, 0.2] * v, (height, width, 3))
    sky = sky.astype(np.float32).copy()
    sky[38, 90] = 1e5
    dome = {
        "type": "sphere",
        "radius": 50.0,
        "bsdf": {"type": "conductor", "specular_reflectance": 0.0},
        "light": {"type": "ibldome", "bitmap": mi.Bitmap(sky), "map": "panoramic"},
    }
    scene = mi.load_dict(room(64, dome=dome))
    return gain(scene, scene, runs)


def hole_gain(runs):
    """A spot over a screen with a hole of 0.2; the ball that stands in for it has radius 0.1."""
    intensity, radius, height = 50.0, 0.1, 4.0
    walls = [
        {
            "type": "rectangle",
            "to_world": t().translate([x, 3, z]).rotate([1, 0, 0], 90).scale([sx, sz, 1]),
            "bsdf": {"type": "diffuse", "reflectance": 0.0},
        }
        for x, z, sx, sz in ((-2.05, 0, 1.95, 4), (2.05, 0, 1.95, 4),
                             (0, -2.05, 0.1, 1.95), (0, 2.05, 0.1, 1.95))
    ]  # fmt: skip
    screen = {f"screen{i}": wall for i, wall in enumerate(walls)}
    spot = {
        "type": "falloffspot",
        "position": [0, height, 0],
        "intensity": intensity,
        "cutoff_angle": 40.0,
        "falloff_angle": 0.0,
    }
    ball = {
        "type": "sphere",
        "center": [0, height, 0],
        "radius": radius,
        "bsdf": {"type": "diffuse", "reflectance": 0.0},
        "light": {"type": "area", "radiance": intensity / (np.pi * radius**2)},
    }
    scenes = (mi.load_dict(room(64, light=light, **screen)) for light in (spot, ball))
    return gain(*scenes, runs)


def slowdown(ours, stock, runs, size=256, spp=64):
    """Median of (CPU time with `ours` / CPU time with `stock`) over interleaved pairs."""
    path = mi.load_dict({"type": "path", "max_depth": 6})
    scenes = [mi.load_dict(room(size, light=light)) for light in (ours, stock)]
    means = [timed_picture(scene, path, spp, 0)[0].mean() for scene in scenes]
    ratios = []
    for seed in range(1, runs + 1):
        a, b = (timed_picture(scene, path, spp, seed)[1] for scene in scenes)
        ratios.append(a / b)
    return statistics.median(ratios), means


def spot_slowdown(runs):
    ours = {
        "type": "falloffspot",
        "position": [0, 5, 0],
        "cutoff_angle": 40.0,
        "falloff_angle": 10.0,
        "intensity": 30.0,
    }
    stock = {
        "type": "spot",
        "to_world": t().look_at(origin=[0, 5, 0], target=[0, 0, 0], up=[0, 0, 1]),
        "cutoff_angle": 40.0,
        "beam_width": 30.0,
        "intensity": 30.0,
    }
    return slowdown(ours, stock, runs)


def beam_slowdown(runs):
    ours = {
        "type": "parallelbeam",
        "origin": [-20, 10, -20],
        "edge_u": [40, 0, 0],
        "edge_v": [0, 0, 40],
        "direction": [0.3, -1, 0.2],
        "irradiance": 2.0,
    }
    stock = {"type": "directional", "direction": [0.3, -1, 0.2], "irradiance": 2.0}
    return slowdown(ours, stock, runs)


def dome_slowdown(runs):
    rng = np.random.default_rng(1)
    image = mi.Bitmap(rng.random((256, 512, 3)).astype(np.float32))
    ours = {
        "type": "sphere",
        "radius": 1000.0,
        "bsdf": {"type": "conductor", "specular_reflectance": 0.0},
        "light": {"type": "ibldome", "bitmap": image, "map": "panoramic"},
    }
    return slowdown(ours, {"type": "envmap", "bitmap": image}, runs)


def area_slowdown(runs):
    lamp = {
        "type": "rectangle",
        "to_world": t().translate([0, 5, 0]).rotate([1, 0, 0], 90),
        "bsdf": {"type": "diffuse", "reflectance": 0.0},
    }
    lights = ({"type": plugin, "radiance": 5.0} for plugin in ("twosidedarea", "area"))
    return slowdown(*({**lamp, "light": light} for light in lights), runs)


def add_arguments(parser):
    parser.add_argument("--runs", type=int, default=5, help="repetitions of each measurement")
    parser.add_argument("--variant", default="llvm_ad_rgb")


def run(options):
    mi.set_variant(options.variant)
    failed = False
    print("variance without / with emitter sampling, at equal time (at least 10)")
    for name, measure in (("sun texel of 1e5", sun_gain), ("spot through a hole", hole_gain)):
        value = measure(options.runs)
        failed |= value < MINIMUM_GAIN
        print(f"  {name:36s} {value:10.3g}")
    print("CPU time over the stock plugin's, picture means")
    for name, measure, limit in (
        ("falloffspot / spot", spot_slowdown, MAXIMUM_SLOWDOWN),
        ("parallelbeam / directional", beam_slowdown, MAXIMUM_SLOWDOWN),
        ("twosidedarea / area", area_slowdown, None),
        ("ibldome / envmap", dome_slowdown, None),
    ):
        value, (ours, stock) = measure(options.runs)
        failed |= limit is not None and value > limit
        bound = f"(at most {limit})" if limit else ""
        print(f"  {name:36s} {value:10.3f}   {ours:.4f} {stock:.4f}  {bound}")
    return 1 if failed else 0

