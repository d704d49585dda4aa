#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "fem/base/text_reader.hpp"
#include "reduction/exports/sid_dialect.hpp"

#include <fmt/format.h>

#include <map>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// A line "key = value"; the value is empty where there is no "=".
struct Line {
  std::string_view key;
  std::string_view value;
};

class SidReader {
 public:
  SidReader(std::string_view text, const std::string& file, const SidDialect& dialect)
      : text_(text, file), dialect_(dialect) {}

  SidFile file() {
    bool in_refmod = false;
    while (const auto line = next()) {
      if (line->key == "refmod" || line->key == "end refmod") {
        in_refmod = line->key == "refmod";
      } else if (in_refmod) {
        refmod(*line);
      } else if (line->key == "new node") {
        sid_.nodes.push_back(node(*line));
      } else if (Taylor* t = matrix(line->key)) {
        *t = taylor(line->key);
      }
    }
    require_sizes();
    return from_dialect(std::move(sid_), dialect_);
  }

 private:
  std::optional<Line> next() {
    while (const auto line = text_.next_line()) {
      const std::string_view all = trimmed(*line);
      if (all.empty()) continue;
      const size_t equals = all.find('=');
      if (equals == std::string_view::npos) return Line{all, {}};
      return Line{trimmed(all.substr(0, equals)), trimmed(all.substr(equals + 1))};
    }
    return {};
  }

  double real(std::string_view token) const {
    const auto value = to_real(token, true);
    if (!value) text_.fail(token, "a number is needed, got " + quoted(token));
    return *value;
  }

  long integer(std::string_view token, long low, long high) const {
    const auto value = to_integer(token);
    if (!value || *value < low || *value > high) {
      text_.fail(token, fmt::format("an integer from {} to {} is needed, got {}", low, high, quoted(token)));
    }
    return *value;
  }

  void refmod(const Line& line) {
    if (line.key == "mass") {
      sid_.mass = real(line.value);
    } else if (line.key.starts_with("ielastq")) {
      const size_t colon = line.value.rfind(':');
      const std::string_view name = trimmed(line.value.substr(0, colon));
      std::string_view hertz = colon == std::string_view::npos ? "" : trimmed(line.value.substr(colon + 1));
      if (hertz.ends_with("Hz")) hertz = trimmed(hertz.substr(0, hertz.size() - 2));
      sid_.modes.emplace_back(name, hertz.empty() ? 0 : real(hertz));
    }
  }

  Taylor* matrix(std::string_view name) {
    const std::map<std::string_view, Taylor*> known = {{"mdCM", &sid_.mdCM},     {"J", &sid_.J},   {"Ct", &sid_.Ct},
                                                       {"Cr", &sid_.Cr},         {"Me", &sid_.Me}, {"Gr", &sid_.Gr},
                                                       {"Ge", &sid_.Ge},         {"Oe", &sid_.Oe}, {"Ke", &sid_.Ke},
                                                       {"ksigma", &sid_.ksigma}, {"De", &sid_.De}};
    const auto found = known.find(name);
    return found == known.end() ? nullptr : found->second;
  }

  SidNode node(const Line& head) {
    SidNode node;
    node.id = static_cast<int>(integer(head.value, 0, 2'000'000'000));
    while (const auto line = next()) {
      if (line->key == "end node") return node;
      if (line->key == "origin") node.origin = taylor(line->key);
      if (line->key == "phi") node.phi = taylor(line->key);
      if (line->key == "psi") node.psi = taylor(line->key);
      if (line->key == "AP") node.AP = taylor(line->key);
      if (line->key == "sigma") taylor(line->key);
    }
    text_.fail({}, "\"end node\" is missing");
  }

  Taylor taylor(std::string_view name) {
    std::map<std::string_view, long> sizes;
    Taylor t;
    while (const auto line = next()) {
      if (line->key == fmt::format("end {}", name)) {
        finish(t, sizes);
        return t;
      }
      if (line->key.starts_with("m0") || line->key.starts_with("m1")) {
        entry(t, *line);
      } else {
        sizes[line->key] = integer(line->value, 0, 1'000'000);
        if (line->key == "structure") allocate(t, sizes, line->value);
      }
    }
    text_.fail({}, fmt::format("\"end {}\" is missing", name));
  }

  void allocate(Taylor& t, std::map<std::string_view, long>& sizes, std::string_view at) const {
    const Index rows = sizes["nrow"];
    const Index cols = sizes["ncol"];
    const Index modes = sizes["order"] > 0 ? sizes["nq"] : 0;
    if (sizes["order"] > 1) text_.fail(at, "Taylor matrices of order 0 and 1 are read, not higher");
    if (static_cast<double>(rows) * static_cast<double>(cols) * (1.0 + static_cast<double>(modes)) > 1e8) {
      text_.fail(at, fmt::format("a matrix of {} x {} and {} modes is too large", rows, cols, modes));
    }
    t.m0 = MatrixXd::Zero(rows, cols);
    t.m1.assign(static_cast<size_t>(modes), t.m0);
  }

  /// m0(i, j) = v, m1(i, k, j) = v.
  void entry(Taylor& t, const Line& line) const {
    const size_t open = line.key.find('(');
    const size_t close = line.key.find(')');
    if (open == std::string_view::npos || close == std::string_view::npos || close < open) {
      text_.fail(line.key, "m0(i, j) or m1(i, k, j) is needed, got " + quoted(line.key));
    }
    std::string_view rest = line.key.substr(open + 1, close - open - 1);
    std::vector<std::string_view> index;
    for (size_t comma = 0; comma != std::string_view::npos; rest = rest.substr(comma + 1)) {
      comma = rest.find(',');
      index.push_back(trimmed(rest.substr(0, comma)));
      if (comma == std::string_view::npos) break;
    }
    const bool first_order = line.key[1] == '1';
    if (index.size() != (first_order ? 3U : 2U)) text_.fail(line.key, "wrong number of indices in " + quoted(line.key));
    const Index row = integer(index[0], 1, t.m0.rows()) - 1;
    if (!first_order) {
      t.m0(row, integer(index[1], 1, t.m0.cols()) - 1) = real(line.value);
      return;
    }
    const std::string_view mode = index[dialect_.mode_before_column ? 1 : 2];
    const std::string_view col = index[dialect_.mode_before_column ? 2 : 1];
    MatrixXd& A = t.m1.at(static_cast<size_t>(integer(mode, 1, std::ssize(t.m1)) - 1));
    A(row, integer(col, 1, A.cols()) - 1) = real(line.value);
  }

  void finish(Taylor& t, const std::map<std::string_view, long>& sizes) const {
    const auto structure = sizes.find("structure");
    if (structure == sizes.end()) text_.fail({}, "a Taylor matrix has no structure");
    if (structure->second == 4) t.m0.setIdentity();
    if (structure->second == 2 && t.m0.rows() == t.m0.cols()) {  // one triangle is enough
      const MatrixXd rest = t.m0 - MatrixXd(t.m0.diagonal().asDiagonal());
      if (rest.isUpperTriangular(0) || rest.isLowerTriangular(0)) t.m0 = (t.m0 + rest.transpose()).eval();
    }
  }

  void require_sizes() const {
    const Index n = sid_.Me.m0.rows();
    const auto check = [this, n](const Taylor& t, Index rows, Index cols, std::string_view name) {
      if (!t.m1.empty() && std::ssize(t.m1) != n) {
        text_.fail({}, fmt::format("{} has nq = {}, must be {}", name, t.m1.size(), n));
      }
      if (t.m0.rows() == rows && t.m0.cols() == cols) return;
      text_.fail({}, fmt::format("{} is {} x {}, must be {} x {}", name, t.m0.rows(), t.m0.cols(), rows, cols));
    };
    check(sid_.mdCM, 3, 1, "mdCM");
    if (sid_.J.m0.cols() == 1) check(sid_.J, 6, 1, "J");
    if (sid_.J.m0.cols() != 1) check(sid_.J, 3, 3, "J");
    check(sid_.Ct, n, 3, "Ct");
    check(sid_.Cr, n, 3, "Cr");
    check(sid_.Me, n, n, "Me");
    check(sid_.Gr, 3, 3 * n, "Gr");
    check(sid_.Ge, n, 3 * n, "Ge");
    check(sid_.Oe, n, 6, "Oe");
    check(sid_.Ke, n, n, "Ke");
    check(sid_.De, n, n, "De");
    for (const Taylor* t : {&sid_.mdCM, &sid_.J, &sid_.Cr, &sid_.Oe}) {
      if (std::ssize(t->m1) != n) text_.fail({}, "mdCM, J, Cr and Oe must be of order 1");
    }
    for (const SidNode& node : sid_.nodes) {
      check(node.origin, 3, 1, "origin of a node");
      check(node.phi, 3, n, "phi of a node");
      check(node.psi, 3, n, "psi of a node");
    }
  }

  TextReader text_;
  const SidDialect& dialect_;
  SidFile sid_;
};

}  // namespace

SidFile read_sid(const std::filesystem::path& path, const ExportOptions& options) {
  const std::string bytes = file_bytes(path);
  const SidDialect dialect = sid_dialect(options);
  return SidReader(bytes, path.string(), dialect).file();
}

}  // namespace flexboom
