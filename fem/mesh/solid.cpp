#include "fem/mesh/solid.hpp"

#include "fem/linear_algebra/dense.hpp"
#include "fem/mesh/elastic_fields.hpp"
#include "fem/mesh/elasticity.hpp"
#include "fem/mesh/shape_functions.hpp"

#include <fmt/format.h>
#include <Eigen/LU>

#include <array>
#include <cmath>
#include <string>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixX3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using elasticity::Lame;

// What a kind is made of. Rules are those of CalculiX (C3D20, C3D20R, C3D10, C3D15, C3D8I), whose frequencies on one
// mesh are then ours. A rule is taken only if it leaves every element its exact mass, centre and inertia where its map
// is affine. The one mass point of C3D4 and the two of C3D6 lose the element's own inertia: here they have more.
struct Recipe {
  Index nodes;
  ShapeFunctions (*shapes)(const Vector3d&);
  const Matrix3Xd& (*positions)();
  PointRule (*stiffness_rule)();
  PointRule (*prestress_rule)();  // exact to the order of the element's own error; holds no motion
  PointRule (*mass_rule)(int extra);
};

template <int n>
PointRule cube() {
  return hexahedron_rule(n);
}
template <int n>
PointRule finer_cube(int extra) {
  return hexahedron_rule(n + extra);
}
template <int points>
PointRule tetrahedron() {
  return tetrahedron_rule(points);
}
PointRule finer_tetrahedron(int extra) {
  return extra == 0 ? tetrahedron_rule(4) : collapsed_tetrahedron_rule(3 + extra);
}
template <int triangle, int n>
PointRule wedge() {
  return wedge_rule(triangle, n);
}
template <int triangle>
PointRule finer_wedge(int extra) {
  return extra == 0 ? wedge_rule(triangle, 3) : collapsed_wedge_rule(3 + extra);
}

// Reduced points alone leave motions without stiffness: six of a lone C3D20R, one or more of a row of them, one of a
// lone C3D6. A share of the full rule gives them some; other frequencies rise by a fraction of that share.
PointRule stabilised(const PointRule& reduced, const PointRule& full) {
  constexpr double share = 1e-5;
  PointRule rule{Matrix3Xd(3, reduced.points.cols() + full.points.cols()),
                 VectorXd(reduced.weights.size() + full.weights.size())};
  rule.points << reduced.points, full.points;
  rule.weights << (1 - share) * reduced.weights, share * full.weights;
  return rule;
}
PointRule stabilised_cube() { return stabilised(hexahedron_rule(2), hexahedron_rule(3)); }
PointRule stabilised_wedge() { return stabilised(wedge_rule(1, 2), wedge_rule(3, 2)); }

constexpr std::array<Recipe, 8> recipes = {
    {{8, hex8_shapes, hexahedron_nodes, cube<2>, cube<2>, finer_cube<2>},
     {20, hex20_shapes, hexahedron_nodes, cube<3>, cube<2>, finer_cube<3>},
     {20, hex20_shapes, hexahedron_nodes, stabilised_cube, cube<2>, finer_cube<2>},
     {27, hex27_shapes, hexahedron_nodes, cube<3>, cube<2>, finer_cube<4>},
     {4, tet4_shapes, tetrahedron_nodes, tetrahedron<1>, tetrahedron<1>, finer_tetrahedron},
     {10, tet10_shapes, tetrahedron_nodes, tetrahedron<4>, tetrahedron<4>, finer_tetrahedron},
     {6, wedge6_shapes, wedge_nodes, stabilised_wedge, wedge<1, 2>, finer_wedge<6>},
     {15, wedge15_shapes, wedge_nodes, wedge<3, 3>, wedge<3, 2>, finer_wedge<3>}}};

template <SolidKind kind>
constexpr const Recipe& recipe = recipes[static_cast<size_t>(kind)];

// Shape functions at the Q points of a rule.
struct Table {
  VectorXd weights;
  MatrixXd values;  // n x Q
  MatrixXd slopes;  // n x 3 Q: by reference coordinate
  MatrixXd rows;    // its transpose
};

Table make_table(const Recipe& recipe, const PointRule& rule) {
  const Index count = rule.weights.size();
  Table table{rule.weights, MatrixXd(recipe.nodes, count), MatrixXd(recipe.nodes, 3 * count), {}};
  for (Index q = 0; q < count; ++q) {
    const ShapeFunctions shapes = recipe.shapes(rule.points.col(q));
    table.values.col(q) = shapes.values;
    table.slopes.middleCols<3>(3 * q) = shapes.gradients;
  }
  table.rows = table.slopes.transpose();
  return table;
}

template <SolidKind kind>
const Table& stiffness_table() {
  static const Table table = make_table(recipe<kind>, recipe<kind>.stiffness_rule());
  return table;
}

template <SolidKind kind>
const Table& prestress_table() {
  static const Table table = make_table(recipe<kind>, recipe<kind>.prestress_rule());
  return table;
}

template <SolidKind kind>
const Table& mass_table() {
  static const Table table = make_table(recipe<kind>, recipe<kind>.mass_rule(0));
  return table;
}

template <SolidKind kind>
const Table& node_table() {
  static const Table table = [] {
    const Index nodes = recipe<kind>.nodes;
    return make_table(recipe<kind>, {recipe<kind>.positions().leftCols(nodes), VectorXd::Zero(nodes)});
  }();
  return table;
}

// Slopes of the position at every point (3 Q x 3): row 3 q + r, column c: d x_c / d xi_r.
MatrixX3d jacobians(const Table& table, const MatrixX3d& X) {
  MatrixX3d J(table.rows.rows(), 3);
  for (Index c = 0; c < 3; ++c)
    J.col(c).noalias() = table.rows * X.col(c);  // three columns do not repay a blocked product
  return J;
}

// Volume of each point [m^3].
VectorXd volumes(const Table& table, const MatrixX3d& X) {
  const MatrixX3d J = jacobians(table, X);
  VectorXd volumes(table.weights.size());
  for (Index q = 0; q < volumes.size(); ++q)
    volumes(q) = table.weights(q) * Matrix3d(J.middleRows<3>(Index{3} * q)).determinant();
  return volumes;
}

// Gradients by position at every point: column q holds those of all nodes, x then y then z (3 n), times sqrt(volume)
// when `scaled`.
struct Gradients {
  MatrixXd columns;
  VectorXd volumes;
};

Gradients gradients(const Table& table, const MatrixX3d& X, bool scaled) {
  const Index n = X.rows(), count = table.weights.size();
  const MatrixX3d J = jacobians(table, X);
  Gradients g{MatrixXd(3 * n, count), VectorXd(count)};
  for (Index q = 0; q < count; ++q) {
    const Matrix3d Jt = J.middleRows<3>(Index{3} * q);
    g.volumes(q) = table.weights(q) * Jt.determinant();
    const double scale = scaled ? std::sqrt(g.volumes(q)) : 1;
    const Matrix3d inverse = scale * Jt.inverse().transpose();  // (r, i): d xi_r / d x_i
    Eigen::Map<MatrixX3d>(g.columns.col(q).data(), n, 3).noalias() =
        table.slopes.middleCols<3>(3 * q).lazyProduct(inverse);
  }
  return g;
}

MatrixXd stiffness_of(const Table& table, const Mesh& mesh, const Element& element) {
  const Gradients g = gradients(table, elasticity::local_positions(mesh, element), true);
  MatrixXd H = MatrixXd::Zero(g.columns.rows(), g.columns.rows());
  H.selfadjointView<Eigen::Lower>().rankUpdate(g.columns);
  return elasticity::stiffness_from_gradients(H, elasticity::lame(elasticity::material_of(mesh, element)));
}

MatrixXd mass_of(const Table& table, const Mesh& mesh, const Element& element) {
  const double rho = elasticity::material_of(mesh, element).rho;
  const VectorXd dm = rho * volumes(table, elasticity::local_positions(mesh, element));
  const MatrixXd scaled = table.values * dm.cwiseSqrt().asDiagonal();
  MatrixXd m = MatrixXd::Zero(scaled.rows(), scaled.rows());
  m.selfadjointView<Eigen::Lower>().rankUpdate(scaled);
  return elasticity::mass_from_scalar(m);
}

elasticity::FieldSlopes field_slopes(const Table& table, const Mesh& mesh, const Element& element,
                                     const Eigen::Ref<const MatrixXd>& q) {
  const MatrixX3d J = jacobians(table, elasticity::local_positions(mesh, element));
  const MatrixXd slopes = transposed_product(elasticity::fields_of(q), table.slopes);
  elasticity::FieldSlopes fields(q.cols(), table.weights.size());
  for (Index p = 0; p < table.weights.size(); ++p) {
    const Matrix3d Jt = J.middleRows<3>(3 * p);
    const double* const at = &slopes(0, 3 * p);
    fields.set(p, table.weights(p) * Jt.determinant(), Jt.inverse().transpose(),
               {at, at + slopes.rows(), at + 2 * slopes.rows()});
  }
  return fields;
}

void visit_masses(const Table& table, const Mesh& mesh, const Element& element, const MassPointVisitor& visit) {
  const MatrixX3d X = elasticity::local_positions(mesh, element);
  const Vector3d first = mesh.nodes.col(element.nodes[0]);
  const VectorXd dm = elasticity::material_of(mesh, element).rho * volumes(table, X);
  elasticity::MassPoint point(X.rows());
  for (Index q = 0; q < dm.size(); ++q) {
    point.visit(dm(q), first + X.transpose() * table.values.col(q), table.values.col(q), visit);
  }
}

void visit_strains(const Table& table, const Mesh& mesh, const Element& element, const StrainPointVisitor& visit) {
  const MatrixXd D = elasticity::elasticity_matrix(elasticity::lame(elasticity::material_of(mesh, element)));
  const Gradients g = gradients(table, elasticity::local_positions(mesh, element), false);
  const Index n = g.columns.rows() / 3;
  for (Index q = 0; q < g.volumes.size(); ++q) {
    visit(g.volumes(q), elasticity::strain_rows(Eigen::Map<const MatrixX3d>(g.columns.col(q).data(), n, 3)), D);
  }
}

// The first point of a table at which the Jacobian is not positive; -1: none.
int inverted_point(const Table& table, const Mesh& mesh, const Element& element) {
  const MatrixX3d J = jacobians(table, elasticity::local_positions(mesh, element));
  for (Index q = 0; q < table.weights.size(); ++q) {
    const Matrix3d slopes = J.middleRows<3>(Index{3} * q).transpose();
    if (!elasticity::is_valid(slopes, slopes.determinant())) return static_cast<int>(q);
  }
  return -1;
}

}  // namespace

template <SolidKind kind>
MatrixXd Solid<kind>::stiffness(const Mesh& mesh, const Element& element) {
  return stiffness_of(stiffness_table<kind>(), mesh, element);
}

template <SolidKind kind>
MatrixXd Solid<kind>::mass(const Mesh& mesh, const Element& element) {
  return mass_of(mass_table<kind>(), mesh, element);
}

template <SolidKind kind>
void Solid<kind>::mass_points(const Mesh& mesh, const Element& element, int extra, const MassPointVisitor& visit) {
  if (extra == 0) return visit_masses(mass_table<kind>(), mesh, element, visit);
  visit_masses(make_table(recipe<kind>, recipe<kind>.mass_rule(extra)), mesh, element, visit);
}

template <SolidKind kind>
void Solid<kind>::strain_points(const Mesh& mesh, const Element& element, const StrainPointVisitor& visit) {
  visit_strains(stiffness_table<kind>(), mesh, element, visit);
}

template <SolidKind kind>
Eigen::Matrix<double, 6, Eigen::Dynamic> Solid<kind>::interpolation(const Mesh& mesh, const Element& element,
                                                                    const Vector3d& at) {
  const ShapeFunctions shapes = recipe<kind>.shapes(at);
  const Matrix3d J = elasticity::local_positions(mesh, element).transpose() * shapes.gradients;
  return elasticity::motion_rows(shapes.values, shapes.gradients * J.inverse());
}

template <SolidKind kind>
Vector3d Solid<kind>::position(const Mesh& mesh, const Element& element, const Vector3d& at) {
  const Vector3d first = mesh.nodes.col(element.nodes[0]);
  return first + elasticity::local_positions(mesh, element).transpose() * recipe<kind>.shapes(at).values;
}

template <SolidKind kind>
MatrixXd Solid<kind>::energy_strains(const Mesh& mesh, const Element& element, const Eigen::Ref<const MatrixXd>& q) {
  return elasticity::energy_strains(field_slopes(stiffness_table<kind>(), mesh, element, q),
                                    elasticity::lame(elasticity::material_of(mesh, element)));
}

template <SolidKind kind>
void Solid<kind>::add_prestress_work(const Mesh& mesh, const Element& element, const Eigen::Ref<const MatrixXd>& q0,
                                     const Eigen::Ref<const MatrixXd>& q, Eigen::Ref<MatrixXd> work) {
  const Table& table = prestress_table<kind>();
  elasticity::add_prestress_work(field_slopes(table, mesh, element, q0), field_slopes(table, mesh, element, q),
                                 elasticity::lame(elasticity::material_of(mesh, element)), work);
}

template <SolidKind kind>
void Solid<kind>::validate(const Mesh& mesh, const Element& element) {
  elasticity::require_property(mesh, element);
  for (const Table* table : {&stiffness_table<kind>(), &mass_table<kind>()}) {
    const int q = inverted_point(*table, mesh, element);
    if (q < 0) continue;
    const MatrixX3d J = jacobians(*table, elasticity::local_positions(mesh, element));
    elasticity::throw_inverted(Matrix3d(J.middleRows<3>(Index{3} * q)).determinant(), q);
  }
}

template <SolidKind kind>
int Solid<kind>::inverted_node(const Mesh& mesh, const Element& element) {
  return inverted_point(node_table<kind>(), mesh, element);
}

template struct Solid<SolidKind::hex8>;
template struct Solid<SolidKind::hex20>;
template struct Solid<SolidKind::hex20_reduced>;
template struct Solid<SolidKind::hex27>;
template struct Solid<SolidKind::tet4>;
template struct Solid<SolidKind::tet10>;
template struct Solid<SolidKind::wedge6>;
template struct Solid<SolidKind::wedge15>;

}  // namespace flexboom
