#pragma once

#include "fem/sparse.hpp"

#include <Eigen/Core>

#include <filesystem>
#include <string>

namespace flexboom {

/// One matrix: the lower triangle of a symmetric one, coordinate form; comment lines are put under the banner.
void write_mtx(const std::filesystem::path&, const SparseMatrix& lower, const std::string& comment);

/// A dense matrix in array form.
void write_mtx(const std::filesystem::path&, const Eigen::MatrixXd&, const std::string& comment);

/// A real matrix in coordinate form. A symmetric one comes as its lower triangle.
SparseMatrix read_mtx(const std::filesystem::path&);

/// A real matrix in array form.
Eigen::MatrixXd read_mtx_array(const std::filesystem::path&);

}  // namespace flexboom
