"""Fields as .vtu files: read back by pyvista, in series, on a cracked body, and in a run that goes on."""

import numpy as np
import pytest
import pyvista
import ufl
from dolfinx import fem, mesh
from dolfinx.mesh import CellType, GhostMode
from mpi4py import MPI

from cutsim.fields.meshing import tag_mesh
from cutsim.fields.space import cracked_space
from cutsim.results import field_files
from cutsim.results.field_files import FieldWriter

COMM = MPI.COMM_WORLD


@pytest.fixture
def folder(tmp_path):
    return COMM.bcast(tmp_path)


def halves(cell, degree):
    """A displacement on a unit square or cube whose upper half moves off the lower one, and the facets between them."""
    ghosts = GhostMode.shared_facet
    if cell in (CellType.triangle, CellType.quadrilateral):
        domain = mesh.create_unit_square(COMM, 2, 2, cell, ghost_mode=ghosts)
    else:
        domain = mesh.create_unit_cube(COMM, 2, 2, 2, cell, ghost_mode=ghosts)
    up = domain.geometry.dim - 1
    tagged = tag_mesh(domain, {"upper": lambda x: x[up] > 0.5 - 1e-9}, {"crack": lambda x: np.isclose(x[up], 0.5)})
    facets = tagged.facets("crack")
    u = fem.Function(cracked_space(domain, ("Lagrange", degree, (up + 1,)), facets), name="u")
    opened = fem.Function(u.function_space)
    opened.interpolate(lambda x: np.stack([x[0] ** degree, *(0 * x[:up])])[: up + 1])
    u.x.array[:] = opened.x.array
    lift = fem.Function(u.function_space)
    lift.interpolate(lambda x: np.stack([*(0 * x[:up]), 0 * x[0] + 0.25]), tagged.cells("upper"))
    u.x.array[:] += lift.x.array
    u.x.scatter_forward()
    return u, facets


SPACES = [
    pytest.param(cell, degree, marks=[pytest.mark.mpi] * (cell == CellType.hexahedron), id=f"{cell.name} {degree}")
    for cell in (CellType.triangle, CellType.quadrilateral, CellType.tetrahedron, CellType.hexahedron)
    for degree in (1, 2)
]


@pytest.mark.parametrize(("cell", "degree"), SPACES)
def test_a_cracked_body_opens_in_pyvista(folder, cell, degree):
    u, _ = halves(cell, degree)
    dim = u.function_space.mesh.geometry.dim
    with FieldWriter(folder, u, format="vtu") as writer:
        writer.write(0.0)
        u.x.array[:] *= 2
        writer.write(0.125)
    if COMM.rank == 0:
        series = pyvista.get_reader(folder / "displacement.pvd")
        assert series.time_values == [0.0, 0.125]
        for time, factor in zip(series.time_values, (1, 2), strict=True):
            series.set_active_time_value(time)
            grid = series.read()[0]
            values, points = grid.point_data["u"], grid.points
            assert values.shape == (len(points), 3)
            assert values[:, 0] == pytest.approx(factor * points[:, 0] ** degree)
            upper = values[:, dim - 1] > 0
            assert values[upper, dim - 1] == pytest.approx(0.25 * factor)
            # the nodes of the crack are there twice
            assert np.isclose(points[upper, dim - 1], 0.5).sum() == np.isclose(points[~upper, dim - 1], 0.5).sum() > 0
            sizes = grid.compute_cell_sizes(length=False)["Area" if dim == 2 else "Volume"]
            assert sizes.sum() == pytest.approx(1)
            opened = grid.warp_by_vector("u").split_bodies(label=False)
            assert len(opened) == 2


@pytest.mark.mpi
def test_derived_fields_and_crack_surfaces(folder):
    u, facets = halves(CellType.quadrilateral, 1)
    crack = mesh.create_submesh(u.function_space.mesh, 1, facets)[0]
    damage = fem.Function(fem.functionspace(crack, ("DG", 0)), name="damage")
    damage.x.array[:] = 0.625
    with FieldWriter(folder, u, {"H": ufl.grad(u), "J": u[0] + 3}, {"crack": [damage]}, format="vtu") as writer:
        writer.write(1.0)
    if COMM.rank == 0:
        fields, surface = (pyvista.read(folder / name / "000000.vtu") for name in ("fields", "crack"))
        assert fields.point_data["H"].shape == (16, 9)
        assert fields.point_data["H"][:, 0] == pytest.approx(1)
        assert not fields.point_data["H"][:, [2, 5, 8]].any()
        assert np.unique(fields.point_data["J"].round(12)).tolist() == [3.25, 3.75]
        assert set(fields.point_data.keys()) == {"H", "J", "u"}
        assert surface.cell_data["damage"] == pytest.approx([0.625, 0.625])
        assert surface.points[:, 1] == pytest.approx(0.5) and surface.n_cells == 2


@pytest.mark.mpi
def test_a_run_that_goes_on_replaces_what_was_written_after_it(folder):
    u, _ = halves(CellType.quadrilateral, 1)
    for times, anew in (((0.0, 0.1, 0.2), True), ((0.2, 0.3), False)):
        with FieldWriter(folder, u, anew=anew, format="vtu") as writer:
            for time in times:
                u.x.array[:] = 1 + time
                writer.write(time)
                # at any moment the list names files that are there
                if COMM.rank == 0:
                    series = pyvista.get_reader(folder / "displacement.pvd")
                    assert series.time_values[-1] == time
    if COMM.rank == 0:
        assert series.time_values == [0.0, 0.1, 0.2, 0.3]
        assert series.read()[0].point_data["u"][0, 0] == 1.0
        assert pyvista.read(folder / "displacement" / "000003.vtu").point_data["u"][0, 0] == 1.3
    with FieldWriter(folder, u, format="vtu") as writer:
        writer.write(5.0)
    assert len(COMM.bcast(list((folder / "displacement").iterdir()))) == 1


def test_without_adios_the_files_are_vtu(folder, monkeypatch):
    u, _ = halves(CellType.quadrilateral, 1)
    monkeypatch.setattr(field_files, "has_adios2", False)
    with FieldWriter(folder, u) as writer:
        writer.write(0.0)
    assert COMM.bcast((folder / "displacement.pvd").exists())
    with pytest.raises(ValueError, match=r"format = 'vtx' .* no ADIOS2"):
        FieldWriter(folder, u, format="vtx")
    with pytest.raises(ValueError, match="format = 'vtk'"):
        FieldWriter(folder, u, format="vtk")
