// Meridian plane of a disc that is indented at the middle of its top. Lengths in mm, quadrilaterals.
//
//   axis x = 0   top                       y = 0    y  axis of revolution, the indenter moves along -y
//            +------------------------+             |
//            |                        |             |
//       axis |          disc          | side        +---- x  distance from the axis
//            |                        |
//            +------------------------+  y = -H
//                     bottom        x = R
//
// Sizes: lc within `core` of the middle of the top, growing from there.
Include "common.geo";
DefineConstant[
  R      = {30,  Name "R"},       // radius of the disc
  H      = {20,  Name "H"},       // thickness
  core   = {3,   Name "core"},    // edge of the square of small elements
  lc     = {0.2, Name "lc"},      // element size there
  growth = {1.2, Name "growth"}   // ratio of neighbouring sizes outside
];
If (lc <= 0 || core < lc || core >= R || core >= H || growth < 1)
  Error("lc = %g must be > 0, core = %g at least lc and less than R = %g and H = %g, growth = %g at least 1", lc, core, R, H, growth);
EndIf
n = Ceil(core / lc - 1e-9);
Point(1) = {0, 0, 0};
near[] = Extrude {core, 0, 0} { Point{1}; Layers{n}; };
size = growth * lc;
length = R - core;
largest = R;
Call Graded;
far[] = Extrude {length, 0, 0} { Point{near[0]}; Layers{layers[], ends[]}; };
upper[] = Extrude {0, -core, 0} { Curve{near[1], far[1]}; Layers{n}; Recombine; };
length = H - core;
largest = H;
Call Graded;
Extrude {0, -length, 0} { Curve{upper[0], upper[4]}; Layers{layers[], ends[]}; Recombine; }
dim = 2;
depth = 0;
e = 1e-6 * H;
name = "disc";   box[] = {0, R, -H, 0};   Call Cells;
name = "top";    box[] = {0, R, 0, 0};    Call Facets;
name = "bottom"; box[] = {0, R, -H, -H};  Call Facets;
name = "axis";   box[] = {0, 0, -H, 0};   Call Facets;
name = "side";   box[] = {R, R, -H, 0};   Call Facets;
