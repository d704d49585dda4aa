#pragma once

#include "dynamics/methods/integrator.hpp"
#include "dynamics/relative/tree.hpp"

#include <Eigen/Core>

#include <vector>

namespace flexboom {

/// What the error of each state is measured against: the largest value so far of the group that it belongs to. A floor
/// gives a state that starts at zero a size.
class ErrorScales {
 public:
  /// rescale: what `restart` is told to forget is forgotten.
  ErrorScales(const Tree&, const Eigen::VectorXd& y0, double tolerance, bool rescale = false);

  const ErrorScale& error() const { return error_; }

  void observe(const Eigen::VectorXd& y);

  /// Of a state that may come: a tenth of it counts, and no more than a tenth of what the energy at the start could
  /// make. Floors rise to it.
  void predict(const Eigen::VectorXd& y);

  /// Errors of a state are weighed against no less than this.
  void raise(int state, double size);

  /// Forgets what moved before y, where it was asked to.
  void restart(const Eigen::VectorXd& y);

 private:
  template <class Each>
  void for_each_size(const Eigen::VectorXd& y, const Each& each) const;
  void set_floors(const Eigen::VectorXd& y0);
  void limit_by_energy(double energy, const Eigen::VectorXd& y0);
  void raise_floors(const Eigen::VectorXd& y);

  const Tree& tree_;
  bool rescale_;
  std::vector<Eigen::Vector4d> start_attitude_;  // per joint
  std::vector<double> period_;                   // per joint, on its spring and stop, over 2 pi [s]; 0: it has none
  std::vector<double> spring_rate_;              // per joint, on its spring alone, angular [rad/s]; 0: it has none
  Eigen::VectorXd floor_, bound_, largest_;      // bound: what the energy at the start could make; 0: it says nothing
  Eigen::VectorXd own_;                          // largest |y| of each state
  Eigen::VectorXd highest_floor_;  // where the start has no energy: of the elastic coordinates; else empty
  double most_held_ = 0;           // then: twice the largest energy of one of them so far
  ErrorScale error_;
};

}  // namespace flexboom
