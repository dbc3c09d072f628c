"""Sphinx: Markdown pages, lessons and validation programs (rendered, not run), and the API from its docstrings."""

import re
import sys
from pathlib import Path

from docutils import nodes

import cutsim

sys.path.insert(0, str(Path(__file__).parent))  # for demo_reader and make_api
import make_api

project = "cutsim"
author = "cutsim contributors"
project_copyright = author
release = version = cutsim.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx-mathjax-offline",  # formulas need no network
    "sphinx_copybutton",
    "sphinx_design",
]
exclude_patterns = ["_build", "*.py", "figures", "**/__pycache__", "**/.ipynb_checkpoints"]
exclude_patterns += ["validation/_*", "validation/peers"]

# demos/ and tests/validation/ are linked into this folder; their light scripts are shown as notebooks without running
nb_custom_formats = {".py": "demo_reader.read"}
nb_execution_mode = "off"
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

default_role = "py:obj"
suppress_warnings = ["ref.python"]  # a name in a docstring that several classes have leads to the first
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "show-inheritance": True}
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
napoleon_google_docstring = True
napoleon_numpy_docstring = False

html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["style.css"]
html_title = f"cutsim {release}"
html_theme_options = {"navigation_with_keys": True}


def plain_text(app, what, name, obj, options, lines):
    """In docstrings bars are absolute values and ``cut_`` is a name: no markup of reStructuredText."""
    for i, line in enumerate(lines):
        parts = re.split(r"(``?[^`]+``?)", line)
        lines[i] = "".join(p if p.startswith("`") else re.sub(r"\||_(?!\w)", r"\\\g<0>", p) for p in parts)


def through_links(app, doctree):
    """Pages refer to lessons and programs by the links to their folders, which Sphinx follows out of this one."""
    for node in doctree.findall(nodes.Element):
        target = Path(node.get("reftarget") or "")
        for folder in ("demos", "validation"):
            if target.is_absolute() and target.is_relative_to((app.srcdir / folder).resolve()):
                node["reftarget"] = f"{folder}/{target.name}"


def setup(app):
    """Called by Sphinx."""
    make_api.reference_pages()
    app.connect("doctree-read", through_links)
    app.connect("autodoc-process-docstring", plain_text, priority=100)
