#include "fem/base/files.hpp"
#include "fem/base/text_reader.hpp"
#include "reduction/exports/integrals.hpp"
#include "reduction/exports/nasa42.hpp"

#include <fmt/format.h>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr Index most_modes = 2000;  // N has 9 n^2 entries

/// A file of 42, line by line: values, then a comment; blank lines do not count.
class Lines42 {
 public:
  explicit Lines42(const std::filesystem::path& path) : bytes_(file_bytes(path)), text_(bytes_, path.string()) {}

  std::string_view next() {
    while (const auto line = text_.next_line()) {
      if (!trimmed(*line).empty()) return *line;
    }
    text_.fail({}, "the file ends too early");
  }

  void skip(int lines) {
    for (int i = 0; i < lines; ++i) next();
  }

  /// The first `count` words of a line.
  std::vector<std::string_view> words(std::string_view line, size_t count) const {
    std::vector<std::string_view> words;
    for (size_t at = 0; words.size() < count;) {
      at = line.find_first_not_of(" \t\r", at);
      if (at == std::string_view::npos) text_.fail(line, fmt::format("{} values are needed in this line", count));
      const size_t end = std::min(line.find_first_of(" \t\r", at), line.size());
      words.push_back(line.substr(at, end - at));
      at = end;
    }
    return words;
  }
  std::vector<std::string_view> words(size_t count) { return words(next(), count); }

  /// What is between the quotation marks of a line.
  std::string label(std::string_view line) const {
    const size_t open = line.find('"');
    const size_t close = line.rfind('"');
    if (open == close) text_.fail(line, "a label in quotation marks is needed");
    return std::string(line.substr(open + 1, close - open - 1));
  }

  double real(std::string_view word) const {
    const auto value = to_real(word);
    if (!value) text_.fail(word, "a number is needed, got " + quoted(word));
    return *value;
  }

  Index index(std::string_view word, Index low, Index high) const {
    const auto value = to_integer(word);
    if (!value || *value < low || *value > high) {
      text_.fail(word, fmt::format("an integer from {} to {} is needed, got {}", low, high, quoted(word)));
    }
    return *value;
  }

  Vector3d vector() {
    const auto w = words(3);
    return {real(w[0]), real(w[1]), real(w[2])};
  }

  /// A count that the file is long enough for.
  Index count() { return index(words(1)[0], 0, static_cast<Index>(bytes_.size())); }

  /// Heading, count, lines of `indices` indices and a value.
  template <class Entry>
  void non_zeros(size_t indices, const Entry& entry) {
    skip(1);
    const Index lines = count();
    for (Index i = 0; i < lines; ++i) {
      const auto w = words(indices + 1);
      entry(w, real(w.back()));
    }
  }

 private:
  std::string bytes_;
  TextReader text_;
};

void read_block(File42& file, const std::filesystem::path& path) {
  Lines42 lines(path);
  lines.skip(2);
  file.about_centre = lines.words(1)[0] == "REFPT_CM";
  lines.skip(3);
  file.mass = lines.real(lines.words(1)[0]);
  const Vector3d moments = lines.vector();
  const Vector3d products = lines.vector();
  file.inertia << moments(0), -products(0), -products(1), -products(0), moments(1), -products(2), -products(1),
      -products(2), moments(2);
  file.centre = lines.vector();
}

void read_nodes(File42& file, const std::filesystem::path& path) {
  Lines42 lines(path);
  lines.skip(2);
  const Index nodes = lines.count();
  lines.skip(1);
  for (Index i = 0; i < nodes; ++i) {
    const std::string_view line = lines.next();
    const auto w = lines.words(line, 3);
    file.nodes.push_back({lines.label(line), -1, {lines.real(w[0]), lines.real(w[1]), lines.real(w[2])}, {}, {}});
  }
}

Node42& joint_of(File42& file, Index joint, Index n) {
  for (Node42& node : file.joints) {
    if (node.joint == joint) return node;
  }
  file.joints.push_back({"", static_cast<int>(joint), Vector3d::Zero(), Matrix3Xd::Zero(3, n), Matrix3Xd::Zero(3, n)});
  return file.joints.back();
}

MatrixXd matrix(Lines42& lines, Index n) {
  MatrixXd A = MatrixXd::Zero(n, n);
  lines.non_zeros(2, [&](const auto& w, double v) { A(lines.index(w[0], 0, n - 1), lines.index(w[1], 0, n - 1)) = v; });
  return A;
}

void read_flex(File42& file, const std::filesystem::path& path) {
  Lines42 lines(path);
  lines.skip(2);
  const Index n = lines.index(lines.words(1)[0], 0, most_modes);
  lines.skip(1);
  for (Index k = 0; k < n; ++k) lines.words(2);
  for (Node42& node : file.nodes) node.PSI = node.THETA = Matrix3Xd::Zero(3, n);
  lines.skip(1);
  for (Matrix3Xd Node42::*shape : {&Node42::PSI, &Node42::THETA}) {
    lines.non_zeros(3, [&](const auto& w, double v) {
      Node42& joint = joint_of(file, lines.index(w[1], 0, 1'000'000), n);
      (joint.*shape)(lines.index(w[2], 0, 2), lines.index(w[0], 0, n - 1)) = v;
    });
  }
  lines.skip(1);
  for (Matrix3Xd Node42::*shape : {&Node42::PSI, &Node42::THETA}) {
    lines.non_zeros(3, [&](const auto& w, double v) {
      Node42& node = file.nodes[static_cast<size_t>(lines.index(w[1], 0, std::ssize(file.nodes) - 1))];
      (node.*shape)(lines.index(w[2], 0, 2), lines.index(w[0], 0, n - 1)) = v;
    });
  }
  file.Mf = matrix(lines, n);
  file.Kf = matrix(lines, n);
  file.Cf = matrix(lines, n);
  file.Pf.resize(3, n);
  file.Hf.resize(3, n);
  for (Matrix3Xd* integral : {&file.Pf, &file.Hf}) {
    lines.skip(1);
    for (Index k = 0; k < n; ++k) integral->col(k) = lines.vector();
  }
  file.L.assign(static_cast<size_t>(n), Eigen::Matrix3d::Zero());
  file.N.assign(static_cast<size_t>(n), file.L);
  const auto mode = [&](std::string_view word) { return static_cast<size_t>(lines.index(word, 0, n - 1)); };
  lines.non_zeros(
      3, [&](const auto& w, double v) { file.L[mode(w[2])](lines.index(w[0], 0, 2), lines.index(w[1], 0, 2)) = v; });
  lines.non_zeros(4, [&](const auto& w, double v) {
    file.N[mode(w[2])][mode(w[3])](lines.index(w[0], 0, 2), lines.index(w[1], 0, 2)) = v;
  });
}

}  // namespace

File42 read_42(const std::filesystem::path& folder) {
  const std::string name = plain_name(export_name(folder));
  File42 file;
  read_block(file, folder / fmt::format("Block_{}.txt", name));
  read_nodes(file, folder / fmt::format("Nodes_{}.txt", name));
  read_flex(file, folder / fmt::format("Flex_{}.txt", name));
  Lines42 joint(folder / fmt::format("Joint_{}.txt", name));
  joint.skip(3);
  file.joint = {joint.vector(), joint.vector(), joint.vector(), joint.vector()};
  return file;
}

}  // namespace flexboom
