"""A page for each Mitsuba plugin, made from the docstring of its module, and links to these pages.

The docstrings are reStructuredText. Their first line is what the plugin is and, in brackets and
backticks, its name, which is that of the module. In any page, the first literal that is the name of
a plugin becomes a link to its page.
"""

import ast
import functools
import re
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from docutils import nodes

KINDS = {
    "bsdfs": "Materials",
    "emitters": "Lights",
    "integrators": "Integrators",
    "phasefunctions": "Phase functions",
    "samplers": "Samplers",
    "sensors": "Cameras",
    "textures": "Textures",
}
"""Packages of plugins in the order of the pages, with their captions."""

TITLE = re.compile(r"(.+) \(`+(\w+)`+\)\n=+\n(.*)", re.DOTALL)

HEADER = """\
Plugins
=======

After ``import relume`` these plugins work in any Mitsuba scene, from dictionaries and from XML. The
tutorial :doc:`/tutorials/mitsuba` shows some of them at work.

"""


class Plugin(NamedTuple):
    """A plugin: its package, what it is in a few words, and its manual."""

    kind: str
    title: str
    manual: str


@functools.cache
def plugins():
    """The plugins by their name."""
    found = {}
    for kind in KINDS:
        for folder in find_spec(f"relume.{kind}").submodule_search_locations:
            for file in sorted(Path(folder).glob("*.py")):
                module = ast.parse(file.read_text(encoding="utf-8"))
                text = TITLE.match(ast.get_docstring(module) or "")
                if text and text[2] == file.stem:
                    found[file.stem] = Plugin(kind, text[1], text[3].strip())
    return found


def page(name, plugin):
    """The text of the page of a plugin."""
    source = f"*Source file:* ``{plugin.kind}/{name}.py``"
    rule = "=" * (len(name) + 4)
    return f"``{name}``\n{rule}\n\n**{plugin.title}**\n\n{plugin.manual}\n\n{source}\n"


def index(found):
    """The text of the page that lists all plugins."""
    parts = [HEADER]
    for kind, caption in KINDS.items():
        names = [name for name in found if found[name].kind == kind]
        rows = [f"   * - :doc:`{name}`\n     - {found[name].title}\n" for name in names]
        pages = [f"   {name}\n" for name in names]
        parts += [f"{caption}\n{'-' * len(caption)}\n\n"]
        parts += [".. list-table::\n   :widths: 25 75\n\n", *rows]
        parts += ["\n.. toctree::\n   :hidden:\n\n", *pages, "\n"]
    return "".join(parts)


def write_pages(app):
    """Write the pages into `plugins/`, but leave those alone that are as they should be."""
    folder = Path(app.srcdir) / "plugins"
    folder.mkdir(exist_ok=True)
    found = plugins()
    pages = {name: page(name, plugin) for name, plugin in found.items()} | {"index": index(found)}
    for old in folder.glob("*.rst"):
        if old.stem not in pages:
            old.unlink()
    for name, text in pages.items():
        file = folder / f"{name}.rst"
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")


def code_role(_name, rawtext, text, *_):
    """What single backticks mean in docstrings of the API: code."""
    return [nodes.literal(rawtext, text)], []


def link_plugins(app, doctree, docname):
    """Link the first literal of a page that is the name of a plugin to the page of that plugin."""
    names = set(plugins()) - {docname.removeprefix("plugins/")}
    for literal in list(doctree.findall(nodes.literal)):
        name = literal.astext()
        if name not in names or isinstance(literal.parent, nodes.reference | nodes.title):
            continue
        names.remove(name)
        uri = app.builder.get_relative_uri(docname, f"plugins/{name}")
        link = nodes.reference("", "", internal=True, refuri=uri)
        literal.replace_self(link)
        link += literal


def setup(app):
    """Write the pages before the sources are read."""
    app.add_role("plain-code", code_role)
    app.connect("builder-inited", write_pages)
    app.connect("doctree-resolved", link_plugins)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
