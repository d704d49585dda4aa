#pragma once

#include "apps/simulate/simulate.hpp"
#include "dynamics/simulation/tree_integrator.hpp"

#include <string>
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
