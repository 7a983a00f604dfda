"""Docstrings of plugin files are manual pages of one grammar, and they say what the plugins do.

A page is a title that ends with the plugin's id, a table of the parameters, prose, and paragraphs
that begin with **Source.**, **Variants.** and **Usage.**, the last with scenes in Python and, for
materials and lights, in XML.
"""

import ast
import functools
import importlib
import inspect
import re
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
from docutils import nodes
from docutils.core import publish_doctree

from relume import plugins

PLUGINS = [(package.__name__, name) for package in plugins.PACKAGES for name in package.PLUGINS]
WITH_XML = ("relume.bsdfs", "relume.emitters")
NESTED = "(nested)"
BY_BASE_CLASS = {"hide_emitters": "hide_emitters", "world_transform": "to_world"}
"""Attributes of Mitsuba's base classes, and the parameters that these read."""

each_plugin = pytest.mark.parametrize(
    ("package", "name"), PLUGINS, ids=[name for _, name in PLUGINS]
)


@pytest.fixture
def page(package, name):
    """The page as a document tree; warnings are errors."""
    text = inspect.getdoc(importlib.import_module(f"{package}.{name}"))
    settings = {"report_level": 2, "halt_level": 2, "syntax_highlight": "none"}
    return publish_doctree(text, settings_overrides=settings)


def parameters(page):
    """Type and description of each parameter in the table of a page, by name."""
    table = next(page.findall(nodes.table))
    rows = [[" ".join(cell.astext().split()) for cell in row] for row in table.findall(nodes.row)]
    assert rows[0] == ["Parameter", "Type", "Description"]
    return {name: tuple(rest) for names, *rest in rows[1:] for name in names.split(", ")}


# ------------------------------ what a constructor reads ------------------------------


@functools.cache
def definitions(module):
    """Functions and classes at the top of a module, and those that it imports from relume.

    Returns:
        From names to syntax trees and the names of the modules that these are in.
    """
    file = importlib.import_module(module).__file__
    found = {}
    for node in ast.parse(Path(file).read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found[node.name] = node, module
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("relume."):
            others = definitions(node.module)
            found |= {a.asname or a.name: others[a.name] for a in node.names if a.name in others}
    return found


def is_props(node):
    return isinstance(node, ast.Name) and node.id == "props"


def strings(nodes):
    return {node.value for node in nodes if isinstance(node, ast.Constant)}


def read_by(node):
    """Names of the parameters that a piece of code reads from `props`."""
    if isinstance(node, ast.Subscript) and is_props(node.value):
        return strings([node.slice])
    if isinstance(node, ast.Attribute) and not is_props(node.value):
        own = isinstance(node.value, ast.Name) and node.attr in BY_BASE_CLASS
        return {BY_BASE_CLASS[node.attr]} if own else set()
    if not isinstance(node, ast.Call):
        return set()
    if isinstance(node.func, ast.Attribute) and is_props(node.func.value):
        if node.func.attr == "objects":
            return {NESTED}
        return strings(node.args[:1]) if node.func.attr.startswith("get") else set()
    if any(is_props(arg) for arg in node.args):  # choice(props, "name", ...) and the like
        return strings(node.args[1:2])
    return set()


def read_parameters(module):
    """Names of the parameters that a plugin reads, in its file and in what that uses."""
    found, seen, waiting = set(), set(), [definitions(module)["define"]]
    while waiting:
        current, home = waiting.pop()
        if current in seen:
            continue
        seen.add(current)
        known = definitions(home)
        for node in ast.walk(current):
            found |= read_by(node)
            if isinstance(node, ast.Name) and node.id in known:
                waiting.append(known[node.id])
    return found


# ------------------------------ the pages ------------------------------


@each_plugin
def test_title_names_the_plugin(page, name):
    title = next(page.findall(nodes.title))
    assert re.fullmatch(rf".+ \({name}\)", title.astext())
    assert isinstance(title.children[-2], nodes.literal)


@each_plugin
def test_table_has_all_parameters(page, package, name):
    """What the constructor reads is in the table, and the other way round."""
    assert set(parameters(page)) == read_parameters(f"{package}.{name}")


@each_plugin
def test_parameters_have_types_and_defaults(page):
    for name, (kind, description) in parameters(page).items():
        assert kind, name
        assert re.search(r"(^|\. )(Required\b|Default: )[^.]*", description), name
        assert description.endswith("."), name


@each_plugin
def test_page_has_source_variants_and_usage(page, package):
    words = [found.astext() for found in page.findall(nodes.strong)]
    wanted = ["Source.", "Variants.", "Usage."]
    if package == "relume.integrators":  # those that only wrap others may have no source
        words = [word for word in words if word in wanted]
    assert words[-3:] == wanted
    languages = [block["classes"][-1] for block in page.findall(nodes.literal_block)]
    assert languages == ["python", "xml"][: 1 + (package in WITH_XML)]


# ------------------------------ what the pages say is so ------------------------------


@pytest.fixture
def scenes(page, tmp_path, monkeypatch):
    """The scenes under **Usage.**, loaded; the files that they name exist."""
    mi.set_variant("llvm_ad_rgb")
    monkeypatch.chdir(tmp_path)
    mi.Bitmap(np.ones((4, 4, 3), np.float32)).write("probe.hdr")
    python, *xml = (block.astext() for block in page.findall(nodes.literal_block))
    loaded = [mi.load_dict(eval(python, {"mi": mi}))]
    return loaded + [mi.load_string(f'<scene version="3.0.0">{text}</scene>') for text in xml]


@each_plugin
def test_usage_loads_and_uses_the_plugin(page, scenes, name):
    for block in page.findall(nodes.literal_block):
        assert re.search(rf"""type['"]?[:=] ?['"]{name}['"]""", block.astext())


def traversed(thing):
    """What `mi.traverse` shows of an object itself, by name, with whether it is differentiable."""

    class Callback(mi.TraversalCallback):
        def __init__(self):
            mi.TraversalCallback.__init__(self)
            self.found = {}

        def put(self, name, value, flags, cpptype=None):
            self.found[name] = value, not int(flags) & int(mi.ParamFlags.NonDifferentiable)

    callback = Callback()
    thing.traverse(callback)
    return callback.found


def instances(thing, module):
    """Objects in a loaded scene whose class a module defines."""
    if type(thing).__module__ == module:
        yield thing
    for child, _ in traversed(thing).values():
        if isinstance(child, mi.Object):
            yield from instances(child, module)


@each_plugin
def test_pages_say_what_is_exposed_and_what_is_differentiable(page, scenes, package, name):
    plugin = next(instances(scenes[0], f"{package}.{name}"))
    shown = {key: flag for key, (_, flag) in traversed(plugin).items()}
    for key, (_, description) in parameters(page).items():
        word = {True: "Differentiable.", False: "Exposed."}.get(shown.get(key), "")
        said = re.findall(r"(?:Differentiable|Exposed)\.", description)
        assert said == ([word] if word else []), key
