#include "apps/scene_checks.hpp"

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

void check_positive(Faults& faults, const std::string& path, double value, std::string_view unit) {
  if (!(std::isfinite(value) && value > 0)) faults.add(path, fmt::format("is {}{}; it must be positive", value, unit));
}

void check_not_negative(Faults& faults, const std::string& path, double value, std::string_view unit) {
  if (!(std::isfinite(value) && value >= 0))
    faults.add(path, fmt::format("is {}{}; it must be zero or positive", value, unit));
}

void check_finite(Faults& faults, const std::string& path, double value) {
  if (!std::isfinite(value)) faults.add(path, fmt::format("is {}; it must be a finite number", value));
}

void check_finite(Faults& faults, const std::string& path, const Vector3d& v) {
  if (!v.allFinite())
    faults.add(path, fmt::format("is [{}, {}, {}]; every entry must be a finite number", v.x(), v.y(), v.z()));
}

void check_unit(Faults& faults, const std::string& path, const Vector3d& v) {
  if (!(std::abs(v.norm() - 1) <= round_off))
    faults.add(path,
               fmt::format("is [{}, {}, {}] of length {}; it must be a unit vector", v.x(), v.y(), v.z(), v.norm()));
}

void check_name(Faults& faults, const std::string& path, const std::string& name) {
  const auto allowed = [](unsigned char c) { return (c < 0x80 && std::isalnum(c)) || c == '_' || c == '-'; };
  if (name.empty() || !std::all_of(name.begin(), name.end(), allowed)) {
    faults.add(path, fmt::format("is {}; it must be one or more of the letters a-z, A-Z, digits, _ and -",
                                 toml_reader::quoted(name)));
  }
}

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

}  // namespace flexboom::scene_checks
