"""What several integrators share."""

from __future__ import annotations

import functools
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from relume.parameters import POSITIVE, Range, whole

NO_LIMIT = 0xFFFFFFFF
"""Depth that no path reaches."""

DIM = 0.4
"""Share of the usual throughput below which roulette ends paths."""

FAINTEST = 0.1
"""Usual throughput at least: what is darker is not worth longer paths."""

MIRRORS = 8
"""Scatterings by mirrors and glass at most by way of which a path sees what it shows."""

LOSSLESS = 1 - 1e-5
"""Share of the light that a bounce keeps at least to count as one that loses nothing."""

PATIENCE = 256
"""Depth by which roulette has ended three of four paths that lose nothing."""


def nested_integrator(props: mi.Properties, capable: str = "") -> mi.SamplingIntegrator:
    """Return the one sampling integrator that is nested in another one.

    Args:
        props: `mi.Properties` of the outer integrator.
        capable: attribute of other integrators that are taken, too.

    Raises:
        ValueError: there is none, several, or one that renders no samples of single pixels, or
            none without their derivatives, as ``prb``.
    """
    nested = [value for _, value in props.objects() if isinstance(value, mi.Integrator)]
    taken = [hasattr(x, capable) or tells_radiance(x) for x in nested]
    if taken != [True]:
        also = " or bdpt" if capable else ""
        raise ValueError(f"{props.plugin_name()} takes one nested sampling integrator{also}")
    if isinstance(nested[0], mi.CppADIntegrator):
        differentiating = type(nested[0]).__name__
        raise ValueError(f"{props.plugin_name()} nests path or its like, not {differentiating}")
    return nested[0]


def tells_radiance(integrator: mi.Integrator) -> bool:
    """Whether an integrator has the radiance of single rays: not that with ``bdpt`` inside."""
    pictures = getattr(integrator, "takes_points", False)
    return isinstance(integrator, mi.SamplingIntegrator) and not pictures


def with_depth_range(
    integrator: mi.SamplingIntegrator, min_depth: int, max_depth: int
) -> mi.SamplingIntegrator:
    """Return an integrator for paths of a range of depths alone.

    Args:
        integrator: `mi.SamplingIntegrator`.
        min_depth: shortest path that counts, as in `surfacepath`.
        max_depth: longest path.

    Raises:
        ValueError: the integrator cannot leave out paths by their depth.
    """
    if not hasattr(integrator, "with_depth_range"):
        name = integrator.class_name()
        raise ValueError(f"{name} cannot leave out the light of some paths; surfacepath can")
    return integrator.with_depth_range(min_depth, max_depth)


def step_by_step(integrator: mi.SamplingIntegrator) -> AbstractContextManager[None]:
    """The context in which an integrator differentiates; one without effect if it needs none."""
    return getattr(integrator, "step_by_step", nullcontext)()


@functools.cache
def _nesting(_variant: str) -> type[mi.SamplingIntegrator]:
    class Nesting(mi.SamplingIntegrator):
        capable = ""  # attribute of other integrators that may be nested, too

        def __init__(self, props):
            mi.SamplingIntegrator.__init__(self, props)
            self.nested = nested_integrator(props, self.capable)

        def step_by_step(self):
            return step_by_step(self.nested)

        def render_forward(self, *args, **kwargs):
            with step_by_step(self.nested):
                return super().render_forward(*args, **kwargs)

        def render_backward(self, *args, **kwargs):
            with step_by_step(self.nested):
                super().render_backward(*args, **kwargs)

        def aov_names(self):
            return self.nested.aov_names()

        def traverse(self, cb):
            cb.put("nested", self.nested, mi.ParamFlags.Differentiable)

    return Nesting


def nesting() -> type[mi.SamplingIntegrator]:
    """The base class of integrators that work on the samples of another one, `nested`.

    Returns:
        The class for the variant in use. It differentiates as the nested one asks for, and shows
        that one's AOVs; `sample` is left to its subclasses.
    """
    return _nesting(mi.variant())


def path_depths(props: mi.Properties, roulette: int) -> tuple[int, int]:
    """Read the parameters ``max_depth`` and ``rr_depth`` of a path tracer.

    Args:
        props: `mi.Properties` of the integrator.
        roulette: default of ``rr_depth``.

    Returns:
        Longest path, `NO_LIMIT` for none, and the depth from which Russian roulette ends paths.

    Raises:
        ValueError: ``max_depth`` is below -1, or ``rr_depth`` below 1.
    """
    max_depth = whole(props, "max_depth", -1, Range(-1))
    rr_depth = whole(props, "rr_depth", roulette, POSITIVE)
    return max_depth if max_depth >= 0 else NO_LIMIT, rr_depth


def power_heuristic(pdf: mi.Float, other: mi.Float) -> mi.Float:
    """Return the weight of a sample of density `pdf` that `other` might have drawn, 0 for 0/0."""
    a, b = pdf * pdf, other * other
    w = a / (a + b)
    return dr.select(dr.isfinite(w), w, 0)


def usual_throughput(
    usual: mi.Float,
    throughput: mi.Spectrum,
    eta: mi.Float,
    depth: mi.UInt32,
    scatters: mi.Bool,
    delta: mi.Bool,
) -> mi.Float:
    """Return the throughput with which paths count as much as others of their pixel.

    A pixel is about as bright as its paths have throughput where they first scatter widely, seen
    straight or by way of mirrors and glass: paths over a dark surface count with a small one.

    Args:
        usual: ``mi.Float``, what was returned before the bounce; 0 at the sensor.
        throughput: ``mi.Spectrum``, that of the bounce included.
        eta: ``mi.Float``, product of the relative indices along the path.
        depth: ``mi.UInt32``, length of the path.
        scatters: ``mi.Bool``, whether it has scattered, and not passed a surface straight on.
        delta: ``mi.Bool``, whether the bounce was that of a mirror or glass.

    Returns:
        ``mi.Float``; 0 as long as it is not known.
    """
    settles = scatters & (usual == 0) & (~delta | (depth >= MIRRORS))
    here = dr.minimum(dr.max(throughput) * dr.square(eta), 1)
    return dr.select(settles, dr.detach(here), usual)


def russian_roulette(
    throughput: mi.Spectrum,
    eta: mi.Float,
    usual: mi.Float,
    kept: mi.Float,
    depth: mi.UInt32,
    decides: mi.Bool,
    sample: mi.Float,
) -> tuple[mi.Spectrum, mi.Bool]:
    """End dim paths by chance, and make up for it in those that go on.

    A path that survives has the throughput `DIM` u / `eta`^2 or more, u being `usual` or
    `FAINTEST`. After a bounce that loses nothing no path is certain to go on, or light between
    perfect mirrors would never end.

    Args:
        throughput: ``mi.Spectrum``, that of the bounce included.
        eta: ``mi.Float``, product of the relative indices along the path, whose square is no loss.
        usual: ``mi.Float``, as `usual_throughput` has it.
        kept: ``mi.Float``, share of the light that the bounce keeps.
        depth: ``mi.UInt32``, length of the path.
        decides: ``mi.Bool``, which paths may end.
        sample: uniform variate.

    Returns:
        (throughput, whether the path goes on).
    """
    largest = dr.max(throughput)
    dim = DIM * dr.maximum(usual, FAINTEST)
    survival = dr.minimum(largest * dr.square(eta) / dim, 1)
    patience = 1 - 2 / (mi.Float(depth) + PATIENCE)
    survival = dr.select(kept >= LOSSLESS, dr.minimum(survival, patience), survival)
    survival = dr.detach(survival)
    throughput = dr.select(decides, throughput * dr.rcp(survival), throughput)
    return throughput, (~decides | (sample < survival)) & (largest != 0)


@dataclass
class PreviousVertex:
    """Where a ray comes from, and how it was drawn.

    Attributes:
        si: ``mi.Interaction3f``.
        pdf: ``mi.Float``, density of its direction [1/sr].
        delta: ``mi.Bool``, whether no emitter sample could have drawn it.
    """

    si: mi.Interaction3f
    pdf: mi.Float
    delta: mi.Bool

    @classmethod
    def camera(cls) -> PreviousVertex:
        """That of camera rays."""
        return cls(dr.zeros(mi.Interaction3f), mi.Float(1), mi.Bool(True))


def emission(
    scene: mi.Scene, si: mi.SurfaceInteraction3f, previous: PreviousVertex, active: mi.Bool
) -> mi.Spectrum:
    """Return what a ray gets of the emitter that it meets, weighted against emitter sampling."""
    ds = mi.DirectionSample3f(scene, si, previous.si)
    pdf = scene.pdf_emitter_direction(previous.si, ds, active & ~previous.delta)
    return ds.emitter.eval(si, active) * power_heuristic(previous.pdf, pdf)
