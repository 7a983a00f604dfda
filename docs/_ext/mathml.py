"""Formulas as MathML, which browsers draw themselves: pages need neither a network nor LaTeX."""

import re

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.util import logging

logger = logging.getLogger(__name__)

SHORT_FRACTION = re.compile(r"\\([td]?frac) ?(\d) ?(\d)")
"""A fraction of two digits without braces, which docutils takes for the number that they make."""


def mathml(node, as_block):
    """The MathML of a formula; what is not understood is a warning."""
    text = SHORT_FRACTION.sub(r"\\\1{\2}{\3}", node.astext())
    try:
        return tex2mathml(text, as_block)
    except MathError as error:
        logger.warning("formula '%s': %s", text, error, location=node)
        return ""


def inline(translator, node):
    """An inline formula."""
    translator.body.append(mathml(node, as_block=False))
    raise nodes.SkipNode


def block(translator, node):
    """A displayed formula."""
    translator.body.append(f'<div class="math">{mathml(node, as_block=True)}</div>\n')
    raise nodes.SkipNode


def setup(app):
    """Register the renderer `mathml`; the pages choose it by `html_math_renderer`."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
