#pragma once

#include "apps/toml_reader.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

/// Checks of single values under their key paths. Written so that NaN fails where a value stands alone. Internal to
/// `apps`.
namespace flexboom::scene_checks {

inline constexpr double round_off = 1e-12;  // relative

/// "bodies[0]", "name" -> "bodies[0].name".
std::string join(const std::string& path, std::string_view key);

void check_positive(toml_reader::Faults&, const std::string& path, double value, std::string_view unit);
void check_not_negative(toml_reader::Faults&, const std::string& path, double value, std::string_view unit);
void check_finite(toml_reader::Faults&, const std::string& path, double value);

/// Of an angle, a length or their rates at the start: finite, and not so far away that nothing can be told apart.
void check_start(toml_reader::Faults&, const std::string& path, double value, std::string_view unit);
void check_finite(toml_reader::Faults&, const std::string& path, const Eigen::Vector3d&);
void check_unit(toml_reader::Faults&, const std::string& path, const Eigen::Vector3d&);

/// Part of column names and file names: letters, digits, _ and -.
void check_name(toml_reader::Faults&, const std::string& path, const std::string& name);

/// Symmetric, positive definite (or, where a point mass is allowed, not negative), triangle inequality.
void check_inertia(toml_reader::Faults&, const std::string& path, const Eigen::Matrix3d&, bool may_vanish);

/// Of the rows of a table.
template <class Table>
std::vector<std::string_view> names_of(const Table& table) {
  std::vector<std::string_view> names;
  for (const auto& row : table) names.push_back(row.name);
  return names;
}

template <class Names>
void check_name_among(toml_reader::Faults& faults, const std::string& path, const std::string& value,
                      const Names& names) {
  if (std::find(names.begin(), names.end(), value) == names.end())
    faults.add(path, toml_reader::not_among(value, names));
}

}  // namespace flexboom::scene_checks
