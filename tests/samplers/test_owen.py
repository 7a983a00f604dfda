"""The sampler `owen`: uniform numbers, nets in every pixel, one sequence for all passes."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

SPP, PIXELS = 64, 50
COUNTS = (2, 1, 1, 2, 2, 1, 2, 1, 2, 2, 2, 2)
"""Numbers drawn at once, past the 16 dimensions."""


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("llvm_ad_rgb")


def owen(spp=SPP, **parameters):
    return mi.load_dict({"type": "owen", "sample_count": spp} | parameters)


def seeded(seed=0, spp=SPP, pixels=PIXELS, base=0):
    sampler = owen(spp, seed=base)
    sampler.seed(seed, spp * pixels)
    return sampler


def drawn(sampler, counts=COUNTS, spp=SPP):
    """(pixels, spp, numbers)."""
    found = []
    for count in counts:
        numbers = sampler.next_2d() if count == 2 else [sampler.next_1d()]
        found += [np.array(x) for x in numbers]
    return np.stack(found, axis=-1).reshape(-1, spp, len(found))


def test_numbers_are_in_strata_in_every_pixel():
    """Each number alone has one of 64 values in each interval of 1/64, whatever was drawn before;
    two drawn at once have one in each box of 1/8 by 1/8."""
    numbers = drawn(seeded())
    assert numbers.min() >= 0 and numbers.max() < 1
    strata = np.sort((numbers * SPP).astype(int), axis=1)
    assert (strata == np.arange(SPP)[:, None]).all()
    first = 0
    for count in COUNTS:
        if count == 2:
            x, y = np.moveaxis((numbers[..., first : first + 2] * 8).astype(int), -1, 0)
            assert (np.sort(8 * x + y, axis=1) == np.arange(SPP)).all()
        first += count


@pytest.mark.false_alarms(1e-3)
def test_every_number_is_uniform_and_independent_of_other_pixels(chance):
    """Of one point in 20 000 pixels: 64 bins of each number, and correlations between neighbours
    and between numbers, which have the standard error 1/sqrt(20000); 2 % of it would be found in
    a mean with the standard error 0.29 / sqrt(20000) = 0.002."""
    pixels = 20000
    numbers = drawn(seeded(chance.seed(), 4, pixels), spp=4)
    for point in (0, 3):
        x = numbers[:, point]
        counts = np.stack([np.histogram(column, 64, (0, 1))[0] for column in x.T])
        expected = pixels / 64
        chi2 = ((counts - expected) ** 2 / expected).sum(axis=1)
        chance.scores((chi2 - 63) / np.sqrt(2 * 63) / 1.3, of=4)  # 1.3 for the skewness
        normal = (x - 0.5) * np.sqrt(12)
        cross = normal.T @ normal / np.sqrt(pixels)
        after = normal[1:].T @ normal[:-1] / np.sqrt(pixels)
        off = cross[~np.eye(len(cross), dtype=bool)]
        chance.scores(np.concatenate([off, after.ravel()]), of=2)


@pytest.mark.false_alarms(1e-3)
def test_no_mean_is_biased_and_the_variance_falls_faster(chance, level):
    """The integral of a smooth function and of an edge over four numbers, in 400 pixels."""
    numbers = drawn(seeded(chance.seed(), SPP, 400), (2, 1, 1))
    values = np.exp(numbers.sum(axis=-1)) / (np.e - 1) ** 4
    edges = (numbers.sum(axis=-1) < 2) * 2.0
    for found, gain in ((values, 20), (edges, 1.5)):
        means = found.mean(axis=1)
        chance.equal(level(means), 1.0, precision=0.005, of=2)
        assert found.var() / SPP / means.var() > gain


def test_dimensions_16_apart_are_not_the_same_points():
    """Of 64 boxes of 1/8 by 1/8 as many have a point as of independent numbers, 64 (1 - 1/e) = 40;
    in the same order there are 8."""
    numbers = (drawn(seeded(), (2,) * 9) * 8).astype(int)
    for first in (0, 1):
        boxes = 8 * numbers[..., first] + numbers[..., 16 + first]
        assert np.mean([len(set(pixel)) for pixel in boxes]) > 32


def test_passes_go_on_with_the_sequences():
    """Points 0 ... 15 and 16 ... 63 of `start`, `advance` and `seed` are the same numbers."""
    whole = drawn(seeded(7))
    pixel, point = np.divmod(np.arange(PIXELS * 48), 48)
    sampler = owen()
    sampler.start(mi.UInt32(pixel), mi.UInt32(16 + point), 7)
    assert np.array_equal(drawn(sampler, spp=48), whole[:, 16:])
    sampler = seeded(7, 16)
    first = drawn(sampler, spp=16)
    sampler.advance()
    assert np.array_equal(first, whole[:, :16])
    assert np.array_equal(drawn(sampler, spp=16), whole[:, 16:32])


def test_clones_go_on_and_forks_begin():
    sampler = seeded(3, base=5)
    drawn(sampler, (2, 1))
    clone, fork = sampler.clone(), sampler.fork()
    expected = drawn(sampler)
    assert np.array_equal(drawn(clone), expected)
    fork.seed(3, SPP * PIXELS)
    assert np.array_equal(drawn(fork), drawn(seeded(3, base=5)))


def test_seeds_give_sequences_of_their_own():
    different = [seeded(1), seeded(2), seeded(1, base=1), seeded(2, base=1)]
    numbers = [drawn(sampler, (2,)) for sampler in different]
    assert not any(np.isclose(a, b).all() for a in numbers for b in numbers if a is not b)


def test_the_next_65536_points_are_another_sequence():
    sampler = owen()
    lane = dr.arange(mi.UInt32, 2 * SPP)
    sampler.start(mi.UInt32(0), dr.select(lane < SPP, lane, lane - SPP + 2**16), 0)
    first, later = drawn(sampler)
    assert np.abs(first - later).max(axis=0).min() > 0.1
    assert (np.sort((later * SPP).astype(int), axis=0) == np.arange(SPP)[:, None]).all()


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("integrator", ["path", "prb", "volpath", "ptracer", "surfacepath"])
def test_stock_integrators_draw_from_it(integrator, chance, level):
    """In their own loops, over the first 16 numbers and more: pictures have the mean of those by
    independent numbers, and less noise where paths begin at the camera."""
    d = mi.cornell_box()
    d["integrator"] = {"type": integrator, "max_depth": 4}
    d["sensor"]["film"] |= {"width": 16, "height": 16}
    pictures = []
    for kind in ("owen", "independent"):
        d["sensor"]["sampler"] = {"type": kind, "sample_count": SPP}
        pictures.append(chance.runs(mi.load_dict(d), SPP, 8))
    ours, theirs = (level(runs.mean(axis=(1, 2, 3))) for runs in pictures)
    chance.equal(ours, theirs, precision=0.02)
    if integrator != "ptracer":
        noise = [runs.var(axis=0, ddof=1).mean() for runs in pictures]
        assert noise[0] < 0.8 * noise[1]


def test_another_seed_compiles_no_kernel():
    d = mi.cornell_box()
    d["sensor"]["film"] |= {"width": 8, "height": 8}
    d["sensor"]["sampler"] = {"type": "owen", "sample_count": 4}
    scene = mi.load_dict(d)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
        for seed in (1, 2):
            dr.kernel_history_clear()
            dr.eval(mi.render(scene, spp=4, seed=seed))
            history = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
    assert all(k["cache_hit"] and not k["cache_disk"] for k in history)


@pytest.mark.parametrize("wrong", [{"sample_count": 0}, {"seed": -1}])
def test_ranges(wrong):
    with pytest.raises(RuntimeError, match=f"{next(iter(wrong))} is "):
        mi.load_dict({"type": "owen"} | wrong)
