#include "dynamics/simulation/method_choice.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <vector>

namespace flexboom {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Frequencies of the elastic coordinates of all bodies [rad/s]; 0 of rigid ones.
struct ElasticFrequencies {
  double least = 0, largest = 0;

  explicit ElasticFrequencies(const Multibody& scene) {
    for (const ReducedBody& body : scene.bodies)
      for (int k = 0; k < body.n(); ++k) {
        const double omega = body.frequency(k);
        if (omega > 0 && (least == 0 || omega < least)) least = omega;
        largest = std::max(largest, omega);
      }
  }
};

/// Of a joint whose tables and pads damp it as much as they can.
LawBranch most_damped(const Joint& joint) {
  LawBranch b;
  if (!joint.law.given()) return b;
  const LawModel law(joint);
  b.damping = law.damping;
  for (const LawRamp& r : law.rate_ramps) b.damping = std::max(b.damping, law.damping + r.slope);
  for (const LawRamp& r : law.ramps) b.stop_damping = std::max(b.stop_damping, r.damping);
  return b;
}

/// The fastest decay without vibration, dampers and pads at work [1/s].
double fastest_decay(const Tree& tree, double t, const VectorXd& y) {
  const std::vector<Joint>& joints = tree.scene().joints;
  std::vector<LawBranch> laws;
  for (const Joint& joint : joints) laws.push_back(most_damped(joint));
  MatrixXd J;
  tree.jacobian(t, y.data(), std::vector<char>(joints.size(), 1), *tree.workspace(), J, laws);
  constexpr double digits = 1e100;  // of entries whose squares are finite
  if (!(J.cwiseAbs().maxCoeff() < digits)) return std::numeric_limits<double>::infinity();
  double fastest = 0;
  for (const std::complex<double>& lambda : J.eigenvalues())
    if (-lambda.real() > std::abs(lambda.imag())) fastest = std::max(fastest, -lambda.real());
  return fastest;
}

}  // namespace

std::string method_beside_exponential(const Tree& tree, const VectorXd& y, const IntegratorOptions& o) {
  const ElasticFrequencies elastic(tree.scene());
  if (elastic.largest > 30 * std::pow(o.tolerance, -0.1) * elastic.least) return "dirk";
  const double short_of_decay = 1000 / (o.duration - o.start);
  return fastest_decay(tree, o.start, y) > std::max(elastic.largest, short_of_decay) ? "bdf" : "adams";
}

}  // namespace flexboom
