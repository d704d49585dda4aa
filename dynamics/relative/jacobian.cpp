#include "dynamics/relative/impl.hpp"

#include <algorithm>

namespace flexboom {

void Tree::jacobian_columns(double t, const double* y, std::span<const char> contact, TreeWorkspace& w,
                            Eigen::Ref<Eigen::MatrixXd> columns, std::span<const LawBranch> laws) const {
  tree::set_instant(impl_->model, t, w.instant);
  w.instant.laws = laws;
  for (int i = 0; i < impl_->layout.size; ++i) w.in[static_cast<size_t>(i)] = y[i];
  for (int done = 0; done < columns.cols(); done += TreeWorkspace::lanes) {
    const int count = std::min(TreeWorkspace::lanes, static_cast<int>(columns.cols()) - done);
    const auto at = static_cast<size_t>(done);
    for (int i = 0; i < count; ++i) w.in[at + static_cast<size_t>(i)].d[i] = 1;
    tree::derivative(impl_->model, w.in.data(), w.instant, contact, w.dual, w.out.data());
    for (int i = 0; i < count; ++i) {
      w.in[at + static_cast<size_t>(i)].d[i] = 0;
      for (int r = 0; r < columns.rows(); ++r) columns(r, done + i) = w.out[static_cast<size_t>(r)].d[i];
    }
  }
}

void Tree::jacobian(double t, const double* y, std::span<const char> contact, TreeWorkspace& w, Eigen::MatrixXd& J,
                    std::span<const LawBranch> laws) const {
  const int size = impl_->layout.size;
  J.setZero(size, size);  // nothing depends on the energies
  jacobian_columns(t, y, contact, w, J.leftCols(impl_->layout.dissipated), laws);
}

}  // namespace flexboom
