#pragma once

#include "fem/mesh/section.hpp"

#include <Eigen/Core>

#include <array>
#include <map>
#include <string>
#include <vector>

namespace flexboom {

enum class BeamTheory { euler_bernoulli, timoshenko };

/// What a beam element needs beside its two nodes.
struct BeamProperty {
  SectionShape start;  // at the first node
  SectionShape end;    // at the second node
  Material material;
  BeamTheory theory = BeamTheory::timoshenko;
  ShearRule shear;
  bool rotary_inertia = true;
  Eigen::Vector3d y_axis = Eigen::Vector3d::UnitY();  // direction of the section's y axis, normal to the beam
  double line_mass = 0;                               // on the axis, beside that of the material [kg/m]
};

/// What a solid element needs beside its nodes. A mesh file without materials leaves E = 0 until one is given.
struct SolidProperty {
  std::string name;
  Material material;
};

/// One element: a row of element_types(), its nodes, its order and its property.
struct Element {
  int type = 0;
  std::vector<int> nodes;  // in the order that the row defines (fem/README.md)
  int order = 1;           // of beams and of "hex"; the others are what their name says
  int property = 0;        // into Mesh::beam_properties or Mesh::solid_properties
};

/// A rigid body fixed to a node.
struct NodalBody {
  int node = 0;
  double mass = 0;
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  // about its own mass centre
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();   // node to mass centre
};

/// Which of ux uy uz rx ry rz of a node; rotations of a node that has none are passed over.
using Components = std::array<bool, 6>;
constexpr Components all_components = {true, true, true, true, true, true};

/// Components of a node that are held at zero.
struct Support {
  int node = 0;
  Components components = all_components;
};

/// Rigid connection (RBE2): the listed components of the nodes follow the reference node as one rigid body.
struct RigidConnection {
  int reference = 0;
  std::vector<int> nodes;
  Components components = all_components;
};

/// Distributing connection (RBE3): the listed components of the reference node follow the weighted mean motion of the
/// nodes (least squares), which it does not stiffen.
struct DistributingConnection {
  int reference = 0;
  std::vector<int> nodes;
  std::vector<double> weights;  // one per node, positive
  Components components = all_components;
};

/// sum of coefficient * component of node = 0; the first term that can is the one that follows.
struct LinearEquation {
  struct Term {
    int node = 0;
    int component = 0;  // 0..5
    double coefficient = 0;
  };
  std::vector<Term> terms;
};

/// A finite-element mesh in the axes of its body, [m].
struct Mesh {
  Eigen::Matrix3Xd nodes;
  std::vector<Element> elements;
  std::vector<BeamProperty> beam_properties;
  std::vector<SolidProperty> solid_properties;
  std::vector<NodalBody> bodies;
  std::vector<Support> supports;
  std::vector<RigidConnection> rigid_connections;
  std::vector<DistributingConnection> distributing_connections;
  std::vector<LinearEquation> equations;
  std::map<std::string, std::vector<int>> node_sets;     // a boom has "root" and "tip"
  std::map<std::string, std::vector<int>> element_sets;  // parts, groups
  std::vector<long> node_labels;                         // numbers in the file it came from; empty: index
  std::vector<long> element_labels;

  /// Label of a node or element for messages: its number in the file, or its index.
  long node_label(int node) const;
  long element_label(int element) const;

  /// @throws InputError on a missing node, a node that nothing uses, a beam of zero length, an inverted solid, a
  /// missing material, a connection of nothing.
  void validate(int threads = 1) const;
};

/// Nodes of a set. @throws InputError naming the sets that exist.
const std::vector<int>& node_set(const Mesh&, const std::string& name);

/// Number of parts of a mesh that no element, connection or equation joins.
int part_count(const Mesh&);

/// What is allowed and most likely a mistake. Such are corners turned inside out, several parts, coincident nodes that
/// nothing joins, or a mean density that no material has (units mixed up). One sentence each.
std::vector<std::string> suspicions(const Mesh&);

/// Those of them that are about materials.
std::vector<std::string> material_suspicions(const Mesh&);

/// What is odd about a material in SI units; empty where nothing is.
std::string suspicion(const Material&);

}  // namespace flexboom
