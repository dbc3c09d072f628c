"""Lessons and validation programs as notebooks: Sphinx does not know the language of a script without a header."""

import jupytext
import nbformat


def read(text: str) -> nbformat.NotebookNode:
    """Notebook of a light script."""
    notebook = jupytext.reads(text, fmt="py:light")
    notebook.metadata["language_info"] = {"name": "python", "pygments_lexer": "python"}
    return notebook
