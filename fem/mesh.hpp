#pragma once

#include "fem/section.hpp"

#include <Eigen/Core>

#include <map>
#include <string>
#include <vector>

namespace flexboom {

enum class BeamTheory { euler_bernoulli, timoshenko };

/// A straight piece of a boom. A taper is a piece whose end shape differs from its start shape.
struct BeamSegment {
  SectionShape start;
  SectionShape end;
  double length = 0;  // [m]
  Material material;
  int elements = 0;  // 0: chosen by make_mesh
};

/// A rigid body fixed to the boom at a distance `position` from the root. A lumped mass has zero inertia and offset.
struct RigidAttachment {
  std::string name;
  double position = 0;                                // [m] along the boom
  double mass = 0;                                    // [kg]
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  // about its own mass centre, boom axes [kg m^2]
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();   // boom axis to its mass centre, boom axes [m]
};

/// A boom along +x of its body frame (BRF), root at the origin; y and z are the principal axes of every section.
struct BeamGeometry {
  std::vector<BeamSegment> segments;
  std::vector<RigidAttachment> attachments;
  BeamTheory theory = BeamTheory::timoshenko;
  ShearRule shear;
  bool rotary_inertia = true;  // false: line mass, no inertia of the section; torsion is then left out
  int order = 4;               // polynomial order p, see fem/README.md

  double length() const;

  /// @throws InputError naming the first fault (dimension, material, attachment outside the boom, order out of 1..12).
  void validate() const;
};

/// What a beam element needs beside its two nodes.
struct BeamProperty {
  SectionShape start;  // at the first node
  SectionShape end;    // at the second node
  Material material;
  BeamTheory theory = BeamTheory::timoshenko;
  ShearRule shear;
  bool rotary_inertia = true;
  Eigen::Vector3d y_axis = Eigen::Vector3d::UnitY();  // direction of the section's y axis, normal to the beam
};

/// One element: a row of element_types(), its nodes, its order and its property.
struct Element {
  int type = 0;
  std::vector<int> nodes;
  int order = 1;
  int property = 0;  // into Mesh::beam_properties
};

/// A rigid body fixed to a node.
struct NodalBody {
  int node = 0;
  double mass = 0;
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  // about its own mass centre
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();   // node to mass centre
};

/// A finite-element mesh in the axes of its body, [m].
struct Mesh {
  Eigen::Matrix3Xd nodes;
  std::vector<Element> elements;
  std::vector<BeamProperty> beam_properties;
  std::vector<NodalBody> bodies;
  std::map<std::string, std::vector<int>> node_sets;  // a boom has "root" and "tip"

  /// @throws InputError on a missing node, an unused node, a part without connection, a beam of zero length.
  void validate() const;
};

/// Mesh of a boom with node sets "root" and "tip" and one node at every segment end and attachment.
/// @throws InputError as BeamGeometry::validate.
Mesh make_mesh(const BeamGeometry&);

/// Nodes of a set. @throws InputError naming the sets that exist.
const std::vector<int>& node_set(const Mesh&, const std::string& name);

}  // namespace flexboom
