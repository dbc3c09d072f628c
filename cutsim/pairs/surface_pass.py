"""Pass of a slave surface over a master surface: jump, law and forces of a step (docs/theory.md §3.5)."""

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from cutsim.base.assembly import owned_vector
from cutsim.base.checks import require
from cutsim.base.kinematics import Expr
from cutsim.fields.faces import Face
from cutsim.fields.points import FacetPoints, Values
from cutsim.fields.state import State
from cutsim.interface.history import GAUSS, TRAPEZOID, InterfaceHistory
from cutsim.pairs.configuration import Pairs
from cutsim.pairs.material_partners import MaterialPartners
from cutsim.pairs.nodal_forces import Action, Coupling, Slope
from cutsim.pairs.pair_forces import PairForces, add_pattern
from cutsim.pairs.pair_law import PairLaw, PairLaws
from cutsim.pairs.paired_field import HotterSide
from cutsim.pairs.pairing import Array
from cutsim.pairs.partners import DEGREES, PairKinematics


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
    jump is a function of the points, which is found beforehand.  On surfaces that slide far a bond has partners of its
    own, see `PairLaw`.

    Args:
        state: Displacement and time.
        name: Name of the slave surface.
        points: Integration points on the slave facets.
        kinematics: Find the jump: one for contact, friction and bond, or one for contact and friction and another one
            for the bond.
        laws: Laws.
        weight: Factor of the virtual work.
        tool: Temperature of a rigid master, as friction feels it.

    Attributes:
        points: Integration points.
        kinematics: Finds the partners that they touch.
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
        kinematics: Sequence[PairKinematics],
        laws: PairLaws,
        *,
        weight: float,
        tool: Expr | None = None,
    ) -> None:
        self._state, self.points, self.kinematics, self.weight = state, points, kinematics[0], weight
        self._all = tuple(kinematics)
        self._dim = state.mesh.geometry.dim
        own = np.where(self.kinematics.slave.owned[:, None], points.weights, 0.0)
        self.weights = weight * own.ravel()
        rule = GAUSS if isinstance(self.kinematics, MaterialPartners) else TRAPEZOID
        self.history = InterfaceHistory(state.memory, name, points, laws.cohesive, rule, ("held",))
        self._warmth = HotterSide.of(laws.friction, points, self.kinematics, tool)
        felt = None if self._warmth is None else self._warmth.value
        self._law = PairLaw(state, name, points, laws, self.history, self._pairs_at(self._start()), felt)
        self.slip, self.viscous = self._law.slip, self._law.viscous
        self._seen: Array | None = None
        self._force = state.memory.value(f"{name}: force", np.zeros(self._dim))

    @property
    def force(self) -> Array:
        """Force on the slave surface in the trial state [force]."""
        return self._force.trial

    @property
    def bonded(self) -> Values:
        """1 at the points with a partner that a cohesive law may bond them to, else 0."""
        return self._law.bonded

    # -- configurations -------------------------------------------------------------------------------------------

    def partners(self) -> Pairs:
        """Pairs that touch at the present displacement; the law knows their jump, and that of the bond, then."""
        return self._now()[0]

    def _now(self) -> tuple[Pairs, ...]:
        """Pairs of each kind at the present displacement; the law knows their jumps then."""
        u = self._state.u.x.array
        # the search is collective: all ranks look again, or none
        same = self._seen is not None and np.array_equal(u, self._seen)
        if not self._state.mesh.comm.allreduce(same, op=MPI.LAND):
            self._pairs = self._pairs_at(self.kinematics.nodes(u))
            self._seen = u.copy()
            self._law.set_pairs(self._pairs)
        return self._pairs

    def _pairs_at(self, nodes: tuple[Array, Array]) -> tuple[Pairs, ...]:
        return tuple(kinematics.pairs(nodes) for kinematics in self._all)

    def _shaped(self, values: Array) -> Values:
        return values.reshape(self.points.weights.shape)

    def begin(self) -> None:
        """Start a step from the committed displacement."""
        for kinematics in self._all:
            kinematics.begin(self._start())
        self._seen = None
        if self._warmth is not None:
            self._warmth.feel(self.partners().hits)

    def evaluate(self) -> None:
        """Trial history, and the force on the slave, of the converged trial displacement."""
        ends = self._start(), self.kinematics.nodes(self._state.u.x.array)
        self.history.evaluate(lambda s: self._along(ends, s))
        for part in (self.slip, self.viscous):
            if part is not None:
                part.evaluate()
        self._force.trial = self._state.mesh.comm.allreduce(self.point_forces().sum(axis=0))
        for kinematics, pairs in zip(self._all, self._now(), strict=True):
            kinematics.note(pairs)

    def point_forces(self) -> Array:
        """Present forces on the slave at the points, shape (points, dimension); zero where another rank adds them."""
        return np.asarray(sum(self.weights[:, None] * action.traction() for action in self._forces().actions))

    def _start(self) -> tuple[Array, Array]:
        return self.kinematics.nodes(self._state.u_old.x.array, start=True)

    def _along(self, ends: tuple[tuple[Array, Array], ...], s: float) -> dict[str, Values]:
        """Values on the way of the step, see `cutsim.interface.history.Along`."""
        (slave, master), (slave_end, master_end) = ends
        pairs = self._pairs_at(((1 - s) * slave + s * slave_end, (1 - s) * master + s * master_end))
        self._law.set_pairs(pairs)
        values, touching = self._law.values(), pairs[0]
        change = touching.increment(self.kinematics.slave.at_points(slave_end - slave), master_end - master)
        power = np.einsum("nai,ni->na", touching.slave.frames, change)
        return values | {
            "contact_power": -values["pressure"] * self._shaped(power[:, 0]),
            "opening": self._shaped(touching.jump[:, 0]),
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

    def _forces(self, *, linearised: bool = False) -> PairForces:
        """Forces at the present displacement, with or without their derivatives."""
        pairs = self._now()
        tractions, stiffness, coupling = self._law.linear() if linearised else self._law.constant()
        actions = [
            Action(kinematics, there, self.weights, values, rate)
            for kinematics, there, values, rate in zip(self._all, pairs, tractions, stiffness, strict=True)
        ]
        return PairForces(actions, None if coupling is None else Coupling(actions[0], actions[1], coupling))

    @property
    def rate_dependent(self) -> bool:
        """Whether friction or bond depend on how long a step takes."""
        return self.viscous is not None or (self.slip is not None and self.slip.rate_dependent)

    @property
    def pattern(self) -> int:
        """Number of the sparsity pattern."""
        return self.kinematics.version

    def prepare(self) -> None:
        """Nothing: partners are found when forces are asked for."""

    def add_forces(self, b: PETSc.Vec, along: Array | None) -> None:
        """Add nodal forces, as `cutsim.base.terms.Assembler.add_forces`."""
        self._forces(linearised=along is not None).add(b, along)

    def rate_forces(self) -> Array | None:
        """Nodal forces of the viscosity of the bond, owned entries; None without it."""
        return None if self.viscous is None else self._owned(Action, self.viscous.values().reshape(-1, self._dim))

    def path_measure(self) -> tuple[float, Array]:
        """What the bond loses in the step, and the derivative, see `cutsim.base.terms.Dissipating`."""
        self._now()
        loss, slope = self._law.loss()
        return self.weight * self.points.integral(loss), self._owned(Slope, slope)

    def _owned(self, kind: type[Action], values: Array) -> Array:
        """Owned nodal values of what acts between the points and their last partners."""
        dofmap, none = self._state.V.dofmap, np.zeros((*values.shape, self._dim))
        b = owned_vector(dofmap.index_map, dofmap.index_map_bs)
        PairForces([kind(self._all[-1], self._now()[-1], self.weights, values, none)]).add(b)
        b.assemble()
        forces = b.array.copy()
        b.destroy()
        return forces

    def add_tangent(self, A: PETSc.Mat) -> None:
        """Add the tangent, as `cutsim.base.terms.Assembler.add_tangent`."""
        self._forces(linearised=True).add_tangent(A)

    def add_pattern(self, A: PETSc.Mat) -> None:
        """Add zeros, as `cutsim.base.terms.Assembler.add_pattern`."""
        add_pattern(A, self._all)
