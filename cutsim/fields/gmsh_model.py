"""Arrays of a gmsh model, after a check that its groups make one mesh. Runs on one rank, before the dolfinx mesh."""

import logging
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import basix
import gmsh
import numpy as np
from dolfinx import cpp
from dolfinx.mesh import CellType
from numpy.typing import NDArray

from cutsim.base.checks import place

logger = logging.getLogger(__name__)

#: Endings of the formats in which gmsh reads the names of groups; of others it reads none, or nothing at all.
FORMATS = (".msh", ".med", ".unv", ".cgns")

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

# cells by their number in gmsh, and the degree of their shape
_CELLS = {
    2: ("triangle", 1), 9: ("triangle", 2), 21: ("triangle", 3),
    3: ("quadrilateral", 1), 10: ("quadrilateral", 2), 36: ("quadrilateral", 3),
    4: ("tetrahedron", 1), 11: ("tetrahedron", 2), 29: ("tetrahedron", 3),
    5: ("hexahedron", 1), 12: ("hexahedron", 2), 92: ("hexahedron", 3),
}  # fmt: skip
# a mesh is flat if it extends along an axis by no more than this fraction of its size
_FLAT = 1e-9
_AXES = "xyz"


@dataclass(frozen=True)
class Model:
    """Mesh with groups, numbered without gaps.

    Attributes:
        cell: Name of the cell.
        degree: Degree of its shape.
        points: Positions of the nodes, shape (nodes, gdim) [length].
        cells: Nodes of each cell in the order of dolfinx, its corners first.
        names: Name of each group → (dimension, tag).
        groups: (dimension, tag) of each group → its cells, by number, or the corners of its facets.
    """

    cell: str
    degree: int
    points: Floats
    cells: Indices
    names: dict[str, tuple[int, int]]
    groups: dict[tuple[int, int], Indices]


@contextmanager
def session() -> Iterator[None]:
    """A quiet gmsh that reads no user configuration and leaves Ctrl-C alone; its warnings go to the log."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.logger.start()
    try:
        yield
        for message in gmsh.logger.get():
            if message.startswith("Warning"):
                logger.warning("gmsh: %s", message)
    finally:
        gmsh.logger.stop()
        gmsh.finalize()


def open_mesh(path: Path | str) -> None:
    """Open a file with a mesh.

    Raises:
        ValueError: There is none, or its format is not one in which gmsh reads groups.
    """
    _check_file(path)
    if Path(path).suffix.lower() not in FORMATS:
        raise ValueError(
            f"gmsh reads no groups from such a file; allowed are {', '.join(FORMATS)}, and read_geo for .geo"
        )
    gmsh.open(str(path))


def generate(path: Path | str, parameters: Mapping[str, float], gdim: int) -> None:
    """Open a geometry, first as it is to learn what it declares, then with the parameters, and mesh it.

    Raises:
        ValueError: There is no such file, or a parameter is unknown or not finite.
    """
    _check_file(path)
    gmsh.open(str(path))
    if parameters:
        known = {name for name in gmsh.onelab.getNames() if not name.startswith(("Gmsh/", "ONELAB/"))}
        for name, value in parameters.items():
            if name not in known:
                raise ValueError(f"unknown parameter {name!r} (= {value}); known: {', '.join(sorted(known))}")
            if not math.isfinite(value):
                raise ValueError(f"parameter {name!r} = {value} must be finite")
            gmsh.onelab.setNumber(name, [float(value)])
        gmsh.parser.clear()
        gmsh.open(str(path))
    gmsh.model.mesh.generate(gdim)


def extract(gdim: int) -> Model:
    """The mesh of the open model.

    Args:
        gdim: Dimension of the mesh and of its space.

    Raises:
        ValueError: The groups make no mesh of one cell type that can be used, or a group has facets that are none of
            the mesh.
    """
    names = _names(gdim)
    kind, tags, cells, members = _cells(gdim)
    cell, degree = _CELLS[kind]
    cells = cells[:, cpp.io.perm_gmsh(getattr(CellType, cell), cells.shape[1])]
    facets = {(gdim - 1, tag): _facets(gdim - 1, tag) for dim, tag in gmsh.model.getPhysicalGroups(gdim - 1)}
    numbers, positions = _nodes()
    points = _plane(positions[np.searchsorted(numbers, np.unique(cells))], gdim)
    used, cells = np.unique(cells, return_inverse=True)
    cells = cells.reshape(len(tags), -1)
    corners = cells[:, : gmsh.model.mesh.getElementProperties(kind)[5]]
    _check_corners(corners, points)
    all_facets = facets_of(cell, corners)
    _check_neighbours(all_facets, points, len(cells))
    groups = {(gdim, tag): np.searchsorted(tags, some) for tag, some in members.items()}
    called = {key: name for name, key in names.items()}
    for (dim, tag), group in facets.items():
        name = called.get((dim, tag), f"tag {tag}")
        places = positions[np.searchsorted(numbers, group)].mean(axis=1)
        groups[dim, tag] = _check_facets(name, group, places, used, all_facets)
    return Model(cell, degree, points, cells, names, groups)


def facets_of(cell: str, corners: NDArray[np.integer]) -> Indices:
    """Corners of all facets of cells given by their corners, each sorted; shape (cells × facets of a cell, corners)."""
    kind = getattr(basix.CellType, cell)
    local = basix.topology(kind)[len(basix.topology(kind)) - 2]
    return np.sort(corners[:, np.asarray(local)].reshape(-1, len(local[0])), axis=1)


def rows_in(rows: NDArray[np.integer], among: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Which rows are also among others."""
    both = np.concatenate([among.reshape(-1, rows.shape[1]), rows])
    number = np.unique(both, axis=0, return_inverse=True)[1].ravel()
    return np.isin(number[len(among) :], number[: len(among)])


def _check_file(path: Path | str) -> None:
    if not Path(path).is_file():
        raise ValueError("no such file")


def _names(gdim: int) -> dict[str, tuple[int, int]]:
    """Names of the groups of cells and facets."""
    groups = gmsh.model.getPhysicalGroups()
    top = max((dim for dim, _ in groups), default=None)
    if top != gdim:
        raise ValueError(f"gdim = {gdim}, but the highest dimension of a physical group is {top}")
    names: dict[str, tuple[int, int]] = {}
    for dim, tag in groups:
        # some formats fill names up with blanks
        name = gmsh.model.getPhysicalName(dim, tag).strip()
        if dim < gdim - 1 or not name:
            continue
        if name in names:
            raise ValueError(f"two physical groups are called {name!r}")
        names[name] = (dim, tag)
    return names


def _cells(gdim: int) -> tuple[int, Indices, Indices, dict[int, Indices]]:
    """Their kind, tags (ascending) and nodes, and the tags of those of each group."""
    kinds: dict[int, int] = {}
    tags, nodes, members = [np.empty(0, np.int64)], [], {}
    for _, tag in gmsh.model.getPhysicalGroups(gdim):
        own = [np.empty(0, np.int64)]
        for entity in gmsh.model.getEntitiesForPhysicalGroup(gdim, tag):
            for kind, some, of_cells in zip(*gmsh.model.mesh.getElements(gdim, entity), strict=True):
                kinds[kind] = kinds.get(kind, 0) + len(some)
                own.append(some.astype(np.int64))
                nodes.append(of_cells.astype(np.int64).reshape(len(some), -1))
        members[tag] = np.concatenate(own)
        tags.append(members[tag])
    _check_kinds(kinds)
    unique, first = np.unique(np.concatenate(tags), return_index=True)
    return next(iter(kinds)), unique, np.concatenate(nodes)[first], members


def _check_kinds(kinds: Mapping[int, int]) -> None:
    """Refuse cells of a type that cannot be used, or of several types."""
    found = {gmsh.model.mesh.getElementProperties(kind)[0]: count for kind, count in kinds.items()}
    for kind, (name, count) in zip(kinds, found.items(), strict=True):
        if kind not in _CELLS:
            of = f"{count} of {sum(found.values())}"
            raise ValueError(f"cells of the type {name!r} ({of}) cannot be used: {_instead(name)}")
    if len(kinds) != 1:
        words = ", ".join(f"{count} {name!r}" for name, count in sorted(found.items())) or "none"
        raise ValueError(f"the cells must be of one type, found {words}")


def _instead(kind: str) -> str:
    if kind.startswith(("Prism", "Pyramid", "Trihedron")):
        return (
            "use tetrahedra (no Recombine), or hexahedra, which are extruded from a surface that is recombined into "
            "quadrilaterals"
        )
    return "use cells of first order (gmsh -order 1), or complete ones of second order (Mesh.SecondOrderIncomplete = 0)"


def _facets(dim: int, tag: int) -> Indices:
    """Corners of the facets of a group, by the numbers of gmsh."""
    corners = [np.empty((0, dim), np.int64)]
    for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag):
        for kind, some, nodes in zip(*gmsh.model.mesh.getElements(dim, entity), strict=True):
            count = gmsh.model.mesh.getElementProperties(kind)[5]
            corners.append(nodes.astype(np.int64).reshape(len(some), -1)[:, :count])
    corners = [c for c in corners if len(c)] or corners
    if len({c.shape[1] for c in corners}) > 1:
        raise ValueError(f"the facets of the group with tag {tag} are of different types")
    return np.concatenate(corners)


def _nodes() -> tuple[Indices, Floats]:
    """Numbers of all nodes, ascending, which may have gaps, and their positions."""
    tags, x, _ = gmsh.model.mesh.getNodes()
    numbers, first = np.unique(tags.astype(np.int64), return_index=True)
    return numbers, x.reshape(-1, 3)[first]


def _plane(x: Floats, gdim: int) -> Floats:
    """Coordinates in the plane of a flat mesh, which may be that of any two axes."""
    bad = np.flatnonzero(~np.isfinite(x).all(axis=1))
    if len(bad):
        raise ValueError(f"{len(bad)} nodes have coordinates that are not finite, the first {place(x[bad[0]])}")
    if gdim == 3:
        return x
    extent = np.ptp(x, axis=0)
    flat = [i for i in (2, 1, 0) if extent[i] <= _FLAT * extent.max()]
    if not flat:
        low, high = x.min(axis=0)[2], x.max(axis=0)[2]
        raise ValueError(
            f"gdim = 2, but the mesh is not flat: z goes from {low:.4g} to {high:.4g}. Allowed is a mesh in a plane of "
            "two axes; a surface in space is no body"
        )
    axes = [i for i in range(3) if i != flat[0]]
    level = x[:, flat[0]].mean()
    if flat[0] != 2:
        logger.warning(
            "the mesh lies in the plane %s = %.4g: its coordinates %s and %s are x[0] and x[1] here",
            _AXES[flat[0]], level, *(_AXES[i] for i in axes),
        )  # fmt: skip
    return np.ascontiguousarray(x[:, axes])


def _check_corners(corners: Indices, points: Floats) -> None:
    """Refuse cells that name a node twice."""
    bad = np.flatnonzero((np.diff(np.sort(corners, axis=1), axis=1) == 0).any(axis=1))
    if len(bad):
        first = place(points[corners[bad[0]]].mean(axis=0))
        raise ValueError(f"{len(bad)} cells have a node twice, the first at {first}")


def _check_neighbours(facets: Indices, points: Floats, cells: int) -> None:
    """Refuse what is no mesh: facets of more than two cells, and cells that have more than one facet in common."""
    # facets are the same if the sums of random numbers of their nodes are
    keys = np.random.default_rng(0).integers(0, 2**62, len(points), dtype=np.uint64)[facets].sum(axis=1)
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(keys[order[1:]] == keys[order[:-1]])
    crowded = order[same[1:][np.diff(same) == 1]]
    pairs = np.sort(np.stack([order[same], order[same + 1]]) // (len(facets) // cells), axis=0)
    pairs, count = np.unique(pairs[0] * cells + pairs[1], return_counts=True)
    twice = pairs[count > 1] // cells * (len(facets) // cells)
    for bad, what in ((crowded, "facets belong to more than two cells"), (twice, "pairs of cells share two facets")):
        if len(bad):
            first = place(points[facets[bad[0]]].mean(axis=0))
            raise ValueError(f"{len(bad)} {what}, the first at {first}: cells are folded or lie over each other")


def _check_facets(name: str, group: Indices, places: Floats, used: Indices, all_facets: Indices) -> Indices:
    """The corners of the facets of a group in the numbers of the mesh, after a check that it has these facets."""
    numbers = np.searchsorted(used, group).clip(max=len(used) - 1)
    known = (used[numbers] == group).all(axis=1)
    near = np.zeros(len(used), dtype=bool)
    near[numbers] = True
    if group.shape[1] == all_facets.shape[1]:
        known &= rows_in(np.sort(numbers, axis=1), all_facets[near[all_facets].all(axis=1)])
    else:
        known[:] = False
    if known.all() and len(group):
        return numbers
    lost = places[~known]
    ends = " to ".join(place(x) for x in (lost if len(lost) < 3 else lost[[0, -1]]))
    raise ValueError(
        f"group {name!r}: {np.count_nonzero(known)} of {len(group)} facets are facets of the mesh"
        + (f"; the others lie near {ends}" if ends else "")
        + ". A curve or surface that is drawn in a body has to be part of it: embed it (Curve{…} In Surface{…};, "
        "Surface{…} In Volume{…};) or cut the body with it (BooleanFragments, occ.fragment) before meshing"
    )
