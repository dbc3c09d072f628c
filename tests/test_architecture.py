"""Imports flow one way: from ready-made studies down to pure mathematics."""

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import cutsim

SOURCES = Path(cutsim.__file__).parent
# a package imports from those before it
PACKAGES = (
    "base", "fields", "solvers", "materials", "bodies", "interface", "pairs", "tools", "heat", "analysis", "results",
    "studies", "identify",
)  # fmt: skip


def imports(path):
    """Modules of the package that a module imports."""
    nodes = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.ImportFrom)]
    names = {node.module for node in nodes if node.module and node.module.startswith("cutsim.")}
    return names | {f"cutsim.{node.names[0].name}" for node in nodes if node.module == "cutsim"}


def test_every_package_has_its_place():
    assert {path.parent.name for path in SOURCES.glob("*/*.py")} == set(PACKAGES)
    assert [path.name for path in SOURCES.glob("*.py")] == ["__init__.py"]


@pytest.mark.parametrize("package", PACKAGES)
def test_imports_flow_one_way(package):
    allowed = PACKAGES[: PACKAGES.index(package) + 1]
    for path in (SOURCES / package).glob("*.py"):
        strangers = {name for name in imports(path) if name.split(".")[1] not in allowed}
        assert not strangers, f"{package}.{path.stem} imports {', '.join(sorted(strangers))}"


def test_no_module_imports_itself_through_others():
    graph = {f"cutsim.{path.parent.name}.{path.stem}": imports(path) for path in SOURCES.glob("*/*.py")}
    TopologicalSorter(graph).prepare()  # raises CycleError
