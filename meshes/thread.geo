// Meridian plane of a block of revolution with a thread on its axis x = 0. Lengths in mm, quadrilaterals.
//
//      top_left : top_right             y = 0     y  axis of revolution, the needle moves along -y
//            +--:---------------+                 |
//     thread |  : notch         |                 |
//     "left" |  :     "right"   | far_right       +---- x  distance from the axis
//            |  | crack         |
//            +--+---------------+  y = -H
//              r0   bottom      x = R
//
// Sizes: lc along the crack as far down as `deep`, growing from there, and from the crack outwards.
Include "common.geo";
DefineConstant[
  r0     = {0.1, Name "r0"},      // radius of the thread
  R      = {8,   Name "R"},       // radius of the block
  H      = {10,  Name "H"},       // height
  notch  = {0.5, Name "notch"},   // depth to which the thread comes off without resistance
  deep   = {6,   Name "deep"},    // depth of the fine part
  lc     = {0.1, Name "lc"},      // element size along the crack
  growth = {1.2, Name "growth"}   // ratio of neighbouring sizes away from it
];
If (r0 <= 0 || R <= r0 || lc <= 0 || growth <= 1)
  Error("r0 = %g and lc = %g must be > 0, R = %g larger than r0, growth = %g > 1", r0, lc, R, growth);
EndIf
If (notch <= 0 || notch >= deep || deep > H)
  Error("notch = %g must lie in (0, deep = %g), deep at most H = %g", notch, deep, H);
EndIf

Point(1) = {r0, -deep, 0};
mouth[] = Extrude {0, deep - notch, 0} { Point{1}; Layers{Ceil((deep - notch) / lc - 1e-9)}; };
rim[] = Extrude {0, notch, 0} { Point{mouth[0]}; Layers{Ceil(notch / lc - 1e-9)}; };
lines[] = {mouth[1], rim[1]};
size = growth * lc;
largest = H;
If (deep < H)
  length = H - deep;
  Call Graded;
  foot[] = Extrude {0, -length, 0} { Point{1}; Layers{layers[], ends[]}; };
  lines[] += {foot[1]};
EndIf
size = lc;
length = R - r0;
Call Graded;
Extrude {-r0, 0, 0} { Curve{lines[]}; Layers{1}; Recombine; }
Extrude {length, 0, 0} { Curve{lines[]}; Layers{layers[], ends[]}; Recombine; }

dim = 2;
depth = 0;
e = 1e-6 * r0;
name = "left";      box[] = {0, r0, -H, 0};         Call Cells;
name = "right";     box[] = {r0, R, -H, 0};         Call Cells;
name = "crack";     box[] = {r0, r0, -H, -notch};   Call Facets;
name = "notch";     box[] = {r0, r0, -notch, 0};    Call Facets;
name = "top_left";  box[] = {0, r0, 0, 0};          Call Facets;
name = "top_right"; box[] = {r0, R, 0, 0};          Call Facets;
name = "bottom";    box[] = {0, R, -H, -H};         Call Facets;
name = "far_right"; box[] = {R, R, -H, 0};          Call Facets;
