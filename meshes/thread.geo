// Meridian plane of a block of revolution with a thread on its axis x = 0. Lengths in mm, quadrilaterals.
//
//      top_left    top_right            y = 0     y  axis of revolution, the needle moves along -y
//            +---:--------------+                 |
//     thread |  : notch         |                 |
//     "left" |  :     "right"   | far_right       +---- x  distance from the axis
//            |  | crack         |
//            +--+---------------+  y = -H
//              r0   bottom      x = R
//
// The hole above the crack is wider by `flare` at the top: friction would fold a sharp rim. With notch = 0 there is neither
// hole nor facet "notch", and the crack begins at the surface. Sizes: lc along the crack as far down as `deep`, growing
// from there, and from the crack outwards; smaller ones, from `entry` on, at the mouth of a crack without notch.
Include "common.geo";
DefineConstant[
  r0     = {0.1, Name "r0"},      // radius of the thread
  R      = {8,   Name "R"},       // radius of the block
  H      = {10,  Name "H"},       // height
  notch  = {0.5, Name "notch"},   // depth to which the thread comes off without resistance
  flare  = {0.1, Name "flare"},   // by which the hole is wider at the top
  deep   = {6,   Name "deep"},    // depth of the fine part
  lc     = {0.1, Name "lc"},      // element size along the crack
  entry  = {0,   Name "entry"},   // element size at the mouth of a crack without notch, 0: lc
  growth = {1.2, Name "growth"}   // ratio of neighbouring sizes away from it
];
If (r0 <= 0 || flare < 0 || R <= r0 + flare || lc <= 0 || growth <= 1)
  Error("r0 = %g and lc = %g must be > 0, flare = %g at least 0, R = %g larger than both radii, growth = %g > 1", r0, lc, flare, R, growth);
EndIf
If (notch < 0 || notch >= deep || deep >= H)
  Error("notch = %g must lie in [0, deep = %g), deep in (0, H = %g)", notch, deep, H);
EndIf

If (notch > 0)
  // Four rows of points, at the axis, at the surface of the thread, and outside; three bands of cells between them.
  height[] = {-H, -deep, -notch, 0};
  size = growth * lc;
  largest = H;
  length = H - deep;
  Call Graded;
  cells[] = {#layers[], Ceil((deep - notch) / lc - 1e-9), Ceil(notch / lc - 1e-9)};
  size = lc;
  length = R - r0;
  Call Graded;
  For row In {0:3}
    p[] = {newp, newp + 1, newp + 2};
    Point(p[0]) = {0, height[row], 0};
    Point(p[1]) = {row < 3 ? r0 : r0 + flare, height[row], 0};
    Point(p[2]) = {R, height[row], 0};
    across[] = {newc, newc + 1};
    Line(across[0]) = {p[0], p[1]};
    Line(across[1]) = {p[1], p[2]};
    Transfinite Curve{across[0]} = 2;
    Transfinite Curve{across[1]} = #layers[] + 1 Using Progression growth;
    If (row > 0)
      c = newc;
      For i In {0:2}
        Line(c + i) = {below[i], p[i]};
        Transfinite Curve{c + i} = cells[row - 1] + 1 Using Progression (row > 1 ? 1 : 1 / growth);
      EndFor
      For i In {0:1}
        loop = newcl; Curve Loop(loop) = {foot[i], c + i + 1, -across[i], -c - i};
        face = news; Plane Surface(face) = {loop};
        Transfinite Surface{face};
        Recombine Surface{face};
      EndFor
    EndIf
    below[] = p[];
    foot[] = across[];
  EndFor
Else
  Point(1) = {0, 0, 0};
  length = H;
  fine = deep;
  Call FromMouth;
  axis[] = Extrude {0, -H, 0} { Point{1}; Layers{layers[], ends[]}; };
  thread[] = Extrude {r0, 0, 0} { Curve{axis[1]}; Layers{1}; Recombine; };
  length = R - r0;
  fine = 4 * lc;
  Call FromMouth;
  Extrude {length, 0, 0} { Curve{thread[0]}; Layers{layers[], ends[]}; Recombine; }
  flare = 0;
EndIf

dim = 2;
depth = 0;
e = 1e-6 * r0;
name = "left";      box[] = {0, r0 + flare, -H, 0};  Call Cells;
name = "right";     box[] = {r0, R, -H, 0};         Call Cells;
name = "crack";     box[] = {r0, r0, -H, -notch};   Call Facets;
name = "top_left";  box[] = {0, r0 + flare, 0, 0};  Call Facets;
name = "top_right"; box[] = {r0 + flare, R, 0, 0};  Call Facets;
name = "bottom";    box[] = {0, R, -H, -H};         Call Facets;
name = "far_right"; box[] = {R, R, -H, 0};          Call Facets;
If (notch > 0)
  name = "notch"; box[] = {r0, r0 + flare, -notch, 0}; Call Facets;
EndIf
