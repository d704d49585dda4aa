#pragma once

#include "dynamics/model/hinge.hpp"
#include "reduction/body/reduced_body.hpp"
#include "reduction/invariants/eq14.hpp"

#include <Eigen/Core>

#include <cmath>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <vector>

namespace flexboom::testing {

/// A body made of point masses with made-up shapes: every invariant is non-zero, and sums over its points are an
/// oracle.
struct PointBody {
  std::vector<double> dm;
  std::vector<Eigen::Vector3d> u0;
  std::vector<Eigen::Matrix3Xd> S;
  ReducedBody body;
};

inline PointBody random_point_body(std::mt19937& random, int points, int n, const std::string& name) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto tilde = [](const Eigen::Vector3d& a) {
    return Eigen::Matrix3d{{0, -a.z(), a.y()}, {a.z(), 0, -a.x()}, {-a.y(), a.x(), 0}};
  };
  PointBody p;
  ReducedBody& b = p.body;
  b.name = name;
  b.structure = "points";
  b.Ct = b.Cr0 = Eigen::Matrix3Xd::Zero(3, n);
  b.Me = b.De = Eigen::MatrixXd::Zero(n, n);
  b.Cr1.assign(static_cast<size_t>(n), Eigen::Matrix3Xd::Zero(3, n));
  b.J1.assign(static_cast<size_t>(n), Eigen::Matrix3d::Zero());
  b.J2.assign(static_cast<size_t>(n), std::vector<Eigen::Matrix3d>(static_cast<size_t>(n), Eigen::Matrix3d::Zero()));
  for (int i = 0; i < points; ++i) {
    const double dm = 0.1 + 0.05 * uniform(random);
    const Eigen::Vector3d u0(0.5 + 0.5 * uniform(random), 0.2 * uniform(random), 0.2 * uniform(random));
    const Eigen::Matrix3Xd S = Eigen::Matrix3Xd::NullaryExpr(3, n, [&] { return uniform(random); });
    p.dm.push_back(dm);
    p.u0.push_back(u0);
    p.S.push_back(S);
    b.m += dm;
    b.mc0 += dm * u0;
    b.J0 -= dm * tilde(u0) * tilde(u0);
    b.Ct += dm * S;
    b.Cr0 += dm * tilde(u0) * S;
    b.Me += dm * S.transpose() * S;
    for (int k = 0; k < n; ++k) {
      const auto ku = static_cast<size_t>(k);
      const Eigen::Matrix3d tk = tilde(S.col(k));
      b.Cr1[ku] += dm * tk * S;
      b.J1[ku] -= dm * (tilde(u0) * tk + tk * tilde(u0));
      for (int l = 0; l < n; ++l) {
        const Eigen::Matrix3d tl = tilde(S.col(l));
        b.J2[ku][static_cast<size_t>(l)] -= 0.5 * dm * (tk * tl + tl * tk);
      }
    }
  }
  const Eigen::MatrixXd r = Eigen::MatrixXd::NullaryExpr(n, n, [&] { return uniform(random); });
  b.Ke = r * r.transpose() + Eigen::MatrixXd::Identity(n, n);
  b.De = 0.1 * b.Ke + 0.05 * b.Me;
  for (int k = 0; k < n; ++k) b.coordinates.push_back({"other", 1.0});
  return p;
}

/// Aluminium round bar of the SPORT scene.
inline eq14::Boom round_boom(double length, double diameter) {
  const double A = std::numbers::pi * diameter * diameter / 4, I = std::pow(diameter, 4) * std::numbers::pi / 64;
  return {length, 2840 * A, 67e9 * I};
}

inline HingeMechanism sport_mechanism(double P1) {
  return {P1 / (std::numbers::pi / 2), std::numbers::pi / 2, 0.01, 10.0, std::numbers::pi / 2};
}

/// Rows of a CSV file with a header, as text.
inline std::vector<std::vector<std::string>> read_csv(const std::string& name) {
  std::ifstream in(std::string(FLEXBOOM_TEST_DATA) + "/reference/" + name);
  if (!in) throw std::runtime_error("no reference file " + name);
  std::vector<std::vector<std::string>> rows;
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    if (line.empty() || line[0] == '#') continue;
    std::vector<std::string> parts;
    std::istringstream cells(line);
    for (std::string part; std::getline(cells, part, ',');) parts.push_back(part);
    rows.push_back(parts);
  }
  return rows;
}

}  // namespace flexboom::testing
