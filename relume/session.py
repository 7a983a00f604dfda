"""A render session: a scene rendered in passes of bounded memory.

A pass adds samples to every pixel. Which samples those are depends on the seed, its index, the size
of the picture and the numbers of samples of this pass and of a whole one alone, so the same pass
gives the same sums, bit for bit, whoever computes it: the radiance of all samples of a pixel is
computed in one kernel and summed in a fixed order, never scattered into the film. Passes are added
up exactly (see `accumulator`).

By the sampler `owen` the passes go on with the points of two sequences in each pixel, in turn: all
passes together are as good as one, and the two, which are independent, tell the noise.
"""

from __future__ import annotations

import functools
import time
import warnings
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.accumulator import Accumulator
from relume.cores import available_cores
from relume.integrators.common import tells_radiance
from relume.options import SAMPLERS
from relume.passes import Pass, PassPlan, PassSet
from relume.progress import Progress
from relume.sensors.pixelsamples import FILTERS, sample_pixels

SAMPLES_PER_LAUNCH = 2**22
"""Most samples of one kernel launch: a pass over a very large picture takes several."""


Scene = Any
"""`mi.Scene`; Mitsuba's types depend on the variant."""

Integrator = Any
"""`mi.Integrator`."""


class CannotRender(RuntimeError):
    """A scene cannot be rendered on this machine, or not as asked; the message says why."""


def reason(error: BaseException) -> str:
    """The last line of an error's text: Mitsuba puts whole Python tracebacks before it."""
    return str(error).strip().rpartition("\n")[2]


def set_variant(name: str) -> None:
    """Set a Mitsuba variant.

    At each change Mitsuba compiles its own integrators anew and warns of it; that is not shown.

    Raises:
        CannotRender: the variant does not work on this machine.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "The AST-transforming decorator", RuntimeWarning)
        try:
            mi.set_variant(name)
        except ImportError as error:
            raise CannotRender(f"{name} does not work here: {reason(error)}") from None


@contextmanager
def variant_context(name: str) -> Iterator[None]:
    """Set a Mitsuba variant for the time of the block; as `mi.variant_context`, without warnings.

    Raises:
        CannotRender: the variant does not work on this machine.
    """
    before = mi.variant()
    set_variant(name)
    try:
        yield
    finally:
        if before and before != name:
            set_variant(before)


@contextmanager
def thread_count(count: float | None) -> Iterator[None]:
    """Render with `count` threads for the time of the block.

    Args:
        count: at most one for each core is used; None for one for each core.
    """
    before = dr.thread_count()
    set_thread_count(count)
    try:
        yield
    finally:
        dr.set_thread_count(before)


def set_thread_count(count: float | None) -> None:
    """Render with `count` threads from now on; as `thread_count`."""
    cores = available_cores()
    dr.set_thread_count(cores if count is None else max(1, min(int(count), cores)))


@contextmanager
def exr_threads() -> Iterator[None]:
    """Use two threads or more for the time of the block, in which Mitsuba reads or writes EXR.

    With one, Mitsuba 3.9 never finishes to do so: it waits for another.
    """
    before = dr.thread_count()
    dr.set_thread_count(max(before, 2))
    try:
        yield
    finally:
        dr.set_thread_count(before)


def check_cameras(scene: Scene, path: str) -> None:
    """Check that the rays of a scene's cameras are numbers: others see nothing, without a word.

    Args:
        scene: the loaded scene.
        path: of its file, for the message.

    Raises:
        CannotRender: a camera's matrix is not finite, or what else it is made of gives no rays.
    """
    for sensor in scene.sensors():
        matrix = np.array(sensor.world_transform().matrix, float)
        if not np.isfinite(matrix).all():
            rows = "; ".join(" ".join(f"{x:g}" for x in row) for row in matrix.reshape(4, 4))
            raise CannotRender(f"{path}: the sensor's to_world is not finite: {rows}")
        for place in ((0.3, 0.6), (0.7, 0.2)):
            ray, _ = sensor.sample_ray(0.0, 0.5, mi.Point2f(*place), mi.Point2f(0.2, 0.6))
            o, d = np.array(ray.o, float), np.array(ray.d, float)
            if not (np.isfinite(o).all() and abs(np.linalg.norm(d) - 1) < 0.1):
                raise CannotRender(
                    f"{path}: the sensor has no rays; its field of view and its lens are to be "
                    "finite and above 0"
                )


def sees_nothing(scene: Scene) -> bool:
    """Whether no ray of a grid from the camera meets a surface; False in scalar variants."""
    if mi.variant().startswith("scalar"):
        return False
    columns, rows = dr.meshgrid(*(dr.linspace(mi.Float, 0.01, 0.99, 64) for _ in range(2)))
    ray, _ = scene.sensors()[0].sample_ray(0.0, 0.5, mi.Point2f(columns, rows), mi.Point2f(0.5))
    return not dr.any(scene.ray_test(ray))


def accumulate(
    passes: Iterable[Pass | None], accumulator: Accumulator, count: int, spp: int
) -> Iterator[Progress]:
    """Add passes to an accumulator as they come.

    Args:
        passes: iterator of `Pass`, or of None where there is none yet.
        accumulator: `Accumulator`.
        count: how many passes are to come.
        spp: samples of a pixel that the render is to have in the end.

    Yields:
        `Progress` after each pass or None.
    """
    start = time.perf_counter()
    count += len(accumulator.done)
    for found in passes:
        if found is not None:
            accumulator.add(found)
        seconds = time.perf_counter() - start
        yield Progress(len(accumulator.done), count, accumulator.spp, spp, seconds)


def samples_rays(integrator: Integrator) -> bool:
    """Whether an integrator has a `sample` that tells the radiance along a ray."""
    differentiating = isinstance(integrator, mi.CppADIntegrator)
    return tells_radiance(integrator) and not differentiating


def sequence_of(which: Any, first: Any, seed: int, pixel: Any, sample: Any) -> Any:
    """A sampler with points of one of the two sequences of pixels.

    Args:
        which: of the two.
        first: the point from which samples count.
        seed: of the sequences.
        pixel: ``mi.UInt32``, of each lane.
        sample: ``mi.UInt32``, counted from 0.
    """
    sampler = mi.load_dict({"type": "owen"})
    which, first = (dr.opaque(mi.UInt32, x) for x in (which, first))
    sampler.start(2 * pixel + which, sample + first, seed)
    return sampler


class Session:
    """Renders one loaded scene; the variant it was loaded under must stay set.

    Args:
        scene: `mi.Scene` with one sensor.
        spp: samples of a pixel.
        seed: non-negative integer; the same seed gives the same picture.
        integrator: `mi.Integrator` to use instead of the scene's.
        per_pass: most samples of a pixel in a pass; None for the usual number.
        sampler: `owen`, or `independent` for that of the scene, taken for independent numbers.
        sensor: `mi.Sensor` that sees it; None for the first of the scene.

    Attributes:
        width, height: of the picture [pixel].
        by_sample: whether the radiance of each sample is known, so that noise can be told; else a
            pass is one picture by `mi.render`.
        plan: `PassPlan` of the render.
        accumulator: the passes so far.

    Raises:
        CannotRender: the film's reconstruction filter has negative weights, or its type is another.
    """

    def __init__(
        self,
        scene: Scene,
        spp: int,
        seed: int = 0,
        integrator: Integrator | None = None,
        *,
        per_pass: int | None = None,
        sampler: str = SAMPLERS[0],
        sensor: Any = None,
    ) -> None:
        self.scene = scene
        self.sensor = sensor or scene.sensors()[0]
        self.integrator = integrator or scene.integrator()
        self.spp = int(spp)
        self.seed = int(seed)
        self.width, self.height = (int(x) for x in self.sensor.film().crop_size())
        self.by_sample = "scalar" not in mi.variant() and samples_rays(self.integrator)
        self._check_film()
        self.plan = PassPlan.of(self.width, self.height, self.spp, per_pass)
        self.spreads = sampler == "owen"
        self.accumulator = Accumulator(self.width, self.height)

    def _check_film(self) -> None:
        film = self.sensor.film()
        kind, rfilter = film.class_name(), film.rfilter().class_name()
        if self.by_sample and rfilter not in FILTERS:
            raise CannotRender(
                f"samples cannot follow the film's {rfilter}, negative in places; expected "
                "a box, tent or gaussian filter"
            )
        if not self.by_sample and kind != "HDRFilm":
            raise CannotRender(f"this integrator renders into a film of type hdrfilm, not {kind}")

    def run(self) -> Iterator[Progress]:
        """Render pass after pass, those that the accumulator lacks, and add them to it.

        Yields:
            `Progress` after each pass; the render can be left at any of them.
        """
        to_do = self.plan.to_do(self.accumulator.done)
        return accumulate(self.render(to_do), self.accumulator, len(to_do), self.spp)

    def render(self, to_do: PassSet) -> Generator[Pass, None, None]:
        """Render passes.

        Args:
            to_do: `PassSet`.

        Yields:
            `Pass`, in the order of their indices.
        """
        for index, spp in to_do:
            yield self.render_pass(index, spp)

    def render_pass(self, index: int, spp: int) -> Pass:
        """Render one pass.

        Args:
            index: which, 0 or more.
            spp: samples of a pixel, at most `plan.per_pass`.

        Returns:
            `Pass`.
        """
        if spp > self.plan.per_pass:
            raise ValueError(f"a pass of {spp} samples, of at most {self.plan.per_pass}")
        if not self.by_sample:
            if self.spreads and getattr(self.integrator, "takes_points", False):
                return self._two_pictures(index, spp)
            return Pass(index, spp, self._render_image(spp, index))
        pixels = self.width * self.height
        rows = max(1, SAMPLES_PER_LAUNCH // (spp * self.width)) * self.width
        found = np.empty((6, pixels), np.float32)
        for launch, first in enumerate(range(0, pixels, rows)):
            count = min(rows, pixels - first)
            sums = self._pixels(spp, first, count, index, launch)
            for row, values in zip(found, sums, strict=True):
                row[first : first + count] = values
        if not self.spreads:
            return Pass(index, spp, found[:3], found[3:])
        odd = index * self.plan.per_pass % 2
        lead = (spp + 1 - odd) // 2 * 2 - spp
        return Pass(index, spp, found[:3], difference=found[3:], lead=lead)

    def image(self) -> np.ndarray:
        """The picture so far: linear RGB, (height, width, 3) float32; NaN where nothing is."""
        return self.accumulator.image()

    def _seed(self, *place):
        return int(np.random.SeedSequence((self.seed, *place)).generate_state(1)[0])

    def _pixels(self, spp, first, count, index, launch):
        """Sums of `spp` samples for `count` pixels from `first`, then of their squares or of their
        differences: six."""
        # Opaque numbers: the kernel is the same for every pass.
        per_pixel, offset, width = (dr.opaque(mi.UInt32, x) for x in (spp, first, self.width))
        lane = dr.arange(mi.UInt32, count * spp)
        pixel = lane // per_pixel
        sample, pixel = lane - pixel * per_pixel, pixel + offset
        if self.spreads:
            sampler, sign = self._spread(index, pixel, sample)
        else:
            sampler, sign = self.sensor.sampler().clone(), None
            sampler.seed(self._seed(index, launch), count * spp)
        y = pixel // width
        corner = mi.Point2f(pixel - y * width, y)
        size = mi.Vector2f(*(dr.opaque(mi.Float, x) for x in (self.width, self.height)))
        u = sampler.next_2d()
        with dr.suspend_grad():
            color = sample_pixels(
                self.scene, self.sensor, self.integrator, sampler, corner, u, size
            )
        samples = [*color, *(color * (color if sign is None else sign))]
        dr.eval(samples)
        return [dr.block_sum(channel, spp).numpy() for channel in samples]

    def _first_point(self, index):
        """The first point of a pass, and the seed of its sequences."""
        # Far more points than a sampler can count begin anew with another seed.
        era, start = divmod(index * self.plan.per_pass, 2**31)
        return start, self._seed(era)

    def _spread(self, index, pixel, sample):
        """The sampler of a pass, and the sign with which each sample counts in the difference."""
        start, seed = self._first_point(index)
        point = sample + dr.opaque(mi.UInt32, start)
        sampler = mi.load_dict({"type": "owen"})
        sampler.start(2 * pixel + point % 2, point // 2, seed)
        return sampler, dr.select(point % 2 == 0, mi.Float(1), mi.Float(-1))

    def _two_pictures(self, index, spp):
        """A pass of an integrator that renders pictures: one by each sequence."""
        self._tell_index(index)
        start, seed = self._first_point(index)
        sums, counts = np.zeros((2, 3, self.width * self.height)), [0, 0]
        for which in range(2):
            first, stop = (start + 1 - which) // 2, (start + spp + 1 - which) // 2
            if count := stop - first:
                points = functools.partial(sequence_of, which, first, seed)
                own, counts[which] = self._seed(index, which), count
                found = self.integrator.render_image(self.scene, self.sensor, own, count, points)
                sums[which] = count * found.T[:3]
        a, b = sums
        both, difference = (x.astype(np.float32) for x in (a + b, a - b))
        return Pass(index, spp, both, difference=difference, lead=counts[0] - counts[1])

    def _tell_index(self, index):
        """Tell the integrator which pass it renders, if it wants to know."""
        if hasattr(self.integrator, "pass_index"):
            self.integrator.pass_index = index

    def _render_image(self, spp, index):
        """The sum of a pass by Mitsuba's own means: (3, pixels)."""
        self._tell_index(index)
        image = mi.render(
            self.scene,
            sensor=self.sensor,
            integrator=self.integrator,
            spp=spp,
            seed=self._seed(index),
        )
        channels = np.array(image).reshape(self.width * self.height, -1).T
        gray = len(channels) < 3
        return (channels[[0, 0, 0]] if gray else channels[:3]) * np.float32(spp)
