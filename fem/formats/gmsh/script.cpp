#include "fem/formats/gmsh/script.hpp"

#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "fem/base/text_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <set>
#include <string>
#include <system_error>
#include <vector>

namespace flexboom {
namespace {

namespace fs = std::filesystem;

constexpr size_t longest_string = 1000;  // gmsh goes on with the rest of a longer one as if it were commands
constexpr size_t most_files = 1000;

// Data to gmsh, by their exact case; a merged file of any other extension is read as a script unless it begins with $.
constexpr std::string_view data_extensions[] = {
    ".step", ".STEP", ".stp", ".STP", ".brep", ".brp", ".BRP",  ".iges", ".IGES", ".igs",  ".IGS",
    ".stl",  ".STL",  ".unv", ".UNV", ".vtk",  ".VTK", ".mesh", ".MESH", ".bdf",  ".BDF",  ".nas",
    ".NAS",  ".med",  ".MED", ".sat", ".SAT",  ".xao", ".XAO",  ".off",  ".OFF",  ".ply2", ".PLY2",
};
// Programs to gmsh, which it runs, or archives, which it unpacks through a shell.
constexpr std::string_view program_extensions[] = {".py", ".PY", ".m", ".M", ".exe", ".EXE", ".pro", ".gz"};

struct Token {
  enum class Kind { word, text, symbol } kind;
  std::string_view text;  // of a string what stands in its quotes
};

bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool among(std::string_view name, const auto& list) { return std::ranges::count(list, name) > 0; }

/// The words, strings and symbols of a script as gmsh sees them; comments are gone.
std::vector<Token> tokens_of(const TextReader& reader) {
  const std::string_view text = reader.text();
  std::vector<Token> tokens;
  for (size_t i = 0; i < text.size();) {
    const char c = text[i];
    const std::string_view rest = text.substr(i);
    if (c == '\0') reader.fail(rest, "is no script: there is a zero byte");
    if (rest.starts_with("//")) {
      i += std::min(rest.find('\n'), rest.size());
    } else if (rest.starts_with("/*")) {
      const size_t end = rest.find("*/", 2);
      if (end == std::string_view::npos) reader.fail(rest, "a comment without end");
      i += end + 2;
    } else if (c == '"' || c == '\'') {
      const size_t end = rest.find(c, 1);
      if (end == std::string_view::npos || end > longest_string)
        reader.fail(rest, fmt::format("a string without end, or of more than {} characters", longest_string));
      tokens.push_back({Token::Kind::text, rest.substr(1, end - 1)});
      i += end + 1;
    } else if (is_letter(c)) {
      size_t length = 1;
      while (length < rest.size() && (is_letter(rest[length]) || is_digit(rest[length]))) ++length;
      tokens.push_back({Token::Kind::word, rest.substr(0, length)});
      i += length;
    } else {
      if (std::isspace(static_cast<unsigned char>(c)) == 0 && !is_digit(c))
        tokens.push_back({Token::Kind::symbol, rest.substr(0, 1)});
      ++i;
    }
  }
  return tokens;
}

/// Reads a script and what it brings in.
class Inspection {
 public:
  void script(const fs::path& path);
  void merged(const fs::path& path);

 private:
  void command(const TextReader&, const std::vector<Token>&, size_t i);
  [[noreturn]] static void refuse(const TextReader& reader, std::string_view at, std::string_view what) {
    reader.fail(at, fmt::format("{} {}; add --trust if you know what this file does", quoted(at), what));
  }

  std::set<std::string> seen_;
};

void Inspection::script(const fs::path& path) {
  std::error_code missing;
  if (!fs::exists(path, missing)) return;  // gmsh reads on without it
  if (!seen_.insert(fs::weakly_canonical(path, missing).string()).second) return;
  require(seen_.size() <= most_files, fmt::format("{}: more than {} files are included", path.string(), most_files));
  const std::string text = file_bytes(path);
  const TextReader reader(text, path.string());
  const std::vector<Token> tokens = tokens_of(reader);
  for (size_t i = 0; i < tokens.size(); ++i) {
    if (tokens[i].kind == Token::Kind::word) command(reader, tokens, i);
  }
}

void Inspection::merged(const fs::path& path) {
  const std::string extension = path.extension().string();
  if (among(extension, data_extensions)) return;
  std::error_code ignored;
  if (fs::is_regular_file(path, ignored) && file_bytes(path).starts_with('$')) return;  // a mesh or a view of gmsh
  script(path);
}

void Inspection::command(const TextReader& reader, const std::vector<Token>& tokens, size_t i) {
  const std::string_view word = tokens[i].text;
  const auto next_is = [&tokens](size_t place, Token::Kind kind) {
    return place < tokens.size() && tokens[place].kind == kind;
  };
  const bool is_member = i > 0 && tokens[i - 1].text == "." && tokens[i - 1].kind == Token::Kind::symbol;
  const bool has_argument = next_is(i + 1, Token::Kind::text) || next_is(i + 1, Token::Kind::word);
  for (const std::string_view name :
       {"SystemCall", "NonBlockingSystemCall", "OnelabRun", "ExternalProcess", "CommandLine"}) {
    if (same_but_case(word, name)) refuse(reader, word, "starts a program");
  }
  if (same_but_case(word, "System") && has_argument) refuse(reader, word, "starts a program");
  for (const std::string_view name : {"Save", "Print", "CreateDir", "CreateDirectory"}) {
    if (same_but_case(word, name) && has_argument && !is_member) refuse(reader, word, "writes files");
  }
  if (same_but_case(word, "Printf")) {  // up to the end of the statement; the strings are tokens of their own
    for (size_t k = i + 1; k < tokens.size() && tokens[k].text != ";"; ++k) {
      if (tokens[k].kind == Token::Kind::symbol && tokens[k].text == ">") refuse(reader, word, "writes a file");
    }
  }
  const bool includes = word == "Include", merges = word == "Merge" || word == "MergeWithBoundingBox";
  if ((!includes && !merges && word != "ShapeFromFile") || is_member) return;
  const size_t place = i + (word == "ShapeFromFile" ? 2 : 1);
  if (!has_argument && word != "ShapeFromFile") return;
  if (!next_is(place, Token::Kind::text) || next_is(place + 1, Token::Kind::word))
    refuse(reader, word, "brings in a file whose name is computed");
  const fs::path path = fs::path(reader.file()).parent_path() / fs::path(std::string(tokens[place].text));
  if (among(path.extension().string(), program_extensions)) refuse(reader, word, "starts a program");
  if (includes)
    script(path);
  else if (merges)
    merged(path);
}

}  // namespace

void refuse_commands(const fs::path& path) {
  Inspection inspection;
  inspection.merged(path);
  fs::path options = path;
  inspection.script(options += ".opt");  // which gmsh reads as well
}

}  // namespace flexboom
