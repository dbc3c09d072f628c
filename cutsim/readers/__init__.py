"""Mesh files of gmsh, Abaqus, FEBio and of all formats that meshio reads, as arrays that make one mesh."""
