#include "apps/subprocess.hpp"
#include "fem/stopwatch.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <sstream>

namespace flexboom {
namespace {

/// In the child: never returns.
[[noreturn]] void become(const std::vector<std::string>& command, const std::filesystem::path& folder, int output) {
  for (const char* name : {"OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "CCX_NPROC_EQUATION_SOLVER"})
    setenv(name, "1", 1);
  const int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
  dup2(nothing, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(nothing, STDERR_FILENO);
  if (chdir(folder.c_str()) != 0) _exit(127);
  std::vector<char*> arguments;
  for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  execv(arguments.front(), arguments.data());
  _exit(127);
}

std::string read_all(int file) {
  std::string text;
  std::array<char, 65536> buffer{};
  for (ssize_t count = 0; (count = read(file, buffer.data(), buffer.size())) > 0;) {
    text.append(buffer.data(), static_cast<size_t>(count));
  }
  return text;
}

}  // namespace

ProcessResult run_process(const std::vector<std::string>& command, const std::filesystem::path& folder) {
  ProcessResult result;
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    result.exit_code = -1;
    return result;
  }
  const Stopwatch start;
  const pid_t child = fork();
  if (child == 0) become(command, folder, ends[1]);
  close(ends[1]);
  result.output = child > 0 ? read_all(ends[0]) : "";
  close(ends[0]);
  int status = 0;
  rusage usage = {};
  const bool ended = child > 0 && wait4(child, &status, 0, &usage) == child && WIFEXITED(status);
  result.exit_code = ended ? WEXITSTATUS(status) : -1;
  result.seconds = start.seconds();
  result.memory_mb = static_cast<double>(usage.ru_maxrss) / 1024;
  return result;
}

std::string program_on_path(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::string file = (folder.empty() ? "." : folder) + "/" + name;
    if (access(file.c_str(), X_OK) == 0) return file;
  }
  return "";
}

std::string this_program() { return std::filesystem::read_symlink("/proc/self/exe").string(); }

}  // namespace flexboom
