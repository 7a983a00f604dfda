"""Renders over several processes and machines, by dask.distributed.

This process hands out passes and adds up what comes back (`farm`); workers load the scene once and
render (`worker`). Scene, meshes and pictures travel by content (`serialization`), so that
workers need neither the files nor a shared disk, only relume itself. Since sums are exact, the
picture is that of a single process, bit for bit, whoever rendered which pass and whatever went
wrong on the way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from relume.options import RenderOptions

if TYPE_CHECKING:
    from relume.cluster.farm import Farm
    from relume.translator.scene import Translation

MPI = "mpi"
"""Address that stands for the processes that mpirun started."""


@dataclass(frozen=True)
class Cluster:
    """Who renders.

    Attributes:
        workers: processes to start on this machine, or None.
        address: of a running scheduler, such as `tcp://host:8786`, or `MPI`.
        tls: files of the certificate authority, the certificate and its key; or None.
    """

    workers: int | None = None
    address: str | None = None
    tls: tuple[str, str, str] | None = None


@contextmanager
def opened(
    cluster: Cluster,
    translation: Translation,
    render: dict[str, Any],
    options: RenderOptions,
    note: Callable[[str], object],
) -> Iterator[Farm]:
    """Context with a `Farm` for a translated scene.

    Args:
        cluster: who renders.
        translation: the translated scene.
        render: its `fingerprint.of_render`.
        options: with which `render` was made.
        note: called with sentences for the user.

    Raises:
        CannotRender: `distributed` is not installed, or no scheduler answers.
    """
    from relume.cluster import farm, opening, serialization, worker

    threads = translation.document.thread
    with opening.client(cluster, None if threads is None else int(threads)) as client:
        scene, contents = serialization.pack(translation.scene)
        job = worker.Job.of(translation, scene, render, options)
        yield farm.Farm(client, job, contents, note)
