// Half a cylinder on another one or on a block, which it touches at the origin, in plane strain. Lengths in mm, triangles.
//
//      (-R, R) +-------- top --------+ (R, R)
//               \       upper       /
//                 \               /
//      -------------- contact ------------- y = 0      lower: a half cylinder of radius R_lower, or if R_lower = 0
//      |               lower              |            a block of width W and height H
//      +------------- bottom -------------+
//
// Sizes: lc on the curves "contact_upper" for |x| < band, ratio * lc on "contact_lower", growing from there to lc_far.
// The bodies share no node.
DefineConstant[
  R       = {8,    Name "R"},       // radius of the upper cylinder
  R_lower = {8,    Name "R_lower"}, // radius of the lower cylinder, 0 for a block
  W       = {200,  Name "W"},       // width of the block
  H       = {200,  Name "H"},       // height of the block
  band    = {1,    Name "band"},    // half the width in which the bodies may touch
  lc      = {0.05, Name "lc"},      // element size there, upper body
  ratio   = {1.4,  Name "ratio"},   // of the sizes of the lower and of the upper body
  lc_far  = {1,    Name "lc_far"},  // element size at the far ends
  order   = {2,    Name "order"}    // of the geometry
];
If (R <= 0 || R_lower < 0 || W <= 0 || H <= 0)
  Error("R = %g, W = %g, H = %g must be > 0, R_lower = %g at least 0", R, W, H, R_lower);
EndIf
If (band <= 0 || band >= R || (R_lower > 0 && band >= R_lower) || (R_lower == 0 && 2 * band >= W))
  Error("band = %g must be > 0 and smaller than the bodies", band);
EndIf
If (lc <= 0 || ratio <= 0 || lc_far < lc || lc_far < ratio * lc)
  Error("lc = %g, ratio = %g must be > 0, lc_far = %g at least lc and ratio * lc", lc, ratio, lc_far);
EndIf
Mesh.ElementOrder = order;
Mesh.HighOrderOptimize = 0;

// A half cylinder of radius r above (side = 1) or below (side = -1) the origin, of size h where it touches.
Macro HalfCylinder
  rise = r - Sqrt(r^2 - band^2);
  middle = newp; Point(middle) = {0, side * r, 0, lc_far};
  foot = newp; Point(foot) = {0, 0, 0, h};
  near[] = {};
  ends[] = {};
  For i In {-1:1:2}
    near[] += {newp}; Point(near[#near[] - 1]) = {i * band, side * rise, 0, h};
    ends[] += {newp}; Point(ends[#ends[] - 1]) = {i * r, side * r, 0, lc_far};
  EndFor
  arc = newl;
  Circle(arc) = {ends[0], middle, near[0]};
  Circle(arc + 1) = {near[0], middle, foot};
  Circle(arc + 2) = {foot, middle, near[1]};
  Circle(arc + 3) = {near[1], middle, ends[1]};
  Line(arc + 4) = {ends[1], middle};
  Line(arc + 5) = {middle, ends[0]};
  Curve Loop(arc) = {arc:arc + 5};
  body = news; Plane Surface(body) = {arc};
  contact[] = {arc + 1, arc + 2};
  flat[] = {arc + 4, arc + 5};
Return

side = 1; r = R; h = lc;
Call HalfCylinder;
Physical Surface("upper") = {body};
Physical Curve("contact_upper") = contact[];
Physical Curve("top") = flat[];

h = ratio * lc;
If (R_lower > 0)
  side = -1; r = R_lower;
  Call HalfCylinder;
Else
  p = newp;
  Point(p) = {-W / 2, 0, 0, lc_far};
  Point(p + 1) = {-band, 0, 0, h};
  Point(p + 2) = {band, 0, 0, h};
  Point(p + 3) = {W / 2, 0, 0, lc_far};
  Point(p + 4) = {W / 2, -H, 0, lc_far};
  Point(p + 5) = {-W / 2, -H, 0, lc_far};
  edge = newl;
  For i In {0:5}
    Line(edge + i) = {p + i, p + (i + 1) % 6};
  EndFor
  Curve Loop(edge) = {edge:edge + 5};
  body = news; Plane Surface(body) = {edge};
  contact[] = {edge + 1};
  flat[] = {edge + 4};
EndIf
Physical Surface("lower") = {body};
Physical Curve("contact_lower") = contact[];
Physical Curve("bottom") = flat[];
