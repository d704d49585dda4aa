#pragma once

// Scratch of one thread for Tree. Internal to `dynamics`.

#include "dynamics/relative/forces.hpp"

#include <memory>

namespace flexboom {

class TreeWorkspace {
 public:
  static constexpr int lanes = 8;
  using D = Dual<lanes>;

  TreeWorkspace(const tree::Model& model, int size)
      : scratch(model), dual(model), in(static_cast<size_t>(size)), out(static_cast<size_t>(size)), instant(model) {}

  tree::Scratch<double> scratch;
  tree::Scratch<D> dual;
  std::vector<D> in, out;
  tree::Instant instant;
  std::unique_ptr<tree::Scratch<double>> alone;  // each link by itself; made when first asked for
};

namespace tree {

/// Evaluates all functions of time.
void set_instant(const Model&, double t, Instant&);

/// Everything at (t, y), poses included, each link by itself: into a scratch that was made so.
void link_by_link(const Model&, double t, const Eigen::VectorXd& y, std::span<const char> contact,
                  std::span<const LawBranch> laws, Scratch<double>&);

}  // namespace tree
}  // namespace flexboom
