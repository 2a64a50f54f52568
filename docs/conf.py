"""How the documentation site is built: ``python -m sphinx -W -b html docs docs/_build``."""

from __future__ import annotations

import sys
from pathlib import Path

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from meshlab_filter import __version__

project = "meshlab-filter"
author = "the meshlab-filter developers"
copyright = "the meshlab-filter developers"
release = version = __version__

extensions = ["sphinx.ext.autodoc", "numpydoc", "myst_parser"]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3
numpydoc_show_class_members = False
autodoc_typehints = "none"
exclude_patterns = ["_build"]
suppress_warnings = ["toc.empty_glob", "myst.header"]

html_theme = "furo"
html_title = f"meshlab-filter {release}"
html_math_renderer = "mathml"
html_copy_source = False


def _inline(self, node: nodes.math) -> None:
    self.body.append(tex2mathml(node.astext(), as_block=False))
    raise nodes.SkipNode


def _block(self, node: nodes.math_block) -> None:
    self.body.append(f"<div class='math'>{tex2mathml(node.astext(), as_block=True)}</div>")
    raise nodes.SkipNode


def setup(app) -> None:
    """Write equations as MathML, which browsers draw by themselves: nothing is loaded for them."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
