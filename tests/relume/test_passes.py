"""Sets of passes and plans: counted against plain Python sets."""

import random

import pytest

from relume.passes import PassPlan, PassSet


def some(seed, size=30):
    """A random set, as `PassSet` and as a dictionary of samples by index."""
    choose = random.Random(seed)
    plain = {i: choose.choice([2, 2, 3]) for i in range(size) if choose.random() < 0.6}
    runs = [(i, i + 1, spp) for i, spp in plain.items()]
    choose.shuffle(runs)
    return PassSet(runs), plain


@pytest.mark.parametrize("seed", range(20))
def test_sets_agree_with_dictionaries(seed):
    passes, plain = some(seed)
    other, plain_other = some(seed + 100)
    assert dict(passes) == plain and len(passes) == len(plain)
    assert passes.spp == sum(plain.values())
    assert all((i in passes) == (i in plain) for i in range(32))
    assert PassSet.parse(str(passes)) == passes
    assert dict(passes.between(5, 20)) == {i: n for i, n in plain.items() if 5 <= i < 20}
    assert dict(passes.without(other)) == {i: n for i, n in plain.items() if i not in plain_other}
    assert dict(passes.union(other.without(passes))) == plain_other | plain
    free = [i for start, stop in passes.gaps(12) for i in range(start, stop)]
    assert free == [i for i in range(100) if i not in plain][:12]


def test_no_pass_is_taken_twice():
    passes = PassSet([(0, 4, 2), (6, 8, 2)])
    for again in ((3, 4, 2), (7, 9, 2), (0, 1, 5)):
        with pytest.raises(ValueError, match=f"pass {max(again[0], 0)} is there twice"):
            passes.union(PassSet([again]))


def test_ranges_are_for_readers():
    assert PassSet([(0, 10, 4), (10, 11, 1), (12, 13, 4)]).ranges() == "0:11, 12:13"
    assert PassSet().ranges() == ""


@pytest.mark.parametrize("text", ["0:3", "3", "0:2x0", "0:2x2 1:3x2", "-1:2x2", "0:2x2;"])
def test_what_is_no_set_is_refused(text):
    with pytest.raises(ValueError):
        PassSet.parse(text)


@pytest.mark.parametrize("spp, per_pass", [(1, 1), (3, 4), (4, 4), (11, 4), (12, 4), (7, 1)])
def test_a_plan_is_finished_from_any_part_of_it(spp, per_pass):
    plan = PassPlan(spp, per_pass)
    whole = plan.passes()
    assert whole.spp == spp and [n for _, n in whole][:-1] == [per_pass] * (len(whole) - 1)
    for seed in range(8):
        choose = random.Random(seed)
        done = PassSet([(i, i + 1, n) for i, n in whole if choose.random() < 0.5])
        assert done.union(plan.to_do(done)) == whole


def test_a_finished_plan_is_extended_with_new_passes():
    done = PassPlan(11, 4).passes()
    assert str(PassPlan(20, 4).to_do(done)) == "3:5x4 5:6x1"
    assert len(PassPlan(8, 4).to_do(done)) == 0


def test_passes_are_as_large_as_memory_allows():
    assert PassPlan.of(64, 64, 1000) == PassPlan(1000, 256)
    assert PassPlan.of(4000, 3000, 10**8) == PassPlan(10**8, 1)
    assert PassPlan.of(4000, 3000, 100, per_pass=7) == PassPlan(100, 7)
