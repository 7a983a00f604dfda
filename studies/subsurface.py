"""The dipole against closed forms and simulations of half spaces; prints tables.

    python -m studies subsurface [SECTION ...]

- `reflectance`: diffuse reflectance of a slab, by quadrature of the kernels and by the renderer,
  against the closed form of Jensen et al. 2001, and all light of a half space under a uniform sky
  against `volpathmis`.
- `materials`: the column "Diffuse Reflectance" of the manual's table against the closed form, and
  what its search radius leaves of it.
- `profile`: exitance around a pencil beam against `volpathmis`; with `--figure FILE` a plot.
"""

import math
import time

import mitsuba as mi
import numpy as np

from relume import (
    bsdfs,  # noqa: F401  registers the plugins
    integrators,  # noqa: F401
)
from relume.bsdfs.subsurface import SubsurfaceMedium
from relume.integrators.diffusion import PROFILES, ExitPoint
from relume.translator.materials_table import MATERIALS
from tests.integrators.translucent_scenes import fresnel, hemispherical, reflectance, rgb

ALPHA = np.array([0.3, 0.8, 0.99])
COLUMN = {
    "Apple": (0.85, 0.84, 0.53), "Chicken1": (0.31, 0.15, 0.10), "Chicken2": (0.32, 0.16, 0.10),
    "Cream": (0.98, 0.90, 0.73), "Ketchup": (0.16, 0.01, 0.00), "Marble": (0.83, 0.79, 0.75),
    "Potato": (0.77, 0.62, 0.21), "Skimmilk": (0.81, 0.81, 0.69), "Skin1": (0.44, 0.22, 0.13),
    "Skin2": (0.63, 0.44, 0.34), "Spectralon": (1.0, 1.0, 1.0), "Wholemilk": (0.91, 0.88, 0.76),
}  # fmt: skip
"""The manual's column, section "MATERIAL_SYMBOL"."""

METHODS = (("standard", -1), ("standard", -2), ("directional", -1), ("normalized", -1))


def look_at(origin, target, up=(0, 0, 1)):
    return mi.ScalarTransform4f().look_at(list(origin), list(target), list(up))


def film(size):
    kind = {"type": "hdrfilm", "width": size, "height": size, "pixel_format": "rgb"}
    return kind | {"rfilter": {"type": "box"}}


def pencil(size=8):
    """A camera that looks at the origin along -z, at nothing else."""
    to_world = look_at((0, 0, 50), (0, 0, 0), (0, 1, 0))
    return {"type": "perspective", "fov": 1e-4, "to_world": to_world, "film": film(size)}


def dipole(sigma_s, sigma_a, eta, level, g=0.0):
    material = {"type": "subsurface", "eta": eta, "level": level, "g": rgb(g)}
    return material | {"sigma_s": rgb(sigma_s), "sigma_a": rgb(sigma_a)}


def simulated(sigma_s, sigma_a, eta):
    """The same medium for `volpathmis`: boundary and interior of a shape."""
    sigma_t = np.asarray(sigma_s) + sigma_a
    boundary = {"type": "null"}
    if eta != 1:
        boundary = {"type": "dielectric", "int_ior": eta, "ext_ior": 1.0}
    scale = float(2 * sigma_t.max())
    interior = {"type": "homogeneous", "albedo": rgb(sigma_s / sigma_t), "scale": scale}
    return {"bsdf": boundary, "interior": interior | {"sigma_t": rgb(sigma_t / scale)}}


def pictures_of(scene, spp, count, seed=0):
    """Independent pictures (count, height, width, 3) and the CPU seconds of one, median."""
    mi.render(scene, spp=1, seed=2**31 - 1)
    pictures, seconds = [], []
    for i in range(count):
        start = time.process_time()
        pictures.append(np.array(mi.render(scene, spp=spp, seed=seed + i), dtype=float))
        seconds.append(time.process_time() - start)
    return np.array(pictures), float(np.median(seconds))


def mean(pictures):
    """Mean over the picture and its standard error, (3,) each."""
    means = pictures.mean(axis=(1, 2))
    return means.mean(axis=0), means.std(axis=0, ddof=1) / math.sqrt(len(means))


def heading(title, head):
    print(f"\n### {title}\n\n| {' | '.join(head)} |\n|{'---|' * len(head)}", flush=True)


def row(cells):
    print(f"| {' | '.join(str(cell) for cell in cells)} |", flush=True)


def table(title, head, rows):
    heading(title, head)
    for cells in rows:
        row(cells)


def triple(values, form=".3f"):
    return " / ".join(f"{v:{form}}" for v in values)


# ------------------------------ sections ------------------------------


def kernel(profile, alpha, eta, r):
    """pi S / F_t(o) for light that enters perpendicularly, at distances r, sigma_t' = 1: (n, 3).

    For eta = 1 this is the exitance [1/area] for unit power.
    """
    alpha = mi.Spectrum(*[float(a) for a in alpha])
    one = mi.Spectrum(1)
    medium = SubsurfaceMedium(alpha, 1 - alpha, 0 * one, mi.Float(eta), mi.Float(1e9), one)
    kind = PROFILES[profile]
    si = mi.SurfaceInteraction3f()
    si.p, si.sh_frame, r = mi.Point3f(0), mi.Frame3f([0, 0, 1]), mi.Float(r)
    leave = ExitPoint(mi.Point3f(r, 0, 0), mi.Normal3f(0, 0, 1))
    F_t = 1 - fresnel(1.0, eta)
    value = kind.entering(medium, leave, si, mi.Vector3f(0, 0, 1)) * (np.pi / F_t)
    value *= kind(medium, mi.Float(1e9)).weight(r)
    return np.array(value).T.astype(float) * np.ones((len(r), 1))


def integral(profile, eta):
    """2 pi int S r dr by the trapezoidal rule in ln r, for perpendicular light."""
    r = np.exp(np.linspace(np.log(1e-5), np.log(1e5), 20_001))
    return (
        2
        * np.pi
        * np.trapezoid(kernel(profile, ALPHA, eta, r) * r[:, None] ** 2, np.log(r), axis=0)
    )


def slab(profile, level, eta):
    """Mean of a slab under a uniform sky, seen along the normal."""
    material = dipole(ALPHA, 1 - ALPHA, eta, level)
    to_world = mi.ScalarTransform4f().scale(5000)
    scene = {
        "type": "scene", "sensor": pencil(), "sky": {"type": "constant"},
        "integrator": {"type": "dipole", "profile": profile, "rr_depth": 100},
        "slab": {"type": "rectangle", "to_world": to_world, "bsdf": material},
    }  # fmt: skip
    return mean(pictures_of(mi.load_dict(scene), 4096, 8)[0])


def simulated_slab(eta):
    to_world = mi.ScalarTransform4f().scale(5000)
    medium = simulated(ALPHA, 1 - ALPHA, eta)
    scene = {
        "type": "scene", "sensor": pencil(), "sky": {"type": "constant"},
        "integrator": {"type": "volpathmis", "rr_depth": 100},
        "slab": {"type": "rectangle", "to_world": to_world} | medium,
    }  # fmt: skip
    return mean(pictures_of(mi.load_dict(scene), 1024, 8)[0])


def study_reflectance(_):
    rows, totals = [], []
    for eta in (1.0, 1.3, 1.5):
        F = fresnel(1.0, eta)
        closed = reflectance(ALPHA, eta)
        truth = simulated_slab(eta)[0]
        for profile in PROFILES:
            # F_t(i) and, in `standard` alone, F_t(o) leave 1 - F_mean of the light.
            entry = 1 - hemispherical(eta) if profile == "standard" else 1
            quadrature = integral(profile, eta)
            measured, error = slab(profile, -2, eta)
            measured, error = ((measured - F) / (1 - F) / entry, error / (1 - F) / entry)
            rows.append((eta, profile, triple(closed, ".4f"), triple(quadrature, ".4f"),
                         triple(measured, ".4f"), triple(error, ".4f")))  # fmt: skip
        for profile, level in METHODS:
            measured, _ = slab(profile, level, eta)
            totals.append((eta, profile, level, triple(truth), triple(measured),
                           triple(measured / truth, ".2f")))  # fmt: skip
    table("Diffuse reflectance, reduced albedo 0.3 / 0.8 / 0.99", (
        "η", "profile", "closed form", "quadrature, perpendicular", "renderer, uniform sky", "σ",
    ), rows)  # fmt: skip
    table("All light of a half space under a uniform sky, seen along the normal", (
        "η", "profile", "level", "simulation", "dipole", "ratio",
    ), totals)  # fmt: skip


def study_materials(_):
    rows = []
    for name, column in COLUMN.items():
        m = MATERIALS[name]
        sigma_s, sigma_a = np.array(m.sigma_s), np.array(m.sigma_a)
        sigma_t = sigma_s + sigma_a
        closed = reflectance(sigma_s / sigma_t, m.eta)
        far = np.abs(closed - column) > 0.02
        r_max = 1.25 * np.sqrt(np.log(1e4) / sigma_t.min())
        within = [
            reflectance(s / t, m.eta, r_max * t) for s, t in zip(sigma_s, sigma_t, strict=True)
        ]
        rows.append((name, triple(column, ".2f"), triple(closed), "differs" if far.any() else "",
                     f"{r_max:.2f}", triple(within / closed, ".2f")))  # fmt: skip
    table("Diffuse reflectance of the manual's materials, R / G / B", (
        "material", "manual", "closed form", "more than 0.02", "r_max [mm]", "share within r_max",
    ), rows)  # fmt: skip


def ring(inner, outer, n=256):
    """A flat ring of radiance 1 that shines down, just above the plane z = 0."""
    phi = np.arange(n) * 2 * np.pi / n
    circle = np.stack([np.cos(phi), np.sin(phi), 0 * phi])
    mesh = mi.Mesh("ring", 2 * n, 2 * n, props=props_of_ring())
    parameters = mi.traverse(mesh)
    points = np.concatenate([inner * circle, outer * circle], axis=1)
    points[2] = 1e-3
    i, j = np.arange(n), (np.arange(n) + 1) % n
    faces = np.concatenate([np.stack([i, j, i + n]), np.stack([j, j + n, i + n])], axis=1)
    parameters["vertex_positions"] = points.T.ravel().astype(np.float32)
    parameters["faces"] = faces.T.ravel().astype(np.uint32)
    parameters.update()
    area = 0.5 * n * math.sin(2 * np.pi / n) * (outer**2 - inner**2)
    return mesh, area


def props_of_ring():
    props = mi.Properties()
    props["light"] = mi.load_dict({"type": "area", "radiance": rgb(1)})
    props["black"] = mi.load_dict({"type": "diffuse", "reflectance": rgb(0)})
    return props


RINGS = (0.1, 0.2, 0.35, 0.5, 0.75, 1, 1.5, 2, 3, 4, 6, 8)


def simulated_exitance(r):
    """Exitance around r (±10 %) of unit power that enters perpendicularly, (mean, error).

    By reciprocity it is what the origin shows along the normal, under light from the ring alone.
    """
    mesh, area = ring(0.9 * r, 1.1 * r)
    scene = {
        "type": "scene", "sensor": pencil(16), "ring": mesh,
        "integrator": {"type": "volpathmis", "rr_depth": 30},
        "slab": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(5000)}
        | simulated(ALPHA, 1 - ALPHA, 1.0),
    }  # fmt: skip
    value, error = mean(pictures_of(mi.load_dict(scene), 64, 8)[0])
    return value / area, error / area


def single_exitance(r):
    """Exitance of light scattered once, isotropically, by quadrature along the beam: (n, 3)."""
    z = np.exp(np.linspace(np.log(1e-6), np.log(50), 4001))[:, None]
    d = np.hypot(z, r[None])
    f = np.exp(-z - d) * z / (4 * np.pi * d**3)
    return np.trapezoid(f * z, np.log(z[:, 0]), axis=0)[:, None] * ALPHA


def averaged(f, r):
    """Mean of f over rings r ± 10 %."""
    x, w = np.polynomial.legendre.leggauss(8)
    nodes = r[:, None] * (1 + 0.1 * x)
    weights = w * nodes
    values = f(nodes.ravel()).reshape(*nodes.shape, 3)
    return (values * weights[..., None]).sum(axis=1) / weights.sum(axis=1)[:, None]


def study_profile(options):
    r = np.array(RINGS)
    simulation = [simulated_exitance(x) for x in RINGS]
    truth, error = (np.array(part) for part in zip(*simulation, strict=True))
    curves = {
        name: averaged(lambda x, name=name: kernel(name, ALPHA, 1.0, x), r) for name in PROFILES
    }
    single = averaged(single_exitance, r)
    curves = {"standard, level -1": curves["standard"] + single} | curves
    for i, alpha in enumerate(ALPHA):
        rows = []
        for k, x in enumerate(RINGS):
            if error[k, i] < 0.1 * truth[k, i]:
                ratios = (f"{curve[k, i] / truth[k, i]:.2f}" for curve in curves.values())
                percent = f"{100 * error[k, i] / truth[k, i]:.1f} %"
                rows.append((x, f"{truth[k, i]:.3g}", percent, *ratios))
        table(f"Exitance over simulation, reduced albedo {alpha}, η = 1", (
            "r σ_t", "simulation [σ_t²]", "±", *curves,
        ), rows)  # fmt: skip
    if options.figure:
        plot(options.figure, r, truth, error, curves)


def plot(path, r, truth, error, curves):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 3, figsize=(10, 3.4), sharex=True, constrained_layout=True)
    for i, (axis, alpha) in enumerate(zip(axes, ALPHA, strict=True)):
        good = error[:, i] < 0.1 * truth[:, i]
        axis.plot(r[good], truth[good, i], "ko", ms=4, label="volpathmis")
        for name, curve in curves.items():
            axis.plot(r[good], curve[good, i], label=name, lw=1.2)
        axis.set(xscale="log", yscale="log", title=f"α' = {alpha}", xlabel="r σ_t")
    axes[0].set_ylabel("exitance / (power σ_t²)")
    axes[2].legend(fontsize=7)
    figure.savefig(path, dpi=110)


SECTIONS = {
    "reflectance": study_reflectance,
    "materials": study_materials,
    "profile": study_profile,
}


def add_arguments(parser):
    parser.add_argument("sections", nargs="*", metavar="SECTION", help=", ".join(SECTIONS))
    parser.add_argument("--figure", help="file of the plot of the profiles")


def run(options):
    mi.set_variant("llvm_ad_rgb")
    for name in options.sections or SECTIONS:
        SECTIONS[name](options)

