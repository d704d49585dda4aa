#pragma once

#include "dynamics/gravity.hpp"
#include "dynamics/hinge.hpp"
#include "dynamics/spatial.hpp"
#include "reduction/reduced_body.hpp"

#include <Eigen/Core>

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace flexboom {

/// A flexible body on its hinge.
struct Appendage {
  ReducedBody body;  // BRF: x along the boom, y deflection in the hinge plane, z hinge axis, origin on the hinge
  Hinge hinge;
};

/// Where everything is and how it moves. Velocities are angular velocity (hub axes), joint rates and q_dot; the
/// quaternion is (w, x, y, z), hub BRF -> inertial.
struct State {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // R of the hub BRF, inertial axes [m]
  Eigen::Vector4d attitude = Eigen::Vector4d(1, 0, 0, 0);
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // Rdot, inertial axes [m/s]
  Eigen::Vector3d omega = Eigen::Vector3d::Zero();     // hub axes [rad/s]
  std::vector<double> angle;                           // Theta [rad], per appendage
  std::vector<double> rate;                            // [rad/s]
  std::vector<Eigen::VectorXd> q;                      // per appendage
  std::vector<Eigen::VectorXd> q_dot;
  double dissipated = 0, work = 0;  // energy lost and work of a field of gravity since the start [J]
};

/// Energies [J] and momenta (inertial axes).
struct Balance {
  double kinetic = 0;
  double elastic = 0;                                          // booms, hinge springs and stops
  Eigen::Vector3d momentum = Eigen::Vector3d::Zero();          // [kg m/s]
  Eigen::Vector3d angular_momentum = Eigen::Vector3d::Zero();  // about the system's mass centre [N m s]
  double momentum_scale = 0;  // sum of the bodies' |momentum|, and of all with the hub: what a drift is relative to
  double angular_momentum_scale = 0;  // of that about each body's own origin, the hub's origin at rest
};

/// All bodies as one, seen from the hub's origin, hub axes.
struct Whole {
  Eigen::Vector3d mass_centre;       // [m]
  Eigen::Vector3d velocity;          // of the mass centre against the hub's origin, in axes that do not turn [m/s]
  Eigen::Matrix3d inertia;           // about the mass centre [kg m^2]
  Eigen::Vector3d angular_momentum;  // about the mass centre [N m s]
};

/// Places of the parts of the state vector y = [p | u | R | attitude | Rdot | dissipated | work]:
/// p = (Delta_1, q_1, Delta_2, q_2, ...) with Delta = Theta - threshold, u = (omega, Delta_dot_1, q_dot_1, ...).
/// With a fixed hub, omega, R, attitude and Rdot are absent. Delta, not Theta, is the unknown: near the stop it keeps
/// its digits.
struct Layout {
  std::vector<int> body;  // first entry of each appendage in p (Delta, then q)
  int p = 0;              // size of p
  int u = 0;              // size of u
  int base = 0;           // entries of omega in u: 3, or 0 with a fixed hub
  int size = 0;           // size of y

  int u_begin() const { return p; }
  int position() const { return p + u; }
  int attitude() const { return p + u + base; }
  int velocity() const { return p + u + base + (base ? 4 : 0); }
  int dissipated() const { return size - 2; }
  int work() const { return size - 1; }
};

/// Scratch of one thread; made by System::workspace().
class Workspace;
struct WorkspaceDeleter {
  void operator()(Workspace*) const;
};
using WorkspaceHandle = std::unique_ptr<Workspace, WorkspaceDeleter>;

/// Hub and hinged flexible bodies in relative coordinates: 6 (hub) + 1 per hinge + n per body. Never changes after
/// construction.
class System {
 public:
  /// In a `field`, positions are relative to its reference point, and so is the gravity that all bodies feel.
  /// @throws InputError when a body is invalid, a hinge's directions are not orthonormal, a mass matrix is singular, or
  /// a fixed hub is in a field or alone.
  System(ReducedBody hub, std::vector<Appendage> appendages, bool fixed_hub = false,
         std::optional<OrbitalField> field = {});
  ~System();
  System(System&&) noexcept;

  const ReducedBody& hub() const;
  const std::vector<Appendage>& appendages() const;
  bool fixed_hub() const;
  const std::optional<OrbitalField>& field() const;
  const Layout& layout() const;

  Eigen::VectorXd pack(const State&) const;
  State unpack(const Eigen::Ref<const Eigen::VectorXd>& y) const;

  /// All at rest at the given hinge angles [rad].
  State at_rest(const std::vector<double>& angles) const;

  WorkspaceHandle workspace() const;

  /// y_dot = f(y) with the stops closed where contact[i] is set (the kink is not looked at here: events switch it).
  /// Allocates nothing. The time [s] counts in a field only.
  void derivative(double t, const double* y, std::span<const char> contact, Workspace&, double* y_dot) const;
  void derivative(const double* y, std::span<const char> contact, Workspace& w, double* y_dot) const {
    derivative(0, y, contact, w, y_dot);
  }

  /// The Jacobian blocks at y, exact by forward differentiation: d(u_dot)/d(p, u) and d(a_hub)/d(p, u), kept in the
  /// workspace together with the state they were taken at. Gravity is left out: its part is of the order of the orbital
  /// rate squared, 1e-6 1/s^2.
  void jacobian(const double* y, std::span<const char> contact, Workspace&) const;

  /// Prepares solves with I - gamma J. @throws NumericalError when it is singular.
  void factorise_newton(double gamma, Workspace&) const;

  /// x = (I - gamma J)^-1 b with the blocks of `jacobian` and the gamma of `factorise_newton`; x and b may be the same
  /// array.
  void solve_newton(const double* b, Workspace&, double* x) const;

  /// J itself, dense, from the kept blocks (for tests and spectra).
  Eigen::MatrixXd dense_jacobian(const Workspace&) const;

  /// Hinge angle minus threshold and its rate.
  double gap(const double* y, int appendage) const { return y[layout().body[static_cast<size_t>(appendage)]]; }
  double gap_rate(const double* y, int appendage) const {
    const Layout& l = layout();
    return y[l.u_begin() + l.base + l.body[static_cast<size_t>(appendage)]];
  }

  /// Energies and momenta of hub and bodies; without the work of gravity.
  Balance balance(const Eigen::Ref<const Eigen::VectorXd>& y, Workspace&) const;

  /// By p and u alone.
  Whole whole(const Eigen::Ref<const Eigen::VectorXd>& y, Workspace&) const;

  /// Elastic displacement of the body's marker "tip" in its BRF [m]; zero without that marker.
  Eigen::Vector3d tip_displacement(const State&, int appendage) const;

  /// Rotation matrix boom axes -> hub axes.
  Eigen::Matrix3d boom_to_hub(int appendage, double angle) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace flexboom
