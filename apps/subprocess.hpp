#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace flexboom {

/// What a program did, as a whole process.
struct ProcessResult {
  int exit_code = 0;     // -1: it could not be started or was killed
  double seconds = 0;    // wall time
  double memory_mb = 0;  // largest resident memory
  std::string output;    // what it wrote to stdout
};

/// Runs a program in a folder, one thread for every numerical library; its stderr is dropped.
ProcessResult run_process(const std::vector<std::string>& command, const std::filesystem::path& folder);

/// Full path of a program on the PATH, empty if it is not there.
std::string program_on_path(const std::string& name);

/// Full path of this program.
std::string this_program();

}  // namespace flexboom
