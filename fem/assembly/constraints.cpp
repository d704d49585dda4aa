#include "fem/assembly/constraints.hpp"

#include "fem/assembly/held_fields.hpp"
#include "fem/assembly/idle_freedoms.hpp"
#include "fem/base/at.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Triplets = std::vector<Eigen::Triplet<double>>;

void add_term(ConstraintRow& row, int dof, double coefficient) {
  if (coefficient != 0) row.terms.emplace_back(dof, coefficient);
}

/// u_node = u_ref + theta_ref x (x_node - x_ref), theta_node = theta_ref.
void add_rigid(std::vector<ConstraintRow>& rows, const Mesh& mesh, const DofMap& dofs, const RigidConnection& c) {
  for (const int node : c.nodes) {
    if (node == c.reference) continue;
    const Vector3d arm = mesh.nodes.col(node) - mesh.nodes.col(c.reference);
    for (int k = 0; k < dofs.freedoms_of(node); ++k) {
      if (!c.components[at(k)]) continue;
      ConstraintRow& row = rows.emplace_back();
      row.preferred = dofs.of_node(node, k);
      add_term(row, row.preferred, 1);
      add_term(row, dofs.of_node(c.reference, k), -1);
      if (k >= 3) continue;
      for (int j = 0; j < 3; ++j) {
        add_term(row, dofs.of_node(c.reference, 3 + j), -Vector3d::Unit(j).cross(arm)(k));
      }
    }
  }
}

/// Moments of the weighted nodes of a distributing connection.
struct Cloud {
  double weight = 0;
  Vector3d centre = Vector3d::Zero();
  Matrix3d inertia = Matrix3d::Zero();  // about the centre
};

Cloud cloud_of(const Mesh& mesh, const DistributingConnection& c) {
  Cloud cloud;
  for (size_t i = 0; i < c.nodes.size(); ++i) {
    cloud.weight += c.weights[i];
    cloud.centre += c.weights[i] * mesh.nodes.col(c.nodes[i]);
  }
  cloud.centre /= cloud.weight;
  for (size_t i = 0; i < c.nodes.size(); ++i) {
    const Vector3d r = mesh.nodes.col(c.nodes[i]) - cloud.centre;
    cloud.inertia += c.weights[i] * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose());
  }
  return cloud;
}

/// theta = J^-1 sum w r x u about the weighted centre, u_ref = sum w u / sum w + theta x (x_ref - centre): the rigid
/// motion that fits the nodes best in the sense of weighted least squares.
void add_distributing(std::vector<ConstraintRow>& rows, const Mesh& mesh, const DofMap& dofs,
                      const DistributingConnection& c) {
  const Cloud cloud = cloud_of(mesh, c);
  const Vector3d moments = Eigen::SelfAdjointEigenSolver<Matrix3d>(cloud.inertia, Eigen::EigenvaluesOnly).eigenvalues();
  require(
      moments(0) > 1e-12 * moments(2),
      fmt::format("distributing connection of node {}: its nodes lie on a line and cannot carry a rotation about it; "
                  "add nodes beside the line",
                  mesh.node_label(c.reference)));
  const Matrix3d J_inverse = cloud.inertia.inverse();
  const Vector3d arm = mesh.nodes.col(c.reference) - cloud.centre;
  for (int k = 0; k < 6; ++k) {
    if (!c.components[at(k)]) continue;
    ConstraintRow& row = rows.emplace_back();
    row.preferred = dofs.of_node(c.reference, k);
    add_term(row, row.preferred, 1);
    for (size_t i = 0; i < c.nodes.size(); ++i) {
      const Vector3d r = mesh.nodes.col(c.nodes[i]) - cloud.centre;
      for (int j = 0; j < 3; ++j) {
        const Vector3d theta = J_inverse * (c.weights[i] * r.cross(Vector3d::Unit(j)));  // of a unit u_j of this node
        const double motion = k < 3 ? theta.cross(arm)(k) + (j == k ? c.weights[i] / cloud.weight : 0) : theta(k - 3);
        add_term(row, dofs.of_node(c.nodes[i], j), -motion);
      }
    }
  }
}

/// Gaussian elimination on sparse rows. A pivot is expressed by freedoms that no earlier pivot is among.
class Elimination {
 public:
  Elimination(int freedoms, std::vector<char> held, std::vector<char> independent)
      : held_(std::move(held)),
        independent_(std::move(independent)),
        pivot_row_(at(freedoms), -1),
        value_(at(freedoms), 0),
        listed_(at(freedoms), 0) {}

  void add(const ConstraintRow& row) {
    for (const auto& [dof, coefficient] : row.terms) accumulate(dof, coefficient);
    substitute();
    double largest = 0, original = 0;
    int strongest = -1;
    for (const auto& [dof, coefficient] : row.terms) original = std::max(original, std::abs(coefficient));
    for (const int dof : list_) {
      largest = std::max(largest, std::abs(value_[at(dof)]));
      if (!independent_[at(dof)] && (strongest < 0 || std::abs(value_[at(dof)]) > std::abs(value_[at(strongest)])))
        strongest = dof;
    }
    if (largest > 1e-11 * original) {  // below: redundant to round-off
      require(strongest >= 0 && std::abs(value_[at(strongest)]) > 1e-9 * largest,
              "connections tie freedoms to each other that are to be independent");
      const bool take_preferred = row.preferred >= 0 && !independent_[at(row.preferred)] &&
                                  std::abs(value_[at(row.preferred)]) > 1e-6 * largest;
      store(take_preferred ? row.preferred : strongest, 1e-14 * largest);
    }
    clear();
  }

  bool is_pivot(int dof) const { return pivot_row_[at(dof)] >= 0; }

  /// Every pivot by freedoms that are no pivots.
  std::vector<std::vector<std::pair<int, double>>> resolved() {
    for (size_t i = rows_.size(); i-- > 0;) {
      for (const auto& [dof, coefficient] : rows_[i]) accumulate(dof, coefficient);
      substitute();
      rows_[i].clear();
      for (const int dof : list_) {
        if (value_[at(dof)] != 0) rows_[i].emplace_back(dof, value_[at(dof)]);
      }
      clear();
    }
    std::vector<std::vector<std::pair<int, double>>> result(pivot_row_.size());
    for (size_t dof = 0; dof < pivot_row_.size(); ++dof) {
      if (pivot_row_[dof] >= 0) result[dof] = rows_[at(pivot_row_[dof])];
    }
    return result;
  }

 private:
  void accumulate(int dof, double coefficient) {
    if (held_[at(dof)]) return;
    if (!listed_[at(dof)]) list_.push_back(dof);
    listed_[at(dof)] = 1;
    value_[at(dof)] += coefficient;
  }

  /// Replaces pivots by what they follow; each replacement brings later pivots only, so it ends.
  void substitute() {
    for (size_t i = 0; i < list_.size(); ++i) {  // NOLINT(modernize-loop-convert): the list grows meanwhile
      const int dof = list_[i];
      if (!is_pivot(dof) || value_[at(dof)] == 0) continue;
      const double factor = value_[at(dof)];
      value_[at(dof)] = 0;
      listed_[at(dof)] = 0;  // a later replacement may bring it back
      for (const auto& [other, coefficient] : rows_[at(pivot_row_[at(dof)])]) accumulate(other, factor * coefficient);
    }
  }

  void store(int pivot, double noise) {
    auto& row = rows_.emplace_back();
    for (const int dof : list_) {
      if (dof != pivot && std::abs(value_[at(dof)]) > noise)
        row.emplace_back(dof, -value_[at(dof)] / value_[at(pivot)]);
    }
    pivot_row_[at(pivot)] = static_cast<int>(rows_.size()) - 1;
  }

  void clear() {
    for (const int dof : list_) {
      value_[at(dof)] = 0;
      listed_[at(dof)] = 0;
    }
    list_.clear();
  }

  std::vector<char> held_, independent_;
  std::vector<int> pivot_row_;  // of each freedom, -1: none
  std::vector<std::vector<std::pair<int, double>>> rows_;
  std::vector<double> value_;  // the row at work
  std::vector<char> listed_;
  std::vector<int> list_;
};

/// Unknowns among `rows` (of followers) that move nothing that strains or has mass, or nothing that others do not move:
/// they have no motion of their own. `open`: freedoms that may be left out.
std::vector<int> without_motion(const std::vector<std::vector<std::pair<int, double>>>& rows,
                                const std::vector<char>& idle, const std::vector<char>& open) {
  std::vector<std::vector<std::pair<int, double>>> moved;
  for (size_t follower = 0; follower < rows.size(); ++follower) {
    if (idle[follower]) continue;
    std::vector<std::pair<int, double>> row;
    std::ranges::copy_if(rows[follower], std::back_inserter(row),
                         [&open](const auto& term) { return open[at(term.first)]; });
    if (!row.empty()) moved.push_back(std::move(row));
  }
  std::vector<char> moves(rows.size(), 0);
  for (IdleGroup& group : idle_groups(moved, static_cast<int>(rows.size()))) {
    group.A.colwise().normalize();
    Eigen::ColPivHouseholderQR<MatrixXd> qr(group.A);
    qr.setThreshold(idle_rank);
    for (Index i = 0; i < qr.rank(); ++i)
      moves[at(group.freedoms[static_cast<size_t>(qr.colsPermutation().indices()(i))])] = 1;
  }
  std::vector<int> result;
  for (size_t dof = 0; dof < open.size(); ++dof) {
    if (open[dof] && !moves[dof]) result.push_back(static_cast<int>(dof));
  }
  return result;
}

/// Why no freedom is left.
std::string nothing_left(const Mesh& mesh, const DofMap& dofs) {
  if (std::ranges::find(dofs.absent, 0) != dofs.absent.end()) return "modes: every freedom is clamped";
  std::vector<std::string> materials;
  for (const SolidProperty& property : mesh.solid_properties) materials.push_back(fmt::format("\"{}\"", property.name));
  if (!mesh.beam_properties.empty()) materials.emplace_back("of the beams");
  return fmt::format(
      "modes: nothing has mass, and without mass there are no frequencies; the density is missing or zero: "
      "material {}; give it in the file, or with --material E,nu,rho",
      fmt::join(materials, ", "));
}

SparseMatrix make_sparse(Index rows, Index cols, const Triplets& triplets) {
  SparseMatrix A(rows, cols);
  A.setFromTriplets(triplets.begin(), triplets.end());
  return A;
}

/// Rows and columns of A that are unknowns; their order is kept, so the lower triangle stays one.
SparseMatrix principal_part(const SparseMatrix& A, const Unknowns& unknowns) {
  SparseMatrix result(unknowns.count, unknowns.count);
  int* start = result.outerIndexPtr();
  long entries = 0;
  for (int pass = 0; pass < 2; ++pass) {  // count, then fill
    if (pass == 1) result.resizeNonZeros(entries);
    long place = 0;
    for (int j = 0; j < A.cols(); ++j) {
      const int column = unknowns.of_freedom[at(j)];
      if (column < 0) continue;
      start[column] = static_cast<int>(place);
      for (SparseMatrix::InnerIterator it(A, j); it; ++it) {
        const int row = unknowns.of_freedom[static_cast<size_t>(it.row())];
        if (row < column) continue;
        if (pass == 1) {
          result.innerIndexPtr()[place] = row;
          result.valuePtr()[place] = it.value();
        }
        ++place;
      }
    }
    entries = place;
    start[unknowns.count] = static_cast<int>(entries);
  }
  return result;
}

/// The parts of A that touch followers: B between followers and unknowns, C among followers (full).
std::pair<SparseMatrix, SparseMatrix> follower_parts(const SparseMatrix& A, const Unknowns& unknowns) {
  std::vector<int> place(unknowns.of_freedom.size(), -1);
  for (size_t i = 0; i < unknowns.follower.size(); ++i) place[at(unknowns.follower[i])] = static_cast<int>(i);
  Triplets to_unknowns, among;
  for (int j = 0; j < A.cols(); ++j) {
    for (SparseMatrix::InnerIterator it(A, j); it; ++it) {
      const auto i = static_cast<int>(it.row());
      if (i < j) continue;
      const int p = place[at(i)], q = place[at(j)];
      const int row = unknowns.of_freedom[at(i)], column = unknowns.of_freedom[at(j)];
      if (p >= 0 && q >= 0) {
        among.emplace_back(p, q, it.value());
        if (p != q) among.emplace_back(q, p, it.value());
      } else if (p >= 0 && column >= 0) {
        to_unknowns.emplace_back(p, column, it.value());
      } else if (q >= 0 && row >= 0) {
        to_unknowns.emplace_back(q, row, it.value());
      }
    }
  }
  const Index followers = std::ssize(unknowns.follower);
  return {make_sparse(followers, unknowns.count, to_unknowns), make_sparse(followers, followers, among)};
}

}  // namespace

std::vector<char> held_freedoms(const Mesh& mesh, const DofMap& dofs, const Clamp& clamp) {
  std::vector<char> held = dofs.absent;
  const auto hold = [&](int node, const Components& components) {
    for (int k = 0; k < dofs.freedoms_of(node); ++k) {
      if (components[at(k)]) held[at(dofs.of_node(node, k))] = 1;
    }
  };
  for (const int node : clamp.nodes) {
    require(node >= 0 && node < mesh.nodes.cols(), fmt::format("clamp: node {} is missing", node));
    hold(node, all_components);
  }
  if (clamp.with_supports) {
    for (const Support& support : mesh.supports) hold(support.node, support.components);
    if (!mesh.supports.empty()) {
      for (const int dof : internal_freedoms_of_held_fields(mesh, dofs, held)) held[at(dof)] = 1;
    }
  }
  return held;
}

std::vector<ConstraintRow> constraint_rows(const Mesh& mesh, const DofMap& dofs) {
  std::vector<ConstraintRow> rows;
  for (const RigidConnection& c : mesh.rigid_connections) add_rigid(rows, mesh, dofs, c);
  for (const DistributingConnection& c : mesh.distributing_connections) add_distributing(rows, mesh, dofs, c);
  for (const LinearEquation& equation : mesh.equations) {
    ConstraintRow& row = rows.emplace_back();
    for (const LinearEquation::Term& term : equation.terms) {
      add_term(row, dofs.of_node(term.node, term.component), term.coefficient);
    }
    if (row.terms.empty())
      rows.pop_back();
    else
      row.preferred = row.terms.front().first;
  }
  return rows;
}

Mesh without_supports(Mesh mesh) {
  std::vector<char> in_body(at(static_cast<int>(mesh.nodes.cols())), 0);
  const auto add = [&in_body](int node) { in_body[at(node)] = 1; };
  for (const Element& element : mesh.elements) std::ranges::for_each(element.nodes, add);
  for (const NodalBody& body : mesh.bodies) add(body.node);
  for (const RigidConnection& c : mesh.rigid_connections) {
    add(c.reference);
    std::ranges::for_each(c.nodes, add);
  }
  for (const DistributingConnection& c : mesh.distributing_connections) {
    add(c.reference);
    std::ranges::for_each(c.nodes, add);
  }
  std::set<std::pair<int, int>> ground;  // node, component
  for (const Support& support : mesh.supports) {
    for (int k = 0; k < 6; ++k) {
      if (support.components[at(k)] && !in_body[at(support.node)]) ground.emplace(support.node, k);
    }
  }
  for (const LinearEquation& equation : mesh.equations) {
    const LinearEquation::Term& first = equation.terms.front();
    if (equation.terms.size() == 1 && !in_body[at(first.node)]) ground.emplace(first.node, first.component);
  }
  std::erase_if(mesh.equations, [&ground](const LinearEquation& equation) {
    std::set<int> nodes;
    for (const LinearEquation::Term& term : equation.terms) {
      if (term.coefficient != 0 && !ground.contains({term.node, term.component})) nodes.insert(term.node);
    }
    return nodes.size() <= 1;
  });
  mesh.supports.clear();
  return mesh;
}

SparseMatrix Unknowns::reduced(const SparseMatrix& A) const {
  SparseMatrix result = principal_part(A, *this);
  if (follower.empty()) return result;
  // T^T A T with T = [I; F]: A_uu + F^T B + B^T F + F^T C F
  const auto [B, C] = follower_parts(A, *this);
  const SparseMatrix F_t = follower_rows.transpose();
  const SparseMatrix FB = F_t * B;
  const SparseMatrix FCF = F_t * SparseMatrix(C * follower_rows);
  const SparseMatrix sum = FB + SparseMatrix(FB.transpose()) + FCF;
  result += SparseMatrix(sum.triangularView<Eigen::Lower>());
  result.makeCompressed();
  return result;
}

MatrixXd Unknowns::expanded(const Eigen::Ref<const MatrixXd>& X) const {
  require(X.rows() == count, fmt::format("unknowns: vectors have {} entries, {} expected", X.rows(), count));
  MatrixXd U = MatrixXd::Zero(std::ssize(of_freedom), X.cols());
  for (size_t dof = 0; dof < of_freedom.size(); ++dof) {
    if (of_freedom[dof] >= 0) U.row(static_cast<Index>(dof)) = X.row(of_freedom[dof]);
  }
  if (!follower.empty()) U(follower, Eigen::all) = follower_rows * X;
  return U;
}

MatrixXd Unknowns::reduced_loads(const Eigen::Ref<const MatrixXd>& F) const {
  MatrixXd result = F(free_dofs(), Eigen::all);
  if (!follower.empty()) result += follower_rows.transpose() * F(follower, Eigen::all);
  return result;
}

std::vector<int> Unknowns::free_dofs() const {
  std::vector<int> free;
  for (size_t dof = 0; dof < of_freedom.size(); ++dof) {
    if (of_freedom[dof] >= 0) free.push_back(static_cast<int>(dof));
  }
  return free;
}

Unknowns unknowns(const Mesh& mesh, const DofMap& dofs, const Clamp& clamp, const std::vector<int>& independent) {
  if (!clamp.with_supports) return unknowns(without_supports(mesh), dofs, {clamp.nodes}, independent);
  std::vector<char> held = held_freedoms(mesh, dofs, clamp);
  std::vector<char> keep(held.size(), 0);
  for (const int dof : independent) keep[at(dof)] = 1;
  Elimination elimination(dofs.count, held, std::move(keep));
  for (const ConstraintRow& row : constraint_rows(mesh, dofs)) elimination.add(row);

  const std::vector<std::vector<std::pair<int, double>>> rows = elimination.resolved();
  const std::vector<char> idle = idle_freedoms(mesh, dofs);
  std::vector<char> open = idle;
  for (int dof = 0; dof < dofs.count; ++dof) {
    if (elimination.is_pivot(dof) || held[at(dof)]) open[at(dof)] = 0;
  }
  for (const int dof : independent) open[at(dof)] = 0;
  for (const int dof : without_motion(rows, idle, open)) held[at(dof)] = 1;

  Unknowns result;
  result.of_freedom.assign(at(dofs.count), -1);
  for (int dof = 0; dof < dofs.count; ++dof) {
    if (elimination.is_pivot(dof)) {
      result.follower.push_back(dof);
    } else if (!held[at(dof)]) {
      result.of_freedom[at(dof)] = result.count++;
    }
  }
  if (result.count == 0) throw InputError(nothing_left(mesh, dofs));
  if (result.follower.empty()) return result;
  Triplets triplets;
  for (size_t i = 0; i < result.follower.size(); ++i) {
    for (const auto& [dof, coefficient] : rows[at(result.follower[i])]) {
      if (!held[at(dof)]) triplets.emplace_back(static_cast<int>(i), result.of_freedom[at(dof)], coefficient);
    }
  }
  result.follower_rows = make_sparse(std::ssize(result.follower), result.count, triplets);
  return result;
}

}  // namespace flexboom
