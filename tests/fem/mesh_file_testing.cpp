#include "mesh_file_testing.hpp"

namespace flexboom::testing {
namespace {

// Bends and shears a little, so that no two edges or faces are alike.
Eigen::Vector3d bent(const Eigen::Vector3d& r) {
  const double x = r(0), y = r(1), z = r(2);
  return {x + 0.10 * y * z + 0.05 * y * y, 1.3 * y + 0.08 * x * x + 0.04 * x * z,
          0.9 * z + 0.06 * x * y - 0.07 * x * x};
}

void add_properties(Mesh& mesh, const ElementType& row) {
  const Material steel{210e9, 0.3, 7850};
  if (row.shape != Shape::line) {
    mesh.solid_properties = {{"steel part", steel}, {"other <part>", aluminium}};
    return;
  }
  const BeamTheory theory = row.name == "beam-timoshenko" ? BeamTheory::timoshenko : BeamTheory::euler_bernoulli;
  const Eigen::Vector3d y_axis = Eigen::Vector3d::UnitZ();
  mesh.beam_properties.push_back({RoundBar{0.01}, RoundBar{0.02}, steel, theory, {"nu-squared", 0}, false, y_axis});
  mesh.beam_properties.push_back({RectangularTube{0.1, 0.2, 0.01},
                                  RectangularTube{0.1, 0.3, 0.02},
                                  aluminium,
                                  theory,
                                  {"value", 0.8},
                                  true,
                                  y_axis});
}

}  // namespace

Mesh two_elements(const ElementType& row, int order) {
  const Eigen::Matrix3Xd ends{{-1, 1}, {0, 0}, {0, 0}};
  const Eigen::Matrix3Xd reference = row.shape == Shape::line ? ends : reference_nodes(row, order);
  const Eigen::Index n = reference.cols();
  Mesh mesh;
  mesh.nodes.resize(3, 2 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    mesh.nodes.col(i) = row.shape == Shape::line ? reference.col(i).eval() : bent(reference.col(i));
    mesh.nodes.col(n + i) = mesh.nodes.col(i) + Eigen::Vector3d(3, 0.1, 1.0 / 3);
  }
  for (int e = 0; e < 2; ++e) {
    Element& element = mesh.elements.emplace_back();
    element.type = element_type(row.name);
    element.order = order;
    element.property = e;
    for (int i = 0; i < n; ++i) element.nodes.push_back(e * static_cast<int>(n) + i);
  }
  add_properties(mesh, row);
  mesh.node_sets = {{"root", {0, 1}}, {"a & \"b\" <c>", {1}}};
  mesh.element_sets = {{"first", {0}}, {"both", {0, 1}}};
  return mesh;
}

void expect_same(const Mesh& mesh, const Mesh& expected, double digits) {
  ASSERT_EQ(mesh.nodes.cols(), expected.nodes.cols());
  const double size = expected.nodes.cwiseAbs().maxCoeff();
  EXPECT_LE((mesh.nodes - expected.nodes).cwiseAbs().maxCoeff(), digits * size);
  ASSERT_EQ(mesh.elements.size(), expected.elements.size());
  for (size_t e = 0; e < mesh.elements.size(); ++e) {
    EXPECT_EQ(type_of(mesh.elements[e]).name, type_of(expected.elements[e]).name);
    EXPECT_EQ(mesh.elements[e].order, expected.elements[e].order);
    EXPECT_EQ(mesh.elements[e].nodes, expected.elements[e].nodes);
    EXPECT_EQ(mesh.elements[e].property, expected.elements[e].property);
  }
  EXPECT_EQ(mesh.node_sets, expected.node_sets);
  EXPECT_EQ(mesh.element_sets, expected.element_sets);
}

}  // namespace flexboom::testing
