#pragma once

#include "fem/base/check.hpp"
#include "reduction/body/reduced_body.hpp"
#include "reduction/body_file/hdf5.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <type_traits>
#include <utility>

// What a body file holds: every field once, for both directions. An archive is one of
//   `size(name, current, allowed)`   leading extent of a dataset, now or in the file; `allowed` empty: any
//   `resize(name, list, count)`      makes it so, or requires it
//   `matrices(field, lead, each, blocks)`, `values(field, shape, entries)`   one dataset from pointers to its parts
//   `attribute(name, text)`          of the root group
namespace flexboom::body_file {

/// Pointers to `member` of all rows.
template <class Rows, class Member>
auto column(Rows& rows, Member member) {
  std::vector<decltype(&(rows[0].*member))> result;
  result.reserve(rows.size());
  for (auto& row : rows) result.push_back(&(row.*member));
  return result;
}

/// Pointers to all entries of a list.
template <class List>
auto entries_of(List& list) {
  std::vector<decltype(&list[0])> result;
  result.reserve(list.size());
  for (auto& entry : list) result.push_back(&entry);
  return result;
}

/// Pointers to all entries of a list of lists.
template <class Lists>
auto flat(Lists& lists) {
  std::vector<decltype(&lists[0][0])> result;
  for (auto& list : lists) {
    for (auto& entry : list) result.push_back(&entry);
  }
  return result;
}

template <class Archive, class Matrix>
void matrix(Archive& a, const Field& field, Matrix& block, const Shape& shape) {
  a.matrices(field, {}, shape, std::vector<Matrix*>{&block});
}

template <class Archive, class Stack>
void stack(Archive& a, const Field& field, Stack& blocks, std::uint64_t count, const Shape& each) {
  a.resize(field.name, blocks, count);
  a.matrices(field, {count}, each, entries_of(blocks));
}

/// A stack that may be empty, else has `count` entries.
template <class Archive, class Stack>
void optional_stack(Archive& a, const Field& field, Stack& blocks, std::uint64_t count, const Shape& each) {
  stack(a, field, blocks, a.size(field.name, blocks.size(), {0, count}), each);
}

template <class Archive, class Rows>
std::uint64_t rows_of(Archive& a, const std::string& group, Rows& rows) {
  const std::string name = group + "/name";
  const std::uint64_t count = a.size(name, rows.size(), {});
  a.resize(name, rows, count);
  return count;
}

template <class Archive, class Body>
void invariants(Archive& a, Body& body, std::uint64_t n) {
  a.values({"m", "kg", "mass: integral of rho"}, {}, std::vector{&body.m});
  matrix(a, {"mc0", "kg m", "first moment: rho u0"}, body.mc0, {3});
  matrix(a, {"J0", "kg m^2", "inertia: -rho tilde(u0) tilde(u0)"}, body.J0, {3, 3});
  matrix(a, {"Ct", "kg m/q", "rho S"}, body.Ct, {3, n});
  matrix(a, {"Cr0", "kg m^2/q", "rho tilde(u0) S"}, body.Cr0, {3, n});
  stack(a, {"Cr1", "kg m^2/q^2", "[k]: rho tilde(S_k) S"}, body.Cr1, n, {3, n});
  matrix(a, {"Me", "kg m^2/q^2", "rho S^T S"}, body.Me, {n, n});
  stack(a, {"J1", "kg m^2/q", "[k]: -rho (tilde(u0) tilde(S_k) + tilde(S_k) tilde(u0))"}, body.J1, n, {3, 3});
  const Field J2 = {"J2", "kg m^2/q^2", "[k, l]: -rho tilde(S_k) tilde(S_l), symmetrised in k, l"};
  a.resize(J2.name, body.J2, n);
  for (auto& row : body.J2) a.resize(J2.name, row, n);
  a.matrices(J2, {n, n}, {3, 3}, flat(body.J2));
  matrix(a, {"Ke", "N m/q^2", "generalised stiffness"}, body.Ke, {n, n});
  matrix(a, {"De", "N m s/q^2", "generalised damping"}, body.De, {n, n});
  const std::uint64_t gram = a.size("gram", static_cast<std::uint64_t>(body.gram.rows()), {0, 4 + 3 * n});
  matrix(a, {"gram", "kg, kg m, kg m/q and products", "sum dm z z^T, z = (1, u0, S_1, ..., S_n); 0 x 0: not known"},
         body.gram, {gram, gram});
}

template <class Archive, class Stiffness>
void geometric_stiffness(Archive& a, Stiffness& Kg, std::uint64_t n) {
  const Shape each = {n, n};
  optional_stack(a, {"Kg/spin", "N m s^2/q^2", "per omega_i omega_j: xx, yy, zz, xy, yz, zx"}, Kg.spin, 6, each);
  optional_stack(a, {"Kg/acceleration", "N s^2/q^2", "per acceleration of the origin along x, y, z"}, Kg.acceleration,
                 3, each);
  optional_stack(a, {"Kg/angular_acceleration", "N m s^2/q^2", "per angular acceleration about x, y, z"},
                 Kg.angular_acceleration, 3, each);
  const std::uint64_t count = rows_of(a, "Kg/markers", Kg.markers);
  a.values({"Kg/markers/name", "", "marker that is loaded; group k holds its matrices"}, {count},
           column(Kg.markers, &MarkerStiffness::marker));
  for (std::uint64_t k = 0; k < count; ++k) {
    const std::string group = fmt::format("Kg/markers/{}/", k);
    optional_stack(a, {group + "force", "m/q^2", "per force along x, y, z"}, Kg.markers[k].force, 3, each);
    optional_stack(a, {group + "torque", "1/q^2", "per torque about x, y, z"}, Kg.markers[k].torque, 3, each);
  }
}

template <class Archive, class Body>
void tables(Archive& a, Body& body, std::uint64_t n) {
  a.resize("coordinates/kind", body.coordinates, n);
  auto& coordinates = body.coordinates;
  a.values({"coordinates/kind", "", "bending_y, ..., interface, attachment"}, {n},
           column(coordinates, &Coordinate::kind));
  a.values({"coordinates/frequency_hz", "Hz", "under the reference condition; 0 of interface coordinates"}, {n},
           column(coordinates, &Coordinate::frequency_hz));
  a.values({"coordinates/interface", "", "whose motion or load it is; empty of modes"}, {n},
           column(coordinates, &Coordinate::interface));
  a.values({"coordinates/direction", "", "ux .. rz of a motion, Fx .. Mz of a load; empty of modes"}, {n},
           column(coordinates, &Coordinate::direction));

  const std::uint64_t interfaces = rows_of(a, "interfaces", body.interfaces);
  a.values({"interfaces/name", "", "place of a joint; the marker of this name lies there"}, {interfaces},
           column(body.interfaces, &Interface::name));
  std::vector<decltype(&body.interfaces[0].components[0])> components;
  for (auto& place : body.interfaces) {
    for (auto& kept : place.components) components.push_back(&kept);
  }
  a.values({"interfaces/components", "1", "1: ux, uy, uz, rx, ry, rz is kept"}, {interfaces, 6}, components);
  a.values({"interfaces/first_coordinate", "1", "the kept components are coordinates from here; -1: clamped"},
           {interfaces}, column(body.interfaces, &Interface::first_coordinate));

  const std::uint64_t markers = rows_of(a, "markers", body.markers);
  a.values({"markers/name", "", "named points"}, {markers}, column(body.markers, &Marker::name));
  a.matrices({"markers/position", "m", "undeformed position"}, {markers}, {3}, column(body.markers, &Marker::position));
  a.matrices({"markers/S", "m/q", "displacement"}, {markers}, {3, n}, column(body.markers, &Marker::S));
  a.matrices({"markers/S_theta", "rad/q", "rotation"}, {markers}, {3, n}, column(body.markers, &Marker::S_theta));

  const std::uint64_t checks = rows_of(a, "certificate", body.certificate);
  a.values({"certificate/name", "", "checks against independent routes"}, {checks},
           column(body.certificate, &BodyCheck::name));
  constexpr bool finite = false;  // a check that failed may have given anything
  a.values({"certificate/value", "SI", "of the body", finite}, {checks}, column(body.certificate, &BodyCheck::value));
  a.values({"certificate/reference", "SI", "by the other route", finite}, {checks},
           column(body.certificate, &BodyCheck::reference));
  a.values({"certificate/relative_error", "1", "of value against reference", finite}, {checks},
           column(body.certificate, &BodyCheck::relative_error));
  a.values({"certificate/passed", "1", "1: the error is within its tolerance"}, {checks},
           column(body.certificate, &BodyCheck::passed));
}

/// Polylines as one list of points and the place where each begins.
template <class Archive, class Lines>
void polylines(Archive& a, Lines& lines) {
  std::vector<int> starts, points;
  for (const std::vector<int>& line : std::as_const(lines)) {
    starts.push_back(static_cast<int>(points.size()));
    points.insert(points.end(), line.begin(), line.end());
  }
  const Field start = {"display/line_starts", "1", "where each polyline begins in line_points"};
  const Field point = {"display/line_points", "1", "points of all polylines, one after the other"};
  const std::uint64_t count = a.size(start.name, starts.size(), {});
  const std::uint64_t total = a.size(point.name, points.size(), {});
  starts.resize(count);
  points.resize(total);
  a.values(start, {count}, entries_of(starts));
  a.values(point, {total}, entries_of(points));
  if constexpr (!std::is_const_v<Lines>) {
    starts.push_back(static_cast<int>(total));
    require(starts.front() == 0 && std::is_sorted(starts.begin(), starts.end()),
            "dataset \"" + start.name + "\" must begin with 0, ascend and end within line_points");
    lines.clear();
    for (size_t i = 0; i < count; ++i) lines.emplace_back(points.begin() + starts[i], points.begin() + starts[i + 1]);
  }
}

template <class Archive, class Display>
void display(Archive& a, Display& shape, std::uint64_t n) {
  const std::uint64_t points = a.size("display/S", shape.S.size(), {});
  matrix(a, {"display/points", "m", "undeformed positions, one column each"}, shape.points, {3, points});
  stack(a, {"display/S", "m/q", "displacement of each point"}, shape.S, points, {3, n});
  optional_stack(a, {"display/S_theta", "rad/q", "rotation of each point; empty: nodes have none"}, shape.S_theta,
                 points, {3, n});
  polylines(a, shape.lines);
  const std::uint64_t triangles = a.size("display/triangles", shape.triangles.size(), {});
  a.resize("display/triangles", shape.triangles, triangles);
  a.values({"display/triangles", "1", "three points each, outward normal by the right hand"}, {triangles, 3},
           flat(shape.triangles));
}

template <class Archive, class Body>
void fields(Archive& a, Body& body) {
  a.attribute("name", body.name);
  a.attribute("structure", body.structure);
  a.attribute("frame", body.frame);
  const std::uint64_t n = a.size("Me", static_cast<std::uint64_t>(body.Me.rows()), {});
  invariants(a, body, n);
  geometric_stiffness(a, body.Kg, n);
  tables(a, body, n);
  display(a, body.display, n);
  auto& p = body.provenance;
  a.values({"provenance/program", "", "that made the body"}, {}, std::vector{&p.program});
  a.values({"provenance/libraries", "", "with versions"}, {}, std::vector{&p.libraries});
  a.values({"provenance/source", "", "file of the model"}, {}, std::vector{&p.source});
  a.values({"provenance/mesh_hash", "", "of nodes, elements, properties and sets"}, {}, std::vector{&p.mesh_hash});
  a.values({"provenance/options", "", "what was asked"}, {}, std::vector{&p.options});
  a.values({"provenance/doubts", "", "materials that are none in SI units"}, {}, std::vector{&p.doubts});
  a.values({"full_freedoms", "1", "unknowns of the model; 0: closed form"}, {}, std::vector{&body.full_freedoms});
}

}  // namespace flexboom::body_file
