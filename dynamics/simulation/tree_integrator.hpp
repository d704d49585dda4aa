#pragma once

#include "dynamics/methods/integrator.hpp"
#include "dynamics/relative/tree.hpp"

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace flexboom {

/// The largest StiffeningEffect of a body in a flight.
struct LargestStiffening {
  double size = 0;
  double softening = 0;       // that lasts from one look to the next
  double time = 0;            // of that [s]
  double last_softening = 0;  // at the last look
  double shortening = 0;      // [m]
};
/// A long flight is looked at this often: each look costs an evaluation and an eigenvalue problem per body.
inline constexpr int looks_at_stiffening = 200;
void observe(const std::vector<StiffeningEffect>&, double t, std::vector<LargestStiffening>&);
/// Of a moment between two outputs: what is that short is no buckling.
void observe_size(const std::vector<StiffeningEffect>&, std::vector<LargestStiffening>&);

/// The change where a geometric stiffness of this size (of StiffeningEffect) is left out for so long [s], relative to
/// what the body does. It is the size, or more. A mode that is stiffer by e runs ahead by e / 2 for each radian that it
/// turns. This is taken of the slowest mode; its damping leaves x exp(-zeta x) of x radians.
double change_without_stiffening(const ReducedBody&, double size, double duration);

/// Names each body whose geometric stiffness is off although it would change more than the tolerance, or takes all
/// stiffness away.
std::vector<std::string> stiffening_warnings(const Multibody&, const std::vector<LargestStiffening>&, double duration,
                                             double tolerance, const std::function<Stiffening(int body)>&);

/// Per joint: is its stop closed where gaps alone say so?
std::vector<char> closed_stops(const Tree&, const Eigen::Ref<const Eigen::VectorXd>& y);

struct TreeTrajectory {
  std::vector<double> time;
  std::vector<Eigen::VectorXd> y;  // Tree::layout(), prescribed coordinates as prescribed
  std::vector<Balance> balance;
  std::vector<std::vector<LawBranch>> laws;  // per row; empty where no joint has a law
  std::vector<StopEvent> events;
  IntegrationSummary summary;                        // momentum_drift: unknown where something holds or pushes
  std::vector<LargestStiffening> stiffening_effect;  // per body, at outputs and telling moments
  std::vector<std::string> warnings;

  /// Of a row, per joint; empty where no joint has a law.
  std::span<const LawBranch> laws_at(size_t row) const {
    return laws.empty() ? std::span<const LawBranch>() : std::span<const LawBranch>(laws[row]);
  }
};

/// Is told what stiffening has reached, per body, after each look at it; may throw to end a flight.
using StiffeningLook = std::function<void(const std::vector<LargestStiffening>&)>;

/// Flies the tree from y0. Method "auto": the one that suits its start, and bdf where that fails.
/// @throws InputError for an unknown method or bad options; NumericalError when the method fails.
TreeTrajectory integrate(const Tree&, const Eigen::VectorXd& y0, const IntegratorOptions&,
                         const Checkpoint<TreeTrajectory>& = {}, const StiffeningLook& = {});

/// For each body: on where the geometric stiffness changes more than `tolerance` (`change_without_stiffening`). The
/// stiffness is looked at as it is at the start. It is also looked at under the prescribed motions until `duration`
/// [s], at rest relative to them, at some times and at those given.
std::vector<Stiffening> stiffening_where_it_counts(const Tree&, Eigen::VectorXd y0, double duration, double tolerance,
                                                   std::span<const double> times = {});

}  // namespace flexboom
