#pragma once

#include "dynamics/model/joint_law.hpp"

#include <Eigen/Core>

#include <array>
#include <cmath>
#include <numeric>
#include <vector>

namespace flexboom {

/// Energies by where they are and where they went [J].
struct EnergyLedger {
  double springs = 0, stops = 0, structures = 0;  // stored: in joints (and lines), pads of stops, bodies
  double dampers = 0, elsewhere = 0;              // lost: in joints; in structures and lines
  std::array<double, law_losses.size()> laws{};   // lost: by the laws of joints

  double stored() const { return springs + stops + structures; }
  double lost() const { return std::accumulate(laws.begin(), laws.end(), dampers + elsewhere); }
};

/// Energies [J] and momenta (inertial axes; angular about the mass centre).
struct Balance {
  double kinetic = 0, elastic = 0, potential = 0;  // potential: of gravity
  double bodies = 0;                               // of kinetic: neither spin of wheels nor way through space
  double dissipated = 0, work = 0;                 // since the start
  std::vector<double> dissipated_by_joint;
  EnergyLedger ledger;  // of elastic and dissipated

  /// What is kept.
  double energy() const { return kinetic + elastic + potential + dissipated - work; }
  /// What can shake the bodies: wheels spin on, whatever their energy.
  double shaking() const { return std::abs(bodies) + std::abs(elastic); }

  Eigen::Vector3d momentum = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_momentum = Eigen::Vector3d::Zero();
  double momentum_scale = 0, angular_momentum_scale = 0;  // sums over the bodies of the norms
};

}  // namespace flexboom
