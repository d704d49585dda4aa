#pragma once

#include "apps/base/toml_reader.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

/// Checks of single values under their key paths, as descriptions of keys name them. Written so that NaN fails where a
/// value stands alone. `unit` has a space in front. Internal to `apps`.
namespace flexboom::scene_checks {

inline constexpr bool required = true;  // of a key: it has no default

inline constexpr double round_off = 1e-12;  // relative

/// "bodies[0]", "name" -> "bodies[0].name".
std::string join(const std::string& path, std::string_view key);

void positive(toml_reader::Faults&, const std::string& path, const double& value, std::string_view unit);
void not_negative(toml_reader::Faults&, const std::string& path, const double& value, std::string_view unit);
void finite(toml_reader::Faults&, const std::string& path, const double& value, std::string_view unit);
void finite(toml_reader::Faults&, const std::string& path, const Eigen::Vector3d&, std::string_view unit);

/// Of an angle, a length or their rates at the start: finite, and not so far away that nothing can be told apart.
void start(toml_reader::Faults&, const std::string& path, const double& value, std::string_view unit);

/// A unit vector.
void direction(toml_reader::Faults&, const std::string& path, const Eigen::Vector3d&, std::string_view unit);

/// Sides, none negative.
void box(toml_reader::Faults&, const std::string& path, const Eigen::Vector3d&, std::string_view unit);

/// Part of column names and file names: letters, digits, _ and -.
void name(toml_reader::Faults&, const std::string& path, const std::string& name, std::string_view unit);

/// Of an inertia: symmetric, positive definite (or, where a point mass is allowed, not negative), triangle inequality.
void definite(toml_reader::Faults&, const std::string& path, const Eigen::Matrix3d&, std::string_view unit);
void semidefinite(toml_reader::Faults&, const std::string& path, const Eigen::Matrix3d&, std::string_view unit);

/// Of the rows of a table.
template <class Table>
std::vector<std::string_view> names_of(const Table& table) {
  std::vector<std::string_view> names;
  names.reserve(std::size(table));
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
