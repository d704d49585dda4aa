#pragma once

// The residual of eq. 12 with stabilised constraints, its Newton matrix, and what a start needs. Internal to the
// redundant coordinates.

#include "dynamics/redundant/body.hpp"
#include "dynamics/redundant/joint.hpp"
#include "dynamics/redundant/multipliers.hpp"
#include "dynamics/redundant/pattern_sum.hpp"

#include <Eigen/Core>

#include <memory>
#include <optional>
#include <vector>

namespace flexboom::redundant {

/// The same description made ready.
struct Prepared {
  Multibody scene;
  std::vector<Stiffening> stiffening;  // per body
  std::vector<BodyData> bodies;
  std::vector<JointData> joints, springs;
  std::vector<PlaceData> loads;
};

/// Constants of a place, with those of geometric stiffness where its body has it on.
PlaceData place_data(const Multibody&, const std::vector<Stiffening>&, const Place&);

/// Places of a body's unknowns in y, [R p q v w u]; of its freedoms [R theta q].
struct BodyPlaces {
  int R = 0, p = 0, q = 0, v = 0, w = 0, u = 0, n = 0, nu = 0, freedom = 0;
};

/// State of the events: which stops are closed; the gaps (angle less threshold) near which hinges are; in what state
/// laws are.
struct JointMemory {
  std::vector<char> closed;
  std::vector<double> near;
  std::vector<LawBranch> laws{};  // empty: no joint has one

  MechanismState of(size_t joint) const {
    return {closed[joint] != 0, near[joint], laws.empty() ? LawBranch{} : laws[joint]};
  }
};

struct EquationScratch;

class Equations {
 public:
  explicit Equations(const Prepared&);
  ~Equations();
  Equations(const Equations&) = delete;
  Equations& operator=(const Equations&) = delete;

  const Multibody& scene() const { return scene_; }
  const std::vector<JointData>& joints() const { return joints_; }
  const std::vector<BodyPlaces>& places() const { return places_; }
  int size() const { return size_; }                                   // of y
  int motion() const { return motion_; }                               // y begins with this much of bodies and wheels
  int wheel(size_t i) const { return wheels_ + static_cast<int>(i); }  // axial angular momentum [N m s]
  int work() const { return work_; }                                   // of loads, prescribed motions and wheels [J]
  /// By structures and springs, behind work [J]; then by the mechanism of each joint that has one, and by its law
  /// (law_losses), see losses. These energies are the end of y.
  int dissipated() const { return work_ + 1; }
  int losses(size_t joint) const { return losses_[joint] < 0 ? -1 : work_ + losses_[joint]; }
  int energies() const { return energies_; }
  int freedoms() const { return freedoms_; }
  int all_rows() const { return all_rows_; }  // kept or not

  /// Holds a joint by its law there (angle [rad] or way [m]), or no more. Rows must be chosen anew then.
  void hold(size_t joint, std::optional<double> at) { joints_[joint].held_at = at; }
  /// The multiplier of the row that holds a joint; -1 where the other rows hold it.
  int holding(size_t joint) const;

  /// Keeps these rows (one flag per row of all joints) and numbers the unknowns anew.
  void keep_rows(const std::vector<char>&);

  Eigen::VectorXd pack(const std::vector<BodyState>&) const;
  std::vector<BodyState> unpack(const double* y) const;

  /// F(t, y, y_dot) = 0. Allocates nothing.
  void residual(double t, const double* y, const double* y_dot, const JointMemory&, double* F);
  /// dF/dy + c dF/dy_dot.
  void newton(double t, double c, const double* y, const double* y_dot, const JointMemory&, PatternSum&);

  /// Values, rates of all rows, and the part of their second derivative that is no acceleration's.
  struct RowValues {
    Eigen::VectorXd g, g_dot, bias;
  };
  void row_values(double t, const double* y, RowValues&);
  /// Values and rates alone, without allocation.
  void row_violations(double t, const double* y, double* g, double* g_dot) const;
  /// Gradient of all rows over the freedoms, all_rows x freedoms.
  Eigen::MatrixXd gradient(double t, const double* y);
  /// Mass matrix of a body over its freedoms.
  Eigen::MatrixXd mass(size_t i, const double* y) const;
  /// y_dot and the multipliers in y, consistent with the motion in y (mu and nu zero).
  /// @throws NumericalError when the kept rows are not independent.
  void make_consistent(double t, Eigen::VectorXd& y, Eigen::VectorXd& y_dot, const JointMemory&);
  /// Moves y by freedoms dx (rotations in BRF axes) and changes velocities by dv.
  void displace(Eigen::VectorXd& y, const Eigen::VectorXd& dx) const;
  void accelerate(Eigen::VectorXd& y, const Eigen::VectorXd& dv) const;
  /// Brings the kept rows and their rates to zero (Newton, least motion in the mass metric); the largest step.
  double project(double t, Eigen::VectorXd& y);
  /// Inverse of a rough, constant, diagonal mass matrix over the freedoms.
  const Eigen::VectorXd& inverse_metric() const { return inverse_metric_; }

  /// Angle or way of a joint less its threshold: keeps its digits near the stop.
  DriveMotion<double> gap(size_t i, const double* y, double near) const;
  std::vector<JointReaction> loads(double t, const double* y);
  /// Of mechanisms, springs and bodies, and what was lost.
  EnergyLedger ledger(const double* y, const JointMemory&) const;
  /// Motion of the two places of a joint at time t.
  PairMotion<double> pair(const JointData&, double t, const double* y, const Joint*) const;

  struct Momenta {
    Eigen::Vector3d linear, angular, first_moment;  // about the body's origin, inertial axes
    double kinetic = 0;                             // [J]
  };
  /// Of a body without its wheels.
  Momenta momenta(size_t i, const double* y) const;

 private:
  Frame<double> frame(int body, const double* y) const;
  Elastic<double> elastic(const PlaceData&, const double* y) const;
  void scatter(const PlaceData&, const PlaceForce<double>&, const double* y, double* F) const;
  void scatter_correction(const PlaceData&, const PlaceForce<double>&, const double* y, double* F) const;
  static RowMultipliers multipliers(const JointData&, const double* y);
  /// The motion of a body, as body_forces wants it.
  BodyInput body_input(size_t i, const double* y, const double* y_dot) const;
  void body_residual(size_t i, const double* y, const double* y_dot, double* F);
  /// Adds the field's gravity on body i to its rows; its power [W]. The Newton matrix leaves out its derivatives, which
  /// are of the size of the orbital rate squared.
  double pull_by_field(size_t i, double t, const double* y, double* F) const;
  void body_newton(size_t i, double t, double c, const double* y, const double* y_dot, PatternSum&);
  void pair_newton(const JointData&, const Eigen::MatrixXd& L, bool velocities, int loss, const double* y, PatternSum&);

  const Prepared& prepared_;
  const Multibody& scene_;
  std::vector<JointData> joints_;
  std::vector<BodyPlaces> places_;
  int size_ = 0, motion_ = 0, wheels_ = 0, work_ = 0, energies_ = 0, freedoms_ = 0, all_rows_ = 0;
  std::vector<int> losses_;  // per joint, from work on; -1: it has none
  Eigen::VectorXd inverse_metric_;
  std::unique_ptr<EquationScratch> scratch_;
};

}  // namespace flexboom::redundant

namespace flexboom {
struct Multipliers::Impl : redundant::Prepared {};
}  // namespace flexboom
