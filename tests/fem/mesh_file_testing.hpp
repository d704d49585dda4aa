#pragma once

#include "fem/formats/mesh_formats.hpp"
#include "fem_testing.hpp"
#include "solid_testing.hpp"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>

// Meshes for the tests of file formats, and what must come back from a file.
namespace flexboom::testing {

/// A folder of this process alone, removed at the end.
struct Folder {
  std::filesystem::path path = std::filesystem::temp_directory_path() / ("flexboom_fem_" + std::to_string(::getpid()));
  Folder() { std::filesystem::create_directories(path); }
  ~Folder() { std::filesystem::remove_all(path); }
};

inline std::filesystem::path test_mesh(const std::string& name) {
  return std::filesystem::path(FLEXBOOM_TEST_DATA) / "fem" / "meshes" / name;
}

/// Volume of the solids by a quadrature of `extra` more points than their own.
inline double volume(const Mesh& mesh, int extra = 3) {
  Mesh dense = mesh;
  for (SolidProperty& property : dense.solid_properties) property.material = {1e9, 0.3, 1};
  double sum = 0;
  for (const Element& element : dense.elements) {
    type_of(element).mass_points(dense, element, extra,
                                 [&sum](double dm, const Eigen::Vector3d&, const auto&) { sum += dm; });
  }
  return sum;
}

inline const ElementType& row_named(std::string_view name) {
  return element_types()[static_cast<size_t>(element_type(name))];
}

/// Two bent elements of a row side by side with a set of each kind; steel and aluminium. They share no nodes, so every
/// shape can be doubled.
Mesh two_elements(const ElementType&, int order);

/// Everything of a mesh but labels, which a file may add. `digits`: positions to that relative accuracy of the size.
void expect_same(const Mesh& mesh, const Mesh& expected, double digits);

}  // namespace flexboom::testing
