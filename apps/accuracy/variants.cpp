#include "apps/accuracy/variants.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

namespace flexboom {

long bearable_steps(const SimulatedMotion& run) { return 20 * run.motion.summary.steps + 20000; }

Scene with_a_digit_more(Scene scene) {
  scene.integrator_tolerance = std::stod(fmt::format("{:.6g}", scene.step_tolerance() / 10));
  return scene;
}

Scene as_flown(Scene scene, const Run& run) {
  for (BodyScene& b : scene.bodies) {
    const auto body = std::ranges::find(run.bodies, b.name, [](const PreparedBody& p) { return p.body.name; });
    if (b.stiffening != "auto" || body == run.bodies.end() || body->body.n() == 0) continue;  // that shows nothing
    const auto index = static_cast<int>(body - run.bodies.begin());
    b.stiffening = run.tree->stiffening(index) == Stiffening::off ? "off" : "on";
  }
  return scene;
}

Scene with_stiffening(Scene scene) {
  for (BodyScene& b : scene.bodies)
    if (b.is_flexible()) b.stiffening = "on";
  return scene;
}

std::optional<Scene> by_cheapest_means(Scene scene) {
  constexpr std::array<std::string_view, 3> as_chosen = {"auto", "exponential", "dirk"};
  const bool has_loops = std::ranges::any_of(scene.joints, &JointScene::closes_loop);
  const bool is_chosen =
      scene.formulation == "relative" && std::ranges::find(as_chosen, scene.integrator) != as_chosen.end();
  if (has_loops || is_chosen) return {};
  scene.formulation = "relative", scene.integrator = "auto";
  scene.integrator_tolerance = std::max(std::min(scene.tolerance, scene.step_tolerance()) / 10, least_tolerance);
  return scene;
}

}  // namespace flexboom
