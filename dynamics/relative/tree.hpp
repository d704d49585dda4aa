#pragma once

#include "dynamics/model/energy_ledger.hpp"
#include "dynamics/model/joint.hpp"
#include "dynamics/model/multibody.hpp"

#include <Eigen/Core>

#include <cmath>
#include <memory>
#include <span>
#include <vector>

namespace flexboom {

/// What a joint has at an instant, as far as its kind has it.
struct JointState {
  std::vector<double> coordinate;                      // angles [rad], length [m]
  std::vector<double> rate;                            // their derivatives
  Eigen::Vector4d attitude = {1, 0, 0, 0};             // quaternion (w, x, y, z), axes of b -> axes of a
  Eigen::Vector3d omega = Eigen::Vector3d::Zero();     // of b relative to a, axes of b [rad/s]
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // of b from a, axes of a [m]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // its derivative [m/s]
};

struct TreeState {
  std::vector<JointState> joints;         // as Multibody::joints
  std::vector<Eigen::VectorXd> q, q_dot;  // per body
  std::vector<double> spin;               // of the wheels relative to their bodies [rad/s]
};

/// Places of the parts of y = [p | u | spins | attitudes, positions, velocities of joints | energies].
/// p: per body the coordinates of the joint that carries it (less the threshold of its mechanism) and q. u: omega of
/// joints that turn, then the derivative of p. Bodies come in the order of the tree (parents first, else as given).
struct TreeLayout {
  struct Joint {  // -1: it has none
    int scalar = -1, omega = -1, position = -1, attitude = -1, velocity = -1, dissipated = -1;
    int losses = -1;  // of a law, in the order of law_losses [J]
  };
  std::vector<Joint> joints;  // as Multibody::joints; `scalar` is a place in p, the others in y
  std::vector<int> q;         // per body, place in p
  int p = 0, base = 0, u = 0, size = 0;
  int spin = 0;        // of the first wheel
  int dissipated = 0;  // by the dampers of the joints, one each; by the structures and springs, one; then the work of
                       // loads, wheels and prescribed joints, and the losses of laws
  int dissipated_elsewhere = 0, work = 0;

  int rate(int place_in_p) const { return p + base + place_in_p; }
};

/// Where a place is and how it moves, inertial axes.
struct PlaceMotionInSpace {
  Eigen::Vector3d position, velocity, omega;  // [m], [m/s], [rad/s]
  Eigen::Matrix3d axes;                       // place -> inertial
};

/// Size of the geometric stiffness of a body against its Ke in some state, and of the displacement u2 that goes with
/// it. 0 where the body has no Kg.
struct StiffeningEffect {
  double size = 0;        // the largest |eigenvalue| of Kg(omega, a, alpha, q_ddot, loads) in the metric of Ke
  double softening = 0;   // what it takes from Ke: at 1 a shape has no stiffness left
  double shortening = 0;  // the largest u2 of a marker that loads may act on [m]
};

/// What joint i exerts on its place b, axes of b; the opposite acts on a.
struct JointLoad {
  Eigen::Vector3d force = Eigen::Vector3d::Zero(), torque = Eigen::Vector3d::Zero();  // [N], [N m]
  std::vector<double> drive;  // of a prescribed motion, one per freedom: torque [N m] or force [N]
};

/// Scratch of one thread; made by Tree::workspace().
class TreeWorkspace;
struct TreeWorkspaceDeleter {
  void operator()(TreeWorkspace*) const;
};
using TreeWorkspaceHandle = std::unique_ptr<TreeWorkspace, TreeWorkspaceDeleter>;

/// Any tree of rigid and flexible bodies in relative coordinates. Never changes after construction.
class Tree {
 public:
  /// `stiffening`: one per body, or one for all.
  /// @throws InputError when the scene is no tree, a body is invalid, a place or marker does not exist, or a joint
  /// moves no inertia.
  explicit Tree(Multibody, std::vector<Stiffening> stiffening = {Stiffening::off});
  ~Tree();
  Tree(Tree&&) noexcept;

  const Multibody& scene() const;
  const TreeLayout& layout() const;
  Stiffening stiffening(int body) const;

  /// All at rest: joints at zero, or the rest of their mechanism where that has a spring.
  TreeState at_rest() const;
  Eigen::VectorXd pack(const TreeState&) const;
  TreeState unpack(const Eigen::Ref<const Eigen::VectorXd>& y) const;
  /// The same into a state of this tree, where it is: row after row without new memory. A new one is made ready.
  void unpack(const Eigen::Ref<const Eigen::VectorXd>& y, TreeState&) const;

  /// Sets what is prescribed at t. Integration keeps it to its tolerance; this to round-off.
  void impose(double t, Eigen::Ref<Eigen::VectorXd> y) const;

  TreeWorkspaceHandle workspace() const;

  /// y_dot = f(t, y) with the stops of joints with contact[joint] closed. Allocates nothing.
  /// @throws NumericalError naming the body where the mass matrix at y is singular to round-off.
  /// laws: a branch per joint, or empty: laws do nothing.
  void derivative(double t, const double* y, std::span<const char> contact, TreeWorkspace&, double* y_dot,
                  std::span<const LawBranch> laws = {}) const;

  /// What holds a joint that its law holds pushes b with, at what the workspace was used for last.
  double hold_load(int joint, const double* y, const TreeWorkspace&) const;

  /// df/dy, exact by forward differentiation.
  void jacobian(double t, const double* y, std::span<const char> contact, TreeWorkspace&, Eigen::MatrixXd& J,
                std::span<const LawBranch> laws = {}) const;

  /// Its first columns: as many as `columns` has, and as many rows of them.
  void jacobian_columns(double t, const double* y, std::span<const char> contact, TreeWorkspace&,
                        Eigen::Ref<Eigen::MatrixXd> columns, std::span<const LawBranch> laws = {}) const;

  /// Joints with a stop, and where they are: coordinate less threshold, its rate.
  const std::vector<int>& stops() const;
  double gap(const double* y, int joint) const { return y[layout().joints[static_cast<size_t>(joint)].scalar]; }
  double gap_rate(const double* y, int joint) const {
    return y[layout().rate(layout().joints[static_cast<size_t>(joint)].scalar)];
  }

  /// Of a state with what is prescribed at t as prescribed; the second form imposes that.
  Balance balance(double t, const Eigen::Ref<const Eigen::VectorXd>& y, TreeWorkspace&) const;
  Balance balance(double t, const Eigen::Ref<const Eigen::VectorXd>& state) const;
  PlaceMotionInSpace motion(double t, const Eigen::Ref<const Eigen::VectorXd>& state, const Place&) const;
  /// Of several places: the bodies are moved once.
  std::vector<PlaceMotionInSpace> motions(double t, const Eigen::Ref<const Eigen::VectorXd>& state,
                                          std::span<const Place> places) const;
  std::vector<JointLoad> joint_loads(double t, const Eigen::VectorXd& y, std::span<const char> contact, TreeWorkspace&,
                                     std::span<const LawBranch> laws = {}) const;

  /// Of each body.
  std::vector<StiffeningEffect> stiffening_effect(double t, const Eigen::VectorXd& y, std::span<const char> contact,
                                                  TreeWorkspace&, std::span<const LawBranch> laws = {}) const;

  struct Impl;
  const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace flexboom
