#include "reduction/exports/matrix_market.hpp"

#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "fem/base/text_reader.hpp"

#include <fmt/format.h>

#include <iterator>
#include <ostream>

namespace flexboom {
namespace {

namespace fs = std::filesystem;
using Eigen::MatrixXd;

/// Banner and comments; the sizes come next.
void read_header(TextReader& reader) {
  const std::string_view banner = reader.next_line().value_or("");
  TextReader words(banner, reader.file());
  const auto fault = [&] {
    reader.fail(banner,
                "not a Matrix Market file of a dense matrix; its first line must be \"%%MatrixMarket matrix array real "
                "general\", found " +
                    quoted(trimmed(banner)));
  };
  if (words.next_token() != "%%MatrixMarket" || words.next_token() != "matrix") fault();
  const std::string_view form = words.next_token();
  const std::string_view field = words.next_token();
  const std::string_view symmetry = words.next_token();
  if (form != "array" || (field != "real" && field != "integer") || symmetry != "general") fault();
  for (size_t start = reader.position();; start = reader.position()) {
    const auto line = reader.next_line();
    if (!line) break;
    const std::string_view text = trimmed(*line);
    if (text.empty() || text.front() == '%') continue;
    reader.seek(start);
    break;
  }
}

void require_end(TextReader& reader) {
  const std::string_view token = reader.next_token();
  if (!token.empty()) reader.fail(token, "more numbers than the sizes say: " + quoted(token));
}

}  // namespace

void write_mtx(const fs::path& path, const MatrixXd& A, const std::string& comment) {
  fmt::memory_buffer text;
  const auto add = [&text](auto format, const auto&... values) {
    fmt::format_to(std::back_inserter(text), fmt::runtime(format), values...);
  };
  add("%%MatrixMarket matrix array real general\n% {}\n{} {}\n", comment, A.rows(), A.cols());
  for (const double value : A.reshaped()) add("{:.17g}\n", value);
  write_file(path, [&](std::ostream& out) { out.write(text.data(), static_cast<std::streamsize>(text.size())); });
}

MatrixXd read_mtx_array(const fs::path& path) {
  const std::string text = file_bytes(path);
  TextReader reader(text, path.string());
  read_header(reader);
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
