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
Include "common.geo";
DefineConstant[
  dim    = {3,    Name "dim"},     // 2 or 3
  Lx     = {30,   Name "Lx"},      // length of each half
  H      = {4.2,  Name "H"},       // thickness
  B      = {10.1, Name "B"},       // width, the length of the cutting edge (dim = 3)
  sym    = {0,    Name "sym"},     // 1: half the width (dim = 3)
  notch  = {0.5,  Name "notch"},   // depth of the starting notch
  lc     = {0.2,  Name "lc"},      // largest element size along the crack and across the band
  band   = {1.0,  Name "band"},    // half width of the zone of uniform size about the crack
  growth = {1.25, Name "growth"},  // ratio of neighbouring sizes outside the band
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

Point(1) = {0, -H, 0};
Point(2) = {0, -notch, 0};
Line(1) = {1, 2};
Transfinite Curve{1} = Ceil((H - notch) / lc - 1e-9) + 1;
lines[] = {1};
If (notch > 0)
  Point(3) = {0, 0, 0};
  Line(2) = {2, 3};
  Transfinite Curve{2} = Ceil(notch / lc - 1e-9) + 1;
  lines[] += {2};
EndIf

n_band = Ceil(band / lc - 1e-9);
size = growth * band / n_band;
length = Lx - band;
largest = Lx;
Call Graded;
For side In {-1:1:2}
  out[] = Extrude {side * band, 0, 0} { Curve{lines[]}; Layers{n_band}; Recombine; };
  Extrude {side * length, 0, 0} { Curve{out[{0:#out[] - 1:4}]}; Layers{layers[], ends[]}; Recombine; }
EndFor
depth = sym ? B / 2 : B;
Call Thicken;

e = 1e-6 * H;
name = "left";      box[] = {-Lx, 0, -H, 0};         Call Cells;
name = "right";     box[] = {0, Lx, -H, 0};          Call Cells;
name = "crack";     box[] = {0, 0, -H, -notch};      Call Facets;
name = "top_left";  box[] = {-Lx, 0, 0, 0};          Call Facets;
name = "top_right"; box[] = {0, Lx, 0, 0};           Call Facets;
name = "bottom";    box[] = {-Lx, Lx, -H, -H};       Call Facets;
name = "far_left";  box[] = {-Lx, -Lx, -H, 0};       Call Facets;
name = "far_right"; box[] = {Lx, Lx, -H, 0};         Call Facets;
If (notch > 0)
  name = "notch"; box[] = {0, 0, -notch, 0}; Call Facets;
EndIf
name = StrChoice(sym, "symmetry", "front"); Call Ends;
