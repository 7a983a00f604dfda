"""What runs on a worker: a scene is loaded once and stays, with its kernels, for all its passes."""

from __future__ import annotations

import tempfile
import time
import zlib
from collections import OrderedDict
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np

from relume import fingerprint
from relume.cluster.serialization import unpack
from relume.loading import load_integrator, load_scene
from relume.options import RenderOptions
from relume.passes import Pass
from relume.session import CannotRender, Session, set_thread_count
from relume.translator import Document, Translation
from relume.translator.plan import RenderPlan

SCENES = 4
"""Scenes that a worker keeps loaded; the least recently used one goes first."""

_thread = ThreadPoolExecutor(1, thread_name_prefix="relume")
"""Mitsuba's variant belongs to a thread: everything renders on this one."""

_sessions: OrderedDict[str, tuple[str, Session]] = OrderedDict()


@dataclass(frozen=True)
class Job:
    """What a worker must know of a render.

    Attributes:
        key: hash of all that follows.
        scene: packed, see `serialization`.
        plan: the scene's.
        render: its `fingerprint.of_render`.
        integrator: plugin id in place of the scene's integrator, or None.
    """

    key: str
    scene: dict[str, Any]
    plan: RenderPlan
    render: dict[str, Any]
    integrator: str | None

    @staticmethod
    def of(
        translation: Translation,
        scene: dict[str, Any],
        render: dict[str, Any],
        options: RenderOptions,
    ) -> Job:
        """The job of a translated scene that was packed as `scene`."""
        key = fingerprint.content_hash([render, translation.plan.spp])
        return Job(key, scene, translation.plan, render, options.integrator)


@dataclass(frozen=True, eq=False)
class Rendered:
    """A pass with what is needed to trust it.

    Attributes:
        pass_: the pass.
        seconds: that it took.
        checksum: of its sums, made where they were.
    """

    pass_: Pass
    seconds: float
    checksum: int


class NotLoaded(RuntimeError):
    """A worker was asked for a pass of a scene that it does not have, or no longer."""


def load(job: Job, contents: Mapping[str, Any], threads: int) -> None:
    """Load a scene, unless it is there.

    Args:
        job: what to load.
        contents: arrays and bytes of the scene by hash.
        threads: for Dr.Jit.

    Raises:
        CannotRender: versions differ, or what came is not the scene that was sent.
    """
    _thread.submit(_load, job, contents, threads).result()


def render(key: str, index: int, spp: int) -> Rendered:
    """Render a pass of the job `key`.

    Raises:
        NotLoaded: the scene is not here.
    """
    return _thread.submit(_render, key, index, spp).result()


def checksum(found: Pass) -> int:
    """A checksum of the sums of a `Pass`."""
    total = found.lead & 0xFFFFFFFF
    for array in found.arrays:
        total = zlib.crc32(np.ascontiguousarray(array).data.cast("B"), total)
    return total


def _load(job: Job, contents: Mapping[str, Any], threads: int) -> None:
    set_thread_count(threads)
    if job.key in _sessions:
        return
    here = fingerprint.versions()
    differ = [f"{name} is {here[name]}, expected {job.render[name]}" for name in here
              if here[name] != job.render[name]]  # fmt: skip
    if differ:
        raise CannotRender("; ".join(differ))
    mi.set_variant(job.render["variant"])
    with tempfile.TemporaryDirectory(prefix="relume-") as folder:
        scene = unpack(job.scene, contents, folder)
        if fingerprint.content_hash(scene) != job.render["scene"]:
            raise CannotRender("the scene arrived damaged")
        translation = Translation(Document(), scene, job.plan)
        integrator = job.integrator and load_integrator(job.integrator, scene["integrator"])
        made = Session(
            load_scene(translation),
            job.plan.spp,
            job.render["seed"],
            integrator,
            per_pass=job.render[fingerprint.PER_PASS],
            sampler=job.render["sampler"],
        )
    while len(_sessions) >= SCENES:
        _sessions.popitem(last=False)
    _sessions[job.key] = job.render["variant"], made


def _render(key: str, index: int, spp: int) -> Rendered:
    if key not in _sessions:
        raise NotLoaded(key)
    _sessions.move_to_end(key)
    variant, session = _sessions[key]
    if mi.variant() != variant:
        mi.set_variant(variant)
    start = time.perf_counter()
    found = session.render_pass(index, spp)
    return Rendered(found, time.perf_counter() - start, checksum(found))
