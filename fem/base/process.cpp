#include "fem/base/process.hpp"

#include "fem/base/stopwatch.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <sstream>
#include <string_view>

namespace flexboom {
namespace {

/// Where a started program gets its input and leaves its output.
class Streams {
 public:
  Streams(int output, const ProcessOptions& options) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions_, output, STDOUT_FILENO);
    if (options.keeps_errors)
      posix_spawn_file_actions_adddup2(&actions_, output, STDERR_FILENO);
    else
      posix_spawn_file_actions_addopen(&actions_, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    if (!options.folder.empty()) posix_spawn_file_actions_addchdir_np(&actions_, options.folder.c_str());
  }
  Streams(const Streams&) = delete;
  Streams& operator=(const Streams&) = delete;
  ~Streams() { posix_spawn_file_actions_destroy(&actions_); }

  const posix_spawn_file_actions_t* actions() const { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_{};
};

/// Those of this process, the numbers of threads overridden.
std::vector<std::string> variables(bool one_thread) {
  std::vector<std::string> result;
  for (char** variable = environ; *variable != nullptr; ++variable) result.emplace_back(*variable);
  if (!one_thread) return result;
  for (const std::string name : {"OMP_NUM_THREADS=", "OPENBLAS_NUM_THREADS=", "CCX_NPROC_EQUATION_SOLVER="}) {
    std::erase_if(result, [&name](const std::string& variable) { return variable.starts_with(name); });
    result.push_back(name + "1");
  }
  return result;
}

/// What the C interface takes: ends with a null.
std::vector<char*> pointers(std::vector<std::string>& words) {
  std::vector<char*> result;
  result.reserve(words.size() + 1);
  for (std::string& word : words) result.push_back(word.data());
  result.push_back(nullptr);
  return result;
}

std::string read_all(int file) {
  std::string text;
  std::array<char, 65536> buffer{};
  for (ssize_t count = 0; (count = read(file, buffer.data(), buffer.size())) > 0 || (count < 0 && errno == EINTR);) {
    if (count > 0) text.append(buffer.data(), static_cast<size_t>(count));
  }
  return text;
}

}  // namespace

ProcessResult run_process(const std::vector<std::string>& command, const ProcessOptions& options) {
  ProcessResult result;
  result.exit_code = -1;
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) return result;
  std::vector<std::string> words = command, environment = variables(options.one_thread);
  const Stopwatch start;
  pid_t child = 0;
  const bool started = [&] {
    const Streams streams(ends[1], options);
    return posix_spawn(&child, words[0].c_str(), streams.actions(), nullptr, pointers(words).data(),
                       pointers(environment).data()) == 0;
  }();
  close(ends[1]);
  if (started) result.output = read_all(ends[0]);
  close(ends[0]);
  if (!started) return result;
  int status = 0;
  rusage usage = {};
  pid_t ended = 0;
  while ((ended = wait4(child, &status, 0, &usage)) < 0 && errno == EINTR) continue;
  if (ended == child && WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  result.seconds = start.seconds();
  result.memory_mb = static_cast<double>(usage.ru_maxrss) / 1024;
  return result;
}

std::string program_on_path(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::string file = (folder.empty() ? "." : folder) + "/" + name;
    if (access(file.c_str(), X_OK) == 0) return file;
  }
  return "";
}

std::string this_program() { return std::filesystem::read_symlink("/proc/self/exe").string(); }

}  // namespace flexboom
