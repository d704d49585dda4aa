#pragma once

// SPORT as benchmarks fly it.

#include "apps/simulate.hpp"
#include "apps/tree_flight.hpp"
#include "dynamics/hub_flight.hpp"

#include <Eigen/Core>

#include <utility>
#include <vector>

namespace flexboom {

/// A scene whose tree is a hub with hinged booms, and its start.
struct HubInFlight {
  explicit HubInFlight(const Scene& given) : HubInFlight(with_joints(given), prepared(with_joints(given))) {}

  /// Columns of a flight.
  OutputTable outputs(const IntegratorOptions& o) const {
    return output_table(scene, tree, integrate(tree, *hub_of(tree), first_state(scene, tree), o));
  }

  Scene scene;
  Tree tree;
  System system;
  Eigen::VectorXd y0;  // System::layout()

 private:
  HubInFlight(Scene s, const std::vector<PreparedBody>& bodies)
      : scene(std::move(s)), tree(make_multibody(scene, bodies)), system(std::move(hub_of(tree)->system)) {
    const Eigen::VectorXd start = first_state(scene, tree);
    y0 = Eigen::VectorXd::Zero(system.layout().size);
    y0.head(system.layout().dissipated()) = start.head(system.layout().dissipated());
  }
  static std::vector<PreparedBody> prepared(const Scene& scene) {
    std::vector<PreparedBody> bodies;
    for (const BodyScene& b : scene.bodies) bodies.push_back(prepare_body(b));
    return bodies;
  }
};

inline HubInFlight sport(int modes) {
  Scene scene = load_scene("sport");
  for (BodyScene& b : scene.bodies) b.structure = "eq14", b.modes = modes;
  return HubInFlight(scene);
}

/// A state in the middle of the motion.
inline Eigen::VectorXd moving_state(const HubInFlight& f) {
  IntegratorOptions o;
  o.tolerance = 1e-6;
  o.duration = 0.12;
  return integrate(f.system, f.y0, o).y.back();
}

}  // namespace flexboom
