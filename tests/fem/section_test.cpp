#include "fem_testing.hpp"

namespace flexboom::testing {
namespace {

constexpr double round_off = 1e-14;  // a dozen operations

TEST(Section, RoundBarHasClosedForms) {
  const Section s = section_of(RoundBar{0.01}, 0.33, {});
  EXPECT_NEAR(s.A / 7.853981633974483e-5, 1, round_off);
  EXPECT_NEAR(s.Iy / 4.908738521234052e-10, 1, round_off);
  EXPECT_EQ(s.Iy, s.Iz);
  EXPECT_EQ(s.J, s.Iy + s.Iz);
  EXPECT_NEAR(s.kappa_y, 0.88864142539, 1e-11);  // as printed in the head of the reference frequencies
  EXPECT_NEAR(section_of(RoundBar{0.01}, 0.33, {"nu-squared", 0}).kappa_z, 0.931359472077, 1e-12);
  EXPECT_EQ(section_of(RoundBar{0.01}, 0.33, {"value", 0.9}).kappa_y, 0.9);
}

TEST(Section, TubeWithoutHoleIsRoundBar) {
  for (const char* rule : {"cowper", "nu-squared"}) {
    const Section tube = section_of(Tube{0.01, 0.005}, 0.3, {rule, 0});
    const Section bar = section_of(RoundBar{0.01}, 0.3, {rule, 0});
    EXPECT_NEAR(tube.A / bar.A, 1, round_off);
    EXPECT_NEAR(tube.Iz / bar.Iz, 1, round_off);
    EXPECT_NEAR(tube.kappa_y / bar.kappa_y, 1, round_off) << rule;
  }
}

TEST(Section, ThinTubeHasLimitsOfCowperAndHutchinson) {
  const double nu = 0.3, thin = 1e-7;  // the formulas differ from their limits by the square of the thickness ratio
  EXPECT_NEAR(section_of(Tube{1, thin}, nu, {"cowper", 0}).kappa_y, 2 * (1 + nu) / (4 + 3 * nu), 1e-12);
  EXPECT_NEAR(section_of(Tube{1, thin}, nu, {"nu-squared", 0}).kappa_y, (1 + nu) / (2 + nu), 1e-12);
  EXPECT_NEAR(section_of(Tube{1, thin}, nu, {}).Iy, pi * thin / 8, 1e-6 * pi * thin / 8);
}

TEST(Section, TorsionOfSquareAndThinRectangle) {
  EXPECT_NEAR(section_of(Rectangle{2, 2}, 0.3, {}).J / (0.140577014955 * 16), 1, 1e-10);  // digits of the constant
  const double ratio = 1e-3;  // J = a b^3 (1/3 - 0.21008 b/a) to all digits when b/a is small
  EXPECT_NEAR(section_of(Rectangle{1, ratio}, 0.3, {}).J / std::pow(ratio, 3), 1.0 / 3 - 0.210083 * ratio, 1e-8);
  EXPECT_EQ(section_of(Rectangle{0.2, 0.1}, 0.3, {}).J, section_of(Rectangle{0.1, 0.2}, 0.3, {}).J);
}

TEST(Section, RectangleBendsAboutTheRightAxes) {
  const Section s = section_of(Rectangle{0.4, 0.1}, 0.3, {});
  EXPECT_NEAR(s.Iz, 0.1 * std::pow(0.4, 3) / 12, round_off);
  EXPECT_NEAR(s.Iy, 0.4 * std::pow(0.1, 3) / 12, round_off);
  EXPECT_NEAR(s.kappa_y, 10 * 1.3 / (12 + 11 * 0.3), round_off);
}

// 5/6 for nu = 0, else values from the long-wave branch of a three-dimensional Ritz solution of the bar (polynomials of
// degree 8 over the section; Richardson in the wave number; good to 2e-4).
TEST(Section, RectangleNuSquaredMatchesElasticity) {
  const ShearRule rule{"nu-squared", 0};
  EXPECT_NEAR(section_of(Rectangle{0.3, 0.1}, 0, rule).kappa_y, 5.0 / 6, round_off);
  EXPECT_NEAR(section_of(Rectangle{1, 1}, 0.3, rule).kappa_y, 0.87235, 2e-4);
  EXPECT_NEAR(section_of(Rectangle{1, 0.5}, 0.3, rule).kappa_y, 0.86721, 2e-4);
  EXPECT_NEAR(section_of(Rectangle{1, 0.5}, 0.3, rule).kappa_z, 0.92683, 2e-4);
  EXPECT_NEAR(section_of(Rectangle{1, 1}, 0.45, rule).kappa_y, 0.88902, 4e-4);
}

// The series summed term by term, 1e5 terms (they fall like n^-4).
TEST(Section, RectangleNuSquaredMatchesPlainSeries) {
  const double nu = 0.3, a = 1, b = 2;
  double C4 = 4.0 / 45 * a * a * a * b * (-12 * a * a - 15 * nu * a * a + 5 * nu * b * b);
  for (int n = 1; n <= 100000; ++n) {
    const double x = n * pi;
    C4 += 16 * nu * nu * std::pow(b, 5) * (x * a - b * std::tanh(x * a / b)) / (std::pow(x, 5) * (1 + nu));
  }
  const double kappa = -2 * (1 + nu) / (9 / (4 * std::pow(a, 5) * b) * C4 + nu * (1 - b * b / (a * a)));
  EXPECT_NEAR(section_of(Rectangle{2 * a, 2 * b}, nu, {"nu-squared", 0}).kappa_y, kappa, 1e-13);
}

// For nu = 0 Cowper's box is I^2 / (A int q^2 / t^2 dA) with the shear flow of a thin closed wall; here for h = 2, b =
// 1 midlines.
TEST(Section, BoxMatchesShearFlow) {
  const double h = 2, b = 1, t = 1e-6;
  const double I = t * (h * h * h / 6 + b * h * h / 2), A = 2 * t * (h + b);
  const auto web_flow = [&](double y) { return b * h / 4 + (h * h / 4 - y * y) / 2; };
  double flow_squared = h * h * b * b * b / 24;  // both flanges
  const GaussRule& rule = gauss_rule(4);
  for (Eigen::Index g = 0; g < 4; ++g)
    flow_squared += 2 * rule.weights(g) * h / 2 * std::pow(web_flow(rule.points(g) * h / 2), 2);
  const Section s = section_of(RectangularTube{h + t, b + t, t}, 0, {});
  EXPECT_NEAR(s.kappa_y, I * I / (A * t * flow_squared), 1e-12);
  EXPECT_NEAR(s.Iz / I, 1, 1e-5);  // thin walls to order t
  EXPECT_NEAR(s.J / (4 * h * h * b * b * t / (2 * (h + b))), 1, 1e-9);
}

TEST(Section, RectangularTubeIsOuterMinusInner) {
  const Section s = section_of(RectangularTube{0.05, 0.03, 0.002}, 0.3, {});
  EXPECT_NEAR(s.A, 0.05 * 0.03 - 0.046 * 0.026, 1e-17);
  EXPECT_NEAR(s.Iz, (0.03 * std::pow(0.05, 3) - 0.026 * std::pow(0.046, 3)) / 12, 1e-20);
  EXPECT_NEAR(s.Iy, (0.05 * std::pow(0.03, 3) - 0.046 * std::pow(0.026, 3)) / 12, 1e-20);
}

TEST(Section, GeneralKeepsItsCoefficients) {
  const Section s = section_of(GeneralSection{1, 2, 3, 4, 0.5, 0.6}, 0.3, {"value", 0.9});
  EXPECT_EQ(s.kappa_y, 0.5);
  EXPECT_EQ(s.kappa_z, 0.6);
  EXPECT_EQ(s.J, 4);
}

TEST(Section, InterpolationIsLinearInDimensions) {
  EXPECT_EQ(std::get<RoundBar>(interpolate(RoundBar{1}, RoundBar{3}, 0.25)).diameter, 1.5);
  const auto tube = std::get<Tube>(interpolate(Tube{1, 0.1}, Tube{2, 0.3}, 0.5));
  EXPECT_EQ(tube.diameter, 1.5);
  EXPECT_NEAR(tube.thickness, 0.2, round_off);
  EXPECT_EQ(std::get<Rectangle>(interpolate(Rectangle{1, 2}, Rectangle{3, 6}, 0.5)).width, 4);
  EXPECT_EQ(std::get<RectangularTube>(interpolate(RectangularTube{1, 2, 0.1}, RectangularTube{3, 6, 0.1}, 0.5)).height,
            2);
  EXPECT_EQ(std::get<GeneralSection>(interpolate(GeneralSection{1, 1, 1, 1}, GeneralSection{3, 1, 1, 1}, 0.5)).A, 2);
}

TEST(Section, NoneIsThinnerThanAnyStrip) {
  EXPECT_THROW(section_of(GeneralSection{1e-4, 1e-320, 1e-9, 1e-9}, 0.3, {"value", 1}), InputError);
  EXPECT_NO_THROW(section_of(GeneralSection{1e-4, 1e-16, 1e-9, 1e-16}, 0.3, {"value", 1}));
}

TEST(Section, BadInputSaysWhatIsWrong) {
  const auto message = [](const SectionShape& shape, const ShearRule& rule = {}) {
    return input_error([&] { section_of(shape, 0.3, rule); });
  };
  EXPECT_EQ(message(RoundBar{-0.005}), "round bar: diameter [m]: is -0.005; it must be positive");
  EXPECT_EQ(message(RoundBar{NAN}), "round bar: diameter [m]: is nan; it must be positive");
  EXPECT_EQ(message(Tube{0.01, 0.006}), "tube: thickness 0.006 m is more than half the diameter 0.01 m");
  EXPECT_EQ(message(Tube{0.01, 0}), "tube: thickness [m]: is 0; it must be positive");
  EXPECT_EQ(message(Rectangle{1, 0}), "rectangle: width [m]: is 0; it must be positive");
  EXPECT_EQ(message(RectangularTube{1, 0.2, 0.1}), "rectangular tube: thickness 0.1 m leaves no hole in 1 m x 0.2 m");
  EXPECT_EQ(message(GeneralSection{1, 1, -1, 1}), "general section: Iz [m^4]: is -1; it must be positive");
  EXPECT_EQ(message(RoundBar{1}, {"timoshenko", 0}),
            "shear rule: \"timoshenko\" is not known; there are \"cowper\", \"nu-squared\", \"value\"");
  EXPECT_EQ(message(RoundBar{1}, {"value", 0}), "shear coefficient: is 0; it must be positive");
  EXPECT_EQ(message(RectangularTube{1, 1, 0.1}, {"nu-squared", 0}),
            "shear rule \"nu-squared\": not known for a rectangular tube; use \"cowper\" (thin walls) or a number");
  EXPECT_EQ(message(Rectangle{1, 10}, {"nu-squared", 0}),
            "shear rule \"nu-squared\": has no positive value for a rectangle 10 times as wide as deep with nu = 0.3; "
            "use \"cowper\" or a number");
  EXPECT_EQ(input_error([] {
              interpolate(RoundBar{1}, Tube{1, 0.1}, 0.5);
            }),
            "taper: the start and the end must be sections of one kind");
}

TEST(Material, BadInputSaysWhatIsWrong) {
  EXPECT_EQ(input_error([] { Material{0, 0.3, 1}.validate(); }), "material: E [Pa]: is 0; it must be positive");
  EXPECT_EQ(input_error([] { Material{1, 0.6, 1}.validate(); }), "material: nu is 0.6; it must lie between -1 and 0.5");
  EXPECT_EQ(input_error([] { Material{1, NAN, 1}.validate(); }), "material: nu is nan; it must lie between -1 and 0.5");
  EXPECT_EQ(input_error([] {
              Material{1, 0.3, -2}.validate();
            }),
            "material: rho is -2 kg/m^3; it must be zero or positive");
}

}  // namespace
}  // namespace flexboom::testing
