"""Formats of mesh files by their endings."""

from pathlib import Path

from cutsim.readers import gmsh_model
from cutsim.readers.abaqus import read_abaqus
from cutsim.readers.febio import read_febio
from cutsim.readers.mesh_data import MeshData
from cutsim.readers.meshio_files import read_meshio

_READERS = {".feb": read_febio, ".inp": read_abaqus}


def load(path: Path | str, gdim: int) -> MeshData:
    """What a mesh file says.

    Args:
        path: The file.
        gdim: Dimension of the mesh.

    Raises:
        ValueError: The file cannot be read.
    """
    ending = Path(path).suffix.lower()
    if ending in gmsh_model.FORMATS:
        with gmsh_model.session():
            gmsh_model.open_mesh(path)
            return gmsh_model.extract(gdim)
    if ending in _READERS:
        return _READERS[ending](path)
    if ending == ".geo":
        raise ValueError("this is a geometry of gmsh without a mesh, which read_geo meshes")
    return read_meshio(path)
