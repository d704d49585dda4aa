#pragma once

#include "dynamics/redundant/multipliers.hpp"
#include "dynamics/simulation/formulations.hpp"
#include "dynamics/simulation/tree_integrator.hpp"
#include "tree_testing.hpp"

#include <algorithm>
#include <string>
#include <vector>

namespace flexboom::testing {

/// A flight in either formulation, as far as laws show in it.
struct LawFlight {
  std::vector<double> time;
  std::vector<std::vector<double>> coordinate, rate;  // per row, per joint
  std::vector<Eigen::VectorXd> q;                     // of all bodies
  std::vector<StopEvent> events;
  std::vector<EnergyLedger> ledger;  // per row
  std::vector<double> energy;        // per row: all that is kept
  std::vector<StopHistory> stops;
  double energy_balance = 0;
  Eigen::VectorXd end;  // of a tree

  std::string kinds() const {
    std::string all;
    for (const StopEvent& e : events) all += (all.empty() ? "" : " ") + std::string(event_name(e));
    return all;
  }
  std::vector<StopEvent> of_kind(std::string_view name) const {
    std::vector<StopEvent> some;
    std::ranges::copy_if(events, std::back_inserter(some), [&](const StopEvent& e) { return event_name(e) == name; });
    return some;
  }
};

inline const std::vector<std::string> every_method = {"adams", "bdf", "dirk", "erk", "ida"};

inline void add_state(const TreeState& s, LawFlight& r) {
  std::vector<double> x, v;
  for (const JointState& j : s.joints) {
    x.push_back(j.coordinate.empty() ? 0 : j.coordinate[0]);
    v.push_back(j.rate.empty() ? 0 : j.rate[0]);
  }
  Eigen::VectorXd all(0);
  for (const Eigen::VectorXd& q : s.q) {
    Eigen::VectorXd more(all.size() + q.size());
    more << all, q;
    all = more;
  }
  r.coordinate.push_back(x), r.rate.push_back(v), r.q.push_back(all);
}

/// method "ida": by multipliers.
inline LawFlight fly(const Multibody& scene, const TreeState& start, const std::string& method, IntegratorOptions o,
                     Stiffening stiffening = Stiffening::off) {
  LawFlight r;
  const Tree tree(scene, {stiffening});
  const Eigen::VectorXd y0 = tree.pack(start);
  if (method != "ida") {
    o.method = method;
    const TreeTrajectory f = integrate(tree, y0, o);
    for (size_t i = 0; i < f.time.size(); ++i) {
      add_state(tree.unpack(f.y[i]), r);
      r.ledger.push_back(f.balance[i].ledger);
      r.energy.push_back(f.balance[i].energy());
    }
    r.time = f.time, r.events = f.events, r.energy_balance = f.summary.energy_balance, r.stops = f.summary.stops;
    r.end = f.y.back();
    return r;
  }
  const Multipliers system(scene, {stiffening});
  MultipliersOptions m{o};
  for (const JointState& j : start.joints) m.angles.push_back(j.coordinate.empty() ? 0 : j.coordinate[0]);
  const MultibodyTrajectory f = integrate_multipliers(system, body_states(tree, o.start, y0), m);
  for (size_t i = 0; i < f.time.size(); ++i) {
    TreeState s = tree_state(system, f.states[i]);
    add_state(s, r);
    r.ledger.push_back(f.states[i].ledger);
    r.energy.push_back(f.balance[i].energy());
  }
  r.time = f.time, r.events = f.events, r.energy_balance = f.summary.energy_balance, r.stops = f.summary.stops;
  return r;
}

inline IntegratorOptions law_options(double tolerance, double duration, double output_step) {
  IntegratorOptions o;
  o.tolerance = tolerance, o.duration = duration, o.output_step = output_step;
  return o;
}

/// One body on the ground, on a hinge (inertia about it) or a slider (mass).
inline Multibody one_joint(JointKind kind, double inertia, const HingeMechanism& mechanism, const JointLaw& law) {
  Multibody scene;
  const Eigen::Matrix3d J = (kind == JointKind::hinge ? inertia : 1.0) * Eigen::Matrix3d::Identity();
  scene.bodies.push_back(rigid_body("rotor", kind == JointKind::hinge ? 1.0 : inertia, Eigen::Vector3d::Zero(), J));
  scene.joints.push_back(joint("pivot", kind, place(-1), place(0)));
  scene.joints[0].mechanism = mechanism;
  scene.joints[0].law = law;
  return scene;
}

inline TreeState one_start(double x, double rate) {
  TreeState s;
  s.joints.resize(1);
  s.joints[0].coordinate = {x}, s.joints[0].rate = {rate};
  s.q.resize(1), s.q_dot.resize(1);
  return s;
}

}  // namespace flexboom::testing
