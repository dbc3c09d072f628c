// Block that a needle splits, or its half in front of the plane z = 0; the needle's axis is y. Lengths in mm, hexahedra.
//
//        top_left  | top_right   y = 0      y  the needle moves along -y
//      +-----------:-----------+            |
//      |           : notch     |            |          z  along the crack, away from the needle
//      |   left    |   right   |            +---- x  opening of the crack
//      |           | crack     |
//      +-----------+-----------+  y = -H
//     -L         bottom        L
//
// The plane x = 0 is the crack, but for the notch |z| < slit, -notch < y < 0. Faces "symmetry" (z = 0), "back" (z = B);
// with whole = 1 "front" (z = -B) in place of the first, for a needle whose two halves along the crack differ.
// half = 1: only the right half of a block that is alike on both sides of the crack, whose facets then are on the boundary.
// With notch = 0 there is no facet "notch", and `slit` is the half width of the fine part.
// Sizes: lc down to `deep`, out to `band` and along z to `slit`, growing from there.
Include "common.geo";
DefineConstant[
  L      = {12,  Name "L"},       // length of each half
  B      = {10,  Name "B"},       // half the width
  whole  = {0,   Name "whole"},   // 1: with the half behind z = 0
  half   = {0,   Name "half"},    // 1: only the right half
  H      = {10,  Name "H"},       // height
  notch  = {1,   Name "notch"},   // depth of the starting notch
  slit   = {1.4, Name "slit"},    // half its width
  deep   = {6,   Name "deep"},    // depth of the fine part
  band   = {0.8, Name "band"},    // half width of the fine part
  lc     = {0.2, Name "lc"},      // element size there
  entry  = {0,   Name "entry"},   // element size at the mouth, from which they grow to lc; 0: lc
  growth = {1.4, Name "growth"}   // ratio of neighbouring sizes outside
];
If (lc <= 0 || growth <= 1 || band <= 0 || band >= L || slit <= 0 || slit >= B)
  Error("lc = %g must be > 0, growth = %g > 1, band = %g in (0, L = %g), slit = %g in (0, B = %g)", lc, growth, band, L, slit, B);
EndIf
If (notch < 0 || notch >= deep || deep >= H)
  Error("notch = %g must lie in [0, deep = %g), deep in (0, H = %g)", notch, deep, H);
EndIf

both = whole; // macros have a variable of this name
mouth = entry; // of the crack, if there is no notch
lines[] = {};
foot = 1;
Point(foot) = {0, 0, 0};
If (notch > 0)
  length = notch;
  fine = notch;
  Call FromMouth;
  rim[] = Extrude {0, -notch, 0} { Point{foot}; Layers{layers[], ends[]}; };
  foot = rim[0];
  lines[] += {rim[1]};
  entry = 0;
EndIf
length = H - notch;
fine = deep - notch;
Call FromMouth;
crack[] = Extrude {0, -length, 0} { Point{foot}; Layers{layers[], ends[]}; };
lines[] += {crack[1]};

length = L;
fine = band;
entry = mouth;
Call FromMouth;
For side In {half ? 1 : -1:1:2}
  Extrude {side * L, 0, 0} { Curve{lines[]}; Layers{layers[], ends[]}; Recombine; }
EndFor

sections[] = Surface{:};
For back In {0:both}
  way = 1 - 2 * back;
  length = slit;
  fine = slit;
  Call FromMouth;
  far[] = Extrude {0, 0, way * slit} { Surface{sections[]}; Layers{layers[], ends[]}; Recombine; };
  size = growth * lc;
  largest = B;
  length = B - slit;
  Call Graded;
  Extrude {0, 0, way * length} { Surface{far[{0:#far[] - 1:6}]}; Layers{layers[], ends[]}; Recombine; }
EndFor

depth = B;
behind = both * B;
dim = 3;
e = 1e-6 * H;
near = half ? 0 : -L;
If (!half)
  name = "left";     box[] = {near, 0, -H, 0}; Call Cells;
  name = "top_left"; box[] = {near, 0, 0, 0};  Call Facets;
EndIf
name = "right";     box[] = {0, L, -H, 0};      Call Cells;
name = "top_right"; box[] = {0, L, 0, 0};       Call Facets;
name = "bottom";    box[] = {near, L, -H, -H};  Call Facets;
If (both)
  sections[] = Surface In BoundingBox{-L - e, -H - e, -B - e, L + e, e, -B + e};
EndIf
name = StrChoice(both, "front", "symmetry"); Call Ends;
plane[] = Surface In BoundingBox{-e, -H - e, -behind - e, e, e, B + e};
If (notch > 0)
  notched[] = Surface In BoundingBox{-e, -notch - e, -both * slit - e, e, e, slit + e};
  plane[] -= notched[];
  Physical Surface("notch") = notched[];
EndIf
Physical Surface("crack") = plane[];
