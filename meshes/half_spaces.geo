// One or two blocks that are large against a contact at the origin, a quarter of each. Lengths in mm, hexahedra.
//
//         z
//         |   upper: 0 < x, y < L, 0 < z < L (if n_upper > 0)
//         +---------> x, y       core: a cube of edge c at the origin with n cells along each edge
//         |   lower: 0 < x, y < L, -L < z < 0
//
// From each core the cells grow outwards by the ratio `growth`. The faces x = 0 and y = 0 are planes of symmetry. The
// blocks share no node; "contact_lower" and "contact_upper" are the faces of the cores at z = 0. With order = 2 edges
// and faces have nodes of their own, which can be moved to a curved surface.
DefineConstant[
  L       = {300, Name "L"},       // edge of each block
  c       = {4,   Name "c"},       // edge of the cores
  n       = {6,   Name "n"},       // cells along the edge of the core, lower block
  n_upper = {0,   Name "n_upper"}, // the same of the upper block; 0: no such block
  growth  = {1.5, Name "growth"},  // ratio of neighbouring sizes outside of the cores
  order   = {1,   Name "order"}    // of the geometry
];
If (c <= 0 || L <= 2 * c)
  Error("c = %g must be > 0, L = %g larger than 2 c", c, L);
EndIf
If (n < 1 || n_upper < 0 || growth <= 1)
  Error("n = %g must be at least 1, n_upper = %g at least 0, growth = %g > 1", n, n_upper, growth);
EndIf
Mesh.ElementOrder = order;

// A block above (side = 1) or below (side = -1) with `cells` along the core; result: solids[]. Corner m of a cube is
// (i, j, k) with m = i + 2 j + 4 k; edge 8 d + m goes from m along axis d; face 2 d + b is normal to d at its end b.
Macro Quarter
  layers = Ceil(Log(1 + (L - c) * (growth - 1) / (growth * c / cells)) / Log(growth));
  For m In {0:7}
    i = m % 2;
    j = Floor(m / 2) % 2;
    k = Floor(m / 4);
    inner[m] = newp; Point(inner[m]) = {c * i, c * j, side * c * k};
    outer[m] = newp; Point(outer[m]) = {L * i, L * j, side * L * k};
    If (m > 0)
      ray[m] = newl; Line(ray[m]) = {inner[m], outer[m]};
      Transfinite Curve{ray[m]} = layers + 1 Using Progression growth;
    EndIf
  EndFor
  For d In {0:2}
    For m In {0:7}
      If (Floor(m / 2^d) % 2 == 0)
        e = 8 * d + m;
        near[e] = newl; Line(near[e]) = {inner[m], inner[m + 2^d]};
        far[e] = newl; Line(far[e]) = {outer[m], outer[m + 2^d]};
        Transfinite Curve{near[e], far[e]} = cells + 1;
        If (m > 0)
          loop = newll; Curve Loop(loop) = {near[e], ray[m + 2^d], -far[e], -ray[m]};
          between[e] = news; Plane Surface(between[e]) = {loop};
          Transfinite Surface{between[e]} = {inner[m], inner[m + 2^d], outer[m + 2^d], outer[m]};
        EndIf
      EndIf
    EndFor
  EndFor
  core[] = {};
  shells[] = {};
  For d In {0:2}
    p = (d + 1) % 3;
    q = (d + 2) % 3;
    For b In {0:1}
      m = b * 2^d;
      f = 2 * d + b;
      loop = newll; Curve Loop(loop) = {near[8 * p + m], near[8 * q + m + 2^p], -near[8 * p + m + 2^q], -near[8 * q + m]};
      face = news; Plane Surface(face) = {loop};
      Transfinite Surface{face};
      core[] += {face};
      If (b == 1)
        loop = newll; Curve Loop(loop) = {far[8 * p + m], far[8 * q + m + 2^p], -far[8 * p + m + 2^q], -far[8 * q + m]};
        end = news; Plane Surface(end) = {loop};
        Transfinite Surface{end};
        loop = newsl; Surface Loop(loop) = {face, end, between[8 * p + m], between[8 * q + m + 2^p], between[8 * p + m + 2^q], between[8 * q + m]};
        solid = newv; Volume(solid) = {loop};
        shells[] += {solid};
      EndIf
    EndFor
  EndFor
  loop = newsl; Surface Loop(loop) = core[];
  solid = newv; Volume(solid) = {loop};
  solids[] = {solid, shells[]};
  Transfinite Volume{solids[]};
Return

tiny = 1e-6 * c;
side = -1;
cells = n;
Call Quarter;
Physical Volume("lower") = {solids[]};
Physical Surface("contact_lower") = Surface In BoundingBox{-tiny, -tiny, -tiny, c + tiny, c + tiny, tiny};
Physical Surface("bottom") = Surface In BoundingBox{-tiny, -tiny, -L - tiny, L + tiny, L + tiny, -L + tiny};
If (n_upper > 0)
  first = news;
  side = 1;
  cells = n_upper;
  Call Quarter;
  Physical Volume("upper") = {solids[]};
  facing[] = Surface In BoundingBox{-tiny, -tiny, -tiny, c + tiny, c + tiny, tiny};
  Physical Surface("contact_upper") = {facing[0] < first ? facing[1] : facing[0]};
  Physical Surface("top") = Surface In BoundingBox{-tiny, -tiny, L - tiny, L + tiny, L + tiny, L + tiny};
EndIf
Physical Surface("symmetry_x") = Surface In BoundingBox{-tiny, -tiny, -L - tiny, tiny, L + tiny, L + tiny};
Physical Surface("symmetry_y") = Surface In BoundingBox{-tiny, -tiny, -L - tiny, L + tiny, tiny, L + tiny};
Recombine Surface{:};
