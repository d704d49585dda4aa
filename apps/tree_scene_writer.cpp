// [[joints]], [[springs]], [[loads]], [[wheels]], [[turns]] as TOML.

#include "apps/scene.hpp"
#include "apps/scene_keys.hpp"
#include "apps/scene_law.hpp"
#include "apps/toml_writer.hpp"

namespace flexboom {
namespace {

using toml_writer::toml;
using toml_writer::Writer;

std::string place(const PlaceScene& p) {
  const std::string where = p.marker.empty() ? "point = " + toml(p.point) : "marker = " + toml(p.marker);
  return fmt::format("{{ body = {}, {}, x = {}, z = {} }}", toml(p.body.empty() ? scene_keys::ground : p.body), where,
                     toml(p.x), toml(p.z));
}

std::string course(const CourseScene& c) {
  if (c.manoeuvre)
    return fmt::format("{{ profile = {}, angle = {}, peak_rate = {}, peak_acceleration = {}, start = {} }}",
                       toml(c.manoeuvre->profile), toml(c.manoeuvre->angle), toml(c.manoeuvre->peak_rate),
                       toml(c.manoeuvre->peak_acceleration), toml(c.manoeuvre->start));
  if (c.table)
    return fmt::format("{{ interpolation = {}, outside = {}, time = {}, value = {} }}", toml(c.table->interpolation),
                       toml(c.table->outside), toml(c.table->time), toml(c.table->value));
  return toml(c.given() ? c.expression : std::string("0"));
}

std::string three(const std::array<CourseScene, 3>& c) {
  const auto one = [](const CourseScene& x) { return x.given() ? course(x) : std::string("0"); };
  return fmt::format("[{}, {}, {}]", one(c[0]), one(c[1]), one(c[2]));
}

void write_joint(Writer& out, const JointScene& j) {
  const JointType& type = joint_type(j.kind);
  out.table("[[joints]]");
  out.key("name", j.name);
  out.key("kind", type.name);
  out.raw("a", place(j.a));
  out.raw("b", place(j.b));
  if (type.scalars == 1) {
    out.key("stiffness", j.mechanism.stiffness);
    out.key("rest", j.mechanism.rest);
    out.key("damping", j.mechanism.damping);
    out.key("stop_stiffness", j.mechanism.stop_stiffness);
    out.key("threshold", j.mechanism.threshold);
  }
  write_law(out, j.law);
  if (j.drive.given()) out.raw("drive", course(j.drive));
  if (j.motion.size() == 1) out.raw("motion", course(j.motion[0]));
  if (j.motion.size() == 2) out.raw("motion", fmt::format("[{}, {}]", course(j.motion[0]), course(j.motion[1])));
  if (!j.start.empty()) out.raw("start", toml(j.start));
  if (!j.start_rate.empty()) out.raw("start_rate", toml(j.start_rate));
  if (type.turns) {
    const Eigen::Vector4d& a = j.start_attitude;
    out.raw("start_attitude", toml(std::vector{a[0], a[1], a[2], a[3]}));
    out.key("start_omega", j.start_omega, "rad/s");
  }
  if (type.floats) {
    out.key("start_position", j.start_position, "m");
    out.key("start_velocity", j.start_velocity, "m/s");
  }
  out.key("loads", j.loads);
  out.key("closes_loop", j.closes_loop);
}

}  // namespace

void write_tree(Writer& out, const Scene& scene) {
  for (const JointScene& j : scene.joints) write_joint(out, j);
  for (const SpringScene& s : scene.springs) {
    out.table("[[springs]]");
    out.key("name", s.name);
    out.raw("a", place(s.a));
    out.raw("b", place(s.b));
    out.key("stiffness", s.stiffness, "N/m");
    out.key("free_length", s.free_length, "m");
    out.key("damping", s.damping, "N s/m");
  }
  for (const LoadScene& l : scene.loads) {
    out.table("[[loads]]");
    out.key("name", l.name);
    out.raw("at", place(l.at));
    out.key("axes", scene_keys::load_axes[l.inertial_axes ? 1 : 0]);
    out.raw("force", three(l.force));
    out.raw("torque", three(l.torque));
  }
  for (const WheelScene& w : scene.wheels) {
    out.table("[[wheels]]");
    out.key("name", w.name);
    out.key("body", w.body);
    out.key("axis", w.axis);
    out.key("inertia", w.inertia, "kg m^2");
    out.key("spin", w.spin, "rad/s");
    if (w.torque.given()) out.raw("torque", course(w.torque));
  }
  for (const TurnScene& t : scene.turns) {
    out.table("[[turns]]");
    out.key("body", t.body);
    out.key("axis", t.axis);
    out.key("profile", t.manoeuvre.profile);
    out.key("angle", t.manoeuvre.angle, "rad");
    out.key("peak_rate", t.manoeuvre.peak_rate, "rad/s");
    out.key("peak_acceleration", t.manoeuvre.peak_acceleration, "rad/s^2");
    out.key("pause", t.pause, "s");
  }
}

}  // namespace flexboom
