"""Settings of the site that Sphinx builds from this folder: `python -m sphinx -W docs site`.

It needs no network, to be built or to be read: formulas are MathML, which browsers draw themselves.
"""

import re
import sys
from pathlib import Path

from docutils.nodes import SkipNode
from docutils.utils.math.latex2mathml import tex2mathml
from pygments.lexers.special import TextLexer

sys.path.insert(0, str(Path(__file__).parents[1] / "scripts"))

import viscotrain

BACKTICKS = re.compile(r"(?<!`)`([^`]+)`(?!`)")

project = "viscotrain"
author = copyright = "The viscotrain developers"
version = release = viscotrain.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]
exclude_patterns = ["study/*.md"]
html_theme = "furo"
html_title = f"viscotrain {release}"
html_show_sourcelink = False

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

autodoc_typehints = "none"  # docstrings give shapes and units
autodoc_member_order = "bysource"
autodoc_mock_imports = ["ngsolve", "netgen", "pyngcore"]


def inline_math(self, node):
    """A formula in a line of text."""
    self.body.append(tex2mathml(node.astext(), as_block=False))
    raise SkipNode


def block_math(self, node):
    """A formula in a line of its own."""
    self.body.append(f"<div class='math'>{tex2mathml(node.astext(), as_block=True)}</div>")
    raise SkipNode


def in_words_of_sphinx(app, what, name, obj, options, lines):
    """Code in docstrings is between single backticks; that of the package is for its authors."""
    lines[:] = [] if what == "module" else [BACKTICKS.sub(r"``\1``", line) for line in lines]


def setup(app):
    """Draw formulas without a script from elsewhere; columns of numbers have no highlights."""
    app.connect("autodoc-process-docstring", in_words_of_sphinx, priority=400)
    app.add_lexer("csv", TextLexer)
    app.add_html_math_renderer("mathml", (inline_math, None), (block_math, None))


html_math_renderer = "mathml"
