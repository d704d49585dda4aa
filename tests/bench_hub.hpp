#pragma once

// SPORT as benchmarks fly it.

#include "apps/simulate/simulate.hpp"
#include "apps/simulate/tree_flight.hpp"

#include <Eigen/Core>

#include <utility>
#include <vector>

namespace flexboom {

/// A scene, its tree and its start.
struct SceneInFlight {
  explicit SceneInFlight(const Scene& given) : SceneInFlight(with_joints(given), prepared(with_joints(given))) {}

  TreeTrajectory fly(const IntegratorOptions& o) const { return integrate(tree, y0, o); }
  OutputTable outputs(const IntegratorOptions& o) const { return output_table(scene, tree, fly(o)); }

  Scene scene;
  Tree tree;
  Eigen::VectorXd y0;

 private:
  SceneInFlight(Scene s, const std::vector<PreparedBody>& bodies)
      : scene(std::move(s)), tree(make_multibody(scene, bodies)), y0(first_state(scene, tree)) {}
  static std::vector<PreparedBody> prepared(const Scene& scene) {
    std::vector<PreparedBody> bodies;
    for (const BodyScene& b : scene.bodies) bodies.push_back(prepare_body(b));
    return bodies;
  }
};

inline SceneInFlight sport(int modes) {
  Scene scene = load_scene("sport");
  for (BodyScene& b : scene.bodies) b.structure = "eq14", b.modes = modes;
  return SceneInFlight(scene);
}

/// A state in the middle of the motion.
inline Eigen::VectorXd moving_state(const SceneInFlight& f) {
  IntegratorOptions o;
  o.method = "exponential";
  o.tolerance = 1e-6;
  o.duration = 0.12;
  return f.fly(o).y.back();
}

/// No stop is closed.
inline std::vector<char> all_open(const SceneInFlight& f) { return std::vector<char>(f.tree.scene().joints.size(), 0); }

}  // namespace flexboom
