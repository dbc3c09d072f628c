// Two boxes that lie on each other, each with a mesh of its own. Lengths in mm, quadrilaterals or hexahedra.
//
//              top         y = H
//          +---------+
//          |  upper  |
//          +- slave -+     y = 0    y
//          + master  +              |
//          |  lower  |              +---- x
//          +---------+             /
//             bottom       y = -H  z  (dim = 3)
//          x = 0     x = L
//
// No node is shared. The upper box has n elements along x and z, the lower one m: the meshes match if both are equal.
// Sizes along y: ly at the joint, growing away from it. dim = 3: z from 0 to B.
Include "common.geo";
DefineConstant[
  dim    = {3,   Name "dim"},     // 2 or 3
  L      = {10,  Name "L"},       // length
  H      = {10,  Name "H"},       // height of each box
  B      = {10,  Name "B"},       // width (dim = 3)
  n      = {4,   Name "n"},       // elements along each edge of the joint in the upper box
  m      = {4,   Name "m"},       // and in the lower box
  ly     = {2.5, Name "ly"},      // element size at the joint, normal to it
  growth = {1.3, Name "growth"}   // ratio of neighbouring sizes away from the joint
];
If (dim != 2 && dim != 3)
  Error("dim = %g, must be 2 or 3", dim);
EndIf
If (L <= 0 || H <= 0 || B <= 0)
  Error("L = %g, H = %g, B = %g must be > 0", L, H, B);
EndIf
If (ly <= 0 || ly > H || n < 1 || m < 1 || growth < 1)
  Error("ly = %g must lie in (0, H = %g], n = %g, m = %g and growth = %g be at least 1", ly, H, n, m, growth);
EndIf

SetFactory("OpenCASCADE"); // in which what lies on each other stays apart
length = H;
size = ly;
largest = H;
Call Graded;
For side In {0:1}
  along = side ? n : m;
  corner = newp; Point(corner) = {0, 0, 0};
  joint[] = Extrude {L, 0, 0} { Point{corner}; Layers{along}; };
  If (dim == 3)
    face[] = Extrude {0, 0, B} { Curve{joint[1]}; Layers{along}; Recombine; };
    box[] = Extrude {0, (2 * side - 1) * H, 0} { Surface{face[1]}; Layers{layers[], ends[]}; Recombine; };
    joints[side] = face[1];
  Else
    box[] = Extrude {0, (2 * side - 1) * H, 0} { Curve{joint[1]}; Layers{layers[], ends[]}; Recombine; };
    joints[side] = joint[1];
  EndIf
  far[side] = box[0];
  cells[side] = box[1];
EndFor
If (dim == 3)
  Physical Volume("lower") = {cells[0]};
  Physical Volume("upper") = {cells[1]};
  Physical Surface("master") = {joints[0]};
  Physical Surface("slave") = {joints[1]};
  Physical Surface("bottom") = {far[0]};
  Physical Surface("top") = {far[1]};
Else
  Physical Surface("lower") = {cells[0]};
  Physical Surface("upper") = {cells[1]};
  Physical Curve("master") = {joints[0]};
  Physical Curve("slave") = {joints[1]};
  Physical Curve("bottom") = {far[0]};
  Physical Curve("top") = {far[1]};
EndIf
