#pragma once

#include "reduction/body/reduced_body.hpp"

#include <Eigen/Core>

#include <array>
#include <string>

/// How far bodies bend.
namespace flexboom {

/// The marker whose displacement is the output NAME.tip: "tip" in any case; without one, the only marker that moves.
/// nullptr: none, or several that are no tip.
const Marker* tip_of(const ReducedBody&);

/// Says so of a body that has none: which markers it has.
std::string no_tip(const ReducedBody&);

/// Elastic displacement of a marker, BRF [m]: S q, and of second order -1/2 q^T Kf q, where the body has the geometric
/// stiffness Kf of forces at the marker. An output has it whether or not the equations do: it is the larger part.
class MarkerDisplacement {
 public:
  MarkerDisplacement(const ReducedBody&, const Marker&);
  Eigen::Vector3d operator()(const Eigen::VectorXd& q) const;

 private:
  Eigen::Matrix3Xd S_;
  std::array<Eigen::MatrixXd, 3> Kf_;  // per axis; empty: none
};

/// Largest elastic displacement of a body over its markers and the points of its picture, by its length.
class Deflection {
 public:
  explicit Deflection(const ReducedBody&);
  double length() const { return length_; }        // [m]
  double largest(const Eigen::VectorXd& q) const;  // [m]

 private:
  double length_ = 0;
  Eigen::MatrixXd S_;  // 3 rows for each point
};

}  // namespace flexboom
