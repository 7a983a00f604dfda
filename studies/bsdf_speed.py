"""Time of each material against the nearest stock plugin in the same scene: a table.

The scene is the Cornell box with every surface but the lamp of
the material in question (glass: the two blocks alone), 160x160 pixels, 64 samples, paths of at
most 8 segments. The runs of all materials are interleaved; a row shows the median of five in
CPU-seconds (first runs, which compile, left out) and its ratio to the stock plugin.
"""

import statistics
import time

import drjit as dr
import mitsuba as mi

from relume import bsdfs, integrators  # noqa: F401  registers the plugins

GREY = {"type": "rgb", "value": [0.4, 0.4, 0.4]}
COLOUR = {"type": "rgb", "value": [0.3, 0.2, 0.3]}
TWO_LOBES = {"diffuse_reflectance": COLOUR, "specular_reflectance": GREY}
# Stock reflectances that give paths of about the same length: albedo 0.5 to 0.6 as well.
CONDUCTOR = {"type": "roughconductor", "alpha_u": 0.2, "alpha_v": 0.2, "specular_reflectance": 0.65}
PLASTIC = {"type": "plastic", "diffuse_reflectance": {"type": "rgb", "value": [0.6, 0.5, 0.6]}}
DIELECTRIC = {"type": "dielectric", "int_ior": 1.5}
WARD = {"type": "ward", "alpha_u": 0.2, "alpha_v": 0.2, **TWO_LOBES}

# name: (material, stock counterpart)
PAIRS = {
    "ward": (WARD, CONDUCTOR),
    "ward, duer": ({**WARD, "variant": "duer"}, CONDUCTOR),
    "ward, balanced": ({**WARD, "variant": "balanced"}, CONDUCTOR),
    "ward, world frame": ({**WARD, "tangent_frame": "world"}, CONDUCTOR),
    "phong": ({"type": "phong", "exponent": 30.0, **TWO_LOBES}, PLASTIC),
    "schlickglass": ({"type": "schlickglass", "int_ior": 1.5}, DIELECTRIC),
    "schlickglass, exact": (
        {"type": "schlickglass", "int_ior": 1.5, "fresnel": "exact"},
        DIELECTRIC,
    ),
}
DISPERSIVE = {"type": "schlickglass", "dispersion": "formula99"}


def twosided(material):
    return {"type": "twosided", "bsdf": material}


def cornell(material, integrator="path"):
    d = mi.cornell_box()
    d["integrator"] = {"type": integrator, "max_depth": 8}
    d["sensor"]["film"].update(width=160, height=160)
    glass = material["type"] in ("schlickglass", "dielectric")
    for name, item in d.items():
        block = name in ("small-box", "large-box")
        wall = isinstance(item, dict) and item["type"] == "rectangle" and "emitter" not in item
        if block or (wall and not glass):
            item["bsdf"] = material
    return mi.load_dict(d)


def interleaved(scenes, repeats):
    """Median CPU-seconds of every scene in the dict `scenes`."""
    times = {name: [] for name in scenes}
    for seed in range(repeats + 1):
        for name, scene in scenes.items():
            start = time.process_time()
            dr.eval(mi.render(scene, spp=64, seed=seed))
            dr.sync_thread()
            if seed > 0:
                times[name].append(time.process_time() - start)
    return {name: statistics.median(values) for name, values in times.items()}


def rows(pairs, repeats, tracers=("path", "path")):
    scenes = {}
    for name, pair in pairs.items():
        for side, material, integrator in zip(("own", "stock"), pair, tracers, strict=True):
            scenes[name, side] = cornell(material, integrator)
    seconds = interleaved(scenes, repeats)
    for name, (_, stock) in pairs.items():
        stock = stock.get("bsdf", stock)["type"]
        own, other = seconds[name, "own"], seconds[name, "stock"]
        print(f"| `{name}` | {own:.2f} | `{stock}` | {other:.2f} | {own / other:.2f} |", flush=True)


def add_arguments(parser):
    parser.add_argument("--repeats", type=int, default=5, help="measured renders of each scene")


def run(options):
    mi.set_variant("llvm_ad_rgb")
    print("| material | CPU-s | stock plugin | CPU-s | ratio |\n|---|---|---|---|---|")
    rows(PAIRS, options.repeats)
    pairs = {name: PAIRS[name] for name in ("ward", "phong")}
    pairs = {f"{name}, two-sided": tuple(map(twosided, pair)) for name, pair in pairs.items()}
    rows(pairs, options.repeats)
    mi.set_variant("llvm_ad_spectral")
    pair = (DISPERSIVE, DIELECTRIC)
    rows({"schlickglass, dispersive": pair}, options.repeats, ("surfacepath", "path"))
    rows({"schlickglass, dispersive, under path": pair}, options.repeats)

