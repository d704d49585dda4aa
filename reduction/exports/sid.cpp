#include "reduction/exports/sid.hpp"

#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "reduction/body/tilde.hpp"
#include "reduction/exports/integrals.hpp"
#include "reduction/exports/sid_dialect.hpp"

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include <cmath>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr ExportSetting settings_of_sid[] = {
    {"m1", "row-mode-column|row-column-mode", "indices of first-order entries: EMBSlib, samples | welib"},
    {"Oe", "xy-yz-xz|xy-xz-yz", "columns 4 to 6 of Oe: EMBSlib, samples | parts of welib"},
    {"Ge", "mode|component", "three columns per mode (EMBSlib, welib) | n per component (sample files)"},
    {"J", "6x1|3x3", "inertia: EMBSlib, samples | welib"},
    {"modal_mass", "unit|as-is", "unit: coordinates of unit modal mass, which EMBSlib takes for granted"},
    {"Gr", "0|1", "order of Gr: samples | welib"},
};

Taylor constant(const MatrixXd& m0) { return {m0, {}}; }
Taylor linear(const MatrixXd& m0, Index n) {
  return {m0, std::vector<MatrixXd>(static_cast<size_t>(n), MatrixXd::Zero(m0.rows(), m0.cols()))};
}

/// a . (omega x (omega x b)) of W = sum dm a b^T, as the row that multiplies (w1^2, w2^2, w3^2, w1 w2, w2 w3, w1 w3).
Eigen::RowVectorXd centrifugal(const Matrix3d& W) {
  const double tr = W.trace();
  Eigen::RowVectorXd row(6);
  row << W(0, 0) - tr, W(1, 1) - tr, W(2, 2) - tr, W(0, 1) + W(1, 0), W(1, 2) + W(2, 1), W(0, 2) + W(2, 0);
  return row;
}

/// t.m1[l](k, c) += family[c](k, l): a stiffness per unit of load c.
void add_stiffness(Taylor& t, const std::vector<MatrixXd>& family) {
  if (family.empty()) return;
  const auto n = static_cast<size_t>(family.front().rows());
  if (t.m1.empty()) t = linear(t.m0, static_cast<Index>(n));
  for (size_t l = 0; l < n; ++l) {
    for (size_t c = 0; c < family.size(); ++c) {
      t.m1[l].col(static_cast<Index>(c)) += family[c].col(static_cast<Index>(l));
    }
  }
}

/// A force F at the node does the work F^T phi(q) dq: phi.m1[l](c, k) = -family[c](k, l) is its stiffness.
void add_node_stiffness(Taylor& phi, const std::vector<MatrixXd>& family) {
  if (family.empty()) return;
  const Index n = phi.m0.cols();
  phi = linear(phi.m0, n);
  for (Index l = 0; l < n; ++l) {
    for (size_t c = 0; c < family.size(); ++c) {
      phi.m1[static_cast<size_t>(l)].row(static_cast<Index>(c)) = -family[c].col(l).transpose();
    }
  }
}

SidNode node_of(const ReducedBody& body, const Marker& m, int id) {
  const Index n = body.n();
  SidNode node{id, linear(m.position, n), constant(m.S), constant(m.S_theta), linear(Matrix3d::Identity(), n)};
  for (Index k = 0; k < n; ++k) {
    const auto kk = static_cast<size_t>(k);
    node.origin.m1[kk] = m.S.col(k);
    node.AP.m1[kk] = tilde(m.S_theta.col(k));
  }
  for (const MarkerStiffness& stiffness : body.Kg.markers) {
    if (stiffness.marker != m.name) continue;
    add_node_stiffness(node.phi, stiffness.force);
    add_node_stiffness(node.psi, stiffness.torque);
  }
  return node;
}

/// Matrices that hold S once or twice.
void set_integrals(SidFile& sid, const ReducedBody& body, bool Gr_first_order) {
  const Index n = body.n();
  const RawIntegrals raw(body, "sid");
  sid.mdCM = linear(body.mc0, n);
  sid.J = linear(body.J0, n);
  sid.Ct = constant(body.Ct.transpose());
  sid.Cr = linear(body.Cr0.transpose(), n);
  sid.Gr = Gr_first_order ? linear(MatrixXd::Zero(3, 3 * n), n) : constant(MatrixXd::Zero(3, 3 * n));
  sid.Ge = constant(MatrixXd::Zero(n, 3 * n));
  sid.Oe = linear(MatrixXd::Zero(n, 6), n);
  for (Index k = 0; k < n; ++k) {
    const auto kk = static_cast<size_t>(k);
    sid.mdCM.m1[kk] = body.Ct.col(k);
    sid.J.m1[kk] = body.J1[kk];
    sid.Cr.m1[kk] = body.Cr1[kk].transpose();
    sid.Ge.m0.middleCols<3>(3 * k) = 2 * body.Cr1[kk].transpose();
    sid.Gr.m0.middleCols<3>(3 * k) = -2 * raw.tilde_u0_tilde_S(k);
    sid.Oe.m0.row(k) = centrifugal(raw.S_u0(k));
    for (Index l = 0; l < n; ++l) {
      const auto ll = static_cast<size_t>(l);
      sid.Oe.m1[ll].row(k) = centrifugal(raw.S_S(k, l));
      if (Gr_first_order) sid.Gr.m1[ll].middleCols<3>(3 * k) = -2 * raw.tilde_S_tilde_S(l, k);
    }
  }
  add_stiffness(sid.Ct, body.Kg.acceleration);
  add_stiffness(sid.Cr, body.Kg.angular_acceleration);
  add_stiffness(sid.Oe, body.Kg.spin);
}

class IdentityList {
 public:
  explicit IdentityList(double tolerance) : tolerance_(tolerance) {}

  void equal(const std::string& name, const MatrixXd& A, const MatrixXd& B, double scale) {
    if (A.size() == 0) return;
    Index row = 0;
    Index col = 0;
    const double deviation = (A - B).cwiseAbs().maxCoeff(&row, &col);
    const double error = deviation == 0 ? 0 : deviation / scale;
    checks_.push_back({name, A(row, col), B(row, col), error, error <= tolerance_});
  }

  void at_most(const std::string& name, double value, double bound) {
    checks_.push_back({name, value, bound, std::max(0.0, value / bound - 1), value <= bound * (1 + tolerance_)});
  }

  std::vector<BodyCheck> take() { return std::move(checks_); }

 private:
  double tolerance_;
  std::vector<BodyCheck> checks_;
};

std::string comment_of(const ReducedBody& body) {
  std::string comment = body.name + ", SI units, " + body.frame + " frame, nodes";
  for (size_t i = 0; i < body.markers.size(); ++i) comment += fmt::format(" {} {}", i + 1, body.markers[i].name);
  for (char& c : comment) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  return comment.substr(0, 300);  // public readers take lines of 511 characters
}

}  // namespace

std::span<const ExportSetting> sid_settings() { return settings_of_sid; }

SidDialect sid_dialect(const ExportOptions& options) {
  return {.mode_before_column = setting(settings_of_sid, options, "m1") == "row-mode-column",
          .Oe_xz_last = setting(settings_of_sid, options, "Oe") == "xy-yz-xz",
          .Ge_by_mode = setting(settings_of_sid, options, "Ge") == "mode",
          .J_as_column = setting(settings_of_sid, options, "J") == "6x1"};
}

SidFile sid_file(const ReducedBody& given, const ExportOptions& options) {
  const ReducedBody body =
      setting(settings_of_sid, options, "modal_mass") == "unit" ? with_unit_modal_mass(given) : given;
  SidFile sid;
  sid.mass = body.m;
  for (const Coordinate& c : body.coordinates) {
    const std::string name = fmt::format("{} {} {}", c.kind, c.interface, c.direction);
    sid.modes.emplace_back(name.substr(0, name.find_last_not_of(' ') + 1), c.frequency_hz);
  }
  for (size_t i = 0; i < body.markers.size(); ++i) {
    sid.nodes.push_back(node_of(body, body.markers[i], static_cast<int>(i) + 1));
  }
  set_integrals(sid, body, setting(settings_of_sid, options, "Gr") == "1");
  sid.Me = constant(body.Me);
  sid.Ke = constant(body.Ke);
  sid.De = constant(body.De);
  sid.ksigma = constant(MatrixXd::Zero(body.n(), 1));
  return sid;
}

std::vector<BodyCheck> sid_identities(const SidFile& sid, double tolerance) {
  const Index n = sid.Me.m0.rows();
  IdentityList list(tolerance);
  if (n == 0) return list.take();
  const double modal = sid.Me.m0.cwiseAbs().maxCoeff();
  const double first = std::sqrt(sid.mass * modal);
  const double second = std::sqrt(sid.J.m0.cwiseAbs().maxCoeff() * modal);
  MatrixXd mdCM(3, n), Ge(n, 3 * n), Cr(n, 3 * n), Gr_sym(3, 3 * n), J(3, 3 * n), Gr_skew(3, 3 * n), tilde_Cr(3, 3 * n);
  MatrixXd Oe(n, 6);
  for (Index k = 0; k < n; ++k) {
    const auto kk = static_cast<size_t>(k);
    const Matrix3d Gr = sid.Gr.m0.middleCols<3>(3 * k);
    const MatrixXd& J1 = sid.J.m1[kk];
    mdCM.col(k) = sid.mdCM.m1[kk];
    J.middleCols<3>(3 * k) = J1;
    Gr_sym.middleCols<3>(3 * k) = (Gr + Gr.transpose()) / 2;
    Gr_skew.middleCols<3>(3 * k) = (Gr - Gr.transpose()) / 2;
    tilde_Cr.middleCols<3>(3 * k) = -tilde(sid.Cr.m0.row(k).transpose());
    Oe.row(k) << -J1(0, 0) / 2, -J1(1, 1) / 2, -J1(2, 2) / 2, -J1(0, 1), -J1(1, 2), -J1(0, 2);
    for (Index l = 0; l < n; ++l) {
      // (k, l) less (l, k): stiffening is symmetric and drops out.
      Cr.block<1, 3>(k, 3 * l) = sid.Cr.m1[static_cast<size_t>(l)].row(k) - sid.Cr.m1[kk].row(l);
    }
  }
  list.equal("mdCM.m1 = Ct^T", mdCM, sid.Ct.m0.transpose(), first);
  list.equal("Ge = 2 skew Cr.m1", sid.Ge.m0, Cr, modal);
  list.equal("sym Gr = J.m1", Gr_sym, J, second);
  list.equal("skew Gr = -tilde(Cr)", Gr_skew, tilde_Cr, second);
  list.equal("Oe = -J.m1 / 2, -J.m1", sid.Oe.m0, Oe, second);
  const MatrixXd effective = sid.Ct.m0.transpose() * Eigen::LDLT<MatrixXd>(sid.Me.m0).solve(sid.Ct.m0);
  list.at_most("Ct^T Me^-1 Ct <= m", effective.diagonal().maxCoeff(), sid.mass);
  return list.take();
}

void write_sid(const ReducedBody& body, const ExportOptions& options, const std::filesystem::path& path) {
  const SidFile sid = sid_file(body, options);
  for (const BodyCheck& c : sid_identities(sid)) {
    if (c.passed) continue;
    throw NumericalError(fmt::format("SID of body \"{}\": the identity {} does not hold ({:.6g} against {:.6g})",
                                     body.name, c.name, c.value, c.reference));
  }
  const SidDialect dialect = sid_dialect(options);
  write_file(path, sid_text(to_dialect(sid, dialect), dialect, comment_of(body)));
}

std::vector<std::string> sid_cannot_hold(const ReducedBody& body) {
  std::vector<std::string> sentences;
  if (body.n() > 0) {
    sentences.emplace_back(
        "Inertia is kept to the first order in the coordinates: J2 is dropped, and with Gr = 0 the first order of Gr.");
    sentences.emplace_back("Public readers take m1(i, k, j), Oe, Ge and J in different orders: see the settings.");
  }
  if (!body.Kg.markers.empty()) {
    sentences.emplace_back(
        "Stiffening by loads at markers is the first order of phi and psi, which EMBSlib reads and does not use.");
  }
  if (body.frame == "free") {
    sentences.emplace_back("The coordinates hold rigid motions, which the frame has as well: clamp the body.");
  }
  sentences.emplace_back(
      "Names of nodes are in the comment of the first line only; a hinge and its stop are not held.");
  return sentences;
}

ReadBack sid_read_back(const ExportOptions& options, const std::filesystem::path& path) {
  const SidFile sid = read_sid(path, options);
  ReadBack back{.m = sid.mass,
                .mc0 = sid.mdCM.m0,
                .J0 = sid.J.m0,
                .Ct = sid.Ct.m0.transpose(),
                .Cr0 = sid.Cr.m0.transpose(),
                .Me = sid.Me.m0,
                .Ke = sid.Ke.m0,
                .markers = {}};
  for (const SidNode& node : sid.nodes) {
    back.markers.push_back({std::to_string(node.id), node.origin.m0, node.phi.m0, node.psi.m0});
  }
  return back;
}

}  // namespace flexboom
