#include "solid_testing.hpp"

#include <fmt/format.h>

namespace flexboom::testing {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

const ElementType& hex() { return element_types()[static_cast<size_t>(element_type("hex"))]; }

// A quarter of a round bar, y, z >= 0, axis along x: a core and two blocks around it, `cells` elements along.
Mesh quarter_bar(int order, double radius, double length, int cells) {
  const double c = 0.55 * radius, d = 0.38 * radius;  // corners of the core on the axes and on the diagonal
  using Eigen::Vector2d;
  const auto arc = [radius](double angle) { return Vector2d(radius * std::cos(angle), radius * std::sin(angle)); };
  const auto blend = [](double s, const Vector2d& a, const Vector2d& b) { return Vector2d((1 - s) * a + s * b); };
  const auto core = [&](double s, double t) {
    return Vector2d((1 - s) * (1 - t) * Vector2d(0, 0) + s * (1 - t) * Vector2d(c, 0) + s * t * Vector2d(d, d) +
                    (1 - s) * t * Vector2d(0, c));
  };
  const auto first = [&](double s, double t) { return blend(s, core(1, t), arc(t * pi / 4)); };
  const auto second = [&](double s, double t) { return blend(t, core(s, 1), arc(pi / 2 - s * pi / 4)); };
  SolidBuilder builder(aluminium, 1e-9 * radius);
  for (int k = 0; k < cells; ++k) {
    for (int block = 0; block < 3; ++block) {
      builder.add(hex(), order, [&](const Vector3d& xi) {
        const Vector3d u = (xi.array() + 1) / 2;
        const Vector2d yz = block == 0 ? core(u(0), u(1)) : block == 1 ? first(u(0), u(1)) : second(u(0), u(1));
        return Vector3d((k + u(2)) * length / cells, yz(0), yz(1));
      });
    }
  }
  return builder.take();
}

// What a motion is about the planes y = 0 and z = 0: `even` keeps the plane (its normal displacement is zero).
struct Parity {
  bool even_y, even_z;
};
bool held_by(const Parity& parity, const Vector3d& x, int k, double tolerance) {
  if (std::abs(x(1)) < tolerance && (parity.even_y ? k == 1 : k != 1)) return true;
  return std::abs(x(2)) < tolerance && (parity.even_z ? k == 2 : k != 2);
}

// Exact three-dimensional elasticity (Pochhammer, Chree) of a round bar whose end faces carry uy = uz = 0: wave number
// pi / L, of which half of the length is enough: its middle face keeps ux = 0. Reference good to 13 digits.
void expect_pochhammer_chree(int order, double tolerance) {
  constexpr double L = 0.03, R = 0.005;
  const Mesh mesh = quarter_bar(order, R, L / 2, 1);
  const std::map<std::string, Parity> families = {
      {"flexural n=1", {false, true}}, {"torsion n=0", {false, false}}, {"longitudinal n=0", {true, true}}};
  int compared = 0;
  for (const auto& cells : reference_rows("cylinder_diaphragm_ends_exact_3d_hz.csv", "stub_L30_R5")) {
    if (cells[4] != "1") continue;
    const Parity parity = families.at(cells[3]);
    const std::vector<int> free = free_of(mesh, [&](const Vector3d& x, int k) {
      if (x(0) < 1e-9 && k != 0) return true;
      if (x(0) > L / 2 - 1e-9 && k == 0) return true;
      return held_by(parity, x, k, 1e-9);
    });
    const double error = solid_frequencies_hz(mesh, free, 1)[0] / std::stod(cells[5]) - 1;
    ::testing::Test::RecordProperty(cells[3], fmt::format("{:.2e}", error));
    EXPECT_LT(std::abs(error), tolerance) << cells[3];
    ++compared;
  }
  EXPECT_EQ(compared, 3);
}

// Reached at p = 5: 3.1e-8; at p = 6: 1.4e-10; at p = 8: 5e-16.
TEST(Hexahedron, RoundBarWithDiaphragmsMatchesPochhammerChree) { expect_pochhammer_chree(5, 5e-8); }
TEST(SlowHexahedron, RoundBarWithDiaphragmsMatchesPochhammerChreeToRoundOff) { expect_pochhammer_chree(8, 1e-12); }

// Torsion of a clamped round bar is exact in one dimension: f = (2 k - 1) / (4 L) sqrt(G / rho).
TEST(Hexahedron, TorsionOfClampedRoundBarMatchesClosedForm) {
  constexpr double L = 0.03, R = 0.005;
  const Mesh mesh = quarter_bar(6, R, L, 1);
  const std::vector<int> free = free_of(mesh, [](const Vector3d& x, int k) {
    return x(0) < 1e-9 || held_by({false, false}, x, k, 1e-9);
  });
  const double exact = std::sqrt(aluminium.shear_modulus() / aluminium.rho) / (4 * L);
  const double error = solid_frequencies_hz(mesh, free, 1)[0] / exact - 1;
  RecordProperty("relative_error", fmt::format("{:.2e}", error));
  EXPECT_LT(std::abs(error), 1e-10);  // reached: 2e-11
}

// An octant of a free cube holds one class of its motions: bit d of `odd` says that the motion is odd about the plane
// across axis d, so that the plane keeps its normal displacement alone.
std::vector<double> free_cube(int order, double nu, int odd, int count) {
  const Mesh mesh = box(hex(), order, {1, 1, 1}, stretch(0.5, 0.5, 0.5), {1, nu, 1});
  const std::vector<int> free = free_of(mesh, [odd](const Vector3d& x, int k) {
    for (int plane = 0; plane < 3; ++plane) {
      const bool even = (odd >> plane & 1) == 0;
      if (x(plane) < 1e-9 && (even ? k == plane : k != plane)) return true;
    }
    return false;
  });
  return solid_frequencies_hz(mesh, free, count, 0.1);  // the shift holds rigid motions
}

// The Lame mode of a cube keeps its volume: f = sqrt(mu / (2 rho)) / a for any Poisson's ratio.
TEST(Hexahedron, LameModeOfCubeIsExact) {
  for (const double nu : {0.3, 0.499, 0.4999}) {
    const double exact = std::sqrt(1 / (2 * (1 + nu)) / 2);
    EXPECT_NEAR(free_cube(6, nu, 0, 1)[0] / exact, 1, 1e-9) << nu;  // of degree 6 per half wave
  }
}

// Modes of four classes against a converged p-FEM reference, good to 4e-8 (13 modes). Eight elements of order 8: stress
// has a weak singularity at corners of the cube, so that errors are up to 2.2e-7, from above.
TEST(SlowHexahedron, FreeCubeMatchesReference) {
  struct ClassOfModes {
    int odd, rigid;
    std::string name;
  };
  for (const std::string nu : {"0.3", "0.499"}) {
    for (const auto& [odd, rigid, name] : {ClassOfModes{0, 0, "000"}, {1, 1, "100"}, {3, 1, "110"}, {7, 0, "111"}}) {
      const std::vector<double> found = free_cube(8, std::stod(nu), odd, 3);
      std::vector<double> expected;  // one of each set of equal modes but for 000 and 111, which have them in one class
      for (const auto& cells : reference_rows("unit_cube_free_3d_hz.csv", nu)) {
        if (cells[4] == name) expected.push_back(std::stod(cells[2]));
      }
      for (size_t m = static_cast<size_t>(rigid); m < 3; ++m) {
        const size_t place = rigid == 1 ? 3 * (m - 1) : m;
        EXPECT_NEAR(found[m] / expected[place], 1, 3e-7) << "nu " << nu << " class " << name << " mode " << m;
      }
    }
  }
}

}  // namespace
}  // namespace flexboom::testing
