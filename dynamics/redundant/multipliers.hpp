#pragma once

#include "dynamics/events/contacts.hpp"
#include "dynamics/model/energy_ledger.hpp"
#include "dynamics/model/multibody.hpp"
#include "dynamics/numerics/ida.hpp"

#include <Eigen/Core>

#include <memory>
#include <string>
#include <vector>

namespace flexboom {

/// Where a body is and how it moves, inertial axes. In an orbit positions are relative to the reference point. The
/// quaternion (w, x, y, z) turns BRF -> inertial.
struct BodyState {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();      // R [m]
  Eigen::Vector4d attitude = Eigen::Vector4d(1, 0, 0, 0);  // unit
  Eigen::VectorXd q{};                                     // empty: zeros
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();      // Rdot, inertial axes [m/s]
  Eigen::Vector3d omega = Eigen::Vector3d::Zero();         // BRF axes [rad/s]
  Eigen::VectorXd q_dot{};                                 // empty: zeros
};

/// Derivatives of the velocities of a body.
struct BodyAcceleration {
  Eigen::Vector3d of_origin = Eigen::Vector3d::Zero();  // of R, inertial axes [m/s^2]
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();    // BRF axes [rad/s^2]
  Eigen::VectorXd of_q{};                               // q_ddot
};

/// What a joint's constraints do to b, at the place b, in the axes of place a; a gets the opposite. The mechanism's own
/// torque is not in it, the torque of a prescribed motion is.
struct JointReaction {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   // [N]
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  // [N m]
};

/// A moment of a motion.
struct MultibodyState {
  std::vector<BodyState> bodies;
  std::vector<double> coordinate, rate;   // per joint: angle of a hinge [rad], way of a slider [m]; 0 of the others
  std::vector<JointReaction> loads;       // per joint
  std::vector<double> spin;               // per wheel, relative to its body [rad/s]
  double work = 0;                        // of loads, prescribed motions and wheels since the start [J]
  double dissipated = 0;                  // by everything [J]
  std::vector<std::vector<double>> lost;  // of it, per joint: by its dampers, then as law_losses; empty: it has none
  EnergyLedger ledger;
  std::vector<LawBranch> laws;  // per joint, or empty
  std::vector<BodyAcceleration> accelerations;
};

struct MultipliersOptions : FlightOptions {
  std::vector<double> angles{};     // per joint: a hinge starts at the turn nearest to this [rad]; empty: to its rest
  double dissipated = 0, work = 0;  // before the start [J]; dissipated: by structures and springs, or everything
  std::vector<std::vector<double>> lost{};  // before the start, as of MultibodyState; empty: nothing
};

struct MultipliersSummary : DaeCounts {
  long restarts = 0;
  double seconds = 0;
  double position_drift = 0;           // largest violation of a constraint at any step [m]
  double angle_drift = 0;              // [rad]
  double velocity_drift = 0;           // of the constraints' rates [m/s]
  double angular_velocity_drift = 0;   // [rad/s]
  double quaternion_drift = 0;         // max | |p| - 1 |
  double energy_balance = 0;           // max |E + dissipated - work - E0| / max E
  double momentum_drift = unknown;     // of both momenta, each over its scale; unknown where something holds or pushes
  MotionScales largest;                // what these two are relative to
  std::vector<std::string> redundant;  // constraint rows left out, by joint
  std::vector<StopHistory> stops;      // per joint
  bool interrupted = false;
};

struct MultibodyTrajectory {
  std::vector<double> time;
  std::vector<MultibodyState> states;
  std::vector<Balance> balance;  // momenta with the wheels'
  std::vector<StopEvent> events;
  MultipliersSummary summary;
  /// Between the outputs, where loads may be largest, see TellingMoments.
  std::vector<std::pair<double, MultibodyState>> telling;
};

/// The equations of motion in redundant coordinates (eq. 12): every body has R, quaternion, q, velocity, omega, q_dot;
/// joints are constraints with Lagrange multipliers (README, "Redundant coordinates"). Never changes after
/// construction.
class Multipliers {
 public:
  /// One choice of geometric stiffness for all bodies or one per body.
  /// @throws InputError when a body, place or joint is not valid, naming it.
  explicit Multipliers(Multibody, std::vector<Stiffening> stiffening = {Stiffening::off});
  ~Multipliers();
  Multipliers(Multipliers&&) noexcept;

  const Multibody& multibody() const;
  Stiffening stiffening(int body) const;

  struct Impl;
  const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// The bodies where the joints of the tree put them, q = 0. `coordinates` has the freedoms of each joint, `rates` their
/// rates. A hinge has an angle [rad]. A slider has a way [m]. A universal joint has two angles [rad]. A spherical joint
/// has a rotation vector [rad]. A free joint has a way, then a rotation vector, both in the axes of a. An empty list of
/// a joint is zeros. Joints that close loops are not looked at.
/// @throws InputError when the joints are no tree or a list has the wrong size.
std::vector<BodyState> place_bodies(const Multibody&, const std::vector<std::vector<double>>& coordinates,
                                    const std::vector<std::vector<double>>& rates = {});

/// Moves the bodies as little as needed (mass metric) until every joint closes at t [s], positions and velocities.
/// @throws InputError naming the joint that stays open.
std::vector<BodyState> close_joints(const Multipliers&, const std::vector<BodyState>&, double t = 0);

/// Flies the bodies from the start with SUNDIALS IDA.
/// @throws InputError when the start does not fulfil a joint (naming it) or the options are bad; NumericalError when
/// the method fails or a loop locks, naming the joint.
MultibodyTrajectory integrate_multipliers(const Multipliers&, const std::vector<BodyState>& start,
                                          const MultipliersOptions&, const Checkpoint<MultibodyTrajectory>& = {});

}  // namespace flexboom
