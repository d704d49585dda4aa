#include "fem/mesh/hexahedron.hpp"

#include "fem/base/check.hpp"
#include "fem/linear_algebra/dense.hpp"
#include "fem/mesh/elastic_fields.hpp"
#include "fem/mesh/elasticity.hpp"
#include "fem/mesh/shape_functions.hpp"

#include <fmt/format.h>
#include <Eigen/LU>

#include <array>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::MatrixX3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using elasticity::Lame;

constexpr std::array<int, max_hexahedron_order> all_orders = {1, 2, 3, 4, 5, 6, 7, 8};

// One more point per direction than polynomials: on curved elements K is then closer to exact than the shapes are.
int stiffness_points(int p) { return p + 2; }
// An error of order 2 p + 2, of the element 2 p; no motion depends on these points for its stiffness.
int prestress_points(int p) { return p + 1; }
// N N^T det J has degree 2 p + 3 p - 1 in each coordinate.
int mass_points_per_direction(int p) { return (5 * p + 1) / 2; }

// The basis at m points of [-1, 1].
struct LineTable {
  VectorXd weights;            // m
  std::array<MatrixXd, 2> by;  // m x n: values, slopes
  // Products of two functions: n^2 x m, entry (a + n b, q) of pairs[2 u + v] is by[u](q, a) by[v](q, b).
  std::array<MatrixXd, 4> pairs;
};

LineTable make_line_table(const LobattoBasis& basis, const VectorXd& points, const VectorXd& weights) {
  const Index n = basis.nodes().size(), m = points.size();
  LineTable table{weights, {MatrixXd(m, n), MatrixXd(m, n)}, {}};
  for (Index q = 0; q < m; ++q) {
    table.by[0].row(q) = basis.values(points(q)).transpose();
    table.by[1].row(q) = basis.slopes(points(q)).transpose();
  }
  for (size_t u = 0; u < 2; ++u) {
    for (size_t v = 0; v < 2; ++v) {
      MatrixXd& pairs = table.pairs[2 * u + v];
      pairs.resize(n * n, m);
      for (Index b = 0; b < n; ++b) {
        pairs.middleRows(b * n, n) = (table.by[v].col(b).asDiagonal() * table.by[u]).transpose();
      }
    }
  }
  return table;
}

LineTable gauss_table(int order, int points) {
  const GaussRule& rule = gauss_rule(points);
  return make_line_table(lobatto_basis(order), rule.points, rule.weights);
}

struct OrderTables {
  LineTable stiffness, prestress, mass, nodes;
  MatrixXd stiffness_pairs;  // 4 m x n^2: all pairs of the stiffness points, transposed and stacked
};

OrderTables make_order_tables(int order) {
  const LobattoBasis& basis = lobatto_basis(order);
  OrderTables tables{gauss_table(order, stiffness_points(order)),
                     gauss_table(order, prestress_points(order)),
                     gauss_table(order, mass_points_per_direction(order)),
                     make_line_table(basis, basis.nodes(), VectorXd::Zero(basis.nodes().size())),
                     {}};
  const Index m = tables.stiffness.weights.size();
  tables.stiffness_pairs.resize(4 * m, tables.stiffness.pairs[0].rows());
  for (Index k = 0; k < 4; ++k) {
    tables.stiffness_pairs.middleRows(k * m, m) = tables.stiffness.pairs[static_cast<size_t>(k)].transpose();
  }
  return tables;
}

const OrderTables& order_tables(int order) {
  static const std::array<OrderTables, max_hexahedron_order> tables = {
      make_order_tables(1), make_order_tables(2), make_order_tables(3), make_order_tables(4),
      make_order_tables(5), make_order_tables(6), make_order_tables(7), make_order_tables(8)};
  return tables[static_cast<size_t>(order - 1)];
}

// Contracts the first index with A (m x n) and moves it to the end: [a, rest] -> [rest, q].
MatrixXd contract_first(const MatrixXd& A, const MatrixXd& X) {
  const Index n = A.cols(), rest = X.size() / n;
  return transposed_product(Map<const MatrixXd>(X.data(), n, rest), A.transpose());
}

// Values (direction < 0) or slopes along `direction` of k fields (n^3 x k) at all points: k x m^3.
MatrixXd at_points(const LineTable& table, const MatrixXd& fields, int direction) {
  MatrixXd result = fields;
  for (int d = 0; d < 3; ++d) result = contract_first(table.by[d == direction ? 1 : 0], result);
  const Index m = table.weights.size();
  return Map<const MatrixXd>(result.data(), fields.cols(), m * m * m);
}

std::array<MatrixXd, 3> slopes_at_points(const LineTable& table, const MatrixXd& fields) {
  return {at_points(table, fields, 0), at_points(table, fields, 1), at_points(table, fields, 2)};
}

double weight_at(const LineTable& table, Index q) {
  const Index m = table.weights.size();
  return table.weights(q % m) * table.weights(q / m % m) * table.weights(q / (m * m));
}

Matrix3d jacobian(const std::array<MatrixXd, 3>& slopes, Index q) {
  Matrix3d J;
  J << slopes[0].col(q), slopes[1].col(q), slopes[2].col(q);
  return J;
}

VectorXd masses(const LineTable& table, const MatrixX3d& X, double rho) {
  const std::array<MatrixXd, 3> slopes = slopes_at_points(table, X);
  VectorXd dm(slopes[0].cols());
  for (Index q = 0; q < dm.size(); ++q) dm(q) = rho * weight_at(table, q) * jacobian(slopes, q).determinant();
  return dm;
}

// Volume and G(r, i) = d xi_r / d x_i at the strain points.
struct Metric {
  VectorXd volumes;
  std::vector<Matrix3d> G;
};

Metric metric(const LineTable& table, const MatrixX3d& X) {
  const std::array<MatrixXd, 3> slopes = slopes_at_points(table, X);
  Metric result{VectorXd(slopes[0].cols()), {}};
  result.G.reserve(static_cast<size_t>(result.volumes.size()));
  for (Index q = 0; q < result.volumes.size(); ++q) {
    const Matrix3d J = jacobian(slopes, q);
    result.volumes(q) = weight_at(table, q) * J.determinant();
    result.G.emplace_back(J.inverse());
  }
  return result;
}

// Adds the sums over the first two directions of c(q) f(a1, b1, q1) f(a2, b2, q2): n^4 x m, pairs of direction 1 first.
void add_two_directions(const MatrixXd& pairs_1, const MatrixXd& pairs_2, const VectorXd& c,
                        Eigen::Ref<MatrixXd> sums) {
  const Index m = pairs_1.cols(), n2 = pairs_1.rows();
  const MatrixXd first = pairs_1 * Map<const MatrixXd>(c.data(), m, m * m);
  for (Index q = 0; q < m; ++q) {
    Map<MatrixXd>(sums.col(q).data(), n2, n2).noalias() += first.middleCols(q * m, m) * pairs_2.transpose();
  }
}

// Block (i, j) of K over all pairs of nodes: n^4 x n^2, entry (a1 + n b1 + n^2 (a2 + n b2), a3 + n b3).
MatrixXd stiffness_block(const OrderTables& tables, const Metric& at, const Lame& lame, Index i, Index j) {
  const LineTable& line = tables.stiffness;
  const Index m = line.weights.size(), n2 = line.pairs[0].rows();
  MatrixXd sums = MatrixXd::Zero(n2 * n2, 4 * m);
  VectorXd c(m * m * m);
  for (int r = 0; r < 3; ++r) {
    for (int s = 0; s < 3; ++s) {
      for (Index q = 0; q < c.size(); ++q) {
        const Matrix3d& G = at.G[static_cast<size_t>(q)];
        const double isotropic = i == j ? G.row(r).dot(G.row(s)) : 0;
        c(q) = at.volumes(q) * (lame.lambda * G(r, i) * G(s, j) + lame.mu * (G(r, j) * G(s, i) + isotropic));
      }
      const auto kind = [r, s](int d) { return 2 * (r == d) + (s == d); };
      add_two_directions(line.pairs[static_cast<size_t>(kind(0))], line.pairs[static_cast<size_t>(kind(1))], c,
                         sums.middleCols(kind(2) * m, m));
    }
  }
  return sums * tables.stiffness_pairs;
}

// Calls visit(a, b, value of (a, b), value of (b, a)) for a >= b over a block as above.
template <class Visit>
void for_each_pair(const MatrixXd& block, Index n, const Visit& visit) {
  const Index n2 = n * n, n3 = n2 * n;
  for (Index b = 0; b < n3; ++b) {
    const Index b1 = b % n, b2 = b / n % n, b3 = b / n2;
    for (Index a3 = b3; a3 < n; ++a3) {
      for (Index a2 = a3 == b3 ? b2 : 0; a2 < n; ++a2) {
        const double* here = &block(n * b1 + n2 * (a2 + n * b2), a3 + n * b3);
        const double* there = &block(b1 + n2 * (b2 + n * a2), b3 + n * a3);
        const Index row = n * (a2 + n * a3);
        for (Index a1 = a3 == b3 && a2 == b2 ? b1 : 0; a1 < n; ++a1) visit(row + a1, b, here[a1], there[n * a1]);
      }
    }
  }
}

ShapeFunctions shapes_at(int order, const Vector3d& at) {
  const LobattoBasis& basis = lobatto_basis(order);
  std::array<std::array<VectorXd, 2>, 3> line;
  for (Index d = 0; d < 3; ++d) line[static_cast<size_t>(d)] = {basis.values(at(d)), basis.slopes(at(d))};
  const Index n = order + 1;
  ShapeFunctions shapes{VectorXd(n * n * n), MatrixX3d(n * n * n, 3)};
  for (Index a = 0; a < n * n * n; ++a) {
    const std::array<Index, 3> index = {a % n, a / n % n, a / (n * n)};
    const auto factor = [&](size_t d, size_t slope) { return line[d][slope](index[d]); };
    shapes.values(a) = factor(0, 0) * factor(1, 0) * factor(2, 0);
    for (size_t d = 0; d < 3; ++d) {
      shapes.gradients(a, static_cast<Index>(d)) = factor(0, d == 0) * factor(1, d == 1) * factor(2, d == 2);
    }
  }
  return shapes;
}

Vector3d point_of(const GaussRule& rule, Index q) {
  const Index m = rule.points.size();
  return {rule.points(q % m), rule.points(q / m % m), rule.points(q / (m * m))};
}

// Slopes of vectors q (freedoms x k) at the points of a line table, direction by direction.
elasticity::FieldSlopes field_slopes(const LineTable& line, const Metric& at, const Eigen::Ref<const MatrixXd>& q) {
  const std::array<MatrixXd, 3> slopes = slopes_at_points(line, elasticity::fields_of(q));
  elasticity::FieldSlopes fields(q.cols(), at.volumes.size());
  for (Index p = 0; p < at.volumes.size(); ++p) {
    fields.set(p, at.volumes(p), at.G[static_cast<size_t>(p)], {&slopes[0](0, p), &slopes[1](0, p), &slopes[2](0, p)});
  }
  return fields;
}

// The first point of a table at which the Jacobian is not positive, and its determinant; -1: none.
std::pair<int, double> inverted_point(const LineTable& table, const Mesh& mesh, const Element& element) {
  const std::array<MatrixXd, 3> slopes = slopes_at_points(table, elasticity::local_positions(mesh, element));
  for (Index q = 0; q < slopes[0].cols(); ++q) {
    const Matrix3d J = jacobian(slopes, q);
    const double determinant = J.determinant();
    if (!elasticity::is_valid(J, determinant)) return {static_cast<int>(q), determinant};
  }
  return {-1, 0};
}

}  // namespace

std::span<const int> Hexahedron::orders() { return all_orders; }

MatrixXd Hexahedron::stiffness(const Mesh& mesh, const Element& element) {
  const OrderTables& tables = order_tables(element.order);
  const Metric at = metric(tables.stiffness, elasticity::local_positions(mesh, element));
  const Lame lame = elasticity::lame(elasticity::material_of(mesh, element));
  const Index n = element.order + 1;
  MatrixXd K = MatrixXd::Zero(3 * n * n * n, 3 * n * n * n);
  for (Index i = 0; i < 3; ++i) {
    for (Index j = 0; j <= i; ++j) {
      for_each_pair(stiffness_block(tables, at, lame, i, j), n, [&](Index a, Index b, double ab, double ba) {
        K(3 * a + i, 3 * b + j) = ab;
        K(3 * a + j, 3 * b + i) = ba;
      });
    }
  }
  return K;
}

MatrixXd Hexahedron::mass(const Mesh& mesh, const Element& element) {
  const LineTable& line = order_tables(element.order).mass;
  const VectorXd dm =
      masses(line, elasticity::local_positions(mesh, element), elasticity::material_of(mesh, element).rho);
  const Index n = element.order + 1;
  MatrixXd sums = MatrixXd::Zero(n * n * n * n, line.weights.size());
  add_two_directions(line.pairs[0], line.pairs[0], dm, sums);
  MatrixXd M = MatrixXd::Zero(3 * n * n * n, 3 * n * n * n);
  for_each_pair(sums * line.pairs[0].transpose(), n, [&M](Index a, Index b, double ab, double) {
    for (Index i = 0; i < 3; ++i) M(3 * a + i, 3 * b + i) = ab;
  });
  return M;
}

void Hexahedron::mass_points(const Mesh& mesh, const Element& element, int extra, const MassPointVisitor& visit) {
  const int count = mass_points_per_direction(element.order) + extra;
  const MatrixX3d X = elasticity::local_positions(mesh, element);
  const Vector3d first = mesh.nodes.col(element.nodes[0]);
  const VectorXd dm = masses(gauss_table(element.order, count), X, elasticity::material_of(mesh, element).rho);
  elasticity::MassPoint point(X.rows());
  for (Index q = 0; q < dm.size(); ++q) {
    const VectorXd values = shapes_at(element.order, point_of(gauss_rule(count), q)).values;
    point.visit(dm(q), first + X.transpose() * values, values, visit);
  }
}

void Hexahedron::strain_points(const Mesh& mesh, const Element& element, const StrainPointVisitor& visit) {
  const MatrixXd D = elasticity::elasticity_matrix(elasticity::lame(elasticity::material_of(mesh, element)));
  const Metric at = metric(order_tables(element.order).stiffness, elasticity::local_positions(mesh, element));
  const GaussRule& rule = gauss_rule(stiffness_points(element.order));
  for (Index q = 0; q < at.volumes.size(); ++q) {
    const ShapeFunctions shapes = shapes_at(element.order, point_of(rule, q));
    visit(at.volumes(q), elasticity::strain_rows(shapes.gradients * at.G[static_cast<size_t>(q)]), D);
  }
}

Eigen::Matrix<double, 6, Eigen::Dynamic> Hexahedron::interpolation(const Mesh& mesh, const Element& element,
                                                                   const Vector3d& at) {
  const ShapeFunctions shapes = shapes_at(element.order, at);
  const Matrix3d J = elasticity::local_positions(mesh, element).transpose() * shapes.gradients;
  return elasticity::motion_rows(shapes.values, shapes.gradients * J.inverse());
}

Vector3d Hexahedron::position(const Mesh& mesh, const Element& element, const Vector3d& at) {
  const Vector3d first = mesh.nodes.col(element.nodes[0]);
  return first + elasticity::local_positions(mesh, element).transpose() * shapes_at(element.order, at).values;
}

MatrixXd Hexahedron::energy_strains(const Mesh& mesh, const Element& element, const Eigen::Ref<const MatrixXd>& q) {
  const LineTable& line = order_tables(element.order).stiffness;
  const Metric at = metric(line, elasticity::local_positions(mesh, element));
  return elasticity::energy_strains(field_slopes(line, at, q),
                                    elasticity::lame(elasticity::material_of(mesh, element)));
}

void Hexahedron::add_prestress_work(const Mesh& mesh, const Element& element, const Eigen::Ref<const MatrixXd>& q0,
                                    const Eigen::Ref<const MatrixXd>& q, Eigen::Ref<MatrixXd> work) {
  const LineTable& line = order_tables(element.order).prestress;
  const Metric at = metric(line, elasticity::local_positions(mesh, element));
  elasticity::add_prestress_work(field_slopes(line, at, q0), field_slopes(line, at, q),
                                 elasticity::lame(elasticity::material_of(mesh, element)), work);
}

void Hexahedron::validate(const Mesh& mesh, const Element& element) {
  elasticity::require_property(mesh, element);
  lobatto_basis(element.order);  // throws where there is none
  const OrderTables& tables = order_tables(element.order);
  for (const LineTable* table : {&tables.stiffness, &tables.mass}) {
    const auto [q, determinant] = inverted_point(*table, mesh, element);
    if (q >= 0) elasticity::throw_inverted(determinant, q);
  }
}

int Hexahedron::inverted_node(const Mesh& mesh, const Element& element) {
  return inverted_point(order_tables(element.order).nodes, mesh, element).first;
}

}  // namespace flexboom
