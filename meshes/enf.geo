// End-notched flexure: two arms bonded along y = 0 in three-point bending. Lengths in mm, quadrilaterals.
//
//                                    load x = L                      y = h    y
//          +-----------------------------+------------------------+           |
//          |                       upper                          |           |
//          + - - - precrack - - - +- crack -+--------------------+  y = 0    +---- x  crack growth
//          |                       lower                          |
//          +--+----------------------------------------------+----+  y = -h
//      x = -over  x = 0          x = a0                    x = 2 L  x = 2 L + over
//
// The pins act on the vertices (0, -h), (2 L, -h) and (L, h).
// Sizes along x: lc_arm up to x = a0 - back, lc from there to x = L, growing from there to lc_arm at the right end.
Include "common.geo";
DefineConstant[
  L      = {60,  Name "L"},       // half the span
  h      = {3,   Name "h"},       // thickness of each arm
  a0     = {44,  Name "a0"},      // initial crack, from the left pin
  over   = {6,   Name "over"},    // length of the beam beyond the pins
  back   = {6,   Name "back"},    // length of fine mesh behind the initial front
  lc     = {0.5, Name "lc"},      // largest element size along the fine mesh
  lc_arm = {1,   Name "lc_arm"},  // largest element size elsewhere
  growth = {1.1, Name "growth"},  // ratio of neighbouring sizes beyond the fine mesh
  ny     = {3,   Name "ny"}       // elements through each arm
];
If (h <= 0 || over <= 0 || lc <= 0 || lc_arm < lc)
  Error("h = %g, over = %g, lc = %g must be > 0, lc_arm = %g at least lc", h, over, lc, lc_arm);
EndIf
If (growth < 1 || ny < 1)
  Error("growth = %g, ny = %g must be at least 1", growth, ny);
EndIf
If (back <= 0 || back >= a0 || a0 >= L)
  Error("back = %g must lie in (0, a0 = %g) and a0 below L = %g", back, a0, L);
EndIf

dim = 2;
length = L;
size = growth * lc;
largest = lc_arm;
Call Graded;
Point(1) = {0, 0, 0};
left[] = Extrude {-over, 0, 0} { Point{1}; Layers{Ceil(over / lc_arm - 1e-9)}; };
arm[] = Extrude {a0 - back, 0, 0} { Point{1}; Layers{Ceil((a0 - back) / lc_arm - 1e-9)}; };
tip[] = Extrude {back, 0, 0} { Point{arm[0]}; Layers{Ceil(back / lc - 1e-9)}; };
path[] = Extrude {L - a0, 0, 0} { Point{tip[0]}; Layers{Ceil((L - a0) / lc - 1e-9)}; };
rest[] = Extrude {L, 0, 0} { Point{path[0]}; Layers{layers[], ends[]}; };
right[] = Extrude {over, 0, 0} { Point{rest[0]}; Layers{Ceil(over / lc_arm - 1e-9)}; };
For side In {-1:1:2}
  Extrude {0, side * h, 0} { Curve{left[1], arm[1], tip[1], path[1], rest[1], right[1]}; Layers{ny}; Recombine; }
EndFor

depth = 0;
e = 1e-6 * h;
name = "lower";    box[] = {-over, 2 * L + over, -h, 0}; Call Cells;
name = "upper";    box[] = {-over, 2 * L + over, 0, h};  Call Cells;
name = "crack";    box[] = {a0, L, 0, 0};                Call Facets;
name = "precrack"; box[] = {-over, a0, 0, 0};            Call Facets;
