#include "dynamics/events/conservation.hpp"

#include <algorithm>
#include <cmath>

namespace flexboom {

namespace {

/// By what the momenta are judged at least: the share of those that all the energy could make. A body that only
/// vibrates has none.
constexpr double least_share = 1e-6;

double sum_of(const std::vector<ReducedBody>& bodies, double (*part)(const ReducedBody&)) {
  double sum = 0;
  for (const ReducedBody& b : bodies) sum += part(b);
  return sum;
}

}  // namespace

double slow_energy(double inertia) { return 0.5e-4 * inertia; }

bool is_held(const Multibody& scene) {
  const auto grounded = [](const auto& pair) { return pair.a.body < 0 || pair.b.body < 0; };
  return std::ranges::any_of(scene.joints, [&](const Joint& j) { return j.kind != JointKind::free && grounded(j); }) ||
         std::ranges::any_of(scene.springs, grounded);
}

bool is_isolated(const Multibody& scene) {
  return scene.loads.empty() && scene.gravity.isZero(0) && !scene.field && !is_held(scene);
}

Conservation::Conservation(const std::vector<ReducedBody>& bodies, const MotionScales& before)
    : mass_(sum_of(bodies, [](const ReducedBody& b) { return b.m; })),
      inertia_(sum_of(bodies, [](const ReducedBody& b) { return b.J0.trace(); })),
      largest_(before) {}

void Conservation::add(const Balance& b) {
  constexpr double digits = 1e-12;  // what is left of a potential energy that hardly changes
  const double total = b.energy(), size = std::max({b.kinetic + std::abs(b.elastic), std::abs(b.work), b.dissipated,
                                                    digits * std::abs(b.potential)});
  if (!begun_) first_total_ = total, P_ = b.momentum, H_ = b.angular_momentum;
  begun_ = true;
  gap_ = std::max(gap_, std::abs(total - first_total_));
  dP_ = std::max(dP_, (b.momentum - P_).norm());
  dH_ = std::max(dH_, (b.angular_momentum - H_).norm());
  largest_.energy = std::max(largest_.energy, size);
  largest_.shaking = std::max(largest_.shaking, b.shaking());
  largest_.momentum = std::max(largest_.momentum, b.momentum_scale);
  largest_.angular_momentum = std::max(largest_.angular_momentum, b.angular_momentum_scale);
}

double Conservation::energy_balance() const {
  return largest_.energy > nothing * slow_energy(inertia_) ? gap_ / largest_.energy : 0;
}

double Conservation::momentum_drift() const {
  if (!(largest_.energy > nothing * slow_energy(inertia_))) return 0;
  const double P = std::max(largest_.momentum, least_share * std::sqrt(2 * mass_ * largest_.energy));
  const double H = std::max(largest_.angular_momentum, least_share * std::sqrt(2 * inertia_ * largest_.energy));
  return std::max(P > 0 ? dP_ / P : 0, H > 0 ? dH_ / H : 0);
}

}  // namespace flexboom
