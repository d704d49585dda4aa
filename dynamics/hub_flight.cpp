// Trees that are a hub with hinged booms, flown by the equations of that kind.

#include "dynamics/hub_flight.hpp"

#include "fem/check.hpp"

#include <algorithm>
#include <utility>

namespace flexboom {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

/// Is it the body's own frame?
bool is_origin(const Place& p) { return p.marker.empty() && p.position.isZero(0) && p.axes.isIdentity(0); }

bool is_flight(const Joint& j) {
  return j.kind == JointKind::free && j.a.body < 0 && is_origin(j.a) && is_origin(j.b) && j.prescribed.empty();
}

/// The hinge of a boom on the hub, `hub` being its number, -1 where it is the inertial frame.
bool is_boom_hinge(const Joint& j, int hub) {
  const HingeMechanism& m = j.mechanism;
  const HingeMechanism plain = {.stiffness = m.stiffness,
                                .rest = m.rest,
                                .damping = m.damping,
                                .stop_stiffness = m.stop_stiffness,
                                .threshold = m.threshold};
  return j.kind == JointKind::hinge && j.a.body == hub && j.a.marker.empty() && is_origin(j.b) &&
         j.prescribed.empty() && !j.law.given() && m == plain;
}

bool is_hub_with_booms(const Tree& tree, int flight, int hub) {
  const Multibody& m = tree.scene();
  if (!m.springs.empty() || !m.loads.empty() || !m.wheels.empty() || !m.gravity.isZero(0)) return false;
  if (hub < 0 ? m.field.has_value() : m.bodies[static_cast<size_t>(hub)].n() > 0) return false;
  for (size_t i = 0; i < m.joints.size(); ++i)
    if (static_cast<int>(i) != flight && !is_boom_hinge(m.joints[i], hub)) return false;
  for (size_t b = 0; b < m.bodies.size(); ++b)
    if (tree.stiffening(static_cast<int>(b)) == Stiffening::on) return false;
  return true;
}

Appendage appendage_of(const Multibody& m, const Joint& j) {
  return {m.bodies[static_cast<size_t>(j.b.body)],
          {.name = j.name,
           .point = j.a.position,
           .stowed = j.a.axes.col(0),
           .outward = j.a.axes.col(1),
           .mechanism = j.mechanism}};
}

/// The flight in terms of the tree, as it grows.
class InTermsOfTheTree {
 public:
  InTermsOfTheTree(const Tree& tree, const HubOfTree& hub)
      : tree_(tree), hub_(hub), motion_(hub.system.layout().dissipated()) {
    result_.stiffening_effect.resize(tree.scene().bodies.size());
    for (const ReducedBody& b : tree.scene().bodies) has_stiffening_ = has_stiffening_ || !b.Kg.spin.empty();
  }

  VectorXd of_hub(const VectorXd& y) const {
    VectorXd r(hub_.system.layout().size);
    const TreeLayout& l = tree_.layout();
    r << y.head(motion_), y.segment(l.dissipated, l.work - l.dissipated).sum(), y[l.work];
    return r;
  }

  IntegratorOptions of_hub(IntegratorOptions o) const {
    if (o.stops.empty()) return o;
    std::vector<StopHistory> stops;
    for (const int joint : hub_.joints) stops.push_back(o.stops[static_cast<size_t>(joint)]);
    o.stops = std::move(stops);
    return o;
  }

  /// Takes the rows that it does not have yet. `outputs`: of the whole flight.
  const TreeTrajectory& grow(const Trajectory& flight, double outputs, double tolerance) {
    for (size_t row = result_.time.size(); row < flight.time.size(); ++row) {
      result_.time.push_back(flight.time[row]);
      result_.y.push_back(of_tree(flight.y[row]));
      result_.balance.push_back(of_tree(flight.balance[row], flight.y[row]));
      if (has_stiffening_ && row % (static_cast<size_t>(outputs / 500) + 1) == 0)
        observe(tree_.stiffening_effect(flight.time[row], result_.y.back(), closed_stops(tree_, result_.y.back())),
                flight.time[row], result_.stiffening_effect);
    }
    result_.events = flight.events;
    for (StopEvent& e : result_.events) e.joint = joint(e.joint);
    result_.summary = flight.summary;
    result_.summary.stops.assign(tree_.scene().joints.size(), {});
    for (size_t i = 0; i < flight.summary.stops.size(); ++i)
      result_.summary.stops[static_cast<size_t>(joint(static_cast<int>(i)))] = flight.summary.stops[i];
    result_.warnings =
        stiffening_warnings(tree_.scene(), result_.stiffening_effect, tolerance, [](int) { return Stiffening::off; });
    return result_;
  }

  void keep_rows(size_t rows) { result_.time.resize(rows), result_.y.resize(rows), result_.balance.resize(rows); }
  TreeTrajectory take() { return std::move(result_); }

 private:
  int joint(int appendage) const { return hub_.joints[static_cast<size_t>(appendage)]; }

  VectorXd of_tree(const VectorXd& y) const {
    const TreeLayout& l = tree_.layout();
    VectorXd r = VectorXd::Zero(l.size);
    r.head(motion_) = y.head(motion_);
    r.tail<2>() = y.tail<2>();
    return r;
  }

  static TreeBalance of_tree(const Balance& b, const VectorXd& y) {
    TreeBalance r;
    r.kinetic = b.kinetic, r.elastic = b.elastic;
    r.dissipated = *(y.end() - 2), r.work = *(y.end() - 1);
    r.momentum = b.momentum, r.angular_momentum = b.angular_momentum;
    r.momentum_scale = b.momentum_scale, r.angular_momentum_scale = b.angular_momentum_scale;
    return r;
  }

  const Tree& tree_;
  const HubOfTree& hub_;
  Index motion_;  // up to here both have the same states
  bool has_stiffening_ = false;
  TreeTrajectory result_;
};

}  // namespace

std::optional<HubOfTree> hub_of(const Tree& tree) {
  const Multibody& m = tree.scene();
  const auto found = std::ranges::find_if(m.joints, is_flight);
  const bool fixed = found == m.joints.end();
  const int flight = fixed ? -1 : static_cast<int>(found - m.joints.begin()), hub = fixed ? -1 : found->b.body;
  if (!is_hub_with_booms(tree, flight, hub)) return {};
  std::vector<int> joints;
  for (int i = 0; i < static_cast<int>(m.joints.size()); ++i)
    if (i != flight) joints.push_back(i);
  std::ranges::sort(joints, {}, [&](int i) { return tree.layout().joints[static_cast<size_t>(i)].scalar; });
  std::vector<Appendage> appendages;
  for (const int i : joints) appendages.push_back(appendage_of(m, m.joints[static_cast<size_t>(i)]));
  System system(fixed ? ReducedBody{} : m.bodies[static_cast<size_t>(hub)], std::move(appendages), fixed, m.field);
  return HubOfTree{std::move(system), std::move(joints)};
}

TreeTrajectory integrate(const Tree& tree, const HubOfTree& hub, const VectorXd& y0, const IntegratorOptions& o,
                         const Checkpoint<TreeTrajectory>& checkpoint) {
  check_options(o, tree.scene().joints.size());
  require(y0.size() == tree.layout().size, "the start state has the wrong size");
  const double outputs = (o.duration - o.start) / o.output_step;
  InTermsOfTheTree flight(tree, hub);
  Checkpoint<Trajectory> on_the_way;
  if (checkpoint)
    on_the_way = [&](const Trajectory& so_far, size_t rows) {
      checkpoint(flight.grow(so_far, outputs, o.tolerance), rows);
      flight.keep_rows(rows);
    };
  flight.grow(integrate(hub.system, flight.of_hub(y0), flight.of_hub(o), on_the_way), outputs, o.tolerance);
  return flight.take();
}

}  // namespace flexboom
