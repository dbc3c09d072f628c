"""The command `cutsim`: one module for each of its commands. What they need of dolfinx is loaded when they run."""
