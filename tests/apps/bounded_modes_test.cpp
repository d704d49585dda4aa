// Bounds of frequencies hold where elements are short beside the boom, and where it tapers to an edge.

#include "apps/model/bounded_modes.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace flexboom {
namespace {

constexpr int count = 8;

struct Piece {
  double length, height = 0.03, end_height = 0.03, width = 0.012, end_width = 0.012;
  int elements = 0;  // chosen
};

/// Modes of a boom of rectangles; `keys` of the body.
BoundedModes modes_of(const std::vector<Piece>& pieces, const std::string& keys, const std::string& backend = "auto") {
  std::string text = "format = \"flexboom-body-1\"\nname = \"boom\"\ndirections = \"all\"\n" + keys;
  for (const Piece& p : pieces)
    text += fmt::format(
        "\n[[segments]]\nshape = \"rectangle\"\nlength = {:.17g}\nheight = {}\nwidth = {}\nelements = {}\n"
        "end = {{ height = {}, width = {} }}\nmaterial = {{ E = 70e9, nu = 0.33, rho = 2700 }}",
        p.length, p.height, p.width, p.elements, p.end_height, p.end_width);
  const auto file = std::filesystem::temp_directory_path() / fmt::format("flexboom-bounded-{}.toml", ::getpid());
  std::ofstream(file) << text << "\n";
  const Model model = load_model(file, {});
  std::filesystem::remove(file);
  return bounded_modes(model, {.num_modes = count, .sigma = {}, .backend = backend}, 1);
}

/// Every error of `modes` is within its bound; `exact` [rad/s]. Returns how many bounds are known.
int expect_bounds_hold(const BoundedModes& modes, const Eigen::VectorXd& exact, const std::string& what) {
  int known = 0;
  for (int k = 0; k < count; ++k) {
    if (std::isnan(modes.bounds.relative[k])) continue;
    ++known;
    const double round_off = 1e-11;  // of the reference
    EXPECT_LT(std::abs(modes.basis.omega[k] / exact[k] - 1), modes.bounds.relative[k] + round_off) << what << ", " << k;
  }
  return known;
}

TEST(BoundedModes, HoldHoweverShortAnElementIs) {
  const Eigen::VectorXd exact = modes_of({{0.8}}, "order = 10").basis.omega;
  for (const double gap : {1e-2, 1e-3, 1e-4, 3e-5, 1e-5, 8.1e-6})
    for (const double at : {0.1, 0.4, 0.7})
      for (const std::string backend : {"auto", "block", "dense"}) {
        const BoundedModes modes = modes_of({{at}, {gap}, {0.8 - at - gap}}, "order = 6", backend);
        EXPECT_EQ(modes.basis.rigid_freedoms, 0) << gap;
        const int known = expect_bounds_hold(modes, exact, fmt::format("{} m at {} m, {}", gap, at, backend));
        if (gap >= 1e-4) {
          EXPECT_EQ(known, count);
        }
      }
}

// A strip that carries a stiff bar and a heavy mass: its first frequency is 1e8 times below the highest of many
// elements, so that shapes are lost in the round-off of K.
TEST(BoundedModes, AreUnknownWhereShapesAreLost) {
  const auto modes = [](int elements, const std::string& backend) {
    return modes_of({{0.3, 5e-5, 5e-5, 1e-3, 1e-3, elements}, {0.3, 0.01, 0.01, 0.01, 0.01, elements}},
                    "attachments = [{ name = \"m\", position = \"tip\", mass = 10, offset = [0, 0.03, 0] }]", backend);
  };
  const BoundedModes coarse = modes(4, "auto");
  EXPECT_LT(coarse.bounds.relative[0], 1e-6);
  int lost = 0;
  for (const int elements : {20, 40, 60})
    for (const char* backend : {"block", "arpack", "spectra"}) {
      const BoundedModes fine = modes(elements, backend);
      lost += std::abs(fine.basis.omega[0] / coarse.basis.omega[0] - 1) > 0.1;
      expect_bounds_hold(fine, coarse.basis.omega, fmt::format("{} elements, {}", elements, backend));
    }
  EXPECT_GT(lost, 0);
}

TEST(BoundedModes, HoldOfSteepTapers) {
  for (const bool wide : {true, false}) {
    const auto piece = [&](double from, double to) {  // of a boom of 0.4 m
      const double a = 1 - 0.99 * from / 0.4, b = 1 - 0.99 * to / 0.4;
      return wide ? Piece{to - from, 0.03, 0.03, 0.012 * a, 0.012 * b} : Piece{to - from, 0.03 * a, 0.03 * b};
    };
    std::vector<Piece> graded;
    double from = 0;
    for (int k = 1; k <= 8; ++k) {
      const double to = k == 8 ? 0.4 : 0.4 * (1 - std::pow(2.0, -k));
      graded.push_back(piece(from, to)), from = to;
    }
    const Eigen::VectorXd exact = modes_of(graded, "order = 11").basis.omega;
    for (const int elements : {1, 2, 5, 8, 10})
      for (const int order : {2, 3, 4, 5, 8}) {
        std::vector<Piece> pieces;
        for (int k = 0; k < elements; ++k) pieces.push_back(piece(0.4 * k / elements, 0.4 * (k + 1) / elements));
        expect_bounds_hold(modes_of(pieces, fmt::format("order = {}", order)), exact,
                           fmt::format("{} elements of order {}", elements, order));
      }
  }
}

}  // namespace
}  // namespace flexboom
