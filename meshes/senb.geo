// Three-point bend of a notched beam (SENB). Lengths in mm, quadrilaterals or hexahedra.
//
//                              load                                y = W    y
//      +-----------------------====-----------------------+                 |
//      |                         : crack                  |                 |
//      |         left            :            right       |                 +---- x
//      |                         |                        |                /
//      |                         | notch                  |               z  thickness (dim = 3)
//      +---===-------------------+--------------------===-+        y = 0
//       support_left            x = 0         support_right
//
// The crack plane is x = 0: "notch" for 0 < y < a, "crack" for a < y < W. Supports and load are patches of the width
// `patch`, centred on (-S/2, 0), (S/2, 0) and (0, W), which are mesh vertices (lines along z if dim = 3).
// Sizes: lc within `band` of the crack plane and of the tip and for `ahead` above the tip, growing from there to lc_far.
// dim = 3: z from 0 to B, faces "front" (z = 0) and "back" (z = B). With sym = 1 only the half 0 < z < B/2 of a beam
// centred on z = 0, faces "symmetry" (z = 0) and "back" (z = B/2).
Include "common.geo";
DefineConstant[
  dim    = {2,    Name "dim"},     // 2 or 3
  W      = {20,   Name "W"},       // height
  S      = {80,   Name "S"},       // span, 4 W in the standard test
  L      = {100,  Name "L"},       // length of the beam
  B      = {10,   Name "B"},       // thickness (dim = 3)
  sym    = {0,    Name "sym"},     // 1: half the thickness (dim = 3)
  a      = {9,    Name "a"},       // depth of the notch
  patch  = {1,    Name "patch"},   // width of the supports and of the load
  lc     = {0.25, Name "lc"},      // element size about the tip
  lc_far = {2,    Name "lc_far"},  // largest element size along x
  band   = {2,    Name "band"},    // half width of the zone of size lc about the crack plane, and its length below the tip
  ahead  = {3,    Name "ahead"},   // length of the zone of size lc above the tip
  growth = {1.15, Name "growth"},  // ratio of neighbouring sizes outside
  nz     = {10,   Name "nz"}       // layers of elements across the modelled thickness (dim = 3)
];
If (dim != 2 && dim != 3)
  Error("dim = %g, must be 2 or 3", dim);
EndIf
If (B <= 0 || patch <= 0 || lc <= 0 || lc_far < lc)
  Error("B = %g, patch = %g, lc = %g must be > 0, lc_far = %g at least lc", B, patch, lc, lc_far);
EndIf
If (growth < 1 || nz < 1)
  Error("growth = %g, nz = %g must be at least 1", growth, nz);
EndIf
If (band <= patch / 2 || band >= a || ahead <= 0 || a + ahead >= W)
  Error("band = %g must lie in (patch/2 = %g, a = %g), ahead = %g in (0, W - a = %g)", band, patch / 2, a, ahead, W - a);
EndIf
If (S / 2 - patch / 2 <= band || L - S <= patch)
  Error("S = %g must lie in (2 band + patch = %g, L - patch = %g)", S, 2 * band + patch, L - patch);
EndIf

// The crack plane, from the tip downwards and upwards.
Point(1) = {0, a, 0};
size = growth * lc;
largest = W;
below[] = Extrude {0, -band, 0} { Point{1}; Layers{Ceil(band / lc - 1e-9)}; };
length = a - band;
Call Graded;
foot[] = Extrude {0, -length, 0} { Point{below[0]}; Layers{layers[], ends[]}; };
above[] = Extrude {0, ahead, 0} { Point{1}; Layers{Ceil(ahead / lc - 1e-9)}; };
length = W - a - ahead;
Call Graded;
head[] = Extrude {0, length, 0} { Point{above[0]}; Layers{layers[], ends[]}; };

// From the crack plane to each end: half the load, rest of the band, growing sizes, support, overhang.
length = S / 2 - patch / 2 - band;
largest = lc_far;
Call Graded;
inner = patch / 2;
overhang = (L - S - patch) / 2;
For side In {-1:1:2}
  o[] = Extrude {side * inner, 0, 0} { Curve{below[1], foot[1], above[1], head[1]}; Layers{Ceil(inner / lc - 1e-9)}; Recombine; };
  o[] = Extrude {side * (band - inner), 0, 0} { Curve{o[{0:12:4}]}; Layers{Ceil((band - inner) / lc - 1e-9)}; Recombine; };
  o[] = Extrude {side * length, 0, 0} { Curve{o[{0:12:4}]}; Layers{layers[], ends[]}; Recombine; };
  o[] = Extrude {side * patch, 0, 0} { Curve{o[{0:12:4}]}; Layers{2}; Recombine; };
  Extrude {side * overhang, 0, 0} { Curve{o[{0:12:4}]}; Layers{Ceil(overhang / lc_far - 1e-9)}; Recombine; }
EndFor
depth = sym ? B / 2 : B;
Call Thicken;

e = 1e-6 * W;
name = "left";          box[] = {-L / 2, 0, 0, W};                           Call Cells;
name = "right";         box[] = {0, L / 2, 0, W};                            Call Cells;
name = "notch";         box[] = {0, 0, 0, a};                                Call Facets;
name = "crack";         box[] = {0, 0, a, W};                                Call Facets;
name = "support_left";  box[] = {-(S + patch) / 2, -(S - patch) / 2, 0, 0};  Call Facets;
name = "support_right"; box[] = {(S - patch) / 2, (S + patch) / 2, 0, 0};    Call Facets;
name = "load";          box[] = {-inner, inner, W, W};                       Call Facets;
name = StrChoice(sym, "symmetry", "front"); Call Ends;
