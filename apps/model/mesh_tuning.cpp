#include "apps/model/mesh_tuning.hpp"

#include "apps/model/prepared_body.hpp"
#include "fem/assembly/assembly.hpp"
#include "fem/base/check.hpp"
#include "fem/booms/solid_boom.hpp"
#include "reduction/basis/modal_basis.hpp"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace flexboom {
namespace {

using Eigen::VectorXd;

/// A size of SolidGrading, and its next finer value.
struct Direction {
  int SolidGrading::*size;
  int (*finer)(int);
};

constexpr std::array<Direction, 6> mesh_sizes = {{
    {&SolidGrading::sectors, [](int n) { return n + 1; }},
    {&SolidGrading::rings, [](int n) { return n + 1; }},
    {&SolidGrading::long_elements, [](int n) { return n + (n + 1) / 2; }},
    {&SolidGrading::end_layers, [](int n) { return n + 2; }},
    {&SolidGrading::corner_levels, [](int n) { return n + 1; }},
    {&SolidGrading::edge_levels, [](int n) { return n + 1; }},
}};

Model finer_in(const Model& model, const Direction& d) {
  Model r = model;
  int& size = r.body->solid.grading.*d.size;
  size = d.finer(size);
  return refined(r, 0);
}

VectorXd frequencies(const Model& model, const EigenOptions& options, int threads) {
  Assembly assembly = assemble(model.mesh, threads);
  return clamped_modes_releasing(model.mesh, assembly, model.clamp, options, threads).omega;
}

/// Largest relative change of an elastic frequency.
double change(const VectorXd& a, const VectorXd& b, int rigid_freedoms) {
  const Eigen::Index n = std::min(a.size(), b.size()) - rigid_freedoms;
  if (n <= 0) return 0;
  return (a.segment(rigid_freedoms, n).array() / b.segment(rigid_freedoms, n).array() - 1).abs().maxCoeff();
}

}  // namespace

Model with_order(Model model, int order) {
  model.body->solid.order = order;
  return refined(model, 0);
}

std::optional<Model> tuned(Model model, VectorXd omega, int rigid_freedoms, double accuracy,
                           const EigenOptions& options, int threads) {
  constexpr int most_rounds = 4;
  constexpr double share = 1.0 / 3;  // of the accuracy, that a direction may keep
  SolidOptions& solid = model.body->solid;
  solid = chosen(model.body->geometry, solid);
  bool any = false;
  std::vector<Direction> tried(mesh_sizes.begin(), mesh_sizes.end());
  for (int round = 0; round < most_rounds && !tried.empty(); ++round) {
    std::vector<std::pair<double, Direction>> effective;
    for (const Direction& d : tried) {
      const Model finer = finer_in(model, d);
      if (finer.mesh.nodes.cols() == model.mesh.nodes.cols() || !is_bearable(finer.mesh)) continue;
      const double moved = change(omega, frequencies(finer, options, threads), rigid_freedoms);
      if (moved > share * accuracy) effective.emplace_back(moved, d);
    }
    std::ranges::sort(effective, [](const auto& a, const auto& b) { return a.first > b.first; });
    tried.clear();
    for (const auto& [moved, d] : effective) {
      Model next = finer_in(model, d);
      if (!refined_if_bearable(next, 1)) continue;  // nothing could be compared with it
      model = std::move(next);
      any = true;
      tried.push_back(d);
    }
    if (!tried.empty()) omega = frequencies(model, options, threads);
  }
  return any ? std::optional(std::move(model)) : std::nullopt;
}

}  // namespace flexboom
