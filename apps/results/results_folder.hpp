#pragma once

#include "apps/base/folder_lock.hpp"
#include "apps/results/results.hpp"

#include <nlohmann/json.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <memory>
#include <string>

namespace flexboom {

/// The results folder of one run: locked, without files of an older run, and at every checkpoint fit to go on from.
/// A run that goes on from this very folder keeps rows, events and frames from before its start.
class ResultsFolder {
 public:
  /// `input`: the file that the scene is from. @throws InputError: the folder cannot be written to, another process is
  /// writing there, or a file that was read would be overwritten.
  ResultsFolder(std::filesystem::path, const Scene&, const std::filesystem::path& input);

  /// trajectory.csv, events.csv and frames of motion.pvd grow, state.toml and summary.json are replaced.
  /// Row 0 of a flight takes what came before it away. @throws InputError as write_file.
  void add(const RunResult& so_far, size_t first);

  /// All files of a run that has ended. @throws InputError as write_file.
  void write(const RunResult&);

  /// summary.json says that the run failed, and why. Never throws: it is called because of an error.
  void fail(const std::string& why) noexcept;

  /// The run was refused before it had a row: what was in the folder is as it was. Where nothing was, or there are
  /// rows, as fail().
  void refuse(const std::string& why) noexcept;

  /// What summary.json says.
  const nlohmann::ordered_json& summary() const { return summary_; }
  const std::filesystem::path& path() const { return path_; }

 private:
  void clear();
  void set_aside();
  void let_go();
  void begin(const RunResult&);
  void drop_events_seen_again(const RunResult&);
  void write_rows(std::ostream&, const OutputTable&, size_t first) const;
  void write_summary();
  void write_state(const RunResult&);

  std::filesystem::path path_;
  bool goes_on_;              // from this folder
  bool begun_ = false;        // files here are this run's
  bool has_rows_ = false;     // and rows are among them
  bool skips_first_ = false;  // row 0 of the flight lies off the grid of outputs of the whole
  double start_ = 0;          // [s]
  std::unique_ptr<FolderLock> lock_;
  std::uintmax_t rows_before_ = 0;  // bytes of trajectory.csv that an earlier flight wrote
  std::string events_before_;       // rows of it
  int kept_events_ = 0;             // of them
  MotionFrames frames_before_, frames_;
  size_t events_ = 0;  // written of this flight
  nlohmann::ordered_json summary_;
};

}  // namespace flexboom
