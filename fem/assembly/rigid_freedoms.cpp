#include "fem/assembly/constraints.hpp"
#include "fem/assembly/idle_freedoms.hpp"
#include "fem/base/at.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/QR>

#include <algorithm>
#include <cmath>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Vector6d = Eigen::Vector<double, 6>;
using Gram = Eigen::Matrix<double, 6, 6>;

/// Rigid motions of the freedoms that elements resist: translation, then rotation about the centre. Lengths are scaled
/// to the body, so that rotations count like translations.
struct Motions {
  Motions(const Mesh& mesh, const DofMap& dofs)
      : strained(strained_freedoms(mesh, dofs)),
        of(Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, dofs.count)),
        unit(Eigen::VectorXd::Ones(dofs.count)) {
    Eigen::AlignedBox3d box;
    for (int node = 0; node < mesh.nodes.cols(); ++node) {
      if (dofs.freedoms_of(node) > 0 && strained[at(dofs.of_node(node, 0))]) box.extend(Vector3d(mesh.nodes.col(node)));
    }
    const double size = box.isEmpty() ? 1 : std::max(1e-300, box.diagonal().norm() / 2);
    for (int node = 0; node < mesh.nodes.cols(); ++node) {
      for (int k = 0; k < dofs.freedoms_of(node); ++k) {
        const int dof = dofs.of_node(node, k);
        if (k >= 3) unit(dof) = 1 / size;
        if (!strained[at(dof)]) continue;
        of(k, dof) = 1;
        if (k < 3)  // (theta x r)_k = theta . (r x e_k)
          of.col(dof).tail<3>() = (Vector3d(mesh.nodes.col(node)) - box.center()).cross(Vector3d::Unit(k)) / size;
      }
    }
  }

  std::vector<char> strained;
  Eigen::Matrix<double, 6, Eigen::Dynamic> of;
  Eigen::VectorXd unit;  // of each freedom in the scaled lengths
};

/// What constraints ask of rigid motions. Freedoms without strain move as well as they can for them. Only what none of
/// their motions reaches is left: the part of Q beyond the rank in a QR factorisation.
void add_constraints(Gram& of_held, const std::vector<ConstraintRow>& rows, const Motions& motions,
                     const std::vector<char>& held) {
  std::vector<Vector6d> asked;
  std::vector<std::vector<std::pair<int, double>>> idle;
  for (const ConstraintRow& row : rows) {
    double scale = 0;
    for (const auto& [dof, coefficient] : row.terms) scale = std::max(scale, std::abs(coefficient * motions.unit(dof)));
    Vector6d of_motion = Vector6d::Zero();
    std::vector<std::pair<int, double>> others;
    for (const auto& [dof, coefficient] : row.terms) {
      const double c = coefficient * motions.unit(dof) / scale;
      if (motions.strained[at(dof)])
        of_motion += c * motions.of.col(dof);
      else if (!held[at(dof)])
        others.emplace_back(dof, c);
    }
    if (others.empty()) {
      of_held += of_motion * of_motion.transpose();
    } else {
      asked.push_back(of_motion);
      idle.push_back(std::move(others));
    }
  }
  for (const IdleGroup& group : idle_groups(idle, static_cast<int>(held.size()))) {
    MatrixXd left(std::ssize(group.rows), 6);
    for (Index i = 0; i < left.rows(); ++i) left.row(i) = asked[at(group.rows[static_cast<size_t>(i)])];
    Eigen::ColPivHouseholderQR<MatrixXd> qr(group.A);
    qr.setThreshold(idle_rank);
    left.applyOnTheLeft(qr.householderQ().transpose());
    const MatrixXd unreached = left.bottomRows(left.rows() - qr.rank());
    of_held += unreached.transpose() * unreached;
  }
}

}  // namespace

int rigid_freedoms(const Mesh& mesh, const DofMap& dofs, const Clamp& clamp) {
  if (!clamp.with_supports) return rigid_freedoms(without_supports(mesh), dofs, {clamp.nodes});
  const Motions motions(mesh, dofs);
  const std::vector<char> held = held_freedoms(mesh, dofs, clamp);
  Gram of_held = Gram::Zero(), of_all = Gram::Zero();
  for (int dof = 0; dof < dofs.count; ++dof) {
    if (!motions.strained[at(dof)]) continue;
    const Gram motion = motions.of.col(dof) * motions.of.col(dof).transpose();
    of_all += motion;
    if (held[at(dof)]) of_held += motion;
  }
  add_constraints(of_held, constraint_rows(mesh, dofs), motions, held);
  // Motions that move nothing (the spin of a line mass) are no freedoms.
  const auto null_space = [](const Gram& gram) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(MatrixXd(gram), Eigen::EigenvaluesOnly);
    return static_cast<int>((solver.eigenvalues().array() <= 1e-12 * std::max(1.0, gram.trace())).count());
  };
  return null_space(of_held) - null_space(of_all);
}

}  // namespace flexboom
