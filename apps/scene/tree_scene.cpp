#include "apps/scene/tree_scene.hpp"

#include "apps/base/deflection.hpp"
#include "apps/scene/scene.hpp"
#include "apps/scene/scene_keys.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>

namespace flexboom {

TimeCourse course_of(const CourseScene& course, double duration) {
  if (course.manoeuvre) return rest_to_rest(*course.manoeuvre);
  if (!course.table) return time_expression(course.expression);
  TimeCourse r = time_table(*course.table);
  require(r.begin <= 0 && r.end >= duration,
          fmt::format(
              "the table reaches from {:g} s to {:g} s, the simulation from 0 to {:g} s; give more times, or outside "
              "= \"hold\"",
              r.begin, r.end, duration));
  // An integrator may ask a little beyond the end.
  const auto within = [begin = r.begin, end = r.end](std::function<double(double)> f) {
    return [begin, end, f = std::move(f)](double t) { return f(std::clamp(t, begin, end)); };
  };
  r.function = {within(r.function.value), within(r.function.rate), within(r.function.acceleration)};
  return r;
}

std::vector<WheelTurn> turns_of(const std::vector<TurnScene>& turns) {
  std::vector<WheelTurn> r;
  double end = 0;
  for (const TurnScene& t : turns) {
    r.push_back({t.axis, t.manoeuvre});
    r.back().manoeuvre.start = end + t.pause;
    end = rest_to_rest(r.back().manoeuvre).corners.back();
  }
  return r;
}

Eigen::Matrix3d PlaceScene::axes() const {
  Eigen::Matrix3d A;
  A << x, z.cross(x), z;
  return A;
}

bool BodyScene::is_elastic() const {
  if (reduced) return reduced->n() > 0;
  return is_flexible() && (modes > 0 || modes_auto);
}

bool BodyScene::root_moves() const {
  if (reduced) return reduced->frame == "mean-axis";
  if (!is_elastic()) return false;
  return basis.name == "mean-axis" || (basis.name == "craig-bampton" ? basis.reference != "root" : clamp != "root");
}

std::vector<std::string> marker_names(const BodyScene& body) {
  if (body.rigid) return {};
  std::vector<std::string> names;
  if (body.reduced) {
    for (const Marker& m : body.reduced->markers) names.push_back(m.name);
    return names;
  }
  names = {"root", "tip"};
  for (const RigidAttachment& a : body.geometry.attachments)
    if (!a.name.empty()) names.push_back(a.name);
  return names;
}

ScalarOutputs scalar_outputs(JointKind kind) {
  static constexpr std::array<std::string_view, 1> angle = {".angle"}, length = {".length"}, rate = {".rate"};
  static constexpr std::array<std::string_view, 2> angles = {".angle1", ".angle2"}, rates = {".rate1", ".rate2"};
  if (kind == JointKind::hinge) return {angle, rate};
  if (kind == JointKind::slider) return {length, rate};
  if (kind == JointKind::universal) return {angles, rates};
  return {};
}

std::vector<std::string> outputs_of(const Scene& scene) {
  std::vector<std::string> names;
  for (const JointScene& joint : scene.joints) {
    const auto add = [&](std::string_view what) { names.push_back(fmt::format("{}{}", joint.name, what)); };
    for (const std::string_view what : scalar_outputs(joint.kind).values) add(what);
    for (const std::string_view what : scalar_outputs(joint.kind).rates) add(what);
    if (joint_type(joint.kind).turns) add(".rotation"), add(".rate");
    if (joint_type(joint.kind).floats) add(".position"), add(".velocity");
    if (joint.loads) add(".force"), add(".torque");
    if (joint.loads && joint.motion.size() == 1) add(".drive");
    for (size_t i = 1; joint.loads && joint.motion.size() > 1 && i <= joint.motion.size(); ++i)
      names.push_back(fmt::format("{}.drive{}", joint.name, i));
  }
  for (const BodyScene& body : scene.bodies) {
    if (!body.is_elastic()) continue;
    names.push_back(body.name + ".q");
    if (!body.reduced || tip_of(*body.reduced)) names.push_back(body.name + ".tip");
  }
  for (const WheelScene& wheel : scene.wheels) names.push_back(wheel.name + ".spin");
  if (!scene.turns.empty()) names.push_back(scene.turns.front().body + ".pointing");
  if (scene.orbit && first_that_flies(scene) < scene.joints.size())
    for (const char* angle : {"lvlh.roll", "lvlh.pitch", "lvlh.yaw"}) names.emplace_back(angle);
  return names;
}

size_t first_that_flies(const Scene& scene) {
  const auto flies = [](const JointScene& j) { return j.kind == JointKind::free && j.a.body.empty(); };
  return static_cast<size_t>(std::ranges::find_if(scene.joints, flies) - scene.joints.begin());
}

}  // namespace flexboom
