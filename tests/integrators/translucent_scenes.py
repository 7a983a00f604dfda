"""Scenes of translucent things, and closed forms of the standard dipole."""

import mitsuba as mi
import numpy as np

from relume import (
    bsdfs,  # noqa: F401  registers the plugins
    emitters,  # noqa: F401
    integrators,  # noqa: F401
)

ALPHA = np.array([0.3, 0.8, 0.99])
SKY = {"type": "constant"}


def transform():
    return mi.ScalarTransform4f()


def rgb(values):
    return {"type": "rgb", "value": [float(v) for v in np.broadcast_to(values, 3)]}


def translucent(alpha=ALPHA, **more):
    """A material of sigma_t = 1 without mirror: F is noise for what is measured here."""
    alpha = np.asarray(alpha)
    coefficients = {"sigma_s": rgb(alpha), "sigma_a": rgb(1 - alpha)}
    kind = {"type": "subsurface", "eta": 1.3, "level": -2, "specular_reflectance": 0.0}
    return kind | coefficients | more


def view(origin=(0, 0, 100), fov=0.01, size=4, up=(0, 1, 0)):
    return {
        "type": "perspective",
        "fov": fov,
        "to_world": transform().look_at(list(origin), [0, 0, 0], list(up)),
        "film": {
            "type": "hdrfilm",
            "width": size,
            "height": size,
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
        },
    }


def scene(integrator="dipole", profile="standard", sensor=None, rr_depth=100, **things):
    kind = {"type": integrator, "rr_depth": rr_depth}
    if integrator == "dipole":
        kind["profile"] = profile
    parts = {"type": "scene", "integrator": kind, "sensor": sensor or view()}
    return mi.load_dict(parts | things)


def slab(bsdf):
    return {"type": "rectangle", "to_world": transform().scale(5000), "bsdf": bsdf}


def fresnel(cos, eta):
    """Fresnel's reflectance of unpolarised light from outside, float64."""
    cos_t = np.sqrt(1 - (1 - cos * cos) / eta**2)
    r_s, r_p = (cos - eta * cos_t) / (cos + eta * cos_t), (eta * cos - cos_t) / (eta * cos + cos_t)
    return (r_s**2 + r_p**2) / 2


def hemispherical(eta):
    """Mean of Fresnel's reflectance from outside over a hemisphere, weighted by the cosine."""
    z = (np.arange(100_000) + 0.5) / 100_000
    return np.mean(2 * z * fresnel(z, eta))


def boundary(eta):
    """A = (1 + F_dr) / (1 - F_dr) with the polynomial of Jensen et al. 2001."""
    F_dr = -1.440 / eta**2 + 0.710 / eta + 0.668 + 0.0636 * eta
    return (1 + F_dr) / (1 - F_dr)


def reflectance(alpha, eta, reach=np.inf):
    """2 pi int_0^reach R(r) r dr of the dipole with sigma_t' = 1, closed form.

    A source at depth z has alpha/2 (e^(-k z) - z/d e^(-k d)), d^2 = reach^2 + z^2, by
    substitution of d for r; the first term alone is R_d of Jensen et al. 2001, eq. 15.
    """
    k, total = np.sqrt(3 * (1 - alpha)), 0
    for z in (1, 1 + 4 / 3 * boundary(eta)):
        d = np.hypot(reach, z)
        total += np.exp(-k * z) - (z / d * np.exp(-k * d) if np.isfinite(d) else 0)
    return alpha / 2 * total
