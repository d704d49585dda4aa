#pragma once

#include "fem/mesh/mesh.hpp"

namespace flexboom {

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

/// Polynomial orders of beams go from 1 to this.
inline constexpr int highest_beam_order = 12;

/// Stations of a boom (ends of segments, attachments) closer than this part of its length are one.
inline constexpr double same_station = 1e-9;

/// Elements of beams have at least this part of the boom's length: the stiffness of one goes by length^-3, and its
/// round-off would be that of the whole boom.
inline constexpr double shortest_beam = 1e-5;

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

  /// @throws InputError where two stations are neither one nor far enough apart for beams (shortest_beam).
  void validate_stations() const;
};

/// Mesh of a boom of beams with node sets "root" and "tip" and one node at every segment end and attachment.
/// @throws InputError as BeamGeometry::validate and validate_stations.
Mesh make_mesh(const BeamGeometry&);

}  // namespace flexboom
