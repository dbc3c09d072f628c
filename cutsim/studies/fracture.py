"""Fracture parameters: energy-release rate of a stationary crack, and closed forms for comparison.

Energy-release rates are positive when growth along the given direction releases energy.
"""

from dataclasses import dataclass
from math import inf, sqrt
from typing import Literal

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import compute_midpoints
from numpy.typing import ArrayLike

from cutsim.base.arrays import Array
from cutsim.base.assembly import integrate
from cutsim.base.checks import between, nonnegative, positive, require, require_number, require_numbers
from cutsim.base.compat import form
from cutsim.bodies.solid import Solid
from cutsim.interface.crack import Crack

#: χ of `EndNotchedBeam` for isotropic arms, whatever Poisson's ratio (Bao, Ho, Suo and Fan 1992).
ENF_CORRECTION = 0.206


class JIntegral:
    """J-integral of a crack front over a domain around it (Shih, Moran and Nakamura 1986).

    J = 1/b ∫ (P : (∇u e ⊗ ∇q) − W e·∇q) dX over the reference configuration, where q falls smoothly from 1 within
    `inner` to 0 beyond `outer`, e is the direction of growth and b the length of the front.  This is minus the
    derivative of the strain energy with respect to a motion q e of the material points, hence valid for any elastic
    material, at any strain, and exact for the discrete energy.  Within `outer` the body is homogeneous and without
    body forces, and its faces, the crack's above all, are parallel to e and carry no traction, or are held.

    Args:
        solid: The body around the front.
        tip: A point of the front.
        direction: Direction of growth, in the crack plane and normal to the front; its length does not matter.
        inner: Radius within which q = 1 [length].
        outer: Radius beyond which q = 0 [length].
        front: Direction of the straight front in 3-D; q depends on the distance from it. None in 2-D.
        length: Length of the front in the body, over which J is the mean [length]; in 2-D the thickness to which the
            energy refers, 1.

    Raises:
        ValueError: A vector has the wrong dimension or no length, the radii are not 0 ≤ inner < outer, or the length
            is not positive.
    """

    def __init__(
        self,
        solid: Solid,
        tip: tuple[float, ...],
        direction: tuple[float, ...],
        inner: float,
        outer: float,
        *,
        front: tuple[float, ...] | None = None,
        length: float = 1.0,
    ) -> None:
        gdim = solid.state.mesh.geometry.dim
        plain = not (solid.state.axisymmetric or solid.assemblers)
        require("solid", solid.name, plain, "a body that is not axisymmetric, without mixed elements")
        require_numbers("tip", tip, length=gdim)
        require_numbers("direction", direction, length=gdim)
        require("direction", direction, any(direction), "not all zero")
        require_number("outer", outer, positive)
        require_number("inner", inner, between(0, outer, "[)", name="outer"))
        require_number("length", length, positive)
        if gdim == 3:
            require("front", front, front is not None and len(front) == 3 and any(front), "3 numbers, not all zero")
        else:
            require("front", front, front is None, "None on a 2-D mesh")
        self._length = length
        q = _plateau(solid, np.asarray(tip), None if front is None else np.asarray(front), inner, outer)
        self._form = form(_release(solid, np.asarray(direction) / np.linalg.norm(direction), q))

    def __call__(self) -> float:
        """J of the present displacement [force/length]. Collective."""
        return integrate(self._form) / self._length


def _plateau(solid: Solid, tip: Array, front: Array | None, inner: float, outer: float) -> fem.Function:
    """Weight q, 1 within the inner and 0 beyond the outer radius, in a space in which its gradient is exact."""
    V = solid.state.V
    q = fem.Function(fem.functionspace(V.mesh, ("Lagrange", V.ufl_element().degree)))

    def value(x: Array) -> Array:
        arm = x[: len(tip)].T - tip
        if front is not None:
            axis = front / np.linalg.norm(front)
            arm = arm - np.outer(arm @ axis, axis)
        s = np.clip((outer - np.linalg.norm(arm, axis=1)) / (outer - inner), 0.0, 1.0)
        return s * s * (3 - 2 * s)

    q.interpolate(value)
    return q


def _release(solid: Solid, direction: Array, q: fem.Function) -> ufl.Form:
    """Rate at which the strain energy falls when the material points move by q e."""
    gdim, u = len(direction), solid.state.u
    e = ufl.as_vector([*direction, *[0.0] * (3 - gdim)])
    slope = ufl.grad(q)
    grad_q = ufl.as_vector([*(slope[i] for i in range(gdim)), *[0.0] * (3 - gdim)])
    F = ufl.variable(solid.deformation_gradient(u))
    grad_u = F - ufl.Identity(3)
    total = ufl.Form([])
    for W, dx in zip(solid.energy_parts(F), solid.measures, strict=True):
        total += (ufl.inner(ufl.diff(W, F), ufl.outer(grad_u * e, grad_q)) - W * ufl.dot(e, grad_q)) * dx
    return total


def crack_profile(crack: Crack, name: str, axis: int = 0) -> tuple[Array, Array]:
    """A quantity along a crack, averaged over the facets with the same coordinate. Collective.

    Args:
        crack: The crack.
        name: Quantity, as in `Crack.point_values`.
        axis: Coordinate along the crack.

    Returns:
        Ascending coordinates of the facets' midpoints [length] and the means there, the same on all ranks.

    Raises:
        ValueError: The quantity or the axis is unknown.
    """
    mesh = crack.points.submesh
    require("axis", axis, axis in range(mesh.geometry.dim), f"0 … {mesh.geometry.dim - 1}")
    owned = np.arange(mesh.topology.index_map(mesh.topology.dim).size_local, dtype=np.int32)
    middle = compute_midpoints(mesh, mesh.topology.dim, owned)[:, axis]
    rows = np.column_stack([middle, crack.facet_mean(name)[owned]])
    x, values = np.concatenate(mesh.comm.allgather(rows)).T
    places, column = np.unique(np.round(x, 6), return_inverse=True)
    return places, np.bincount(column, values) / np.bincount(column)


def crack_front(
    crack: Crack, axis: int = 0, name: str = "damage", level: float = 0.5, *, backwards: bool = False
) -> float:
    """Place where a quantity falls below a level along the coordinate in which the crack grows [length]. Collective.

    Args:
        crack: The crack.
        axis: The coordinate.
        name: As for `Crack.point_values`.
        level: Level; by default the front is where the damage (4.26, 4.27) is one half.
        backwards: Whether the crack grows against the coordinate.
    """
    places, values = crack_profile(crack, name, axis)
    order = slice(None, None, -1 if backwards else 1)
    return float(np.interp(-level, -values[order], places[order]))


def plane_modulus(young: float, poisson: float, plane: Literal["strain", "stress"] = "strain") -> float:
    """Modulus E' of plane problems: E/(1 − ν²) in plane strain, E in plane stress [stress].

    Raises:
        ValueError: A parameter is outside its range.
    """
    require_number("young", young, positive)
    require_number("poisson", poisson, between(-1, 0.5, "(]"))
    require("plane", plane, plane in ("strain", "stress"), "'strain' or 'stress'")
    return young / (1 - poisson**2) if plane == "strain" else young


def stress_intensity(release: float, modulus: float) -> float:
    """Stress intensity K_I = √(G E') in pure opening [stress·√length]; `modulus` is E' of `plane_modulus`.

    Raises:
        ValueError: The energy-release rate is negative or the modulus not positive.
    """
    require_number("release", release, nonnegative)
    require_number("modulus", modulus, positive)
    return sqrt(release * modulus)


def energy_release_from_compliance(
    loads: ArrayLike, displacements: ArrayLike, lengths: ArrayLike, thickness: float
) -> Array:
    """Energy-release rates G = P²/(2B) d(δ/P)/da of linear bodies that differ in crack length alone (Irwin and Kies).

    Args:
        loads: Load P on each of them [force].
        displacements: Displacement δ of its point of application along it [length].
        lengths: Crack lengths, increasing [length].
        thickness: Length B of the front [length].

    Returns:
        G at each length, by central differences (one-sided, and so less accurate, at the ends) [force/length].

    Raises:
        ValueError: There are fewer than two lengths, or they do not increase, or the thickness is not positive.
    """
    P, a = np.asarray(loads, dtype=np.float64), _increasing(lengths)
    require_number("thickness", thickness, positive)
    return 0.5 * P**2 / thickness * np.gradient(np.asarray(displacements) / P, a)


def energy_release_from_energy(energies: ArrayLike, lengths: ArrayLike, thickness: float) -> Array:
    """Energy-release rates G = −1/B dU/da at fixed prescribed displacements, for any elastic body.

    Args:
        energies: Strain energy U of bodies that differ in crack length alone [energy].
        lengths: Crack lengths, increasing [length].
        thickness: Length B of the front [length].

    Returns:
        G at each length, by central differences (one-sided, and so less accurate, at the ends) [force/length].

    Raises:
        ValueError: There are fewer than two lengths, or they do not increase, or the thickness is not positive.
    """
    require_number("thickness", thickness, positive)
    return -np.gradient(np.asarray(energies, dtype=np.float64), _increasing(lengths)) / thickness


def _increasing(lengths: ArrayLike) -> Array:
    a = np.asarray(lengths, dtype=np.float64)
    require("lengths", lengths, a.ndim == 1 and a.size > 1 and bool(np.all(np.diff(a) > 0)), "two or more, increasing")
    return a


@dataclass(frozen=True)
class BentBeam:
    """Notched beam in three-point bending with a span of four heights (SENB; ASTM E399, thesis 4.92, 4.93).

    Args:
        height: Height W > 0 of the beam, along the crack [length].
        thickness: Thickness B > 0 [length].

    Raises:
        ValueError: A dimension is not positive.
    """

    height: float
    thickness: float

    def __post_init__(self) -> None:
        require_number("height", self.height, positive)
        require_number("thickness", self.thickness, positive)

    @property
    def span(self) -> float:
        """Distance S = 4 W of the supports [length]."""
        return 4 * self.height

    def shape(self, notch: float) -> float:
        """f(a/W) [–], within 0.5 % of the exact value for all 0 < a/W < 1.

        Raises:
            ValueError: The notch is not between 0 and the height.
        """
        require_number("notch", notch, between(0, self.height, name="height"))
        x = notch / self.height
        polynomial = 1.99 - x * (1 - x) * (2.15 - 3.93 * x + 2.7 * x**2)
        return 3 * sqrt(x) * polynomial / (2 * (1 + 2 * x) * (1 - x) ** 1.5)

    def stress_intensity(self, load: float, notch: float) -> float:
        """K_I = P S f(a/W) / (B W^1.5) of a load P and a notch of length a [stress·√length].

        Raises:
            ValueError: The notch is not between 0 and the height.
        """
        return load * self.span * self.shape(notch) / (self.thickness * self.height**1.5)

    def critical_load(self, toughness: float, notch: float, modulus: float) -> float:
        """Load at which K_I reaches √(G_c E') [force].

        Args:
            toughness: G_c [force/length].
            notch: Length a of the notch [length].
            modulus: E' of `plane_modulus` [stress].

        Raises:
            ValueError: The notch is not between 0 and the height, or another argument is out of range.
        """
        return stress_intensity(toughness, modulus) / self.stress_intensity(1.0, notch)


@dataclass(frozen=True)
class CantileverBeams:
    """Double cantilever beam (DCB) by beam theory, with crack length a + χh (Williams 1989).

    Args:
        height: Height h > 0 of each arm [length].
        thickness: Thickness b > 0 [length].
        modulus: Young's modulus along the arms, E' in plane strain, > 0 [stress].
        correction: χ ≥ 0 [–]; 0 for arms clamped at the tip, `crack_length_correction` for a better estimate.

    Raises:
        ValueError: A parameter is outside its range.
    """

    height: float
    thickness: float
    modulus: float
    correction: float = 0.0

    def __post_init__(self) -> None:
        for name in ("height", "thickness", "modulus"):
            require_number(name, getattr(self, name), positive)
        require_number("correction", self.correction, nonnegative)

    @property
    def rigidity(self) -> float:
        """Bending stiffness E I of an arm [force·length²]."""
        return self.modulus * self.thickness * self.height**3 / 12

    def load(self, opening: float, length: float) -> float:
        """Load P that opens the ends by `opening` in total with a crack of the given length [force]."""
        return 1.5 * self.rigidity * opening / (length + self.correction * self.height) ** 3

    def propagation(self, toughness: float, length: float) -> tuple[float, float]:
        """Load and total opening at which a crack of the given length grows [force, length]."""
        effective = length + self.correction * self.height
        load = sqrt(toughness * self.thickness * self.rigidity) / effective
        return load, load * effective**3 / (1.5 * self.rigidity)


def crack_length_correction(young: float, shear: float, *, across: float | None = None) -> float:
    """χ = √(E₁₁/(11 G₁₃) (3 − 2 (Γ/(1+Γ))²)), Γ = 1.18 √(E₁₁ E₂₂)/G₁₃, of DCB arms (Williams 1989) [–].

    It makes up for what the arms turn and shear beyond the front; 0.663 for isotropic arms with ν = 0.3.

    Args:
        young: Modulus E₁₁ along the arms [stress].
        shear: Shear modulus G₁₃ in the plane in which they bend [stress].
        across: Modulus E₂₂ normal to the crack [stress]; None for isotropic arms.

    Raises:
        ValueError: A modulus is not positive.
    """
    require_number("young", young, positive)
    require_number("shear", shear, positive)
    require_number("across", across, positive.or_none)
    gamma = 1.18 * sqrt(young * (young if across is None else across)) / shear
    return sqrt(young / (11 * shear) * (3 - 2 * (gamma / (1 + gamma)) ** 2))


@dataclass(frozen=True)
class EndNotchedBeam:
    """End-notched flexure (ENF): three-point bending of two bonded arms, with a crack from one pin (mode II).

    Beam theory with crack length a' = a + χh.  Both arms bend alike: each carries half of the shear force P/2 of the
    cracked part, and they press on each other with P/4 above the pin.  There friction μP/4 holds the arms back by a
    couple of arm h, which relieves the front like a crack shorter by 2μh/3.  This is so while the faces slide on: while
    the load rises or the crack grows.

        G = 9 P² (a' − 2μh/3)² / (16 E b² h³),    deflection = P ((3a'³ + 2L³ − 3μha'²)/(8Ebh³) + 3L/(10 G_s b h)),
        slip of the faces above the pin = 3 P a' (a' − 4μh/3) / (2Ebh²).

    Source: without friction and correction Russell and Street (1982); correction Bao, Ho, Suo and Fan (1992), shear
    deflection by Timoshenko's theory, friction from the balance of two arms (docs/theory.md §7).

    Args:
        height: Height h > 0 of each arm [length].
        thickness: Thickness b > 0 [length].
        half_span: Distance L > 0 from a pin to the load in the middle [length].
        modulus: Young's modulus E along the arms, E' in plane strain, > 0 [stress].
        shear: Shear modulus G_s > 0 [stress]; infinite for beams that are rigid in shear.
        correction: χ ≥ 0 [–]; 0 for arms clamped at the tip, `ENF_CORRECTION` for isotropic ones.
        friction: Coefficient μ ≥ 0 of Coulomb friction between the faces [–].

    Raises:
        ValueError: A parameter is outside its range.
    """

    height: float
    thickness: float
    half_span: float
    modulus: float
    shear: float = inf
    correction: float = 0.0
    friction: float = 0.0

    def __post_init__(self) -> None:
        for name in ("height", "thickness", "half_span", "modulus"):
            require_number(name, getattr(self, name), positive)
        require_number("shear", self.shear, positive.or_inf)
        for name in ("correction", "friction"):
            require_number(name, getattr(self, name), nonnegative)

    def release(self, load: float, length: float) -> float:
        """Energy-release rate G in sliding under a load P, with a crack of the given length [force/length].

        Raises:
            ValueError: The crack does not end between pin and load.
        """
        relieved = self._effective(length) - 2 * self.friction * self.height / 3
        return 9 * load**2 * relieved**2 / (16 * self.modulus * self.thickness**2 * self.height**3)

    def compliance(self, length: float) -> float:
        """Deflection under the load over the load, while the faces slide on [length/force].

        Raises:
            ValueError: The crack does not end between pin and load.
        """
        a, h, b, L = self._effective(length), self.height, self.thickness, self.half_span
        bending = (3 * a**3 + 2 * L**3 - 3 * self.friction * h * a**2) / (8 * self.modulus * b * h**3)
        return bending + 0.3 * L / (self.shear * b * h)

    def slip(self, load: float, length: float) -> float:
        """Sliding of the faces on each other above the pin [length].

        Raises:
            ValueError: The crack does not end between pin and load.
        """
        a, h = self._effective(length), self.height
        return 1.5 * load * a * (a - 4 * self.friction * h / 3) / (self.modulus * self.thickness * h**2)

    def propagation(self, toughness: float, length: float) -> tuple[float, float]:
        """Load and deflection at which a crack of the given length grows [force, length]; stable from a' = 0.69 L on.

        Raises:
            ValueError: The crack does not end between pin and load, or the toughness is not positive.
        """
        require_number("toughness", toughness, positive)
        load = sqrt(toughness / self.release(1.0, length))
        return load, load * self.compliance(length)

    def _effective(self, length: float) -> float:
        require_number("length", length, between(0, self.half_span, name="half_span"))
        return length + self.correction * self.height
