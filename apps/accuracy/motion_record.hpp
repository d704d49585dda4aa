#pragma once

#include "apps/simulate/simulate.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <string>
#include <vector>

namespace flexboom {

/// Where a body is among those of a tree.
int index_of(const Tree&, const std::string& body);

/// Parts of a run with rows as close as its fastest vibrations want, and what drives modes there.
///
/// The parts are the start, the end, and some spread evenly between. Others begin where something may set tones off: a
/// corner or an extreme of a function of time, a contact, a change of a law.
class MotionRecord {
 public:
  /// Flies a scene once more. `fastest` [rad/s] sets how close the rows are, `slowest` how long the parts are.
  /// @throws InputError, NumericalError as that flight.
  MotionRecord(const Scene& flown, const SimulatedMotion& run, const RunHooks&, double fastest, double slowest,
               bool wants_loads);

  double step() const { return step_; }                            // of the rows [s]
  std::size_t samples() const { return samples_; }                 // rows in each part
  const std::vector<double>& lasting() const { return lasting_; }  // until the next part begins [s]

  /// What drives the modes of a body.
  struct Driven {
    /// Per part, a row for each of its rows: acceleration and angular acceleration of the BRF, then force and torque at
    /// each marker, BRF axes. Six columns each.
    std::vector<Eigen::MatrixXd> signals{};
    std::vector<std::string> markers{};  // where something is joined to the body
  };
  /// `body`: of the scene, with whatever modes.
  Driven driven(const ReducedBody& body) const;

  /// The largest that the joint that carries a body has in these parts; 0 where none does.
  struct Loads {
    double force = 0, torque = 0;  // [N], [N m]
  };
  Loads loads_of(const std::string& body) const;

 private:
  void add_accelerations();

  Scene scene_;
  SimulatedMotion motion_;
  double step_ = 0;
  std::size_t samples_ = 0;
  std::vector<std::size_t> windows_;  // first rows of the parts
  std::vector<double> lasting_;
  std::vector<std::vector<Eigen::MatrixXd>> accelerations_;  // per body and part: of the BRF, its axes, six columns
};

}  // namespace flexboom
