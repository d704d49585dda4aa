#pragma once

#include "apps/scene/tree_scene.hpp"
#include "dynamics/model/hub_with_booms.hpp"
#include "fem/booms/solid_boom.hpp"
#include "reduction/basis/basis.hpp"
#include "reduction/body_file/body_file.hpp"

#include <Eigen/Core>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace flexboom {

class SavedState;

namespace toml_reader {
struct Value;
}

/// A rigid body of a scene with joints.
struct RigidScene {
  double mass = 0;                                    // [kg]
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  // about its mass centre, BRF axes [kg m^2]
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();   // BRF [m]
  Eigen::Vector3d size = Eigen::Vector3d::Zero();     // box about the mass centre, for pictures [m]
};

/// A flexible boom as a file describes it (format "flexboom-body-1", or a [[bodies]] entry of a scene). In a scene with
/// joints a body may also be rigid, or reduced before.
struct BodyScene {
  std::string name;
  std::string structure =
      "beam";  // "beam", "solid": finite elements; "eq14": closed form (one uniform segment only); "rigid"
  std::string clamp = "root";              // node set that is fixed
  int modes = 2;                           // elastic coordinates kept
  bool modes_given = false;                // by the file
  bool modes_auto = false;                 // modes = "auto": chosen from the accuracy wanted
  std::vector<int> shapes;                 // which of the modes stand for the body, from 1; empty: all
  std::string directions = "hinge-plane";  // modes that count: "hinge-plane" (bending along y) or "all"
  bool directions_given = false;           // by the file
  bool basis_given = false;                // by the file
  BasisOptions basis;                      // its names and places; modes, plane and backend are those of the body
  BeamGeometry geometry;
  SolidOptions solid;            // [solid], how structure = "solid" is meshed
  DampingRule damping;           // none by default
  std::string backend = "auto";  // eigen-solver: ARPACK for beams, blocks for large solids

  // Of a scene with joints.
  std::string stiffening;                      // geometric: "auto", "on", "off"; empty: not part of the equations
  std::optional<RigidScene> rigid;             // instead of a geometry; structure is "rigid"
  std::shared_ptr<const ReducedBody> reduced;  // instead of a geometry; structure is that of the file
  std::filesystem::path reduced_file;          // where `reduced` is from, absolute
  std::optional<DampingRule> other_damping;    // instead of that of the file
  std::shared_ptr<const RicherBodies> richer;  // what the file has for error estimates; may be null
  /// Modes of all directions count, unless the file says which.
  void open_directions() {
    if (!directions_given) directions = "all";
  }
  bool is_boom() const { return !rigid && !reduced; }
  bool is_flexible() const { return !rigid && structure != "rigid"; }  // whatever modes it has
  bool is_elastic() const;  // has it coordinates, as far as that is known before it is made?
  bool root_moves() const;  // in its own frame: the root is then a marker, not a point of the frame
};

/// A rigid hub. Inertia about its mass centre, which is the origin of its BRF.
struct HubScene {
  double mass = 0;                                    // [kg]
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  // [kg m^2], as given
  bool fixed = false;                                 // does not move at all
  Eigen::Vector3d size = Eigen::Vector3d::Zero();     // box for pictures [m]
};

struct HingeScene {
  std::string body;  // BodyScene::name; also the hinge's name
  Hinge hinge;
  JointLaw law;            // beside its mechanism; then the scene is one with joints
  double start_angle = 0;  // [rad]
  double start_rate = 0;   // [rad/s]
  bool loads = false;      // are its force and torque outputs?
};

/// Orbit of the reference point, for gravity and for attitude in the local-vertical local-horizontal frame: z to the
/// Earth, y against the orbit's normal. The inertial axes are those of this frame at t = 0.
struct OrbitScene {
  double altitude = 405e3;       // of the perigee, above the equatorial radius [m]
  double eccentricity = 0;       // [0, 1)
  double inclination = 0;        // [rad]
  double node = 0;               // right ascension of the ascending node [rad]
  double perigee = 0;            // argument, from the node [rad]
  double anomaly = 0;            // true anomaly at t = 0, from the perigee [rad]
  std::string gravity = "none";  // "none", or "differential": that on the bodies less that on the reference point
  bool J2 = false;               // oblateness of the Earth, in the orbit and in the gravity
  double rate() const;           // mean motion [rad/s]
};

/// Everything `flexboom run` needs. Defaults are the values a file may leave out.
struct Scene {
  std::string name;
  double duration = 10;       // [s]
  double output_step = 0.01;  // [s]
  double vtu_step = 0;        // [s]; 0: no VTU files
  double tolerance = 1e-6;    // [accuracy] tolerance
  double step_tolerance() const { return integrator_tolerance > 0 ? integrator_tolerance : tolerance; }
  /// That of the integrator for each of the accuracy: below 1 where outputs need more digits than are asked for.
  double digits_share() const { return step_tolerance() / tolerance; }
  /// The integrator gets no more than this share of the accuracy.
  void limit_digits_share(double share) {
    if (share * tolerance < step_tolerance()) integrator_tolerance = share * tolerance;
  }
  std::vector<std::string> outputs;   // [accuracy] outputs; empty: all
  std::vector<std::string> absolute;  // [accuracy] absolute: errors that do not count, "1e-9 rad"
  bool error_budget = true;  // [accuracy] budget: repeat the run with a finer everything and print the differences
  std::string integrator = "auto";       // [integrator] method; "auto": what suits the scene
  double integrator_tolerance = 0;       // [integrator] tolerance; 0: that of [accuracy]
  std::string formulation = "relative";  // [integrator] formulation
  double settle = -1;                    // [integrator] settle, IntegratorOptions::settle
  bool rescale_at_events = false;
  HubScene hub;
  Eigen::Vector3d start_rate = Eigen::Vector3d::Zero();      // [initial] hub angular velocity, hub axes [rad/s]
  Eigen::Vector3d start_velocity = Eigen::Vector3d::Zero();  // [initial] hub velocity [m/s]
  std::optional<OrbitScene> orbit;
  std::vector<BodyScene> bodies;
  std::vector<HingeScene> hinges;

  // With [[joints]] the scene is a tree of bodies; hub, hinges and the start of the hub are then not used.
  bool is_tree = false;
  std::vector<JointScene> joints;
  std::vector<SpringScene> springs;
  std::vector<LoadScene> loads;
  std::vector<WheelScene> wheels;
  std::vector<TurnScene> turns;
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  // inertial axes [m/s^2]

  std::filesystem::path
      bodies_kept_in;           // where reduced bodies that take long are kept; empty: nowhere; not in the file
  double gravity_strength = 1;  // of OrbitalField; not in the file
  bool verify = false;          // hold the run against runs that share little with it; not in the file
  std::shared_ptr<const SavedState> from;  // instead of the start: where an earlier run ended; not part of the file

  std::vector<std::string> warnings;  // what was repaired or is odd (e.g. an inertia that is not symmetric)
};

/// Reads and checks everything; unknown keys are errors that name the nearest known key.
/// @throws InputError with every fault found, one per line.
Scene read_scene(const std::filesystem::path&);
Scene parse_scene(const std::string& text, const std::string& file_name, const std::filesystem::path& folder = ".");
/// Of a scene file that was parsed and perhaps changed since; `folder`: that its body files are relative to.
Scene read_scene(const toml_reader::Value& root, const std::filesystem::path& folder);
BodyScene read_body(const std::filesystem::path&);

/// What beams or the closed form leave out of a boom: its slit, beam_doubt. Of a solid nothing. `in_plane`: as there.
std::vector<std::string> doubts_of_beams(const BodyScene&, bool in_plane = false);

/// A path, or the name of a built-in scene ("sport"). @throws InputError listing the built-in names.
Scene load_scene(const std::string& path_or_name);

/// What is simulated: hub and hinges written out as a rigid body that flies and joints. A scene of joints as it is.
Scene with_joints(Scene);

/// Text of a built-in scene, nullptr if there is none of that name. The text is the commented file in meshes/.
const char* builtin_scene(const std::string& name);
std::vector<std::string> builtin_scene_names();

/// The scene as TOML with every default written out; parse_scene reads it back to the same Scene.
std::string to_toml(const Scene&);

/// A body as [[bodies]] of a scene.
std::string to_toml(const BodyScene&);

/// Checks that reading can not do line by line (also after command-line overrides). @throws InputError.
void validate(const Scene&);

/// Force and torque of every joint that holds something become outputs.
void ask_for_loads(Scene&);

}  // namespace flexboom
