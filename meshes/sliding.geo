// A block that slides on a slab, with a mesh of its own. Lengths in mm, quadrilaterals.
//
//        x = X   top   x = X + B      y = H
//          +---------+
//          |  upper  |
//     +----+- rubbing +--------+      y = 0    y
//     | track   lower          |               |
//     +------------------------+      y = -H   +---- x  sliding
//  x = 0       bottom        x = L
//
// No node is shared. Sizes along x: B / nx in the block, L / nl in the slab; along y: ly at the contact, growing away
// from it.
Include "common.geo";
DefineConstant[
  B      = {10,  Name "B"},       // length of the block
  H      = {10,  Name "H"},       // height of block and slab
  L      = {100, Name "L"},       // length of the slab
  X      = {15,  Name "X"},       // where the block begins
  nx     = {12,  Name "nx"},      // elements along the block
  nl     = {100, Name "nl"},      // elements along the slab
  ly     = {1,   Name "ly"},      // element size at the contact, normal to it
  growth = {1.3, Name "growth"}   // ratio of neighbouring sizes away from the contact
];
If (B <= 0 || H <= 0 || X < 0 || L < X + B)
  Error("B = %g, H = %g must be > 0, X = %g at least 0 and L = %g at least X + B", B, H, X, L);
EndIf
If (ly <= 0 || ly > H || nx < 1 || nl < 1 || growth < 1)
  Error("ly = %g must lie in (0, H], nx = %g, nl = %g and growth = %g be at least 1", ly, nx, nl, growth);
EndIf

length = H;
size = ly;
largest = H;
Call Graded;
Point(1) = {X, 0, 0};
Point(2) = {0, 0, 0};
rubbing[] = Extrude {B, 0, 0} { Point{1}; Layers{nx}; };
track[] = Extrude {L, 0, 0} { Point{2}; Layers{nl}; };
upper[] = Extrude {0, H, 0} { Curve{rubbing[1]}; Layers{layers[], ends[]}; Recombine; };
lower[] = Extrude {0, -H, 0} { Curve{track[1]}; Layers{layers[], ends[]}; Recombine; };
Physical Surface("upper") = {upper[1]};
Physical Surface("lower") = {lower[1]};
Physical Curve("rubbing") = {rubbing[1]};
Physical Curve("track") = {track[1]};
Physical Curve("top") = {upper[0]};
Physical Curve("bottom") = {lower[0]};
