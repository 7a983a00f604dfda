"""Path tracers that take the light of one rectangle as the original program does.

With next event estimation the program finds an emitting rectangle in two ways that do not agree:
rays from the camera, mirrors and glass hit it in its squared extents (row uvplane-extent), and what
they see in mirrors and glass counts without Fresnel's weights; shadow rays go to the rectangle as
it is written. Nothing of relume renders so: it isolates the cause of a difference.
"""

import drjit as dr
import mitsuba as mi

TINT, GLASS = 0.99, 1.5
"""Colour of mirrors and glass, and the index of refraction, in the scenes that are studied."""


class Lamp:
    """Light of a parallelogram as it is written, sampled.

    Args:
        shape: `relume.translator.shapes.UVPlane`; light leaves on the side of u x v.
        emission: radiance, linear RGB.
    """

    def __init__(self, shape, emission):
        self.origin, self.u, self.v = (mi.Point3f(*x) for x in (shape.origin, shape.u, shape.v))
        across = dr.cross(mi.Vector3f(self.u), mi.Vector3f(self.v))
        self.area, self.normal = dr.norm(across), dr.normalize(across)
        self.emission = mi.Color3f(*emission)

    def sample(self, si, s):
        """A point on it, and radiance times cosine and area over the squared distance."""
        p = self.origin + self.u * s.x + self.v * s.y
        d = p - si.p
        cos = dr.maximum(-dr.dot(dr.normalize(d), self.normal), 0)
        return p, self.emission * (cos * self.area / dr.squared_norm(d))


class Beam(Lamp):
    """Light of a beam down from a horizontal square, in the squared extents of its edges.

    Args:
        shape: as `Lamp`; its edges are along x and z.
        emission: irradiance over pi, linear RGB.
    """

    def __init__(self, shape, emission):
        super().__init__(shape, emission)
        self.u, self.v = (x * dr.norm(mi.Vector3f(x)) for x in (self.u, self.v))

    def sample(self, si, s):
        """The point above, and the irradiance below the square."""
        p = mi.Point3f(si.p.x, self.origin.y, si.p.z)
        x, z = p.x - self.origin.x, p.z - self.origin.z
        below = (x > 0) & (x < self.u.x) & (z > 0) & (z < self.v.z) & (si.p.y < p.y)
        return p, dr.select(below, dr.pi * self.emission, 0)


def define():
    """The integrator's class under the variant in use."""

    class TwoLamps(mi.SamplingIntegrator):
        """Path tracer that sees a lamp and samples another.

        Args:
            lamp: `Lamp`; the scene's own emitters are what rays see.
            rr_depth: number of bounces after which roulette sets in.
        """

        def __init__(self, lamp, rr_depth):
            super().__init__(mi.Properties("two_lamps"))
            self.lamp, self.rr_depth = lamp, rr_depth

        @dr.syntax
        def sample(self, scene, sampler, ray, medium=None, active=True):
            ctx = mi.BSDFContext()
            ray = mi.Ray3f(ray)
            active = mi.Bool(active)
            L, β = mi.Spectrum(0), mi.Spectrum(1)
            depth = mi.UInt32(0)
            while active:
                si = scene.ray_intersect(ray, active)
                L[depth == 0] += self.emission(scene, si, active)
                active &= si.is_valid()
                bsdf = si.bsdf(ray)

                # ---- light of the lamp as it is written
                p, E = self.lamp.sample(si, sampler.next_2d(active))
                wo = si.to_local(dr.normalize(p - si.p))
                lit = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth) & (dr.max(E) > 0)
                lit &= ~scene.ray_test(si.spawn_ray_to(p), lit)
                L[lit] += β * bsdf.eval(ctx, si, wo, lit) * E

                # ---- light seen in mirrors and glass, without Fresnel's weights
                delta = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Delta)
                L[delta] += β * TINT * self.seen(scene, si, mi.reflect(si.wi), delta)
                _, cos_t, _, eta_ti = mi.fresnel(mi.Frame3f.cos_theta(si.wi), GLASS)
                glass = delta & mi.has_flag(bsdf.flags(), mi.BSDFFlags.DeltaTransmission)
                glass &= cos_t != 0
                through = mi.refract(si.wi, cos_t, eta_ti)
                L[glass] += β * TINT * self.seen(scene, si, through, glass)

                # ---- next direction
                bs, weight = bsdf.sample(
                    ctx, si, sampler.next_1d(active), sampler.next_2d(active), active
                )
                ray = si.spawn_ray(si.to_world(bs.wo))
                β *= weight
                depth[active] += 1
                q = dr.minimum(dr.max(β), 0.95)
                roulette = depth > self.rr_depth
                survives = ~roulette | (sampler.next_1d(active) < q)
                β[roulette] *= dr.rcp(q)
                active &= survives & (dr.max(β) > 0)
            return L, mi.Bool(True), []

        def emission(self, scene, si, active):
            """The emission of the surface that was hit."""
            return si.emitter(scene, active).eval(si, active)

        def seen(self, scene, si, wo, active):
            """The emission that is met in a local direction."""
            hit = scene.ray_intersect(si.spawn_ray(si.to_world(wo)), active)
            return self.emission(scene, hit, active)

    return TwoLamps
