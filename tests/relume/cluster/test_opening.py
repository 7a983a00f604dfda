"""`relume render --workers` and `--cluster`: the command line as a whole."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from click.testing import CliRunner

from relume import cli, cluster, passes_file

SETUP = """
from relume import cli, checkpoint, passes
passes.SAMPLES_PER_PASS = 32 * 24 * 16
checkpoint.INTERVAL = 0
"""

SLOW = """
import time
from relume.accumulator import Accumulator
add = Accumulator.add
Accumulator.add = lambda *told: (add(*told), time.sleep(0.5))
"""
"""What is left of the render after its first pass takes long enough to interrupt it."""

PATIENCE = 600
"""Time for other processes to begin or end on a busy machine [s]."""


def command(*words, setup=SETUP):
    return [sys.executable, "-c", f"{setup}\ncli.main()", "render", *map(str, words)]


def test_workers_of_this_machine(room, tmp_path, monkeypatch):
    """Ctrl-C in the middle, to all processes as a terminal sends it; then resumed without workers.

    All that listened meanwhile was on the loopback address.
    """
    psutil = pytest.importorskip("psutil", reason="dask.distributed is not installed")
    pytest.importorskip("distributed", reason="dask.distributed is not installed")
    monkeypatch.chdir(tmp_path)
    words = room(), "--spp", 800
    process = subprocess.Popen(
        command(*words, "--workers", 2, "-o", "a.exr", setup=SETUP + SLOW),
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    deadline = time.monotonic() + PATIENCE
    while not os.path.exists("a.passes.exr"):
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.05)
    family = [psutil.Process(process.pid), *psutil.Process(process.pid).children(recursive=True)]
    sockets = [c for p in family for c in p.net_connections() if c.status == psutil.CONN_LISTEN]
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, err
    assert "interrupted after" in err and "Traceback" not in err and "failed" not in err
    assert len(sockets) >= 3 and {c.laddr.ip for c in sockets} == {"127.0.0.1"}
    assert 0 < len(passes_file.read_header("a.passes.exr").done) < 50
    for more in (["--resume", "-o", "a.exr"], ["-o", "whole.exr"]):
        subprocess.run(command(*words, *more), check=True, capture_output=True)
    pictures = [passes_file_free(name) for name in ("a.exr", "whole.exr")]
    assert np.array_equal(*pictures)


def passes_file_free(name):
    """The picture in a file, which holds no passes."""
    import mitsuba as mi

    with pytest.raises(passes_file.NoPasses):
        passes_file.read_header(name)
    return np.array(mi.Bitmap(name))


def invoke(*words):
    return CliRunner().invoke(cli.main, ["render", *map(str, words)])


def test_what_is_missing_is_named(room, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    monkeypatch.delitem(sys.modules, "relume.cluster.opening", raising=False)
    monkeypatch.delattr(cluster, "opening", raising=False)  # another test may have loaded it
    result = invoke(room(), "-o", room().parent / "a.exr", "--workers", 2)
    assert result.exit_code == 1 and "pip install 'relume[cluster]'" in result.stderr


def test_a_scheduler_that_does_not_answer(room, monkeypatch):
    pytest.importorskip("distributed", reason="dask.distributed is not installed")
    from relume.cluster import opening

    monkeypatch.setattr(opening, "CONNECT", 0.5)
    for address in ("tcp://127.0.0.1:1", "nonsense://a"):
        result = invoke(room(), "-o", room().parent / "a.exr", "--cluster", address)
        assert result.exit_code == 1 and f"no cluster at {address}: " in result.stderr


def test_options_that_do_not_go_together(room):
    own = room()
    tls = ("--tls-ca", own, "--tls-cert", own, "--tls-key", own)
    for words, told in (
        (("--workers", 2, "--cluster", "tcp://127.0.0.1:1"), "either --workers or --cluster"),
        (("--tls-ca", own), "go together"),
        (tls, "with a cluster"),
        (("--cluster", "mpi", *tls), "own settings"),
        (("--workers", 0), "--workers"),
    ):
        result = invoke(own, *words)
        assert result.exit_code == 2 and told in result.stderr
