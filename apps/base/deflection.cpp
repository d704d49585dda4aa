#include "apps/base/deflection.hpp"

#include "fem/base/text_reader.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace flexboom {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

constexpr double zero_shape = 1e-10;  // of shapes where the body is held

/// Of a body without a picture: a rod of its mass and inertia.
double length_of_rod(const ReducedBody& b) {
  const double J = b.J0.trace() - 2 * b.mc0.squaredNorm() / b.m;  // about the mass centre
  return std::sqrt(6 * std::max(J, 0.0) / b.m);
}

}  // namespace

const Marker* tip_of(const ReducedBody& body) {
  const Marker *named = nullptr, *only = nullptr;
  double most = 0;
  for (const Marker& m : body.markers) {
    if (same_but_case(m.name, "tip") && (!named || m.name == "tip")) named = &m;
    most = std::max(most, m.S.norm());
  }
  int moving = 0;
  for (const Marker& m : body.markers)
    if (m.S.norm() > zero_shape * most) only = &m, ++moving;
  return named || moving != 1 ? named : only;
}

std::string no_tip(const ReducedBody& body) {
  std::vector<std::string> names;
  for (const Marker& m : body.markers) names.push_back(m.name);
  return fmt::format(
      "body {} has no marker that is its tip: of {} none is called \"tip\", and more than one or none moves", body.name,
      names.empty() ? "no markers" : fmt::format("{}", fmt::join(names, ", ")));
}

MarkerDisplacement::MarkerDisplacement(const ReducedBody& body, const Marker& at) : S_(at.S) {
  for (const MarkerStiffness& k : body.Kg.markers)
    for (size_t i = 0; k.marker == at.name && i < k.force.size(); ++i)
      if (!k.force[i].isZero(0)) Kf_[i] = k.force[i];
}

Vector3d MarkerDisplacement::operator()(const VectorXd& q) const {
  Vector3d u = S_.lazyProduct(q);
  for (size_t i = 0; i < Kf_.size(); ++i)
    if (Kf_[i].size() > 0) u[static_cast<Index>(i)] -= 0.5 * q.dot(Kf_[i].lazyProduct(q));
  return u;
}

Deflection::Deflection(const ReducedBody& body) {
  constexpr size_t enough = 200;
  std::vector<const Matrix3Xd*> shapes;
  for (const Marker& m : body.markers)
    if (m.S.cols() == body.n()) shapes.push_back(&m.S);
  const size_t stride = body.display.S.size() / enough + 1;
  for (size_t i = 0; i < body.display.S.size(); i += stride) shapes.push_back(&body.display.S[i]);
  S_.resize(3 * std::ssize(shapes), body.n());
  for (size_t i = 0; i < shapes.size(); ++i) S_.middleRows<3>(3 * static_cast<Index>(i)) = *shapes[i];
  const Matrix3Xd& points = body.display.points;
  if (points.cols() > 1) length_ = (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).norm();
  if (!(length_ > 0)) length_ = length_of_rod(body);
}

double Deflection::largest(const VectorXd& q) const {
  if (S_.size() == 0) return 0;
  const VectorXd u = S_ * q;
  return std::sqrt(u.reshaped(3, u.size() / 3).colwise().squaredNorm().maxCoeff());
}

}  // namespace flexboom
