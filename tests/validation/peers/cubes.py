"""Two neo-Hookean cubes on each other, of different meshes; the upper one is pressed down and drawn over an edge.

Edges of 10 mm, 12³ hexahedra of degree 1 on 10³, E = 1 MPa, ν = 0.45, full integration, friction 0.3, no penetration.
The upper cube is pressed by 1 mm in 5 steps and drawn by 3 mm in 15.
"""

EDGE, CELLS = 10.0, (12, 10)  # mm; cells along an edge, above and below
YOUNG, POISSON, FRICTION = 1.0, 0.45, 0.3
PRESS, DRAW = 1.0, 3.0  # mm
STEPS = 5, 15
