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
  std::string output;    // what it wrote to stdout, and to stderr if that was asked for
};

struct ProcessOptions {
  std::filesystem::path folder{};  // where it runs; empty: here
  bool keeps_errors = false;       // output has its stderr, too; else that is dropped
  bool one_thread = false;         // for every numerical library
};

/// Runs a program, by its full path and without a shell. It reads nothing from stdin.
ProcessResult run_process(const std::vector<std::string>& command, const ProcessOptions&);

/// Full path of a program on the PATH, empty if it is not there.
std::string program_on_path(const std::string& name);

/// Full path of this program.
std::string this_program();

}  // namespace flexboom
