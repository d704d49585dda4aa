#!/bin/sh
# Made the .msh files of this folder with Gmsh 4.8.4 (Debian 12). Run here; a new version may place nodes otherwise.
set -e
mesh() {  # name, options
  file=$1.msh
  shift
  gmsh -v 2 -3 sector.geo -o "$file" "$@"
}
for cells in hex:0 wedge:1 tet:2; do
  kind=${cells#*:}
  name=${cells%:*}
  mesh "${name}_1_v41" -setnumber kind "$kind" -format msh41
  mesh "${name}_2_v41" -setnumber kind "$kind" -order 2 -format msh41 -setnumber Mesh.SecondOrderIncomplete 1
  mesh "${name}_2_v22" -setnumber kind "$kind" -order 2 -format msh22 -setnumber Mesh.SecondOrderIncomplete 1
  mesh "${name}_2_v41_binary" -setnumber kind "$kind" -order 2 -format msh41 -bin -setnumber Mesh.SecondOrderIncomplete 1
done
mesh tet_1_v22_binary -setnumber kind 2 -format msh22 -bin
mesh hex_2_full_v41 -order 2 -format msh41
for order in 3 4 5 8; do
  mesh "hex_${order}_v41_binary" -order "$order" -format msh41 -bin
done
mesh hex_3_v22 -order 3 -format msh22
mesh hex_1_parametric_v41 -format msh41 -setnumber Mesh.SaveParametric 1
mesh hex_1_no_groups_v41 -format msh41 -setnumber Mesh.SaveAll 1
