#include "apps/accuracy/motion_record.hpp"

#include "apps/accuracy/variants.hpp"
#include "apps/simulate/tree_flight.hpp"
#include "fem/base/check.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

namespace flexboom {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

/// A load on a body at one of its markers, inertial axes.
struct LoadAtMarker {
  Vector3d force = Vector3d::Zero(), torque = Vector3d::Zero();
};

/// One end of a joint or a spring that a body has at a marker.
struct End {
  const Place *here = nullptr, *there = nullptr;
  bool is_b = false;                     // of the two
  const SpringDamper* spring = nullptr;  // nullptr: it is that of a joint
  Index column = -1;                     // of the outputs, of the joint's force on b; -1: it has none
};

LoadAtMarker of_spring(const SpringDamper& s, const PlaceMotionInSpace& here, const PlaceMotionInSpace& there) {
  const Vector3d way = there.position - here.position;
  const double length = way.norm();
  if (!(length > 0)) return {};
  const Vector3d along = way / length;
  const double rate = along.dot(there.velocity - here.velocity);
  return {(s.stiffness * (length - s.free_length) + s.damping * rate) * along};
}

/// `load`: force and torque on b, its axes.
LoadAtMarker of_joint(const Vector6& load, const PlaceMotionInSpace& a, const PlaceMotionInSpace& b, bool is_b) {
  const Vector3d force = b.axes * load.head<3>(), torque = b.axes * load.tail<3>();
  if (is_b) return {force, torque};
  return {-force, -torque - (b.position - a.position).cross(force)};
}

/// Of the force of a joint on its place b, before that of its torque; -1: it has none.
Index column_of_load(const OutputTable& outputs, const std::string& joint) {
  const auto column = std::ranges::find(outputs.names, joint + ".force.x");
  return column == outputs.names.end() ? -1 : column - outputs.names.begin();
}

/// What is joined to a body where its modes move it.
std::vector<End> ends_on(int body, const ReducedBody& all, const Multibody& bodies, const OutputTable& outputs) {
  std::vector<End> ends;
  const auto moves = [&all](const Place& place) {
    const auto at = std::ranges::find(all.markers, place.marker, &Marker::name);
    return at != all.markers.end() && !(at->S.isZero(0) && at->S_theta.isZero(0));
  };
  const auto add = [&](const Place& a, const Place& b, const SpringDamper* spring, Index column) {
    if (a.body == body && moves(a)) ends.push_back({&a, &b, false, spring, column});
    if (b.body == body && moves(b)) ends.push_back({&b, &a, true, spring, column});
  };
  for (const Joint& j : bodies.joints) add(j.a, j.b, nullptr, column_of_load(outputs, j.name));
  for (const SpringDamper& s : bodies.springs) add(s.a, s.b, &s, -1);
  return ends;
}

/// Is something joined to what bends?
bool any_joined(const Scene& scene, const SimulatedMotion& run) {
  const Multibody bodies = make_multibody(scene, run.bodies);
  for (size_t b = 0; b < bodies.bodies.size(); ++b)
    if (!ends_on(static_cast<int>(b), bodies.bodies[b], bodies, {}).empty()) return true;
  return false;
}

/// When something may set tones off: a force has a corner or is largest, a stop is met, a law changes.
std::vector<double> beginnings(const Scene& scene, const SimulatedMotion& run) {
  IntegratorOptions o;
  o.duration = scene.duration;
  set_corners(scene, o);
  std::vector<double> times = std::move(o.corners);
  times.insert(times.end(), o.telling_times.begin(), o.telling_times.end());
  for (const StopEvent& e : run.motion.events) times.push_back(e.time);
  std::ranges::sort(times);
  return times;
}

/// So many of these times at most: those that come after the longest quiet.
std::vector<double> after_quiet(const std::vector<double>& times, size_t most) {
  std::vector<std::pair<double, double>> quiet;  // how long, and when it ended
  for (size_t i = 0; i < times.size(); ++i) quiet.emplace_back(times[i] - (i > 0 ? times[i - 1] : 0), times[i]);
  std::ranges::sort(quiet, std::greater<>());
  quiet.resize(std::min(quiet.size(), most));
  std::vector<double> r;
  for (const auto& [length, time] : quiet) r.push_back(time);
  return r;
}

/// Where rows of so many seconds begin: at the start, at those times, evenly between, and before the end.
std::vector<double> rows_at(const std::vector<double>& times, double length, double duration) {
  constexpr int evenly = 6;
  std::vector<double> at;
  const auto add = [&](double t) {
    const auto is_near = [&](double other) { return std::abs(other - t) <= length; };
    if (t + length < duration && std::ranges::none_of(at, is_near)) at.push_back(t);
  };
  add(0);
  std::ranges::for_each(times, add);
  add(duration - 1.01 * length);
  for (int i = 1; i < evenly; ++i) add(duration * i / evenly);
  std::ranges::sort(at);
  return at;
}

/// Of the frame of a body from one row to the next: acceleration and angular acceleration, its axes.
Vector6 acceleration(const PlaceMotionInSpace& before, const PlaceMotionInSpace& now, double step) {
  const Matrix3d to_body = (before.axes + now.axes).transpose() / 2;
  Vector6 a;
  a << to_body * (now.velocity - before.velocity),
      now.axes.transpose() * now.omega - before.axes.transpose() * before.omega;
  return a / step;
}

}  // namespace

int index_of(const Tree& tree, const std::string& body) {
  const auto& bodies = tree.scene().bodies;
  return static_cast<int>(std::ranges::find(bodies, body, &ReducedBody::name) - bodies.begin());
}

MotionRecord::MotionRecord(const Scene& flown, const SimulatedMotion& run, const RunHooks& given, double fastest,
                           double slowest, bool wants_loads)
    : scene_(with_joints(flown)) {
  constexpr double per_period = 4, periods = 12, few = 64, many = 4096;
  constexpr size_t most_beginnings = 6;
  scene_.verify = false;
  if (wants_loads || any_joined(scene_, run))
    for (JointScene& j : scene_.joints) j.loads = true;
  const double step = 2 * std::numbers::pi / (per_period * fastest), duration = scene_.duration;
  const double longest = std::max(std::floor(duration / step), few);
  samples_ = std::bit_floor(
      static_cast<size_t>(std::clamp(per_period * periods * fastest / slowest, few, std::min(many, longest))));
  RunHooks hooks = given;
  const double length = step * static_cast<double>(samples_);
  std::vector<double> at = rows_at(after_quiet(beginnings(scene_, run), most_beginnings), length, duration);
  if (!at.empty() && length * static_cast<double>(at.size()) < duration / 2)
    hooks.close_looks = {std::move(at), samples_ + 1, step};
  else
    scene_.output_step = std::min(step, duration / static_cast<double>(samples_));
  motion_ = fly_once(scene_, hooks, 0, bearable_steps(run));
  if (motion_.motion.summary.interrupted) throw NumericalError("interrupted");
  const std::vector<double>& times = motion_.motion.time;
  const size_t between = hooks.close_looks.at.empty() ? samples_ : samples_ + 1;
  for (size_t first = 0; first + samples_ < times.size(); first += between) windows_.push_back(first);
  for (size_t i = 0; i < windows_.size(); ++i)
    lasting_.push_back((i + 1 < windows_.size() ? times[windows_[i + 1]] : duration) - times[windows_[i]]);
  step_ = times[1] - times[0];
  add_accelerations();
}

void MotionRecord::add_accelerations() {
  const Tree& tree = *motion_.tree;
  std::vector<Place> origins(tree.scene().bodies.size());
  for (size_t b = 0; b < origins.size(); ++b) origins[b].body = static_cast<int>(b);
  accelerations_.resize(origins.size());
  const auto moved = [&](size_t row) { return tree.motions(motion_.motion.time[row], motion_.motion.y[row], origins); };
  for (const size_t first : windows_) {
    for (auto& of_body : accelerations_) of_body.emplace_back(static_cast<Index>(samples_), 6);
    std::vector<PlaceMotionInSpace> before = moved(first);
    for (size_t i = 0; i < samples_; ++i) {
      std::vector<PlaceMotionInSpace> now = moved(first + i + 1);
      const double step = motion_.motion.time[first + i + 1] - motion_.motion.time[first + i];
      for (size_t b = 0; b < origins.size(); ++b)
        accelerations_[b].back().row(static_cast<Index>(i)) = acceleration(before[b], now[b], step).transpose();
      before = std::move(now);
    }
  }
}

MotionRecord::Driven MotionRecord::driven(const ReducedBody& all) const {
  const int body = index_of(*motion_.tree, all.name);
  const Multibody bodies = make_multibody(scene_, motion_.bodies);
  const std::vector<End> ends = ends_on(body, all, bodies, motion_.outputs);
  std::vector<Place> places(1);  // the body, then here and there of each end
  places[0].body = body;
  Driven r;
  for (const End& end : ends) {
    if (std::ranges::find(r.markers, end.here->marker) == r.markers.end()) r.markers.push_back(end.here->marker);
    places.push_back(*end.here), places.push_back(*end.there);
  }
  const auto columns = static_cast<Index>(6 + 6 * r.markers.size());
  for (size_t w = 0; w < windows_.size(); ++w) {
    MatrixXd& signals = r.signals.emplace_back(MatrixXd::Zero(static_cast<Index>(samples_), columns));
    signals.leftCols<6>() = accelerations_[static_cast<size_t>(body)][w];
    for (Index i = 0; i < signals.rows() && !ends.empty(); ++i) {
      const size_t row = windows_[w] + static_cast<size_t>(i) + 1;
      const std::vector<PlaceMotionInSpace> now =
          motion_.tree->motions(motion_.motion.time[row], motion_.motion.y[row], places);
      for (size_t e = 0; e < ends.size(); ++e) {
        const End& end = ends[e];
        const PlaceMotionInSpace &here = now[1 + 2 * e], &there = now[2 + 2 * e];
        LoadAtMarker load;
        if (end.spring != nullptr)
          load = of_spring(*end.spring, here, there);
        else if (end.column >= 0)
          load = of_joint(motion_.outputs.values.row(static_cast<Index>(row)).segment<6>(end.column).transpose(),
                          end.is_b ? there : here, end.is_b ? here : there, end.is_b);
        const auto marker = std::ranges::find(r.markers, end.here->marker) - r.markers.begin();
        signals.row(i).segment<3>(6 + 6 * marker) += now[0].axes.transpose() * load.force;
        signals.row(i).segment<3>(9 + 6 * marker) += now[0].axes.transpose() * load.torque;
      }
    }
  }
  return r;
}

MotionRecord::Loads MotionRecord::loads_of(const std::string& body) const {
  Loads r;
  for (const JointScene& j : scene_.joints) {
    const Index column = column_of_load(motion_.outputs, j.name);
    if (j.b.body != body || j.closes_loop || column < 0) continue;
    r.force = motion_.outputs.values.middleCols<3>(column).rowwise().norm().maxCoeff();
    r.torque = motion_.outputs.values.middleCols<3>(column + 3).rowwise().norm().maxCoeff();
  }
  return r;
}

}  // namespace flexboom
