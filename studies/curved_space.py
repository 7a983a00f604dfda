"""Light in curved space against closed forms; prints the largest errors, draws them with --figure.

    python -m studies curved-space [--figure FILE] [--picture FILE]

- deflection by a black hole, against elliptic integrals;
- the size of its shadow to two kinds of observers;
- the outline of the shadow of a hole that spins;
- the angle that rays sweep at wormholes, against quadrature.

The picture is that of a disk of gas, of which all is made here.
"""

from __future__ import annotations

import argparse
import itertools
from pathlib import Path

import mitsuba as mi
import numpy as np
from scipy.integrate import quad

from relume import (
    bsdfs,  # noqa: F401  registers the plugins
    emitters,  # noqa: F401
    integrators,  # noqa: F401
    textures,  # noqa: F401
)
from tests.integrators.metrics.geodesics import (
    CRITICAL,
    angle_of,
    deflection,
    follow,
    metric,
    outside,
    towards,
)

FAR = 1000.0
"""Distance [M] from which rays are sent, and for wormholes in units of their throat."""

POINTS = 40_000
"""Of a curve from which distances are measured."""

SPINS = (0.0, 0.5, 0.9, 0.99)
WORMHOLES = {"a = 0.5, W = 0.05": (0.5, 0.05), "a = 0.005, W = 0.05": (0.005, 0.05),
             "a = 0.5, W = 0.43": (0.5, 0.43)}  # fmt: skip


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--figure", metavar="FILE", type=Path, help="PNG of the four comparisons")
    parser.add_argument("--picture", metavar="FILE", type=Path, help="PNG of a disk around a hole")


def start(n: int, distance: float = FAR) -> np.ndarray:
    return np.array([[distance], [0.0], [0.0]]) * np.ones(n)


def deflections() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Impact parameters [M], measured deflections, and those of the closed form."""
    b = 2 * np.geomspace(2.65, 200, 40)
    _, _, out, _ = follow(metric("schwarzschild"), start(b.size), towards(angle_of(b, FAR)))
    exact = deflection(b)
    swept = exact + np.pi - [outside(x, FAR) for x in b]
    error = np.arctan2(out[:, 1], out[:, 0]) - swept
    return b, exact + (error + np.pi) % (2 * np.pi) - np.pi, exact


def bisected(inside: np.ndarray, beyond: np.ndarray, captured, rounds: int = 22) -> np.ndarray:
    """Where capture ends between pairs of numbers."""
    for _ in range(rounds):
        middle = (inside + beyond) / 2
        falls = captured(middle)
        inside, beyond = np.where(falls, middle, inside), np.where(falls, beyond, middle)
    return (inside + beyond) / 2


def shadows(static: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distances [M], measured half angles of the shadow, and those of the closed form."""
    r = np.geomspace(3.2, 60, 16)
    hole = metric("schwarzschild", observer="static" if static else "coordinate")
    p = np.array([r, 0 * r, 0 * r])
    measured = bisected(
        0 * r, 0 * r + np.pi / 2, lambda t: follow(hole, p, towards(t), camera=True)[1]
    )
    sine = CRITICAL / r * np.sqrt(1 - 2 / r) if static else np.sqrt(27 / (r**2 + 54 / r))
    return r, measured, np.arcsin(sine)


def spherical_orbits(a: float) -> tuple[np.ndarray, np.ndarray]:
    """Outline of the shadow seen from the equator at infinity, upper half, from -Y to +Y [M]."""
    ends = 2 * (1 + np.cos(2 / 3 * np.arccos(np.array([-a, a]))))
    r = ends[0] + (ends[1] - ends[0]) * (1 - np.cos(np.linspace(0, np.pi, POINTS))) / 2
    if a == 0:
        t = np.linspace(np.pi, 0, POINTS)
        return CRITICAL * np.cos(t), CRITICAL * np.sin(t)
    xi = -(r**3 - 3 * r**2 + a * a * (r + 1)) / (a * (r - 1))
    eta = r**3 * (4 * a * a - r * (r - 3) ** 2) / (a * a * (r - 1) ** 2)
    return -xi, np.sqrt(np.maximum(eta, 0))


def outline(a: float, n: int = 25) -> tuple[np.ndarray, np.ndarray]:
    """Outline found by rays, upper half, as `spherical_orbits`.

    Rays are parallel, from 100 000 M, where scene coordinates are impact parameters to 1e-4 M.
    """
    hole, far = metric("kerr", spin=a), 1e5
    center, angle = 2 * a, np.linspace(0, np.pi, n)
    y, z = np.cos(angle), np.sin(angle)

    def captured(s):
        at = np.array([center + s * y, s * z]) / far
        d = np.array([-1 + 0 * s, *at])
        return follow(hole, start(n, far), d / np.linalg.norm(d, axis=0))[1]

    s = bisected(0 * angle, 0 * angle + 8, captured, 18)
    return center + s * y, s * z


def wormhole_angle(beta: float, rho: float, a: float, W: float) -> float:
    """Angle that a ray sweeps through a wormhole, from infinity to infinity, by quadrature."""
    M = W / 1.42953

    def rate(t):
        x = 2 * t / (np.pi * M)
        r = rho + M * (x * np.arctan(x) - np.log1p(x * x) / 2)
        return beta / (r * np.sqrt(r * r - beta * beta))

    parts = [0, M, 10 * M, rho, 10 * rho, 100 * rho, 1e4 * rho]
    half = sum(quad(rate, u, v, epsabs=1e-11)[0] for u, v in itertools.pairwise(parts))
    half += beta / parts[-1] + a * beta / (rho * np.sqrt(rho * rho - beta * beta))
    return 2 * half


def swept(a: float, W: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Impact parameters [throat], measured angles swept through a wormhole, and by quadrature."""
    beta = np.linspace(0.05, 0.98, 24)
    hole = metric("wormhole", rho=1.0, a=a, W=W)
    g, _, out, _ = follow(hole, start(beta.size), towards(np.arcsin(beta / FAR)))
    turns = np.array(g.y[1])
    end = np.arctan2(out[:, 1], out[:, 0])
    end = turns + (end - turns + np.pi) % (2 * np.pi) - np.pi
    exact = np.array([wormhole_angle(x, 1.0, a, W) for x in beta])
    return beta, end + np.arcsin(beta / FAR), exact


def run(options: argparse.Namespace) -> None:
    mi.set_variant("llvm_ad_rgb")
    bent = deflections()
    seen = {kind: shadows(kind == "static") for kind in ("coordinate", "static")}
    outlines = {a: outline(a) for a in SPINS}
    through = {name: swept(*shape) for name, shape in WORMHOLES.items()}
    print("| | largest error |\n|---|---|")
    print(f"| deflection, b from 5.3 to 400 M | {np.abs(bent[1] - bent[2]).max():.1e} rad |")
    for kind, (_, measured, exact) in seen.items():
        print(f"| half angle of the shadow, {kind} | {np.abs(measured - exact).max():.1e} rad |")
    for a, (x, y) in outlines.items():
        curve = np.array(spherical_orbits(a))
        distance = np.hypot(x[:, None] - curve[0], y[:, None] - curve[1]).min(axis=1)
        print(f"| outline of the shadow, a = {a:g} | {distance.max():.1e} M |")
    for name, (_, measured, exact) in through.items():
        print(f"| angle swept by wormholes, {name} | {np.abs(measured - exact).max():.1e} rad |")
    if options.picture:
        pixels = mi.render(disk_around_a_hole(), spp=64)
        mi.util.write_bitmap(str(options.picture), pixels, write_async=False)
    if options.figure:
        draw(options.figure, bent, seen, outlines, through)


def disk_around_a_hole(width: int = 480) -> mi.Scene:
    """A disk of rings, seen by an observer at rest from a little above it, before 3000 stars."""
    y, x = np.mgrid[-1:1:512j, -1:1:512j]
    r, angle = np.hypot(x, y), np.arctan2(y, x)
    rings = 0.55 + 0.25 * np.sin(40 * r + 2 * np.sin(3 * angle)) + 0.2 * np.sin(90 * r + 2 * angle)
    gas = 1.7 * np.clip(rings, 0, 1) * np.clip((1 - r) / 0.15, 0, 1) * np.clip(r / 0.02, 0, 1)
    stars, rng = np.zeros((512, 1024, 3), np.float32), np.random.default_rng(1)
    stars.reshape(-1, 3)[rng.integers(0, 512 * 1024, 3000)] = 3 * rng.random((3000, 1))
    picture = mi.Bitmap(np.repeat(gas[..., None], 3, axis=-1).astype(np.float32))
    disk = {
        "type": "accretiondisk",
        "spin": 0.7,
        "outer_radius": 40.0,
        "temperature": 4500.0,
        "picture": {"type": "bitmap", "bitmap": picture, "raw": True, "wrap_mode": "clamp"},
    }
    T = mi.ScalarTransform4f
    return mi.load_dict({
        "type": "scene",
        "integrator": {"type": "curvedspace", "metric": "kerr", "spin": 0.7, "observer": "static",
                       "nested": {"type": "surfacepath", "max_depth": 2}},
        "sky": {"type": "envmap", "bitmap": mi.Bitmap(stars)},
        "disk": {"type": "disk", "to_world": T().scale(40),
                 "bsdf": {"type": "mask", "opacity": disk | {"quantity": "opacity"},
                          "nested": {"type": "diffuse", "reflectance": 0.0}},
                 "emitter": {"type": "twosidedarea", "radiance": disk | {"scale": 2.5}}},
        "sensor": {"type": "perspective", "fov": 42,
                   "to_world": T().look_at([60, 0, 7], [0, 0, 0], [0, 0, 1]),
                   "film": {"type": "hdrfilm", "width": width, "height": width * 9 // 16}},
    })  # fmt: skip


def draw(path: Path, bent, seen, outlines, through) -> None:
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(9.5, 8))
    top, right, left, low = axes.flat
    b, measured, exact = bent
    top.loglog(b, exact, "k-", lw=1, label="elliptic integral")
    top.loglog(b, 4 / b, "k:", lw=1, label="4 M / b")
    top.loglog(b, measured, "o", ms=4, mfc="none", label="rays")
    top.set(xlabel="impact parameter b / M", ylabel="deflection [rad]", title="Black hole")
    for kind, (r, measured, exact) in seen.items():
        curve = right.plot(r, np.degrees(exact), "-", lw=1, label=f"{kind} observer")
        right.plot(r, np.degrees(measured), "o", ms=4, mfc="none", color=curve[0].get_color())
    right.set(xlabel="distance r / M", ylabel="half angle [degrees]", title="Its shadow")
    for a, (x, y) in outlines.items():
        curve = left.plot(*spherical_orbits(a), "-", lw=1, label=f"a = {a:g} M")
        left.plot(x, y, "o", ms=4, mfc="none", color=curve[0].get_color())
    left.set(aspect="equal", xlabel="x / M", ylabel="y / M", title="Shadow of a hole that spins")
    for name, (beta, measured, exact) in through.items():
        curve = low.plot(beta, exact, "-", lw=1, label=name)
        low.plot(beta, measured, "o", ms=4, mfc="none", color=curve[0].get_color())
    low.set(xlabel="impact parameter β / ρ", ylabel="angle swept [rad]", title="Wormholes, ρ = 1")
    for ax in axes.flat:
        ax.legend(frameon=False, fontsize=8)
    figure.suptitle("Lines: closed forms. Circles: rays.", fontsize=9)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
