// Meridian plane of a punch with a rounded edge on a cylinder, which it touches at z = 0 (NAFEMS CGS-2). Lengths in mm, triangles.
//
//   axis   top        z = 100
//     |     |  punch, radius 50, edge rounded by 10
//     |---------- contact ---- z = 0
//     |     |  foundation, radius 100
//   axis   bottom     z = -200
DefineConstant[
  lc     = {1,   Name "lc"},     // elements where the bodies touch, of the punch
  ratio  = {1.5, Name "ratio"},  // of the sizes of the foundation and of the punch
  lc_far = {15,  Name "lc_far"}, // elements at the far ends
  order  = {2,   Name "order"}   // of the geometry
];
Mesh.ElementOrder = order;
Mesh.HighOrderOptimize = 0;

Point(1) = {0, 0, 0, lc};
Point(2) = {40, 0, 0, lc};
Point(3) = {40, 10, 0, lc};
Point(4) = {50, 10, 0, 2 * lc};
Point(5) = {50, 100, 0, lc_far};
Point(6) = {0, 100, 0, lc_far};
Point(7) = {40 + 10 * Sin(Pi / 8), 10 - 10 * Cos(Pi / 8), 0, lc / 2};
Line(1) = {1, 2};
Circle(2) = {2, 3, 7};
Circle(3) = {7, 3, 4};
Line(4) = {4, 5};
Line(5) = {5, 6};
Line(6) = {6, 1};
Curve Loop(1) = {1:6};
Plane Surface(1) = {1};

Point(11) = {0, 0, 0, ratio * lc};
Point(12) = {50, 0, 0, ratio * lc};
Point(13) = {100, 0, 0, lc_far};
Point(14) = {100, -200, 0, lc_far};
Point(15) = {0, -200, 0, lc_far};
Point(16) = {42, 0, 0, ratio * lc / 2};
Line(11) = {11, 16};
Line(12) = {16, 12};
Line(13) = {12, 13};
Line(14) = {13, 14};
Line(15) = {14, 15};
Line(16) = {15, 11};
Curve Loop(2) = {11:16};
Plane Surface(2) = {2};

Physical Surface("punch") = {1};
Physical Surface("foundation") = {2};
Physical Curve("contact_punch") = {1, 2, 3};
Physical Curve("contact_foundation") = {11, 12};
Physical Curve("top") = {5};
Physical Curve("bottom") = {15};
Physical Curve("axis") = {6, 16};
