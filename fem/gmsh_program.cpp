#include "fem/gmsh_program.hpp"

#include "fem/check.hpp"
#include "fem/files.hpp"
#include "fem/gmsh.hpp"
#include "fem/gmsh_script.hpp"
#include "fem/text_reader.hpp"

#include <fmt/format.h>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
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

/// Where a started program gets its input and leaves its output.
class Streams {
 public:
  explicit Streams(const fs::path& output) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions_, STDOUT_FILENO, output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_adddup2(&actions_, STDOUT_FILENO, STDERR_FILENO);
  }
  Streams(const Streams&) = delete;
  Streams& operator=(const Streams&) = delete;
  ~Streams() { posix_spawn_file_actions_destroy(&actions_); }

  const posix_spawn_file_actions_t* actions() const { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_;
};

/// Runs a program of PATH without a shell. Returns its exit code, 127 when it is not there.
int run(std::vector<std::string> words, const fs::path& output) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const Streams streams(output);
  pid_t child = 0;
  const int code = ::posix_spawnp(&child, arguments[0], streams.actions(), nullptr, arguments.data(), environ);
  if (code == ENOENT) return 127;
  require(code == 0, fmt::format("cannot start {}: {}", words[0], std::generic_category().message(code)));
  int status = 0;
  while (::waitpid(child, &status, 0) < 0) require(errno == EINTR, fmt::format("lost {}", words[0]));
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

// The first line in which gmsh says that something is an error, else the last.
std::string complaint(const fs::path& output) {
  const std::string text = file_bytes(output);
  TextReader reader(text, "");
  std::string last;
  while (const auto line = reader.next_line()) {
    if (!trimmed(*line).empty()) last = trimmed(*line);
    if (line->find("Error") != std::string_view::npos) return last;
  }
  return last.empty() ? "no output" : last;
}

std::vector<std::string> command(const fs::path& path, const fs::path& mesh, bool has_unit, bool has_order) {
  // An absolute path cannot be taken for an option.
  std::vector<std::string> words = {
      "gmsh", fs::absolute(path).string(), "-3", "-format", "msh41", "-bin", "-o", mesh.string(), "-v", "3"};
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
  const fs::path mesh = folder.path() / "mesh.msh", output = folder.path() / "output.txt";
  const int code = run(command(path, mesh, is_step, is_script), output);
  require(code != 127,
          fmt::format("{}: to mesh a geometry, the program gmsh must be in PATH (Debian: gmsh)", path.string()));
  require(code == 0 && fs::exists(mesh),
          fmt::format("{}: gmsh made no mesh (exit code {}): {}", path.string(), code, complaint(output)));
  MeshFile result = read_gmsh(file_bytes(mesh), path.string());
  result.notes.push_back(fmt::format(
      "meshed by gmsh{}{}; sizes of elements are set in a .geo file (Merge \"{}\"; Mesh.MeshSizeMax = ...;)",
      is_script ? "" : " with tetrahedra of second order", is_step ? ", lengths in metres" : "",
      path.filename().string()));
  return result;
}

}  // namespace flexboom
