"""Pass of a slave surface over a master surface: jump, law and forces of a step (docs/theory.md §3.5)."""

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base.assembly import add_blocks, owned_vector
from cutsim.base.checks import require
from cutsim.fields.faces import Face
from cutsim.fields.points import FacetPoints, Values
from cutsim.fields.state import State
from cutsim.interface.history import GAUSS, TRAPEZOID, InterfaceHistory
from cutsim.pairs import nodal_forces
from cutsim.pairs.configuration import Pairs
from cutsim.pairs.nodal_forces import Tractions
from cutsim.pairs.pair_law import PairLaw, PairLaws
from cutsim.pairs.pairing import Array
from cutsim.pairs.partners import DEGREES, PairKinematics

# points whose tangents are held in memory at a time
_CHUNK = 10_000


def slave_points(state: State, face: Face, name: str) -> FacetPoints:
    """The integration points of a slave surface, the parameter of a name. Collective.

    Raises:
        ValueError: The displacement is not of degree 1 or 2, or there are no facets.
    """
    degree = state.V.element.basix_element.degree
    require("degree", degree, degree in DEGREES, "1 or 2: fields on the surfaces of a pair")
    measure = state.measures.face(face, name)
    return FacetPoints(state.mesh, face.facets, measure, interior=False, degree=DEGREES[degree], ordered=True)


class SurfacePass:
    """Pass of a slave surface over a master surface. Every method is collective.

    The traction T acts on the slave, −T on the master.  Its components follow from the jump by the laws of a crack: the
    jump is a function of the points, which is found beforehand.

    Args:
        state: Displacement and time.
        name: Name of the slave surface.
        points: Integration points on the slave facets.
        kinematics: Finds the jump.
        laws: Laws.
        weight: Factor of the virtual work.

    Attributes:
        points: Integration points.
        kinematics: Finds their partners.
        weight: Factor of the virtual work.
        weights: Weights of the points, flattened, times the factor; zero where another rank adds them.
        history: What they remember of opening and damage.
        slip: What they remember of friction, or None.
        viscous: What they remember of the viscosity of the bond, or None.
    """

    def __init__(
        self,
        state: State,
        name: str,
        points: FacetPoints,
        kinematics: PairKinematics,
        laws: PairLaws,
        *,
        weight: float,
    ) -> None:
        self._state, self.points, self.kinematics, self.weight = state, points, kinematics, weight
        self._dim = state.mesh.geometry.dim
        own = np.where(kinematics.slave.owned[:, None], points.weights, 0.0)
        self.weights = weight * own.ravel()
        rule = GAUSS if kinematics.small_sliding else TRAPEZOID
        self.history = InterfaceHistory(state.memory, name, points, laws.cohesive, rule, ("held",))
        self._law = PairLaw(state, name, points, laws, self.history, kinematics.pairs(self._start()))
        self.slip, self.viscous = self._law.slip, self._law.viscous
        self._seen: Array | None = None
        self._force = state.memory.value(f"{name}: force", np.zeros(self._dim))

    @property
    def force(self) -> Array:
        """Force on the slave surface in the trial state [force]."""
        return self._force.trial

    def _tractions(self, *, linearised: bool) -> Tractions:
        """Tractions for the jump that was found last."""
        if linearised:
            return Tractions(*self._law.linear(), self.weights)
        values = self._law.traction()
        return Tractions(values, np.zeros((*values.shape, self._dim)), self.weights)

    # -- configurations -------------------------------------------------------------------------------------------

    def partners(self) -> Pairs:
        """Pairs at the present displacement; the law knows their jump then."""
        u = self._state.u.x.array
        # the search is collective: all ranks look again, or none
        same = self._seen is not None and np.array_equal(u, self._seen)
        if not self._state.mesh.comm.allreduce(same, op=MPI.LAND):
            self._pairs = self.kinematics.pairs(self.kinematics.nodes(u))
            self._seen = u.copy()
            self._law.set_pairs(self._pairs)
        return self._pairs

    def _shaped(self, values: Array) -> Values:
        return values.reshape(self.points.weights.shape)

    def begin(self) -> None:
        """Start a step from the committed displacement."""
        self.kinematics.begin(self._start())
        self._seen = None

    def evaluate(self) -> None:
        """Trial history, and the force on the slave, of the converged trial displacement."""
        ends = self._start(), self.kinematics.nodes(self._state.u.x.array)
        self.history.evaluate(lambda s: self._along(ends, s))
        for part in (self.slip, self.viscous):
            if part is not None:
                part.evaluate()
        self._force.trial = self._state.mesh.comm.allreduce(self.point_forces().sum(axis=0))
        self.kinematics.note(self.partners())

    def point_forces(self) -> Array:
        """Present forces on the slave at the points, shape (points, dimension); zero where another rank adds them."""
        pairs, tractions = self.partners(), self._tractions(linearised=False)
        return np.asarray(np.einsum("n,na,nai->ni", self.weights, tractions.values, pairs.slave.frames))

    def _start(self) -> tuple[Array, Array]:
        return self.kinematics.nodes(self._state.u_old.x.array, start=True)

    def _along(self, ends: tuple[tuple[Array, Array], ...], s: float) -> dict[str, Values]:
        """Values on the way of the step, see `cutsim.interface.history.Along`."""
        (slave, master), (slave_end, master_end) = ends
        pairs = self.kinematics.pairs(((1 - s) * slave + s * slave_end, (1 - s) * master + s * master_end))
        self._law.set_pairs(pairs)
        values = self._law.values()
        change = pairs.increment(self.kinematics.interpolate(slave_end - slave), master_end - master)
        power = np.einsum("nai,ni->na", pairs.slave.frames, change)
        return values | {
            "contact_power": -values["pressure"] * self._shaped(power[:, 0]),
            "opening": self._shaped(pairs.jump[:, 0]),
        }

    def augment(self) -> bool:
        """Improve multiplier and anchor; True if the step has to be solved again."""
        self.partners()
        return self._law.augment()

    def energies(self) -> dict[str, float]:
        """Energies of the pass, by entry of the audit.

        Where normals of facets differ, pressure does work on a slide at constant penetration: work that the penalty
        does not hold is numerical.
        """
        total = {**self.history.energies(), "friction": 0.0}
        held = self.points.integral(self.history.trial["held"])
        total |= {"contact": held, "numerical": total["contact"] - held}
        for entry, value in (self.slip.energies() if self.slip is not None else {}).items():
            total[entry] += value
        if self.viscous is not None:
            total["cohesive_viscous"] = self.viscous.dissipated()
        return {entry: self.weight * value for entry, value in total.items()}

    # -- forces ---------------------------------------------------------------------------------------------------

    @property
    def pattern(self) -> int:
        """Number of the sparsity pattern."""
        return self.kinematics.partners.version

    def prepare(self) -> None:
        """Nothing: partners are found when forces are asked for."""

    def add_forces(self, b: PETSc.Vec, along: Array | None) -> None:
        """Add nodal forces, as `cutsim.base.terms.Assembler.add_forces`."""
        self.partners()
        self._add(b, self._tractions(linearised=along is not None), along)

    def rate_forces(self) -> Array | None:
        """Nodal forces of the viscosity of the bond, owned entries; None without it."""
        if self.viscous is None:
            return None
        self.partners()
        values = self.viscous.values().reshape(-1, self._dim)
        dofmap = self._state.V.dofmap
        b = owned_vector(dofmap.index_map, dofmap.index_map_bs)
        self._add(b, Tractions(values, np.zeros((*values.shape, self._dim)), self.weights), None)
        b.assemble()
        forces = b.array.copy()
        b.destroy()
        return forces

    def _add(self, b: PETSc.Vec, tractions: Tractions, along: Array | None) -> None:
        """Add the nodal forces of tractions."""
        kinematics, pairs = self.kinematics, self.partners()
        rows = nodal_forces.active(kinematics, pairs, tractions)
        forces = nodal_forces.forces(kinematics, pairs, tractions, rows)
        if along is not None:
            change = kinematics.at_stencil(along, pairs, rows)
            forces += np.einsum("nricj,ncj->nri", nodal_forces.tangents(kinematics, pairs, tractions, rows), change)
        dofs = self.dofs(nodal_forces.nodes(kinematics, pairs, rows))
        # nodes of a rigid master have none; matrices pass over them unasked
        b.setOption(PETSc.Vec.Option.IGNORE_NEGATIVE_INDICES, True)
        b.setValues(dofs.ravel().astype(PETSc.IntType), forces.ravel(), addv=PETSc.InsertMode.ADD)

    def add_tangent(self, A: PETSc.Mat) -> None:
        """Add the tangent, as `cutsim.base.terms.Assembler.add_tangent`."""
        kinematics, pairs, tractions = self.kinematics, self.partners(), self._tractions(linearised=True)
        rows = nodal_forces.active(kinematics, pairs, tractions)
        for some in np.array_split(rows, 1 + len(rows) // _CHUNK):
            starts, nodes = nodal_forces.stencils(kinematics, pairs, some)
            if len(starts):
                blocks = np.add.reduceat(nodal_forces.tangents(kinematics, pairs, tractions, some), starts)
                dofs = self.dofs(nodes)
                add_blocks(A, dofs, blocks.reshape(*dofs.shape, dofs.shape[1]))

    def add_pattern(self, A: PETSc.Mat) -> None:
        """Add zeros, as `cutsim.base.terms.Assembler.add_pattern`."""
        dofs = self.dofs(self.kinematics.partners.nodes())
        for some in np.array_split(dofs, 1 + len(dofs) // _CHUNK):
            add_blocks(A, some, np.zeros((*some.shape, some.shape[1])))

    def dofs(self, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
        """Global dofs of global nodes, shape (…, nodes) → (…, dofs); negative for −1."""
        return (nodes[..., None] * self._dim + np.arange(self._dim)).reshape(len(nodes), self._dim * nodes.shape[1])
