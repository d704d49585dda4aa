// The keys of a body, as those of a scene in scene_language.cpp.

#include "apps/base/axis.hpp"
#include "apps/scene/keys.hpp"
#include "apps/scene/scene_checks.hpp"
#include "apps/scene/scene_keys.hpp"
#include "fem/booms/solid_boom.hpp"
#include "reduction/eigen/solver.hpp"

#include <fmt/format.h>

#include <array>

namespace flexboom {
namespace {

using namespace scene_checks;
using scene_keys::Dimension;
using toml_reader::Faults;
using Use = Archive::Use;

constexpr std::array<std::string_view, 4> structures = {"beam", "solid", "eq14", "rigid"};
constexpr std::array<std::string_view, 2> directions = {"hinge-plane", "all"};
constexpr std::array<std::string_view, 3> stiffenings = {"auto", "on", "off"};
constexpr std::array<std::string_view, 2> theories = {"euler-bernoulli", "timoshenko"};  // order of BeamTheory
constexpr std::array<std::string_view, 2> shear_rules = {"cowper", "nu-squared"};        // or a number
constexpr std::array<std::string_view, 4> damping_rules = {"none", "modal", "loss-factor", "rayleigh"};
constexpr std::array<std::string_view, 1> mode_words = {"auto"};  // or a number
constexpr std::array<std::string_view, 1> positions = {"tip"};    // or a number

template <class T>
void from_to(Faults& faults, const std::string& path, T value, T least, T most, const char* otherwise) {
  if (value < least || value > most)
    faults.add(path, fmt::format("is {}; it must be {} to {}{}", value, least, most, otherwise));
}

void mode_count(Faults& faults, const std::string& path, const NumberOrWord& modes, std::string_view) {
  from_to(faults, path, modes.number, 0.0, 10000.0, ", or \"auto\"");  // more is a typing error
}

void shape_numbers(Faults& faults, const std::string& path, const std::vector<int>& values, std::string_view) {
  int before = 0;
  for (const int v : values) {
    if (v <= before) return faults.add(path, fmt::format("has {}; it must be ascending whole numbers from 1 on", v));
    before = v;
  }
}

void element_count(Faults& faults, const std::string& path, const int& elements, std::string_view) {
  from_to(faults, path, elements, 0, 100000, ", 0 to let the program choose");  // as make_mesh
}

void order(Faults& faults, const std::string& path, const int& value, std::string_view) {
  from_to(faults, path, value, 1, highest_beam_order, "");
}

void mesh_accuracy(Faults& faults, const std::string& path, const double& value, std::string_view) {
  if (!(value >= best_mesh_accuracy && value < 1))
    faults.add(path, fmt::format("is {}; it must be {:g} or more, the best that is known of a mesh, and less than 1",
                                 value, best_mesh_accuracy));
}

void shear_coefficient(Faults& faults, const std::string& path, const NumberOrWord& shear, std::string_view unit) {
  if (shear.word.empty())
    positive(faults, path, shear.number, unit);
  else
    check_name_among(faults, path, shear.word, shear_rules);
}

void poisson(Faults& faults, const std::string& path, const double& nu, std::string_view) {
  if (!(nu > -1 && nu < 0.5))
    faults.add(path, fmt::format("is {}; Poisson's ratio must lie between -1 and 0.5, both excluded", nu));
}

void stiffnesses(Faults& faults, const std::string& path, const std::vector<double>& values, std::string_view unit) {
  for (const double value : values) not_negative(faults, path, value, unit);
}

void some_direction(Faults& faults, const std::string& path, const Eigen::Vector3d& axis, std::string_view) {
  if (!(axis.allFinite() && axis.norm() > 0))
    faults.add(path, "has no direction; give [x, y, z] in the axes of the body");
}

void name_if_any(Faults& faults, const std::string& path, const std::string& value, std::string_view unit) {
  if (!value.empty()) name(faults, path, value, unit);
}

void section_keys(Archive& a, SectionShape& shape, bool of_the_start) {
  if (KeyReader* reader = a.reader())
    reader->hint(fmt::format(" (for shape \"{}\")", scene_keys::shapes[shape.index()]));
  const auto describe = [&](SectionShape& described) {
    for (const Dimension& d : scene_keys::dimensions(described))
      if (a.use() != Use::document || !d.what.empty())
        a.key({d.key, d.unit, d.what, of_the_start && !d.optional}, *d.value, positive);
  };
  describe(shape);
  for (size_t other = shape.index() + 1; a.use() == Use::document && other < scene_keys::shapes.size(); ++other) {
    SectionShape described = scene_keys::blank_shape(other);
    describe(described);
  }
}

void end_keys(Archive& a, SectionShape& shape) {
  if (a.use() != Use::document) section_keys(a, shape, false);  // they are those of the start
}

void material_keys(Archive& a, Material& m) {
  a.key({"E", "Pa", "Young's modulus", required}, m.E, positive);
  a.key({"nu", "", "Poisson's ratio", required}, m.nu, poisson);
  a.key({"rho", "kg/m^3", "density", required}, m.rho, not_negative);
}

void segment_keys(Archive& a, BeamSegment& s) {
  const bool reads = a.reader();
  size_t shape = reads ? scene_keys::shapes.size() : s.start.index();
  a.choice({"shape", "", "of the cross-section", required}, scene_keys::shapes, shape);
  if (shape < scene_keys::shapes.size()) {
    if (reads) s.start = scene_keys::blank_shape(shape);
    section_keys(a, s.start, true);
    if (reads) s.end = s.start;
    if (a.use() != Use::check || is_tapered(s))
      a.table({"end", "", "dimensions that differ at the far end; between the ends they change linearly", false,
               "as the start"},
              s.end, end_keys, "End");
  } else {
    s.start = s.end = GeneralSection{1, 1, 1, 1, 1, 1};  // some faultless section takes its place
    a.reader()->take_any_key();
  }
  a.key({"length", "m", "of the segment", required}, s.length, positive);
  a.key({"elements", "", "finite elements; 0: chosen by the program"}, s.elements, element_count);
  a.table({"material", "", "of the segment", required}, s.material, material_keys, "Material");
}

void attachment_keys(Archive& a, RigidAttachment& r, double boom_length) {
  NumberOrWord position{r.position, "", false};
  a.key({"name", "", "letters, digits, `_` and `-`; names a marker and a node set", false, "none"}, r.name,
        name_if_any);
  a.choice_or_number({"position", "m", "distance from the root", required}, positions, position);
  const double length = boom_length > 0 ? boom_length : 0;  // a faulty one is reported where it stands
  if (a.reader()) r.position = position.word.empty() ? position.number : length;
  a.key({"mass", "kg", "of the attached body", required}, r.mass, not_negative);
  a.key({"inertia", "kg m^2", "about its mass centre, boom axes"}, r.inertia, semidefinite);
  a.key({"offset", "m", "of its mass centre from the boom, boom axes"}, r.offset, finite);
}

void damping_keys(Archive& a, DampingRule& d) {
  if (a.reader()) d = {};
  a.choice({"rule", "", "damping of the elastic coordinates", required}, damping_rules, d.name);
  const bool by_value = a.reader() && (d.name == "modal" || d.name == "loss-factor");
  a.key({"value", "", R"(of `"modal"` the damping ratio of every mode, of `"loss-factor"` twice that)", by_value},
        d.value, not_negative);
  a.key({"alpha", "1/s",
         "of `\"rayleigh\"`: damping alpha M + beta K of motions in the frame of the body, which its basis holds"},
        d.alpha, not_negative);
  a.key({"beta", "s", "of `\"rayleigh\"`"}, d.beta, not_negative);
}

void grading_keys(Archive& a, SolidGrading& g) {
  a.key({"sectors", "", "elements per quarter of a circle or shorter side", false, "chosen"}, g.sectors);
  a.key({"rings", "", "elements through the section or the wall", false, "chosen"}, g.rings);
  a.key({"long_elements", "", "elements along the boom, beside the graded ends", false, "chosen"}, g.long_elements);
  a.key({"end_layers", "", "layers that grow away from clamps and steps", false, "chosen"}, g.end_layers);
  a.key({"first_layer", "half depths", "thickness of the first of them", false, "chosen"}, g.first_layer);
  a.key({"growth", "", "ratio of one layer to the next", false, "chosen"}, g.growth);
  a.key({"corner_levels", "", "refinements toward the singular rims of clamps and steps", false, "chosen"},
        g.corner_levels);
  a.key({"factor", "", "ratio of one refinement to the next", false, "chosen"}, g.factor);
  a.key({"edge_levels", "",
         "cuts toward edges along the boom: inner ones of rectangular tubes, those of slits and long sides", false,
         "chosen"},
        g.edge_levels);
}

void solid_keys(Archive& a, SolidOptions& o) {
  a.key({"element", "",
         R"(`"hex"`, or `"hex8"`, `"hex8-reduced"`, `"hex20"`, `"hex20-reduced"`, `"hex27"`, `"tet4"`, `"tet10"`)"},
        o.element);
  a.key(
      {"accuracy", "",
       "relative error wanted in the frequencies, 1e-8 or more; a mesh left open starts by it, and `modes` refines it "
       "until it is met"},
      o.accuracy, mesh_accuracy);
  a.key({"order", "", "of `\"hex\"`, 1 to 8; 0: chosen"}, o.order);
  a.key({"slit", "m", "width of a slit along every tube, at +y, on the midline of the wall; 0: closed"}, o.slit);
  a.table({"grading", "", "Sizes of the elements."}, o.grading, grading_keys);
}

void prestress_keys(Archive& a, SteadyMotion& m) {
  a.key({"spin", "rad/s", "angular velocity of the body's frame, its axes"}, m.spin, finite);
  a.key({"acceleration", "m/s^2", "of its origin less gravity, axes of the body"}, m.acceleration, finite);
  std::vector<std::string> turns;
  for (const Eigen::Vector3d& axis : m.turns) turns.push_back(text_of_axis(axis));
  a.key({"turns", "",
         R"(axes about which the joint lets the root turn: `"x"`, `"y"`, `"z"` or `"X,Y,Z"` of a direction)"},
        turns);
  KeyReader* const reader = a.reader();
  if (reader == nullptr) return;
  m.turns.clear();
  for (const std::string& text : turns) {
    const auto axis = axis_of(text);
    if (axis)
      m.turns.push_back(*axis);
    else
      reader->table().fault("turns",
                            fmt::format(R"(has {}; an axis of the body is "x", "y", "z", or "X,Y,Z" of a direction)",
                                        toml_reader::in_quotes(text)));
  }
}

void basis_keys(Archive& a, BasisOptions& b) {
  a.choice({"basis", "", "shapes that stand for the deformation"}, basis_names, b.name);
  if (a.reader() && b.name == "craig-bampton" && b.interfaces.empty())
    b.interfaces = {"root", "tip"}, b.reference = "root";
  a.key(
      {"interfaces", "",
       "of `\"craig-bampton\"`: node sets with coordinates of their own; `\"tip:distributing\"` leaves a face free to "
       "deform",
       false, R"(`["root", "tip"]`)"},
      b.interfaces);
  a.key({"reference", "", "of `\"craig-bampton\"`: the interface that carries the frame", false, "`\"root\"`"},
        b.reference);
  a.key({"orthonormal", "", "of `\"craig-bampton\"`: whether the modes of the reduced body are the coordinates"},
        b.orthonormal);
  a.key({"hinge_stiffness", "N m/rad", "of `\"hinge\"`: number or array, the stiffness of each regime", false,
         "of the hinge that carries the body: its spring, and with its stop"},
        b.hinge_stiffness, stiffnesses);
  a.key({"hinge_axis", "", "of `\"hinge\"`: axis through the root", false, "that of the hinge"}, b.hinge_axis,
        some_direction);
  if (a.use() != Use::write || b.name == "prestressed")
    a.table({"prestress", "", R"(of `"prestressed"`: the motion that stiffens the body)", false,
             "that of the joints at rest"},
            b.motion, prestress_keys, "Prestress");
  a.key({"corrections", "", R"(static shapes of unit loads beside the modes: `"tip.Fy"`, `"root.Mz"`)"}, b.corrections);
}

/// What a scene may also say of a body whose geometry comes from a file.
void model_keys(Archive& a, BodyScene& b) {
  static const std::vector<std::string_view> backends = [] {
    std::vector<std::string_view> names = names_of(eigen_backends());
    names.emplace_back("auto");
    return names;
  }();
  a.choice({"structure", "", "model of the body"}, structures, b.structure);
  a.key({"clamp", "", R"(node set that is fixed: `"root"`, `"tip"` or the name of an attachment)"}, b.clamp);
  NumberOrWord modes{static_cast<double>(b.modes), b.modes_auto ? "auto" : "", true};
  a.choice_or_number({"modes", "", "number of modes, 0 to 10000", false, "`\"auto\"`"}, mode_words, modes, mode_count);
  if (a.use() != Use::write || !b.shapes.empty())
    a.key({"shapes", "", "which of the modes stand for the body, counted from 1", false, "all"}, b.shapes,
          shape_numbers);
  if (KeyReader* reader = a.reader()) {
    b.modes = static_cast<int>(modes.number), b.modes_auto = modes.word == "auto";
    b.modes_given = b.modes_given || reader->has("modes");
    b.directions_given = b.directions_given || reader->has("directions");
    b.basis_given = b.basis_given || reader->has("basis");
  }
  if (a.use() != Use::write || b.directions_given || !b.modes_auto)  // a plan has those that are not given
    a.choice({"directions", "", "modes that count, bending along y or all"}, directions, b.directions);
  basis_keys(a, b.basis);
  a.choice({"backend", "", "eigen-solver"}, backends, b.backend);
  a.table({"damping", "", "of the elastic coordinates", false, "none"}, b.damping, damping_keys, "Damping");
}

void geometry_keys(Archive& a, BodyScene& b) {
  BeamGeometry& g = b.geometry;
  NumberOrWord shear{g.shear.value, g.shear.name == "value" ? "" : g.shear.name, false};
  a.choice({"theory", "", "of the beams"}, theories, g.theory);
  a.choice_or_number({"shear", "", "shear coefficient"}, shear_rules, shear, shear_coefficient);
  if (a.reader()) g.shear = {shear.word.empty() ? "value" : shear.word, shear.word.empty() ? shear.number : 0};
  a.key({"rotary_inertia", "", "whether the sections have it"}, g.rotary_inertia);
  a.key({"order", "", "polynomial order of the beams, 1 to 12"}, g.order, order);
  a.table({"solid", "", "How `structure = \"solid\"` is meshed."}, b.solid, solid_keys);
  a.tables({"segments", "", "Straight pieces of the boom from the root to the tip; one at least."}, g.segments,
           segment_keys);
  const double length = a.reader() ? g.length() : 0;
  a.tables({"attachments", "", "Rigid bodies fixed to the boom."}, g.attachments,
           [length](Archive& below, RigidAttachment& r) { attachment_keys(below, r, length); });
  if (a.reader()) spell_sets(b);
}

void reduced_keys(Archive& a, BodyScene& b) {
  if (KeyReader* reader = a.reader()) reader->hint(" (of a reduced body)");
  std::string file = b.reduced_file.string();
  a.key({"file", "", "`.h5` file of `flexboom reduce`", required}, file);
  if (b.stiffening.empty()) b.stiffening = "auto";
  a.choice({"stiffening", "", "geometric stiffness"}, stiffenings, b.stiffening);
  a.table({"damping", "", "of the elastic coordinates", false, "the file's"}, b.other_damping, damping_keys, "Damping");
}

}  // namespace

void boom_keys(Archive& a, BodyScene& b) {
  a.key({"name", "", "part of the names of columns: letters, digits, `_` and `-`", required}, b.name, name);
  model_keys(a, b);
  geometry_keys(a, b);
}

void body_keys(Archive& a, BodyScene& b) {
  KeyReader* reader = a.reader();
  if (reader && reader->has("mass")) b.rigid.emplace(), b.structure = "rigid", b.modes = 0;
  if (reader && !b.rigid && reader->has("file")) read_file_of_body(reader->table(), reader->reading(), b);
  a.key({"name", "", "part of the names of columns: letters, digits, `_` and `-`", b.name.empty()}, b.name, name);
  if (b.rigid) {
    if (reader) reader->hint(" (of a rigid body)");
    return rigid_keys(a, *b.rigid);
  }
  if (b.reduced || !b.reduced_file.empty()) return reduced_keys(a, b);
  std::string file;
  if (a.use() == Use::document)
    a.key({"file", "", "body file with the geometry; the keys down to `damping` may stand beside it"}, file);
  if (a.use() == Use::read || a.use() == Use::document || !b.stiffening.empty())
    a.choice({"stiffening", "",
              "geometric stiffness, by itself where it would change more than the tolerance or both ends are held",
              false, "`\"auto\"`"},
             stiffenings, b.stiffening);
  model_keys(a, b);
  if (reader && !b.modes_given && b.structure != "rigid") b.modes_auto = true;
  if (reader && b.structure == "rigid" && reader->has("modes"))
    reader->reading().warnings.push_back(reader->table().path("modes") + ": has no effect with structure = \"rigid\"");
  if (reader && reader->has("file")) {
    spell_sets(b);
    return reader->hint(" (its geometry comes from the body file)");
  }
  geometry_keys(a, b);
}

}  // namespace flexboom
