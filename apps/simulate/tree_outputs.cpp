// Outputs of a scene: columns of trajectory.csv, lines of the plan.

#include "apps/base/deflection.hpp"
#include "apps/scene/scene_keys.hpp"
#include "apps/scene/scene_orbit.hpp"
#include "apps/simulate/tree_flight.hpp"
#include "dynamics/numerics/rotation.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace flexboom {

using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/// Puts values under their names, row by row: the first row says what the columns are. A name has an owner and what it
/// is of it, so that no text is made for the rows behind the first.
class Columns {
 public:
  explicit Columns(Eigen::Index rows) : rows_(rows) {}

  void put(std::string_view owner, std::string_view what, double value) { put_part(owner, what, "", value); }
  void put(std::string_view owner, std::string_view what, const Vector3d& v) {
    put_part(owner, what, ".x", v.x()), put_part(owner, what, ".y", v.y()), put_part(owner, what, ".z", v.z());
  }
  /// The elements of a vector, counted from 1.
  void put_numbered(std::string_view owner, std::string_view what, const Eigen::Ref<const VectorXd>& v) {
    for (Eigen::Index i = 0; i < v.size(); ++i)
      put_part(owner, what, row_ == 0 ? std::to_string(i + 1) : std::string(), v[i]);
  }
  void end_row() {
    if (row_ == 0) {
      by_row_.resize(std::ssize(first_), rows_);
      by_row_.col(0) = Eigen::Map<const VectorXd>(first_.data(), std::ssize(first_));
    }
    next_ = ++row_ < rows_ ? by_row_.col(row_).data() : nullptr;
  }
  OutputTable table() && { return {std::move(names_), by_row_.transpose()}; }

 private:
  void put_part(std::string_view owner, std::string_view what, std::string_view part, double value) {
    if (row_ > 0) {
      *next_++ = value;
      return;
    }
    names_.push_back(fmt::format("{}{}{}", owner, what, part));
    first_.push_back(value);
  }

  std::vector<std::string> names_;
  std::vector<double> first_;  // row
  Eigen::MatrixXd by_row_;     // a column for each
  Eigen::Index rows_, row_ = 0;
  double* next_ = nullptr;  // value of the row
};

/// `centre`: where the scene has the mass centre, which flies along the orbit.
void put_joint(Columns& out, const JointScene& joint, const JointState& s, const Vector3d& centre) {
  const std::string& name = joint.name;
  const ScalarOutputs scalars = scalar_outputs(joint.kind);
  for (size_t i = 0; i < scalars.values.size(); ++i) out.put(name, scalars.values[i], s.coordinate[i]);
  for (size_t i = 0; i < scalars.rates.size(); ++i) out.put(name, scalars.rates[i], s.rate[i]);
  if (joint_type(joint.kind).turns)
    out.put(name, ".rotation", rotation_vector(s.attitude)), out.put(name, ".rate", s.omega);
  if (!joint_type(joint.kind).floats) return;
  Vector3d position = s.position;
  if (joint.a.body.empty()) position += joint.a.axes().transpose() * centre;
  out.put(name, ".position", position), out.put(name, ".velocity", s.velocity);
}

/// `tip`: none where the body has none.
void put_body(Columns& out, const std::string& name, const std::optional<MarkerDisplacement>& tip, const VectorXd& q) {
  out.put_numbered(name, ".q", q);
  if (tip) out.put(name, ".tip", (*tip)(q));
}

/// `drive`: of its motor, which pushes as two loads do.
void put_load(Columns& out, const JointScene& joint, JointLoad load, double drive) {
  (joint.kind == JointKind::hinge ? load.torque : load.force).z() += drive;
  out.put(joint.name, ".force", load.force), out.put(joint.name, ".torque", load.torque);
  if (load.drive.size() == 1) out.put(joint.name, ".drive", load.drive[0]);
  if (load.drive.size() > 1)
    out.put_numbered(joint.name, ".drive", Eigen::Map<const VectorXd>(load.drive.data(), std::ssize(load.drive)));
}

/// Of the body on a free joint, BRF -> inertial.
Eigen::Vector4d attitude_of(const JointScene& joint, const JointState& s) {
  const Eigen::Quaterniond turn(
      Eigen::Matrix3d(joint.a.axes() * rotation_matrix(s.attitude) * joint.b.axes().transpose()));
  return {turn.w(), turn.x(), turn.y(), turn.z()};
}

/// Rotation vectors of the body that turns from the attitudes that the turns command, its own axes [rad].
class Pointing {
 public:
  explicit Pointing(const Scene& scene) : turns_(turns_of(scene.turns)) {
    if (turns_.empty()) return;
    name_ = scene.turns.front().body;
    const auto carrier = std::ranges::find(scene.joints, name_, [](const JointScene& j) { return j.b.body; });
    joint_ = static_cast<size_t>(carrier - scene.joints.begin());
    from_place_ = carrier->b.axes();
    start_ = rotation_matrix(carrier->start_attitude);
  }

  void put(Columns& out, double t, const TreeState& s) const {
    if (turns_.empty()) return;
    const Eigen::Matrix3d now = start_.transpose() * rotation_matrix(s.joints[joint_].attitude);
    const Eigen::Quaterniond error(Eigen::Matrix3d(rotation_matrix(commanded_attitude(turns_, t)).transpose() *
                                                   from_place_ * now * from_place_.transpose()));
    out.put(name_, ".pointing", rotation_vector({error.w(), error.x(), error.y(), error.z()}));
  }

 private:
  std::vector<WheelTurn> turns_;
  std::string name_;
  size_t joint_ = 0;
  Eigen::Matrix3d from_place_, start_;  // place b -> body; place b -> place a at the start
};

}  // namespace

OutputTable output_table(const Scene& scene, const Tree& tree, size_t rows,
                         const std::function<void(size_t row, Moment&)>& moment) {
  Columns out(static_cast<Eigen::Index>(rows));
  const Pointing pointing(scene);
  Vector3d centre = Vector3d::Zero();
  if (tree.scene().field) centre = mass_centre(tree, start_state(without_loops(scene), tree));
  std::vector<std::optional<MarkerDisplacement>> tips(tree.scene().bodies.size());
  for (size_t b = 0; b < tips.size(); ++b)
    if (const ReducedBody& body = tree.scene().bodies[b]; const Marker* tip = body.n() > 0 ? tip_of(body) : nullptr)
      tips[b].emplace(body, *tip);
  std::vector<std::function<double(double)>> drives;  // of joints; empty: none
  for (const JointScene& j : scene.joints)
    drives.push_back(j.drive.given() ? course_of(j.drive, scene.duration).function.value : nullptr);
  const size_t flying = first_that_flies(scene);
  std::optional<Orbit> orbit;
  if (scene.orbit && flying < scene.joints.size()) orbit = orbit_of(scene);
  Moment now;
  const TreeState& s = now.state;
  for (size_t row = 0; row < rows; ++row) {
    moment(row, now);
    out.put("t", "", now.time);
    for (size_t i = 0; i < scene.joints.size(); ++i) {
      put_joint(out, scene.joints[i], s.joints[i], centre);
      if (scene.joints[i].loads) put_load(out, scene.joints[i], now.loads[i], drives[i] ? drives[i](now.time) : 0);
    }
    for (size_t b = 0; b < scene.bodies.size(); ++b) put_body(out, scene.bodies[b].name, tips[b], s.q[b]);
    for (size_t w = 0; w < scene.wheels.size(); ++w) out.put(scene.wheels[w].name, ".spin", s.spin[w]);
    pointing.put(out, now.time, s);
    if (orbit) {
      const Vector3d angles = lvlh_angles(attitude_of(scene.joints[flying], s.joints[flying]), *orbit, now.time);
      out.put("lvlh", ".roll", angles.x()), out.put("lvlh", ".pitch", angles.y()), out.put("lvlh", ".yaw", angles.z());
    }
    const Balance& e = now.balance;
    out.put("energy", ".kinetic", e.kinetic), out.put("energy", ".elastic", e.elastic);
    out.put("energy", ".potential", e.potential), out.put("energy", ".dissipated", e.dissipated);
    out.put("energy", ".work", e.work);
    out.end_row();
  }
  return std::move(out).table();
}

OutputTable output_table(const Scene& scene, const Tree& tree, const TreeTrajectory& motion) {
  const bool loads = std::any_of(scene.joints.begin(), scene.joints.end(), [](const JointScene& j) { return j.loads; });
  const TreeWorkspaceHandle work = tree.workspace();
  return output_table(scene, tree, motion.time.size(), [&](size_t row, Moment& now) {
    const VectorXd& y = motion.y[row];
    now.time = motion.time[row], now.balance = motion.balance[row];
    tree.unpack(y, now.state);
    if (loads) now.loads = tree.joint_loads(now.time, y, closed_stops(tree, y), *work, motion.laws_at(row));
  });
}

void describe_model(const Scene& scene, const Run& run, std::vector<std::string>& plan) {
  for (size_t i = 0; i < scene.bodies.size(); ++i) {
    const BodyScene& b = scene.bodies[i];
    if (b.rigid) plan.push_back(fmt::format("{}: rigid, {:g} kg", b.name, b.rigid->mass));
    if (b.reduced)
      plan.push_back(fmt::format("{}: reduced body of {}, {} coordinates{}", b.name, b.reduced_file.string(),
                                 run.bodies[i].body.n(),
                                 b.richer && b.richer->more_modes ? "" : "; its own truncation is not measured"));
    if (run.bodies[i].body.n() == 0) continue;
    if (!tip_of(run.bodies[i].body))
      plan.push_back(fmt::format("{0}: no output {0}.tip: {1}", b.name, no_tip(run.bodies[i].body)));
    const bool known = !run.bodies[i].body.Kg.spin.empty();
    const bool on = run.tree->stiffening(static_cast<int>(i)) == Stiffening::on;
    const double effect = known ? run.motion.stiffening_effect[i].size : 0;
    plan.push_back(known ? fmt::format("{}: geometric stiffness {} (stiffening = \"{}\"): its effect {}", b.name,
                                       on ? "on" : "off", b.stiffening,
                                       std::isnan(effect)
                                           ? "is not known"
                                           : fmt::format("reaches {:.2g} of the stiffness of the body", effect))
                         : fmt::format("{}: geometric stiffness is not in the equations{}", b.name,
                                       b.reduced               ? ": it is not in the file"
                                       : b.structure == "eq14" ? ": structure \"eq14\" has none"
                                                               : ""));
  }
  for (const JointScene& j : scene.joints)
    plan.push_back(fmt::format("joint {}: {}, {} on {}{}{}", j.name, joint_type(j.kind).name, j.b.body,
                               j.a.body.empty() ? "the inertial frame" : j.a.body,
                               j.motion.empty() ? "" : ", motion prescribed", j.closes_loop ? ", closes a loop" : ""));
  for (const WheelTurn& t : turns_of(scene.turns))
    plan.push_back(fmt::format("{} turns by {:g} rad about ({:g}, {:g}, {:g}), {}, from {:g} s to {:g} s",
                               scene.turns.front().body, t.manoeuvre.angle, t.axis.x(), t.axis.y(), t.axis.z(),
                               t.manoeuvre.profile, t.manoeuvre.start, rest_to_rest(t.manoeuvre).corners.back()));
  plan.insert(plan.end(), run.notes.begin(), run.notes.end());
}

}  // namespace flexboom
