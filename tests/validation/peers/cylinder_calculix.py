"""The cylinder of `cylinder` in CalculiX, with face-to-face contact: writes the input, runs ccx, reads the output."""

import json
import re
import resource
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from mpi4py import MPI

from cutsim.base.compat import geometry_nodes

sys.path.append(str(Path(__file__).parents[2]))
import cylinder

# nodes of a triangle of degree 2 as CalculiX counts them, and the corners of its faces
_ORDER = [0, 1, 2, 5, 3, 4]
_FACES = ((0, 1), (1, 2), (2, 0))


def lines(numbers: Iterable[int]) -> str:
    """Numbers, eight to a line."""
    found = [str(number) for number in numbers]
    return "".join(", ".join(found[i : i + 8]) + ",\n" for i in range(0, len(found), 8))


def write(path: Path) -> int:
    """Write the input; the number of unknowns."""
    problem, domain = cylinder.LINES, cylinder.LINES.mesh(MPI.COMM_SELF)
    mesh = domain.mesh
    x, nodes = mesh.geometry.x, geometry_nodes(mesh)[:, _ORDER].copy()
    first, second = x[nodes[:, 1]] - x[nodes[:, 0]], x[nodes[:, 2]] - x[nodes[:, 0]]
    turned = first[:, 0] * second[:, 1] < first[:, 1] * second[:, 0]
    nodes[turned] = nodes[turned][:, [0, 2, 1, 5, 4, 3]]  # counterclockwise
    mesh.topology.create_connectivity(1, 2)
    mesh.topology.create_connectivity(1, 0)
    corners = mesh.topology.connectivity(2, 0)
    of_vertex = {}
    for cell, row in enumerate(geometry_nodes(mesh)[:, :3]):
        of_vertex.update(zip(corners.links(cell), row, strict=True))

    def faces(facets: np.ndarray) -> list[tuple[int, int]]:
        """Element and number of its face, from one."""
        found = []
        for facet in facets:
            cell = mesh.topology.connectivity(1, 2).links(facet)[0]
            ends = {of_vertex[v] for v in mesh.topology.connectivity(1, 0).links(facet)}
            number = next(i for i, face in enumerate(_FACES) if {nodes[cell][j] for j in face} == ends)
            found.append((cell + 1, number + 1))
        return found

    def on(facets: np.ndarray) -> list[int]:
        """Nodes on some facets, from one."""
        found = set()
        for cell, number in faces(facets):
            found |= {nodes[cell - 1][j] + 1 for j in (*_FACES[number - 1], number + 2)}
        return sorted(found)

    text = ["*NODE, NSET=ALL\n"]
    text += [f"{i}, {p[0]:.12g}, {p[1]:.12g}, 0.\n" for i, p in enumerate(x, start=1)]
    for name, material in (("upper", problem.upper), ("lower", problem.lower)):
        text.append(f"*ELEMENT, TYPE=CPE6, ELSET={name}\n")
        text += [f"{c + 1}, " + ", ".join(str(n + 1) for n in nodes[c]) + "\n" for c in domain.cells(name)]
        text.append(f"*MATERIAL, NAME=M{name}\n*ELASTIC\n{material.young}, {material.poisson}\n")
        text.append(f"*SOLID SECTION, ELSET={name}, MATERIAL=M{name}\n1.\n")
        text.append(f"*SURFACE, NAME=S{name}, TYPE=ELEMENT\n")
        text += [f"{cell}, S{number}\n" for cell, number in faces(domain.facets(f"contact_{name}"))]
    text.append(f"*NSET, NSET=centre\n{cylinder.centre(mesh, domain.cells('lower')) + 1}\n")
    for name in ("top", "bottom"):
        text.append(f"*NSET, NSET={name}\n" + lines(on(domain.facets(name))))
    text.append(
        "*SURFACE INTERACTION, NAME=I\n"
        f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{problem.contact.stiffness:.12g}\n"
        "*CONTACT PAIR, INTERACTION=I, TYPE=SURFACE TO SURFACE\nSupper, Slower\n"
        f"*STEP, INC=1000\n*STATIC, DIRECT\n{1 / problem.steps[0]}, 1.\n"
        f"*BOUNDARY\nbottom, 1, 2\ntop, 1, 1\ntop, 2, 2, {-problem.approach:.12g}\n"
        f"*NODE PRINT, NSET=top, TOTALS=ONLY, FREQUENCY={problem.steps[0]}\nRF\n"
        f"*NODE PRINT, NSET=centre, FREQUENCY={problem.steps[0]}\nU\n"
        f"*CONTACT PRINT, SLAVE=Supper, MASTER=Slower, FREQUENCY={problem.steps[0]}\nCSTR\n"
        "*END STEP\n"
    )
    path.write_text("".join(text))
    return 2 * len(x)


def read(path: Path) -> dict[str, float]:
    """What was found, from the tables of the output, each below a line that says what it is."""
    tables: dict[str, list[list[float]]] = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        if any(letter.isalpha() and letter != "E" for letter in line):
            title = line.split("(")[0].strip()
            tables[title] = []
        elif line.strip():
            tables[title].append([float(number) for number in line.split()])
    return {
        "load": -tables["total force"][0][1],
        "centre of the block": tables["displacements"][0][2],
        "largest pressure": max(row[2] for row in tables["contact stress"]),
    }


def main() -> None:
    """Print what was found."""
    with TemporaryDirectory() as folder:
        unknowns = write(Path(folder, "cylinder.inp"))
        done = subprocess.run(["ccx", "cylinder"], cwd=folder, capture_output=True, text=True, check=True)
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        values = read(Path(folder, "cylinder.dat"))
        steps = [line.split() for line in Path(folder, "cylinder.sta").read_text(encoding="utf-8").splitlines()]
    iterations = sum(int(row[3]) for row in steps if row and row[0].isdigit())
    version = re.search(r"Version (\S+)", done.stdout)
    found = {"values": values, "iterations": iterations, "seconds": used.ru_utime, "unknowns": unknowns}
    print(json.dumps(found | {"version": version[1].rstrip(",") if version else ""}))


if __name__ == "__main__":
    main()
