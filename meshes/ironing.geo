// A die with a round face above a slab, with a mesh of its own. Lengths in mm, quadrilaterals.
//
//             top          y = T
//          +-------+
//          |  die  |                    half the chord: W, radius of the face: R
//           \     /
//     +------ face ------------+      y = 0    y
//     | track   slab           |               |
//     +------------------------+      y = -H   +---- x  drawn
//  x = 0      x = X bottom   x = L
//
// No node is shared. The slab has elements of the size h, growing downwards to twice that; the face of the die has nd.
Include "common.geo";
DefineConstant[
  L  = {12,  Name "L"},   // length of the slab
  H  = {2,   Name "H"},   // height of the slab
  R  = {2,   Name "R"},   // radius of the face
  W  = {1.2, Name "W"},   // half its chord
  T  = {1.2, Name "T"},   // height of the die
  X  = {4,   Name "X"},   // lowest point of the face
  h  = {0.2, Name "h"},   // element size of the slab at its face
  nd = {9,   Name "nd"}   // elements along the face of the die
];
If (R <= W || W <= 0 || X < W || L < X + W)
  Error("W = %g must lie in (0, R = %g), and X = %g at least W from 0 and L = %g", W, R, X, L);
EndIf
rise = R - Sqrt(R * R - W * W);
If (H <= 0 || T <= rise || h <= 0 || h > H || nd < 1)
  Error("H = %g must be > 0, T = %g above the rim of the die, h = %g in (0, H] and nd = %g at least 1", H, T, h, nd);
EndIf

length = H;
size = h;
growth = 1.2;
largest = 2 * h;
Call Graded;
Point(1) = {0, 0, 0};
track[] = Extrude {L, 0, 0} { Point{1}; Layers{Ceil(L / h - 1e-9)}; };
slab[] = Extrude {0, -H, 0} { Curve{track[1]}; Layers{layers[], ends[]}; Recombine; };

centre = newp; Point(centre) = {X, R, 0};
left = newp;   Point(left) = {X - W, rise, 0};
right = newp;  Point(right) = {X + W, rise, 0};
far = newp;    Point(far) = {X + W, T, 0};
near = newp;   Point(near) = {X - W, T, 0};
face = newc;   Circle(face) = {left, centre, right};
front = newc;  Line(front) = {right, far};
top = newc;    Line(top) = {far, near};
rear = newc;   Line(rear) = {near, left};
loop = newcl;  Curve Loop(loop) = {face, front, top, rear};
die = news;    Plane Surface(die) = {loop};
Transfinite Curve{face, top} = nd + 1;
Transfinite Curve{front, rear} = Ceil(nd * T / (3 * W)) + 1;
Transfinite Surface{die};
Recombine Surface{die};

Physical Surface("slab") = {slab[1]};
Physical Surface("die") = {die};
Physical Curve("face") = {face};
Physical Curve("track") = {track[1]};
Physical Curve("top") = {top};
Physical Curve("bottom") = {slab[0]};
