#include "dynamics/methods/error_scales.hpp"

#include "dynamics/events/contacts.hpp"
#include "dynamics/numerics/rotation.hpp"

#include <cmath>

namespace flexboom {

using Eigen::Vector4d;
using Eigen::VectorXd;

namespace {

constexpr double of_energy = 1e-4;  // of the values that an energy could give a state

const ReducedBody& carried_body(const Tree& tree, size_t joint) {
  return tree.scene().bodies[static_cast<size_t>(tree.scene().joints[joint].b.body)];
}

/// Twice the energy of the elastic coordinate of a body that has the most. q, q_dot: where its coordinates start in y.
double most_held(const ReducedBody& body, const VectorXd& y, int q, int q_dot) {
  double most = 0;
  for (int k = 0; k < body.n(); ++k)
    most = std::max(most, body.Ke(k, k) * y[q + k] * y[q + k] + body.Me(k, k) * y[q_dot + k] * y[q_dot + k]);
  return most;
}

}  // namespace

ErrorScales::ErrorScales(const Tree& tree, const VectorXd& y0, double tolerance, bool rescale)
    : tree_(tree),
      rescale_(rescale),
      start_attitude_(tree.scene().joints.size(), Vector4d(1, 0, 0, 0)),
      period_(tree.scene().joints.size(), 0.0),
      spring_rate_(tree.scene().joints.size(), 0.0),
      largest_(VectorXd::Zero(y0.size())),
      own_(VectorXd::Zero(y0.size())) {
  error_.tolerance = tolerance;
  for (size_t i = 0; i < period_.size(); ++i) {
    const TreeLayout::Joint& place = tree.layout().joints[i];
    if (place.attitude >= 0) start_attitude_[i] = y0.segment<4>(place.attitude);
    const Joint& joint = tree.scene().joints[i];
    const bool is_sprung = joint.mechanism.stiffness > 0 || joint.mechanism.stop_stiffness > 0;
    if (!is_sprung || !joint.prescribed.empty() || joint.law.given()) continue;
    const Stop stop = stop_of(joint, i, carried_body(tree, i));
    period_[i] = stop.period, spring_rate_[i] = stop.spring_rate;
  }
  set_floors(y0);
  observe(y0);
}

void ErrorScales::observe(const VectorXd& y) {
  own_ = own_.cwiseMax(y.cwiseAbs());
  if (highest_floor_.size() > 0) raise_floors(y);
  for_each_size(y, [&](int i, double size) {
    if (size <= largest_[i]) return;
    largest_[i] = size;
    error_.scale[i] = std::max(size, rescale_ ? error_.scale[i] : floor_[i]);
  });
}

void ErrorScales::predict(const VectorXd& y) {
  for_each_size(y, [&](int i, double size) {
    floor_[i] = std::max(floor_[i], 0.1 * std::min(size, bound_[i]));
    error_.scale[i] = std::max(error_.scale[i], floor_[i]);
  });
}

void ErrorScales::raise(int state, double size) {
  largest_[state] = std::max(largest_[state], size);
  error_.scale[state] = std::max(error_.scale[state], size);
}

void ErrorScales::restart(const VectorXd& y) {
  if (!rescale_) return;
  const int motion = tree_.layout().spin;
  largest_.head(motion).setZero(), own_.head(motion).setZero();
  error_.scale.head(motion) = floor_.head(motion) * 1e-50;
  observe(y);
}

/// To a part of what each elastic coordinate would be, had it the energy of the one that has had the most.
void ErrorScales::raise_floors(const VectorXd& y) {
  const TreeLayout& l = tree_.layout();
  double most = 0;
  for (size_t b = 0; b < l.q.size(); ++b)
    most = std::max(most, most_held(tree_.scene().bodies[b], y, l.q[b], l.rate(l.q[b])));
  if (most <= most_held_) return;
  most_held_ = most;
  const auto raise_to = [&](int i, double size) {
    floor_[i] = std::max(floor_[i], std::min(of_energy * size, highest_floor_[i]));
    error_.scale[i] = std::max(error_.scale[i], floor_[i]);
  };
  for (size_t b = 0; b < l.q.size(); ++b) {
    const ReducedBody& body = tree_.scene().bodies[b];
    for (int k = 0; k < body.n(); ++k) {
      if (body.Ke(k, k) > 0) raise_to(l.q[b] + k, std::sqrt(most / body.Ke(k, k)));
      raise_to(l.rate(l.q[b] + k), std::sqrt(most / body.Me(k, k)));
    }
  }
}

/// each(i, size) for every state.
template <class Each>
void ErrorScales::for_each_size(const VectorXd& y, const Each& each) const {
  const TreeLayout& l = tree_.layout();
  const auto vector = [&](int first) {
    const double size = y.segment<3>(first).norm();
    for (int k = 0; k < 3; ++k) each(first + k, size);
  };
  for (size_t i = 0; i < l.joints.size(); ++i) {
    const TreeLayout::Joint& j = l.joints[i];
    for (int k = 0; k < joint_type(tree_.scene().joints[i].kind).scalars; ++k) {
      const int at = j.scalar + k, rate = l.rate(at);
      // Gap and rate measure each other. At the stop the gap is zero but the motion is not. Where the spring turns back
      // it is the other way round. What a spring presses into its stop at rest does not move: no stop in the rate.
      each(at, std::max(std::abs(y[at]), std::abs(y[rate]) * period_[i]));
      each(rate, std::max(std::abs(y[rate]), std::abs(y[at]) * spring_rate_[i]));
    }
    for (const int first : {j.omega, j.position, j.velocity})
      if (first >= 0) vector(first);
    if (j.attitude < 0) continue;
    Vector4d back = start_attitude_[i];
    back.tail<3>() *= -1;
    const double angle = rotation_vector(quaternion_product(back, y.segment<4>(j.attitude))).norm();
    for (int k = 0; k < 4; ++k) each(j.attitude + k, std::min(1.0, 0.5 * angle));
  }
  // Elastic coordinates by energy: what the one with the most has, were it in this one. Each is an output, too: no more
  // than ten times its own size.
  const auto elastic = [&](int i, double size) {
    const double own = std::abs(y[i]);
    each(i, std::max(own, std::min(size, 10 * std::max(own, own_[i]))));
  };
  for (size_t b = 0; b < l.q.size(); ++b) {
    const ReducedBody& body = tree_.scene().bodies[b];
    const int q = l.q[b], q_dot = l.rate(q);
    const double held = most_held(body, y, q, q_dot);
    for (int k = 0; k < body.n(); ++k) {
      elastic(q + k, body.Ke(k, k) > 0 ? std::sqrt(held / body.Ke(k, k)) : 0.0);
      elastic(q_dot + k, std::sqrt(held / body.Me(k, k)));
    }
  }
  for (size_t i = 0; i < tree_.scene().wheels.size(); ++i)
    each(l.spin + static_cast<int>(i), std::abs(y[l.spin + static_cast<int>(i)]));
  for (int i = l.dissipated; i < l.size; ++i) each(i, std::abs(y[i]));
}

/// A floor is a small part of the body's size (lengths, deflections), of a radian, or of these in the time that they
/// take. It is the value that all the energy at the start could give the state, where that is less. Without energy at
/// the start, elastic coordinates begin with a thousandth of the floor. A stiff one of the same size has far more
/// energy than others.
void ErrorScales::set_floors(const VectorXd& y0) {
  constexpr double of_size = 1e-5, at_first = 1e-3;
  const TreeLayout& l = tree_.layout();
  const Multibody& scene = tree_.scene();
  double length = 0;
  for (const ReducedBody& b : scene.bodies) length = std::max(length, std::sqrt(b.J0.trace() / b.m));
  floor_ = VectorXd::Constant(l.size, of_size * std::max(length, 1.0));
  bound_ = VectorXd::Zero(l.size);
  for (size_t b = 0; b < l.q.size(); ++b) {
    const ReducedBody& body = scene.bodies[b];
    for (int k = 0; k < body.n(); ++k) {
      const double size = of_size * length * std::sqrt(body.m / body.Me(k, k));
      floor_[l.q[b] + k] = size;
      floor_[l.rate(l.q[b] + k)] = size * body.frequency(k);
    }
  }
  VectorXd beside = y0;  // on their way through space: that energy shakes nothing
  for (const TreeLayout::Joint& j : l.joints)
    if (j.velocity >= 0) beside.segment<3>(j.velocity).setZero();
  const double energy = tree_.balance(0, beside).shaking();
  floor_.tail(l.size - l.dissipated).setConstant(std::max(energy, of_size));
  constexpr double none = 1e-30;
  if (energy > none) {
    limit_by_energy(energy, y0);
  } else {
    highest_floor_ = floor_;
    for (size_t b = 0; b < l.q.size(); ++b) {
      floor_.segment(l.q[b], scene.bodies[b].n()) *= at_first;
      floor_.segment(l.rate(l.q[b]), scene.bodies[b].n()) *= at_first;
    }
  }
  // A quaternion's entries are near 1: less than its round-off can not be asked for.
  const double least_turn = 1e-14 / error_.tolerance;
  for (const TreeLayout::Joint& j : l.joints)
    if (j.attitude >= 0) floor_.segment<4>(j.attitude) = floor_.segment<4>(j.attitude).cwiseMax(least_turn);
  error_.scale = floor_;
}

/// By the values that so much energy [J] could give each state.
void ErrorScales::limit_by_energy(double energy, const VectorXd& y0) {
  const TreeLayout& l = tree_.layout();
  const Multibody& scene = tree_.scene();
  const auto limit = [&](int i, double size) {
    bound_[i] = size;
    floor_[i] = std::min(floor_[i], of_energy * size);
  };
  double longest = 1e-3;
  for (size_t i = 0; i < l.joints.size(); ++i) {
    if (l.joints[i].omega >= 0)
      if (const double spin = y0.segment<3>(l.joints[i].omega).norm(); spin > 0) longest = std::max(longest, 1 / spin);
    const Joint& joint = scene.joints[i];
    if (!(period_[i] > 0) || !(joint.mechanism.stiffness > 0)) continue;
    const double k = joint.mechanism.stiffness, rate = spring_rate_[i];
    longest = std::max(longest, 1 / rate);
    limit(l.joints[i].scalar, std::max(std::abs(y0[l.joints[i].scalar]), std::sqrt(2 * energy / k)));
    limit(l.rate(l.joints[i].scalar), std::sqrt(2 * energy / k) * rate);
  }
  for (size_t b = 0; b < l.q.size(); ++b) {
    const ReducedBody& body = scene.bodies[b];
    for (int k = 0; k < body.n(); ++k) {
      if (body.Ke(k, k) > 0) limit(l.q[b] + k, std::sqrt(2 * energy / body.Ke(k, k)));
      limit(l.rate(l.q[b] + k), std::sqrt(2 * energy / body.Me(k, k)));
    }
  }
  for (size_t i = 0; i < l.joints.size(); ++i) {
    const TreeLayout::Joint& j = l.joints[i];
    if (j.position < 0) continue;
    const ReducedBody& body = carried_body(tree_, i);
    const double turn = std::sqrt(2 * energy / (body.J0.trace() / 3)), v = std::sqrt(2 * energy / body.m);
    for (int k = 0; k < 3; ++k) limit(j.omega + k, turn), limit(j.velocity + k, v), limit(j.position + k, v * longest);
    for (int k = 0; k < 4; ++k) limit(j.attitude + k, std::min(1.0, turn * longest));
  }
}

}  // namespace flexboom
