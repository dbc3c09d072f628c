// Two strips that lie on each other and whose ends stand up like the arms of a T. Lengths in mm, triangles.
//
//      upper_grip
//      +---+  y = arm                                       y
//      |   |                                                |
//      |   +-------------------------------+  y = h         +---- x  the strips peel off each other
//      |               upper               |
//      +- cut -+--------- glued -----------+  y = 0
//      |               lower               |
//      |   +-------------------------------+  y = -h
//      |   |
//      +---+  y = -arm                   x = tail
//      lower_grip
//
// Sizes: fine along y = 0, coarse at the outer corners.
DefineConstant[
  h      = {1.5, Name "h"},       // thickness of the strips and of their arms
  arm    = {5,   Name "arm"},     // height of the arms
  tail   = {26,  Name "tail"},    // length of the strips
  slit   = {4,   Name "slit"},    // length without glue
  fine   = {0.2, Name "fine"},    // element size where the strips are glued
  coarse = {0.5, Name "coarse"}   // element size elsewhere
];
If (h <= 0 || arm <= h || slit <= 0 || tail <= slit || tail <= h)
  Error("h = %g must be > 0, arm = %g larger, slit = %g > 0, tail = %g larger than both", h, arm, slit, tail);
EndIf
If (fine <= 0 || coarse < fine)
  Error("fine = %g must be > 0 and coarse = %g at least as large", fine, coarse);
EndIf
Point(1) = {0, 0, 0, fine};
Point(2) = {slit, 0, 0, fine};
Point(3) = {tail, 0, 0, fine};
Line(1) = {1, 2};
Line(2) = {2, 3};
For side In {1:-1:-2}
  p = newp;
  Point(p) = {tail, side * h, 0, coarse};
  Point(p + 1) = {h, side * h, 0, coarse};
  Point(p + 2) = {h, side * arm, 0, coarse};
  Point(p + 3) = {0, side * arm, 0, coarse};
  c = newc;
  Line(c) = {3, p};
  Line(c + 1) = {p, p + 1};
  Line(c + 2) = {p + 1, p + 2};
  Line(c + 3) = {p + 2, p + 3};
  Line(c + 4) = {p + 3, 1};
  loop = newcl; Curve Loop(loop) = {1, 2, c:c + 4};
  strip = news; Plane Surface(strip) = {loop};
  Physical Surface(StrChoice(side > 0, "upper", "lower")) = {strip};
  Physical Curve(StrChoice(side > 0, "upper_grip", "lower_grip")) = {c + 3};
EndFor
Physical Curve("cut") = {1};
Physical Curve("glued") = {2};
