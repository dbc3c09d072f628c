"""Measures of the package: its functions, classes and signatures stay small, and what is public has a docstring."""

import ast
from pathlib import Path
from statistics import median

import pytest

import cutsim

SOURCES, TESTS = Path(cutsim.__file__).parent, Path(__file__).parent

#: Public constructors and functions whose keyword arguments are each of a kind of its own: bags of them would
#: not help who calls. Each has the number that it may have, everything else at most 8.
WIDE = {
    "pairs.surface_pair.SurfacePair.__init__": 12,
    "results.pictures.draw_body": 15,
    "identify.inverse.fit_simulation": 11,
    "bodies.solid.Solid.__init__": 11,
    "commands.fit.command": 11,
    "commands.fit_material.command": 10,
    "results.recording.Recording.__init__": 13,
    "commands.sweep.command": 10,
    "analysis.mechanics.Mechanics.__init__": 10,
    "interface.crack.Crack.__init__": 11,
    "fields.laminate.laminate": 12,
    "studies.body.cracked_block": 9,
    "tools.tool_contact.ToolContact.__init__": 9,
    "tools.triangulated_tool.TriangulatedTool.__init__": 10,
}


def inside(node, name):
    """All functions and classes in a node, nested ones too, by their full names."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.FunctionDef | ast.ClassDef):
            yield f"{name}.{child.name}", child
            yield from inside(child, f"{name}.{child.name}")
        else:
            yield from inside(child, name)


def body_lines(function):
    """Lines of the body without the docstring."""
    body = function.body[1:] if ast.get_docstring(function) else function.body
    return function.end_lineno - body[0].lineno + 1 if body else 0


def attributes(kind):
    """What a class assigns on self anywhere, and the fields of a dataclass."""
    stores = [n for n in ast.walk(kind) if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store)]
    fields = [n.target for n in kind.body if isinstance(n, ast.AnnAssign)]
    return {n.attr for n in stores if isinstance(n.value, ast.Name) and n.value.id == "self"} | {n.id for n in fields}


def parameters(function):
    """Number of parameters that can be given by position, and of those that cannot; without self and cls."""
    names = [a.arg for a in (*function.args.posonlyargs, *function.args.args)]
    return len(names) - (names[:1] in (["self"], ["cls"])), len(function.args.kwonlyargs)


# a property and its setter, and overloads, have one name
DEFINITIONS = [
    definition
    for path in sorted(SOURCES.glob("*/**/*.py"))
    for definition in inside(ast.parse(path.read_text()), f"{path.parent.name}.{path.stem}")
]
FUNCTIONS = [(name, node) for name, node in DEFINITIONS if isinstance(node, ast.FunctionDef)]
CLASSES = [(name, node) for name, node in DEFINITIONS if isinstance(node, ast.ClassDef)]


def test_functions_are_short():
    assert median(body_lines(node) for _, node in FUNCTIONS) <= 5
    assert not [(name, body_lines(node)) for name, node in FUNCTIONS if body_lines(node) > 50]


def test_classes_are_small():
    assert not [name for name, node in CLASSES if node.end_lineno - node.lineno + 1 > 200]
    assert not [(name, sorted(attributes(node))) for name, node in CLASSES if len(attributes(node)) > 15]


def test_signatures_are_short():
    counts = [(name, sum(parameters(node))) for name, node in FUNCTIONS]
    assert not [(name, count) for name, count in counts if count > WIDE.get(name, 8)]
    assert {name: count for name, count in counts if name in WIDE} == WIDE, "an exception is as large as needed"
    assert not [name for name, node in FUNCTIONS if name in WIDE and parameters(node)[0] > 5], "the rest has keywords"


def test_what_is_public_has_a_docstring():
    public = [(name, node) for name, node in DEFINITIONS if not name.rpartition(".")[2].startswith("_")]
    bare = [name for name, node in public if not ast.get_docstring(node)]
    assert len(bare) <= 0.05 * len(public), bare


def test_measures_see_what_they_measure():
    source = """
class A:
    x: int
    def f(self, a, b, *, c):
        '''Docstring.'''
        self.y, a.z = 1, 2

        def g():
            self.w = 3
        return g
"""
    (_, kind), (_, method), (name, _) = inside(ast.parse(source), "module")
    assert name == "module.A.f.g"
    assert attributes(kind) == {"x", "y", "w"}
    assert body_lines(method) == 5 and parameters(method) == (2, 1)


@pytest.mark.parametrize("path", sorted(TESTS.rglob("*.py")), ids=lambda path: path.stem)
def test_tests_share_by_the_helpers(path):
    """No test imports from another one or from conftest."""
    nodes = list(ast.walk(ast.parse(path.read_text())))
    modules = [node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)]
    modules += [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    assert not [name for name in modules if name == "conftest" or name.startswith("test_")]
