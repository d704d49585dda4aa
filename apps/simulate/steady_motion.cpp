#include "apps/simulate/steady_motion.hpp"

#include "apps/model/prepared_body.hpp"
#include "apps/simulate/tree_flight.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

bool is_open(const BodyScene& b) { return b.basis.name == "prestressed" && !b.basis.motion; }

/// Its bodies as rigid ones.
Tree rigid_tree(const Scene& scene) {
  std::vector<PreparedBody> bodies;
  for (BodyScene b : scene.bodies) {
    if (b.is_boom()) b.structure = "rigid", b.modes = 0, b.shapes.clear(), b.stiffening.clear();
    bodies.push_back(prepare_body(b));
  }
  return Tree(make_multibody(without_loops(scene), bodies));
}

/// The free bodies start, and all angles and lengths are those where the joints rest.
TreeState steady_state(const Scene& scene, const Tree& tree) {
  TreeState state = start_state(scene, tree);
  const TreeState rest = tree.at_rest();
  for (size_t i = 0; i < state.joints.size(); ++i)
    state.joints[i].coordinate = rest.joints[i].coordinate, state.joints[i].rate = rest.joints[i].rate;
  return state;
}

/// Does anything in the joint hold the root, at times?
bool holds(const JointScene& j) {
  return j.mechanism.stiffness > 0 || j.mechanism.stop_stiffness > 0 || j.law.given() || j.drive.given() ||
         !j.motion.empty();
}

/// Axes of the body about which its joint lets it turn freely.
std::vector<Vector3d> free_turns(const Scene& scene, const std::string& body) {
  std::vector<Vector3d> turns;
  for (const JointScene& j : scene.joints) {
    if (j.b.body != body || j.closes_loop || holds(j)) continue;
    const Matrix3d axes = j.b.axes();  // columns: those of its place
    const JointType& type = joint_type(j.kind);
    for (int i = 0; i < type.freedoms; ++i) {
      const Freedom freedom = type.freedom[static_cast<size_t>(i)];
      if (freedom == Freedom::turn_x) turns.emplace_back(axes.col(0));
      if (freedom == Freedom::turn_y) turns.emplace_back(axes.col(1));
      if (freedom == Freedom::turn_z || freedom == Freedom::turn_z_of_a) turns.emplace_back(axes.col(2));
    }
  }
  return turns;
}

/// Without round-off: bodies that move alike have the same modes.
Vector3d rounded(const Vector3d& v) {
  constexpr double digits = 1e-12;
  const auto of = [size = v.norm()](double x) {
    return std::abs(x) <= digits * size ? 0 : std::stod(fmt::format("{:.12g}", x));
  };
  return {of(v.x()), of(v.y()), of(v.z())};
}

}  // namespace

Scene with_steady_motions(Scene scene) {
  if (std::ranges::none_of(scene.bodies, is_open)) return scene;
  const Scene joined = with_joints(scene);
  const Tree tree = rigid_tree(joined);
  const Eigen::VectorXd state = tree.pack(steady_state(without_loops(joined), tree));
  double mass = 0;
  for (const ReducedBody& body : tree.scene().bodies) mass += body.m;
  const Vector3d v = tree.balance(0, state).momentum / mass;
  for (BodyScene& b : scene.bodies) {
    if (!is_open(b)) continue;
    const auto index = std::ranges::find(joined.bodies, b.name, &BodyScene::name) - joined.bodies.begin();
    const PlaceMotionInSpace m = tree.motion(0, state, Place{.body = static_cast<int>(index), .marker = {}});
    const Vector3d acceleration = m.omega.cross(m.velocity - v) - joined.gravity;
    b.basis.motion = {rounded(m.axes.transpose() * m.omega), rounded(m.axes.transpose() * acceleration),
                      free_turns(joined, b.name)};
  }
  return scene;
}

}  // namespace flexboom
