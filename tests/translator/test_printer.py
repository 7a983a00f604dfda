"""A document printed as scene text reads back as an equal document.

The strategies draw random documents from the same tables as the parser is made from, so a keyword
that is added is tested without a line here.
"""

import math

import pytest
from hypothesis import HealthCheck, Phase, example, given, settings
from hypothesis import strategies as st

from relume.translator import read, read_text
from relume.translator.diagnostics import SceneError
from relume.translator.document import MAX_SIDE, Document
from relume.translator.forms.coefficients import Coefficients
from relume.translator.forms.names import MaterialName, Name, Names
from relume.translator.forms.numbers import Flag, Integer, Number, NumberOnEitherLine
from relume.translator.forms.phase import MeanCosine
from relume.translator.forms.reflections import (
    DISPERSION,
    REFLECTIONS,
    Reflection,
    ReflectionLines,
)
from relume.translator.forms.transforms import TRANSFORMS, Transform, TransformBlock
from relume.translator.forms.variables import Variables
from relume.translator.forms.ward import Ward
from relume.translator.gravity import BlackHole, WormHole
from relume.translator.keywords import ENVIRONMENT, rows
from relume.translator.materials_table import MATERIALS
from relume.translator.objects import SceneObject
from relume.translator.printer import print_document
from relume.translator.shapes import SHAPES, MeshFile, Sphere
from relume.translator.values import MAX_NUMBER

BALL = Sphere((0.0, 0.0, 0.0), 1.0)

NUMBER = st.floats(-MAX_NUMBER, MAX_NUMBER)
LENGTH = st.floats(1e-6, 1e9)
COORDINATE = st.floats(-1e9, 1e9)
DIRECTION = st.tuples(COORDINATE, COORDINATE, COORDINATE).filter(lambda v: max(map(abs, v)) > 1e-3)
NAME = (
    st.text(st.characters(exclude_categories=("Cs",), exclude_characters="\r\n\0"), max_size=30)
    .map(lambda text: text.strip(" \t"))
    .filter(bool)
)
LETTERS = "ABCXYZabcxyz"
VARIABLES = st.dictionaries(
    st.builds("".join, st.tuples(st.sampled_from(LETTERS), st.text(LETTERS + "0189", max_size=5))),
    NUMBER,
    max_size=3,
)


def one_number(row):
    """A number in the range of a row."""
    if isinstance(row.form, Flag):
        return st.booleans()
    if isinstance(row.form, Integer):
        low = int(max(row.low, -(2**40)))
        return st.integers(low, int(min(row.high, 2**40)))
    return st.floats(
        max(row.above, row.low, -MAX_NUMBER),
        min(row.high, row.under, MAX_NUMBER),
        exclude_min=row.above >= max(row.low, -MAX_NUMBER),
        exclude_max=row.under <= min(row.high, MAX_NUMBER),
    )


def numbers(row):
    """As many numbers as a row says."""
    return one_number(row) if row.arity == 1 else st.tuples(*[one_number(row)] * row.arity)


VALUES = {
    **dict.fromkeys([Number, NumberOnEitherLine, Integer, Flag, Coefficients, MeanCosine], numbers),
    Name: lambda row: NAME,
    Names: lambda row: st.lists(NAME, max_size=3),
    MaterialName: lambda row: st.sampled_from(sorted(MATERIALS)),
    Variables: lambda row: VARIABLES,
    TransformBlock: lambda row: st.lists(transforms(), max_size=3),
    ReflectionLines: lambda row: reflections(),
    Ward: lambda row: st.tuples(one_number(row), one_number(row), LENGTH, LENGTH),
}
"""The values that a keyword of each form may hold; of any other form its default alone is tried."""


def value_of(row):
    """A value that a row's keyword may hold."""
    strategy = VALUES.get(type(row.form))
    return strategy(row) if strategy else st.just(row.default)


def transforms():
    """One line of a matrix definition."""
    values = st.tuples(LENGTH, LENGTH, LENGTH)
    return st.builds(Transform, st.sampled_from(sorted(TRANSFORMS)), values)


@st.composite
def reflections(draw):
    """What any order of `reflection` lines can add up to."""
    model = draw(st.sampled_from([None, *REFLECTIONS]))
    if model in (None, "Subsurface_Scattering"):
        return Reflection(subsurface=model is not None)
    dispersion = DISPERSION.get(model)
    six = draw(st.tuples(*[NUMBER] * 6)) if dispersion in ("cauchy6", "sellmeier3") else ()
    return Reflection(REFLECTIONS[model][0], draw(st.booleans()), dispersion, six)


@st.composite
def shapes(draw):
    """A shape within the checks."""
    row = draw(st.sampled_from(list(SHAPES.values())))
    if row.name == "uvplane":
        corner = draw(st.tuples(COORDINATE, COORDINATE, COORDINATE))
        edge = (draw(st.floats(-1e3, 1e3)), draw(st.floats(1e-3, 1e9)), 0.0)
        return row.build(corner, (draw(LENGTH), 0.0, 0.0), edge)
    if row.arity == 0:
        return row.build(draw(NAME))
    if row.name == "infinity_light":
        return row.build(draw(DIRECTION))
    numbers = draw(st.tuples(*[COORDINATE] * 3))
    if row.arity > 3:
        radius = draw(LENGTH)
        numbers += (radius, radius * draw(st.floats(0, 0.99)))[: row.arity - 3]
    return row.build(numbers, *[draw(DIRECTION) for _ in row.vectors])


@st.composite
def filled(draw, make, share=0.3):
    """A target whose fields are drawn from the ranges of their rows, each with a probability."""
    target = make()
    for row in rows(type(target)):
        if row.place != ENVIRONMENT and draw(st.floats(0, 1)) < share:
            setattr(target, row.field, draw(value_of(row)))
    return target


@st.composite
def objects(draw):
    """An `OBJECT` block within the checks."""
    block = draw(filled(SceneObject))
    block.shape = draw(shapes())
    block.transforms = draw(st.lists(transforms(), max_size=2))
    if block.reflection.kind in ("diffuse", "specular") and block.roughness is None:
        block.roughness = 1.0 if block.reflection.kind == "diffuse" else 0.0
    w = draw(st.floats(1e-3, 90))
    block.spot_light_angle = (w, w * draw(st.floats(0, 1)))
    block.spot_light_dir = draw(DIRECTION)
    return block


@st.composite
def gravity(draw):
    """A block outside the manual."""
    block = draw(filled(draw(st.sampled_from([BlackHole, WormHole]))))
    if isinstance(block, BlackHole):
        block.position = draw(st.none() | st.tuples(NUMBER, NUMBER, NUMBER))
    elif block.entrance and block.exit and math.dist(block.entrance, block.exit) <= 2 * block.rho:
        block.exit = None  # mouths that meet are an error
    return block


@st.composite
def documents(draw):
    """A document within the checks."""
    document = draw(filled(Document, 0.2))
    document.image = (draw(st.integers(1, MAX_SIDE)), draw(st.integers(1, 4096)))
    document.sampling = draw(st.integers(1, 2**20))
    document.supersampling = draw(st.integers(1, 2**10))
    document.mutation = min(document.mutation, 2.0**20)
    distance, opening = draw(LENGTH), st.floats(1e-3, 1e2)
    document.screen = (draw(opening) * distance, draw(opening) * distance, distance)
    document.camera_pos = draw(st.tuples(COORDINATE, COORDINATE, COORDINATE))
    x, y, z = document.camera_pos
    document.camera_dir = (0.5, draw(st.floats(-1e6, 1e6)), -1.0)
    document.camera_upvec = (0.0, draw(LENGTH), 0.0)
    document.target_pos = draw(st.sampled_from([None, (x + 1, y + 10, z - 1)]))
    document.objects = draw(st.lists(objects(), max_size=3))
    document.gravity = draw(st.lists(gravity(), max_size=2))
    return document


@settings(
    max_examples=150,
    derandomize=True,
    deadline=None,
    phases=[Phase.explicit, Phase.generate, Phase.shrink],
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
@given(documents())
@example(Document())
def test_text_reads_back_as_an_equal_document(document):
    """Text to document undoes document to text, and the text of an equal document is the same."""
    text = print_document(document)
    again = read_text(text, environ={})
    assert again == document
    assert print_document(again) == text


def test_scenes_read_back_equal(scene_file):
    """The same for files that people wrote, in which fields are set in many ways."""
    try:
        document = read(scene_file, environ={})
    except SceneError:
        pytest.skip("the file has errors")
    assert read_text(print_document(document), environ={}) == document


def test_defaults_are_left_out():
    """An empty document needs no lines, a plain object those of its shape and what differs."""
    assert print_document(Document()).strip() == ""
    block = SceneObject(Sphere((0.0, 1.0, 0.5), 2.0), color=(0.5, 0.0, 0.0))
    assert print_document(Document(objects=[block])) == "OBJECT\nsphere 0 1 0.5 2\ncolor 0.5 0 0\n"


def test_numbers_are_exact():
    """Numbers keep all their digits, from the smallest to the largest that the language has."""
    values = (5e-324, 0.1 + 0.2, -1e30)
    again = read_text(print_document(Document(camera_pos=values)), environ={})
    assert again.camera_pos == values


@pytest.mark.parametrize(
    "change",
    [
        {"camera_pos": (0.0, math.nan, 0.0)},
        {"sensor_response": math.inf},
        {"output": ""},
        {"output": "a\nIMAGE"},
        {"output": "a.bmp "},
        {"background_texture": "a\0b"},
        {"objects": [SceneObject(None)]},
        {"objects": [SceneObject(MeshFile("\r"))]},
        {"objects": [SceneObject(BALL, reflection=Reflection("velvet"))]},
        {"objects": [SceneObject(BALL, reflection=Reflection("glass", dispersion="cauchy6"))]},
    ],
    ids=repr,
)
def test_what_no_file_can_hold_is_refused(change):
    """A value without words in the language raises; it is never printed as something else."""
    with pytest.raises(ValueError, match=r"scene file|language"):
        print_document(Document(**change))


def test_a_name_that_looks_like_a_comment():
    """A file name that starts with '#' stays a name, below its keyword and beside it."""
    document = Document(output="#1.bmp", background_texture="#sky.bmp")
    assert read_text(print_document(document), environ={}) == document
