#pragma once

#include <Eigen/Core>

namespace flexboom {

/// C = A B, all by columns and C apart from both: for a few columns of B and sizes of a few hundred, where a library's
/// packing costs more.
void small_product(const Eigen::Ref<const Eigen::MatrixXd>& A, const Eigen::Ref<const Eigen::MatrixXd>& B,
                   Eigen::Ref<Eigen::MatrixXd> C);

}  // namespace flexboom
