#include "fem/formats/gmsh/program.hpp"

#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "fem/base/process.hpp"
#include "fem/base/text_reader.hpp"
#include "fem/formats/gmsh/gmsh.hpp"
#include "fem/formats/gmsh/script.hpp"

#include <fmt/format.h>

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <string>
#include <system_error>
#include <vector>

namespace flexboom {
namespace {

namespace fs = std::filesystem;

/// A new folder for the files in between, gone at the end.
class WorkFolder {
 public:
  WorkFolder() {
    std::string pattern = (fs::temp_directory_path() / "flexboom_gmsh_XXXXXX").string();
    require(::mkdtemp(pattern.data()) != nullptr, fmt::format("cannot make the folder {}", pattern));
    path_ = pattern;
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  ~WorkFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }

  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// The first line in which gmsh says that something is an error, else the last.
std::string complaint(const std::string& output) {
  TextReader reader(output, "");
  std::string last;
  while (const auto line = reader.next_line()) {
    if (!trimmed(*line).empty()) last = trimmed(*line);
    if (line->find("Error") != std::string_view::npos) return last;
  }
  return last.empty() ? "no output" : last;
}

std::vector<std::string> command(const std::string& program, const fs::path& path, const fs::path& mesh, bool has_unit,
                                 bool has_order) {
  // An absolute path cannot be taken for an option.
  std::vector<std::string> words = {
      program, fs::absolute(path).string(), "-3", "-format", "msh41", "-bin", "-o", mesh.string(), "-v", "3"};
  if (!has_order) words.insert(words.end(), {"-order", "2"});
  if (has_unit) words.insert(words.end(), {"-setstring", "Geometry.OCCTargetUnit", "M"});
  return words;
}

}  // namespace

MeshFile mesh_with_gmsh(const fs::path& path, const ReadOptions& options) {
  require_regular_file(path);  // its own message when the file is missing
  if (!options.trust) refuse_commands(path);
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const bool is_step = extension == ".step" || extension == ".stp", is_script = extension == ".geo";
  const WorkFolder folder;
  const fs::path mesh = folder.path() / "mesh.msh";
  const std::string program = program_on_path("gmsh");
  require(!program.empty(),
          fmt::format("{}: to mesh a geometry, the program gmsh must be in PATH (Debian: gmsh)", path.string()));
  const ProcessResult gmsh = run_process(command(program, path, mesh, is_step, is_script), {.keeps_errors = true});
  require(gmsh.exit_code == 0 && fs::exists(mesh), fmt::format("{}: gmsh made no mesh (exit code {}): {}",
                                                               path.string(), gmsh.exit_code, complaint(gmsh.output)));
  MeshFile result = read_gmsh(file_bytes(mesh), path.string());
  result.notes.push_back(fmt::format(
      "meshed by gmsh{}{}; sizes of elements are set in a .geo file (Merge \"{}\"; Mesh.MeshSizeMax = ...;)",
      is_script ? "" : " with tetrahedra of second order", is_step ? ", lengths in metres" : "",
      path.filename().string()));
  return result;
}

}  // namespace flexboom
