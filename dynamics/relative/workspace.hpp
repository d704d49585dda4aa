#pragma once

// Scratch of one thread for Tree. Internal to `dynamics`.

#include "dynamics/relative/forces.hpp"

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
};

namespace tree {

/// Evaluates all functions of time.
void set_instant(const Model&, double t, Instant&);

/// Everything at (t, y), poses included, each link by itself.
Scratch<double> link_by_link(const Model&, double t, const Eigen::VectorXd& y, std::span<const char> contact,
                             std::span<const LawBranch> laws);

}  // namespace tree
}  // namespace flexboom
