#include "fem/mesh/validation.hpp"

#include "fem/base/round_off.hpp"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include <cmath>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::Vector3d;

void validate_rigid(double mass, const Matrix3d& inertia, const Vector3d& offset) {
  require(std::isfinite(mass) && mass >= 0, fmt::format("mass is {} kg; it must be zero or positive", mass));
  require(offset.allFinite(), "offset has a component that is not finite");
  require(inertia.allFinite(), "inertia has an entry that is not finite");
  const double scale = inertia.cwiseAbs().maxCoeff();
  require((inertia - inertia.transpose()).cwiseAbs().maxCoeff() <= relative_round_off * scale,
          "inertia must be symmetric");
  require(mass > 0 || scale == 0, "inertia without mass; give the mass that carries it");
  require(mass > 0 || offset.isZero(0), "offset without mass; give the mass that it moves");
  const Vector3d I = Eigen::SelfAdjointEigenSolver<Matrix3d>(inertia, Eigen::EigenvaluesOnly).eigenvalues();
  require(I(0) >= -relative_round_off * scale, fmt::format("inertia has the negative principal value {} kg m^2", I(0)));
  require(I(0) + I(1) >= I(2) - relative_round_off * scale,
          fmt::format("inertia breaks the triangle inequality: principal values {}, {}, {} kg m^2; "
                      "none can exceed the sum of the others",
                      I(0), I(1), I(2)));
}

void validate_sections(const SectionShape& start, const SectionShape& end, const Material& material, BeamTheory theory,
                       const ShearRule& shear) {
  const ShearRule rule = theory == BeamTheory::timoshenko ? shear : ShearRule{"value", 1};
  within("start", [&] { section_of(start, material.nu, rule); });
  within("end", [&] { section_of(end, material.nu, rule); });
  interpolate(start, end, 0.5);
}

}  // namespace flexboom
