#pragma once

#include "apps/model/model.hpp"
#include "apps/model/reduce_arguments.hpp"

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace flexboom {

/// Exit codes promised to scripts.
enum ExitCode : int {
  exit_ok = 0,
  exit_usage = 2,
  exit_input = 3,
  exit_numerical = 4,
  exit_check_failed = 5,
  exit_interrupted = 130
};

/// Notes, warnings and errors. A stderr that is full or closed is no reason to fail: unlike fmt::print it never throws.
inline void print_note(const std::string& text) { std::fputs((text + '\n').c_str(), stderr); }

/// Is this file a body? (Its first key says so; anything else goes through the scene reader and its errors.)
bool is_body_file(const std::string& path);

/// Options that every command has.
struct CommonOptions {
  bool json = false;
  bool quiet = false;
  std::filesystem::path out;
  int threads = 1;
};

struct RunArguments {
  std::string scene;
  std::optional<double> duration, tolerance, output_step, vtu_step;
  std::optional<std::string> modes, structure, formulation, integrator;
  std::filesystem::path from;  // results folder or state file that the run goes on from
  std::filesystem::path plan;  // results folder or scene file that the models of bodies are taken from
  bool force = false;          // from a state file that was changed by hand, too
  double checkpoint = 10;      // wall time between two checkpoints [s]
  bool report = false;
  bool loads = false;  // of every joint, as outputs
  bool no_budget = false;
  bool verify = false;  // by reference runs
};

struct ModesArguments {
  std::string model;
  ModelOptions options;
  std::optional<int> count;            // what the file asks for, or 10
  std::optional<std::string> backend;  // what the file asks for, or "auto"
  std::string verify = "auto";         // Sturm count: "auto" where it is cheap, "sturm" always, "basic" never
  std::filesystem::path vtu;
};

struct MeshArguments {
  std::string body;
  ModelOptions options;
  std::filesystem::path file;
};

struct ExportArguments {
  std::filesystem::path body;
  std::string format;
  std::filesystem::path path;
  std::vector<std::string> settings;  // "name=value"
};

struct BenchArguments {
  std::string what;
  double longest = 60;              // [s] per row; larger models are left out
  std::vector<std::string> scenes;  // of transient; empty: its own
};

struct CompareArguments {
  std::string body;  // body file, scene file or built-in scene
  int count = 10;
  double tolerance = 1e-10;
  int elements = 8;
  bool no_transient = false;
};

struct SweepArguments {
  std::string scene;
  std::vector<std::string> vary, quantities;
  std::optional<size_t> runs;
  std::string sample;  // empty: grid where all are lists, else random
  std::uint64_t seed = 1;
  bool indices = false;  // sample for Sobol indices
  size_t jobs = 0;       // 0: all cores
  bool resume = false;
  std::string shard;  // "i/n"; empty: all runs
  bool trajectories = false, loads = false, report = false;
  std::vector<std::filesystem::path> merge;
};

// One function per command; each returns its exit code and throws InputError or NumericalError.
int run_command(const RunArguments&, const CommonOptions&);
int check_command(const std::string& name, const CommonOptions&);
int keys_command(const std::string& table, const CommonOptions&);
int modes_command(const ModesArguments&, const CommonOptions&);
int mesh_command(const MeshArguments&, const CommonOptions&);
int reduce_command(const ReduceArguments&, const CommonOptions&);
int inspect_command(const std::filesystem::path& file, const CommonOptions&);
int export_command(const ExportArguments&, const CommonOptions&);
int bench_modes_command(const BenchArguments&, const CommonOptions&);
int bench_reduction_command(const BenchArguments&, const CommonOptions&);
int bench_transient_command(const BenchArguments&, const CommonOptions&);
int compare_command(const CompareArguments&, const CommonOptions&);
int sweep_command(const SweepArguments&, const CommonOptions&);
int report_command(const std::filesystem::path& folder, const CommonOptions&);

}  // namespace flexboom
