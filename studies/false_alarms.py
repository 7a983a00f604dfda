"""How often each test by chance raises a false alarm, were its seeds not fixed.

    python -m studies false-alarms [--reruns 200] [--reduced 16] [-- pytest's arguments]
    python -m studies false-alarms --compare [--reruns 200] [SCENE ...]

The first form reruns every test that states a rate (`false_alarms`), each time with other seeds,
and a random one of its parameter sets. Samples are divided by `--reduced`: standard errors grow by
the root of that, limits of the standard error with them, so that a test's statistic keeps its law.
What a test grants beside chance is not enlarged, which makes a rerun stricter than the test. The
second form compares scenes with themselves by the statistics of `relume compare`: each comparison
draws its 2 x 32 renders from a pool of 1280, so that any two comparisons share few.
"""

import math
import random
from collections import defaultdict

import numpy as np
import pytest

import relume
from relume import translator
from relume.loading import open_session, resized
from relume.session import Session
from relume.workbench import estimates, statistics
from relume.workbench.comparing import RUNS
from relume.workbench.comparison import FALSE_ALARMS
from studies import ROOT, SCENES
from studies.calibration_page import merge

COMPARED = ("cornell", "glass", "spot", "ward")
SIZE, SPP, POOL = (32, 24), 2, 1280


class AlarmCounts:
    """Counts of one test function.

    Args:
        rate: of false alarms that it states.
        reduced: divisor of its samples.

    Attributes:
        p: the p-values of those reruns that have one.
    """

    def __init__(self, rate, reduced=1):
        self.rate, self.reduced = rate, reduced
        self.reruns, self.alarms, self.p = 0, 0, []

    def row(self, name):
        """The table's row, by the binomial law; 5 % of all p-values ought to be below 0.05."""
        small = sum(p < 0.05 for p in self.p)
        kept = at_least(self.alarms, self.reruns, self.rate) > 0.005
        kept &= at_least(small, len(self.p), 0.05) > 0.001
        return {
            "test": name,
            "states": f"{self.rate:g}",
            "reruns": str(self.reruns),
            "samples": f"1/{self.reduced}" if self.reduced > 1 else "all",
            "alarms": str(self.alarms),
            "at most (95 %)": f"{upper_limit(self.alarms, self.reruns):.1%}",
            "p < 0.05": f"{small / len(self.p):.1%}" if self.p else "",
            "verdict": "kept" if kept else "broken",
        }


def at_least(k, n, p):
    """Probability of k or more of n, by the binomial law."""
    return 1 - sum(math.comb(n, i) * p**i * (1 - p) ** (n - i) for i in range(k))


def upper_limit(k, n):
    """Clopper and Pearson's upper 95 % limit of a rate of which k of n were seen."""
    low, high = k / n, 1.0
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if 1 - at_least(k + 1, n, middle) > 0.05 else (low, middle)
    return high


class Reruns:
    """Pytest plugin: thins the reruns out to `count` of each test function and counts alarms."""

    def __init__(self, count):
        self.count, self.counts = count, {}

    def pytest_collection_modifyitems(self, config, items):
        groups = defaultdict(list)
        for item in items:
            if item.get_closest_marker("false_alarms"):
                groups[name_of(item)].append(item)
        draw = random.Random(1)
        items[:] = [
            item
            for group in groups.values()
            for item in draw.sample(group, min(self.count, len(group)))
        ]

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item, call):
        report = yield
        if report.when == "call" and not report.skipped:
            chance = item.funcargs["chance"]
            new = AlarmCounts(chance.rate, chance.reduced)
            counts = self.counts.setdefault(name_of(item), new)
            counts.reruns += 1
            counts.alarms += report.failed
            if chance.p is not None:
                counts.p.append(chance.p)
        return report


def name_of(item):
    """`folder/file::function`, without the parameters."""
    return f"{item.path.relative_to(ROOT / 'tests')}::{item.originalname}"


def rerun_tests(count, reduced, arguments):
    """`AlarmCounts` by name of the tests that `arguments` select."""
    plugin = Reruns(count)
    options = [f"--other-seeds={count}", f"--reduced={reduced}", "--tb=line", "-q"]
    pytest.main([*options, *(arguments or [str(ROOT / "tests")])], plugins=[plugin])
    return plugin.counts


def compare_with_self(scene, count):
    """`AlarmCounts` of the verdict of `relume compare` between a method and itself."""
    counts, rng, pool = AlarmCounts(FALSE_ALARMS), np.random.default_rng(1), []
    document = resized(relume.read(SCENES / f"{scene}.txt"), SIZE, SPP * RUNS)
    with open_session(translator.translate(document)) as session:
        for seed in range(POOL):
            session = Session(session.scene, SPP, seed)
            for _ in session.run():
                pass
            pool.append(session.image())
    for _ in range(count):
        drawn = rng.permutation(POOL)
        sides = (estimate(pool[k] for k in drawn[i : i + RUNS]) for i in (0, RUNS))
        scores = statistics.all_levels(*sides, FALSE_ALARMS)
        counts.reruns += 1
        counts.alarms += any(level.differ for level in scores.values())
    return counts


def estimate(pictures):
    """The `estimates.Estimate` of some pictures."""
    runs = estimates.Runs()
    for picture in pictures:
        runs.add(picture)
    return runs.estimate()


def add_arguments(parser):
    parser.add_argument("--reruns", type=int, default=200)
    parser.add_argument("--reduced", type=int, default=16)
    parser.add_argument("--compare", action="store_true")
    parser.add_argument("rest", nargs="*", help="scenes, or pytest's arguments")


def run(options):
    if options.compare:
        names = options.rest or COMPARED
        found = {
            f"relume compare, {name} with itself": compare_with_self(name, options.reruns)
            for name in names
        }
    else:
        found = rerun_tests(options.reruns, options.reduced, options.rest)
    rows = [counts.row(name) for name, counts in found.items()]
    merge("false_alarms", rows, lambda row: (not row["test"].startswith("relume"), row["test"]))
    broken = [row["test"] for row in rows if row["verdict"] == "broken"]
    return f"broken: {', '.join(broken)}" if broken else 0
