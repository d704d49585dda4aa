#pragma once

#include "fem/base/check.hpp"
#include "fem/mesh/mesh.hpp"

#include <Eigen/Core>

#include <string>

// Checks that a boom and a mesh share.
namespace flexboom {

/// Runs a check and puts `where` in front of what it says.
template <class Check>
void within(const std::string& where, const Check& check) {
  try {
    check();
  } catch (const InputError& error) {
    throw InputError(where + ": " + error.what());
  }
}

/// @throws InputError unless a rigid body can have this mass, inertia about its mass centre, and offset.
void validate_rigid(double mass, const Eigen::Matrix3d& inertia, const Eigen::Vector3d& offset);

/// The section constants exist at both ends and, the dimensions being linear, in between. @throws InputError.
void validate_sections(const SectionShape& start, const SectionShape& end, const Material&, BeamTheory,
                       const ShearRule&);

}  // namespace flexboom
