#pragma once

// Rank of the constraints, starts on them, consistent accelerations. Internal to the redundant coordinates.

#include "dynamics/redundant/equations.hpp"

#include <string>
#include <vector>

namespace flexboom::redundant {

/// Rows of all joints, by number.
struct RowName {
  size_t joint = 0, row = 0;
};
std::vector<RowName> row_names(const Equations&);
std::string describe(const Equations&, RowName);  // joint "a": tilt about x

/// The rank of the gradient of all rows, scaled by the inverse metric and to rows of length 1. It is found by QR with
/// column pivoting. The report says which rows span the gradient, and how near they are to dependence.
struct RankReport {
  std::vector<char> kept;  // per row
  std::vector<RowName> left_out;
  double margin = 1;  // smallest kept pivot over the largest, 0 to 1
  double gap = 1;     // largest pivot left out, 0 where none
};
RankReport constraint_rank(Equations&, double t, const double* y);

/// The joint whose rows are most nearly a combination of the others', loops before the tree: what a lock is called
/// by.
std::string locked_joint(Equations&, double t, const double* y);

/// The body that moves most where the mass matrix of what the constraints leave free has no, or negative, inertia;
/// empty where it has enough.
std::string body_without_inertia(Equations&, double t, const double* y);

/// Names the row with the largest violation.
struct Violation {
  double position = 0, angle = 0;  // [m], [rad]; or per second
  RowName worst_position, worst_angle;
};
Violation violation(const Equations&, const Eigen::VectorXd& values);

/// Is a joint at the wrong one of its solutions (axes opposite)? @throws InputError naming it.
void check_branches(Equations&, double t, const double* y);

}  // namespace flexboom::redundant
