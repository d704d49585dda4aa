#pragma once

#include "apps/accuracy/run_scene.hpp"
#include "fem/base/files.hpp"

#include <nlohmann/json_fwd.hpp>

#include <filesystem>
#include <iosfwd>
#include <string>
#include <utility>
#include <vector>

namespace flexboom {

/// Makes the folder and proves that it can be written to. @throws InputError.
void prepare_folder(const std::filesystem::path&);

/// Rows of trajectory.csv from `first` on, 17 significant digits. They go out one by one: as one text they may be
/// gigabytes.
void print_rows(std::ostream&, const OutputTable&, size_t first);

/// events.csv: its header, and its rows from event `first` on.
constexpr const char* events_header = "time,hinge,kind\n";
std::string event_rows(const RunResult&, size_t first);

/// Keys of summary.json, of a run that has ended.
nlohmann::ordered_json summary_json(const RunResult&, double write_seconds);

/// Frames of motion.pvd: time [s] and file, and the time that the next one is wanted at.
struct MotionFrames {
  std::vector<std::pair<double, std::string>> files;
  double next = 0;

  void add(std::pair<double, std::string>, double vtu_step);
};

/// Is this the name of such a file?
bool is_motion_frame(const std::string& name);

/// motion.pvd and motion_NNNNN.vtu, bodies in inertial axes: a frame per vtu_step of the scene, behind those that are
/// there.
void write_motion(const RunResult&, const std::filesystem::path& folder, MotionFrames&);

}  // namespace flexboom
