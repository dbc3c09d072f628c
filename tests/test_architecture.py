"""Imports flow one way: from ready-made studies down to pure mathematics."""

import ast
import inspect
import pkgutil
import re
from dataclasses import is_dataclass
from graphlib import TopologicalSorter
from importlib import import_module
from pathlib import Path

import pytest

import cutsim
import cutsim.materials

SOURCES = Path(cutsim.__file__).parent
# a package imports from those before it
PACKAGES = (
    "base", "readers", "fields", "solvers", "materials", "bodies", "interface", "pairs", "tools", "heat", "analysis",
    "results", "studies", "identify", "cases", "validation", "commands",
)  # fmt: skip


def imports(path):
    """Modules of the package that a module imports."""
    nodes = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.ImportFrom)]
    names = {node.module for node in nodes if node.module and node.module.startswith("cutsim.")}
    return names | {f"cutsim.{node.names[0].name}" for node in nodes if node.module == "cutsim"}


def test_every_package_has_its_place():
    assert {path.parent.name for path in SOURCES.glob("*/*.py")} == set(PACKAGES)
    assert sorted(path.name for path in SOURCES.glob("*.py")) == ["__init__.py", "__main__.py"]


@pytest.mark.parametrize("package", PACKAGES)
def test_imports_flow_one_way(package):
    allowed = PACKAGES[: PACKAGES.index(package) + 1]
    for path in (SOURCES / package).rglob("*.py"):
        strangers = {name for name in imports(path) if name.split(".")[1] not in allowed}
        assert not strangers, f"{package}.{path.stem} imports {', '.join(sorted(strangers))}"


@pytest.mark.parametrize("package", PACKAGES)
def test_mpi_is_loaded_first(package):
    """Whichever module is imported first, the library of MPI is there before dolfinx."""
    if package == "commands":  # starts without dolfinx, which its modules load by the other packages
        return
    uses_dolfinx = any("dolfinx" in path.read_text() for path in (SOURCES / package).glob("*.py"))
    first = ast.parse((SOURCES / package / "__init__.py").read_text()).body[1:3]
    assert not uses_dolfinx or "import mpi4py.MPI" in [ast.unparse(node) for node in first]


def test_no_module_imports_itself_through_others():
    modules = {path: ".".join(path.relative_to(SOURCES).with_suffix("").parts) for path in SOURCES.glob("*/**/*.py")}
    graph = {f"cutsim.{name}": imports(path) for path, name in modules.items()}
    TopologicalSorter(graph).prepare()  # raises CycleError


def test_materials_are_frozen_dataclasses():
    """What has a memory or assembles is no material; protocols and bases without fields are."""
    for module in pkgutil.iter_modules(cutsim.materials.__path__):
        classes = inspect.getmembers(import_module(f"cutsim.materials.{module.name}"), inspect.isclass)
        for name, kind in classes:
            if kind.__module__ == f"cutsim.materials.{module.name}":
                frozen = is_dataclass(kind) and kind.__dataclass_params__.frozen
                assert frozen or "__init__" not in vars(kind) or getattr(kind, "_is_protocol", False), name


LESSONS = sorted((Path(__file__).parents[1] / "demos").glob("*.py"))


@pytest.mark.parametrize("path", LESSONS, ids=[path.stem for path in LESSONS])
def test_lessons_are_read_from_top_to_bottom(path):
    """At most 120 lines, a third of them prose, which comes first; no program with options, classes or a main."""
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    assert path.stem.startswith("demo_") and lines[0].startswith("# # ")
    assert len(lines) <= 120
    assert 3 * sum(line.startswith("#") for line in lines) >= len(lines)
    assert "$$" in text[: text.index("\nimport ")], "mathematics first"
    assert not re.search(r"__main__|^class |argparse|typer", text, re.MULTILINE)
    assert "overwrite=True" in text and "\nassert " in text, "a lesson can be run again, and checks its headline"
