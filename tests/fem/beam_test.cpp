#include "fem_testing.hpp"

#include <fmt/format.h>

namespace flexboom::testing {
namespace {

const RoundBar boom4_section{0.010};
constexpr double boom4_length = 0.302;

// Columns of boom_beam_frequencies_hz.csv.
enum Column { euler_bernoulli = 2, rayleigh, timoshenko_cowper, timoshenko_nu_squared, timoshenko_number, axial };

double largest_error(const std::vector<double>& f, Column column, const std::string& boom = "4") {
  const auto rows = reference_rows("boom_beam_frequencies_hz.csv", boom);
  double error = 0;
  for (size_t k = 0; k < rows.size(); ++k) {
    const double reference = std::stod(rows[k][column]);
    error = std::max(error, std::abs(f[k] - reference) / reference);
  }
  ::testing::Test::RecordProperty("relative_error", fmt::format("{:.2e}", error));
  return error;
}

BeamGeometry boom4(BeamTheory theory, const ShearRule& rule = {}) {
  BeamGeometry boom = uniform_boom(boom4_section, boom4_length, theory, 5, 8);
  boom.shear = rule;
  return boom;
}

// Reference data good to 14 digits; discretisation error below 1e-13 with five elements of order 8. Round-off: the
// condition of the scaled K is some 1e4, the Rayleigh quotient squares the error of the vector: 1e-12 leaves room.
constexpr double frequency_tolerance = 1e-12;

TEST(BeamFrequencies, TimoshenkoMatchesReferenceWithCowper) {
  EXPECT_LT(
      largest_error(clamped_frequencies_hz(boom4(BeamTheory::timoshenko, {"cowper", 0}), 1, 6), timoshenko_cowper),
      frequency_tolerance);
}

TEST(BeamFrequencies, TimoshenkoMatchesReferenceWithNuSquared) {
  EXPECT_LT(largest_error(clamped_frequencies_hz(boom4(BeamTheory::timoshenko, {"nu-squared", 0}), 2, 6),
                          timoshenko_nu_squared),
            frequency_tolerance);
}

TEST(BeamFrequencies, TimoshenkoMatchesReferenceWithNumber) {
  EXPECT_LT(
      largest_error(clamped_frequencies_hz(boom4(BeamTheory::timoshenko, {"value", 0.9}), 1, 6), timoshenko_number),
      frequency_tolerance);
}

TEST(BeamFrequencies, EulerBernoulliWithRotaryInertiaMatchesRayleigh) {
  EXPECT_LT(largest_error(clamped_frequencies_hz(boom4(BeamTheory::euler_bernoulli), 1, 6), rayleigh),
            frequency_tolerance);
}

TEST(BeamFrequencies, LineMassMatchesEulerBernoulli) {
  BeamGeometry boom = boom4(BeamTheory::euler_bernoulli);
  boom.rotary_inertia = false;
  EXPECT_LT(largest_error(clamped_frequencies_hz(boom, 2, 6), euler_bernoulli), frequency_tolerance);
}

TEST(BeamFrequencies, AxialMatchesBar) {
  EXPECT_LT(largest_error(clamped_frequencies_hz(boom4(BeamTheory::timoshenko), 0, 6), axial), frequency_tolerance);
}

TEST(BeamFrequencies, TorsionOfRoundBarMatchesClosedForm) {
  const std::vector<double> f = clamped_frequencies_hz(boom4(BeamTheory::timoshenko), 3, 6);
  for (int k = 0; k < 6; ++k) {  // f = (2k + 1) / (4 L) sqrt(G / rho), as J is the polar moment
    const double exact = (2 * k + 1) / (4 * boom4_length) * std::sqrt(aluminium.shear_modulus() / aluminium.rho);
    EXPECT_NEAR(f[static_cast<size_t>(k)] / exact, 1, frequency_tolerance);
  }
}

// Modes 1 to 10 against alpha_k^2 sqrt(EI / (rho A L^4)), with a handful of elements of high order.
struct TenModesCase {
  int elements, order;
  double tolerance;  // truncation of mode 10 by the rate 2 (p + 1), or 1e-14 of round-off (reached: 5e-16)
};

TEST(BeamFrequencies, TenModesOfLineMassMatchClosedForm) {
  const double d = boom4_section.diameter, L = boom4_length;
  const double unit = std::sqrt(aluminium.E * d * d / 16 / aluminium.rho) / (L * L) / (2 * pi);
  for (const auto& [elements, order, tolerance] :
       {TenModesCase{7, 8, 2e-11}, TenModesCase{8, 8, 2e-12}, TenModesCase{8, 10, 1e-14}}) {
    BeamGeometry boom = uniform_boom(boom4_section, L, BeamTheory::euler_bernoulli, elements, order);
    boom.rotary_inertia = false;
    const std::vector<double> f = clamped_frequencies_hz(boom, 1, 10);
    for (size_t k = 0; k < 10; ++k) {
      const double alpha = std::stod(reference_rows("eq14_roots.csv", std::to_string(k + 1))[0][1]);
      const double error = f[k] / (alpha * alpha * unit) - 1;
      RecordProperty(fmt::format("elements_{}_order_{}_mode_{}", elements, order, k + 1), fmt::format("{:.2e}", error));
      EXPECT_LT(std::abs(error), tolerance) << elements << " elements of order " << order << ", mode " << k + 1;
    }
  }
}

// NAFEMS FV5: deep square beam on simple supports, free to turn; references recomputed, 12 digits (torsion constant 9).
TEST(BeamFrequencies, NafemsFv5) {
  BeamGeometry boom = uniform_boom(Rectangle{2, 2}, 10, BeamTheory::timoshenko, 5, 8);
  boom.segments[0].material = {200e9, 0.3, 8000};
  const Mesh mesh = make_mesh(boom);
  const Assembly a = assemble(mesh);
  const int tip = node_set(mesh, "tip")[0];
  std::vector<int> free;
  for (int dof = 0; dof < a.dofs.count; ++dof) {
    const bool held = dof < 4 || dof == a.dofs.of_node(tip, 1) || dof == a.dofs.of_node(tip, 2);
    if (!held) free.push_back(dof);
  }
  const std::vector<double> bending = dense_frequencies_hz(mesh, a, coupled_with(a, free, a.dofs.of_node(0, 5)), 3);
  const auto rows = reference_rows("nafems_hz.csv", "FV5 section 2x2 m");
  size_t mode = 0;
  for (const auto& row : rows) {  // the mode column holds a quoted pair, so cells after it move by one
    if (row.back().find("Cowper") == std::string::npos) continue;
    EXPECT_NEAR(bending[mode++] / std::stod(row[4]), 1, 1e-11);
  }
  EXPECT_EQ(mode, 3U);
  const std::vector<double> twist = dense_frequencies_hz(mesh, a, coupled_with(a, free, a.dofs.of_node(tip, 3)), 2);
  const auto torsion = reference_rows("nafems_hz.csv", "FV5 torsion");
  EXPECT_NEAR(twist[0] / std::stod(torsion[0][3]), 1, 3e-9);
  EXPECT_NEAR(twist[1] / std::stod(torsion[1][3]), 1, 3e-9);
}

// Frequencies converge with the elements like h^(2 (p + 1)). The error also oscillates with the phase of the wave in
// the elements, so each order has a mode and a mesh that is fine enough for the rate to be seen and coarse enough to
// stay above round-off.
struct OrderCase {
  int order, mode, elements;
};

class BeamConvergence : public ::testing::TestWithParam<std::tuple<BeamTheory, OrderCase>> {};

TEST_P(BeamConvergence, HasOrderTwicePPlusOne) {
  const auto& [theory, c] = GetParam();
  const auto frequency = [&theory = theory, &c = c](int elements, int order) {
    return clamped_frequencies_hz(uniform_boom(boom4_section, boom4_length, theory, elements, order), 1, c.mode).back();
  };
  const double exact = frequency(14, 12);
  const double error_h = frequency(c.elements, c.order) / exact - 1;
  const double error_half = frequency(2 * c.elements, c.order) / exact - 1;
  const double observed = std::log2(error_h / error_half);
  RecordProperty("observed_order", fmt::format("{:.2f}", observed));
  EXPECT_GT(error_half, 0) << "a consistent mass approaches from above";
  EXPECT_GT(observed, 2 * (c.order + 1) - 0.5) << error_h << " -> " << error_half;  // half an order: not yet asymptotic
}

INSTANTIATE_TEST_SUITE_P(BothTheories, BeamConvergence,
                         ::testing::Combine(::testing::Values(BeamTheory::euler_bernoulli, BeamTheory::timoshenko),
                                            ::testing::Values(OrderCase{1, 3, 8}, OrderCase{2, 3, 6},
                                                              OrderCase{3, 3, 8}, OrderCase{4, 6, 10},
                                                              OrderCase{5, 5, 6}, OrderCase{6, 6, 6},
                                                              OrderCase{7, 5, 3}, OrderCase{8, 9, 3})));

// At L/d = 1e4 shear and rotary inertia change a frequency by about (a d / L)^2 ~ 1e-7, so both theories agree to 1e-6:
// a locking element would be too stiff by orders of magnitude.
TEST(Timoshenko, DoesNotLockWhenSlender) {
  for (int p : {1, 2, 4, 8}) {
    const RoundBar thin{boom4_length / 1e4};
    const auto thick = clamped_frequencies_hz(uniform_boom(thin, boom4_length, BeamTheory::timoshenko, 8, p), 1, 3);
    const auto plain =
        clamped_frequencies_hz(uniform_boom(thin, boom4_length, BeamTheory::euler_bernoulli, 8, p), 1, 3);
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(thick[k] / plain[k], 1, 1e-6) << "order " << p;
  }
}

// A cone of a line mass has closed-form mass; its frequency only a finer mesh. Refined answers agree to discretisation
// error.
TEST(BeamFrequencies, TaperConvergesWithOrderAndElements) {
  BeamGeometry boom = uniform_boom(RoundBar{0.01}, 0.3, BeamTheory::timoshenko, 3, 10);
  boom.segments[0].end = RoundBar{0.004};
  const std::vector<double> few = clamped_frequencies_hz(boom, 1, 4);
  boom.segments[0].elements = 10;
  const std::vector<double> many = clamped_frequencies_hz(boom, 1, 4);
  for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(few[k] / many[k], 1, 1e-11);
}

// Uniform bar cut in segments of unequal elements with an equivalent second material: nothing changes.
TEST(BeamFrequencies, SegmentsOfOneBarAreTheBar) {
  BeamGeometry whole = boom4(BeamTheory::timoshenko);
  BeamGeometry cut = whole;
  cut.segments.clear();
  for (double fraction : {0.2, 0.5, 0.3})
    cut.segments.push_back({boom4_section, boom4_section, fraction * boom4_length, aluminium, 3});
  const std::vector<double> a = clamped_frequencies_hz(whole, 1, 6), b = clamped_frequencies_hz(cut, 1, 6);
  for (size_t k = 0; k < 6; ++k) EXPECT_NEAR(a[k] / b[k], 1, frequency_tolerance);
}

// Tip mass on a massless beam: omega^2 = 3 EI / (m L^3); the same with a disc in torsion: GJ / (L Ix).
TEST(BeamFrequencies, TipBodyOnMasslessBeamMatchesClosedForm) {
  BeamGeometry boom = uniform_boom(boom4_section, boom4_length, BeamTheory::euler_bernoulli, 4, 2);
  boom.segments[0].material.rho = 0;
  boom.attachments.push_back({"mass", boom4_length, 2.0, Eigen::Matrix3d::Zero(), Eigen::Vector3d::Zero()});
  const double I = pi * std::pow(boom4_section.diameter, 4) / 64, L = boom4_length;
  EXPECT_NEAR(clamped_frequencies_hz(boom, 1, 1)[0] * 2 * pi / std::sqrt(3 * aluminium.E * I / (2.0 * L * L * L)), 1,
              1e-12);
  boom.attachments[0].inertia = Eigen::Vector3d(1e-3, 1e-3, 1e-3).asDiagonal();
  EXPECT_NEAR(
      clamped_frequencies_hz(boom, 3, 1)[0] * 2 * pi / std::sqrt(aluminium.shear_modulus() * 2 * I / (L * 1e-3)), 1,
      1e-12);
}

}  // namespace
}  // namespace flexboom::testing
