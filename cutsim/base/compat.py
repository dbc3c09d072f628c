"""Compatibility with the supported versions of dolfinx (0.9, 0.10 and 0.11) and their versions of PETSc.

Nothing outside this module asks which version is installed.  Each function has the meaning of the newest version and
is written for the older ones beside it.
"""

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import singledispatchmethod
from pathlib import Path
from typing import Any

import basix.ufl
import dolfinx
import numpy as np
import ufl
from dolfinx import cpp, fem, graph
from dolfinx.common import IndexMap
from dolfinx.cpp.la import SparsityPattern
from dolfinx.mesh import GhostMode, Mesh
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc
from ufl.algorithms import expand_derivatives
from ufl.corealg.map_dag import map_expr_dag
from ufl.corealg.multifunction import MultiFunction

from cutsim.base.jit import JIT_OPTIONS, compiled

_VERSION = tuple(int(part) for part in dolfinx.__version__.split(".")[:2])
_BEFORE_0_10 = _VERSION < (0, 10)

#: For each further mesh of a form, the map between its cells and the entities of the mesh integrated over.
EntityMaps = Mapping[Mesh, Any]

#: Reason of PETSc's SNES for a residual that is not finite.
NOT_FINITE: int = getattr(PETSc.SNES.ConvergedReason, "DIVERGED_FUNCTION_NANORINF", None) or (
    PETSc.SNES.ConvergedReason.DIVERGED_FNORM_NAN
)

#: PETSc options of line searches. Newer versions of PETSc, such as 3.25, cut each step at λ = 1 without a word;
#: a softening bond needs the longer steps that "l2" finds. Older ones have no such bound and do not read the option.
LINE_SEARCH_OPTIONS: dict[str, Any] = {"snes_linesearch_maxlambda": 1e8}


# ---- Python


def _with_subclasses(kind: type) -> Iterator[type]:
    yield kind
    subclasses: list[type] = kind.__subclasses__()
    for derived in subclasses:
        yield from _with_subclasses(derived)


def _forget_what_was_dispatched() -> None:
    """Python 3.13.0 and 3.13.1 keep for ever what a `singledispatchmethod` was called on (gh-127750).

    UFL calls such methods on what differentiates a form, which holds the mesh, and with it MPI's communicators.
    """
    try:
        from ufl.corealg.dag_traverser import DAGTraverser
    except ImportError:  # UFL 2024, of dolfinx 0.9
        return
    for kind in _with_subclasses(DAGTraverser):
        for method in vars(kind).values():
            if isinstance(method, singledispatchmethod) and hasattr(method, "_method_cache"):
                method._method_cache = None


_forget_what_was_dispatched()


@functools.cache
def _cell(name: str) -> ufl.Cell:
    return ufl.Cell(name)


def _remember_cells() -> None:
    """Basix makes UFL's description of a cell, with all its sides, anew whenever an element is asked for its cell.

    That was an eighth of the time in which kernels are generated.
    """
    for kind in _with_subclasses(basix.ufl._ElementBase):
        if isinstance(vars(kind).get("cell"), property):
            kind.cell = property(lambda element: _cell(element.cell_type.name))  # type: ignore[attr-defined]


_remember_cells()


# ---- forms and expressions


def form(
    form: ufl.Form,
    *,
    entity_maps: EntityMaps | None = None,
    jit_options: Mapping[str, Any] | None = None,
    form_compiler_options: Mapping[str, Any] | None = None,
) -> fem.Form:
    """Compile a UFL form with the project's compiler options. Collective on the mesh of the form.

    Args:
        form: UFL form; every integral on one mesh.
        entity_maps: Maps made by `create_submesh`, by submesh.
        jit_options: Options that override `cutsim.base.jit.JIT_OPTIONS`.
        form_compiler_options: Options of FFCx.

    Returns:
        The compiled form, in one of many folders: to load a kernel, and more so to compile one, Python looks through
        all files of its folder.
    """
    counted = _counted(form)
    options = {**JIT_OPTIONS, **(jit_options or {})}
    options["cache_dir"] = str(Path(options["cache_dir"]) / counted.signature()[:2])
    maps = dict(entity_maps or {})
    return compiled(
        form.ufl_domain().ufl_cargo().comm,
        lambda: fem.form(
            counted,
            entity_maps=maps if _BEFORE_0_10 else list(maps.values()),
            jit_options=options,
            form_compiler_options=dict(form_compiler_options or {}),
        ),
        Path(options["cache_dir"]),
    )


def _counted(form: ufl.Form) -> ufl.Form:
    """The form with the markers of its domains counted from 0: forms that differ only in them are compiled once."""
    domains: dict[str, dict[int, Any]] = {}
    for integral in form.integrals():
        if not isinstance(integral.subdomain_id(), int) or not isinstance(integral.subdomain_data(), list):
            return form
        entities = dict(integral.subdomain_data())[integral.subdomain_id()]
        domains.setdefault(integral.integral_type(), {})[integral.subdomain_id()] = entities
    order = {kind: sorted(marked) for kind, marked in domains.items()}
    data = {kind: [(new, marked[old]) for new, old in enumerate(order[kind])] for kind, marked in domains.items()}
    return ufl.Form(
        [
            integral.reconstruct(
                subdomain_id=order[integral.integral_type()].index(integral.subdomain_id()),
                subdomain_data=data[integral.integral_type()],
            )
            for integral in form.integrals()
        ]
    )


def forms(parts: Sequence[ufl.Form], *, entity_maps: EntityMaps | None = None) -> list[fem.Form]:
    """Compile the parts of a sum one by one, as one form where dolfinx, before 0.10, makes patterns of one form only.

    Args:
        parts: On one mesh; some may be empty.
        entity_maps: As for `form`.

    Returns:
        Compiled forms with the same sum. What vanishes, such as a part times zero, is not among them.
    """
    if _BEFORE_0_10:
        return [form(sum(parts, start=ufl.Form([])), entity_maps=entity_maps)]
    found = [form(part, entity_maps=entity_maps) for part in parts if not part.empty()]
    return [part for part in found if part.integral_types]


def sparsity_pattern(forms: Sequence[fem.Form]) -> SparsityPattern:
    """Pattern of the sum of bilinear forms on the same spaces. Collective."""
    first, *further = forms
    pattern = fem.create_sparsity_pattern(first)
    for other in further:
        fem.build_sparsity_pattern(pattern, other)
    pattern.finalize()
    return pattern


class _WithoutVariables(MultiFunction):
    """What the variables stand for, in their place; each part of an expression is visited once."""

    expr = MultiFunction.reuse_if_untouched

    def variable(self, _: Any, expression: Any, __: Any) -> Any:
        return expression


def expression(expression: Any, points: NDArray[np.float64], mesh: Mesh) -> fem.Expression:
    """Compile a UFL expression with the project's compiler options. Collective.

    Args:
        expression: UFL expression on the mesh.
        points: Points of the reference cell at which it is evaluated, one a row.
        mesh: The mesh.

    Returns:
        The compiled expression.
    """
    # its signature counts the variables of the whole process: without them equal expressions are compiled once
    plain = map_expr_dag(_WithoutVariables(), expand_derivatives(expression))
    return compiled(mesh.comm, lambda: fem.Expression(plain, points, jit_options=JIT_OPTIONS))


def nodal_expression(expression_: Any, V: fem.FunctionSpace) -> fem.Expression:
    """Compile a UFL expression at the interpolation points of a space, for `Function.interpolate`. Collective."""
    points = V.element.interpolation_points
    return expression(expression_, points() if callable(points) else points, V.mesh)


def evaluate(expression: fem.Expression, mesh: Mesh, cells: NDArray[np.int32]) -> NDArray[np.float64]:
    """Values of a compiled expression in cells.

    Returns:
        Shape (cells, points × components), the components of a point beside each other.
    """
    size = len(expression.X()) * int(np.prod(expression.ufl_expression.ufl_shape))
    return np.asarray(expression.eval(mesh, cells)).reshape(len(cells), size)


# ---- meshes


def cell_partitioner(partition: Callable[..., Any] | None = None) -> Callable[..., Any]:
    """Partitioner of cells that gives each rank the cells beyond its facets, as cracks need.

    Args:
        partition: Graph partitioner; that of dolfinx by default.
    """
    start = () if partition is None else (partition,)
    # from 0.11 on the number of cells that may share a facet has to be said
    cells_per_facet = () if _VERSION < (0, 11) else (2,)
    return dolfinx.mesh.create_cell_partitioner(*start, GhostMode.shared_facet, *cells_per_facet)


def create_mesh(
    comm: MPI.Comm, cells: NDArray[np.int64], x: NDArray[np.float64], element: basix.ufl._ElementBase
) -> Mesh:
    """Mesh of nodes and the nodes of each cell, with the ghosts that cracks need. Collective.

    Args:
        comm: Communicator; each rank gives a part of the cells and nodes.
        cells: Global node numbers, one cell a row.
        x: Positions, one node a row.
        element: Coordinate element.
    """
    geometry = (x, element) if _BEFORE_0_10 else (element, x)
    return dolfinx.mesh.create_mesh(comm, cells, *geometry, cell_partitioner())


def geometry_nodes(mesh: Mesh) -> NDArray[np.int32]:
    """Geometry nodes of each local cell, shape (cells, nodes of a cell)."""
    return mesh.geometry.dofmap if _VERSION < (0, 11) else mesh.geometry.dofmaps[0]


def create_submesh(mesh: Mesh, dim: int, entities: NDArray[np.int32]) -> tuple[Mesh, NDArray[np.int32], Any]:
    """Mesh of some entities of a mesh. Collective.

    Returns:
        The submesh, the entity of the parent for each of its cells, and its map for `EntityMaps`.
    """
    submesh, parents = dolfinx.mesh.create_submesh(mesh, dim, entities)[:2]
    if not _BEFORE_0_10:
        cells = submesh.topology.index_map(dim)
        local = np.arange(cells.size_local + cells.num_ghosts, dtype=np.int32)
        return submesh, np.asarray(parents.sub_topology_to_topology(local, inverse=False)), parents
    index_map = mesh.topology.index_map(dim)
    to_cell = np.full(index_map.size_local + index_map.num_ghosts, -1, dtype=np.int32)
    to_cell[parents] = np.arange(len(parents), dtype=np.int32)
    return submesh, np.asarray(parents, dtype=np.int32), to_cell


# ---- spaces with dofs of their own


def index_map(comm: MPI.Comm, size: int, ghosts: NDArray[np.int64], owners: NDArray[np.int32]) -> IndexMap:
    """Index map of owned indices and of ghosts, given by global index and owning rank. Collective."""
    # the tag keeps the messages of maps that are made at the same time apart, which is never so here
    return IndexMap(comm, size, ghosts, owners, *(() if _BEFORE_0_10 else (0,)))


def with_dofs(parent: fem.FunctionSpace, index_map: IndexMap, dofs: NDArray[np.int32]) -> fem.FunctionSpace:
    """A space with other dofs.

    Args:
        parent: The space with the mesh and the element.
        index_map: Index map of the dofs.
        dofs: Local dofs of every local cell, shape (cells, dofs of a cell).
    """
    mesh, old, of_cells = parent.mesh, parent.dofmap, graph.adjacencylist(dofs)
    if _BEFORE_0_10:
        dofmap = cpp.fem.DofMap(old.dof_layout, index_map, old.index_map_bs, of_cells, old.bs)
        space = type(parent._cpp_object)(mesh._cpp_object, parent.element, dofmap, parent.value_shape)
    else:
        dofmap = cpp.fem.DofMap(old.dof_layout, index_map, old.index_map_bs, of_cells._cpp_object, old.bs)
        space = type(parent._cpp_object)(mesh._cpp_object, parent.element._cpp_object, dofmap)
    return fem.FunctionSpace(mesh, parent.ufl_element(), space)
