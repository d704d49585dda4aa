#pragma once

#include <Eigen/Core>

#include <filesystem>
#include <map>
#include <string>
#include <variant>
#include <vector>

namespace flexboom {

using IntegerMatrix = Eigen::Matrix<long, Eigen::Dynamic, Eigen::Dynamic>;
using IntegerVector = Eigen::Matrix<long, Eigen::Dynamic, 1>;

/// A dictionary without entries.
struct EmptyDictionary {};

/// What EXUDYN keeps in its HDF5 files, by Python's types: int, float, str, list of str, arrays of one and two axes,
/// and {}.
using ExudynValue = std::variant<long, double, std::string, std::vector<std::string>, Eigen::VectorXd, Eigen::MatrixXd,
                                 IntegerVector, IntegerMatrix, EmptyDictionary>;
using ExudynDictionary = std::map<std::string, ExudynValue>;

/// Writes a dictionary as EXUDYN's `LoadDictFromHDF5` reads it: one dataset per entry, rows first, with its Python type
/// in the attribute `datatype`. Equal dictionaries make equal files.
/// @throws InputError when the file cannot be written.
void write_exudyn_dictionary(const std::filesystem::path&, const ExudynDictionary&);

/// The entries of the kinds above; what else the file holds is passed over.
/// @throws InputError naming the file when it is missing, not HDF5, or an entry cannot be read.
ExudynDictionary read_exudyn_dictionary(const std::filesystem::path&);

}  // namespace flexboom
