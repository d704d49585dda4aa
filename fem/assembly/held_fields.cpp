#include "fem/assembly/held_fields.hpp"

#include "fem/base/at.hpp"

#include <Eigen/Geometry>

#include <map>
#include <numeric>

namespace flexboom {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double direction_digits = 1e-6;  // parts of a direction below this are digits of a deck

/// Beams that hang together, and what is held at all of their nodes.
struct BeamStructure {
  Components held = all_components;
  int nodes = 0;
  bool moves = false;

  bool holds(const Vector3d& direction, size_t first) const {
    double free = 0;
    for (int k = 0; k < 3; ++k) free += held[first + at(k)] ? 0 : direction(k) * direction(k);
    return free < direction_digits * direction_digits;
  }
  bool holds_translation(const Vector3d& direction) const { return holds(direction, 0); }
  bool holds_rotation(const Vector3d& direction) const { return holds(direction, 3); }

  /// A lone beam between two supports vibrates between them; one in a plane is told by what it leaves free.
  bool is_partial() const {
    const auto count = [this](size_t first) { return held[first] + held[first + 1] + held[first + 2]; };
    bool in_plane = count(0) == 1 && count(3) == 2;
    for (size_t k = 0; k < 3; ++k) in_plane = in_plane && held[k] != held[k + 3];
    return moves && (nodes > 2 || in_plane);
  }
};

class BeamStructures {
 public:
  BeamStructures(const Mesh& mesh, const DofMap& dofs, const std::vector<char>& held)
      : parent_(at(static_cast<int>(mesh.nodes.cols()))) {
    std::iota(parent_.begin(), parent_.end(), 0);
    std::vector<char> of_beams(parent_.size(), 0);
    for (const Element& element : mesh.elements) {
      if (type_of(element).shape != Shape::line) continue;
      for (const int node : element.nodes) {
        of_beams[at(node)] = 1;
        parent_[at(root(node))] = root(element.nodes.front());
      }
    }
    for (size_t node = 0; node < parent_.size(); ++node) {
      if (of_beams[node] == 0) continue;
      BeamStructure& structure = of_root_[root(static_cast<int>(node))];
      ++structure.nodes;
      for (size_t k = 0; k < 6; ++k) {
        const bool is_held = held[at(dofs.of_node(static_cast<int>(node), static_cast<int>(k)))] != 0;
        structure.held[k] = structure.held[k] && is_held;
        structure.moves = structure.moves || !is_held;
      }
    }
  }

  const BeamStructure& of(const Element& element) { return of_root_[root(element.nodes.front())]; }

 private:
  int root(int node) {
    while (parent_[at(node)] != node) node = parent_[at(node)] = parent_[at(parent_[at(node)])];
    return node;
  }

  std::vector<int> parent_;
  std::map<int, BeamStructure> of_root_;
};

/// Axes of a beam: along it, direction y of its section, z.
Matrix3d beam_axes_of(const Mesh& mesh, const Element& element) {
  const Vector3d x = (mesh.nodes.col(element.nodes[1]) - mesh.nodes.col(element.nodes[0])).normalized();
  const Vector3d z = x.cross(mesh.beam_properties[at(element.property)].y_axis).normalized();
  Matrix3d axes;
  axes << x, z.cross(x), z;
  return axes;
}

}  // namespace

std::vector<int> internal_freedoms_of_held_fields(const Mesh& mesh, const DofMap& dofs, const std::vector<char>& held) {
  std::vector<int> freedoms;
  BeamStructures structures(mesh, dofs, held);
  for (int e = 0; e < std::ssize(mesh.elements); ++e) {
    const Element& element = mesh.elements[at(e)];
    if (type_of(element).shape != Shape::line) continue;
    const BeamStructure& structure = structures.of(element);
    if (!structure.is_partial()) continue;
    const Matrix3d axes = beam_axes_of(mesh, element);
    const int first = dofs.element_offset[at(e)], last = dofs.element_offset[at(e) + 1];
    const int torsion = first + element.order, plane_y = torsion + element.order, plane_z = (plane_y + last) / 2;
    const auto hold = [&freedoms](int begin, int end) {
      for (int dof = begin; dof < end; ++dof) freedoms.push_back(dof);
    };
    if (structure.holds_translation(axes.col(0))) hold(first, torsion);
    if (structure.holds_rotation(axes.col(0))) hold(torsion, plane_y);
    if (structure.holds_translation(axes.col(1)) && structure.holds_rotation(axes.col(2))) hold(plane_y, plane_z);
    if (structure.holds_translation(axes.col(2)) && structure.holds_rotation(axes.col(1))) hold(plane_z, last);
  }
  return freedoms;
}

}  // namespace flexboom
