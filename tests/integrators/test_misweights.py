"""Weights from two numbers a subpath against the balance heuristic written out, path by path.

Paths are chains of random densities: what the sums of ratios telescope to is known exactly.
"""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume.integrators import misweights
from relume.integrators.misweights import Subpath

R, KAPPA, NU, LANES = 0.25, 0.5, 0.7, 64


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("llvm_ad_rgb")


class Chain:
    """A path of `edges` edges from lamp (vertex 0) to camera (the last one), of random densities.

    Densities of directions are per solid angle at a vertex, towards the next one (`onwards`, from
    the lamp) or the one before (`back`). Interior vertices in `deltas` cannot be connected.
    """

    def __init__(self, edges, deltas=(), rng=None):
        rng = rng or np.random.default_rng(edges)
        n = edges + 1
        draw = lambda *shape: rng.uniform(0.3, 3, (*shape, LANES))  # noqa: E731
        self.edges, self.deltas = edges, deltas
        self.onwards, self.back, self.d2 = draw(n), draw(n), draw(edges)
        self.cos = rng.uniform(0.2, 1, (n, 2, LANES))  # towards the vertex before, and the next
        self.E, self.emitter_pdf = draw(), draw()  # the latter from vertex 1, per solid angle
        for i in deltas:
            self.back[i] = self.onwards[i]

    def area(self, i, j):
        """Density per area with which vertex i finds its neighbour j."""
        edge, arrives = min(i, j), self.cos[j][0 if i < j else 1]
        pdf = self.onwards[i] if i < j else self.back[i]
        return pdf * arrives / self.d2[edge]

    def density(self, s):
        """Samples times density of the way with s vertices from the lamp; 0 if there is none."""
        n, t = self.edges + 1, self.edges + 1 - s
        if {s - 1, s} & set(self.deltas):
            return np.zeros(LANES)
        p = np.full(LANES, {0: 1, 1: 1}.get(s, R if t == 1 else KAPPA), dtype=float)
        if s == 1:
            p *= self.emitter_pdf * self.cos[0][1] / self.d2[0]
        if s > 1:
            p *= self.E * self.cos[0][1] * self.cos[1][0] / self.d2[0]
            for i in range(1, s - 1):
                p *= self.area(i, i + 1)
        for i in range(n - 1, s, -1):
            p *= self.area(i, i - 1)
        return p

    def merged_density(self, i):
        """Samples times density of merging at vertex i, which both subpaths have found."""
        p = NU * self.E * self.cos[0][1] * self.cos[1][0] / self.d2[0]
        for k in range(1, i):
            p = p * self.area(k, k + 1)
        for k in range(self.edges, i, -1):
            p = p * self.area(k, k - 1)
        return p

    def all_density(self):
        """Sum over all ways."""
        # There is no way t = 0, and none that connects the lamp to the camera (s = t = 1).
        ways = range(self.edges + 1 if self.edges > 1 else 1)
        total = sum(self.density(i) for i in ways)
        return total + sum(self.merged_density(i) for i in merges(self))

    def weight(self, s):
        """The balance heuristic's."""
        return self.density(s) / self.all_density()

    def merged_weight(self, i):
        """That of merging at vertex i."""
        return self.merged_density(i) / self.all_density()

    def light(self, s):
        """Sums of the light subpath at vertex s - 1, s above 1, and its g."""
        f = lambda x: mi.Float(np.asarray(x, np.float32))  # noqa: E731
        ratio = self.E / self.emitter_pdf
        none = mi.Float(0)
        m = Subpath(f(1 / (ratio * self.cos[1][0])), f(1 / self.E / self.cos[1][0]), none)
        for i in range(1, s - 1):
            delta = mi.Bool(i in self.deltas)
            g = mi.Float(1 if i == 1 else KAPPA)
            at = f(self.onwards[i]), f(self.back[i]), f(self.cos[i][1])
            ν = mi.Float(NU if i - 1 in self.deltas else 0)
            m = misweights.scattered(m, g, *at, delta, ν)
            m = misweights.arrived(m, f(self.d2[i]), f(self.cos[i + 1][0]))
        return m, mi.Float(1 if s == 2 else KAPPA)

    def eye(self, s, arrives=True):
        """Sums of the camera's subpath at vertex s, and its g."""
        f = lambda x: mi.Float(np.asarray(x, np.float32))  # noqa: E731
        last = self.edges
        m = Subpath(f(R / self.back[last]), f(np.zeros(LANES)), mi.Float(0))
        for i in range(last - 1, s - 1, -1):
            if i > s or arrives:
                m = misweights.arrived(m, f(self.d2[i]), f(self.cos[i][1]))
            if i > s:
                g = mi.Float(1 if i == last - 1 else KAPPA)
                at = f(self.back[i]), f(self.onwards[i]), f(self.cos[i][0])
                ν = mi.Float(NU if i + 1 in self.deltas else 0)
                m = misweights.scattered(m, g, *at, mi.Bool(i in self.deltas), ν)
        return m, mi.Float(1 if s == last - 1 else KAPPA)

    def found(self, s):
        """The weight as the integrator has it."""
        f = lambda x: mi.Float(np.asarray(x, np.float32))  # noqa: E731
        t = self.edges + 1 - s
        if s == 0:
            m, _ = self.eye(0, arrives=False)
            return misweights.of_hit(m, f(self.emitter_pdf), f(self.E))
        if s == 1:
            m, g = self.eye(1)
            others = misweights.other_ways(m, g, f(self.onwards[1]))
            ratio = f(self.E / self.emitter_pdf * self.cos[1][0])
            return misweights.of_emitter_sample(f(self.back[1] / self.emitter_pdf), ratio, others)
        y, g_y = self.light(s)
        others_y = misweights.other_ways(y, g_y, f(self.back[s - 1]))
        pdf_y = f(self.area(s, s - 1))
        if t == 1:
            return misweights.of_sensor_connection(pdf_y, mi.Float(R), others_y)
        x, g_x = self.eye(s)
        others_x = misweights.other_ways(x, g_x, f(self.onwards[s]))
        pdf_x = f(self.area(s - 1, s))
        return misweights.of_connection(mi.Float(KAPPA), pdf_y, others_y, pdf_x, others_x)

    def found_merged(self, i):
        """The weight of merging at vertex i, as the integrator has it."""
        f = lambda x: mi.Float(np.asarray(x, np.float32))  # noqa: E731
        (y, g_y), (x, g_x) = self.light(i + 1), self.eye(i)
        others = [(y, g_y, self.back[i]), (x, g_x, self.onwards[i])]
        others_y, others_x = (misweights.other_ways(m, g, f(back)) for m, g, back in others)
        return misweights.of_merge(mi.Float(NU), others_y, others_x)


def merges(chain):
    """Where a chain is merged: between deltas."""
    inner = range(2, chain.edges - 1)
    return [i for i in inner if {i - 1, i + 1} <= set(chain.deltas) and i not in chain.deltas]


def ways(chain):
    """The ways that find a chain."""
    ends = [s for s in range(chain.edges + 1) if not {s - 1, s} & set(chain.deltas)]
    return [s for s in ends if s != 1 or chain.edges > 1]


@pytest.mark.parametrize("edges", [2, 3, 4, 6, 9])
def test_weights_are_those_of_the_balance_heuristic(edges):
    """And they sum to 1. An error of 2 % in any density shows: the tolerance is 1e-4."""
    chain = Chain(edges)
    weights = {s: np.array(chain.found(s)) for s in ways(chain)}
    for s, weight in weights.items():
        assert weight == pytest.approx(chain.weight(s), rel=1e-4), s
    assert sum(weights.values()) == pytest.approx(np.ones(LANES), rel=1e-4)


@pytest.mark.parametrize(
    ("edges", "deltas"), [(3, (1,)), (3, (2,)), (5, (2,)), (5, (1, 2)), (6, (3, 4)), (7, (1, 4))]
)
def test_mirrors_and_glass_are_no_ends_of_a_connection(edges, deltas):
    """Densities at delta vertices drop out of the weights of the other ways."""
    chain = Chain(edges, deltas)
    assert len(ways(chain)) < edges
    weights = {s: np.array(chain.found(s)) for s in ways(chain)}
    for s, weight in weights.items():
        assert weight == pytest.approx(chain.weight(s), rel=1e-4), s
    assert sum(weights.values()) == pytest.approx(np.ones(LANES), rel=1e-4)


@pytest.mark.parametrize(
    ("edges", "deltas"),
    [(4, (1, 3)), (5, (1, 3)), (6, (1, 3, 5)), (7, (1, 2, 4)), (8, (2, 3, 5, 7))],
)
def test_weights_with_merging_sum_to_one(edges, deltas):
    """Vertices between deltas, several on one path among them, are ways of their own; an error of
    2 % in what stands for them shows."""
    chain = Chain(edges, deltas)
    weights = {s: np.array(chain.found(s)) for s in ways(chain)}
    merged = {i: np.array(chain.found_merged(i)) for i in merges(chain)}
    assert merged
    for s, weight in weights.items():
        assert weight == pytest.approx(chain.weight(s), rel=1e-4), s
    for i, weight in merged.items():
        assert weight == pytest.approx(chain.merged_weight(i), rel=1e-4), i
    total = sum(weights.values()) + sum(merged.values())
    assert total == pytest.approx(np.ones(LANES), rel=1e-4)


@pytest.mark.parametrize("which", ["pdf", "pdf_back", "cos", "ν"])
def test_an_error_of_two_percent_in_a_density_is_found(which, monkeypatch):
    original = misweights.scattered

    def wrong(subpath, g, pdf, pdf_back, cos, delta, ν):
        values = {"pdf": pdf, "pdf_back": pdf_back, "cos": cos, "ν": ν}
        values[which] = values[which] * 1.02
        return original(subpath, g, delta=delta, **values)

    monkeypatch.setattr(misweights, "scattered", wrong)
    chain = Chain(6, (1, 3, 5) if which == "ν" else ())
    total = sum(np.array(chain.found(s)) for s in ways(chain))
    total = total + sum(np.array(chain.found_merged(i)) for i in merges(chain))
    assert np.abs(total - 1).max() > 1e-3


def test_nothing_to_compare_with_leaves_the_whole_weight():
    """Zero sums: neither NaN nor less than 1."""
    none = Subpath(mi.Float(0), mi.Float(0))
    assert dr.all(misweights.of_hit(none, mi.Float(0), mi.Float(0)) == 1)
    nothing = misweights.of_hit(none, mi.Float(dr.inf), mi.Float(0))
    assert dr.all(dr.isfinite(nothing))
