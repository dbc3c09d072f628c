"""Pictures show what was computed: grids keep measures and faces apart, PNGs are not blank."""

import logging
import sys

import matplotlib.colors
import matplotlib.image
import numpy as np
import pytest
import pyvista
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.base.compat import cell_partitioner
from cutsim.bodies.loads import Support, Traction
from cutsim.fields.space import cracked_space
from cutsim.results import grids, pictures, plots, setup_picture
from cutsim.results.grids import gather_facets, gather_grid
from cutsim.results.pictures import draw_body, save
from cutsim.results.plots import COLOURS, Curve, distinct, plot_curves, plot_energy, plot_parts
from cutsim.results.setup_picture import draw_setup
from cutsim.results.tool_surfaces import revolved
from helpers.blocks import make_blocks

SHAPES = ("triangle", "quadrilateral", "tetrahedron", "hexahedron")


def torn(shape, degree):
    """The unit square or cube with its right half moved by 0.25, damage = y at the crack between."""
    kind = mesh.CellType[shape]
    partitioner = cell_partitioner()
    make = mesh.create_unit_square if mesh.cell_dim(kind) == 2 else mesh.create_unit_cube
    domain = make(MPI.COMM_WORLD, *(mesh.cell_dim(kind) * [4]), kind, partitioner=partitioner)
    tdim = domain.topology.dim
    facets = mesh.locate_entities(domain, tdim - 1, lambda x: np.isclose(x[0], 0.5))
    u = fem.Function(cracked_space(domain, ("Lagrange", degree, (tdim,)), facets))
    right = mesh.locate_entities(domain, tdim, lambda x: x[0] > 0.5 - 1e-9)
    u.interpolate(lambda x: np.stack([0.25 + 0 * x[0], *(tdim - 1) * [0 * x[0]]]), cells0=right)
    u.x.scatter_forward()
    height = fem.Function(fem.functionspace(domain, ("DG", 0)))
    height.interpolate(lambda x: x[1])
    return u, height, facets, mesh.compute_midpoints(domain, tdim - 1, facets)[:, 1]


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("shape", SHAPES)
def test_gathered_body_is_whole_and_torn(shape, degree):
    u, height, facets, damage = torn(shape, degree)
    local = np.full(u.function_space.mesh.topology.index_map(u.function_space.mesh.topology.dim).size_local, 7.0)
    grid = gather_grid(u, {"height": height, "seven": local})
    faces = gather_facets(u, facets, damage)
    if MPI.COMM_WORLD.rank > 0:
        assert grid is None and faces is None
        return
    assert grid.n_points == u.function_space.dofmap.index_map.size_global
    body = grid.warp_by_vector("u").compute_cell_sizes()
    measure = "Area" if body.celltypes[0] in (5, 9, 69, 70) else "Volume"
    assert np.sum(body[measure]) == pytest.approx(1.0)
    assert body.bounds[:4] == pytest.approx((0.0, 1.25, 0.0, 1.0))
    assert not np.any((body.points[:, 0] > 0.51) & (body.points[:, 0] < 0.74))
    np.testing.assert_allclose(grid["height"], grid.cell_centers().points[:, 1], atol=1e-12)
    assert set(grid["seven"]) == {7.0}
    torn_faces = faces.warp_by_vector("u")
    sides = torn_faces.cell_centers().points[:, 0]
    assert np.count_nonzero(np.isclose(sides, 0.5)) == np.count_nonzero(np.isclose(sides, 0.75)) == len(sides) // 2
    np.testing.assert_array_equal(sides > 0.6, faces["middle"][:, 0] > 0.5)
    sizes = faces.compute_cell_sizes()
    assert np.sum(sizes["Area" if measure == "Volume" else "Length"]) == pytest.approx(2.0)
    np.testing.assert_allclose(faces["damage"], faces.cell_centers().points[:, 1], atol=1e-12)


@pytest.mark.mpi
def test_rows_must_fit_on_every_rank():
    u, _, facets, damage = torn("quadrilateral", 1)
    with pytest.raises(ValueError, match="length of stress"):
        gather_grid(u, {"stress": np.zeros(3 if MPI.COMM_WORLD.rank == 0 else 0)})
    with pytest.raises(ValueError, match="length of damage"):
        gather_facets(u, facets, np.zeros(len(damage) + (MPI.COMM_WORLD.rank == 0)))


def colours(path):
    """Pixels of a PNG, and the share of those that are neither white nor grey."""
    pixels = matplotlib.image.imread(path)[..., :3]
    return pixels, float(np.mean(np.ptp(pixels, axis=2) > 0.2))


@pytest.mark.mpi
@pytest.mark.parametrize("shape", ["quadrilateral", "hexahedron"])
def test_body_is_drawn(folder, shape):
    u, height, facets, damage = torn(shape, 1)
    grid, crack = gather_grid(u, {"height": height}), gather_facets(u, facets, damage)
    tool = pyvista.Sphere(radius=0.1, center=(0.62, 0.9, 0.0)) if grid else None
    draw_body(folder / "plain.png", grid, "height", label="height [mm]")
    draw_body(folder / "new" / "all.png", grid, "height", label="height [mm]", tool=tool, crack=crack)
    if grid is None:
        return
    plain, filled = colours(folder / "plain.png")
    assert plain.shape == (1000, 1600, 3)
    assert 0.1 < filled < 0.6
    assert np.any(colours(folder / "new" / "all.png")[0] != plain)


@pytest.mark.mpi
def test_setup_is_drawn_with_all_that_has_a_name(folder, monkeypatch):
    """Also what is held on nodes that another support holds."""
    b, seen = make_blocks(), []
    monkeypatch.setattr(setup_picture, "save", lambda figure, path: (seen.append(figure), save(figure, path)))
    facets, right = b.face(1, 1.0), b.face(0, 1.0)
    pull = Traction(b.state, right, (1.0, 0.0), lambda t: t, name="wind")
    supports = [Support(b.state, facets, 1, name="lid"), Support(b.state, b.face(1, 0.0), 0)]
    supports.append(Support(b.state, facets, 0, name="pin"))
    problem = Mechanics(b.state, [b.solid(name="cake"), b.crack(name="cut"), pull], supports)
    draw_setup(folder / "setup.png", problem, supports)
    if MPI.COMM_WORLD.rank > 0:
        assert not seen
        return
    names = [text.get_text() for text in seen[0].legends[0].get_texts()]
    assert names == ["cake", "cut", "lid: $u_y$", "held: $u_x$", "pin: $u_x$", "wind"]
    pixels = colours(folder / "setup.png")[0]
    for colour in distinct(6)[1:]:
        assert np.any(np.abs(pixels[:850] - matplotlib.colors.to_rgb(colour)).max(axis=2) < 0.03)


@pytest.mark.parametrize("names", [(), ("low", "high")])
def test_bars_are_those_of_what_there_is(tmp_path, names, monkeypatch):
    """Layers have a legend of their names, stresses and damage a bar; there is none of damage where nothing is."""
    seen = []
    monkeypatch.setattr(pictures, "save", lambda figure, path: seen.append(figure))
    u, height, facets, damage = torn("quadrilateral", 1)
    grid = gather_grid(u, {"height": np.round(height.x.array)})
    for broken in (damage, 0 * damage):
        draw_body("none.png", grid, "height", label="$σ_v$ [MPa]", crack=gather_facets(u, facets, broken), names=names)
    titles = [[axes.get_title() for axes in figure.axes[1:]] for figure in seen]
    legends = [[text.get_text() for legend in figure.legends for text in legend.get_texts()] for figure in seen]
    assert titles == ([[], []] if names else [["$σ_v$ [MPa]", "damage of the crack"], ["$σ_v$ [MPa]"]])
    assert legends == [list(names), list(names)]


def test_scale_is_true(tmp_path):
    """The bar of the scale is as long as a part of the body of that length."""
    grid = pyvista.ImageData(dimensions=(5, 3, 1), spacing=(0.75, 0.5, 1.0)).cast_to_unstructured_grid()
    grid["u"] = np.zeros((grid.n_points, 3))
    grid.cell_data["s"] = np.arange(grid.n_cells, dtype=float)
    draw_body(tmp_path / "scale.png", grid, "s", label="s", length="cm", limits=(0.0, 7.0))
    pixels = colours(tmp_path / "scale.png")[0]
    # the colours of a plane body are those of the bar
    for end in (0.0, 1.0):
        colour = matplotlib.colormaps["viridis"](end)[:3]
        assert np.any(np.abs(pixels[150:850] - colour).max(axis=2) < 0.02)
    body = np.flatnonzero(np.any(pixels[:850] < 0.9, axis=(0, 2)))
    bar = np.flatnonzero(np.all(pixels[905:945, 1200:] < 0.1, axis=2).any(axis=0))
    assert (bar[-1] - bar[0]) / (body[-1] - body[0]) == pytest.approx(0.5 / 3.0, rel=0.02)


@pytest.mark.parametrize("suffix", ["svg", "pdf"])
def test_pictures_and_plots_have_letters_as_vectors(tmp_path, suffix):
    u, height, *_ = torn("quadrilateral", 1)
    draw_body(tmp_path / f"a.{suffix}", gather_grid(u, {"height": height}), "height", label="σ [mm]")
    assert (tmp_path / f"a.{suffix}").read_bytes()[:5] in (b"<?xml", b"%PDF-")


def test_no_two_curves_have_one_colour():
    for count in (1, 7, 8, 30):
        assert len(set(distinct(count))) == count


def test_options_change_the_picture(tmp_path):
    u, height, facets, damage = torn("hexahedron", 1)
    grid, crack = gather_grid(u, {"height": height}), gather_facets(u, facets, damage)
    draw_body(tmp_path / "plain.png", grid, "height", label="height [mm]", crack=crack)
    plain = colours(tmp_path / "plain.png")[0]
    window = (0, 0.2, 0, 0.2, 0, 0)
    for options in ({"clip": ((1, 0, 0), (0.5, 0, 0))}, {"mirror": "xy"}, {"window": window}, {"title": "t"}):
        draw_body(tmp_path / "other.png", grid, "height", label="height [mm]", crack=crack, **options)
        other, filled = colours(tmp_path / "other.png")
        assert filled > 0.05 and np.any(other != plain), options


def test_view_fills_the_stage(tmp_path):
    """A long thin body and a small one far from the origin both take nine tenths of the width."""
    for scale, origin in (((20.0, 1.0, 1.0), (0, 0, 0)), ((0.01, 0.002, 0.002), (500, 0, 0))):
        grid = pyvista.ImageData(dimensions=(5, 3, 3), spacing=np.divide(scale, (4, 2, 2)), origin=origin)
        grid = grid.cast_to_unstructured_grid()
        grid["u"] = np.zeros((grid.n_points, 3))
        grid.cell_data["s"] = np.arange(grid.n_cells, dtype=float)
        draw_body(tmp_path / "long.png", grid, "s", label="s", view=(0.3, 0.2, 1.0))
        drawn = np.any(colours(tmp_path / "long.png")[0][:850] < 0.9, axis=(0, 2))
        assert 0.86 < (np.flatnonzero(drawn)[-1] - np.flatnonzero(drawn)[0]) / 1600 < 0.95


@pytest.mark.mpi
def test_a_failing_picture_is_a_warning(folder, caplog, monkeypatch):
    u, height, *_ = torn("quadrilateral", 1)
    grid = gather_grid(u, {"height": height})
    with caplog.at_level(logging.WARNING, logger=pictures.__name__):
        draw_body(folder / "no.png", grid, "colour", label="colour")
    assert ("'colour'" in caplog.text) == (MPI.COMM_WORLD.rank == 0)
    assert not (folder / "no.png").exists()
    with pytest.raises(ValueError, match="mirror = 'w'"):
        draw_body(folder / "no.png", grid, "height", label="height", mirror=("w",))
    monkeypatch.setitem(sys.modules, "pyvista", None)  # as if it were not installed
    with caplog.at_level(logging.WARNING, logger=grids.__name__):
        assert gather_grid(u, {"height": height}) is None
    assert ("no pictures" in caplog.text) == (MPI.COMM_WORLD.rank == 0)


def test_a_curve_that_ends_early_says_so(tmp_path, monkeypatch):
    seen = []
    monkeypatch.setattr(plots, "_save", lambda figure, path: seen.append(figure))
    curves = [Curve([0, 1], [0, 2], "whole"), Curve([0, 1, 2], [0, 1, 3], "cut off", partial=True)]
    plot_curves(tmp_path / "a.png", curves, xlabel="x", ylabel="y")
    axes = seen[0].axes[0]
    assert [t.get_text() for t in axes.get_legend().get_texts()] == ["whole", "cut off (ends early)"]
    (cross,) = [line for line in axes.lines if line.get_marker() == "x"]
    assert cross.get_xydata().tolist() == [[2, 3]] and cross.get_color() == axes.lines[1].get_color()


def test_curves_and_energy_are_plotted(tmp_path):
    x = np.linspace(0, 1, 20)
    plot_curves(
        tmp_path / "new" / "force.png",
        [Curve(x, x**2, "cutsim"), Curve(x, x, style="o")],
        xlabel="depth [mm]",
        ylabel="force [N]",
        references={"closed form": 0.5},
    )
    history = {"time": x, "work_external": x, "energy_strain": 0.6 * x, "energy_fracture": 0.4 * x}
    plot_energy(tmp_path / "energy.png", {**history, "energy_closure": 0 * x})
    for name in ("new/force.png", "energy.png"):
        pixels, filled = colours(tmp_path / name)
        assert pixels.shape[1] == 1050 and filled > 0.002
    codes = [plots.ENERGIES[name][1] for name in ("energy_strain", "energy_fracture")]
    pixels = colours(tmp_path / "energy.png")[0]
    shown = [0.85 * np.array(matplotlib.colors.to_rgb(code)) + 0.15 for code in codes]
    shares = [np.mean(np.abs(pixels - colour).max(axis=2) < 0.02) for colour in shown]
    assert shares[0] / shares[1] == pytest.approx(1.5, rel=0.1)  # areas are in the ratio of the energies
    with pytest.raises(ValueError, match="energy_closure"):
        plot_energy(tmp_path / "energy.png", history)


def test_parts_are_stacked_in_colours_of_their_own(tmp_path):
    x = np.linspace(0, 1, 20)
    parts = {"a": 0.6 * x, "none": 0 * x, "b": 0.4 * x}
    plot_parts(tmp_path / "parts.png", x, parts, x, xlabel="depth [mm]", ylabel="force [N]")
    pixels = colours(tmp_path / "parts.png")[0]
    shown = [0.85 * np.array(matplotlib.colors.to_rgb(COLOURS[i])) + 0.15 for i in (0, 1, 2)]
    shares = [np.mean(np.abs(pixels - colour).max(axis=2) < 0.02) for colour in shown]
    assert shares[0] / shares[2] == pytest.approx(1.5, rel=0.1)
    assert shares[1] == 0


def test_tool_of_revolution_has_the_area_of_a_cone_and_a_cylinder():
    outline = np.array([(0.0, 0.0), (3.0, 4.0), (3.0, 9.0), (-3.0, 9.0), (-3.0, 4.0)])
    tool = revolved(outline, (1.0, 2.0, 3.0), ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)), points=400)
    assert tool.area == pytest.approx(np.pi * 3 * 5 + 2 * np.pi * 3 * 5, rel=1e-3)
    np.testing.assert_allclose(tool.bounds, (-2, 4, 2, 11, 0, 6), atol=1e-3)
