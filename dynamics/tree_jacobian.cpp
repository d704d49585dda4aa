#include "dynamics/tree_impl.hpp"

#include <algorithm>

namespace flexboom {

void Tree::jacobian(double t, const double* y, std::span<const char> contact, TreeWorkspace& w, Eigen::MatrixXd& J,
                    std::span<const LawBranch> laws) const {
  const int size = impl_->layout.size, inputs = impl_->layout.dissipated;  // nothing depends on the energies
  J.setZero(size, size);
  tree::set_instant(impl_->model, t, w.instant);
  w.instant.laws = laws;
  for (int i = 0; i < size; ++i) w.in[static_cast<size_t>(i)] = y[i];
  for (int first = 0; first < inputs; first += TreeWorkspace::lanes) {
    const int count = std::min(TreeWorkspace::lanes, inputs - first);
    for (int i = 0; i < count; ++i) w.in[static_cast<size_t>(first + i)].d[i] = 1;
    tree::derivative(impl_->model, w.in.data(), w.instant, contact, w.dual, w.out.data());
    for (int i = 0; i < count; ++i) {
      w.in[static_cast<size_t>(first + i)].d[i] = 0;
      for (int r = 0; r < size; ++r) J(r, first + i) = w.out[static_cast<size_t>(r)].d[i];
    }
  }
}

}  // namespace flexboom
