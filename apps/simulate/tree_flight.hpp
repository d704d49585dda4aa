#pragma once

#include "apps/simulate/simulate.hpp"
#include "dynamics/simulation/tree_integrator.hpp"

#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace flexboom {

/// The bodies, joints and forces of a scene with joints. @throws InputError.
Multibody make_multibody(const Scene&, const std::vector<PreparedBody>&);

/// The joints that make the tree.
Scene without_loops(Scene);

/// Start values of its joints.
TreeState start_state(const Scene&, const Tree&);

/// Where its flight begins: there, or where an earlier run ended. @throws InputError for a state of another scene.
Eigen::VectorXd first_state(const Scene&, const Tree&);

std::vector<std::string> joint_names(const Scene&);

/// Where a flight of a scene with joints is.
FlightState end_of(const Run&, const Scene&, double time, const Eigen::VectorXd& y, const IntegrationSummary&);

/// Geometric stiffness of each body: as the scene says, "auto" by what its start and prescribed motions make of it, and
/// on where springs or joints that close loops hold it at both ends. `whole`: with these joints; `plain`: the tree
/// without any geometric stiffness.
std::vector<Stiffening> first_stiffening(const Scene&, const Multibody& whole, const Tree& plain);

/// How far the hinge or slider moves that moves least, as a length [m]; infinite where there is none. `range`: lowest
/// and highest coordinate of a joint.
double least_motion(const Multibody&, const std::function<std::pair<double, double>(size_t joint)>& range);

/// Turns on what a flight showed to count: `effect` per body. A body that gets shorter as it bends may be all that
/// moves a joint: `least_motion`, once it is known. Was there any?
bool revise_stiffening(const Scene&, const Multibody&, const std::vector<LargestStiffening>& effect,
                       std::vector<Stiffening>&, double least_motion = std::numeric_limits<double>::infinity());

/// Would that turn on any? Then the flight that showed it is not worth keeping.
bool will_be_revised(const Scene&, const Multibody&, const std::vector<LargestStiffening>& effect,
                     std::vector<Stiffening>);

/// How a flight ended, and how far the joint that moved least moved in it.
struct Flown {
  bool interrupted = false;
  double least_motion = 0;  // [m]
};

/// Flies until no flight shows more that counts; one that fails without it is flown again with it. `fly` sets `effect`.
/// @throws NumericalError as `fly`.
void fly_until_settled(const Scene&, const Multibody&, std::vector<LargestStiffening>& effect, std::vector<Stiffening>&,
                       const std::function<Flown()>& fly);

/// One flight in relative coordinates. Geometric stiffness "auto" is on where it exceeds the tolerance at the start or
/// under the prescribed motions. Where it exceeds the tolerance at any output, the flight is repeated with it.
/// `max_steps` > 0 bounds its cost. @throws InputError, NumericalError.
Run fly_tree(const Scene&, std::vector<PreparedBody>, const RunHooks&, long max_steps);

/// Adds where the scene's functions of time are not smooth, and where steps must end so that they overlook nothing of
/// them: a pulse, or a vibration.
void set_corners(const Scene&, IntegratorOptions&);

/// Where the mass centre of all bodies lies, inertial axes [m].
Eigen::Vector3d mass_centre(const Tree&, const TreeState&);

/// What a row of trajectory.csv is made of.
struct Moment {
  double time = 0;
  TreeState state;               // joints as Scene::joints
  std::vector<JointLoad> loads;  // the same
  Balance balance;
};

/// Columns of trajectory.csv. `moment` turns that of the row before into that of a row.
OutputTable output_table(const Scene&, const Tree&, size_t rows,
                         const std::function<void(size_t row, Moment&)>& moment);
OutputTable output_table(const Scene&, const Tree&, const TreeTrajectory&);

/// What was flown, one line each.
void describe_model(const Scene&, const Run&, std::vector<std::string>& plan);

}  // namespace flexboom
