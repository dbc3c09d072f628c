"""The two cubes of `cubes` in GetFEM: same meshes, energy, supports and steps; contact without penalty.

Needs GetFEM's Python interface (the Debian package python3-getfem; run with the system's Python).  The last line is
what was found. Forces on both cubes go to the error stream: with `--version 0`, GetFEM's default, they differ once
facets hang over an edge.
"""

import argparse
import json
import sys
import time

import getfem as gf
import numpy as np
from cubes import CELLS, DRAW, EDGE, FRICTION, POISSON, PRESS, STEPS, YOUNG

BOTTOM, TOP = 1, 2


class Cube:
    """A cube and its displacement in a model."""

    def __init__(self, model: gf.Model, name: str, cells: int, bottom: float) -> None:
        side = np.linspace(0, EDGE, cells + 1)
        self.mesh, self.name = gf.Mesh("cartesian", side, side, bottom + side), name
        faces = self.mesh.outer_faces()
        up = self.mesh.normal_of_faces(faces)[2]
        self.mesh.set_region(BOTTOM, faces[:, up < -0.9])
        self.mesh.set_region(TOP, faces[:, up > 0.9])
        self.space = gf.MeshFem(self.mesh, 3)
        self.space.set_fem(gf.Fem("FEM_QK(3,1)"))
        self.points = gf.MeshIm(self.mesh, gf.Integ("IM_GAUSS_PARALLELEPIPED(3,4)"))
        self.model = model
        model.add_fem_variable(name, self.space)
        model.add_fem_data(f"{name}_old", self.space)
        shear, lame = YOUNG / 2 / (1 + POISSON), YOUNG * POISSON / (1 + POISSON) / (1 - 2 * POISSON)
        F = f"(Id(3)+Grad_{name})"
        energy = f"{shear}/2*(Norm_sqr{F}-3)-{shear}*log(Det{F})+{lame}/2*sqr(log(Det{F}))"
        model.add_nonlinear_term(self.points, energy)

    def support(self, region: int) -> None:
        """Prescribe the displacement of a face."""
        self.model.add_filtered_fem_variable(f"{self.name}_force", self.space, region)
        self.model.add_initialized_data(f"{self.name}_path", [0.0] * 3)
        names = self.name, f"{self.name}_force", region, f"{self.name}_path"
        self.model.add_Dirichlet_condition_with_multipliers(self.points, *names)
        self.region = region

    def force(self) -> np.ndarray:
        """Reaction of the support."""
        parts = [f"{self.name}_force({i})" for i in (1, 2, 3)]
        return np.ravel([gf.asm("generic", self.points, 0, part, self.region, self.model) for part in parts])


def touch(model: gf.Model, slave: tuple[Cube, int], master: tuple[Cube, int], stiffness: float, version: int) -> None:
    """Contact of a face of a cube with that of another, by a multiplier on the slave."""
    (cube, region), (other, face) = slave, master
    model.add_filtered_fem_variable("pressure", cube.space, region)
    for name, value in {"r": stiffness, "friction": FRICTION, "alpha": 1.0}.items():
        model.add_initialized_data(name, [value])
    brick = model.add_integral_large_sliding_contact_brick_raytracing("r", 1.5, "friction", "alpha", version)
    model.add_slave_contact_boundary_to_large_sliding_contact_brick(
        brick, cube.points, region, cube.name, "pressure", f"{cube.name}_old"
    )
    model.add_master_contact_boundary_to_large_sliding_contact_brick(
        brick, other.points, face, other.name, f"{other.name}_old"
    )


def main() -> None:
    """Print what was found, and the forces at the end of each step."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("upper", type=int, nargs="?", default=CELLS[0])
    parser.add_argument("lower", type=int, nargs="?", default=CELLS[1])
    parser.add_argument("--below", action="store_true", help="slave surface below")
    parser.add_argument("--version", type=int, default=1, help="1: symmetric, 0: GetFEM's default")
    parser.add_argument("--stiffness", type=float, default=10.0, help="of the augmentation, r in N/mm³")
    options = parser.parse_args()
    model = gf.Model("real")
    upper, lower = Cube(model, "upper", options.upper, EDGE), Cube(model, "lower", options.lower, 0.0)
    surfaces = [(upper, BOTTOM), (lower, TOP)]
    touch(model, *(surfaces[::-1] if options.below else surfaces), options.stiffness, options.version)
    upper.support(TOP)
    lower.support(BOTTOM)
    total, normal, start = 0, [], time.process_time()
    for step in range(1, sum(STEPS) + 1):
        press, draw = min(step / STEPS[0], 1.0), max(step - STEPS[0], 0) / STEPS[1]
        model.set_variable("upper_path", [DRAW * draw, 0.0, -PRESS * press])
        for cube in (upper, lower):
            model.set_variable(f"{cube.name}_old", model.variable(cube.name))
        total += model.solve("max_iter", 60, "max_res", 1e-9, "lsearch", "simplest", "alpha min", 0.2)[0]
        forces = f"upper {upper.force().round(4)}, lower {lower.force().round(4)} N"
        print(f"{step:3d} {total:4d} iterations; {forces}", file=sys.stderr)
        normal.append(upper.force()[2])
    values = {
        "normal force, pressed": normal[STEPS[0] - 1],
        "drag at the end": -upper.force()[0],
        "normal force at the end": normal[-1],
    }
    seconds = time.process_time() - start
    unknowns = upper.space.nbdof() + lower.space.nbdof()
    found = {"values": values, "iterations": total, "seconds": seconds, "unknowns": unknowns}
    print(json.dumps(found | {"version": gf.getfem_env("version")}))


if __name__ == "__main__":
    main()
