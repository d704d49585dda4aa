#include "reduction/exports/sid_dialect.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

template <class Function>
void for_each_order(Taylor& t, const Function& f) {
  f(t.m0);
  for (MatrixXd& A : t.m1) f(A);
}

void swap_last_columns(Taylor& Oe) {
  for_each_order(Oe, [](MatrixXd& A) { A.col(4).swap(A.col(5)); });
}

/// Ge(k, 3l + c) to Ge(k, c n + l).
MatrixXd by_component(const MatrixXd& Ge) {
  const Index n = Ge.cols() / 3;
  MatrixXd result(Ge.rows(), Ge.cols());
  for (Index l = 0; l < n; ++l) {
    for (Index c = 0; c < 3; ++c) result.col(c * n + l) = Ge.col(3 * l + c);
  }
  return result;
}

MatrixXd by_mode(const MatrixXd& Ge) {
  const Index n = Ge.cols() / 3;
  MatrixXd result(Ge.rows(), Ge.cols());
  for (Index l = 0; l < n; ++l) {
    for (Index c = 0; c < 3; ++c) result.col(3 * l + c) = Ge.col(c * n + l);
  }
  return result;
}

MatrixXd column_of(const MatrixXd& J) {
  MatrixXd column(6, 1);
  for (size_t i = 0; i < voigt.size(); ++i) column(static_cast<Index>(i)) = J(voigt[i].first, voigt[i].second);
  return column;
}

MatrixXd square_of(const MatrixXd& column) {
  MatrixXd J(3, 3);
  for (size_t i = 0; i < voigt.size(); ++i) {
    const auto [row, col] = voigt[i];
    J(row, col) = J(col, row) = column(static_cast<Index>(i));
  }
  return J;
}

/// Lines of a SID file: keys at an indentation, "=" in column 49.
class SidWriter {
 public:
  SidWriter(const SidDialect& dialect, Index modes) : dialect_(dialect), modes_(modes) {}

  void line(int indent, std::string_view text) { (text_.append(static_cast<size_t>(indent), ' ') += text) += '\n'; }

  void value(int indent, std::string_view key, std::string_view text) {
    line(indent, fmt::format("{:<{}}={}", key, 48 - indent, text));
  }

  void number(int indent, std::string_view key, double v) {
    std::string digits = fmt::format("{: .16E}", v);
    std::ranges::replace(digits, 'E', 'D');
    value(indent, key, digits);
  }

  void integer(int indent, std::string_view key, Index v) { value(indent, key, fmt::format(" {:4}", v)); }

  void taylor(int indent, std::string_view name, const Taylor& t) {
    constexpr int inside = 26;
    line(indent, name);
    integer(inside, "order", t.m1.empty() ? 0 : 1);
    integer(inside, "nrow", t.m0.rows());
    integer(inside, "ncol", t.m0.cols());
    integer(inside, "nq", modes_);
    integer(inside, "nqn", 0);
    const int structure = structure_of(t);
    integer(inside, "structure", structure);
    for (Index i = 0; i < t.m0.rows() && structure != 4; ++i) {
      for (Index j = 0; j < t.m0.cols(); ++j) {
        if (t.m0(i, j) != 0) number(inside, fmt::format("m0({:2},{:2})", i + 1, j + 1), t.m0(i, j));
      }
    }
    for (size_t k = 0; k < t.m1.size(); ++k) first_order(inside, t.m1[k], k);
    line(indent, fmt::format("end {}", name));
  }

  std::string take() { return std::move(text_); }

 private:
  void first_order(int indent, const MatrixXd& A, size_t k) {
    for (Index i = 0; i < A.rows(); ++i) {
      for (Index j = 0; j < A.cols(); ++j) {
        if (A(i, j) == 0) continue;
        const auto mode = static_cast<Index>(k) + 1;
        number(indent,
               dialect_.mode_before_column ? fmt::format("m1({:2},{:2},{:2})", i + 1, mode, j + 1)
                                           : fmt::format("m1({:2},{:2},{:2})", i + 1, j + 1, mode),
               A(i, j));
      }
    }
  }

  /// 0 zero, 1 diagonal, 3 full, 4 unit. Symmetric matrices are written full: one public reader does not mirror.
  static int structure_of(const Taylor& t) {
    if (!t.m1.empty()) return 3;
    if ((t.m0.array() == 0).all()) return 0;
    if (t.m0.rows() != t.m0.cols()) return 3;
    if (t.m0 == MatrixXd::Identity(t.m0.rows(), t.m0.cols())) return 4;
    return t.m0 == MatrixXd(t.m0.diagonal().asDiagonal()) ? 1 : 3;
  }

  const SidDialect& dialect_;
  Index modes_;
  std::string text_;
};

}  // namespace

SidFile to_dialect(SidFile sid, const SidDialect& dialect) {
  if (!dialect.Oe_xz_last) swap_last_columns(sid.Oe);
  if (!dialect.Ge_by_mode) for_each_order(sid.Ge, [](MatrixXd& A) { A = by_component(A); });
  if (dialect.J_as_column) for_each_order(sid.J, [](MatrixXd& A) { A = column_of(A); });
  return sid;
}

SidFile from_dialect(SidFile sid, const SidDialect& dialect) {
  if (!dialect.Oe_xz_last) swap_last_columns(sid.Oe);
  if (!dialect.Ge_by_mode) for_each_order(sid.Ge, [](MatrixXd& A) { A = by_mode(A); });
  if (sid.J.m0.cols() == 1) for_each_order(sid.J, [](MatrixXd& A) { A = square_of(A); });
  return sid;
}

std::string sid_text(const SidFile& sid, const SidDialect& dialect, const std::string& comment) {
  const auto n = static_cast<Index>(sid.modes.size());
  SidWriter w(dialect, n);
  w.line(0, fmt::format("{:5}{:5}   :{}", sid.nodes.size(), n, comment));
  w.line(0, "part");
  w.line(6, "new modal");
  w.line(11, "refmod");
  w.number(16, "mass", sid.mass);
  w.integer(16, "nelastq", n);
  for (size_t k = 0; k < sid.modes.size(); ++k) {
    const auto& [name, frequency] = sid.modes[k];
    w.value(16, fmt::format("ielastq ({:4})", k + 1), fmt::format(" {} : {:.17g} Hz", name, frequency));
  }
  w.line(11, "end refmod");
  w.line(11, "frame");
  for (const SidNode& node : sid.nodes) {
    w.integer(16, "new node", node.id);
    w.value(21, "rframe", "    body ref");
    w.taylor(21, "origin", node.origin);
    w.taylor(21, "phi", node.phi);
    w.taylor(21, "psi", node.psi);
    w.taylor(21, "AP", node.AP);
    w.line(16, "end node");
  }
  w.line(11, "end frame");
  w.taylor(11, "mdCM", sid.mdCM);
  w.taylor(11, "J", sid.J);
  w.taylor(11, "Ct", sid.Ct);
  w.taylor(11, "Cr", sid.Cr);
  w.taylor(11, "Me", sid.Me);
  w.taylor(11, "Gr", sid.Gr);
  w.taylor(11, "Ge", sid.Ge);
  w.taylor(11, "Oe", sid.Oe);
  w.taylor(11, "ksigma", sid.ksigma);
  w.taylor(11, "Ke", sid.Ke);
  w.taylor(11, "De", sid.De);
  w.line(6, "end modal");
  w.line(0, "end part");
  return w.take();
}

}  // namespace flexboom
