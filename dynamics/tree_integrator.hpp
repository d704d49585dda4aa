#pragma once

#include "dynamics/integrator.hpp"
#include "dynamics/tree.hpp"

#include <string>
#include <vector>

namespace flexboom {

struct TreeTrajectory {
  std::vector<double> time;
  std::vector<Eigen::VectorXd> y;  // Tree::layout(), prescribed coordinates as prescribed
  std::vector<TreeBalance> balance;
  std::vector<Event> events;              // `hinge` is the joint
  IntegrationSummary summary;             // momentum_drift: unknown where something holds or pushes
  std::vector<double> stiffening_effect;  // per body: largest Tree::stiffening_effect at the outputs
  std::vector<std::string> warnings;
};

/// Flies the tree from y0 with CVODE: "bdf" or "adams" (default where the options name the default of System).
/// `rescale_at_events` is not heard: errors are measured against the largest motion so far.
/// A body whose geometric stiffness is off although its effect exceeds the tolerance is named in the warnings.
/// @throws InputError for an unknown method or bad options; NumericalError when the method fails.
TreeTrajectory integrate(const Tree&, const Eigen::VectorXd& y0, const IntegratorOptions&,
                         const Checkpoint<TreeTrajectory>& = {});

/// For each body: on where the geometric stiffness exceeds `tolerance` of Ke at the start or, at rest relative to them,
/// under the prescribed motions until `duration` [s].
std::vector<Stiffening> stiffening_where_it_counts(const Multibody&, const TreeState&, double duration,
                                                   double tolerance);

}  // namespace flexboom
