#include "apps/simulate/motion_spectra.hpp"

#include "apps/base/deflection.hpp"
#include "apps/scene/wanted_accuracy.hpp"
#include "apps/simulate/drives.hpp"
#include "apps/simulate/tree_flight.hpp"
#include "apps/simulate/variants.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <cstddef>
#include <functional>
#include <limits>
#include <numbers>
#include <span>
#include <utility>

namespace flexboom {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double near_a_mode = beyond_a_tone;

std::span<const LawBranch> laws_at_end(const TreeTrajectory& motion) {
  return motion.laws.empty() ? std::span<const LawBranch>() : std::span<const LawBranch>(motion.laws.back());
}

/// The largest |eigenvalue| of the equations at the last row [rad/s]: how J^2 makes a vector grow.
double largest_vibration(const Tree& tree, const TreeTrajectory& motion) {
  constexpr int before = 40, counted = 20;
  const VectorXd& y = motion.y.back();
  MatrixXd J(y.size(), y.size());
  tree.jacobian(motion.time.back(), y.data(), closed_stops(tree, y), *tree.workspace(), J, laws_at_end(motion));
  VectorXd x(y.size());
  for (Index i = 0; i < x.size(); ++i) x[i] = 1 + std::fmod(static_cast<double>(i) * std::numbers::phi, 1.0);
  double growth = 0;
  for (int i = 0; i < before + counted; ++i) {
    x = J * (J * (x / x.norm())).eval();
    if (!(x.norm() > 0)) return 0;
    if (i >= before) growth += std::log(x.norm());
  }
  return std::exp(growth / (2 * counted));
}

/// Of any joint [rad/s].
double largest_turn(const Tree& tree, const TreeTrajectory& motion) {
  double most = 0;
  TreeState now;
  for (const VectorXd& y : motion.y) {
    tree.unpack(y, now);
    for (size_t i = 0; i < now.joints.size(); ++i) {
      most = std::max(most, now.joints[i].omega.norm());
      if (tree.scene().joints[i].kind == JointKind::slider) continue;
      for (const double rate : now.joints[i].rate) most = std::max(most, std::abs(rate));
    }
  }
  return most;
}

/// How loads on the frame of a body change its acceleration, 6 x 6, BRF axes, at the last row: force and torque about
/// the BRF origin. What is joined to the body is in it.
Matrix6 mobility_at_end(const Tree& tree, const TreeTrajectory& motion, int body) {
  const double t = motion.time.back();
  const VectorXd& y = motion.y.back();
  int on = -1;  // which of the loads acts
  Load load;
  load.at.body = body;
  for (int i = 0; i < 6; ++i)
    (i < 3 ? load.force : load.torque)[static_cast<size_t>(i % 3)] = [&on, i](double) { return i == on ? 1.0 : 0.0; };
  Multibody loaded = tree.scene();
  loaded.loads.push_back(load);
  std::vector<Stiffening> stiffening;
  for (size_t b = 0; b < loaded.bodies.size(); ++b) stiffening.push_back(tree.stiffening(static_cast<int>(b)));
  const Tree other(std::move(loaded), stiffening);
  const TreeWorkspaceHandle work = other.workspace();
  const std::vector<char> closed = closed_stops(tree, y);
  const auto derivative = [&](int acting) {
    on = acting;
    VectorXd y_dot(y.size());
    other.derivative(t, y.data(), closed, *work, y_dot.data(), laws_at_end(motion));
    return y_dot;
  };
  // Velocities are linear in rates, so changes of accelerations are what velocities are of changes of rates.
  const TreeLayout& layout = other.layout();
  const auto velocity_of = [&](const VectorXd& change) {
    VectorXd state = y;
    state.segment(layout.p, layout.u) = change.segment(layout.p, layout.u);
    for (const TreeLayout::Joint& j : layout.joints)
      if (j.velocity >= 0) state.segment<3>(j.velocity) = change.segment<3>(j.velocity);
    const PlaceMotionInSpace of = other.motion(t, state, load.at);
    Vector6 v;
    v << of.axes.transpose() * of.velocity, of.axes.transpose() * of.omega;
    return v;
  };
  const VectorXd free = derivative(-1);
  const Vector6 at_rest = velocity_of(VectorXd::Zero(y.size()));
  Matrix6 Y;
  for (int i = 0; i < 6; ++i) Y.col(i) = velocity_of(derivative(i) - free) - at_rest;
  return Y;
}

/// Between which frequencies a mode of a body may vibrate: that of a held root, and that of one that gives way. What is
/// joined elsewhere may slow it.
std::pair<double, double> band_of(const ReducedBody& b, Index mode, const Matrix6& mobility, bool is_joined) {
  constexpr double others = 1.05;  // modes shift it, too
  const double w = b.frequency(mode);
  Vector6 p;
  p << b.Ct.col(mode), b.Cr0.col(mode);
  const double left = 1 - p.dot(mobility * p) / b.Me(mode, mode);  // of its mass
  const double shift = left > 0 ? std::min(near_a_mode, others / std::sqrt(left)) : near_a_mode;
  return {w / (is_joined ? near_a_mode : others), w * shift};
}

/// What the outputs wanted are.
struct Wanted {
  bool rates = false, loads = false;

  explicit Wanted(const Scene& scene) {
    for (const std::string& text : scene.outputs) {
      const std::string output = wanted_output(text).name;
      rates = rates || unit_of(output).ends_with("/s");
      loads = loads || is_load(output);
    }
    if (!scene.outputs.empty()) return;
    rates = true;
    loads = std::ranges::any_of(scene.joints, &JointScene::loads);
  }
};

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

int index_of(const Tree& tree, const std::string& body) {
  const auto& bodies = tree.scene().bodies;
  return static_cast<int>(std::ranges::find(bodies, body, &ReducedBody::name) - bodies.begin());
}

}  // namespace

double MotionSpectra::fastest() const {
  constexpr double square = 2;  // what turns at a rate shakes at twice that, too
  if (fastest_ < 0 && !run_.motion.y.empty())
    fastest_ = std::max(largest_vibration(*run_.tree, run_.motion), square * largest_turn(*run_.tree, run_.motion));
  return std::max(fastest_, 0.0);
}

namespace {

/// Are loads of joints needed? They are where the outputs want them, or where something is joined to what bends.
bool needs_loads(const Scene& scene, const SimulatedMotion& run) {
  if (Wanted(scene).loads) return true;
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

}  // namespace

const MotionSpectra::Record& MotionSpectra::record(double slowest) const {
  if (record_ && slowest >= record_->slowest) return *record_;
  constexpr double per_period = 4, periods = 12, few = 64, many = 4096;
  constexpr size_t most_beginnings = 6;
  Scene scene = with_joints(flown_);
  scene.verify = false;
  if (needs_loads(scene, run_))
    for (JointScene& j : scene.joints) j.loads = true;
  const double step = 2 * std::numbers::pi / (per_period * fastest());
  const double longest = std::max(std::floor(scene.duration / step), few);
  const double samples = std::clamp(per_period * periods * fastest() / slowest, few, std::min(many, longest));
  Record r;
  r.slowest = slowest;
  r.samples = std::bit_floor(static_cast<size_t>(samples));
  RunHooks hooks = hooks_;
  const double length = step * static_cast<double>(r.samples);
  std::vector<double> at = rows_at(after_quiet(beginnings(scene, run_), most_beginnings), length, scene.duration);
  if (length * static_cast<double>(at.size()) < scene.duration / 2) {
    hooks.close_looks = {std::move(at), r.samples + 1, step};
  } else {
    scene.output_step = std::min(step, scene.duration / static_cast<double>(r.samples));
  }
  r.motion = fly_once(scene, hooks, 0, bearable_steps(run_));
  const std::vector<double>& times = r.motion.motion.time;
  if (r.motion.motion.summary.interrupted) throw NumericalError("interrupted");
  const size_t between = hooks.close_looks.at.empty() ? r.samples : r.samples + 1;
  for (size_t first = 0; first + r.samples < times.size(); first += between) r.windows.push_back(first);
  for (size_t i = 0; i < r.windows.size(); ++i)
    r.lasting.push_back((i + 1 < r.windows.size() ? times[r.windows[i + 1]] : scene.duration) - times[r.windows[i]]);
  r.step = times[1] - times[0];
  r.add_accelerations();
  return record_.emplace(std::move(r));
}

namespace {

/// Of the frame of a body from one row to the next: acceleration and angular acceleration, its axes.
Vector6 acceleration(const PlaceMotionInSpace& before, const PlaceMotionInSpace& now, double step) {
  const Matrix3d to_body = (before.axes + now.axes).transpose() / 2;
  Vector6 a;
  a << to_body * (now.velocity - before.velocity),
      now.axes.transpose() * now.omega - before.axes.transpose() * before.omega;
  return a / step;
}

}  // namespace

void MotionSpectra::Record::add_accelerations() {
  const Tree& tree = *motion.tree;
  std::vector<Place> origins(tree.scene().bodies.size());
  for (size_t b = 0; b < origins.size(); ++b) origins[b].body = static_cast<int>(b);
  accelerations.resize(origins.size());
  const auto moved = [&](size_t row) { return tree.motions(motion.motion.time[row], motion.motion.y[row], origins); };
  for (const size_t first : windows) {
    for (auto& of_body : accelerations) of_body.emplace_back(static_cast<Index>(samples), 6);
    std::vector<PlaceMotionInSpace> before = moved(first);
    for (size_t i = 0; i < samples; ++i) {
      std::vector<PlaceMotionInSpace> now = moved(first + i + 1);
      for (size_t b = 0; b < origins.size(); ++b)
        accelerations[b].back().row(static_cast<Index>(i)) = acceleration(before[b], now[b], step).transpose();
      before = std::move(now);
    }
  }
}

MotionSpectra::Driven MotionSpectra::driven(const ReducedBody& all, const Record& record) const {
  const SimulatedMotion& motion = record.motion;
  const int body = index_of(*motion.tree, all.name);
  const Multibody bodies = make_multibody(with_joints(flown_), motion.bodies);
  const std::vector<End> ends = ends_on(body, all, bodies, motion.outputs);
  std::vector<Place> places(1);  // the body, then here and there of each end
  places[0].body = body;
  Driven r;
  for (const End& end : ends) {
    if (std::ranges::find(r.markers, end.here->marker) == r.markers.end()) r.markers.push_back(end.here->marker);
    places.push_back(*end.here), places.push_back(*end.there);
  }
  const auto columns = static_cast<Index>(6 + 6 * r.markers.size());
  for (size_t w = 0; w < record.windows.size(); ++w) {
    MatrixXd& signals = r.signals.emplace_back(MatrixXd::Zero(static_cast<Index>(record.samples), columns));
    signals.leftCols<6>() = record.accelerations[static_cast<size_t>(body)][w];
    for (Index i = 0; i < signals.rows() && !ends.empty(); ++i) {
      const size_t row = record.windows[w] + static_cast<size_t>(i) + 1;
      const std::vector<PlaceMotionInSpace> now =
          motion.tree->motions(motion.motion.time[row], motion.motion.y[row], places);
      for (size_t e = 0; e < ends.size(); ++e) {
        const End& end = ends[e];
        const PlaceMotionInSpace &here = now[1 + 2 * e], &there = now[2 + 2 * e];
        LoadAtMarker load;
        if (end.spring != nullptr)
          load = of_spring(*end.spring, here, there);
        else if (end.column >= 0)
          load = of_joint(motion.outputs.values.row(static_cast<Index>(row)).segment<6>(end.column).transpose(),
                          end.is_b ? there : here, end.is_b ? here : there, end.is_b);
        const auto marker = std::ranges::find(r.markers, end.here->marker) - r.markers.begin();
        signals.row(i).segment<3>(6 + 6 * marker) += now[0].axes.transpose() * load.force;
        signals.row(i).segment<3>(9 + 6 * marker) += now[0].axes.transpose() * load.torque;
      }
    }
  }
  return r;
}

namespace {

using Spectrum = std::vector<std::complex<double>>;

/// What drives a mode for each signal, by its modal mass.
RowVectorXd shares_of(const ReducedBody& b, Index mode, const std::vector<std::string>& markers) {
  RowVectorXd shares(6 + 6 * std::ssize(markers));
  shares << -b.Ct.col(mode).transpose(), -b.Cr0.col(mode).transpose(), RowVectorXd::Zero(6 * std::ssize(markers));
  for (size_t m = 0; m < markers.size(); ++m) {
    const Marker& at = marker(b, markers[m]);
    const auto column = static_cast<Index>(6 + 6 * m);
    shares.segment<3>(column) = at.S.col(mode).transpose();
    shares.segment<3>(column + 3) = at.S_theta.col(mode).transpose();
  }
  return shares / b.Me(mode, mode);
}

/// What stands out of a band of frequencies.
struct Peak {
  double largest = 0;   // of the windows
  double integral = 0;  // over time [s]
  bool stands_out = false;
  size_t bin = 0;
};

/// A range of bins.
struct Band {
  size_t first = 0, end = 0;
};

/// The largest amplitude in `band`. It stands out of what is around it. `spectra`: of each window and signal; a window
/// stands for some time [s].
Peak peak_of(const std::vector<std::vector<Spectrum>>& spectra, const std::vector<double>& lasting,
             const RowVectorXd& shares, Band band, Band around) {
  constexpr double far_above = 4;
  const auto height = [&](const std::vector<Spectrum>& window, size_t bin) {
    std::complex<double> sum = 0;
    for (size_t s = 0; s < window.size(); ++s) sum += shares[static_cast<Index>(s)] * window[s][bin];
    return std::abs(sum);
  };
  Peak peak;
  std::vector<double> integrals;
  for (size_t i = around.first; i < around.end; ++i) {
    double& sum = integrals.emplace_back(0);
    for (size_t w = 0; w < spectra.size(); ++w) sum += lasting[w] * height(spectra[w], i);
  }
  for (size_t i = 1; i + 1 < integrals.size(); ++i) {
    const size_t bin = around.first + i;
    const double here = integrals[i];
    const bool is_top = here >= integrals[i - 1] && here >= integrals[i + 1];  // no flank of one elsewhere
    if (is_top && bin >= band.first && bin < band.end && here > peak.integral) peak.integral = here, peak.bin = bin;
  }
  if (peak.integral == 0) return {};
  for (const std::vector<Spectrum>& window : spectra) peak.largest = std::max(peak.largest, height(window, peak.bin));
  const auto middle = integrals.begin() + std::ssize(integrals) / 2;
  std::ranges::nth_element(integrals, middle);
  peak.stands_out = peak.integral > far_above * *middle;
  return peak;
}

/// Of each signal: the amplitude of a tone. Hann's window keeps what is slow from leaking.
std::vector<Spectrum> windowed_spectra(const MatrixXd& signals) {
  const auto n = static_cast<double>(signals.rows());
  std::vector<Spectrum> spectra;
  for (Index s = 0; s < signals.cols(); ++s) {
    std::vector<double> values;
    for (Index i = 0; i < signals.rows(); ++i) {
      const double phase = 2 * std::numbers::pi * (static_cast<double>(i) + 0.5) / n;
      values.push_back(2 / n * (1 - std::cos(phase)) * signals(i, s));
    }
    spectra.push_back(spectral_sums(values));
  }
  return spectra;
}

}  // namespace

/// How far a body moves in a run, by its modes that are kept. Infinite: it is no concern of the outputs.
struct MotionSpectra::Sizes {
  double deflection = 0, speed = 0;  // of any of its points, in its frame [m], [m/s]
  double force = 0, torque = 0;      // of the joint that carries it
};

MotionSpectra::Sizes MotionSpectra::sizes_of(const std::string& name, const Record& record) const {
  constexpr double still = 1e-9;  // of its length: round-off
  Sizes r;
  const Tree& tree = *run_.tree;
  const auto body = static_cast<size_t>(index_of(tree, name));
  const ReducedBody& kept = tree.scene().bodies[body];
  if (kept.n() > 0) {
    const Deflection deflection(kept);
    const size_t stride = run_.motion.y.size() / static_cast<size_t>(most_deflections) + 1;
    const int q = tree.layout().q[body], q_dot = tree.layout().rate(q);
    for (size_t row = 0; row < run_.motion.y.size(); row += stride) {
      const VectorXd& y = run_.motion.y[row];
      r.deflection = std::max(r.deflection, deflection.largest(y.segment(q, kept.n())));
      r.speed = std::max(r.speed, deflection.largest(y.segment(q_dot, kept.n())));
    }
    r.deflection = std::max(r.deflection, still * deflection.length());
  }
  const Wanted wanted(with_joints(flown_));
  if (!wanted.rates) r.speed = std::numeric_limits<double>::infinity();
  r.force = r.torque = std::numeric_limits<double>::infinity();
  if (!wanted.loads) return r;
  const OutputTable& outputs = record.motion.outputs;
  for (const JointScene& j : with_joints(flown_).joints) {
    if (j.b.body != name || j.closes_loop) continue;
    const Index column = column_of_load(outputs, j.name);
    if (column < 0) continue;
    r.force = outputs.values.middleCols<3>(column).rowwise().norm().maxCoeff();
    r.torque = outputs.values.middleCols<3>(column + 3).rowwise().norm().maxCoeff();
  }
  return r;
}

std::vector<ShakenMode> MotionSpectra::shaken_beyond(const ReducedBody& all, double shown) const {
  constexpr double last = 0.75;
  const double slowest = shown / near_a_mode;
  if (!(fastest() > slowest)) return {};
  const Record& record = this->record(slowest);
  const Driven driven = this->driven(all, record);
  const Sizes sizes = sizes_of(all.name, record);
  const Deflection deflection(all);
  const double step = std::numbers::pi / (static_cast<double>(record.samples) * record.step);
  std::vector<std::vector<Spectrum>> spectra;
  for (const MatrixXd& window : driven.signals) spectra.push_back(windowed_spectra(window));
  const auto bins = [&](double from, double to) -> Band {
    constexpr double round_off = 1;
    const auto end = std::ssize(spectra[0][0]) - 1;
    const auto bin = [&](double w) { return std::clamp<std::ptrdiff_t>(std::lround(w), 1, end); };
    return {static_cast<size_t>(bin(from / step - round_off)), static_cast<size_t>(bin(to / step + round_off)) + 1};
  };
  /// What the motion does in a band to a mode like k, and at which frequency.
  const auto shaken = [&](Index k, double from, double to) -> ShakenMode {
    constexpr double wide = 2;
    const Peak peak = peak_of(spectra, record.lasting, shares_of(all, k, driven.markers),
                              bins(from, std::min(to, fastest())), bins(from / wide, to * wide));
    if (!peak.stands_out) return {};
    const double zeta = all.De(k, k) / (2 * all.Me(k, k) * all.frequency(k)), w = step * static_cast<double>(peak.bin);
    VectorXd q = VectorXd::Zero(all.n());
    q[k] = std::min(peak.largest / (2 * zeta * w), peak.integral / 2) / w;  // or as it builds up
    const double way = deflection.largest(q), load = q[k] * w * w;
    const double effect =
        std::max({way / sizes.deflection, way * w / sizes.speed, load * all.Ct.col(k).norm() / sizes.force,
                  load * all.Cr0.col(k).norm() / sizes.torque});
    return {w, effect};
  };
  const Matrix6 mobility = mobility_at_end(*run_.tree, run_.motion, index_of(*run_.tree, all.name));
  std::vector<Index> modes;
  for (Index k = 0; k < all.n(); ++k)
    if (all.coordinates[static_cast<size_t>(k)].kind != "attachment" && all.frequency(k) > 0) modes.push_back(k);
  std::vector<ShakenMode> r;
  double highest = 0;
  for (const Index k : modes) highest = std::max(highest, all.frequency(k));
  for (const Index k : modes) {
    const double w = all.frequency(k);
    const auto [from, to] = band_of(all, k, mobility, !driven.markers.empty());
    if (w > shown) r.push_back({w, shaken(k, from, to).effect});
    if (!(w > last * highest && highest < near_a_mode * fastest())) continue;
    const ShakenMode alike = shaken(k, highest / near_a_mode, fastest());
    r.push_back({near_a_mode * alike.frequency, alike.effect});
  }
  return r;
}

}  // namespace flexboom
