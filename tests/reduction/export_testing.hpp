#pragma once

#include "fem/assembly/assembly.hpp"
#include "fem/mesh/element.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "tests/reduction/messages.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <random>
#include <string>

namespace flexboom::test {

struct BentBody {
  Mesh mesh;
  Assembly assembly;
  ModalBasis basis;
  ReducedBody body;
};

/// Three beams at right angles with different sections, clamped at the origin, a heavy probe beside the tip: no
/// integral is zero by symmetry. Markers "middle", "root" and "tip"; damped, De not diagonal.
inline BentBody bent_body(int modes = 6) {
  BentBody b;
  b.mesh.nodes.resize(3, 4);
  b.mesh.nodes.transpose() << 0, 0, 0, 0.4, 0, 0, 0.4, 0.3, 0, 0.4, 0.3, 0.25;
  const int type = element_type("beam-timoshenko");
  const SectionShape shapes[] = {Rectangle{0.012, 0.02}, Rectangle{0.01, 0.014}, RoundBar{0.011}};
  const Eigen::Vector3d y_axes[] = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
  for (int i = 0; i < 3; ++i) {
    BeamProperty p;
    p.start = p.end = shapes[i];
    p.material = {67e9, 0.33, 2840};
    p.y_axis = y_axes[i];
    b.mesh.beam_properties.push_back(p);
    b.mesh.elements.push_back({type, {i, i + 1}, 5, i});
  }
  Eigen::Matrix3d inertia;
  inertia << 3e-4, 2e-5, 0, 2e-5, 4e-4, -3e-5, 0, -3e-5, 5e-4;
  b.mesh.bodies.push_back({3, 0.15, inertia, {0.03, -0.05, 0.02}});
  b.mesh.node_sets = {{"root", {0}}, {"middle", {2}}, {"tip", {3}}};
  b.assembly = assemble(b.mesh);
  b.basis = clamped_modes(b.mesh, b.assembly, node_set(b.mesh, "root"),
                          {.num_modes = modes, .sigma = {}, .backend = "dense"});
  b.body = reduce(b.mesh, b.assembly, b.basis, "bent body");
  std::ranges::sort(b.body.markers, {}, &Marker::name);
  apply_damping(b.body, {"rayleigh", 0, 0.3, 2e-5});
  return b;
}

/// That body, made once.
inline const ReducedBody& bent() {
  static const ReducedBody body = bent_body().body;
  return body;
}

/// Random numbers in [-1, 1], the same in every run.
class Random {
 public:
  explicit Random(unsigned seed) : generator_(seed) {}

  Eigen::MatrixXd matrix(Eigen::Index rows, Eigen::Index cols) {
    return Eigen::MatrixXd::NullaryExpr(rows, cols,
                                        [this] { return static_cast<double>(generator_()) / 2147483648.0 - 1; });
  }
  Eigen::Vector3d vector() { return matrix(3, 1); }
  std::vector<Eigen::MatrixXd> symmetric(int count, Eigen::Index n) {
    std::vector<Eigen::MatrixXd> family;
    for (int i = 0; i < count; ++i) {
      const Eigen::MatrixXd A = matrix(n, n);
      family.emplace_back(A + A.transpose());
    }
    return family;
  }

 private:
  std::mt19937 generator_;
};

/// Geometric stiffness with nothing in common between loads.
inline void add_random_stiffening(ReducedBody& body, unsigned seed) {
  Random random(seed);
  const Eigen::Index n = body.n();
  body.Kg.spin = random.symmetric(6, n);
  body.Kg.acceleration = random.symmetric(3, n);
  body.Kg.angular_acceleration = random.symmetric(3, n);
  for (const Marker& m : body.markers) {
    body.Kg.markers.push_back({m.name, random.symmetric(3, n), random.symmetric(3, n)});
  }
}

/// A folder of its own for each test, in one of this process alone that is removed at the end.
inline std::filesystem::path test_folder() {
  struct Folders {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("flexboom_exports_" + std::to_string(::getpid()));
    ~Folders() { std::filesystem::remove_all(path); }
  };
  static const Folders all;
  const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
  const std::filesystem::path folder = all.path / (std::string(info->test_suite_name()) + "." + info->name());
  std::filesystem::create_directories(folder);
  return folder;
}

}  // namespace flexboom::test
