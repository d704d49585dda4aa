// Checks of [[joints]], [[springs]], [[loads]], [[wheels]] and [[turns]].

#include "apps/scene/keys.hpp"
#include "apps/scene/scene.hpp"
#include "apps/scene/scene_checks.hpp"
#include "apps/scene/scene_keys.hpp"
#include "apps/scene/scene_law.hpp"
#include "dynamics/numerics/expression.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace flexboom {
namespace {

using namespace scene_checks;
using toml_reader::Faults;

/// Looks up what joints, forces and wheels refer to.
class TreeCheck {
 public:
  TreeCheck(const Scene& scene, Faults& faults) : scene_(scene), faults_(faults) {}

  void run() {
    if (scene_.joints.empty())
      faults_.add("joints", "has no joint; each body hangs on one, free ones on a joint of kind \"free\"");
    check_names();
    each("joints", scene_.joints, [this](const auto& path, const JointScene& j) { joint(path, j); });
    each("springs", scene_.springs, [this](const auto& path, const SpringScene& s) { spring(path, s); });
    each("loads", scene_.loads, [this](const auto& path, const LoadScene& l) { load(path, l); });
    each("wheels", scene_.wheels, [this](const auto& path, const WheelScene& w) { wheel(path, w); });
    each("turns", scene_.turns, [this](const auto& path, const TurnScene& t) { turn(path, t); });
    if (!scene_.turns.empty()) turning_body();
    if (faults_.clean("joints") && bodies_known()) topology();
  }

 private:
  template <class Items, class Check>
  void each(const char* what, const Items& items, Check check) {
    for (size_t i = 0; i < items.size(); ++i) check(fmt::format("{}[{}]", what, i), items[i]);
  }

  bool bodies_known() const {
    for (size_t i = 0; i < scene_.bodies.size(); ++i)
      if (!faults_.clean(fmt::format("bodies[{}].name", i))) return false;
    return !scene_.bodies.empty() || faults_.clean("bodies");
  }

  // A joint may have the name of the body it carries; its columns are others.
  void check_names() {
    const auto unique = [this](const char* what, const auto& items) {
      std::set<std::string> taken = {"energy", "lvlh"};
      each(what, items, [&](const std::string& path, const auto& item) {
        if (!taken.insert(item.name).second)
          faults_.add(path + ".name", fmt::format("{} is taken; choose another", toml_reader::in_quotes(item.name)));
      });
    };
    unique("joints", scene_.joints), unique("springs", scene_.springs), unique("loads", scene_.loads);
    unique("wheels", scene_.wheels);
  }

  const BodyScene* body_named(const std::string& path, const std::string& name, bool or_ground = false) {
    std::vector<std::string_view> names;
    for (const BodyScene& b : scene_.bodies) {
      if (b.name == name) return &b;
      names.push_back(b.name);
    }
    if (!bodies_known()) return nullptr;
    if (or_ground) names.push_back(scene_keys::ground);
    faults_.add(path, toml_reader::not_among(name, names));
    return nullptr;
  }

  /// The frame is fixed to the root. What bends away from it is no part of the frame.
  void point_of_the_frame(const std::string& path, const Eigen::Vector3d& point, const BodyScene& body) {
    constexpr double same = 1e-9;  // of the body's size
    if (body.is_boom() && point.x() > same * body.geometry.length())
      faults_.add(path, fmt::format("is {:g} m along the boom, and a point moves with the root alone; give a marker, "
                                    "\"{}\" or an attachment there",
                                    point.x(), fmt::join(marker_names(body), "\", \"")));
    if (!body.reduced) return;
    double size = 0;
    for (const Marker& m : body.reduced->markers) size = std::max(size, m.position.norm());
    for (const Marker& m : body.reduced->markers)
      if (!m.S.isZero(0) && (m.position - point).norm() <= same * size)
        faults_.add(path, fmt::format("is at marker {}, but a point moves with the frame alone; give the marker",
                                      toml_reader::in_quotes(m.name)));
  }

  void place(const std::string& path, const PlaceScene& p) {
    if (std::abs(p.x.dot(p.z)) > round_off && faults_.clean(path + ".z"))
      faults_.add(path + ".x", fmt::format("is not normal to z, [{}, {}, {}]; it must be", p.z.x(), p.z.y(), p.z.z()));
    if (p.body.empty()) {
      if (!p.marker.empty()) faults_.add(path + ".marker", "needs a body; the inertial frame has none, give a point");
      return;
    }
    const BodyScene* body = body_named(path + ".body", p.body, true);
    if (!body) return;
    if (p.marker.empty() && body->root_moves() && body->is_elastic())
      faults_.add(path + ".point",
                  "is a point of the frame, which no material of this body follows: its basis moves the root, too; "
                  "give a marker");
    else if (p.marker.empty() && body->is_elastic())
      point_of_the_frame(path + ".point", p.point, *body);
    if (p.marker.empty()) return;
    const std::vector<std::string> names = marker_names(*body);
    if (names.empty()) return faults_.add(path + ".marker", fmt::format("a rigid body has none; give a point"));
    check_name_among(faults_, path + ".marker", p.marker, std::vector<std::string_view>(names.begin(), names.end()));
  }

  /// Looked at from the start to the end. What has no value between two of these times, and grows towards none, stops
  /// the run there.
  void value_everywhere(const std::string& path, const std::function<double(double)>& value) {
    constexpr int looks = 1024;
    if (!(std::isfinite(scene_.duration) && scene_.duration > 0)) return;
    const double step = scene_.duration / looks;
    std::vector<double> size;
    for (int i = 0; i <= looks; ++i) {
      const double t = scene_.duration * i / looks, v = value(t);
      if (!std::isfinite(v))
        return faults_.add(path, fmt::format("is {} at t = {:g} s; it must have a finite value all through the run",
                                             std::isnan(v) ? "not a number" : "infinite", t));
      size.push_back(std::abs(v));
    }
    std::vector<size_t> peaks;
    for (size_t i = 1; i < looks; ++i)
      if (size[i] > 0 && size[i] >= size[i - 1] && size[i] >= size[i + 1]) peaks.push_back(i);
    constexpr size_t most_peaks = 8;  // the highest: a pole is one of them
    std::ranges::sort(peaks, std::greater(), [&](size_t i) { return size[i]; });
    peaks.resize(std::min(peaks.size(), most_peaks));
    for (const size_t i : peaks) {
      const double t = step * static_cast<double>(i);
      if (const std::optional<double> pole = pole_of(value, t - step, t + step))
        return faults_.add(path, fmt::format("grows without end near t = {:.9g} s; it must have a finite value all "
                                             "through the run",
                                             *pole));
    }
  }

  /// Does a function grow without an end toward a place, whatever it is there? The first look may have hit a pole,
  /// where round-off leaves a large number.
  static bool grows_toward(const std::function<double(double)>& value, double place, double width) {
    constexpr double far = 0x1p-16, near = 0x1p-32, of_a_pole = 100;  // a pole of order 1/2 grows by 256
    const auto beside = [&](double d) {
      return std::max(std::abs(value(place - d * width)), std::abs(value(place + d * width)));
    };
    return beside(near) > of_a_pole * beside(far);
  }

  /// Where a function has its largest value between two times, if that goes on growing however near one looks. A look
  /// that comes near to a pole by chance is the largest of the next ones, too. A fast sine that is zero at the first
  /// looks grows at the next ones, and then no more.
  static std::optional<double> pole_of(const std::function<double(double)>& value, double from, double to) {
    constexpr int zooms = 10, by_chance = 4, looks = 16;
    constexpr double of_a_peak = 1.5, of_a_pole = 100;
    const double width = to - from;
    double first = 0, later = 0, largest = 0, place = 0;
    for (int zoom = 0; zoom < zooms; ++zoom) {
      const double step = (to - from) / looks;
      for (int i = 0; i <= looks; ++i) {
        const double v = std::abs(value(from + i * step));
        if (!std::isfinite(v)) return from + i * step;
        if (v > largest) largest = v, place = from + i * step;
      }
      if (zoom == 0) first = largest;
      if (zoom == by_chance) {
        if (largest < of_a_peak * first) return grows_toward(value, place, width) ? std::optional(place) : std::nullopt;
        later = largest;
      }
      from = place - step, to = place + step;
    }
    return largest > of_a_pole * later ? std::optional(place) : std::nullopt;
  }

  void course(const std::string& path, const CourseScene& c) {
    if (!c.given()) return;
    try {
      value_everywhere(path, course_of(c, scene_.duration).function.value);
    } catch (const InputError& error) {
      faults_.add(path, error.what());
    }
  }

  void joint(const std::string& path, const JointScene& j) {
    const JointType& type = joint_type(j.kind);
    const bool scalar = type.scalars == 1;
    place(path + ".a", j.a);
    place(path + ".b", j.b);
    if (j.b.body.empty())
      faults_.add(path + ".b", "has no body; a is the place nearer to the inertial frame, b is on a body");
    const HingeMechanism& m = j.mechanism;
    const auto mechanism = [&](const char* key, double value) {
      if (value > 0 && !scalar)
        faults_.add(path + "." + key, fmt::format("a {} joint has none; hinges and sliders have", type.name));
    };
    mechanism("stiffness", m.stiffness), mechanism("damping", m.damping), mechanism("stop_stiffness", m.stop_stiffness);
    if (const HingeMechanism usual; m.threshold != usual.threshold && m.rest != usual.rest)
      mechanism("threshold", std::abs(m.threshold)), mechanism("rest", std::abs(m.rest));
    Joint with_law;
    with_law.kind = j.kind, with_law.mechanism = m, with_law.law = j.law;
    with_law.prescribed.resize(j.motion.size());
    check_law(faults_, path, with_law, !j.start.empty() ? j.start[0] : m.stiffness > 0 ? m.rest : 0);
    course(path + ".drive", j.drive);
    if (j.drive.given() && !scalar)
      faults_.add(path + ".drive", fmt::format("a {} joint has none; hinges and sliders have", type.name));
    motion(path, j, type);
    start(path, j, type);
    inertia(path, j, type);
    if (j.closes_loop) loop(path, j);
  }

  /// A rigid body on which nothing hangs needs inertia about each axis that its joint turns it about. What hangs on it
  /// is looked at when the scene is simulated.
  void inertia(const std::string& path, const JointScene& j, const JointType& type) {
    const auto body = std::ranges::find(scene_.bodies, j.b.body, &BodyScene::name);
    if (body == scene_.bodies.end() || !body->rigid || type.floats || j.closes_loop || !j.motion.empty() ||
        std::ranges::any_of(scene_.joints, [&](const JointScene& other) { return other.a.body == j.b.body; }) ||
        std::ranges::any_of(scene_.wheels, [&](const WheelScene& wheel) { return wheel.body == j.b.body; }))
      return;
    constexpr double too_little = 1e-12;
    const RigidScene& rigid = *body->rigid;
    if (!(rigid.mass > 0) || !rigid.inertia.allFinite()) return;  // a fault of its own
    const Eigen::Matrix3d J =
        rigid.inertia + centre_inertia(rigid.mass, Eigen::Vector3d(rigid.mass * (rigid.centre - j.b.point)));
    const Eigen::Matrix3d axes = j.b.axes();
    for (int k = 0; k < type.freedoms; ++k) {
      const Freedom freedom = type.freedom[static_cast<size_t>(k)];
      if (freedom < Freedom::turn_x) continue;
      const int column = freedom == Freedom::turn_x ? 0 : freedom == Freedom::turn_y ? 1 : 2;
      const double about = axes.col(column).dot(J * axes.col(column));
      if (about > too_little * J.trace()) continue;
      return faults_.add(path, fmt::format("turns body {} about an axis through its mass, where its inertia is {:.3g} "
                                           "kg m^2; give it inertia, or a place away from its mass centre",
                                           toml_reader::in_quotes(j.b.body), about));
    }
  }

  void loop(const std::string& path, const JointScene& j) {
    if (scene_.formulation != "multipliers")
      faults_.add(path + ".closes_loop", "is true: a loop needs [integrator] formulation = \"multipliers\"");
    if (j.a.body == j.b.body)
      faults_.add(path + ".b",
                  fmt::format("is on {} as a is; a joint is between two bodies", toml_reader::in_quotes(j.b.body)));
    const JointScene none;
    const bool starts = !j.start.empty() || !j.start_rate.empty() || j.start_attitude != none.start_attitude ||
                        !j.start_omega.isZero(0) || !j.start_position.isZero(0) || !j.start_velocity.isZero(0);
    if (starts)
      faults_.add(path + ".closes_loop", "is true, so the start of the joint follows from the others; drop its own");
  }

  /// A jump of the rate would need an impulse, which no integrator sees between two of its times. An acceleration
  /// without a bound would need steps without an end.
  void rate_without_jumps(const std::string& path, const CourseScene& c) {
    constexpr int looks = 1024;
    if (!c.given() || !(std::isfinite(scene_.duration) && scene_.duration > 0)) return;
    TimeCourse course;
    try {
      course = course_of(c, scene_.duration);
      if (!c.expression.empty()) course.corners = Expression(c.expression).corners(0, scene_.duration, looks);
    } catch (const InputError&) {
      return;  // a fault of its own
    }
    const double near = 1e-9 * scene_.duration;
    double largest = 0, fastest = 0;
    for (int i = 0; i <= looks; ++i) {
      const double t = scene_.duration * i / looks;
      largest = std::max(largest, std::abs(course.function.value(t)));
      fastest = std::max(fastest, std::abs(course.function.rate(t)));
    }
    for (const auto& [end, inside] : {std::pair(0.0, near), std::pair(scene_.duration, scene_.duration - near)}) {
      const double step = course.function.value(inside) - course.function.value(end);
      const double steepest = std::max(std::abs(course.function.rate(inside)), std::abs(course.function.rate(end)));
      if (std::abs(step) > 4 * near * steepest + 1e-9 * largest)
        return faults_.add(path,
                           fmt::format("jumps by {:.4g} at t = {:.6g} s; a joint cannot, it needs a ramp", step, end));
    }
    for (const double t : course.corners) {
      if (!(t > near && t < scene_.duration - near)) continue;
      const auto [before, after] = std::pair(course.function.rate(t - near), course.function.rate(t + near));
      const double step = course.function.value(t + near) - course.function.value(t - near);
      const double steepest = std::max(std::abs(before), std::abs(after));
      const double bent =
          std::max(std::abs(course.function.acceleration(t - near)), std::abs(course.function.acceleration(t + near)));
      if (std::abs(step) > 4 * near * steepest + 1e-9 * std::abs(course.function.value(t)))
        return faults_.add(path,
                           fmt::format("jumps by {:.4g} at t = {:.6g} s; a joint cannot, it needs a ramp", step, t));
      const auto grows = [&](double side) {  // without an end, toward the corner
        const double nearer = std::abs(course.function.acceleration(t + side / 16));
        return nearer > 2 * std::abs(course.function.acceleration(t + side)) && nearer * near > 1e-9 * fastest;
      };
      if (!std::isfinite(course.function.acceleration(t)) || grows(-near) || grows(near))
        return faults_.add(path,
                           fmt::format("has an acceleration without a bound at t = {:.6g} s, which takes as large "
                                       "a load; round the corner, or give a profile (\"smooth\")",
                                       t));
      if (std::abs(after - before) > 4 * near * bent + 1e-6 * fastest)
        return faults_.add(path, fmt::format("has a rate that jumps from {:.4g} to {:.4g} at t = {:.6g} s, which takes "
                                             "an impulse; round the corner, or give a profile (\"smooth\")",
                                             before, after, t));
    }
  }

  void motion(const std::string& path, const JointScene& j, const JointType& type) {
    for (const CourseScene& c : j.motion) {
      course(path + ".motion", c);
      rate_without_jumps(path + ".motion", c);
    }
    if (j.motion.empty()) return;
    if (type.scalars == 0)
      faults_.add(path + ".motion",
                  fmt::format("a {} joint cannot be given one; hinge, slider and universal can", type.name));
    else if (std::ssize(j.motion) != type.scalars)
      faults_.add(path + ".motion",
                  fmt::format("has {} functions; a {} joint needs {}", j.motion.size(), type.name, type.scalars));
    if (j.drive.given())
      faults_.add(path + ".drive", "is given beside motion, whose torque is an output; give one of them");
    if (j.mechanism.stop_stiffness > 0)
      faults_.add(path + ".stop_stiffness", "is given beside motion, which no stop can change; give one of them");
    if (!j.start.empty() || !j.start_rate.empty())
      faults_.add(path + (j.start.empty() ? ".start_rate" : ".start"),
                  "is given beside motion, which says it; give one of them");
  }

  void start(const std::string& path, const JointScene& j, const JointType& type) {
    const auto scalars = [&](const char* key, const std::vector<double>& v) {
      if (v.empty() || std::ssize(v) == type.scalars) return;
      faults_.add(path + "." + key,
                  type.scalars == 0
                      ? fmt::format("a {} joint has start_attitude and its like, if any", type.name)
                      : fmt::format("has {} numbers; a {} joint needs {}", v.size(), type.name, type.scalars));
    };
    scalars("start", j.start), scalars("start_rate", j.start_rate);
    const auto vector = [&](const char* key, const Eigen::Vector3d& v, bool has) {
      if (!has && !v.isZero(0)) faults_.add(path + "." + key, fmt::format("a {} joint has none", type.name));
    };
    vector("start_omega", j.start_omega, type.turns);
    vector("start_position", j.start_position, type.floats);
    vector("start_velocity", j.start_velocity, type.floats);
    if (!type.turns && j.start_attitude != Eigen::Vector4d(1, 0, 0, 0))
      faults_.add(path + ".start_attitude", fmt::format("a {} joint has none", type.name));
  }

  void spring(const std::string& path, const SpringScene& s) {
    place(path + ".a", s.a);
    place(path + ".b", s.b);
    const auto both_on = std::ranges::find(scene_.bodies, s.a.body, &BodyScene::name);
    const bool bends = both_on != scene_.bodies.end() && both_on->is_elastic();
    if (s.a.body == s.b.body && (!bends || s.a.marker == s.b.marker))
      faults_.add(path + ".b", "is fixed to a, so the spring never changes its length; choose another place");
  }

  void load(const std::string& path, const LoadScene& l) {
    place(path + ".at", l.at);
    if (l.at.body.empty()) faults_.add(path + ".at", "has no body to act on");
    for (const CourseScene& c : l.force) course(path + ".force", c);
    for (const CourseScene& c : l.torque) course(path + ".torque", c);
  }

  void wheel(const std::string& path, const WheelScene& w) {
    if (const BodyScene* body = body_named(path + ".body", w.body); body != nullptr && body->root_moves())
      faults_.add(path + ".body",
                  fmt::format("is {}, and a wheel is fixed to the frame, which no material of this body follows: its "
                              "basis moves the root, too; fix a rigid body to it that carries the wheel",
                              toml_reader::in_quotes(w.body)));
    course(path + ".torque", w.torque);
  }

  void turn(const std::string& path, const TurnScene& t) {
    if (t.body != scene_.turns.front().body)
      faults_.add(path + ".body", fmt::format("is not {}, the body of the first turn; all turns are of one body",
                                              toml_reader::in_quotes(scene_.turns.front().body)));
    if (faults_.clean(path)) try {
        rest_to_rest(t.manoeuvre);
      } catch (const InputError& error) {
        faults_.add(path, error.what());
      }
  }

  /// The torques of the wheels are those of a free body at rest with three wheels.
  void turning_body() {
    const std::string& body = scene_.turns.front().body;
    if (!body_named("turns[0].body", body)) return;
    std::vector<Eigen::Vector3d> axes;
    std::vector<std::string> moving;
    for (const WheelScene& w : scene_.wheels) {
      if (w.body == body && !w.torque.given()) axes.push_back(w.axis);
      if (w.spin != 0) moving.push_back(fmt::format("wheel \"{}\"", w.name));
    }
    if (axes.size() != 3 || std::abs(axes[0].cross(axes[1]).dot(axes[2])) < 0.1)
      faults_.add("turns[0].body", fmt::format("{} has {} wheels without a torque of their own; three are needed, with "
                                               "axes that span space",
                                               toml_reader::in_quotes(body), axes.size()));
    bool free = false;
    for (const JointScene& j : scene_.joints) {
      free = free || (j.kind == JointKind::free && j.a.body.empty() && j.b.body == body);
      if (!j.start_omega.isZero(0) || !j.start_velocity.isZero(0) ||
          std::ranges::any_of(j.start_rate, [](double v) { return v != 0; }))
        moving.push_back(fmt::format("joint \"{}\"", j.name));
    }
    if (!free)
      faults_.add("turns[0].body",
                  fmt::format("{} can not turn: it needs a joint of kind \"free\" to the inertial frame",
                              toml_reader::in_quotes(body)));
    if (std::ranges::any_of(scene_.joints, [](const JointScene& j) { return j.closes_loop; }))
      faults_.add("turns", "need a tree: with closed loops give the wheels their torques");
    if (!moving.empty())
      faults_.add("turns",
                  fmt::format("start from rest, but {} moves at t = 0: let it start without a rate, or drop the turns",
                              fmt::join(moving, ", ")));
  }

  /// Each body hangs on one joint, and following them leads to the inertial frame.
  void topology() {
    std::map<std::string, size_t> carrier;
    for (size_t i = 0; i < scene_.joints.size(); ++i) {
      const JointScene& j = scene_.joints[i];
      if (j.closes_loop) continue;
      const auto [first, only] = carrier.emplace(j.b.body, i);
      if (!only)
        faults_.add(
            fmt::format("joints[{}].b", i),
            fmt::format("body {} hangs on joint {} already: this one closes a loop; it may start from another "
                        "body, or say closes_loop = true",
                        toml_reader::in_quotes(j.b.body), toml_reader::in_quotes(scene_.joints[first->second].name)));
    }
    for (size_t i = 0; i < scene_.bodies.size(); ++i) {
      const std::string& name = scene_.bodies[i].name;
      if (!carrier.contains(name)) {
        faults_.add(fmt::format("bodies[{}]", i),
                    fmt::format("{} hangs on no joint; if it is free, give it one of kind \"free\"",
                                toml_reader::in_quotes(name)));
      } else if (!leads_home(name, carrier)) {
        faults_.add(fmt::format("joints[{}].a", carrier[name]),
                    fmt::format("body {} hangs on itself in a circle of joints; one of them must start from the "
                                "inertial frame",
                                toml_reader::in_quotes(name)));
      }
    }
  }

  bool leads_home(std::string name, const std::map<std::string, size_t>& carrier) const {
    for (size_t step = 0; step <= scene_.joints.size(); ++step) {
      if (name.empty()) return true;
      const auto joint = carrier.find(name);
      if (joint == carrier.end()) return true;  // reported elsewhere
      name = scene_.joints[joint->second].a.body;
    }
    return false;
  }

  const Scene& scene_;
  Faults& faults_;
};

}  // namespace

void check_tree(const Scene& scene, Faults& faults) { TreeCheck(scene, faults).run(); }

}  // namespace flexboom
