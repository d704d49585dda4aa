#pragma once

#include "apps/toml_reader.hpp"
#include "apps/tree_scene.hpp"
#include "fem/section.hpp"

#include <array>
#include <filesystem>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

/// What the reader, the checks and the writer of scenes share: every name that a file may use is spelled here once.
/// Internal to `apps`.
namespace flexboom::scene_keys {

inline constexpr std::string_view scene_format = "flexboom-scene-1";
inline constexpr std::string_view body_format = "flexboom-body-1";
inline constexpr std::array<std::string_view, 4> structures = {"beam", "solid", "eq14", "rigid"};
inline constexpr std::array<std::string_view, 2> directions = {"hinge-plane", "all"};
inline constexpr std::array<std::string_view, 2> theories = {"euler-bernoulli", "timoshenko"};  // order of BeamTheory
inline constexpr std::array<std::string_view, 2> shear_rules = {"cowper", "nu-squared"};        // or a number
inline constexpr std::array<std::string_view, 4> damping_rules = {"none", "modal", "loss-factor", "rayleigh"};

inline constexpr std::array<std::string_view, 2> formulations = {"relative", "multipliers"};
inline constexpr std::array<std::string_view, 3> stiffenings = {"auto", "on", "off"};
inline constexpr std::array<std::string_view, 2> load_axes = {"body", "inertial"};
inline constexpr std::array<std::string_view, 2> orbit_gravities = {"none", "differential"};
inline constexpr std::string_view ground = "ground";  // the inertial frame as a body

/// A dimension of a cross-section [m, m^2, m^4, -].
struct Dimension {
  std::string_view key;
  double* value;
  bool optional = false;
};

inline std::vector<Dimension> dimensions(RoundBar& s) { return {{"diameter", &s.diameter}}; }
inline std::vector<Dimension> dimensions(Tube& s) { return {{"diameter", &s.diameter}, {"thickness", &s.thickness}}; }
inline std::vector<Dimension> dimensions(Rectangle& s) { return {{"height", &s.height}, {"width", &s.width}}; }
inline std::vector<Dimension> dimensions(RectangularTube& s) {
  return {{"height", &s.height}, {"width", &s.width}, {"thickness", &s.thickness}};
}
inline std::vector<Dimension> dimensions(GeneralSection& s) {
  return {{"A", &s.A},
          {"Iy", &s.Iy},
          {"Iz", &s.Iz},
          {"J", &s.J},
          {"kappa_y", &s.kappa_y, true},
          {"kappa_z", &s.kappa_z, true}};
}
inline std::vector<Dimension> dimensions(SectionShape& shape) {
  return std::visit([](auto& s) { return dimensions(s); }, shape);
}

/// Names in the order of the alternatives of SectionShape.
inline constexpr std::array<std::string_view, 5> shapes = {"round-bar", "tube", "rectangle", "rectangular-tube",
                                                           "general"};
static_assert(shapes.size() == std::variant_size_v<SectionShape>);

inline SectionShape blank_shape(size_t index) {
  const std::array<SectionShape, 5> blank = {RoundBar{}, Tube{}, Rectangle{}, RectangularTube{}, GeneralSection{}};
  return blank[index];
}

}  // namespace flexboom::scene_keys

namespace flexboom {

struct Scene;
struct BodyScene;

/// Everything that can be said of the values themselves, under the key paths of a scene file or (for a body with an
/// empty path) of a body file.
void check_scene(const Scene&, toml_reader::Faults&);

/// [hub] and [[hinges]] of a scene with joints, before they are written out as joints.
void check_shorthand(const Scene&, toml_reader::Faults&);
void check_body(const BodyScene&, const std::string& path, toml_reader::Faults&);

/// Joints, springs, loads, wheels and gravity: reading (apps/tree_scene_reader.cpp) and checking.
void read_tree(toml_reader::TableReader&, Scene&);
void check_tree(const Scene&, toml_reader::Faults&);

/// Decks write names in capitals: a marker that is not there as written is the one that differs by case alone. A place
/// without marker or point on a body whose root moves in its frame is the root. A hub that is fixed is the inertial
/// frame.
void look_up(const Scene&, PlaceScene&);

/// What formulation = "multipliers" cannot do.
void check_multipliers(const Scene&, toml_reader::Faults&);

/// What is not wrong but may not be meant: springs that press on stops, starts beyond them.
void warn_of_oddities(const Scene&, std::vector<std::string>& warnings);

/// Paths of every key that the readers of a scene look for, "bodies[].name".
std::set<std::string> keys_known(const std::string& scene, const std::filesystem::path& folder);

/// A place, functions of time: one, one per freedom, one per axis.
PlaceScene read_place(toml_reader::TableReader&, std::string_view key);
CourseScene read_course(toml_reader::TableReader&, std::string_view key);
std::vector<CourseScene> read_courses(toml_reader::TableReader&, std::string_view key);
std::array<CourseScene, 3> read_three_courses(toml_reader::TableReader&, std::string_view key);

/// Markers that a place on the body may name.
std::vector<std::string> marker_names(const BodyScene&);

/// Columns of a scene with joints, a vector being one output: "arm.angle", "arm.q", "arm.tip".
std::vector<std::string> outputs_of(const Scene&);

/// A direction rounded by hand or by arithmetic is made a unit vector; one that is so to round-off stays bit for bit,
/// so that a scene that was written out reads back the same.
Eigen::Vector3d unit_direction(const Eigen::Vector3d&);
Eigen::Vector3d normal_to(const Eigen::Vector3d& direction, const Eigen::Vector3d& unit);

}  // namespace flexboom
