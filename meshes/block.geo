// Block to be cut: two halves that meet in the plane x = 0. Lengths in mm, quadrilaterals or hexahedra.
//
//              top_left  | top_right        y = 0       y  thickness, the blade moves along -y
//            +-----------:-----------+                  |
//            |           : notch     |                  |
//   far_left |   left    |   right   | far_right        +---- x  opening of the cut
//            |           | crack     |                 /
//            +-----------+-----------+  y = -H        z  along the blade edge (dim = 3)
//          x = -Lx     bottom      x = Lx
//
// dim = 3: z from 0 to B, faces "front" (z = 0) and "back" (z = B). With sym = 1 only the half 0 < z < B/2 of a
// block centred on z = 0, faces "symmetry" (z = 0) and "back" (z = B/2). With notch = 0 there is no facet "notch".
// half = 1: only the right half of a block that is alike on both sides of the crack, whose facets then are on the boundary.
// axis > 0 (dim = 2): meridian plane of a body of revolution about x = 0, whose crack is a cylinder of this radius; the left
// half ends on the axis.
// Sizes: lc along the crack down to `deep` and across it to `band`, growing from there; smaller ones, from `entry` on, at
// the mouth of the crack or of the notch, where a tool that starts above the surface indents it.
Include "common.geo";
DefineConstant[
  dim    = {3,    Name "dim"},     // 2 or 3
  Lx     = {30,   Name "Lx"},      // length of each half
  H      = {4.2,  Name "H"},       // thickness
  axis   = {0,    Name "axis"},    // radius of a crack about the axis of revolution, 0: a plane crack
  B      = {10.1, Name "B"},       // width, the length of the cutting edge (dim = 3)
  half   = {0,    Name "half"},    // 1: only the right half
  sym    = {0,    Name "sym"},     // 1: half the width (dim = 3)
  notch  = {0.5,  Name "notch"},   // depth of the starting notch
  lc     = {0.2,  Name "lc"},      // largest element size along the crack and across the band
  band   = {1.0,  Name "band"},    // half width of the zone of uniform size about the crack
  deep   = {0,    Name "deep"},    // depth of the fine part, 0: all of the thickness
  entry  = {0,    Name "entry"},   // element size at the mouth, 0: as along the crack
  growth = {1.25, Name "growth"},  // ratio of neighbouring sizes outside of the fine part
  nz     = {10,   Name "nz"}       // layers of elements across the modelled width (dim = 3)
];
If (dim != 2 && dim != 3)
  Error("dim = %g, must be 2 or 3", dim);
EndIf
If (Lx <= 0 || H <= 0 || B <= 0 || lc <= 0 || growth < 1 || nz < 1)
  Error("Lx = %g, H = %g, B = %g, lc = %g must be > 0, growth = %g and nz = %g at least 1", Lx, H, B, lc, growth, nz);
EndIf
If (notch < 0 || notch >= H || band <= 0 || band >= Lx)
  Error("notch = %g must lie in [0, H = %g) and band = %g in (0, Lx = %g)", notch, H, band, Lx);
EndIf
If (deep < 0 || deep > H || deep > 0 && deep <= notch || entry < 0)
  Error("deep = %g must be 0 or lie in (notch = %g, H = %g], entry = %g must be at least 0", deep, notch, H, entry);
EndIf
If (axis < 0 || axis > 0 && (dim == 3 || axis <= band || half))
  Error("axis = %g must be 0, or with dim = 2 and half = 0 larger than band = %g", axis, band);
EndIf

deepest = deep > 0 ? deep : H;
mouth = entry; // of the crack, if there is no notch
lines[] = {};
foot = 1;
Point(foot) = {axis, 0, 0};
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
fine = deepest - notch;
Call FromMouth;
crack[] = Extrude {0, -length, 0} { Point{foot}; Layers{layers[], ends[]}; };
lines[] += {crack[1]};

fine = band;
entry = mouth;
For side In {half ? 1 : -1:1:2}
  length = side < 0 && axis > 0 ? axis : Lx;
  Call FromMouth;
  Extrude {side * length, 0, 0} { Curve{lines[]}; Layers{layers[], ends[]}; Recombine; }
EndFor
depth = sym ? B / 2 : B;
Call Thicken;

e = 1e-6 * H;
near = axis > 0 || half ? 0 : -Lx;
far = axis + Lx;
If (!half)
  name = "left"; box[] = {near, axis, -H, 0}; Call Cells;
EndIf
name = "right";     box[] = {axis, far, -H, 0};        Call Cells;
name = "crack";     box[] = {axis, axis, -H, -notch};  Call Facets;
If (!half)
  name = "top_left"; box[] = {near, axis, 0, 0}; Call Facets;
EndIf
name = "top_right"; box[] = {axis, far, 0, 0};         Call Facets;
name = "bottom";    box[] = {near, far, -H, -H};       Call Facets;
name = "far_right"; box[] = {far, far, -H, 0};         Call Facets;
If (axis == 0 && !half)
  name = "far_left"; box[] = {-Lx, -Lx, -H, 0}; Call Facets;
EndIf
If (notch > 0)
  name = "notch"; box[] = {axis, axis, -notch, 0}; Call Facets;
EndIf
name = StrChoice(sym, "symmetry", "front"); Call Ends;
