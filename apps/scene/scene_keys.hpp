#pragma once

#include "apps/base/toml_reader.hpp"
#include "apps/scene/tree_scene.hpp"
#include "fem/mesh/section.hpp"

#include <array>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

/// What the description, the checks and the reader of scenes share. Internal to `apps`.
namespace flexboom::scene_keys {

inline constexpr std::string_view scene_format = "flexboom-scene-1";
inline constexpr std::string_view body_format = "flexboom-body-1";
inline constexpr std::string_view ground = "ground";  // the inertial frame as a body

/// A dimension of a cross-section.
struct Dimension {
  std::string_view key, unit, what;
  double* value;
  bool optional = false;
};

inline std::vector<Dimension> dimensions(RoundBar& s) {
  return {{"diameter", "m", "outer one, of a round bar or a tube", &s.diameter}};
}
inline std::vector<Dimension> dimensions(Tube& s) {
  return {{"diameter", "m", "", &s.diameter}, {"thickness", "m", "of the wall of a tube", &s.thickness}};
}
inline std::vector<Dimension> dimensions(Rectangle& s) {
  return {{"height", "m", "of a rectangle or its tube, along y", &s.height},
          {"width", "m", "of a rectangle or its tube, along z", &s.width}};
}
inline std::vector<Dimension> dimensions(RectangularTube& s) {
  return {{"height", "m", "", &s.height}, {"width", "m", "", &s.width}, {"thickness", "m", "", &s.thickness}};
}
inline std::vector<Dimension> dimensions(GeneralSection& s) {
  return {{"A", "m^2", "area of a general section", &s.A},
          {"Iy", "m^4", "its second moment of area about y", &s.Iy},
          {"Iz", "m^4", "about z", &s.Iz},
          {"J", "m^4", "its torsion constant", &s.J},
          {"kappa_y", "", "its shear coefficient along y", &s.kappa_y, true},
          {"kappa_z", "", "along z", &s.kappa_z, true}};
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

struct BeamSegment;
struct BodyScene;
struct Reading;
struct Scene;

/// Everything that can be said of the values themselves, under the key paths of a scene file.
void check_scene(const Scene&, toml_reader::Faults&);

/// [hub] and [[hinges]] of a scene with joints, before they are written out as joints.
void check_shorthand(const Scene&, toml_reader::Faults&);

/// What the keys of a body, each of them right, cannot be together. With an empty path: of a body file.
void check_body(const BodyScene&, const std::string& path, toml_reader::Faults&);

/// The same of joints, springs, loads, wheels and gravity.
void check_tree(const Scene&, toml_reader::Faults&);

/// Does the far end have other dimensions?
bool is_tapered(const BeamSegment&);

/// Decks write names in capitals: a marker that is not there as written is the one that differs by case alone. A place
/// without marker or point on a body whose root moves in its frame is the root. A hub that is fixed is the inertial
/// frame.
void look_up(const Scene&, PlaceScene&);

/// The same of the node sets that a boom names.
void spell_sets(BodyScene&);

/// What is not wrong but may not be meant: springs that press on stops, starts beyond them.
void warn_of_oddities(const Scene&, std::vector<std::string>& warnings);
/// doubts_of_beams, materials that are none, bodies that hardly vibrate, files that fail their own checks.
void warn_of_body(const BodyScene&, std::vector<std::string>& warnings);

/// Paths of every key that the readers of a scene look for, "bodies[].name".
std::set<std::string> keys_known(const std::string& scene, const std::filesystem::path& folder);

/// Takes over what the file holds that an entry of [[bodies]] names. A file that cannot be read is a fault of the whole
/// entry.
void read_file_of_body(toml_reader::TableReader& entry, Reading&, BodyScene&);

/// Markers that a place on the body may name.
std::vector<std::string> marker_names(const BodyScene&);

/// Columns of a scene with joints, a vector being one output: "arm.angle", "arm.q", "arm.tip".
std::vector<std::string> outputs_of(const Scene&);

/// The joint of the body whose attitude against the LVLH frame is an output; one behind the last where no body flies.
size_t first_that_flies(const Scene&);

/// A direction rounded by hand or by arithmetic is made a unit vector. One that is a unit vector to round-off stays bit
/// for bit. So a scene that was written out reads back the same.
Eigen::Vector3d unit_direction(const Eigen::Vector3d&);
Eigen::Vector3d normal_to(const Eigen::Vector3d& direction, const Eigen::Vector3d& unit);

}  // namespace flexboom
