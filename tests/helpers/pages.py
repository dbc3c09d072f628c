"""Running the Python of the pages."""

import re
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"
PYTHON = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)


def run_page(name):
    """Run the Python of a page as one script and return its names."""
    blocks = PYTHON.findall((DOCS / f"{name}.md").read_text(encoding="utf-8"))
    assert blocks, f"{name}.md has no Python"
    names = {"__name__": "__main__"}
    exec(compile("\n".join(blocks), f"{name}.md", "exec"), names)
    return names
