#include "apps/scene/scene_checks.hpp"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include <cctype>
#include <cmath>

namespace flexboom::scene_checks {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using toml_reader::Faults;

std::string join(const std::string& path, std::string_view key) {
  return path.empty() ? std::string(key) : fmt::format("{}.{}", path, key);
}

namespace {

// Beyond these a product of a few of them is no longer a number, or zero.
constexpr double least_size = 1e-50, most_size = 1e30;

}  // namespace

void positive(Faults& faults, const std::string& path, const double& value, std::string_view unit) {
  if (!(std::isfinite(value) && value > 0)) {
    faults.add(path, fmt::format("is {}{}; it must be positive{}", value, unit, value > 0 ? " and finite" : ""));
  } else if (value < least_size || value > most_size) {
    faults.add(path, fmt::format("is {}{}; what can be computed with lies between {:g} and {:g}", value, unit,
                                 least_size, most_size));
  }
}

void not_negative(Faults& faults, const std::string& path, const double& value, std::string_view unit) {
  if (!(std::isfinite(value) && value >= 0)) {
    faults.add(path, fmt::format("is {}{}; it must be zero or positive", value, unit));
  } else if (value > 0 && value < least_size) {
    faults.add(path,
               fmt::format("is {}{}; it must be zero, or {:g} or more to be computed with", value, unit, least_size));
  }
}

void start(Faults& faults, const std::string& path, const double& value, std::string_view unit) {
  constexpr double far = 1e4;  // of angles, 1600 turns: the digits that are left must tell contacts apart
  finite(faults, path, value, unit);
  if (std::abs(value) > far)
    faults.add(path, fmt::format("is {}{}; a start lies between {:g} and {:g}", value, unit, -far, far));
}

void finite(Faults& faults, const std::string& path, const double& value, std::string_view) {
  if (!std::isfinite(value)) faults.add(path, fmt::format("is {}; it must be a finite number", value));
}

void finite(Faults& faults, const std::string& path, const Vector3d& v, std::string_view) {
  if (!v.allFinite())
    faults.add(path, fmt::format("is [{}, {}, {}]; every entry must be a finite number", v.x(), v.y(), v.z()));
}

void direction(Faults& faults, const std::string& path, const Vector3d& v, std::string_view) {
  if (!(std::abs(v.norm() - 1) <= round_off))
    faults.add(path,
               fmt::format("is [{}, {}, {}] of length {}; it must be a unit vector", v.x(), v.y(), v.z(), v.norm()));
}

void box(Faults& faults, const std::string& path, const Vector3d& sides, std::string_view unit) {
  for (const double side : sides) not_negative(faults, path, side, unit);
}

void name(Faults& faults, const std::string& path, const std::string& name, std::string_view) {
  const auto allowed = [](unsigned char c) { return (c < 0x80 && std::isalnum(c)) || c == '_' || c == '-'; };
  if (name.empty() || !std::all_of(name.begin(), name.end(), allowed)) {
    faults.add(path, fmt::format("is {}; it must be one or more of the letters a-z, A-Z, digits, _ and -",
                                 toml_reader::in_quotes(name)));
  }
}

namespace {

void check_inertia(Faults& faults, const std::string& path, const Matrix3d& inertia, bool may_vanish) {
  if (!inertia.allFinite()) return faults.add(path, "has an entry that is not finite; give 9 or 3 finite numbers");
  const double scale = inertia.cwiseAbs().maxCoeff();
  const double skew = (inertia - inertia.transpose()).cwiseAbs().maxCoeff();
  if (skew > round_off * scale) {
    return faults.add(
        path, fmt::format("is not symmetric: entries across the diagonal differ by up to {:g} kg m^2, {:.3g} % of "
                          "the largest entry; up to 2 % is repaired with a warning",
                          skew, 100 * skew / scale));
  }
  if (scale > 0 && (scale < least_size || scale > most_size))
    return faults.add(path,
                      fmt::format("has entries up to {:g} kg m^2; what can be computed with lies between {:g} and "
                                  "{:g}",
                                  scale, least_size, most_size));
  const Vector3d I = Eigen::SelfAdjointEigenSolver<Matrix3d>(inertia, Eigen::EigenvaluesOnly).eigenvalues();
  const std::string moments = fmt::format("principal moments {:g}, {:g}, {:g} kg m^2", I(0), I(1), I(2));
  if (may_vanish ? I(0) < -round_off * scale : I(0) <= 0) {
    return faults.add(path, fmt::format("is not positive definite: {}; {}", moments,
                                        may_vanish ? "none may be negative" : "all must be positive"));
  }
  if (I(2) > (I(0) + I(1)) * (1 + round_off)) {
    faults.add(path, fmt::format("breaks the triangle inequality: {}; none can exceed the sum of the others", moments));
  }
}

}  // namespace

void definite(Faults& faults, const std::string& path, const Matrix3d& inertia, std::string_view) {
  check_inertia(faults, path, inertia, false);
}

void semidefinite(Faults& faults, const std::string& path, const Matrix3d& inertia, std::string_view) {
  check_inertia(faults, path, inertia, true);
}

}  // namespace flexboom::scene_checks
