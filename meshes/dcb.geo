// Double cantilever beam: two arms bonded along y = 0. Lengths in mm, quadrilaterals or hexahedra.
//
//                                     top                           y = h    y  opening
//               +--------------------------------------------+               |
//   load_upper  |                   upper                    |               |
//               + - - precrack - - +--------- crack ---------+  end y = 0    +---- x  crack growth
//   load_lower  |                   lower                    |              /
//               +--------------------------------------------+             z  width (dim = 3)
//             x = 0               x = a0  bottom           x = L    y = -h
//
// Sizes along x: lc_arm from x = 0, lc from a0 - back to a0 + fine, growing from there to x = L.
// Fully integrated first-order elements of the size s bend too stiffly, by about (s / h)^2 / 3 + 1 / (4 ny^2)
// (measured on a cantilever): keep lc and lc_arm below h / 5, or use second order.
// dim = 3: z from 0 to b, faces "front" (z = 0) and "back" (z = b). With sym = 1 only the half 0 < z < b/2 of a beam
// centred on z = 0, faces "symmetry" (z = 0) and "back" (z = b/2).
Include "common.geo";
DefineConstant[
  dim    = {2,    Name "dim"},     // 2 or 3
  L      = {100,  Name "L"},       // length
  h      = {1.5,  Name "h"},       // thickness of each arm
  b      = {20,   Name "b"},       // width (dim = 3)
  sym    = {0,    Name "sym"},     // 1: half the width (dim = 3)
  a0     = {30,   Name "a0"},      // initial crack, from the loaded end
  back   = {5,    Name "back"},    // length of fine mesh behind the initial front
  fine   = {35,   Name "fine"},    // length of fine mesh ahead of the initial front
  lc     = {0.25, Name "lc"},      // largest element size along the fine mesh
  lc_arm = {0.25, Name "lc_arm"},  // largest element size between the loaded end and the fine mesh
  growth = {1.1,  Name "growth"},  // ratio of neighbouring sizes beyond the fine mesh
  ny     = {6,    Name "ny"},      // elements through each arm
  nz     = {10,   Name "nz"}       // layers of elements across the modelled width (dim = 3)
];
If (dim != 2 && dim != 3)
  Error("dim = %g, must be 2 or 3", dim);
EndIf
If (h <= 0 || b <= 0 || lc <= 0 || lc_arm <= 0)
  Error("h = %g, b = %g, lc = %g, lc_arm = %g must be > 0", h, b, lc, lc_arm);
EndIf
If (growth < 1 || ny < 1 || nz < 1)
  Error("growth = %g, ny = %g, nz = %g must be at least 1", growth, ny, nz);
EndIf
If (back <= 0 || back >= a0 || fine <= 0 || a0 + fine >= L)
  Error("back = %g must lie in (0, a0 = %g) and fine = %g in (0, L - a0 = %g)", back, a0, fine, L - a0);
EndIf

length = L - a0 - fine;
size = growth * lc;
largest = L;
Call Graded;
Point(1) = {0, 0, 0};
arm[] = Extrude {a0 - back, 0, 0} { Point{1}; Layers{Ceil((a0 - back) / lc_arm - 1e-9)}; };
tip[] = Extrude {back, 0, 0} { Point{arm[0]}; Layers{Ceil(back / lc - 1e-9)}; };
path[] = Extrude {fine, 0, 0} { Point{tip[0]}; Layers{Ceil(fine / lc - 1e-9)}; };
rest[] = Extrude {length, 0, 0} { Point{path[0]}; Layers{layers[], ends[]}; };
For side In {-1:1:2}
  Extrude {0, side * h, 0} { Curve{arm[1], tip[1], path[1], rest[1]}; Layers{ny}; Recombine; }
EndFor
depth = sym ? b / 2 : b;
Call Thicken;

e = 1e-6 * h;
name = "lower";      box[] = {0, L, -h, 0};  Call Cells;
name = "upper";      box[] = {0, L, 0, h};   Call Cells;
name = "crack";      box[] = {a0, L, 0, 0};  Call Facets;
name = "precrack";   box[] = {0, a0, 0, 0};  Call Facets;
name = "load_upper"; box[] = {0, 0, 0, h};   Call Facets;
name = "load_lower"; box[] = {0, 0, -h, 0};  Call Facets;
name = "end";        box[] = {L, L, -h, h};  Call Facets;
name = "top";        box[] = {0, L, h, h};   Call Facets;
name = "bottom";     box[] = {0, L, -h, -h}; Call Facets;
name = StrChoice(sym, "symmetry", "front"); Call Ends;
