// Macros for the geometries of this folder; no geometry by itself.

behind = 0; // how far a body in space goes on behind z = 0

// Layers of an extrusion that start with the size `size`, grow by the ratio `growth` up to the size `largest` and are
// then shrunk together to fill `length`. Result: the lists of Layers{layers[], ends[]}.
Macro Graded
  layers[] = {};
  ends[] = {};
  reach = 0;
  step = size;
  For i In {1:10000} // gmsh has no "while"
    If (reach < length * (1 - 1e-9))
      reach += step;
      step = growth * step < largest ? growth * step : largest;
      layers[] += {1};
      ends[] += {reach};
    EndIf
  EndFor
  For i In {0:#ends[] - 1}
    ends[i] /= reach;
  EndFor
Return

// Layers from the mouth of a crack over the length `length`, along it or away from it: of size lc up to `fine`, or growing
// by a fifth from `entry` to lc if 0 < entry < lc; beyond, growing by the ratio `growth`. Result: layers[], ends[].
Macro FromMouth
  whole = length;
  outer = growth;
  length = fine < whole ? fine : whole;
  inner = length;
  size = entry > 0 && entry < lc ? entry : lc;
  growth = 1.2;
  largest = lc;
  Call Graded;
  near[] = ends[];
  last = 1;
  If (#near[] > 1) // gmsh reads both sides of a question mark
    last = near[#near[] - 1] - near[#near[] - 2];
  EndIf
  growth = outer;
  length = whole - inner;
  size = growth * inner * last;
  largest = whole;
  If (length > 1e-9 * whole)
    Call Graded;
  Else
    ends[] = {};
  EndIf
  layers[] = {};
  all[] = {};
  For i In {0:#near[] - 1}
    layers[] += {1};
    all[] += {near[i] * inner / whole};
  EndFor
  If (#ends[] > 0)
    For i In {0:#ends[] - 1}
      layers[] += {1};
      all[] += {(inner + length * ends[i]) / whole};
    EndFor
  EndIf
  ends[] = all[];
  length = whole;
Return

// Extrude the whole plane section from z = 0 to z = depth in nz layers (dim = 3 only).
Macro Thicken
  If (dim == 3)
    sections[] = Surface{:};
    Extrude {0, 0, depth} { Surface{sections[]}; Layers{nz}; Recombine; }
  Else
    depth = 0;
  EndIf
Return

// Physical group `name` of all cells with x and y in box[] = {x_min, x_max, y_min, y_max}.
Macro Cells
  If (dim == 3)
    Physical Volume(Str(name)) = Volume In BoundingBox{box[0] - e, box[2] - e, -behind - e, box[1] + e, box[3] + e, depth + e};
  Else
    Physical Surface(Str(name)) = Surface In BoundingBox{box[0] - e, box[2] - e, -e, box[1] + e, box[3] + e, e};
  EndIf
Return

// Physical group `name` of all facets with x and y in box[]. One side of the box must be thin.
Macro Facets
  If (dim == 3)
    Physical Surface(Str(name)) = Surface In BoundingBox{box[0] - e, box[2] - e, -behind - e, box[1] + e, box[3] + e, depth + e};
  Else
    Physical Curve(Str(name)) = Curve In BoundingBox{box[0] - e, box[2] - e, -e, box[1] + e, box[3] + e, e};
  EndIf
Return

// Physical groups `name` of the faces z = 0 and "back" of the faces z = depth (dim = 3 only).
Macro Ends
  If (dim == 3)
    Physical Surface(Str(name)) = sections[];
    Physical Surface("back") = Surface In BoundingBox{-1e9, -1e9, depth - e, 1e9, 1e9, depth + e};
  EndIf
Return
