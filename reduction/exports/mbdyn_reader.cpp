#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "fem/base/text_reader.hpp"
#include "reduction/exports/mbdyn.hpp"

#include <fmt/format.h>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr std::string_view mark = "** RECORD GROUP ";

/// Tokens of each record group; lines that begin with an asterisk are comments.
std::map<int, std::vector<std::string_view>> tokens_by_group(TextReader& text) {
  std::map<int, std::vector<std::string_view>> groups;
  std::vector<std::string_view>* group = nullptr;
  while (const auto line = text.next_line()) {
    if (line->starts_with("** END OF FILE")) break;
    if (line->starts_with(mark)) {
      const std::string_view number = trimmed(line->substr(mark.size()).substr(0, line->substr(mark.size()).find(',')));
      const auto value = to_integer(number);
      if (!value || *value < 1 || *value > 1000)
        text.fail(*line, "a record group needs a number, got " + quoted(number));
      group = &groups[static_cast<int>(*value)];
      if (!group->empty()) text.fail(*line, fmt::format("record group {} is there twice", *value));
      continue;
    }
    if (group == nullptr || line->starts_with('*')) continue;
    for (size_t at = 0; (at = line->find_first_not_of(" \t\r", at)) != std::string_view::npos;) {
      const size_t end = std::min(line->find_first_of(" \t\r", at), line->size());
      group->push_back(line->substr(at, end - at));
      at = end;
    }
  }
  return groups;
}

class Groups {
 public:
  explicit Groups(TextReader& text) : text_(text), tokens_(tokens_by_group(text)) {}

  bool has(int group) const { return tokens_.contains(group); }

  const std::vector<std::string_view>& tokens(int group, size_t count) const {
    const auto found = tokens_.find(group);
    if (found == tokens_.end()) text_.fail({}, fmt::format("record group {} is missing", group));
    const auto& tokens = found->second;
    if (tokens.size() != count) {
      text_.fail(tokens.empty() ? std::string_view() : tokens.front(),
                 fmt::format("record group {} has {} values, must have {}", group, tokens.size(), count));
    }
    return tokens;
  }

  double real(std::string_view token) const {
    const auto value = to_real(token, true);
    if (!value) text_.fail(token, "a number is needed, got " + quoted(token));
    return *value;
  }

  Index integer(std::string_view token, long low, long high) const {
    const auto value = to_integer(token);
    if (!value || *value < low || *value > high) {
      text_.fail(token, fmt::format("an integer from {} to {} is needed, got {}", low, high, quoted(token)));
    }
    return *value;
  }

  /// Values from `first` on, row by row.
  MatrixXd values(const std::vector<std::string_view>& tokens, size_t first, Index rows, Index cols) const {
    MatrixXd A(rows, cols);
    for (Index i = 0; i < rows; ++i) {
      for (Index j = 0; j < cols; ++j) A(i, j) = real(tokens[first++]);
    }
    return A;
  }

  MatrixXd matrix(int group, Index rows, Index cols) const {
    return values(tokens(group, static_cast<size_t>(rows * cols)), 0, rows, cols);
  }

  const std::vector<std::string_view>& any(int group) const { return tokens_.at(group); }
  const TextReader& text() const { return text_; }

 private:
  const TextReader& text_;
  std::map<int, std::vector<std::string_view>> tokens_;
};

/// REV nodes normal attached constraint rejected. A count that the file is too short for is refused before anything of
/// its size is made.
std::pair<Index, Index> sizes(const Groups& groups, size_t bytes) {
  const auto& header = groups.tokens(1, 6);
  const long most = static_cast<long>(bytes);
  const Index nodes = groups.integer(header[1], 1, most);
  const Index modes = groups.integer(header[2], 0, most) + groups.integer(header[3], 0, most) +
                      groups.integer(header[4], 0, most) - groups.integer(header[5], 0, most);
  if (modes < 0 || static_cast<double>(modes) * static_cast<double>(modes) > static_cast<double>(bytes)) {
    groups.text().fail(header[2], "the numbers of modes do not go with the length of the file");
  }
  return {nodes, modes};
}

void read_stiffening(MbdynFile& file, const Groups& groups, Index n) {
  const auto& all = groups.any(19);
  const size_t block = 1 + static_cast<size_t>(n * n);
  const Index count = all.empty() ? 0 : groups.integer(all[0], 0, static_cast<long>(all.size()));
  const auto& tokens = groups.tokens(19, 1 + static_cast<size_t>(count) * block);
  for (size_t first = 1; first < tokens.size(); first += block) {
    const auto index = static_cast<int>(groups.integer(tokens[first], 1, 12 + 6 * std::ssize(file.labels)));
    file.stiffening[index] = groups.values(tokens, first + 1, n, n);
  }
}

}  // namespace

MbdynFile read_mbdyn(const std::filesystem::path& path) {
  const std::string bytes = file_bytes(path);
  TextReader text(bytes, path.string());
  const Groups groups(text);
  const auto [nodes, n] = sizes(groups, bytes.size());
  MbdynFile file;
  for (const std::string_view label : groups.tokens(2, static_cast<size_t>(nodes))) file.labels.emplace_back(label);
  file.positions.resize(3, nodes);
  for (int i = 0; i < 3; ++i) file.positions.row(i) = groups.matrix(5 + i, 1, nodes);
  const MatrixXd shapes = groups.matrix(8, n * nodes, 6);  // mode by mode, node by node
  for (Index i = 0; i < nodes; ++i) {
    MatrixXd shape(6, n);
    for (Index k = 0; k < n; ++k) shape.col(k) = shapes.row(k * nodes + i);
    file.shapes.push_back(shape);
  }
  file.mass = groups.matrix(9, n, n).transpose();
  file.stiffness = groups.matrix(10, n, n).transpose();
  file.damping = groups.has(13) ? MatrixXd(groups.matrix(13, n, n).transpose()) : MatrixXd::Zero(n, n);
  const MatrixXd inertia = groups.matrix(12, 13, 1);
  file.m = inertia(0);
  file.centre = inertia.middleRows<3>(1);
  file.inertia = inertia.bottomRows<9>().reshaped<Eigen::RowMajor>(3, 3);
  if (groups.has(11)) {
    const MatrixXd masses = groups.matrix(11, nodes, 6);
    file.masses.assign(masses.col(0).begin(), masses.col(0).end());
  }
  if (groups.has(14)) {
    file.Inv3 = groups.matrix(14, 3, n);
    file.Inv4 = groups.matrix(15, 3, n);
    file.Inv8 = groups.matrix(16, 3, 3 * n);
    file.Inv5 = groups.matrix(17, 3, n * n);
    file.Inv9 = groups.matrix(18, 3, 3 * n * n);
  }
  if (groups.has(19)) read_stiffening(file, groups, n);
  return file;
}

}  // namespace flexboom
