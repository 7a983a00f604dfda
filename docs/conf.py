"""How Sphinx makes the site: `make docs`."""

import importlib.metadata
import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

project = "relume"
author = "the relume authors"
copyright = author
release = importlib.metadata.version("relume")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_click",
    "sphinx_copybutton",
    "mathml",
    "plugin_pages",
    "whole_pages",
]
exclude_patterns = ["_ext", "efficiency", "metropolis"]
default_role = "plain-code"

myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3

autodoc_typehints = "description"
autodoc_member_order = "bysource"
python_use_unqualified_type_names = True
copybutton_prompt_text = "$ "
copybutton_only_copy_prompt_lines = True

html_theme = "furo"
html_title = "relume"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_copyright = False


def escape_stars(_app, _context, lines):
    """Patterns such as 'grey ball/*' in the help of an option are no emphasis."""
    lines[:] = [re.sub(r"(?<!\*)\*(?!\*)", r"\\*", line) for line in lines]


def setup(app):
    """Sphinx calls this."""
    app.connect("sphinx-click-process-options", escape_stars)
