#include "apps/accuracy/motion_spectra.hpp"

#include "apps/accuracy/drive_spectra.hpp"
#include "apps/base/deflection.hpp"
#include "apps/scene/wanted_accuracy.hpp"
#include "apps/simulate/tree_flight.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <numbers>
#include <span>
#include <utility>

namespace flexboom {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// The largest |eigenvalue| of the equations at a row [rad/s]: how J^2 makes a vector grow.
double largest_vibration(const Tree& tree, const TreeTrajectory& motion, size_t row) {
  constexpr int before = 40, counted = 20;
  const VectorXd& y = motion.y[row];
  MatrixXd J(y.size(), y.size());
  tree.jacobian(motion.time[row], y.data(), closed_stops(tree, y), *tree.workspace(), J, motion.laws_at(row));
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
    other.derivative(t, y.data(), closed, *work, y_dot.data(), motion.laws_at(motion.y.size() - 1));
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
  const double shift = left > 0 ? std::min(beyond_a_tone, others / std::sqrt(left)) : beyond_a_tone;
  return {w / (is_joined ? beyond_a_tone : others), w * shift};
}

/// Are rates among the outputs that count?
bool wants_rates(const Scene& scene) {
  return scene.outputs.empty() || std::ranges::any_of(scene.outputs, [](const std::string& text) {
           return unit_of(wanted_output(text).name, {}).ends_with("/s");
         });
}

}  // namespace

double fastest_motion(const SimulatedMotion& run) {
  constexpr double square = 2;  // what turns at a rate shakes at twice that, too
  double fastest = square * largest_turn(*run.tree, run.motion);
  for (const size_t row : {size_t{0}, run.motion.y.size() - 1})
    fastest = std::max(fastest, largest_vibration(*run.tree, run.motion, row));
  return fastest;
}

MotionSpectra::MotionSpectra(const Scene& flown, const SimulatedMotion& run, double slowest, const RunHooks& hooks)
    : run_(run),
      fastest_(fastest_motion(run)),
      has_rates_(wants_rates(flown)),
      has_loads_(wants_loads(with_joints(flown))),
      record_(flown, run, hooks, fastest_, slowest, has_loads_) {}

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

MotionSpectra::Sizes MotionSpectra::sizes_of(const std::string& name) const {
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
  if (!has_rates_) r.speed = std::numeric_limits<double>::infinity();
  r.force = r.torque = std::numeric_limits<double>::infinity();
  if (!has_loads_) return r;
  const MotionRecord::Loads loads = record_.loads_of(name);
  if (loads.force > 0) r.force = loads.force, r.torque = loads.torque;
  return r;
}

std::vector<ShakenMode> MotionSpectra::shaken_beyond(const ReducedBody& all, double shown) const {
  constexpr double last = 0.75;
  const MotionRecord::Driven driven = record_.driven(all);
  if (driven.signals.empty()) return {};
  const Sizes sizes = sizes_of(all.name);
  const Deflection deflection(all);
  const double step = std::numbers::pi / (static_cast<double>(record_.samples()) * record_.step());
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
    const Peak peak = peak_of(spectra, record_.lasting(), shares_of(all, k, driven.markers),
                              bins(from, std::min(to, fastest_)), bins(from / wide, to * wide));
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
    if (!(w > last * highest && highest < beyond_a_tone * fastest_)) continue;
    const ShakenMode alike = shaken(k, highest / beyond_a_tone, fastest_);
    r.push_back({beyond_a_tone * alike.frequency, alike.effect});
  }
  return r;
}

}  // namespace flexboom
