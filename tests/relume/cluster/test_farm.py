"""Renders on workers that die, hang, fail and lie: always the picture of a single process.

Which worker is quick is not left to chance: where a test needs one of them to take part, the other
waits for it, told by a file that both see.
"""

import os
import signal
import time
from types import SimpleNamespace

import numpy as np
import pytest

import relume
from relume import fingerprint, translator
from relume.accumulator import Accumulator
from relume.cluster import serialization
from relume.loading import open_session
from relume.options import RenderOptions
from relume.passes import Pass, PassPlan
from relume.session import CannotRender

distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")

from relume.cluster import farm as farms  # noqa: E402
from relume.cluster import worker as remote  # noqa: E402

PLAN = PassPlan(spp=44, per_pass=4)


@pytest.fixture(scope="module")
def cluster():
    """Two workers of one thread on this machine."""
    options = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0", "memory_limit": 0}
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, silence_logs=50, **options
    ) as made:
        yield made


@pytest.fixture(scope="module")
def client(cluster):
    with distributed.Client(cluster) as made:
        yield made


@pytest.fixture
def workers(client):
    """Addresses of the workers; what a test changed in them is undone after it."""
    client.wait_for_workers(2)
    yield list(client.nthreads())
    client.run(restore)


class Rendering:
    """A scene rendered by a farm, pass by pass.

    Args:
        client: the client.
        path: the scene file.
        sampler: as `RenderOptions`.
    """

    def __init__(self, client, path, spp=PLAN.spp, sampler="owen"):
        options = RenderOptions(sampler=sampler)
        translation = translator.translate(relume.read(path))
        plan = translation.plan
        render = fingerprint.of_render(translation, options, PLAN.per_pass)
        scene, contents = serialization.pack(translation.scene)
        job = remote.Job.of(translation, scene, render, options)
        self.notes = []
        self.farm = farms.Farm(client, job, contents, self.notes.append)
        self.accumulator = Accumulator(plan.width, plan.height)
        self.to_do = PassPlan(spp, PLAN.per_pass).passes()
        with open_session(translation, options, PLAN.per_pass) as session:
            for found in session.render(self.to_do):
                self.accumulator.add(found)
        self.expected = self.accumulator.image()
        self.accumulator = Accumulator(plan.width, plan.height)

    def steps(self, idle=False):
        """Yields the number of passes after each, and with `idle` also where there is none."""
        for found in self.farm.render(self.to_do):
            if found is not None:
                self.accumulator.add(found)
            if found is not None or idle:
                yield len(self.accumulator.done)

    def check(self):
        """Render what is left; each pass came once, and the picture is the expected one."""
        for _ in self.steps():
            pass
        self.same()

    def same(self):
        assert self.accumulator.done == self.to_do
        assert np.array_equal(self.accumulator.image(), self.expected)


# ---- run on workers


def replace_rendering(kind, times=10**9, *, tells=None, at=1, waits=None):
    """Make a worker return something else than a pass.

    Args:
        kind: of what it returns, or `own` for the pass as it is.
        times: how often.
        tells: file that it makes when it is called for the `at`-th time.
        at: see `tells`.
        waits: file without which it returns nothing, from its first call on.
    """
    import os
    import time
    from dataclasses import replace

    from relume.cluster import worker as remote

    remote.original = getattr(remote, "original", remote._render)
    calls = 0

    def render(key, index, spp):
        nonlocal calls
        calls += 1
        if tells and calls == at:
            open(tells, "w").close()
        while waits and not os.path.exists(waits):
            time.sleep(0.01)
        if kind == "own" or calls > times:
            return remote.original(key, index, spp)
        if kind == "error":
            raise FloatingPointError("out of order")
        if kind == "hang":
            return None
        result = remote.original(key, index, spp)
        found = result.pass_
        if kind == "nothing":
            return None
        if kind == "other pass":
            found = replace(found, index=index + 1)
        if kind == "wrong size":
            found = replace(found, sum=found.sum[:, 1:], difference=found.difference[:, 1:])
        if kind == "doubles":
            found = replace(found, difference=found.difference.astype(float))
        if kind == "no finite":
            found.sum[1, 5] = float("nan")
        if kind == "impossible":
            found = replace(found, sum=found.sum * 3)
        if kind == "damaged":
            return remote.Rendered(found, result.seconds, result.checksum ^ 1)
        return remote.Rendered(found, result.seconds, remote.checksum(found))

    remote._render = render


def restore():
    from relume.cluster import worker as remote

    remote._render = getattr(remote, "original", remote._render)


def loads():
    from relume.cluster import worker as remote

    return list(remote._sessions)


# ---- all is well


def test_the_picture_is_that_of_one_process(client, workers, room, tmp_path):
    """Also the second time, when each worker has the scene loaded already."""
    flag = str(tmp_path / "flag")
    client.run(replace_rendering, "own", tells=flag, workers=workers[:1])
    client.run(replace_rendering, "own", waits=flag, workers=workers[1:])
    rendering = Rendering(client, room(spp=44))
    rendering.check()
    assert rendering.notes == []
    job = rendering.farm.job
    assert all(job.key in loaded for loaded in client.run(loads).values())
    client.run(replace_loading)
    again = Rendering(client, room(spp=44))
    again.check()
    assert again.farm.job.key == job.key and again.notes == []
    assert max(loaded.count(job.key) for loaded in client.run(loads).values()) == 1


def replace_loading():
    from relume.cluster import worker as remote

    def loaded(_):
        raise AssertionError("loaded twice")

    remote.load_scene = loaded


def test_workers_need_no_files(client, workers, tmp_path):
    """The mesh and the picture on it are gone before a worker begins."""
    from PIL import Image

    client.run(restore_loading)
    (tmp_path / "part.obj").write_text("v -2 0 0\nv 2 0 0\nv 0 3 0\nf 1 2 3\n")
    pixels = np.random.default_rng(0).integers(0, 256, (8, 8, 3), np.uint8)
    Image.fromarray(pixels).save(tmp_path / "dots.png")
    path = tmp_path / "scene.txt"
    path.write_text(
        "IMAGE\n24 16\nSAMPLING\n44\nCAMERA_POS\n0 1 9\nTARGET_POS\n0 1 0\nBACKGROUND\n1 1 1\n\n"
        "OBJECT\nobjfile part.obj\ncolor 0.5 0.6 0.7\nreflection diffuse\n\n"
        "OBJECT\nuvplane -3 0 -3\nU 6 0 0\nV 0 4 0\ntexture dots.png\nreflection diffuse\n"
    )
    rendering = Rendering(client, path)
    for name in ("part.obj", "dots.png", "scene.txt"):
        (tmp_path / name).unlink()
    rendering.check()
    assert len(rendering.farm.contents) == 2 and rendering.notes == []


def restore_loading():
    from relume import loading
    from relume.cluster import worker as remote

    remote.load_scene = loading.load_scene


# ---- all is not well


@pytest.mark.parametrize(
    "kind, told",
    [
        ("error", "FloatingPointError: out of order"),
        ("nothing", "it returned no pass"),
        ("other pass", "it returned another pass"),
        ("wrong size", "it returned sums of another size"),
        ("doubles", "it returned sums of another size"),
        ("impossible", "it returned sums that no samples have"),
        ("damaged", "the sums were damaged on the way"),
        ("no finite", None),
    ],
)
def test_what_is_no_pass_is_rendered_elsewhere(client, workers, room, tmp_path, kind, told):
    """One worker fails at its first two passes and is forgiven; nothing that it said counts."""
    flag = str(tmp_path / "flag")
    client.run(replace_rendering, kind, 2, tells=flag, workers=workers[:1])
    client.run(replace_rendering, "own", waits=flag, workers=workers[1:])
    # Squares alone bound a sum.
    sampler = "independent" if kind == "impossible" else "owen"
    rendering = Rendering(client, room(spp=44), sampler=sampler)
    rendering.check()
    if told:
        assert {note.partition(": ")[2] for note in rendering.notes} == {told}
        assert all(note.startswith(f"worker {workers[0]} failed") for note in rendering.notes)
    else:
        assert rendering.notes == []


def test_a_worker_that_always_fails_is_not_used(client, workers, room, tmp_path):
    flag = str(tmp_path / "flag")
    client.run(replace_rendering, "error", tells=flag, at=farms.FAILURES, workers=workers[:1])
    client.run(replace_rendering, "own", waits=flag, workers=workers[1:])
    rendering = Rendering(client, room(spp=44))
    rendering.check()
    assert rendering.farm.banned == {workers[0]: "FloatingPointError: out of order"}


def test_a_pass_that_fails_everywhere_ends_the_render(client, workers, room):
    client.run(replace_rendering, "error")
    with pytest.raises(CannotRender, match="out of order"):
        Rendering(client, room(spp=44)).check()


def test_a_scene_that_makes_nan_everywhere_is_rendered(client, workers, room):
    """Where two workers find the same NaN, it is the picture's."""
    client.run(replace_rendering, "no finite")
    rendering = Rendering(client, room(spp=12), spp=12)
    for _ in rendering.steps():
        pass
    image = rendering.accumulator.image()
    assert np.isnan(image[0, 5, 1]) and np.isnan(image).sum() == 1
    assert rendering.accumulator.done == rendering.to_do


def test_a_worker_of_another_version_is_not_used(client, workers, room, tmp_path):
    """The other one waits until it has been found out."""

    def other_version():
        from relume import fingerprint

        versions = fingerprint.versions()
        fingerprint.versions = lambda: versions | {"mitsuba": "2.0"}

    def own_version():
        import importlib

        from relume import fingerprint

        importlib.reload(fingerprint)

    path = room("LENS\n0.3 14", spp=44)
    flag = tmp_path / "flag"
    client.run(replace_rendering, "own", waits=str(flag), workers=workers[1:])
    client.run(other_version, workers=workers[:1])
    try:
        rendering = Rendering(client, path)
        for _ in rendering.steps(idle=True):
            if workers[0] in rendering.farm.banned:
                flag.touch()
        rendering.same()
    finally:
        client.run(own_version)
    assert "mitsuba is 2.0, expected 3." in rendering.farm.banned[workers[0]]


@pytest.mark.parametrize("kind", ["hang", "late"])
def test_a_worker_that_hangs_is_left_alone(client, workers, room, monkeypatch, tmp_path, kind):
    """Also one that wakes up later: what it then returns does not count a second time.

    The clock is ours: it stands until nothing but the passes of the hanging worker is left.
    """
    clock = SimpleNamespace(now=0.0, monotonic=lambda: clock.now)
    monkeypatch.setattr(farms, "time", clock)
    begun, awake = str(tmp_path / "begun"), str(tmp_path / "awake")
    what = {"hang": "hang", "late": "own"}[kind]
    client.run(replace_rendering, what, tells=begun, waits=awake, workers=workers[:1])
    client.run(replace_rendering, "own", waits=begun, workers=workers[1:])
    rendering = Rendering(client, room(spp=44))
    farm = rendering.farm
    for _ in rendering.steps(idle=True):
        hanging, other = (farm.workers.get(address) for address in workers)
        if hanging and hanging.ready and not farm.waiting and other and not other.tasks:
            clock.now += farms.LOADING + farms.LOOK
        if not hanging and kind == "late":
            open(awake, "w").close()
    open(awake, "w").close()
    rendering.same()
    assert "no answer for" in farm.banned[workers[0]]


def test_a_worker_that_dies_and_one_that_comes(cluster, client, workers, room, tmp_path):
    """SIGKILL in the middle; the two passes that it had are rendered by the others."""
    begun, never = str(tmp_path / "begun"), str(tmp_path / "never")
    client.run(replace_rendering, "own", tells=begun, waits=never, workers=workers[:1])
    client.run(replace_rendering, "own", waits=begun, workers=workers[1:])
    rendering = Rendering(client, room(spp=240), spp=240)
    steps = rendering.steps()
    next(steps)
    pids = client.run(os.getpid)
    os.kill(pids[workers[0]], signal.SIGKILL)
    cluster.scale(3)
    seen = {}
    for _ in steps:
        seen |= rendering.farm.workers
        while not client.nthreads().keys() - set(workers):
            time.sleep(0.1)  # until a new one has come
        if not seen.keys() - set(workers):
            time.sleep(farms.LOOK / 10)  # until it is noticed
    rendering.same()
    assert workers[0] not in rendering.farm.workers and seen.keys() - set(workers)


# ---- sums


def test_possible_sums():
    """Samples of any kind are possible, also with rounding; sums without their squares are not."""
    random = np.random.default_rng(0)
    for scale in (1e-20, 1.0, 1e15):
        for spp in (1, 7, 1000):
            samples = (random.exponential(scale, (spp, 3, 4)) * [1, -1, 0, 1]).astype(np.float32)
            sums, squares = samples.sum(axis=0), (samples**2).sum(axis=0)
            assert farms.possible(Pass(0, spp, sums, squares))
            constant = np.full((3, 4), spp * np.float32(scale), np.float32)
            assert farms.possible(Pass(0, spp, constant, constant * np.float32(scale)))
    assert not farms.possible(Pass(0, 7, 3 * sums, squares))
    assert farms.possible(Pass(0, 7, sums))
