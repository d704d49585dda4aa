// A sector of a thick ring: radii 0.1 and 0.2 m, 30 degrees, 0.05 m high. kind 0: hexahedra, 1: prisms, 2: tetrahedra.
DefineConstant[ kind = 0 ];
Point(1) = {0.1, 0, 0};
Point(2) = {0.2, 0, 0};
Point(3) = {0.2, 0, 0.05};
Point(4) = {0.1, 0, 0.05};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Transfinite Curve {1, 3} = 3;
Transfinite Curve {2, 4} = 2;
Transfinite Surface {1};
If (kind == 0)
  Recombine Surface {1};
EndIf
If (kind == 2)
  out[] = Extrude {{0, 0, 1}, {0, 0, 0}, Pi / 6} { Surface{1}; Layers{1}; };
Else
  out[] = Extrude {{0, 0, 1}, {0, 0, 0}, Pi / 6} { Surface{1}; Layers{1}; Recombine; };
EndIf
Physical Volume("ring") = {out[1]};
Physical Surface("root") = {1};
Physical Curve("inner edge") = {4};
Physical Point("corner") = {1};
