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

/// Of the body that this file says.
BoundedModes modes_of_file(const std::string& text, const EigenOptions& options) {
  const auto file = std::filesystem::temp_directory_path() / fmt::format("flexboom-bounded-{}.toml", ::getpid());
  std::ofstream(file) << "format = \"flexboom-body-1\"\nname = \"boom\"\ndirections = \"all\"\n" << text << "\n";
  const Model model = load_model(file, {});
  std::filesystem::remove(file);
  return bounded_modes(model, options, 1);
}

/// Modes of a boom of rectangles; `keys` of the body.
BoundedModes modes_of(const std::vector<Piece>& pieces, const std::string& keys, const std::string& backend = "auto") {
  std::string text = keys;
  for (const Piece& p : pieces)
    text += fmt::format(
        "\n[[segments]]\nshape = \"rectangle\"\nlength = {:.17g}\nheight = {}\nwidth = {}\nelements = {}\n"
        "end = {{ height = {}, width = {} }}\nmaterial = {{ E = 70e9, nu = 0.33, rho = 2700 }}",
        p.length, p.height, p.width, p.elements, p.end_height, p.end_width);
  return modes_of_file(text, {.num_modes = count, .sigma = {}, .backend = backend});
}

/// Every error of `modes` is within its bound; `exact` [rad/s]. Returns how many bounds are known.
int expect_bounds_hold(const BoundedModes& modes, const Eigen::VectorXd& exact, const std::string& what) {
  int known = 0;
  for (Eigen::Index k = 0; k < modes.basis.omega.size(); ++k) {
    if (std::isnan(modes.bounds.relative[k])) continue;
    ++known;
    const double round_off = 1e-11;  // of the reference
    EXPECT_LT(std::abs(modes.basis.omega[k] / exact[k] - 1), modes.bounds.relative[k] + round_off) << what << ", " << k;
  }
  return known;
}

TEST(BoundedModes, HoldHoweverShortAnElementIs) {
  const Eigen::VectorXd exact = modes_of({{0.8}}, "order = 10").basis.omega;
  const auto few = [](double length) {  // elements: the dense solver is slow
    Piece piece{length};
    piece.elements = 3;
    return piece;
  };
  for (const double gap : {1e-2, 1e-3, 1e-4, 3e-5, 1e-5, 8.1e-6})
    for (const double at : {0.1, 0.4, 0.7})
      for (const std::string backend : {"auto", "block", "dense"}) {
        const BoundedModes modes = modes_of({few(at), {gap}, few(0.8 - at - gap)}, "order = 6", backend);
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

// A piece with so little torsional stiffness twists in waves that its elements hardly follow. Meshes of order 4 and 6
// both find its third torsion (601 Hz) above a bending mode that they know to the last digit (610 Hz).
TEST(BoundedModes, HoldWhereTwoMeshesMissOneMode) {
  constexpr int more = 10;
  const auto modes = [](double weak, int elements, int order) {
    std::string text = fmt::format("order = {}\n", order);
    for (const auto& [length, J] : {std::pair(1.0, 9.4e-7), std::pair(0.16874, weak)})
      text += fmt::format(
          "[[segments]]\nshape = \"general\"\nA = 4.25e-3\nIy = 4.27e-5\nIz = 2.65e-5\nJ = {}\nkappa_y = 0.517\n"
          "kappa_z = 0.173\nlength = {}\nelements = {}\nmaterial = {{ E = 70e9, nu = 0.3, rho = 2700 }}\n",
          J, length, elements);
    return modes_of_file(text, {.num_modes = more, .sigma = {}, .backend = "auto"});
  };
  const double missing = 1.44e-8;
  for (const double J : {1.2e-8, missing, 1.7e-8}) {
    const Eigen::VectorXd exact = modes(J, 10, 12).basis.omega;
    for (const int order : {3, 4, 5}) {
      const BoundedModes found = modes(J, 0, order);
      expect_bounds_hold(found, exact, fmt::format("J = {} m^4, order {}", J, order));
      if (J == missing && order == 4) {
        EXPECT_GT(found.bounds.relative[more - 1], 1e-3);
      }
    }
  }
}

// The mirror image of a boom has its frequencies. Errors gather at the rim of the face that is held.
TEST(BoundedModes, SolidsHeldAtTheirTipsAreThoseHeldAtTheirRoots) {
  const auto modes = [](const std::string& clamp) {
    return modes_of_file(
        fmt::format("structure = \"solid\"\nclamp = \"{}\"\nsolid = {{ accuracy = 1e-3 }}\n[[segments]]\n"
                    "shape = \"round-bar\"\ndiameter = 0.04\nlength = 0.06\n"
                    "material = {{ E = 70e9, nu = 0.49, rho = 2700 }}",
                    clamp),
        {.num_modes = 4, .sigma = {}, .backend = "auto"});
  };
  const BoundedModes at_root = modes("root"), at_tip = modes("tip");
  for (int k = 0; k < 4; ++k)
    EXPECT_LT(std::abs(at_tip.basis.omega[k] / at_root.basis.omega[k] - 1),
              at_tip.bounds.relative[k] + at_root.bounds.relative[k])
        << k;
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
