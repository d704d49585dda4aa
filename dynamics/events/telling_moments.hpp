#pragma once

#include "dynamics/events/flight.hpp"
#include "dynamics/model/joint.hpp"

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace flexboom {

/// Moments between the outputs of a flight at which loads may be largest: past times that are given, and where a pad is
/// pressed deeper than before.
class TellingMoments {
 public:
  /// The options live as long.
  TellingMoments(const std::vector<Joint>&, const FlightOptions&);

  /// Is the end of a step, at t [s], one of them? `coordinate` of a joint: its angle [rad] or length [m].
  bool at(double t, const std::function<double(std::size_t joint)>& coordinate);

 private:
  struct Pad {
    std::size_t joint;
    double at;
    int side;
    double deepest = 0;
  };
  std::vector<Pad> pads_;
  std::span<const double> times_;
};

}  // namespace flexboom
