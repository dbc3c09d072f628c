"""Crack on predefined facets, with one law for closing and opening (docs/theory.md §1, 3; thesis 4.10, 4.41).

Closed, the law is penalty contact; open, a cohesive law with irreversible damage.  '+' and '−' are fixed by region, the
jump is δ = u⁻ − u⁺, the normal n points from '+' to '−', and the traction acts as T on the '+' face, as −T on the '−'
face: T·n > 0 pulls them together.
"""

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
import ufl
from numpy.typing import NDArray

from cutsim.base.checks import positive, require, require_number
from cutsim.base.compat import EntityMaps
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.terms import Term
from cutsim.fields.faces import Face
from cutsim.fields.points import Surface, Values
from cutsim.fields.sizes import facet_size, largest_extent, normal_size
from cutsim.fields.state import State
from cutsim.fields.symmetry import SymmetryPlane
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.crack_faces import CrackFaces
from cutsim.interface.crack_friction import CrackFriction
from cutsim.interface.crack_viscosity import CrackViscosity
from cutsim.interface.doubts import doubt_law, doubt_penetration
from cutsim.interface.history import InterfaceHistory
from cutsim.interface.path_measure import PathMeasure
from cutsim.interface.point_fields import PointFields
from cutsim.interface.rubbing import AnyFriction, check_friction
from cutsim.interface.sides import sides_of
from cutsim.interface.viscous import ViscousBond

#: Fields of a crack for output.
FIELDS = ("damage", "strength_loss", "spent", "opening", "sliding", "pressure", "dissipated")
# pressure over that of faces which look at each other that counts as none
_ROUNDING = 1e-9
# its contact knows no other partners than those that met at the start
_CURE = "a stiffer contact is needed or, where they slide past each other, symmetric or sliding faces"


class Crack(PointFields):
    """Modified contact on a set of interior facets of a cracked space.

    Args:
        state: Displacement (on a space that is cracked along the facets) and time.
        facets: Local interior facets, ghosts included; with plus=None facets of the outer boundary.
        plus: The side called '+': its local cells (ghosts included) or a direction e with n⁺·e > 0. None if only this
            side is meshed: the facets lie in a plane of symmetry, in which the other one is its image, and all
            energies are those of the side that is meshed.
        law: Cohesive law; None for a crack that is already broken, with contact only.
        young: Young's modulus of the softer neighbour, for the automatic penalty and the mesh check [stress].
        name: Name in messages and output.
        contact: Contact law of the closed crack; by default a penalty of 10 E/h.
        friction: Friction, a friction law, or the coefficient of Coulomb's, None for none.
        allowed_penetration: If given, Uzawa augmentation until no point penetrates more than this [length].
        normal: "current" mid-surface normal (large rotation) or "reference" (small strain).
        closing: Whether closed faces press on the points that they met in the reference configuration. Faces that slide
            over each other need False, and a `SurfacePair` of the two beside the crack for pressure and friction.

    Attributes:
        young: Young's modulus of the softer neighbour [stress].
        entities: Rows (cell⁺, local facet⁺, cell⁻, local facet⁻), flattened, of the facets owned by this rank; without
            the last two in a plane of symmetry.
        points: Its integration points, with the facets in the order of all per-facet arrays.
        history: What they remember.
        faces: Its sides, meshed or not, and kinematics and tractions of the faces at a displacement.
        path_measure: Gives what the bond loses in a step, see `cutsim.base.terms.Dissipating`.
        friction: Friction of the faces, or None.
        closing: Whether closed faces press on each other.
        viscosity: Viscosity of the bond, or None.
        normal_size: Mean size of the neighbouring cells across the crack, the h of the penalty [length].

    Raises:
        ValueError: A parameter is outside its range, or the facets are not a crack of the mesh.
    """

    symmetric = False

    @checked
    def __init__(
        self,
        state: State,
        facets: NDArray[np.int32],
        plus: NDArray[np.int32] | tuple[float, ...] | None,
        law: CohesiveLaw | None = None,
        *,
        young: float,
        name: str = "crack",
        contact: PenaltyContact | None = None,
        friction: AnyFriction = None,
        allowed_penetration: float | None = None,
        normal: Literal["current", "reference"] = "current",
        closing: bool = True,
    ) -> None:
        require_number("young", young, positive)
        require_number("allowed_penetration", allowed_penetration, positive.or_none)
        check_friction("friction", friction)
        for parameter, value in {"friction": friction, "allowed_penetration": allowed_penetration}.items():
            require(parameter, value, closing or not value, "None with closing=False: a pair of the faces takes it")
        require("friction", friction, plus is not None or not friction, "None: a face does not slide on its image")
        self.name, self.state, self.law, self.young = name, state, law, young
        self._allowed_penetration = allowed_penetration
        sides = sides_of(state, np.asarray(facets, dtype=np.int32), plus, name, current=normal == "current")
        self.points, self.entities = sides.points, sides.entities
        self.normal_size = self.points.mean(normal_size(state.mesh, self.points.facets))
        self.contact = contact or PenaltyContact.automatic(young, self.normal_size)
        if law is not None:
            doubt_law(state.verdict, name, law, young, self.size, largest_extent(state.mesh))
        self.history = InterfaceHistory(state.memory, name, self.points, law)
        self.closing, augmented = closing, allowed_penetration is not None
        pressing = self.contact if closing else None
        self.faces = CrackFaces(state, sides, self.history, law, pressing, augmented=augmented)
        self.path_measure = PathMeasure(state, sides, self.faces, self.history)
        self.friction = CrackFriction(self, friction) if friction else None
        self.viscosity = CrackViscosity(self, law) if isinstance(law, ViscousBond) else None

    @property
    def size(self) -> float:
        """Median size of the facets along the crack, whose end may be coarser [length]. Collective."""
        return self.points.median(facet_size(self.state.mesh, self.points.facets))

    @property
    def plane(self) -> SymmetryPlane | None:
        """Plane of symmetry in which it lies; None if both sides are meshed."""
        return self.faces.sides.plane

    @property
    def companions(self) -> Sequence[Term]:
        """Friction of the faces and viscosity of the bond."""
        return [part for part in (self.friction, self.viscosity) if part is not None]

    # -- virtual work ---------------------------------------------------------------------------------------------

    @property
    def entity_maps(self) -> EntityMaps:
        """Map from facets of the mesh to cells of the crack's submesh."""
        return self.points.entity_maps

    @property
    def facet_fields(self) -> tuple[str, ...]:
        """Fields for output, averaged over each facet; none without a law."""
        return () if self.law is None else FIELDS

    @property
    def meshed(self) -> tuple[Face, ...]:
        """Its faces, '+' first; in a plane of symmetry this one alone. Collective."""
        return self.faces.sides.meshed

    @property
    def facet_energy(self) -> float:
        """Energy that breaks a facet of mean size in opening; 0 without a law."""
        if self.law is None:
            return 0.0
        return self.faces.sides.share * self.law.toughness * self.points.mean(self.points.weights.sum(axis=1))

    def surface(self, side: Literal["+", "-"]) -> Surface:
        """One face of the crack, which a tool can touch. Collective."""
        return Surface.of(self.state, self.face(side))

    def face(self, side: Literal["+", "-"]) -> Face:
        """One face of the crack, for a pair of surfaces. Collective."""
        return self.faces.sides.face(side)

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work ∫ T·(v⁻ − v⁺) dΓ₀ of cohesive traction and contact pressure."""
        response = self.faces.response(self.state.u)
        traction = response.cohesive - response.pressure * response.normal
        return self.faces.virtual_work(traction, v)

    # -- history --------------------------------------------------------------------------------------------------

    def evaluate(self) -> None:
        """Trial history, and the work of the step integrated along the path of the displacement. Collective."""
        self.history.evaluate(self.faces.values)

    def augment(self) -> bool:
        """Uzawa step λ ← p (thesis 4.33) if a closed point is off by more than is allowed. Collective."""
        if self._allowed_penetration is None:
            return False
        pressure = self.faces.values(1.0)["pressure"]
        return self.history.augment(pressure, self.contact.stiffness * self._allowed_penetration)

    def energies(self) -> dict[str, float]:
        """Recoverable and dissipated part of the cohesive work, and the energy of the contact penalty. Collective."""
        return {name: self.faces.sides.share * energy for name, energy in self.history.energies().items()}

    def damage_increment(self) -> float:
        """Largest growth of damage at a point in the trial step. Collective."""
        return self.history.damage_increment() if self.law is not None else 0.0

    def diagnose(self) -> str | None:
        """Say where the trial state of the last solve opens or closes most. Collective."""
        values = self.faces.values(1.0)
        opening, penetration = self.points.maximum(values["opening"]), self._penetration(values)
        return f"{self.name}: largest opening {opening:.3g}, largest penetration {penetration:.3g}"

    def _penetration(self, values: Mapping[str, Values]) -> float:
        """Largest penetration of a point that is pressed, as faces that turn away are not. Collective."""
        depth = -values["opening"]
        pressed = values["pressure"] > _ROUNDING * self.contact.stiffness * np.abs(depth)
        return max(self.points.maximum(np.where(pressed, depth, 0.0)), 0.0)

    def penetration(self) -> float:
        """Largest penetration of a pressed point over the normal mesh size. Collective."""
        return self._penetration(self.history.trial) / self.normal_size

    def watch(self) -> None:
        """Doubt faces that lie deep in each other. Collective."""
        blend = self.contact.blend / self.normal_size
        doubt_penetration(self.state.verdict, self.name, self.penetration(), blend, _CURE)

    def record(self) -> dict[str, tuple[float, str]]:
        """Broken area ∫ max(D_n, D_t) dΓ₀, largest opening, penetration over the normal mesh size. Collective."""
        columns = {
            f"{self.name}_opening": (self.points.maximum(self.history.trial["opening"]), "length"),
            f"{self.name}_penetration": (self.penetration(), "one"),
        }
        if self.law is not None:
            kind = self.state.facet_measure
            columns[f"{self.name}_broken"] = (self.points.integral(self.history.trial["damage"]), kind)
        return columns

    def point_values(self, name: str) -> Values:
        """Trial values at the integration points, shape (local crack facets, points).

        Args:
            name: "damage" (4.26, 4.27), "strength_loss", "spent" (the larger of both modes, see
                `cutsim.interface.damage`), "opening", "sliding", "pressure", "stored" or "dissipated".

        Raises:
            ValueError: The name is unknown.
        """
        return self.history.point_values(name)

    def dissipation(self) -> Values:
        """Fracture dissipation of the trial step at the integration points [energy per reference area]."""
        return self.history.dissipation()
