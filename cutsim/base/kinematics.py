"""Kinematics of large deformation in pure UFL, without a mesh or a state.

Bulk tensors are three-dimensional also for plane problems, so that every strain energy is written once.
Interface vectors keep the geometric dimension of the mesh.
"""

from typing import Any

import ufl
from ufl.geometry import FacetJacobian

Expr = Any  # UFL ships no type stubs; every symbolic argument and result has this name


def deformation_gradient(u: Expr, stretch: Expr = 1.0) -> Expr:
    """Deformation gradient F = I + ∇u as a 3 × 3 tensor.

    Args:
        u: Displacement, a vector of the geometric dimension (2 or 3).
        stretch: Stretch λ₃ out of the plane, used for two-dimensional meshes only (1 is plane strain).

    Returns:
        F, dimensionless; det F > 0 for an admissible deformation.
    """
    H = ufl.grad(u)
    if u.ufl_shape[0] == 3:
        return ufl.Identity(3) + H
    return ufl.as_tensor([[1 + H[0, 0], H[0, 1], 0], [H[1, 0], 1 + H[1, 1], 0], [0, 0, stretch]])


def right_cauchy_green(F: Expr) -> Expr:
    """Right Cauchy–Green tensor C = FᵀF."""
    return F.T * F


def green_lagrange(F: Expr) -> Expr:
    """Green–Lagrange strain E = ½(C − I)."""
    return 0.5 * (F.T * F - ufl.Identity(3))


def small_strain(F: Expr) -> Expr:
    """Infinitesimal strain ε = sym(F) − I."""
    return ufl.sym(F) - ufl.Identity(3)


def cofactor(A: Expr) -> Expr:
    """Cofactor matrix cof A = det(A) A⁻ᵀ, without division, for 2 × 2 and 3 × 3 matrices."""
    if A.ufl_shape == (2, 2):
        return ufl.as_tensor([[A[1, 1], -A[1, 0]], [-A[0, 1], A[0, 0]]])
    rows = [ufl.as_vector([A[i, j] for j in range(3)]) for i in range(3)]
    cross = [ufl.cross(rows[(i + 1) % 3], rows[(i + 2) % 3]) for i in range(3)]
    return ufl.as_tensor([[cross[i][j] for j in range(3)] for i in range(3)])


def midsurface_normal(u: Expr, N: Expr) -> Expr:
    """Unit normal of the current mid-surface of a crack, from '+' to '−' (docs/theory.md §1).

    Nanson's formula with the mean of the two deformation gradients, n = cof(½(F⁺ + F⁻)) N⁺ / |…|.

    Args:
        u: Displacement on a cracked space (unrestricted).
        N: Reference facet normal of the mesh (unrestricted).

    Returns:
        Unit vector of the geometric dimension, for use on interior facets.
    """
    F = ufl.Identity(len(u)) + 0.5 * (ufl.grad(u)("+") + ufl.grad(u)("-"))
    n = cofactor(F) * N("+")
    return n / ufl.sqrt(ufl.dot(n, n))


def facing(u: Expr, N: Expr) -> Expr:
    """Whether the two faces of a crack face each other, 1 if they do and 0 if not.

    Falls smoothly from 1 to 0 while the current normals of the faces turn from 60° to 90° against each other.  Faces
    that have turned further apart cannot touch, and the normal of their mid-surface has no meaning.

    Args:
        u: Displacement on a cracked space (unrestricted).
        N: Reference facet normal of the mesh (unrestricted).
    """
    plus, minus = (cofactor(ufl.Identity(len(u)) + ufl.grad(u)(side)) * N("+") for side in ("+", "-"))
    x = 2 * ufl.dot(plus, minus) / ufl.sqrt(ufl.dot(plus, plus) * ufl.dot(minus, minus))
    rising = ufl.conditional(ufl.gt(x, 0), x**2 * (3 - 2 * x), 0.0)
    return ufl.conditional(ufl.lt(x, 1), rising, 1.0)


def surface_frame(u: Expr, mesh: Any, n: Expr, *, current: bool) -> tuple[Expr, ...]:
    """Unit tangents of a crack that turn with its mid-surface: components along them are objective.

    The first is the image F̄ A of an edge A of the facet under the mean deformation gradient F̄ = ½(F⁺ + F⁻), the second
    completes it to a right-handed frame with n.

    Args:
        u: Displacement on a cracked space (unrestricted).
        mesh: The mesh.
        n: Unit normal of the mid-surface, from '+' to '−'.
        current: Whether n is the normal of the current mid-surface; else of the reference one.

    Returns:
        One unit vector in 2-D, two in 3-D, for use on interior facets.
    """
    if len(n) == 2:
        return tangents(n)
    edge = FacetJacobian(mesh)("+")[:, 0]
    if current:
        edge = edge + 0.5 * (ufl.grad(u)("+") + ufl.grad(u)("-")) * edge
    return tangents(n, edge)


def tangents(n: Expr, edge: Expr | None = None) -> tuple[Expr, ...]:
    """Unit tangents that complete a unit normal: one in 2-D, in 3-D two of which the first is along an edge."""
    if edge is None:
        return (ufl.as_vector([-n[1], n[0]]),)
    first = edge / ufl.sqrt(ufl.dot(edge, edge))
    return first, ufl.cross(n, first)


def displacement_jump(u: Expr) -> Expr:
    """Displacement jump δ = u⁻ − u⁺ (positive along n⁺ when the crack opens)."""
    return u("-") - u("+")


def tangential(vector: Expr, n: Expr) -> Expr:
    """Part of a vector tangential to the surface with unit normal n."""
    return vector - ufl.dot(vector, n) * n


def safe_norm(vector: Expr, floor: float) -> Expr:
    """Euclidean norm √(v·v + floor²) − floor, differentiable at zero.

    Args:
        vector: Any UFL vector.
        floor: Positive number of the vector's unit, far below its relevant size.
    """
    return ufl.sqrt(ufl.dot(vector, vector) + floor**2) - floor
