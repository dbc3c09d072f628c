"""Dead loads on nodes: forces on points, and forces per length of a line."""

from abc import abstractmethod
from collections.abc import Sequence

import numpy as np
import ufl
from dolfinx import la
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base.checks import require, require_numbers
from cutsim.base.kinematics import Expr
from cutsim.base.parameters import TimeFunction
from cutsim.base.signatures import checked
from cutsim.bodies.loads import Load
from cutsim.fields.sizes import incidence
from cutsim.fields.space import locate_dofs, marks, refuse
from cutsim.fields.state import State

# share of a straight edge's load that its nodes take, ends first, by the degree of the displacement
_SHARES = {1: (1 / 2, 1 / 2), 2: (1 / 6, 1 / 6, 2 / 3)}


class NodalLoad(Load):
    """Base of dead loads whose forces on nodes are known beforehand.

    Attributes:
        nodes: Local nodes (blocked dofs) that are loaded, ghosts included.
    """

    nodes: NDArray[np.int32]

    @abstractmethod
    def _shares(self, direction: NDArray[np.float64]) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Owned nodes, and the force on each at factor 1, one a row. Collective."""

    def __init__(
        self,
        state: State,
        direction: tuple[float, ...],
        factor: float | TimeFunction,
        name: str,
        corners: tuple[float, ...],
    ) -> None:
        gdim = state.mesh.geometry.dim
        require_numbers("direction", direction, length=gdim)
        super().__init__(state, factor, "factor", name, corners)
        nodes, forces = self._shares(np.array(direction, dtype=float))
        self._dofs = (gdim * nodes[:, None] + np.arange(gdim, dtype=np.int32)).ravel()
        self._unit = forces.ravel()
        self._forces_on_nodes = _DeadForces(self)

    @property
    def assemblers(self) -> Sequence["_DeadForces"]:
        """The forces."""
        return (self._forces_on_nodes,)

    def residual(self, v: Expr) -> ufl.Form:
        """No form: the forces are those of the assembler."""
        return ufl.Form([])

    def forces(self) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Owned dofs and the forces on them at the end of the step [force]."""
        return self._dofs, self._factor.value * self._unit

    def _nodal_forces(self) -> NDArray[np.float64]:
        nodal = np.zeros(len(self.state.increment))
        dofs, forces = self.forces()
        nodal[dofs] = forces
        return nodal


class NodalForce(NodalLoad):
    """The same dead force on each of some vertices.

    The deformation under a force at a point depends on the mesh.  Where the vertices are those of a surface, a
    `Traction` is a load that does not, and where they are those of a line a `LineLoad`.

    Args:
        state: Displacement and time.
        vertices: Local vertices.
        direction: Force on each of them at factor 1, one number a component [force].
        factor: Function of time that scales it.
        name: Name in messages and output.
        corners: Times at which the factor has a kink.

    Raises:
        ValueError: The direction has the wrong number of components, or no vertex is found on any rank.
    """

    @checked
    def __init__(
        self,
        state: State,
        vertices: NDArray[np.int32],
        direction: tuple[float, ...],
        factor: float | TimeFunction,
        *,
        name: str = "force",
        corners: tuple[float, ...] = (),
    ) -> None:
        self.nodes = locate_dofs(state.V, 0, vertices)
        self._owned = self.nodes[self.nodes < state.V.dofmap.index_map.size_local]
        found = state.mesh.comm.allreduce(len(self._owned))
        require("vertices", found, found > 0, f"vertices that carry dofs (load {name!r})")
        super().__init__(state, direction, factor, name, corners)

    def _shares(self, direction: NDArray[np.float64]) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        return self._owned, np.tile(direction, (len(self._owned), 1))


class LineLoad(NodalLoad):
    """Dead force per reference length along a line of edges in space, such as under a roller.

    In the plane a `Traction` on facets is such a load.

    Args:
        state: Displacement, of degree 1 or 2, and time.
        vertices: Local vertices of the line, ghosts included; the edges of the mesh between them are loaded.
        direction: Force per length at factor 1, one number a component [force/length].
        factor: Number or function of time that scales it.
        name: Name in messages and output.
        corners: Times at which the factor has a kink.

    Attributes:
        length: Length of the line in the reference configuration [length].

    Raises:
        ValueError: The mesh is flat, the direction has the wrong number of components, or the vertices are not those of
            a line: no edge is between them, more than two meet in one of them, or it runs along a crack.
    """

    @checked
    def __init__(
        self,
        state: State,
        vertices: NDArray[np.int32],
        direction: tuple[float, ...],
        factor: float | TimeFunction,
        *,
        name: str = "line_load",
        corners: tuple[float, ...] = (),
    ) -> None:
        mesh, degree = state.mesh, state.V.ufl_element().degree
        require("state", f"of a mesh in {mesh.geometry.dim} dimensions", mesh.geometry.dim == 3, "of a mesh in space")
        require("state", f"of degree {degree}", degree in _SHARES, "of degree 1 or 2")
        edges = self._edges(state, np.asarray(vertices, dtype=np.int32), name)
        self.nodes = locate_dofs(state.V, 1, edges)
        self._parts = _edge_nodes(state, edges)
        x = state.V.tabulate_dof_coordinates()
        lengths = np.linalg.norm(x[self._parts[:, 1]] - x[self._parts[:, 0]], axis=1)
        self.length = float(mesh.comm.allreduce(lengths.sum()))
        self._weights = lengths[:, None] * np.array(_SHARES[degree])
        super().__init__(state, direction, factor, name, corners)

    @staticmethod
    def _edges(state: State, vertices: NDArray[np.int32], name: str) -> NDArray[np.int32]:
        """Owned edges whose ends are both among some vertices. Collective."""
        mesh = state.mesh
        mesh.topology.create_entities(1)
        ends = incidence(mesh, 1, 0)[: mesh.topology.index_map(1).size_local]
        marked = marks(mesh.comm, mesh.topology.index_map(0), vertices, "vertices")
        edges = np.flatnonzero(marked[ends].all(axis=1)).astype(np.int32)
        found = mesh.comm.allreduce(len(edges))
        require("vertices", found, found > 0, f"vertices with edges of the mesh between them (load {name!r})")
        meeting = la.vector(mesh.topology.index_map(0))
        np.add.at(meeting.array, ends[edges].ravel(), 1.0)
        meeting.scatter_reverse(la.InsertMode.add)
        branched = bool(meeting.array.max(initial=0.0) > 2)
        refuse(mesh.comm, f"vertices of load {name!r}: more than two edges meet in one of them" if branched else None)
        return edges

    def _shares(self, direction: NDArray[np.float64]) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        index_map = self.state.V.dofmap.index_map
        shares, taken = la.vector(index_map), la.vector(index_map)
        np.add.at(shares.array, self._parts.ravel(), self._weights.ravel())
        taken.array[self._parts] = 1.0
        for vector in (shares, taken):
            vector.scatter_reverse(la.InsertMode.add)
        n = index_map.size_local
        split = bool((taken.array[self.nodes[self.nodes < n]] == 0).any())
        refuse(self.state.mesh.comm, f"vertices of load {self.name!r}: the line runs along a crack" if split else None)
        nodes = np.flatnonzero(taken.array[:n]).astype(np.int32)
        return nodes, shares.array[nodes, None] * direction


def _edge_nodes(state: State, edges: NDArray[np.int32]) -> NDArray[np.int32]:
    """Nodes of edges as one of their cells has them, ends first; shape (edges, nodes)."""
    topology, dofmap = state.mesh.topology, state.V.dofmap
    topology.create_connectivity(1, topology.dim)
    cells = np.array([topology.connectivity(1, topology.dim).links(edge)[0] for edge in edges], dtype=np.int32)
    of_cells = incidence(state.mesh, topology.dim, 1)
    closure = np.array([dofmap.dof_layout.entity_closure_dofs(1, i) for i in range(of_cells.shape[1])])
    local = (of_cells[cells] == edges[:, None]).argmax(axis=1)
    return np.asarray(dofmap.list[cells[:, None], closure[local]])


class _DeadForces:
    """The forces of a load on nodes, as `cutsim.base.terms.Assembler`; they have no tangent."""

    pattern = 0
    rate_dependent = False

    def __init__(self, load: NodalLoad) -> None:
        self._load = load

    def prepare(self) -> None:
        """Nothing depends on the displacement."""

    def add_forces(self, b: PETSc.Vec, along: NDArray[np.float64] | None) -> None:
        """Subtract the forces, which are external, see `cutsim.base.terms.Assembler.add_forces`."""
        dofs, forces = self._load.forces()
        b.setValues((b.getOwnershipRange()[0] + dofs).astype(PETSc.IntType), -forces, addv=PETSc.InsertMode.ADD)

    def add_tangent(self, A: PETSc.Mat) -> None:
        """Nothing."""

    def add_pattern(self, A: PETSc.Mat) -> None:
        """Nothing."""
