"""Workers of this machine, or a scheduler that runs already; `distributed` is imported here."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from relume.cluster import MPI, Cluster
from relume.cores import available_cores
from relume.session import CannotRender

try:
    from distributed import Client, LocalCluster, Security
except ImportError as error:
    raise CannotRender(
        f"--workers and --cluster need dask.distributed: pip install 'relume[cluster]' ({error})"
    ) from None

LOOPBACK = "127.0.0.1"
"""Whoever reaches a scheduler runs code: this address is reached from this machine alone."""

CONNECT = 30
"""Time to wait for a scheduler [s]."""


@contextmanager
def client(cluster: Cluster, threads: int | None = None) -> Iterator[Client]:
    """Context with a `distributed.Client`.

    Args:
        cluster: who renders.
        threads: that the workers of this machine share; None for one for each core.

    Raises:
        CannotRender: no scheduler answers, or a file of the certificates is wrong.
    """
    try:
        if cluster.workers is None:
            with _connected(cluster) as connected:
                yield connected
        else:
            with _local(cluster, cluster.workers, threads) as local, Client(local) as connected:
                yield connected
    except (OSError, ValueError) as error:
        where = cluster.address or f"{cluster.workers} workers"
        raise CannotRender(f"no cluster at {where}: {error}") from error


def _connected(cluster: Cluster) -> Client:
    if cluster.address == MPI:
        return Client(timeout=CONNECT)  # dask_mpi has told dask where the scheduler is
    return Client(cluster.address, security=_security(cluster.tls), timeout=CONNECT)


def _local(cluster: Cluster, workers: int, threads: int | None) -> LocalCluster:
    cores = threads or available_cores()
    return LocalCluster(
        n_workers=workers,
        threads_per_worker=max(1, cores // workers),
        host=LOOPBACK,
        protocol="tls" if cluster.tls else "tcp",
        security=_security(cluster.tls, ("client", "scheduler", "worker")),
        dashboard_address=f"{LOOPBACK}:0",
        memory_limit=0,
        preload="relume.cluster.preload",
        silence_logs=logging.CRITICAL,
    )


def _security(
    tls: tuple[str, str, str] | None, roles: Sequence[str] = ("client",)
) -> Security | None:
    """What `distributed` takes for the files of `Cluster.tls`."""
    if tls is None:
        return None
    authority, certificate, key = tls
    files = {f"tls_{role}_cert": certificate for role in roles}
    files |= {f"tls_{role}_key": key for role in roles}
    return Security(tls_ca_file=authority, require_encryption=True, **files)


def join_mpi() -> None:
    """Make the process what its rank under mpirun is; only rank 1 returns, and hands out passes.

    Raises:
        CannotRender: dask-mpi is not installed, or there are fewer than three processes.
    """
    try:
        import dask_mpi
        from mpi4py import MPI as mpi
    except (ImportError, RuntimeError) as error:
        raise CannotRender(f"--cluster mpi needs dask-mpi and mpi4py: {error}") from None
    if mpi.COMM_WORLD.Get_size() < 3:
        raise CannotRender("--cluster mpi needs mpirun -n 3 or more: scheduler, client, workers")
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    dask_mpi.initialize(nthreads=available_cores(), dashboard=False)
