"""Mixed elements for nearly incompressible bodies, with the pressure eliminated in each cell (docs/elements.md §2).

In each cell the volume change J is projected on polynomials ψ: the constant for degree 1 of the displacement, also
the linear ones for degree 2.  The volumetric energy is that of the projection J̄,

    ∫ U(J̄) dV,    variation ∫ p̄ δJ dV,    second variation ∫ p̄ δ²J dV + Bᵀ M⁻¹ H M⁻¹ B,

with p̄ the projection of U'(J̄), B = ∫ ψ δJ dV, M = ∫ ψ ψ dV and H = ∫ U''(J̄) ψ ψ dV.  This is the three-field
principle of Simo, Taylor and Pister (1985): Q1/P0, the mean dilatation, and Q2 with a discontinuous linear pressure.
"""

from collections.abc import Callable

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base.assembly import Array, add_blocks, empty_matrix
from cutsim.base.compat import form
from cutsim.base.kinematics import Expr
from cutsim.fields.state import State

# cells whose tangents are held in memory at a time
_CHUNK = 2000


class VolumeChange:
    """Projected volume change and pressure of one body.

    Args:
        state: Displacement and time.
        J: Volume change at `state.u`.
        energy: Volumetric strain energy per reference volume of a volume change [energy/length³].
        measure: Measure over the body.
        cells: Local cells of the body, all by default.

    Attributes:
        value: Projected volume change J̄ at the displacement of the last `prepare` [–].
        pressure: Projected derivative p̄ of the energy, > 0 in tension [stress].
    """

    def __init__(
        self,
        state: State,
        J: Expr,
        energy: Callable[[Expr], Expr],
        measure: ufl.Measure,
        cells: NDArray[np.int32] | None = None,
    ) -> None:
        mesh, V = state.mesh, state.V
        owned = mesh.topology.index_map(mesh.topology.dim).size_local
        self._cells = np.arange(owned, dtype=np.int32) if cells is None else np.unique(cells[cells < owned])
        modes = _modes(V)
        self._m = len(modes)
        space = fem.functionspace(mesh, ("Discontinuous Lagrange", 0, (self._m,)))
        self._value, self._pressure = fem.Function(space), fem.Function(space)
        self.value, self.pressure = (ufl.dot(f, modes) for f in (self._value, self._pressure))
        q, trial = (ufl.dot(argument(space), modes) for argument in (ufl.TestFunction, ufl.TrialFunction))
        change = ufl.variable(self.value)
        slope = ufl.diff(energy(change), change)
        self._volume = form(q * J * measure)
        self._push = form(q * slope * measure)
        self._stiffness = _Blocks(q * trial * ufl.diff(slope, change) * measure, self._m, self._cells)
        self._coupling = _Blocks(q * ufl.derivative(J, state.u, ufl.TrialFunction(V)) * measure, self._m, self._cells)
        self._dofs, bs = self._coupling.columns, V.dofmap.index_map_bs
        nodes = V.dofmap.index_map.global_to_local(self._dofs.ravel() // bs).reshape(self._dofs.shape)
        self._local = nodes * bs + self._dofs % bs
        mass = _Blocks(q * trial * measure, self._m, self._cells)
        self._inverse = np.linalg.inv(mass.assemble())
        self.prepare()

    def prepare(self) -> None:
        """Project volume change and pressure at the present displacement. Collective."""
        for f, compiled in ((self._value, self._volume), (self._pressure, self._push)):
            moments = fem.assemble_vector(compiled).array.reshape(-1, self._m)[self._cells]
            f.x.array.reshape(-1, self._m)[self._cells] = np.einsum("cmn,cn->cm", self._inverse, moments)
            f.x.scatter_forward()

    @property
    def rate_dependent(self) -> bool:
        """False: the pressure depends on the displacement alone, not on how long a step takes."""
        return False

    @property
    def pattern(self) -> int:
        """Always the same."""
        return 0

    def add_forces(self, b: PETSc.Vec, along: Array | None) -> None:
        """Add the tangent part that is no form, times a displacement, see `cutsim.base.terms.Assembler.add_forces`."""
        if along is None:
            return
        coupling, stiffness = self._linear()
        forces = np.einsum("cmi,cmn,cnj,cj->ci", coupling, stiffness, coupling, along[self._local], optimize=True)
        b.setValues(self._dofs.ravel().astype(PETSc.IntType), forces.ravel(), addv=PETSc.InsertMode.ADD)

    def add_tangent(self, A: PETSc.Mat) -> None:
        """Add this part of the tangent, see `cutsim.base.terms.Assembler.add_tangent`."""
        coupling, stiffness = self._linear()
        for some in self._chunks():
            B = coupling[some]
            add_blocks(A, self._dofs[some], np.swapaxes(B, 1, 2) @ stiffness[some] @ B)

    def add_pattern(self, A: PETSc.Mat) -> None:
        """Add zeros for it, see `cutsim.base.terms.Assembler.add_pattern`."""
        for some in self._chunks():
            n, size = self._dofs[some].shape
            add_blocks(A, self._dofs[some], np.zeros((n, size, size)))

    def _linear(self) -> tuple[Array, Array]:
        """B and M⁻¹ H M⁻¹ of all cells."""
        stiffness = self._inverse @ self._stiffness.assemble() @ self._inverse
        return self._coupling.assemble(), stiffness

    def _chunks(self) -> list[NDArray[np.intp]]:
        return np.array_split(np.arange(len(self._cells)), 1 + len(self._cells) // _CHUNK)


class _Blocks:
    """Bilinear form with a test function that is constant in the cells, as one dense block for each cell.

    Args:
        a: The form.
        rows: Components of the test function.
        cells: Owned cells of the form.

    Attributes:
        columns: Global dofs of the columns of each block, shape (cells, n).
    """

    def __init__(self, a: ufl.Form, rows: int, cells: NDArray[np.int32]) -> None:
        self._a = form(a)
        self._matrix = empty_matrix([self._a])
        ends, columns, _ = self._values()
        starts = ends[rows * cells[:, None] + np.arange(rows)].astype(np.int64)
        dofmap = a.arguments()[1].ufl_function_space().dofmap
        self._entries = starts[..., None] + np.arange(dofmap.dof_layout.num_dofs * dofmap.bs)
        self.columns = columns[self._entries[:, 0]].astype(np.int64)

    def assemble(self) -> Array:
        """Blocks, shape (cells, rows, n)."""
        return self._values()[2][self._entries]

    def _values(self) -> tuple[NDArray[np.int32], NDArray[np.int32], Array]:
        self._matrix.zeroEntries()
        petsc.assemble_matrix(self._matrix, self._a)
        self._matrix.assemble()
        return self._matrix.getValuesCSR()


def _modes(V: fem.FunctionSpace) -> Expr:
    """Polynomials on which the volume change is projected: in physical space, so that distorted cells lose no order."""
    if V.ufl_element().degree == 1:
        return ufl.as_vector([1])
    gdim = V.mesh.geometry.dim
    centre = fem.Function(fem.functionspace(V.mesh, ("Discontinuous Lagrange", 0, (gdim,))))
    centre.interpolate(lambda x: x[:gdim])
    x = ufl.SpatialCoordinate(V.mesh)
    return ufl.as_vector([1, *(x[i] - centre[i] for i in range(gdim))])
