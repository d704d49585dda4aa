// [[joints]], [[springs]], [[loads]], [[wheels]], [[turns]] as TOML.

#include "apps/keys.hpp"
#include "apps/scene.hpp"
#include "apps/scene_keys.hpp"
#include "apps/scene_law.hpp"
#include "apps/toml_writer.hpp"

namespace flexboom {

using toml_writer::toml;
using toml_writer::Writer;

std::string toml(const PlaceScene& p) {
  const std::string where = p.marker.empty() ? "point = " + toml(p.point) : "marker = " + toml(p.marker);
  return fmt::format("{{ body = {}, {}, x = {}, z = {} }}",
                     toml(p.body.empty() ? scene_keys::ground : std::string_view(p.body)), where, toml(p.x), toml(p.z));
}

std::string toml(const CourseScene& c) {
  if (c.manoeuvre)
    return fmt::format("{{ profile = {}, angle = {}, peak_rate = {}, peak_acceleration = {}, start = {} }}",
                       toml(c.manoeuvre->profile), toml(c.manoeuvre->angle), toml(c.manoeuvre->peak_rate),
                       toml(c.manoeuvre->peak_acceleration), toml(c.manoeuvre->start));
  if (c.table)
    return fmt::format("{{ interpolation = {}, outside = {}, time = {}, value = {} }}", toml(c.table->interpolation),
                       toml(c.table->outside), toml(c.table->time), toml(c.table->value));
  return toml(c.given() ? c.expression : std::string("0"));
}

std::string toml(const std::vector<CourseScene>& c) {
  return c.size() == 1 ? toml(c[0]) : fmt::format("[{}, {}]", toml(c.at(0)), toml(c.at(1)));
}

std::string toml(const std::array<CourseScene, 3>& c) {
  return fmt::format("[{}, {}, {}]", toml(c[0]), toml(c[1]), toml(c[2]));
}

void write_tree(Writer& out, const Scene& scene) {
  for (const JointScene& j : scene.joints) {
    out.table("[[joints]]");
    out.key("kind", joint_type(j.kind).name);
    write_keys(out, "", j, joint_keys);
    write_law(out, j.law);
  }
  for (const SpringScene& s : scene.springs) write_keys(out, "[[springs]]", s, spring_keys);
  for (const LoadScene& l : scene.loads) {
    write_keys(out, "[[loads]]", l, load_keys);
    out.key("axes", scene_keys::load_axes[l.inertial_axes ? 1 : 0]);
  }
  for (const WheelScene& w : scene.wheels) write_keys(out, "[[wheels]]", w, wheel_keys);
  for (const TurnScene& t : scene.turns) write_keys(out, "[[turns]]", t, turn_keys);
}

}  // namespace flexboom
