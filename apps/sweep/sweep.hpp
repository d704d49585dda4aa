#pragma once

#include "apps/sweep/journal.hpp"

#include <nlohmann/json.hpp>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace flexboom {

struct SweepRequest {
  std::string scene;  // a path, or the name of a built-in scene
  SweepDesign design;
  std::vector<std::string> quantities;  // empty: default_quantities
  bool loads = false;                   // of every joint, as outputs
  bool trajectories = false;            // kept
  Shard shard;
  size_t jobs = 1;
  bool resume = false;
  bool report = false;
  std::filesystem::path out;
};

/// How a sweep ended.
struct SweepEnd {  // NOLINT(bugprone-exception-escape): a value of JSON is moved without one
  nlohmann::ordered_json summary;
  size_t failed = 0;  // runs
  bool interrupted = false;
};

/// Told after each run: how many are done, of how many.
using SweepProgress = std::function<void(size_t done, size_t of)>;

/// Folder of results where none is given.
std::filesystem::path default_sweep_folder(const SweepRequest&);

/// Simulates the runs that the journal in the folder lacks, and writes the tables. @throws InputError, NumericalError
/// of the scene as it stands; runs that fail are counted.
SweepEnd run_sweep(const SweepRequest&, const SweepProgress&);

/// The tables of one sweep from the folders of its shards. @throws InputError listing runs that are missing, or are
/// there twice.
SweepEnd merge_sweeps(const std::vector<std::filesystem::path>& folders, const std::filesystem::path& out, bool report);

}  // namespace flexboom
