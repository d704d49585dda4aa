#include "dynamics/redundant/frame.hpp"

#include "dynamics/events/conservation.hpp"

namespace flexboom::redundant {

using Eigen::Vector3d;
using Eigen::VectorXd;

FlightFrame::FlightFrame(const Equations& equations, const std::vector<BodyState>& start, double t)
    : gravity_(equations.scene().gravity), start_(t), loaded_(!equations.scene().loads.empty()) {
  if (is_held(equations.scene()) || equations.scene().field) return;  // where in the field matters
  const VectorXd y = equations.pack(start);
  for (size_t i = 0; i < start.size(); ++i) {
    const double m = equations.scene().bodies[i].m;
    mass_ += m;
    origin_ += m * start[i].position;
    velocity_ += equations.momenta(i, y.data()).linear;
  }
  origin_ /= mass_;
  velocity_ /= mass_;
}

std::vector<BodyState> FlightFrame::seen(std::vector<BodyState> bodies) const {
  for (BodyState& b : bodies) {
    b.position -= origin_;
    b.velocity -= velocity_;
  }
  return bodies;
}

void FlightFrame::leave(double t, MultibodyState& s, Balance& b) const {
  const Vector3d way = origin_ + (t - start_) * velocity_;
  for (BodyState& body : s.bodies) {
    body.position += way;
    body.velocity += velocity_;
  }
  // What loads gave the momentum, which begins at zero here, they did on the way of this frame, too.
  if (loaded_) b.work += velocity_.dot(b.momentum - mass_ * (t - start_) * gravity_);
  b.kinetic += velocity_.dot(b.momentum) + 0.5 * mass_ * velocity_.squaredNorm();
  b.potential -= mass_ * gravity_.dot(way);
  b.momentum += mass_ * velocity_;
  b.momentum_scale += mass_ * velocity_.norm();
}

}  // namespace flexboom::redundant
