#pragma once

#include "dynamics/model/joint_law.hpp"

#include <array>
#include <numeric>

namespace flexboom {

/// Energies by where they are and where they went [J].
struct EnergyLedger {
  double springs = 0, stops = 0, structures = 0;  // stored: in joints (and lines), pads of stops, bodies
  double dampers = 0, elsewhere = 0;              // lost: in joints; in structures and lines
  std::array<double, law_losses.size()> laws{};   // lost: by the laws of joints

  double stored() const { return springs + stops + structures; }
  double lost() const { return std::accumulate(laws.begin(), laws.end(), dampers + elsewhere); }
};

}  // namespace flexboom
