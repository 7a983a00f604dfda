"""Exposure and tone curves."""

import math

import numpy as np
import pytest

from relume import output, tone
from relume.tone import Look


def grey(*values):
    """A picture of a row of grey pixels."""
    return np.array(values, np.float32)[None, :, None].repeat(3, axis=2)


def test_the_plain_look_is_the_legacy_encoding():
    """Bit for bit: what scenes without a wish got before there was one."""
    image = np.random.default_rng(0).random((6, 8, 3), np.float32) * 2
    assert tone.AS_IT_IS.applied(image) is image


@pytest.mark.parametrize("stops, factor", [(1, 2), (-2, 0.25), (0.5, 2**0.5)])
def test_an_exposure_is_a_factor_of_2_a_stop(stops, factor):
    image = grey(0.1, 0.3)
    assert Look(stops).applied(image) == pytest.approx(factor * image, rel=1e-6)


@pytest.mark.parametrize("scale", [1e-6, 1, 1e5])
def test_auto_finds_the_exposure_of_any_scale(scale):
    """A grey card of 18 % comes out as 18 %; a black or dim surround does not count."""
    image = grey(0.18, 0.18, 0.18, 0, 0, 0, 1e-6, 1e-6, 1e-6) * scale
    assert Look("auto").applied(image)[0, 0, 0] == pytest.approx(0.18, rel=1e-3)


@pytest.mark.parametrize(
    "color, Y", [((1, 0, 0), 0.2126), ((0, 1, 0), 0.7152), ((0, 0, 1), 0.0722)]
)
def test_auto_weighs_colours_by_luminance(color, Y):
    """Those of Rec. 709."""
    assert tone.auto_exposure(np.array([[color]], float)) == pytest.approx(math.log2(0.18 / Y))


def test_auto_leaves_black_alone():
    assert tone.auto_exposure(np.zeros((2, 2, 3))) == 0


@pytest.mark.parametrize("name", tone.TONE_MAPS)
def test_curves_rise_from_black_to_white(name):
    x = np.concatenate([[0], np.geomspace(1e-4, 1e4, 200), [3e38]])
    y = tone.TONE_MAPS[name](grey(*x).astype(float))[0]
    assert np.ptp(y, axis=1).max() < 2e-3, "grey stays grey"
    assert (np.diff(y[:, 0]) > -1e-3).all() and y.min() >= 0 and y.max() <= 1
    assert y[0, 0] < 1e-3 and y[-1, 0] > 0.95


@pytest.mark.parametrize(
    "name, x, y",
    [
        ("linear", 0.5, 0.5),
        # By hand from the formulas of the sources.
        ("aces", 0.01, 0.01 * (0.0251 + 0.03) / (0.01 * (0.0243 + 0.59) + 0.14)),
        ("aces", 1.0, (2.51 + 0.03) / (2.43 + 0.59 + 0.14)),
        ("filmic", 0.01, (0.00506 / 0.07006 - 1 / 15) / (19.38 / 24.476 - 1 / 15)),
        ("filmic", 1.0, (0.704 / 1.66 - 1 / 15) / (19.38 / 24.476 - 1 / 15)),
    ],
)
def test_curves_at_a_value_worked_out_by_hand(name, x, y):
    assert tone.TONE_MAPS[name](grey(x).astype(float))[0, 0, 0] == pytest.approx(y, rel=1e-5)


def test_agx_at_middle_grey():
    """The value that was worked out by hand has four digits."""
    assert tone.agx(grey(0.18).astype(float))[0, 0, 0] == pytest.approx(0.2156, abs=2e-3)


@pytest.mark.parametrize("name", ["linear", "filmic", "aces", "agx"])
def test_bright_colours_stay_in_range(name):
    image = np.array([[[1e30, 0, 0], [0, 50, 1e5], [3e38, 3e38, 0]]], float)
    found = tone.TONE_MAPS[name](image)
    assert np.isfinite(found).all() and found.min() >= 0 and found.max() <= 1


def test_agx_takes_bright_red_towards_white():
    red = np.array([[[100.0, 0, 0]]])
    assert tone.agx(red)[0, 0, 1] > 0.3 and tone.linear(red)[0, 0, 1] == 0


@pytest.mark.parametrize(
    "value, said",
    [(0.0005, "nearly black"), (0.05, ""), (0.9, ""), (400, "burnt out, 100 % of it white")],
)
def test_pictures_that_show_little_are_told(value, said):
    image = grey(*[value] * 20)
    found = tone.advice(image, output.encode_display(image))
    assert found.startswith(said) and bool(found) == bool(said)
    if said:
        exposed = Look(float(found.split("--exposure ")[1].split()[0])).applied(image)
        assert not tone.advice(exposed, output.encode_display(exposed))


def test_an_exposure_that_would_not_show_a_picture_is_not_told():
    """Two bright pixels in the dark: less light would make it no brighter."""
    image = grey(*[0.0] * 398, 9, 9)
    assert not tone.advice(image, output.encode_display(image))


def test_burnt_out_is_what_is_mostly_white():
    """Three of five pixels, and all of their channels: a red lamp is a colour."""
    for image, said in (
        (grey(4, 4, 4, 0.2, 0.2), "burnt out, 60 % of it white"),
        (grey(4, 4, 0.2, 0.2, 0.2), ""),
        (grey(4, 4, 4, 4, 4) * np.array([1, 0.1, 0.1]), ""),
    ):
        found = tone.advice(image, output.encode_display(image))
        assert found.startswith(said) and bool(found) == bool(said)
