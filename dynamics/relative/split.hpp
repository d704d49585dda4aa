#pragma once

#include "dynamics/relative/tree.hpp"

#include <Eigen/Core>

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace flexboom {

/// Places in a state y = (x, followers, energies). x: coordinates and their rates, angular velocities, spins of wheels.
struct SplitLayout {
  struct Coordinate {  // entries of x
    int value, rate;
  };
  struct Turn {    // an attitude and the angular velocity that it follows, in the axes that turn
    int omega;     // entry of x
    int attitude;  // quaternion, place in y
    bool is_root;  // of a body that floats in inertial space: what is inside does not feel it
  };
  struct Root {  // a body that floats in inertial space
    int position, velocity, attitude, omega;
  };

  int x = 0, energies = 0, size = 0;  // number of entries of x; place of the first energy
  std::vector<Coordinate> coordinates;
  std::vector<Turn> turns;
  std::vector<Root> roots;
  std::vector<Coordinate> gaps;   // per stop
  std::vector<int> joints;        // entries of x that are coordinates of joints, less their thresholds
  std::vector<int> spins;         // of wheels
  std::vector<int> prescribed;    // entries of x that are given functions of time
  bool outside_pushes = false;    // does gravity or a load move a mass centre?
  bool loads_work = false;        // does a load's power depend on x?
  bool attitudes_matter = false;  // does x' depend on an attitude, or on a place?
  bool momentum_is_kept = false;  // of all bodies, the first root among them
};

/// Of all that hangs on a root, in the axes of the root's position.
struct MassCentre {
  Eigen::Vector3d position;  // from that of the root [m]
  Eigen::Vector3d velocity;  // less that of the root [m/s]
};

/// All that hangs on a root, in the axes of its position.
struct FloatingBodies {
  MassCentre centre;
  Eigen::Matrix3d inertia;           // about the mass centre [kg m^2]
  Eigen::Vector3d angular_momentum;  // about the mass centre [N m s]
};

/// What exponential collocation needs of equations of motion: x' = L x + N(t, y), and what follows x. Holds a
/// workspace: for one thread.
class SplitProblem {
 public:
  virtual ~SplitProblem() = default;
  virtual const SplitLayout& layout() const = 0;
  /// contact: one flag per stop.
  virtual void derivative(double t, const double* y, std::span<const char> contact, double* y_dot) = 0;
  /// The acceleration of a root's mass centre, at the state of the last `derivative` [m/s^2].
  virtual Eigen::Vector3d outside_acceleration(size_t root) = 0;
  /// d(x')/dx.
  virtual Eigen::MatrixXd linear(double t, const double* y, std::span<const char> contact) = 0;
  /// By x and attitudes alone. t: of prescribed motions [s].
  virtual FloatingBodies floating(size_t root, double t, const double* y) = 0;
  /// The same mass centre, at a part of the cost.
  virtual MassCentre mass_centre(size_t root, double t, const double* y) = 0;
};

/// Why a tree cannot be split: words, or none.
std::string split_fault(const Tree&);
/// @throws InputError where there is such a reason.
std::unique_ptr<SplitProblem> split(const Tree&);

}  // namespace flexboom
