"""A crack: one law for closing and opening on predefined facets (docs/theory.md §1, 3; thesis 4.10, 4.41).

Closed, the law is penalty contact; open, a cohesive law with irreversible damage.  '+' and '−' are fixed by region, the
jump is δ = u⁻ − u⁺, the normal n points from '+' to '−', and the traction acts as T on the '+' face, as −T on the '−'
face: T·n > 0 pulls them together.
"""

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import basix.ufl
import numpy as np
import ufl
from dolfinx import default_scalar_type, fem, la
from dolfinx.mesh import Mesh, create_submesh
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.checks import require
from cutsim.cohesive import CohesiveLaw, process_zone_element
from cutsim.compat import form
from cutsim.contact import PenaltyContact
from cutsim.kinematics import Expr, displacement_jump, midsurface_normal, safe_norm
from cutsim.parameters import with_constants
from cutsim.sizes import facet_size, normal_size
from cutsim.space import crack_measure_entities
from cutsim.state import State
from cutsim.terms import Term

logger = logging.getLogger(__name__)

# Gauss points on the straight path of the displacement over a step, on which interface work is integrated
_PATH, _PATH_WEIGHTS = (0.5 * (a + b) for a, b in zip(np.polynomial.legendre.leggauss(5), (1.0, 0.0), strict=True))
# relative distance below its history at which a point still counts as loading
_AT_HISTORY = 1e-9
# what is known at each integration point
_COLUMNS = ("demand", "cohesive_power", "contact_power", "stored", "damage", "opening", "sliding", "pressure")


@dataclass(frozen=True)
class Surface:
    """A surface that a tool can touch: a facet measure and, for a crack, the side of it.

    Args:
        measure: Facet measure.
        side: "+" or "-" on a crack, None on the outer boundary.
    """

    measure: ufl.Measure
    side: Literal["+", "-"] | None = None

    @classmethod
    def exterior(cls, state: State, facets: NDArray[np.int32]) -> "Surface":
        """A part of the outer boundary, given by its local facets."""
        return cls(state.measures.exterior(facets))

    def restrict(self, f: Expr) -> Expr:
        """Restriction of an expression to the side."""
        return f if self.side is None else f(self.side)


@dataclass(frozen=True)
class _Response:
    """The law at a displacement: symbolic, at an integration point."""

    jump: Expr
    opening: Expr
    sliding: Expr
    demand: Expr
    cohesive: Expr
    pressure: Expr
    normal: Expr


class Crack(Term):
    """Modified contact on a set of interior facets of a cracked space.

    Args:
        state: Displacement (on a space that is cracked along the facets) and time.
        facets: Local interior facets, ghosts included.
        plus: The side called '+': its local cells (ghosts included) or a direction e with n⁺·e > 0.
        law: Cohesive law; None for a crack that is already broken, with contact only.
        young: Young's modulus of the softer neighbour, for the automatic penalty and the mesh check [stress].
        name: Name in messages and output.
        contact: Contact law of the closed crack; by default a penalty of 10 E/h.
        penetration: If given, Uzawa augmentation until no point penetrates more than this [length].
        normal: "current" mid-surface normal (large rotation) or "reference" (small strain).
        closing_range: Jump beyond which closing fades out, because the mid-surface normal of wide-open, rotated
            faces has no meaning [length]; by default the larger of 3 ε_n and the facet size.

    Attributes:
        submesh: Mesh of the crack's facets.
        facets: Local facet of the parent mesh for each cell of the submesh; the order of all per-facet arrays.
        entities: Rows (cell⁺, local facet⁺, cell⁻, local facet⁻), flattened, of the facets owned by this rank.
        size: Mean size of the facets along the crack, their shortest edge [length].
        normal_size: Mean size of the neighbouring cells across the crack, the h of the penalty [length].

    Raises:
        ValueError: A parameter is outside its range, or the facets are not a crack of the mesh.
    """

    symmetric = False

    def __init__(
        self,
        state: State,
        facets: NDArray[np.int32],
        plus: NDArray[np.int32] | tuple[float, ...],
        law: CohesiveLaw | None = None,
        *,
        young: float,
        name: str = "crack",
        contact: PenaltyContact | None = None,
        penetration: float | None = None,
        normal: Literal["current", "reference"] = "current",
        closing_range: float | None = None,
    ) -> None:
        require("young", young, young > 0, "> 0")
        require("normal", normal, normal in ("current", "reference"), "'current' or 'reference'")
        require("penetration", penetration, penetration is None or penetration > 0, "> 0 or None")
        require("closing_range", closing_range, closing_range is None or closing_range > 0, "> 0 or None")
        self.name, self.state, self.law = name, state, law
        self._current = normal == "current"
        self._allowed_penetration = penetration
        self.entities = crack_measure_entities(state.mesh, facets, plus)
        self.dS = state.measures.interior(self.entities)(
            metadata={"quadrature_degree": 4, "quadrature_scheme": "default"}
        )
        self._make_history(np.asarray(facets, dtype=np.int32))
        self.size = self._mean(facet_size(state.mesh, self.facets))
        self.normal_size = self._mean(normal_size(state.mesh, self.facets))
        self.contact = contact or PenaltyContact.automatic(young, self.normal_size)
        self._symbolic_law = None if law is None else with_constants(state.mesh, law)
        self._symbolic_contact = with_constants(state.mesh, self.contact)
        floor = 3 * law.opening if law is not None else 0.0
        self._range = fem.Constant(state.mesh, default_scalar_type(closing_range or max(floor, self.size)))
        self._warn_coarse(young)
        self._s = fem.Constant(state.mesh, default_scalar_type(1.0))
        self._points_form = form(self._point_values(), entity_maps=self.entity_maps)

    # -- virtual work ---------------------------------------------------------------------------------------------

    @property
    def entity_maps(self) -> Mapping[Mesh, NDArray[np.int32]]:
        """Map from facets of the mesh to cells of the crack's submesh."""
        return {self.submesh: self._facet_to_cell}

    @property
    def facet_energy(self) -> float:
        """Energy that breaks a facet of mean size in opening; 0 without a law."""
        return self.law.toughness[0] * self._mean(self.weights.sum(axis=1)) if self.law is not None else 0.0

    def surface(self, side: Literal["+", "-"]) -> Surface:
        """One face of the crack, for tool contact."""
        return Surface(self.dS, side)

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work ∫ T·(v⁻ − v⁺) dΓ₀ of cohesive traction and contact pressure."""
        response = self._response(self.state.u)
        traction = response.cohesive - response.pressure * response.normal
        return ufl.inner(traction, displacement_jump(v)) * self.dS

    def _response(self, u: Expr) -> _Response:
        law, contact = self._symbolic_law, self._symbolic_contact
        N = ufl.FacetNormal(self.state.mesh)
        n = midsurface_normal(u, N) if self._current else N("+")
        jump = displacement_jump(u)
        gap = ufl.dot(jump, n)
        slide = jump - gap * n
        opening = ufl.conditional(ufl.ge(gap, 0), gap, 0.0)
        multiplier = self._multiplier("+") / contact.stiffness if self._allowed_penetration else 0.0
        fade = ufl.exp(-((ufl.dot(jump, jump) / self._range**2) ** 2))
        pressure = fade * contact.pressure(multiplier - gap)
        if law is None:
            return _Response(jump, gap, safe_norm(slide, 1e-12), ufl.as_ufl(0.0), 0 * jump, pressure, n)
        sliding = safe_norm(slide, 1e-12 * law.opening)
        demand = law.demand(opening, sliding)
        kappa = self._history(demand)
        k_n, k_t = law.stiffness(opening, sliding, kappa)
        return _Response(jump, gap, sliding, demand, k_n * opening * n + k_t * slide, pressure, n)

    def _history(self, demand: Expr) -> Expr:
        """Largest demand so far, the present one included.

        A step starts with every point exactly at its history.  There it counts as loading, so that Newton's first
        tangent is that of the growing crack, and not a mixture of loading and unloading points drawn by rounding.
        """
        kappa = self._kappa("+")
        return ufl.conditional(ufl.gt(demand, (1 - _AT_HISTORY) * kappa), demand, kappa)

    # -- history --------------------------------------------------------------------------------------------------

    def _make_history(self, facets: NDArray[np.int32]) -> None:
        mesh, fdim = self.state.mesh, self.state.mesh.topology.dim - 1
        self.submesh, parents = create_submesh(mesh, fdim, np.unique(facets))[:2]
        self.facets = np.asarray(parents, dtype=np.int32)
        facet_map = mesh.topology.index_map(fdim)
        self._facet_to_cell = np.full(facet_map.size_local + facet_map.num_ghosts, -1, dtype=np.int32)
        self._facet_to_cell[parents] = np.arange(len(parents), dtype=np.int32)
        cell = self.submesh.topology.cell_name()
        scalar = fem.functionspace(self.submesh, basix.ufl.quadrature_element(cell, degree=4))
        self._values = fem.functionspace(
            self.submesh, basix.ufl.quadrature_element(cell, value_shape=(len(_COLUMNS),), degree=4)
        )
        self._kappa = fem.Function(scalar)
        self._multiplier = fem.Function(scalar)
        self._multiplier_old = np.zeros_like(self._multiplier.x.array)
        # both spaces have the same points in each cell, but number them on their own
        cells = self.submesh.topology.index_map(fdim)
        self._owned = cells.size_local
        self._scalar_dofs = scalar.dofmap.list
        self._value_dofs = self._values.dofmap.list
        weights = ufl.inner(ufl.as_vector([1.0] * len(_COLUMNS)), ufl.TestFunction(self._values)("+")) * self.dS
        self.weights = self._assemble(form(weights, entity_maps=self.entity_maps))[..., 0]
        shape = self._value_dofs.shape
        self._trial = {name: np.zeros(shape) for name in _COLUMNS}
        self._work = {name: np.zeros(shape) for name in ("cohesive", "contact")}
        self._work_old = {name: np.zeros(shape) for name in self._work}
        self._trial_old = self._trial

    def _assemble(self, compiled: fem.Form) -> NDArray[np.float64]:
        """Point vector, shape (local crack facets, points, columns), equal on owner and ghosts."""
        b = fem.assemble_vector(compiled)
        b.scatter_reverse(la.InsertMode.add)
        b.scatter_forward()
        return b.array.reshape(-1, len(_COLUMNS))[self._value_dofs]

    def _point_values(self) -> ufl.Form:
        u_s = self.state.u_old + self._s * (self.state.u - self.state.u_old)
        r = self._response(u_s)
        increment = displacement_jump(self.state.u) - displacement_jump(self.state.u_old)
        law = self._symbolic_law
        damage = ufl.as_ufl(1.0) if law is None else law.damage(self._history(r.demand))[0]
        columns = {
            "demand": r.demand,
            "cohesive_power": ufl.dot(r.cohesive, increment),
            "contact_power": -r.pressure * ufl.dot(r.normal, increment),
            "stored": 0.5 * ufl.dot(r.cohesive, r.jump),
            "damage": damage,
            "opening": r.opening,
            "sliding": r.sliding,
            "pressure": r.pressure,
        }
        test = ufl.TestFunction(self._values)("+")
        return ufl.inner(ufl.as_vector([columns[name] for name in _COLUMNS]), test) * self.dS

    def _evaluate_at(self, s: float) -> dict[str, NDArray[np.float64]]:
        """All columns at the fraction s of the step's displacement increment."""
        self._s.value = s
        values = self._assemble(self._points_form) / self.weights[..., None]
        return {name: values[..., i] for i, name in enumerate(_COLUMNS)}

    def evaluate(self) -> None:
        """Trial history, and the work of the step integrated along the path of the displacement. Collective."""
        self._work = {name: work.copy() for name, work in self._work_old.items()}
        for s, weight in zip(_PATH, _PATH_WEIGHTS, strict=True):
            values = self._evaluate_at(s)
            for name in self._work:
                self._work[name] += weight * values[f"{name}_power"]
        self._trial = self._evaluate_at(1.0)

    def augment(self) -> bool:
        """Uzawa step λ ← p (thesis 4.33) if a closed point is off by more than is allowed. Collective.

        p − λ is the penalty times the penetration; where the crack has opened again, it is what λ still pushes.
        """
        if self._allowed_penetration is None:
            return False
        pressure = self._evaluate_at(1.0)["pressure"]
        change = np.abs(pressure - self._multiplier.x.array[self._scalar_dofs])
        if self._max(change) <= self.contact.stiffness * self._allowed_penetration:
            return False
        self._multiplier.x.array[self._scalar_dofs] = pressure
        return True

    def rollback(self) -> None:
        """Restore the contact multiplier, and what is known at the points, of the committed state."""
        self._multiplier.x.array[:] = self._multiplier_old
        self._trial, self._work = self._trial_old, self._work_old

    def commit(self) -> None:
        """Adopt history, work and multiplier of the step."""
        kappa = self._kappa.x.array
        kappa[self._scalar_dofs] = np.maximum(kappa[self._scalar_dofs], self._trial["demand"])
        self._multiplier_old[:] = self._multiplier.x.array
        self._work_old = self._work
        self._trial_old = self._trial

    # -- reductions -----------------------------------------------------------------------------------------------

    def integral(self, values: NDArray[np.float64]) -> float:
        """Integral over the reference crack of values at the integration points, as `point_values`. Collective."""
        owned = slice(0, self._owned)
        return float(self.state.mesh.comm.allreduce((values * self.weights)[owned].sum(), op=MPI.SUM))

    def _max(self, values: NDArray[np.float64]) -> float:
        local = float(values[: self._owned].max(initial=-np.inf))
        return float(self.state.mesh.comm.allreduce(local, op=MPI.MAX))

    def energies(self) -> dict[str, float]:
        """Recoverable and dissipated part of the cohesive work, and the energy of the contact penalty. Collective."""
        stored = self.integral(self._trial["stored"])
        return {
            "cohesive_stored": stored,
            "fracture": self.integral(self._work["cohesive"]) - stored,
            "contact": self.integral(self._work["contact"]),
        }

    def damage_increment(self) -> float:
        """Largest growth of damage at a point in the trial step. Collective."""
        return self._max(self._trial["damage"] - self._trial_old["damage"]) if self.law is not None else 0.0

    def diagnose(self) -> str | None:
        """Say where the trial state of the last solve opens or closes most. Collective."""
        values = self._evaluate_at(1.0)
        opening, penetration = self._max(values["opening"]), self._max(-values["opening"])
        return f"{self.name}: largest opening {opening:.3g}, largest penetration {max(penetration, 0.0):.3g}"

    def record(self) -> dict[str, tuple[float, str]]:
        """Broken area ∫ D dΓ₀, largest opening, penetration over the normal mesh size. Collective."""
        penetration = max(self._max(-self._trial["opening"]), 0.0) / self.normal_size
        columns = {
            f"{self.name}_opening": (self._max(self._trial["opening"]), "length"),
            f"{self.name}_penetration": (penetration, "one"),
        }
        if self.law is not None:
            kind = "length" if self.state.mesh.geometry.dim == 2 else "area"
            columns[f"{self.name}_broken"] = (self.integral(self._trial["damage"]), kind)
        return columns

    def point_values(self, name: str) -> NDArray[np.float64]:
        """Trial values at the integration points, shape (local crack facets, points).

        Args:
            name: "damage", "opening", "sliding", "pressure", "stored" or "dissipated".

        Raises:
            ValueError: The name is unknown.
        """
        if name == "dissipated":
            return self._work["cohesive"] - self._trial["stored"]
        require("name", name, name in _COLUMNS, f"one of {(*_COLUMNS, 'dissipated')}")
        return self._trial[name]

    def facet_mean(self, name: str) -> NDArray[np.float64]:
        """Mean over each local crack facet of a point quantity; arguments as `point_values`."""
        return (self.point_values(name) * self.weights).sum(axis=1) / self.weights.sum(axis=1)

    def _mean(self, per_facet: NDArray[np.float64]) -> float:
        total = np.array([per_facet[: self._owned].sum(), self._owned])
        total = self.state.mesh.comm.allreduce(total, op=MPI.SUM)
        return float(total[0] / total[1])

    def _warn_coarse(self, young: float) -> None:
        if self.law is None:
            return
        allowed = process_zone_element(self.law, young)
        if self.size > allowed:
            logger.warning(
                "%s: facets of %.3g do not resolve the process zone (opening %.3g): use %.3g or less",
                self.name, self.size, self.law.opening, allowed,
            )  # fmt: skip
