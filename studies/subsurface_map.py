"""The dipole's error over radius and albedo, and the time of both; docs/subsurface.

Balls of 0.3 to 300 reduced mean free paths lie under a dim sky and a square lamp, nine albedos in
three pictures. All is relative to `randomwalk`, which is exact: the mean of the disk, the root mean
square of what its pixels differ beyond their noise, and the CPU time to 5 % noise in a pixel. For
`randomwalk` the time is also that of a mesh of 1280 faces, in which walks cross no balls at once.
Figures go to docs/subsurface/map.json, which the translator's table is compared with, and map.png.
"""

import json

import mitsuba as mi
import numpy as np

from studies import DOCS
from studies.subsurface import (
    dipole,
    film,
    heading,
    look_at,
    pictures_of,
    rgb,
    row,
    simulated,
)
from studies.subsurface_spheres import estimate, scaling

FOLDER = DOCS / "subsurface"
RADII = (0.3, 1, 3, 10, 30, 100, 300)
ALPHAS = ((0.3, 0.5, 0.7), (0.8, 0.9, 0.95), (0.98, 0.99, 0.999))
ETAS = (1.0, 1.3, 1.5)
PROFILES = ("standard", "normalized", "directional")
WALK, WALK_IN_MESH = "randomwalk", "randomwalk in a mesh"
SPP, RUNS, RR_DEPTH, SIZE = 128, 8, 6, 24


def icosphere(levels=3):
    """Vertices and faces of a sphere of 20 * 4^levels triangles."""
    phi = (1 + 5**0.5) / 2
    low = [(-1, phi, 0), (1, phi, 0), (-1, -phi, 0), (1, -phi, 0)]
    v = np.array(low + [(z, x, y) for x, y, z in low] + [(y, z, x) for x, y, z in low], float)
    gaps = np.linalg.norm(v[:, None] - v[None], axis=2)
    near = np.isclose(gaps, 2)
    f = [(i, j, k) for i in range(12) for j in range(i) for k in range(j)
         if near[i, j] and near[j, k] and near[i, k]]  # fmt: skip
    triangles = v[np.array(f)]
    for _ in range(levels):
        a, b, c = (triangles[:, k] for k in range(3))
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        triangles = np.concatenate([np.stack(part, axis=1) for part in parts])
    triangles /= np.linalg.norm(triangles, axis=2, keepdims=True)
    outwards = np.linalg.det(triangles) > 0
    triangles[~outwards] = triangles[~outwards][:, ::-1]
    vertices, faces = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    return vertices, faces.reshape(-1, 3)


def mesh(things):
    """The ball as a mesh with flat faces."""
    properties = mi.Properties()
    for name, thing in things.items():
        properties[name] = mi.load_dict(thing)
    vertices, faces = icosphere()
    made = mi.Mesh("ball", len(vertices), len(faces), props=properties)
    parameters = mi.traverse(made)
    parameters["vertex_positions"] = vertices.ravel().astype(np.float32)
    parameters["faces"] = faces.ravel().astype(np.uint32)
    parameters.update()
    return made


def ball(radius, alphas, eta, method, size=SIZE):
    """A ball of radius 1 and `radius` reduced mean free paths, and which pixels show it."""
    alphas = np.array(alphas)
    lamp = look_at((-4, -3, 4), (0, 0, 0)) @ scaling(2)
    camera = look_at((0, -10, 0), (0, 0, 0)) @ scaling(1.1)
    scene = {
        "type": "scene",
        "sky": {"type": "constant", "radiance": rgb(0.3)},
        "lamp": {"type": "rectangle", "to_world": lamp,
                 "emitter": {"type": "area", "radiance": rgb(6)}},
        "sensor": {"type": "orthographic", "to_world": camera, "film": film(size)},
    }  # fmt: skip
    if method in PROFILES:
        scene["integrator"] = {"type": "dipole", "profile": method, "rr_depth": RR_DEPTH}
        things = {"bsdf": dipole(alphas * radius, (1 - alphas) * radius, eta, -1)}
    else:
        scene["integrator"] = {"type": "randomwalk", "rr_depth": RR_DEPTH}
        things = simulated(alphas * radius, (1 - alphas) * radius, eta)
    scene["ball"] = mesh(things) if method == WALK_IN_MESH else {"type": "sphere"} | things
    x = (np.arange(size) + 0.5) / size * 2.2 - 1.1
    return mi.load_dict(scene), np.hypot(*np.meshgrid(x, x)) < 0.95


def measured(radius, alphas, eta, method, runs):
    """Mean pixels (n, 3), variances of these means, and the time to 5 % noise of each channel."""
    scene, disk = ball(radius, alphas, eta, method)
    pictures, seconds = pictures_of(scene, SPP, runs)
    seen = pictures[:, disk]
    value, spread = estimate(seen)
    noise2 = seen.var(axis=0, ddof=1).mean(axis=0) / seen.mean(axis=(0, 1)) ** 2
    return value, spread, seconds * noise2 / 0.05**2


def cells(runs):
    """Yield the figures of each radius, index and three albedos."""
    for eta in ETAS:
        for radius in RADII:
            for alphas in ALPHAS:
                truth, variance, walk = measured(radius, alphas, eta, WALK, runs)
                in_mesh = measured(radius, alphas, eta, WALK_IN_MESH, 3)[2]
                mean = truth.mean(axis=0)
                found = {"truth": mean, WALK: walk, WALK_IN_MESH: in_mesh}
                for profile in PROFILES:
                    value, spread, seconds = measured(radius, alphas, eta, profile, runs)
                    squares = ((value - truth) ** 2 - spread - variance).mean(axis=0)
                    found[profile] = value.mean(axis=0) / mean
                    found[f"{profile} rms"] = np.sqrt(np.maximum(squares, 0)) / mean
                    found[f"{profile} seconds"] = seconds
                for i, alpha in enumerate(alphas):
                    figures = {k: float(f"{v[i]:.3g}") for k, v in found.items()}
                    yield {"eta": eta, "radius": radius, "alpha": alpha} | figures


def grid(rows, eta, key):
    """Figures (radius, albedo) of one index."""
    found = {(c["radius"], c["alpha"]): c[key] for c in rows if c["eta"] == eta}
    return np.array([[found[r, a] for a in np.ravel(ALPHAS)] for r in RADII])


def tables(rows):
    """Print what the page has."""
    head = ("radius", *(f"{a:g}" for a in np.ravel(ALPHAS)))
    for profile in PROFILES:
        heading(f"{profile}, mean over that of `randomwalk`, η = 1 / 1.3 / 1.5", head)
        grids = [grid(rows, eta, profile) for eta in ETAS]
        for i, radius in enumerate(RADII):
            row((radius, *(" / ".join(f"{g[i, j]:.2f}" for g in grids) for j in range(9))))
    heading("pixels of `standard`, root mean square difference [%], η = 1.3", head)
    for radius, values in zip(RADII, grid(rows, 1.3, "standard rms"), strict=True):
        row((radius, *(f"{100 * v:.0f}" for v in values)))
    heading("CPU seconds to 5 % noise, dipole / walk / walk in a mesh, η = 1.3", head)
    grids = [grid(rows, 1.3, key) for key in ("standard seconds", WALK, WALK_IN_MESH)]
    for i, radius in enumerate(RADII):
        row((radius, *(" / ".join(f"{g[i, j]:.2g}" for g in grids) for j in range(9))))


def plot(path, rows):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(3, 3, figsize=(10, 7.6), sharex=True, sharey=True,
                                   constrained_layout=True)  # fmt: skip
    x, y = -np.log10(1 - np.ravel(ALPHAS)), np.log10(RADII)
    for line, profile in zip(axes, PROFILES, strict=True):
        for axis, eta in zip(line, ETAS, strict=True):
            error = 100 * (grid(rows, eta, profile) - 1)
            shown = axis.contourf(x, y, error, np.linspace(-60, 60, 25), cmap="RdBu_r",
                                  extend="both")  # fmt: skip
            lines = axis.contour(x, y, error, [-30, -10, 10, 30], colors="k", linewidths=0.8)
            axis.clabel(lines, fmt="%d %%", fontsize=7)
            axis.set(title=f"{profile}, η = {eta:g}")
            axis.set_xticks(x[[0, 2, 4, 6, 7, 8]], [f"{np.ravel(ALPHAS)[i]:g}" for i in
                                                    (0, 2, 4, 6, 7, 8)])  # fmt: skip
            axis.set_yticks(y, [f"{r:g}" for r in RADII])
    for axis in axes[-1]:
        axis.set_xlabel("reduced albedo")
    for axis in axes[:, 0]:
        axis.set_ylabel("radius [reduced mean free path]")
    figure.colorbar(shown, ax=axes, label="error of the mean [%]")
    figure.savefig(path, dpi=90)


def add_arguments(parser):
    parser.add_argument("--runs", type=int, default=RUNS, help="pictures of each ball and method")
    parser.add_argument("--again", action="store_true", help="tables and figure of map.json")


def run(options):
    mi.set_variant("llvm_ad_rgb")
    store = FOLDER / "map.json"
    if options.again:
        rows = json.loads(store.read_text())
    else:
        rows = []
        for cell in cells(options.runs):
            rows.append(cell)
            print(cell, flush=True)
        store.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n", encoding="utf-8")
    tables(rows)
    plot(FOLDER / "map.png", rows)
