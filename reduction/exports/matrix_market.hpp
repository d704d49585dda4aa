#pragma once

#include <Eigen/Core>

#include <filesystem>
#include <string>

namespace flexboom {

/// A dense matrix in array form, with a line of comment.
void write_mtx(const std::filesystem::path&, const Eigen::MatrixXd&, const std::string& comment);

/// A real matrix in array form. @throws InputError with file:line:column.
Eigen::MatrixXd read_mtx_array(const std::filesystem::path&);

}  // namespace flexboom
