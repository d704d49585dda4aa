#include "fem/base/check.hpp"
#include "fem/formats/common/node_orders.hpp"
#include "fem/formats/vtk/cells.hpp"
#include "fem/formats/vtk/vtk.hpp"
#include "fem/mesh/element.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;

bool is_beam(const Element& element) { return type_of(element).shape == Shape::line; }

void require_vtu_holds(const Mesh& mesh) {
  const auto lacks = [&mesh](const char* what, int node, const char* where = "write .inp") {
    throw InputError(fmt::format("a .vtu file cannot hold {} (node {}); {}", what, mesh.node_label(node), where));
  };
  if (!mesh.rigid_connections.empty()) lacks("a rigid connection", mesh.rigid_connections.front().reference);
  if (!mesh.distributing_connections.empty())
    lacks("a distributing connection", mesh.distributing_connections.front().reference, "no format does");
  if (!mesh.equations.empty() && !mesh.equations.front().terms.empty())
    lacks("an equation", mesh.equations.front().terms.front().node);
}

// Kind of shape and its dimensions.
Eigen::Matrix<double, 7, 1> numbers_of(const SectionShape& shape) {
  Eigen::Matrix<double, 7, 1> numbers = Eigen::Matrix<double, 7, 1>::Zero();
  numbers(0) = static_cast<double>(shape.index());
  if (const auto* bar = std::get_if<RoundBar>(&shape)) numbers(1) = bar->diameter;
  if (const auto* tube = std::get_if<Tube>(&shape)) numbers.segment<2>(1) << tube->diameter, tube->thickness;
  if (const auto* r = std::get_if<Rectangle>(&shape)) numbers.segment<2>(1) << r->height, r->width;
  if (const auto* r = std::get_if<RectangularTube>(&shape)) numbers.segment<3>(1) << r->height, r->width, r->thickness;
  if (const auto* s = std::get_if<GeneralSection>(&shape))
    numbers.segment<6>(1) << s->A, s->Iy, s->Iz, s->J, s->kappa_y, s->kappa_z;
  return numbers;
}

double shear_rule_number(const ShearRule& rule) {
  return rule.name == "cowper" ? 0 : rule.name == "nu-squared" ? 1 : 2;
}

void add_beam_fields(VtkGrid& grid, const Mesh& mesh) {
  const auto count = static_cast<Index>(mesh.elements.size());
  MatrixXd start = MatrixXd::Zero(7, count), end = start, options = MatrixXd::Zero(6, count);
  MatrixXd line_mass = MatrixXd::Zero(1, count);
  for (Index e = 0; e < count; ++e) {
    const Element& element = mesh.elements[static_cast<size_t>(e)];
    if (!is_beam(element)) continue;
    const BeamProperty& property = mesh.beam_properties.at(static_cast<size_t>(element.property));
    start.col(e) = numbers_of(property.start);
    end.col(e) = numbers_of(property.end);
    options.col(e) << property.y_axis, property.rotary_inertia ? 1 : 0, shear_rule_number(property.shear),
        property.shear.value;
    line_mass(e) = property.line_mass;
  }
  grid.cell_data.emplace_back(vtk_field::beam_start, std::move(start));
  grid.cell_data.emplace_back(vtk_field::beam_end, std::move(end));
  grid.cell_data.emplace_back(vtk_field::beam, std::move(options));
  if (!line_mass.isZero(0)) grid.cell_data.emplace_back(vtk_field::line_mass, std::move(line_mass));
}

void add_properties(VtkGrid& grid, const Mesh& mesh) {
  const auto count = static_cast<Index>(mesh.elements.size());
  MatrixXd property(1, count), order(1, count), material(3, count);
  std::map<std::string, std::vector<int>> named;
  for (int e = 0; e < count; ++e) {
    const Element& element = mesh.elements[static_cast<size_t>(e)];
    const auto index = static_cast<size_t>(element.property);
    const size_t known = is_beam(element) ? mesh.beam_properties.size() : mesh.solid_properties.size();
    require(index < known, fmt::format("{} element {}: property {} is missing", type_of(element).name,
                                       mesh.element_label(e), element.property));
    const Material& m = is_beam(element) ? mesh.beam_properties[index].material : mesh.solid_properties[index].material;
    property(e) = element.property;
    order(e) = element.order;
    material.col(e) << m.E, m.nu, m.rho;
    if (!is_beam(element)) named[mesh.solid_properties[index].name].push_back(e);
  }
  grid.cell_data.emplace_back(vtk_field::property, std::move(property));
  grid.cell_data.emplace_back(vtk_field::material, std::move(material));
  const bool has_beams = std::ranges::any_of(mesh.elements, is_beam);
  if (has_beams) grid.cell_data.emplace_back(vtk_field::order, std::move(order));
  if (has_beams) add_beam_fields(grid, mesh);
  for (auto& [name, cells] : named)
    grid.cell_groups.emplace_back(std::string(vtk_field::named) + name, std::move(cells));
}

// Rows that the type of the cell does not tell.
void add_rows(VtkGrid& grid, const Mesh& mesh) {
  std::map<std::string_view, std::vector<int>> rows;
  for (size_t e = 0; e < mesh.elements.size(); ++e) {
    const std::string_view row = type_of(mesh.elements[e]).name;
    const VtkGrid::Cell& cell = grid.cells[e];
    if (vtk_solid(cell.type, cell.points.size(), true).row != row) rows[row].push_back(static_cast<int>(e));
  }
  for (auto& [row, cells] : rows)
    grid.cell_groups.emplace_back(std::string(vtk_field::row) + std::string(row), std::move(cells));
}

/// Mass, inertia and mass centre (offset from the node) of two bodies that move together.
NodalBody united(const NodalBody& a, const NodalBody& b) {
  NodalBody both = a;
  both.mass = a.mass + b.mass;
  if (both.mass > 0) both.offset = (a.mass * a.offset + b.mass * b.offset) / both.mass;
  both.inertia = a.inertia + b.inertia;
  for (const NodalBody* body : {&a, &b}) {
    const Vector3d d = body->offset - both.offset;
    both.inertia += body->mass * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
  }
  return both;
}

void add_node_fields(VtkGrid& grid, const Mesh& mesh) {
  if (!mesh.supports.empty()) {
    MatrixXd held = MatrixXd::Zero(6, mesh.nodes.cols());
    for (const Support& support : mesh.supports) {
      for (Index i = 0; i < 6; ++i)
        if (support.components[static_cast<size_t>(i)]) held(i, support.node) = 1;
    }
    grid.point_data.emplace_back(vtk_field::support, std::move(held));
  }
  if (mesh.bodies.empty()) return;
  std::map<int, NodalBody> bodies;
  for (const NodalBody& body : mesh.bodies) {
    const auto [found, is_new] = bodies.try_emplace(body.node, body);
    if (!is_new) found->second = united(found->second, body);
  }
  MatrixXd values = MatrixXd::Zero(10, mesh.nodes.cols());
  for (const auto& [node, body] : bodies) {
    const Eigen::Matrix3d& J = body.inertia;
    values.col(node) << body.mass, J(0, 0), J(1, 1), J(2, 2), J(0, 1), J(0, 2), J(1, 2), body.offset;
  }
  grid.point_data.emplace_back(vtk_field::body, std::move(values));
}

void add_labels(std::vector<std::pair<std::string, MatrixXd>>& fields, const std::vector<long>& labels) {
  if (labels.empty()) return;
  const Eigen::Map<const Eigen::Matrix<long, 1, Eigen::Dynamic>> row(labels.data(), 1, std::ssize(labels));
  fields.emplace_back(vtk_field::label, row.cast<double>());
}

}  // namespace

VtkGrid vtk_grid(const Mesh& mesh) {
  VtkGrid grid;
  grid.points = equispaced_from_lobatto(mesh, mesh.nodes);
  grid.cells.reserve(mesh.elements.size());
  VtkSolid solid;
  const Element* previous = nullptr;
  for (const Element& element : mesh.elements) {
    const bool alike = previous != nullptr && previous->type == element.type && previous->order == element.order;
    if (!alike) solid = vtk_solid_of(element);
    previous = &element;
    VtkGrid::Cell& cell = grid.cells.emplace_back(VtkGrid::Cell{solid.type, element.nodes});
    if (solid.node_order.empty()) continue;
    for (size_t i = 0; i < cell.points.size(); ++i)
      cell.points[i] = element.nodes[static_cast<size_t>(solid.node_order[i])];
  }
  return grid;
}

MatrixXd vtk_point_values(const Mesh& mesh, const MatrixXd& nodal) { return equispaced_from_lobatto(mesh, nodal); }

void write_vtu(const std::filesystem::path& path, const Mesh& mesh) {
  VtkGrid grid;
  try {
    require_vtu_holds(mesh);
    grid = vtk_grid(mesh);
    add_properties(grid, mesh);
    add_rows(grid, mesh);
    add_node_fields(grid, mesh);
  } catch (const InputError& error) {
    throw InputError(fmt::format("cannot write {}: {}", path.string(), error.what()));
  }
  add_labels(grid.point_data, mesh.node_labels);
  add_labels(grid.cell_data, mesh.element_labels);
  for (const auto& [name, nodes] : mesh.node_sets)
    grid.point_groups.emplace_back(std::string(vtk_field::set) + name, nodes);
  for (const auto& [name, elements] : mesh.element_sets)
    grid.cell_groups.emplace_back(std::string(vtk_field::set) + name, elements);
  write_vtu(path, grid);
}

}  // namespace flexboom
