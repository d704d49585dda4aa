#include "fem/mesh/element.hpp"

#include "fem/base/check.hpp"
#include "fem/mesh/beam.hpp"
#include "fem/mesh/hexahedron.hpp"
#include "fem/mesh/solid.hpp"
#include "fem/mesh/solid_hex8.hpp"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <numbers>

namespace flexboom {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int max_gauss_points = 64;

// K = sum w B^T D B over the strain points of any element, lower triangle.
template <void (*strain_points)(const Mesh&, const Element&, const StrainPointVisitor&)>
MatrixXd stiffness_from_points(const Mesh& mesh, const Element& element) {
  MatrixXd K;
  strain_points(mesh, element, [&K](double weight, const MatrixXd& B, const MatrixXd& D) {
    if (K.size() == 0) K.setZero(B.cols(), B.cols());
    const MatrixXd DB = weight * D * B;
    K.triangularView<Eigen::Lower>() += B.transpose() * DB;
  });
  return K;
}

// M = sum dm N^T N over the mass points of any element, lower triangle.
template <void (*mass_points)(const Mesh&, const Element&, int, const MassPointVisitor&)>
MatrixXd mass_from_points(const Mesh& mesh, const Element& element) {
  MatrixXd M;
  mass_points(mesh, element, 0, [&M](double dm, const Vector3d&, const Eigen::Ref<const Eigen::Matrix3Xd>& N) {
    if (M.size() == 0) M.setZero(N.cols(), N.cols());
    M.selfadjointView<Eigen::Lower>().rankUpdate(N.transpose(), dm);
  });
  return M;
}

template <int count>
int fixed_count(int) {
  return count;
}
int no_internal_freedoms(const Mesh&, const Element&) { return 0; }
int no_inverted_node(const Mesh&, const Element&) { return -1; }

constexpr std::array<int, 1> first_order = {1}, second_order = {2};
constexpr std::array<int, 12> beam_orders = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
std::span<const int> linear() { return first_order; }
std::span<const int> quadratic() { return second_order; }
std::span<const int> of_beams() { return beam_orders; }

constexpr ElementType beam_row(std::string_view name) {
  return {name,
          Shape::line,
          6,
          fixed_count<2>,
          of_beams,
          beam::internal_freedoms,
          stiffness_from_points<beam::strain_points>,
          mass_from_points<beam::mass_points>,
          beam::mass_points,
          beam::strain_points,
          beam::interpolation,
          beam::position,
          beam::energy_strains,
          beam::add_prestress_work,
          beam::validate,
          no_inverted_node};
}

template <class Type, class Strains = Type>
constexpr ElementType solid_row(std::string_view name, Shape shape, int (*node_count)(int),
                                std::span<const int> (*orders)()) {
  return {name,
          shape,
          3,
          node_count,
          orders,
          no_internal_freedoms,
          Strains::stiffness,
          Type::mass,
          Type::mass_points,
          Strains::strain_points,
          Type::interpolation,
          Type::position,
          Strains::energy_strains,
          Strains::add_prestress_work,
          Type::validate,
          Type::inverted_node};
}

// The table: one row per element.
constexpr std::array<ElementType, 12> types{{
    beam_row("beam-euler-bernoulli"),
    beam_row("beam-timoshenko"),
    solid_row<Hexahedron>("hex", Shape::hexahedron, Hexahedron::node_count, Hexahedron::orders),
    solid_row<Solid<SolidKind::hex8>, Hex8<Hex8Strain::full>>("hex8", Shape::hexahedron, fixed_count<8>, linear),
    solid_row<Solid<SolidKind::hex8>, Hex8<Hex8Strain::reduced>>("hex8-reduced", Shape::hexahedron, fixed_count<8>,
                                                                 linear),
    solid_row<Solid<SolidKind::hex20>>("hex20", Shape::hexahedron, fixed_count<20>, quadratic),
    solid_row<Solid<SolidKind::hex20_reduced>>("hex20-reduced", Shape::hexahedron, fixed_count<20>, quadratic),
    solid_row<Solid<SolidKind::hex27>>("hex27", Shape::hexahedron, fixed_count<27>, quadratic),
    solid_row<Solid<SolidKind::tet4>>("tet4", Shape::tetrahedron, fixed_count<4>, linear),
    solid_row<Solid<SolidKind::tet10>>("tet10", Shape::tetrahedron, fixed_count<10>, quadratic),
    solid_row<Solid<SolidKind::wedge6>>("wedge6", Shape::wedge, fixed_count<6>, linear),
    solid_row<Solid<SolidKind::wedge15>>("wedge15", Shape::wedge, fixed_count<15>, quadratic),
}};

// Root i of P_n by Newton from the asymptotic estimate, in long double so that the rounded values are correct doubles.
GaussRule make_gauss_rule(int n) {
  GaussRule rule{Eigen::VectorXd(n), Eigen::VectorXd(n)};
  for (int i = 0; i < n; ++i) {
    long double x = -std::cos(std::numbers::pi_v<long double> * (i + 0.75L) / (n + 0.5L));
    long double slope = 1;
    for (int iteration = 0; iteration < 12; ++iteration) {
      long double p = x, previous = 1;
      for (int k = 1; k < n; ++k) {
        const long double next = ((2 * k + 1) * x * p - k * previous) / (k + 1);
        previous = p;
        p = next;
      }
      slope = n * (x * p - previous) / (x * x - 1);
      x -= p / slope;
    }
    if (2 * i + 1 == n) x = 0;
    rule.points(i) = static_cast<double>(x);
    rule.weights(i) = static_cast<double>(2 / ((1 - x * x) * slope * slope));
  }
  return rule;
}

}  // namespace

std::span<const ElementType> element_types() { return types; }

int element_type(std::string_view name) {
  std::string known;
  for (size_t i = 0; i < types.size(); ++i) {
    if (types[i].name == name) return static_cast<int>(i);
    known += fmt::format("{}\"{}\"", i ? ", " : "", types[i].name);
  }
  throw InputError(fmt::format("element type \"{}\" is not known; there are {}", name, known));
}

const ElementType& type_of(const Element& element) { return types[static_cast<size_t>(element.type)]; }

const GaussRule& gauss_rule(int n) {
  static std::array<GaussRule, max_gauss_points + 1> rules;
  static std::array<std::once_flag, max_gauss_points + 1> made;
  require(n >= 1 && n <= max_gauss_points,
          fmt::format("Gauss rule of {} points; there are 1 to {}", n, max_gauss_points));
  const auto i = static_cast<size_t>(n);
  std::call_once(made[i], [n, i] { rules[i] = make_gauss_rule(n); });
  return rules[i];
}

void nodal_body_mass_points(const Mesh& mesh, const NodalBody& body, const MassPointVisitor& visit) {
  if (body.mass == 0) return;
  const Vector3d node = mesh.nodes.col(body.node);
  // Second moments integral(r r^T) = tr(J)/2 - J. A pair of points m/6 at +-a along each principal axis has 2 m/6 a^2
  // there.
  const Matrix3d moments = body.inertia.trace() / 2 * Matrix3d::Identity() - body.inertia;
  const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(moments);
  Eigen::Matrix3Xd N = Eigen::Matrix3Xd::Zero(3, 6);
  N.leftCols<3>().setIdentity();
  for (int axis = 0; axis < 3; ++axis) {
    const double a = std::sqrt(3 * std::max(principal.eigenvalues()(axis), 0.0) / body.mass);
    for (const double sign : {1.0, -1.0}) {
      const Vector3d r = body.offset + sign * a * principal.eigenvectors().col(axis);
      for (int k = 0; k < 3; ++k) N.col(3 + k) = Vector3d::Unit(k).cross(r);  // u = u_node + theta x r
      visit(body.mass / 6, node + r, N);
    }
  }
}

}  // namespace flexboom
