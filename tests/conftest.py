"""What all tests share. Tests by chance draw and judge through the fixture `chance`.

Such a test states how often a right program fails it, were its seeds not fixed:

    @pytest.mark.false_alarms(1e-3)
    def test_mean(chance): ...

`make study-calibration` holds it to that, with other seeds and a part of the samples: see
`--other-seeds` and `--reduced`. A test in which few samples hold much of the light says how far
they may be divided, `false_alarms(1e-3, reduced=4)`.
"""

import gc
import math
import zlib

import numpy as np
import pytest

import relume  # noqa: F401  isort: skip  first: it points Dr.Jit at a usable LLVM

from relume.workbench import statistics
from relume.workbench.statistics import Level


@pytest.fixture(autouse=True, scope="module")
def memory():
    """What Dr.Jit keeps of a file's arrays is given back after it: tests share their process."""
    yield
    import drjit as dr

    gc.collect()
    dr.flush_malloc_cache()


@pytest.fixture(autouse=True)
def cameras(monkeypatch):
    """A picture through a camera whose matrix is not finite, which sees nothing, is an error."""
    import mitsuba as mi

    def render(scene, params=None, sensor=0, *args, **options):
        seen_by = scene.sensors()[sensor] if isinstance(sensor, int) else sensor
        matrix = np.array(seen_by.world_transform().matrix)
        assert np.isfinite(matrix).all(), f"the camera has no finite matrix: {matrix.tolist()}"
        return original(scene, params, sensor, *args, **options)

    if mi.variant():
        original = mi.render
        monkeypatch.setattr(mi, "render", render)


def pytest_addoption(parser):
    group = parser.getgroup("calibration")
    group.addoption(
        "--other-seeds", type=int, default=0, help="run each test by chance with N other seeds"
    )
    group.addoption(
        "--reduced", type=int, default=1, help="divide the samples of tests by chance by this"
    )


def pytest_generate_tests(metafunc):
    """Each rerun of a test by chance is a test of its own."""
    reruns = metafunc.config.getoption("other_seeds")
    if reruns and metafunc.definition.get_closest_marker("false_alarms"):
        if "chance" not in metafunc.fixturenames:
            raise pytest.UsageError(f"{metafunc.definition.nodeid} does not draw by chance")
        metafunc.parametrize("chance", range(1, reruns + 1), indirect=True)


class Chance:
    """Seeds, budgets and significance of one test.

    Args:
        rate: how often the test may fail by chance; None for one that judges nothing.
        entropy: integers, from which all seeds follow.
        reduced: divisor of all samples, whose errors grow by its root.

    Attributes:
        p: least p-value of what was judged, all judgements of the test taken together.
    """

    def __init__(self, rate, entropy, reduced=1):
        self.rate, self.reduced, self.p = rate, reduced, None
        self._words = np.random.default_rng(entropy)

    def seed(self):
        """A new 31-bit seed, independent of all others."""
        return int(self._words.integers(2**31))

    def rng(self):
        """A new generator of random numbers."""
        return np.random.default_rng(self.seed())

    def samples(self, count):
        """The number of samples to take where a test wants `count`."""
        return -(-count // self.reduced)

    def runs(self, scene, spp, runs=8, **options):
        """Independent pictures of a scene by `mi.render`: (runs, height, width, channels)."""
        import mitsuba as mi

        spp = self.samples(spp)
        pictures = (mi.render(scene, spp=spp, seed=self.seed(), **options) for _ in range(runs))
        return np.array([np.array(picture, dtype=float) for picture in pictures])

    def judge(self, p, about="", of=1):
        """Fail if a p-value is less than what chance gives in all but `rate` of such tests.

        Args:
            p: p-values.
            about: what to tell on failure.
            of: how often the test calls for a judgement of as many p-values (Šidák).
        """
        assert self.rate is not None, "the test states no rate of false alarms"
        least = float(np.min(p))
        together = 1.0 if least >= 1 else -math.expm1(np.size(p) * of * math.log1p(-least))
        self.p = together if self.p is None else min(self.p, together)
        assert together >= self.rate, (about, f"p = {together:.2g} < {self.rate:g}")

    def scores(self, z, about="", of=1):
        """Judge standard normal scores, two-sided."""
        worst = float(np.abs(z).max())
        p = np.ones(np.shape(z))
        p.flat[0] = math.erfc(worst / math.sqrt(2))
        self.judge(p, (about, f"|z| = {worst:.2f}"), of)

    def rare(self, k, n, p, of=1):
        """Judge whether k of n events are as many as their probability p allows, or fewer."""
        fewer = sum(math.comb(n, i) * p**i * (1 - p) ** (n - i) for i in range(k))
        self.judge(max(1 - fewer, 0), f"{k} of {n}, each of probability {p}", of)

    def count(self, k, n, p, about="", of=1):
        """Judge whether k of n events fit their probability p, in (0, 1), by the binomial law."""
        i = np.arange(n)
        choose = np.concatenate([[0.0], np.cumsum(np.log((n - i) / (i + 1)))])
        i = np.arange(n + 1)
        mass = np.exp(choose + i * math.log(p) + (n - i) * math.log1p(-p))
        tail = min(mass[: k + 1].sum(), mass[k:].sum())
        self.judge(min(2 * tail, 1.0), (about, f"{k} of {n}, each of probability {p:.3g}"), of)

    def equal(self, a, b, allowed=0.0, precision=None, of=1):
        """Judge whether two means are equal, by Welch's t.

        Args:
            a: `Level`, or known values.
            b: likewise; the reference.
            allowed: difference relative to b that is not due to chance.
            precision: upper limit of the standard error relative to b: what gives the test its
                power.
            of: as `judge`.
        """
        a, b = (x if isinstance(x, Level) else known(x) for x in (a, b))
        d = statistics.difference(a, b)
        size = np.abs(np.broadcast_to(b.mean, d.mean.shape))
        error = np.sqrt(d.variance)
        if precision is not None:
            limit = precision * math.sqrt(self.reduced) * size
            assert np.all(error <= limit), (error / size, precision)
        t = np.maximum(np.abs(d.mean) - allowed * size, 0) / np.maximum(error, 1e-30)
        self.scores(statistics.normal_score(t, d.dof), (a.mean, b.mean, error), of)


def known(value):
    """A `Level` without error."""
    value = np.asarray(value, dtype=float)
    return Level(value, np.zeros(value.shape), np.full(value.shape, 1e9))


@pytest.fixture
def level():
    """Function from independent values (runs, ...) to the `Level` of their mean."""

    def of(values):
        values = np.asarray(values, dtype=float)
        n = len(values)
        variance = values.var(axis=0, ddof=1) / n
        return Level(values.mean(axis=0), variance, np.full(variance.shape, n - 1.0))

    return of


@pytest.fixture
def chance(request):
    """The `Chance` of this test."""
    mark = request.node.get_closest_marker("false_alarms")
    rerun = getattr(request, "param", 0)
    entropy = [rerun, zlib.crc32(request.node.nodeid.encode())] if rerun else 0
    reduced = request.config.getoption("reduced")
    most = mark.kwargs.get("reduced", reduced) if mark else reduced
    return Chance(mark and mark.args[0], entropy, min(reduced, most))
