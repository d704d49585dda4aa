#include "reduction/matrix_market.hpp"

#include "fem/check.hpp"
#include "fem/files.hpp"
#include "fem/text_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <ostream>
#include <utility>
#include <vector>

namespace flexboom {
namespace {

namespace fs = std::filesystem;
using Eigen::Index;
using Eigen::MatrixXd;

/// Text that goes to a file in pieces.
class Lines {
 public:
  explicit Lines(std::ostream& out) : out_(out) {}
  ~Lines() { flush(); }
  Lines(const Lines&) = delete;
  Lines& operator=(const Lines&) = delete;

  template <class... Values>
  void add(fmt::format_string<Values...> format, Values&&... values) {
    fmt::format_to(std::back_inserter(buffer_), format, std::forward<Values>(values)...);
    if (buffer_.size() > size_t{1} << 16) flush();
  }

 private:
  void flush() {
    out_.write(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
    buffer_.clear();
  }

  std::ostream& out_;
  fmt::memory_buffer buffer_;
};

void add_banner(Lines& lines, std::string_view kind, const std::string& comment) {
  lines.add("%%MatrixMarket matrix {}\n", kind);
  std::string_view rest = comment;
  while (!rest.empty()) {
    const size_t end = std::min(rest.find('\n'), rest.size());
    lines.add("% {}\n", rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
}

/// Banner and comments of a Matrix Market file; the sizes come next.
struct Header {
  bool array = false;
  bool symmetric = false;
};

Header read_header(TextReader& reader) {
  const std::string_view banner = reader.next_line().value_or("");
  TextReader words(banner, reader.file());
  const auto fault = [&] {
    reader.fail(banner,
                "not a Matrix Market file of real numbers; its first line must be \"%%MatrixMarket matrix coordinate "
                "real symmetric\" (or array, or general), found " +
                    quoted(trimmed(banner)));
  };
  if (words.next_token() != "%%MatrixMarket" || words.next_token() != "matrix") fault();
  const std::string_view form = words.next_token();
  const std::string_view field = words.next_token();
  const std::string_view symmetry = words.next_token();
  if ((form != "coordinate" && form != "array") || (field != "real" && field != "integer") ||
      (symmetry != "general" && symmetry != "symmetric")) {
    fault();
  }
  for (size_t start = reader.position();; start = reader.position()) {
    const auto line = reader.next_line();
    if (!line) break;
    const std::string_view text = trimmed(*line);
    if (text.empty() || text.front() == '%') continue;
    reader.seek(start);
    break;
  }
  return {form == "array", symmetry == "symmetric"};
}

void require_end(TextReader& reader) {
  const std::string_view token = reader.next_token();
  if (!token.empty()) reader.fail(token, "more numbers than the sizes say: " + quoted(token));
}

}  // namespace

void write_mtx(const fs::path& path, const SparseMatrix& lower, const std::string& comment) {
  require(lower.rows() == lower.cols(), "cannot write " + path.string() + ": a symmetric matrix is square");
  const auto each = [&](const auto& visit) {
    for (Index col = 0; col < lower.outerSize(); ++col) {
      for (SparseMatrix::InnerIterator it(lower, col); it; ++it) {
        if (it.row() >= col) visit(it.row(), col, it.value());
      }
    }
  };
  long entries = 0;
  each([&](Index, Index, double) { ++entries; });
  write_file(path, [&](std::ostream& out) {
    Lines lines(out);
    add_banner(lines, "coordinate real symmetric", comment);
    lines.add("{} {} {}\n", lower.rows(), lower.cols(), entries);
    each([&](Index row, Index col, double value) { lines.add("{} {} {:.17g}\n", row + 1, col + 1, value); });
  });
}

void write_mtx(const fs::path& path, const MatrixXd& A, const std::string& comment) {
  write_file(path, [&](std::ostream& out) {
    Lines lines(out);
    add_banner(lines, "array real general", comment);
    lines.add("{} {}\n", A.rows(), A.cols());
    for (const double value : A.reshaped()) lines.add("{:.17g}\n", value);
  });
}

SparseMatrix read_mtx(const fs::path& path) {
  const std::string text = file_bytes(path);
  TextReader reader(text, path.string());
  const Header header = read_header(reader);
  if (header.array) reader.fail(text, "a matrix in array form, where coordinate form is expected");
  const auto most = static_cast<long>(text.size());  // rows: every one has an entry
  const long rows = reader.integer("number of rows", 0, most);
  const long cols = reader.integer("number of columns", 0, most);
  constexpr long shortest = 5;  // characters of "1 1 1"
  const long entries = reader.integer("number of entries", 0, static_cast<long>(reader.bytes_left()) / shortest);
  if (header.symmetric && rows != cols) reader.fail(text, "a symmetric matrix must be square");
  std::vector<Eigen::Triplet<double>> triplets;
  triplets.reserve(static_cast<size_t>(entries));
  for (long i = 0; i < entries; ++i) {
    const long row = reader.integer("row", 1, rows);
    const long col = reader.integer("column", 1, header.symmetric ? row : cols);
    triplets.emplace_back(static_cast<int>(row - 1), static_cast<int>(col - 1), reader.real("entry"));
  }
  require_end(reader);
  SparseMatrix A(rows, cols);
  A.setFromTriplets(triplets.begin(), triplets.end());
  return A;
}

MatrixXd read_mtx_array(const fs::path& path) {
  const std::string text = file_bytes(path);
  TextReader reader(text, path.string());
  const Header header = read_header(reader);
  if (!header.array || header.symmetric) reader.fail(text, "a general matrix in array form is expected");
  const long rows = reader.integer("number of rows", 0, static_cast<long>(text.size()));
  const long cols = reader.integer("number of columns", 0, static_cast<long>(text.size()));
  if (cols > 0 && rows > static_cast<long>(reader.bytes_left()) / cols) {
    reader.fail(text, fmt::format("{} x {} numbers are more than the file holds", rows, cols));
  }
  MatrixXd A(rows, cols);
  for (double& value : A.reshaped()) value = reader.real("entry");
  require_end(reader);
  return A;
}

}  // namespace flexboom
