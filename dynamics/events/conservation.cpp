#include "dynamics/events/conservation.hpp"

namespace flexboom {

namespace {

/// Energy of bodies that turn by a hundredth of a radian per second, by 1e-20: nothing moves.
double no_motion(double inertia) { return 1e-20 * 0.5e-4 * inertia; }

/// By what the momenta are judged at least: the share of those that all the energy could make. A body that only
/// vibrates has none.
constexpr double least_share = 1e-6;

double sum_of(const std::vector<ReducedBody>& bodies, double (*part)(const ReducedBody&)) {
  double sum = 0;
  for (const ReducedBody& b : bodies) sum += part(b);
  return sum;
}

}  // namespace

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

double Conservation::energy_balance() const {
  return largest_.energy > no_motion(inertia_) ? gap_ / largest_.energy : 0;
}

double Conservation::momentum_drift() const {
  if (!(largest_.energy > no_motion(inertia_))) return 0;
  const double P = std::max(largest_.momentum, least_share * std::sqrt(2 * mass_ * largest_.energy));
  const double H = std::max(largest_.angular_momentum, least_share * std::sqrt(2 * inertia_ * largest_.energy));
  return std::max(P > 0 ? dP_ / P : 0, H > 0 ? dH_ / H : 0);
}

}  // namespace flexboom
