#include "dynamics/model/time_function.hpp"

#include "dynamics/numerics/expression.hpp"
#include "fem/base/check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <initializer_list>
#include <numbers>

namespace flexboom {
namespace {

using std::numbers::pi;
constexpr double eps = 2.3e-16;

std::array<double, 3> at(const TimeFunction& f, double t) { return {f.value(t), f.rate(t), f.acceleration(t)}; }

template <class Run>
std::string refusal(Run run) {
  try {
    run();
  } catch (const InputError& e) {
    return e.what();
  }
  return "not refused";
}

TEST(Expression, KeepsThePrecedenceOfMathematics) {
  const auto value = [](const char* text, double t = 0) { return Expression(text).at(t)[0]; };
  EXPECT_EQ(value("1+2*3"), 7);
  EXPECT_EQ(value("-2^2"), -4);
  EXPECT_EQ(value("2^3^2"), 512);
  EXPECT_EQ(value("2^-1"), 0.5);
  EXPECT_EQ(value("8-3-2"), 3);
  EXPECT_EQ(value("8/4/2"), 1);
  EXPECT_EQ(value("(1+2)*-3"), -9);
  EXPECT_EQ(value("1.5e-3*2"), 3e-3);
  EXPECT_EQ(value(" .5 + t", 2), 2.5);
  EXPECT_EQ(value("1 < 2 && 3 >= 4 || 5 != 6"), 1);
  EXPECT_EQ(value("if(t > 1, 10, 20)", 1), 20);
  EXPECT_EQ(value("min(t, 3) + max(t, 3)", 5), 8);
  EXPECT_EQ(value("step(t - 1)", 1), 1);
  EXPECT_EQ(value("cos(pi) + log(e)"), 0);
}

/// Derivatives against the closed forms of a computer-algebra text book, by hand, at a place where nothing is special.
TEST(Expression, DerivativesAreExactToRoundOff) {
  struct Case {
    const char* text;
    double v, d, dd;
  };
  const double t = 0.37, s = std::sin(3 * t), c = std::cos(3 * t), x = std::exp(-t / 2), r = std::sqrt(1 + t * t);
  const Case cases[] = {
      {"sin(3*t)*exp(-t/2)", s * x, (3 * c - s / 2) * x, (-9 * s - 3 * c + s / 4) * x},
      {"sqrt(1+t^2)", r, t / r, 1 / (r * r * r)},
      {"t^3/(2-t)", t * t * t / (2 - t), (3 * t * t * (2 - t) + t * t * t) / std::pow(2 - t, 2),
       (6 * t * (2 - t) * (2 - t) + 6 * t * t * (2 - t) + 2 * t * t * t) / std::pow(2 - t, 3)},
      {"t^t", std::pow(t, t), std::pow(t, t) * (std::log(t) + 1),
       std::pow(t, t) * (std::pow(std::log(t) + 1, 2) + 1 / t)},
      {"atan2(sin(t), cos(t)) + atan(t)", t + std::atan(t), 1 + 1 / (1 + t * t), -2 * t / std::pow(1 + t * t, 2)},
      {"tan(t) - tanh(t)", std::tan(t) - std::tanh(t), std::pow(std::tan(t), 2) + std::pow(std::tanh(t), 2),
       2 * std::tan(t) * (1 + std::pow(std::tan(t), 2)) + 2 * std::tanh(t) * (1 - std::pow(std::tanh(t), 2))},
      {"asin(t) + 2*acos(t)", std::asin(t) + 2 * std::acos(t), -1 / std::sqrt(1 - t * t),
       -t / std::pow(1 - t * t, 1.5)},
      {"sinh(t) + log(cosh(t))", std::sinh(t) + std::log(std::cosh(t)), std::cosh(t) + std::tanh(t),
       std::sinh(t) + 1 / std::pow(std::cosh(t), 2)},
      {"abs(t-1)*sign(t-1) + min(t, 2*t)", t - 1 + t, 2, 0},
      {"if(t<1, t^2, 5)", t * t, 2 * t, 2},
  };
  for (const Case& k : cases) {
    const auto f = Expression(k.text).at(t);
    const double scale = 20 * eps * std::max({1.0, std::abs(k.v), std::abs(k.d), std::abs(k.dd)});  // some operations
    EXPECT_NEAR(f[0], k.v, scale) << k.text;
    EXPECT_NEAR(f[1], k.d, scale) << k.text;
    EXPECT_NEAR(f[2], k.dd, scale) << k.text;
  }
}

TEST(Expression, PowersAreSmoothAtZero) {
  EXPECT_EQ(Expression("t^2").at(0), (std::array<double, 3>{0, 0, 2}));
  EXPECT_EQ(Expression("t^1").at(0), (std::array<double, 3>{0, 1, 0}));
  EXPECT_EQ(Expression("t^0").at(0), (std::array<double, 3>{1, 0, 0}));
}

TEST(Expression, SaysWhereAndWhatWasNotUnderstood) {
  const auto why = [](const char* text) { return refusal([&] { Expression e(text); }); };
  EXPECT_EQ(why("2*sni(t)"),
            "expression \"2*sni(t)\", column 3: 'sni' is not understood; 'sni' is not known, the "
            "nearest name is 'sin'");
  EXPECT_NE(why("heaviside(t)").find("'heaviside' is not known; there are t, pi, e, sin, "), std::string::npos)
      << why("heaviside(t)");
  for (const char* bad : {"",          " ",     "1+",   "(1", "1)",  "sin()", "sin(1,2)", "1,2", "t=3", "2 3",
                          "t ? 1 : 2", "\"a\"", "1..2", "*2", "nan", "inf",   "sin",      "#",   "T",   "if(1,2)"}) {
    const std::string text = why(bad);
    EXPECT_NE(text.find(", column "), std::string::npos) << bad << " -> " << text;
  }
  std::string long_sum = "t";
  for (int i = 0; i < 300; ++i) long_sum += "+t";
  EXPECT_NE(why(long_sum.c_str()).find("more than 256"), std::string::npos);
}

/// Cubics are splines: reproduced with all derivatives; with a kink a spline converges, to fourth order for a sine.
TEST(TimeTable, CubicSplineReproducesCubicsAndConvergesToFourthOrder) {
  TimeTable cubic;
  for (const double t : {0.0, 0.3, 1.0, 1.2, 2.5}) {
    cubic.time.push_back(t);
    cubic.value.push_back(1 + t * (2 + t * (-3 + t)));
  }
  const TimeFunction f = time_table(cubic).function;
  for (const double t : {0.0, 0.1, 0.9, 1.9, 2.5}) {
    EXPECT_NEAR(f.value(t), 1 + t * (2 + t * (-3 + t)), 100 * eps);  // a solve of 5 rows
    EXPECT_NEAR(f.rate(t), 2 + t * (-6 + 3 * t), 300 * eps);
    EXPECT_NEAR(f.acceleration(t), -6 + 6 * t, 1000 * eps);
  }
  const auto worst = [](int n) {
    TimeTable sine;
    for (int i = 0; i <= n; ++i) {
      sine.time.push_back(3.0 * i / n);
      sine.value.push_back(std::sin(sine.time.back()));
    }
    const TimeFunction g = time_table(sine).function;
    double error = 0;
    for (double t = 0; t <= 3; t += 0.001) error = std::max(error, std::abs(g.value(t) - std::sin(t)));
    return error;
  };
  EXPECT_NEAR(std::log2(worst(40) / worst(80)), 4, 0.3);
}

/// The next number.
double after(double t) { return std::nextafter(t, 100.0); }

TEST(Expression, CornersAreWhereSidesChange) {
  const auto corners = [](const char* text, double begin = 0, double end = 10) {
    return Expression(text).corners(begin, end, 64);
  };
  const auto of = [](std::initializer_list<double> times) { return std::vector<double>(times); };
  EXPECT_EQ(corners("(t > 1.25)*(t < 1.2500001)"), of({after(1.25), 1.2500001})) << "much closer than samples";
  EXPECT_EQ(corners("if(3 - 2*t/4 >= 1/2, t, 0)"), of({after(5)}));
  EXPECT_EQ(corners("step(t - pi) + 3"), of({pi}));
  EXPECT_EQ(corners("max(t, 2 - t) + min(t, 4)"), of({after(1), after(4)}));
  EXPECT_EQ(corners("sin(t) + t^3 + (2 < 3)"), of({}));
  EXPECT_EQ(corners("(t < 11)*(t > 0)"), of({})) << "outside";
  EXPECT_EQ(corners("t == 3"), of({})) << "a moment";
  ASSERT_EQ(corners("step((t - 2451545) + 2451544.9)").size(), 1u) << "large terms cancel";
  EXPECT_EQ(corners("(t < 2)*(t < 2)"), of({2}));
  const std::vector<double> bounces = corners("abs(sin(pi*t))", 0.5, 3.5);
  EXPECT_LE(corners("max(sin(t)^2 + cos(t)^2, 1)").size(), 64u) << "round-off takes many sides";
  EXPECT_EQ(corners("(sin(t) > 0.5) + (sin(t) > 0.51)", 0, 1.5).size(), 2u) << "between two samples";
  ASSERT_EQ(bounces.size(), 3u);
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(bounces[i], static_cast<double>(i) + 1, 1e-15);
}

TEST(SmoothPieces, PolynomialsOfDegreeFourFollow) {
  constexpr double duration = 20;
  constexpr int samples = 4096;
  const std::vector<std::function<double(double)>> functions = {
      [](double t) { return std::exp(-std::pow((t - 5.25) / 0.02, 2)); }, [](double t) { return 1e6 * std::sin(t); }};
  EXPECT_TRUE(smooth_pieces({}, duration, samples, 0).empty());
  EXPECT_EQ(smooth_pieces({[](double t) { return t * t; }}, duration, samples, 0), std::vector<double>{duration});
  const std::vector<double> pieces = smooth_pieces(functions, duration, samples, 1e-9);
  EXPECT_EQ(pieces.back(), duration);
  EXPECT_LT(pieces.size(), 60u);
  double begin = 0, longest = 0;
  for (const double end : pieces) {
    longest = std::max(longest, end - begin);
    const bool is_shortest = end - begin < 4.5 * duration / samples;  // of these nothing is promised
    for (const auto& f : functions) {
      if (is_shortest) continue;
      double low = f(begin), high = low, worst = 0;
      for (int k = 0; k <= 100; ++k) {
        const double x = k / 25.0, t = begin + x * (end - begin) / 4;
        double p = 0;  // of Lagrange
        for (int i = 0; i < 5; ++i) {
          double l = f(begin + i * (end - begin) / 4);
          for (int j = 0; j < 5; ++j)
            if (j != i) l *= (x - j) / (i - j);
          p += l;
        }
        low = std::min(low, f(t)), high = std::max(high, f(t)), worst = std::max(worst, std::abs(p - f(t)));
      }
      EXPECT_LT(worst, 2e-3 * (high - low) + 1e-9) << begin << " to " << end;  // between samples, too
    }
    begin = end;
  }
  EXPECT_GT(longest, 1);
}

TEST(TimeTable, FewPointsAreALineAndAParabola) {
  const auto parabola = at(time_table({{0, 1, 3}, {0, 1, 9}}).function, 2);
  EXPECT_NEAR(parabola[0], 4, 1e-14);
  EXPECT_NEAR(parabola[1], 4, 1e-14);
  EXPECT_NEAR(parabola[2], 2, 1e-14);
  EXPECT_EQ(at(time_table({{1, 3}, {1, 5}}).function, 2), (std::array<double, 3>{3, 2, 0}));
}

TEST(TimeTable, LinearHasItsCornersAndHoldsOutsideWhenAsked) {
  const TimeCourse c = time_table({{0, 1, 3}, {5, 7, 7}, "linear", "hold"});
  EXPECT_EQ(c.corners, (std::vector<double>{0, 1, 3}));
  EXPECT_EQ(at(c.function, 0.5), (std::array<double, 3>{6, 2, 0}));
  EXPECT_EQ(at(c.function, -1), (std::array<double, 3>{5, 0, 0}));
  EXPECT_EQ(at(c.function, 4), (std::array<double, 3>{7, 0, 0}));
  const TimeCourse strict = time_table({{0, 1}, {5, 7}});
  EXPECT_EQ(strict.end, 1);
  EXPECT_THROW(strict.function.value(1.1), InputError);
}

TEST(TimeTable, RefusesWhatIsNoTable) {
  EXPECT_NE(refusal([] { time_table({{0, 1, 1}, {1, 2, 3}}); }).find("row 3"), std::string::npos);
  EXPECT_NE(refusal([] { time_table({{0, 1}, {1}}); }).find("2 times and 1 values"), std::string::npos);
  EXPECT_NE(refusal([] { time_table({{0, 1}, {1, NAN}}); }).find("row 2"), std::string::npos);
  EXPECT_NE(refusal([] { time_table({{0, 1}, {1, 2}, "cubik"}); }).find("'cubik'"), std::string::npos);
  EXPECT_NE(refusal([] { time_table({{0, 1}, {1, 2}, "linear", "wrap"}); }).find("'wrap'"), std::string::npos);
}

/// Limits are kept and one is reached; value, rate and acceleration are derivatives of each other.
TEST(RestToRest, TurnsTwiceWithinItsLimits) {
  for (const char* profile : {"trapezoid", "smooth"})
    for (const double sign : {1.0, -1.0})
      for (const double peak_rate : {0.1, 10.0}) {
        const TimeCourse c = rest_to_rest({profile, sign * 4 * pi, peak_rate, 0.02, 3});
        const double end = c.corners.back(), h = (end - 3) / 4000;
        double rate = 0, acceleration = 0, worst = 0, integral = 0;
        for (int i = 0; i < 4000; ++i) {
          const double t = 3 + (i + 0.5) * h;
          rate = std::max(rate, std::abs(c.function.rate(t)));
          acceleration = std::max(acceleration, std::abs(c.function.acceleration(t)));
          worst = std::max(
              worst, std::abs(c.function.value(t + h / 2) - c.function.value(t - h / 2) - h * c.function.rate(t)));
          integral += h * c.function.acceleration(t) * (end - t);  // the angle, by the acceleration alone
        }
        EXPECT_LE(rate, peak_rate * (1 + 1e-12));
        EXPECT_LE(acceleration, 0.02 * (1 + 1e-12));
        EXPECT_GT(std::max(rate / peak_rate, acceleration / 0.02), 1 - 1e-5);  // seen at 4000 places
        EXPECT_LT(worst, 0.02 * h * h);                                        // midpoint rule, a corner within it
        EXPECT_NEAR(integral, sign * 4 * pi, 0.02 * h * (end - 3));            // the same, over all
        EXPECT_EQ(c.function.value(2.9), 0);
        EXPECT_NEAR(c.function.value(end - 1e-9), sign * 4 * pi, 1e-12);
        EXPECT_EQ(c.function.value(end + 1), sign * 4 * pi);
        EXPECT_EQ(c.function.rate(end + 1), 0);
      }
  // 4 pi at most 0.1 rad/s and 0.02 rad/s^2: 5 s up, 125.66 - 5 s, 5 s down.
  EXPECT_NEAR(rest_to_rest({"trapezoid", 4 * pi, 0.1, 0.02, 0}).corners[3], 4 * pi / 0.1 + 5, 1e-12);
  EXPECT_EQ(rest_to_rest({"trapezoid", 4 * pi, 10, 0.02, 0}).corners.size(), 3u);  // a triangle
}

TEST(RestToRest, RefusesUnknownProfilesAndImpossibleLimits) {
  EXPECT_NE(refusal([] { rest_to_rest({"trapez", 1, 1, 1, 0}); }).find("'trapez'"), std::string::npos);
  EXPECT_THROW(rest_to_rest({"smooth", 1, 0, 1, 0}), InputError);
  EXPECT_EQ(rest_to_rest({"smooth", 0, 1, 1, 0}).function.value(0.5), 0);
}

}  // namespace
}  // namespace flexboom
