#include "solid_testing.hpp"

#include <fmt/format.h>

namespace flexboom::testing {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

const ElementType& row(const std::string& name) { return element_types()[static_cast<size_t>(element_type(name))]; }

bool on_boundary(const Vector3d& u) { return u.minCoeff() < 1e-9 || u.maxCoeff() > 1 - 1e-9; }

// Corners of a box of 3 x 3 x 3 cells, the inner ones off their places.
Vector3d shaken(const Vector3d& u) {
  if (on_boundary(u)) return u;
  return u +
         0.05 * Vector3d(std::sin(17 * u(0) + 5 * u(1)), std::sin(23 * u(1) + 3 * u(2)), std::cos(19 * u(2) + u(0)));
}

// Straight-sided cells of a box; those of the middle layer (along x) are of `middle`, the others of `outer`.
Mesh shaken_box(const ElementType& outer, const ElementType& middle, int order) {
  SolidBuilder builder(aluminium);
  for (int c = 0; c < 27; ++c) {
    const Vector3d cell(c % 3, c / 3 % 3, c / 9);
    const ElementType& type = c % 3 == 1 ? middle : outer;
    for (const Map3& piece : pieces_of_cube(type.shape)) {
      builder.add(type, order, straight(type.shape, [&](const Vector3d& x) {
                    return shaken((cell + (piece(x).array() + 1).matrix() / 2) / 3);
                  }));
    }
  }
  return builder.take();
}

// With a linear displacement on the boundary, a distorted mesh takes it inside as well: constant strain.
void expect_patch_test(const Mesh& mesh) {
  const Assembly a = assemble(mesh);
  const Matrix3d G = (Matrix3d() << 1, 2, -1, 0.4, -2, 3, 1, 0, 0.5).finished();
  VectorXd exact(a.dofs.count), u = VectorXd::Zero(a.dofs.count);
  for (Index i = 0; i < mesh.nodes.cols(); ++i) exact.segment<3>(3 * i) = G * mesh.nodes.col(i);
  const std::vector<int> inside = free_of(mesh, [](const Vector3d& x, int) { return on_boundary(x); });
  ASSERT_GT(inside.size(), 20U);
  u = exact;
  for (const int dof : inside) u(dof) = 0;
  const SparseMatrix K = a.K.selfadjointView<Eigen::Lower>();
  const VectorXd load = -(K * u);
  const VectorXd found = full(a.K, inside).llt().solve(VectorXd(load(inside)));
  EXPECT_LT((found - VectorXd(exact(inside))).cwiseAbs().maxCoeff(), 1e-11) << "condition 1e4 of displacements of 3";
}

class Patch : public ::testing::TestWithParam<std::tuple<std::string, std::string, int>> {};

TEST_P(Patch, LinearDisplacementIsExactOnDistortedMesh) {
  const auto& [outer, middle, order] = GetParam();
  expect_patch_test(shaken_box(row(outer), row(middle), order));
}

INSTANTIATE_TEST_SUITE_P(Shapes, Patch,
                         ::testing::Values(std::tuple("hex8", "wedge6", 1), std::tuple("hex8-reduced", "hex8", 1),
                                           std::tuple("hex8-reduced", "wedge6", 1), std::tuple("hex", "hex8", 1),
                                           std::tuple("tet4", "tet4", 1), std::tuple("hex20", "wedge15", 2),
                                           std::tuple("hex20", "hex20-reduced", 2), std::tuple("hex27", "hex27", 2),
                                           std::tuple("wedge15", "hex20-reduced", 2), std::tuple("tet10", "tet10", 2),
                                           std::tuple("hex", "hex", 2), std::tuple("hex", "hex", 3)));

// A box whose faces slide: u . n = 0 and no shear. Shear waves u = rot (0, 0, ...) with wave vector pi (i / Lx, j / Ly,
// k / Lz) are exact: f = |k| sqrt(mu / rho) / (2 pi) for two of the three numbers not zero.
struct SlidingBox {
  Vector3d size{1, 1.1, 1.25};
  Material material{1, 0.3, 1};

  double lowest() const {  // (0, 1, 1)
    return std::sqrt(material.shear_modulus() / material.rho) / 2 * Vector3d(0, 1 / size(1), 1 / size(2)).norm();
  }
  // Cells of smooth, curved shape inside; their faces meet the faces of the box where they are.
  Mesh mesh(const ElementType& type, int order, int n) const {
    return box(
        type, order, {n, n, n},
        [this](const Vector3d& u) {
          const Vector3d s = (pi * u).array().sin();
          const Vector3d bent = u + 0.06 * Vector3d(s(0) * std::cos(2 * u(1) + u(2)), s(1) * std::cos(3 * u(0)),
                                                    s(2) * std::sin(2 * u(0) + u(1)));
          return Vector3d(bent.cwiseProduct(size));
        },
        material);
  }
  std::vector<int> free(const Mesh& mesh) const {
    return free_of(mesh, [this](const Vector3d& x, int k) { return x(k) < 1e-9 || x(k) > size(k) - 1e-9; });
  }
  double error(const ElementType& type, int order, int n) const {
    const Mesh m = mesh(type, order, n);
    return solid_frequencies_hz(m, free(m), 1)[0] / lowest() - 1;
  }
};

struct ConvergenceCase {
  std::string name;
  int order, cells, more_cells;
};
void PrintTo(const ConvergenceCase& c, std::ostream* out) { *out << c.name << " order " << c.order; }

class SolidConvergence : public ::testing::TestWithParam<ConvergenceCase> {};

// Eigenvalues of shapes of degree p converge like h^(2 p).
TEST_P(SolidConvergence, HasOrderTwiceP) {
  const auto& [name, order, cells, more_cells] = GetParam();
  const double coarse = SlidingBox{}.error(row(name), order, cells);
  const double fine = SlidingBox{}.error(row(name), order, more_cells);
  const double observed = std::log(std::abs(coarse / fine)) / std::log(static_cast<double>(more_cells) / cells);
  RecordProperty("observed_order", fmt::format("{:.2f}", observed));
  EXPECT_GT(observed, 2 * order - 0.4) << coarse << " -> " << fine;  // not yet asymptotic
}

INSTANTIATE_TEST_SUITE_P(Rows, SolidConvergence,
                         ::testing::Values(ConvergenceCase{"hex", 1, 4, 8}, ConvergenceCase{"hex", 2, 2, 4},
                                           ConvergenceCase{"hex", 3, 2, 3}, ConvergenceCase{"hex", 4, 1, 2},
                                           ConvergenceCase{"hex8", 1, 4, 8}, ConvergenceCase{"hex8-reduced", 1, 4, 8},
                                           ConvergenceCase{"hex20", 2, 3, 5}, ConvergenceCase{"hex20-reduced", 2, 3, 5},
                                           ConvergenceCase{"hex27", 2, 2, 4}, ConvergenceCase{"tet4", 1, 4, 8},
                                           ConvergenceCase{"tet10", 2, 4, 6}, ConvergenceCase{"wedge6", 1, 4, 8},
                                           ConvergenceCase{"wedge15", 2, 3, 5}),
                         [](const auto& c) { return row_name(row(c.param.name), c.param.order); });

// First bending frequency of a free block, nearly incompressible, 2 x 2 x 8 cells or fewer of higher order: a
// locking element is too stiff by tens of per cent.
TEST(SolidLocking, NearlyIncompressibleBlockBends) {
  const Material rubber{1, 0.4999, 1};
  const auto first = [&](const std::string& name, int order, const std::array<int, 3>& cells) {
    const Mesh mesh = box(row(name), order, cells, stretch(1, 0.8, 5), rubber);
    return solid_frequencies_hz(mesh, free_of(mesh, [](const Vector3d&, int) { return false; }), 7, 0.05)[6];
  };
  const double reference = first("hex", 5, {1, 1, 2});
  for (const std::string name : {"hex8", "hex8-reduced", "hex20", "hex20-reduced", "hex27", "tet10", "wedge15"}) {
    const double error = first(name, 2, {2, 2, 8}) / reference - 1;
    RecordProperty(name, fmt::format("{:.2e}", error));
    EXPECT_LT(std::abs(error), 0.05) << name;
  }
  for (const int order : {2, 3, 4}) {
    const double error = first("hex", order, {1, 1, 4}) / reference - 1;
    RecordProperty(fmt::format("hex_order_{}", order), fmt::format("{:.2e}", error));
    EXPECT_LT(std::abs(error), 0.05) << "order " << order;
  }
}

// A strip of ten elements 100 times as long as thick, nu = 0, clamped: an Euler-Bernoulli beam to 1e-5.
TEST(SolidLocking, ThinElementsBend) {
  const Material plain{1, 0, 1};
  const double exact = 1.8751040687119612 * 1.8751040687119612 / std::sqrt(12.0) / (1000.0 * 1000.0) / (2 * pi);
  for (const std::string name : {"hex8", "hex8-reduced", "hex20", "hex20-reduced", "hex27", "wedge15", "hex"}) {
    const Mesh mesh = box(row(name), 2, {1, 1, 10}, stretch(10, 1, 1000), plain);
    const std::vector<int> free = free_of(mesh, [](const Vector3d& x, int k) { return x(2) < 1e-9 || k == 0; });
    const double error = solid_frequencies_hz(mesh, free, 1)[0] / exact - 1;
    RecordProperty(name, fmt::format("{:.2e}", error));
    EXPECT_LT(std::abs(error), 0.01) << name;  // of ten elements of degree 2
  }
}

// On a parallelepiped the reduced element is the full one.
TEST(Hex8, ReducedIsFullOnParallelepiped) {
  const Map3 skew = [](const Vector3d& x) {
    return Vector3d(x(0) + 0.3 * x(1), 2 * x(1) - 0.2 * x(2), 0.7 * x(2) + 0.1 * x(0));
  };
  const Mesh full = one_solid(row("hex8"), 1, skew), reduced = one_solid(row("hex8-reduced"), 1, skew);
  const MatrixXd K = row("hex8").stiffness(full, full.elements[0]);
  const MatrixXd reduced_K = row("hex8-reduced").stiffness(reduced, reduced.elements[0]);
  EXPECT_LT((K - reduced_K).cwiseAbs().maxCoeff(), 1e-14 * K.diagonal().maxCoeff());
}

// Pure bending of one distorted-free brick is exact for any nu: u = (x y, -(x^2 + nu (y^2 - z^2)) / 2, -nu y z) has the
// energy E V <y^2> / 2 and is trilinear at the corners.
TEST(Hex8, BendsExactly) {
  for (const double nu : {0.0, 0.3, 0.4999}) {
    const Mesh mesh = one_solid(row("hex8"), 1, stretch(2, 0.5, 0.7), {1, nu, 1});
    VectorXd q(24);
    for (Index a = 0; a < 8; ++a) {
      const double x = mesh.nodes(0, a), y = mesh.nodes(1, a), z = mesh.nodes(2, a);
      q.segment<3>(3 * a) << x * y, -(x * x + nu * (y * y - z * z)) / 2, -nu * y * z;
    }
    const double volume = 8 * 2 * 0.5 * 0.7, mean = 0.5 * 0.5 / 3;
    EXPECT_NEAR(row("hex8").energy_strains(mesh, mesh.elements[0], q).squaredNorm() / (volume * mean), 1, 1e-11) << nu;
  }
}

// Of a nearly incompressible element only its volume is stiff: one eigenvalue of K grows with the bulk modulus.
TEST(Hex8, OnlyVolumeIsStiffWhenNearlyIncompressible) {
  for (const std::string name : {"hex8", "hex8-reduced"}) {
    const Mesh mesh = one_solid(row(name), 1, stretch(1, 1, 1), {3, 0.499999, 1});  // mu = 1
    const MatrixXd K = row(name).stiffness(mesh, mesh.elements[0]).selfadjointView<Eigen::Lower>();
    const VectorXd values = Eigen::SelfAdjointEigenSolver<MatrixXd>(K).eigenvalues();
    EXPECT_GT(values(23), 1e5) << name;
    EXPECT_LT(values(22), 10) << name;
  }
}

TEST(SolidValidation, InvertedElementNamesPlaceAndCure) {
  Mesh mesh = one_solid(row("hex20"), 2, distort);
  mesh.node_labels.resize(20);
  for (size_t i = 0; i < 20; ++i) mesh.node_labels[i] = 100 + static_cast<long>(i);
  mesh.element_labels = {1234};
  std::swap(mesh.elements[0].nodes[0], mesh.elements[0].nodes[6]);
  const std::string text = input_error([&] { mesh.validate(); });
  EXPECT_NE(text.find("hex20 element 1234: inverted (Jacobian -"), std::string::npos) << text;
  EXPECT_NE(text.find("); reorder its nodes or repair the mesh"), std::string::npos) << text;
}

// A corner beyond the opposite edge turns the Jacobian there; integration points follow later.
TEST(SolidValidation, InvertedCornerIsAWarningUntilAnIntegrationPointFollows) {
  for (const std::string name :
       {"hex", "hex8", "hex8-reduced", "hex20", "hex20-reduced", "hex27", "tet10", "wedge6", "wedge15"}) {
    const Mesh upright = one_solid(row(name), 2, [](const Vector3d& x) { return x; });
    EXPECT_TRUE(suspicions(upright).empty()) << name;
    const Vector3d inward = upright.nodes.rowwise().mean() - upright.nodes.col(0);
    bool warned = false;
    std::string error = "nothing was thrown";
    for (double part = 0; part < 3 && error == "nothing was thrown"; part += 0.02) {
      Mesh mesh = upright;
      mesh.nodes.col(0) += part * inward;
      error = input_error([&] { mesh.validate(); });
      if (error != "nothing was thrown") break;
      warned = !suspicions(mesh).empty();
      if (!warned) continue;
      EXPECT_NE(suspicions(mesh).front().find("1 elements have a Jacobian that is not positive at a node"),
                std::string::npos);
      const Assembly a = assemble(mesh);
      const VectorXd lowest = Eigen::SelfAdjointEigenSolver<MatrixXd>(full(a.K)).eigenvalues();
      EXPECT_GT(lowest(0), -1e-9 * lowest.tail<1>()(0)) << name << " " << part;
    }
    EXPECT_TRUE(warned) << name;
    EXPECT_NE(error.find("integration point"), std::string::npos) << name << ": " << error;
  }
}

TEST(SolidValidation, FlatAndMirroredElementsAreRefused) {
  for (const ElementType& type : element_types()) {
    if (!is_solid(type)) continue;
    const int order = type.orders().back();
    const Mesh mirrored = one_solid(type, order, stretch(-1, 1, 1)), flat = one_solid(type, order, stretch(1, 1, 0));
    const auto found = [&](const Mesh& mesh) { return input_error([&] { type.validate(mesh, mesh.elements[0]); }); };
    EXPECT_NE(found(mirrored).find("inverted"), std::string::npos) << type.name;
    EXPECT_NE(found(flat).find("inverted"), std::string::npos) << type.name;
    const Mesh thin = one_solid(type, order, stretch(1, 1, 1e-7));
    EXPECT_EQ(found(thin), "nothing was thrown") << type.name;
  }
}

// Rules of tetrahedra and wedges against factorial formulas of monomials.
TEST(PointRules, IntegrateTheirDegrees) {
  const auto factorial = [](int n) { return std::tgamma(n + 1.0); };
  const auto check = [&](const PointRule& rule, int degree, int height_degree, bool wedge) {
    for (int i = 0; i <= degree; ++i) {
      for (int j = 0; i + j <= degree; ++j) {
        for (int k = 0; wedge ? k <= height_degree : i + j + k <= degree; ++k) {
          const Eigen::Array3Xd x = rule.points.array();
          const double sum = (x.row(0).pow(i) * x.row(1).pow(j) * x.row(2).pow(k)).matrix().dot(rule.weights);
          const double exact = wedge ? factorial(i) * factorial(j) / factorial(i + j + 2) * (k % 2 ? 0 : 2.0 / (k + 1))
                                     : factorial(i) * factorial(j) * factorial(k) / factorial(i + j + k + 3);
          EXPECT_NEAR(sum, exact, 4 * eps) << rule.weights.size() << " points: " << i << j << k;
        }
      }
    }
  };
  check(tetrahedron_rule(1), 1, 0, false);
  check(tetrahedron_rule(4), 2, 0, false);
  check(tetrahedron_rule(15), 5, 0, false);
  check(collapsed_tetrahedron_rule(5), 7, 0, false);
  check(wedge_rule(1, 2), 1, 3, true);
  check(wedge_rule(3, 3), 2, 5, true);
  check(wedge_rule(6, 3), 4, 5, true);
  check(collapsed_wedge_rule(4), 6, 7, true);
}

// The orders of VTK and Abaqus, written out once more: corners, then middles of the listed edges, then single places.
TEST(ShapeFunctions, NodesAreInOrderOfVtkAndAbaqus) {
  struct Order {
    Shape shape;
    std::vector<Vector3d> corners;
    std::vector<std::pair<size_t, size_t>> edges;
    std::vector<Vector3d> others;
  };
  const std::vector<Order> orders = {
      {Shape::hexahedron,
       {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}},
       {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6}, {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}},
       {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}, {0, 0, 0}}},
      {Shape::tetrahedron,
       {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
       {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}},
       {}},
      {Shape::wedge,
       {{0, 0, -1}, {1, 0, -1}, {0, 1, -1}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}},
       {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}},
       {}}};
  for (const Order& order : orders) {
    std::vector<Vector3d> places = order.corners;
    for (const auto& [a, b] : order.edges) places.emplace_back((order.corners[a] + order.corners[b]) / 2);
    places.insert(places.end(), order.others.begin(), order.others.end());
    for (const ElementType& type : element_types()) {
      if (type.shape != order.shape || type.name == "hex") continue;
      const Mesh mesh = one_solid(type, type.orders()[0], [](const Vector3d& x) { return x; });
      ASSERT_LE(mesh.nodes.cols(), std::ssize(places));
      for (Index a = 0; a < mesh.nodes.cols(); ++a) {
        const MatrixXd N = type.interpolation(mesh, mesh.elements[0], places[static_cast<size_t>(a)]);
        EXPECT_NEAR(N(0, 3 * a), 1, 1e-14) << type.name << " node " << a;
      }
    }
  }
}

TEST(ShapeFunctions, AreOneAtTheirNodesAndZeroAtOthers) {
  for (const ElementType& type : element_types()) {
    if (!is_solid(type)) continue;
    for (const int order : type.orders()) {
      const Mesh mesh = one_solid(type, order, distort);
      const Eigen::Matrix3Xd reference = reference_nodes(type, order);
      MatrixXd rows(3 * reference.cols(), 3 * reference.cols());
      for (Index a = 0; a < reference.cols(); ++a) {
        rows.middleRows<3>(3 * a) = type.interpolation(mesh, mesh.elements[0], reference.col(a)).topRows<3>();
      }
      EXPECT_TRUE(rows.isIdentity(1e-14)) << type.name;
    }
  }
}

}  // namespace
}  // namespace flexboom::testing
