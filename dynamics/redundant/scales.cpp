#include "dynamics/redundant/scales.hpp"

#include "dynamics/events/conservation.hpp"
#include "dynamics/numerics/rotation.hpp"

#include <algorithm>
#include <cmath>

namespace flexboom::redundant {

using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;

namespace {

/// What a start says of the energies to come. It is the energy of the start. Where there is none but round-off, it is
/// what its pushes begin with. Where nothing pushes yet but round-off, it is that of slow bodies. `time`: in which a
/// push shows [s].
double energy_scale(const Equations& equations, double at_start, const VectorXd& y_dot, double time) {
  double inertia = 0;
  for (const ReducedBody& b : equations.scene().bodies) inertia += b.J0.trace();
  const double slow = slow_energy(inertia);
  double begun = 0;
  for (size_t i = 0; i < equations.places().size(); ++i) {
    const BodyPlaces& at = equations.places()[i];
    const ReducedBody& b = equations.scene().bodies[i];
    begun += (b.m * y_dot.segment<3>(at.v).squaredNorm() + b.J0.trace() / 3 * y_dot.segment<3>(at.w).squaredNorm()) *
             time * time / 2;
  }
  constexpr double round_off = 1e-9;  // of what is pushed: a preload times the round-off of a place is no energy
  if (at_start > std::max(nothing * slow, round_off * begun)) return at_start;
  constexpr double hardly =
      1e-6;  // of what slow bodies have: beside gravity's gradient it is what comes later that counts
  return begun > nothing * slow ? std::max(begun, hardly * slow) : slow;
}

}  // namespace

StateScales::StateScales(Equations& equations, const VectorXd& y0, const VectorXd& y0_dot, double energy,
                         double tolerance, double duration)
    : equations_(equations), tolerance_(tolerance), start_(y0) {
  constexpr double part = 1e-3;
  scale_ = VectorXd::Constant(equations.motion() + equations.energies(), 1e100);
  least_ = VectorXd::Zero(scale_.size());
  const double time = std::min(1.0, 0.01 * duration), E = energy_scale(equations, energy, y0_dot, time);
  const auto& places = equations.places();
  for (const JointData& j : equations.joints())
    for (const PlaceData* p : {&j.a, &j.b}) length_ = std::max(length_, std::sqrt(dot(p->position, p->position)));
  for (const BodyPlaces& at : places) length_ = std::max(length_, y0.segment<3>(at.R).norm());
  set_least();
  for (size_t i = 0; i < places.size(); ++i) {
    const BodyPlaces& at = places[i];
    const ReducedBody& b = equations.scene().bodies[i];
    const auto speed = [&](int first, int count, double mass) {
      return part * std::max({std::sqrt(2 * E / mass), y0_dot.segment(first, count).norm() * time,
                              y0.segment(first, count).norm()});
    };
    const double v = speed(at.v, 3, b.m), w = speed(at.w, 3, b.J0.trace() / 3);
    scale_.segment<3>(at.v).setConstant(v);
    scale_.segment<3>(at.w).setConstant(w);
    scale_.segment<3>(at.R).setConstant(v * time);
    scale_.segment<4>(at.p).setConstant(std::min(part, w * time));
    for (int k = 0; k < at.n; ++k) {
      const double u = speed(at.u + k, 1, b.Me(k, k));
      scale_[at.u + k] = u;
      scale_[at.q + k] =
          std::max(b.Ke(k, k) > 0 ? part * std::sqrt(2 * E / b.Ke(k, k)) : u * time, part * std::abs(y0[at.q + k]));
    }
  }
  for (size_t i = 0; i < equations.scene().wheels.size(); ++i) {
    const ReactionWheel& wheel = equations.scene().wheels[i];
    scale_[equations.wheel(i)] =
        std::max({part * std::sqrt(2 * E * wheel.inertia), std::abs(y0[equations.wheel(i)]), 1e-30});
  }
  scale_.tail(equations.energies()).setConstant(E);
  observe(y0);
}

/// Where joints hold a body at places known to round-off, that is how well they know how it is turned, and what it
/// stretches by. A force at r from a middle whose radius of gyration is k moves the place, and turns the body by
/// r / (k^2 + r^2) of that; joints turn others with it.
void StateScales::set_least() {
  constexpr double round_off = 4e-15;
  double turned = 0;  // per length that a place moves [rad/m]
  for (const JointData& j : equations_.joints())
    for (const PlaceData* p : {&j.a, &j.b}) {
      if (p->body < 0) continue;
      const ReducedBody& b = equations_.scene().bodies[static_cast<size_t>(p->body)];
      const double r_squared = dot(p->position, p->position);
      turned = std::max(turned, std::sqrt(r_squared) / (b.J0.trace() / (3 * b.m) + r_squared));
    }
  for (size_t i = 0; i < equations_.places().size(); ++i) {
    const BodyPlaces& at = equations_.places()[i];
    least_.segment<3>(at.R).setConstant(round_off * length_);
    least_.segment<4>(at.p).setConstant(round_off * std::max(1.0, length_ * turned));
    for (int k = 0; k < at.n; ++k) {
      double shape = 0;
      for (const Marker& m : equations_.scene().bodies[i].markers) shape = std::max(shape, m.S.col(k).norm());
      if (shape > 0) least_[at.q + k] = round_off * length_ / shape;
    }
  }
}

void StateScales::raise(int first, int count, double size) {
  for (int k = 0; k < count; ++k) scale_[first + k] = std::max(scale_[first + k], size);
}

void StateScales::observe(const VectorXd& y) {
  double length = 0;
  for (const BodyPlaces& at : equations_.places()) length = std::max(length, y.segment<3>(at.R).norm());
  if (length > 2 * length_) {
    length_ = length;
    set_least();
  }
  for (const BodyPlaces& at : equations_.places()) {
    raise(at.R, 3, (y.segment<3>(at.R) - start_.segment<3>(at.R)).norm());
    Vector4d back = start_.segment<4>(at.p);
    back.tail<3>() *= -1;
    raise(at.p, 4, std::min(1.0, 0.5 * rotation_vector(quaternion_product(back, y.segment<4>(at.p))).norm()));
    raise(at.v, 3, y.segment<3>(at.v).norm());
    raise(at.w, 3, y.segment<3>(at.w).norm());
    for (int k = 0; k < at.n; ++k) {
      raise(at.q + k, 1, std::abs(y[at.q + k]));
      raise(at.u + k, 1, std::abs(y[at.u + k]));
    }
  }
  for (size_t i = 0; i < equations_.scene().wheels.size(); ++i)
    raise(equations_.wheel(i), 1, std::abs(y[equations_.wheel(i)]));
  for (int k = 0; k < equations_.energies(); ++k) raise(equations_.motion() + k, 1, std::abs(y[equations_.work() + k]));
}

void StateScales::weights(double* w) const {
  constexpr double not_weighed = 1e-100;
  const VectorXd all = (tolerance_ * scale_).cwiseMax(least_).cwiseInverse();
  Eigen::Map<VectorXd> weights(w, equations_.size());
  weights.setConstant(not_weighed / tolerance_);
  weights.head(equations_.motion()) = all.head(equations_.motion());
  weights.tail(equations_.energies()) = all.tail(equations_.energies());
}

}  // namespace flexboom::redundant
