#include "dynamics/events/telling_moments.hpp"

#include <algorithm>

namespace flexboom {

TellingMoments::TellingMoments(const std::vector<Joint>& joints, const FlightOptions& o) : times_(o.telling_times) {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const HingeMechanism& m = joints[i].mechanism;
    if (m.stop_stiffness > 0) pads_.push_back({i, m.threshold, 1});
    for (const auto& [stop, side] : {std::pair(joints[i].law.upper_stop, 1), std::pair(joints[i].law.lower_stop, -1)})
      if (stop && !stop->restitution) pads_.push_back({i, stop->at, side});
  }
  while (!times_.empty() && times_.front() < o.start) times_ = times_.subspan(1);
}

bool TellingMoments::at(double t, const std::function<double(std::size_t joint)>& coordinate) {
  constexpr double deeper = 1.25;  // each look costs, and loads are wanted by their size
  bool telling = false;
  for (; !times_.empty() && times_.front() <= t; times_ = times_.subspan(1)) telling = true;
  for (Pad& pad : pads_) {
    const double depth = pad.side * (coordinate(pad.joint) - pad.at);
    if (!(depth > deeper * pad.deepest)) continue;
    pad.deepest = depth;
    telling = true;
  }
  return telling;
}

}  // namespace flexboom
