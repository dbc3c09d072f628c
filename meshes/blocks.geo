// A block on a slab, in contact along y = 0. Lengths in mm, hexahedra.
//
//                        top                 y = H
//                    +---------+
//                    |  upper  |
//          +---------+- crack -+---------+   y = 0    y
//          |            lower            |            |
//          +-----------------------------+   y = -H   +---- x  sliding
//     x = -L/2   x = -B/2   x = B/2   x = L/2        /
//                      bottom                       z  width
//
// Sizes along x: B / nx under the block, growing from there to both ends of the slab; with L = B the slab is as long as
// the block. Sizes along y: ly at the contact, growing away from it.
// z from 0 to B, faces "front" (z = 0) and "back" (z = B).
Include "common.geo";
DefineConstant[
  B      = {10,  Name "B"},       // length of the block, and width of both
  H      = {10,  Name "H"},       // height of block and slab
  L      = {100, Name "L"},       // length of the slab, at least B
  nx     = {4,   Name "nx"},      // elements along the block, and across the width
  ly     = {1,   Name "ly"},      // element size at the contact, normal to it
  growth = {1.3, Name "growth"}   // ratio of neighbouring sizes away from the contact
];
If (B <= 0 || H <= 0 || L < B)
  Error("B = %g, H = %g must be > 0 and L = %g at least B", B, H, L);
EndIf
If (ly <= 0 || ly > H || nx < 1 || growth < 1)
  Error("ly = %g must lie in (0, H = %g], nx = %g and growth = %g be at least 1", ly, H, nx, growth);
EndIf

dim = 3;
Point(1) = {-B / 2, 0, 0};
face[] = Extrude {B, 0, 0} { Point{1}; Layers{nx}; };
line[] = {face[1]};
length = (L - B) / 2;
size = growth * B / nx;
largest = L;
If (length > 0)
  Call Graded;
  left[] = Extrude {-length, 0, 0} { Point{1}; Layers{layers[], ends[]}; };
  right[] = Extrude {length, 0, 0} { Point{face[0]}; Layers{layers[], ends[]}; };
  line[] += {left[1], right[1]};
EndIf
length = H;
size = ly;
largest = H;
Call Graded;
Extrude {0, H, 0} { Curve{face[1]}; Layers{layers[], ends[]}; Recombine; }
Extrude {0, -H, 0} { Curve{line[]}; Layers{layers[], ends[]}; Recombine; }
depth = B;
nz = nx;
Call Thicken;

e = 1e-6 * B;
name = "lower";  box[] = {-L / 2, L / 2, -H, 0};  Call Cells;
name = "upper";  box[] = {-B / 2, B / 2, 0, H};   Call Cells;
name = "crack";  box[] = {-B / 2, B / 2, 0, 0};   Call Facets;
name = "top";    box[] = {-B / 2, B / 2, H, H};   Call Facets;
name = "bottom"; box[] = {-L / 2, L / 2, -H, -H}; Call Facets;
name = "front"; Call Ends;
