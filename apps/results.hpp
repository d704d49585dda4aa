#pragma once

#include "apps/simulate.hpp"
#include "fem/files.hpp"
#include "fem/vtk.hpp"

#include <nlohmann/json_fwd.hpp>

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

namespace flexboom {

/// Makes the folder and proves that it can be written to. @throws InputError.
void prepare_folder(const std::filesystem::path&);

/// trajectory.csv and events.csv, 17 significant digits. The first goes out row by row: as one text it may be
/// gigabytes.
void print_trajectory_csv(std::ostream&, const OutputTable&);
std::string events_csv(const std::vector<std::string>& hinges, const Trajectory&);

/// Keys of summary.json.
nlohmann::ordered_json summary_json(const RunResult&, double write_seconds);

/// scene.toml, trajectory.csv, events.csv, summary.json, and motion.pvd with its .vtu files when the scene has a
/// vtu_step. Files of an older run in the folder are removed first, and summary.json comes last: where it is, the rest
/// is. Returns what summary.json says. @throws InputError as write_file.
nlohmann::ordered_json write_results(const RunResult&, const std::filesystem::path& folder);

/// motion.pvd and motion_NNNNN.vtu, one grid per frame of the scene's vtu_step.
void write_frames(const RunResult&, const std::filesystem::path& folder,
                  const std::function<VtkGrid(size_t row)>& grid);

/// motion.pvd and motion_NNNN.vtu: hub box and deformed booms in inertial axes.
void write_motion(const RunResult&, const std::filesystem::path& folder);

/// Points of the hub's box and the deformed booms at a state, inertial axes [m]; used by the VTU files and the report.
struct Pose {
  Eigen::Matrix3Xd hub;                      // 8 corners
  std::vector<Eigen::Matrix3Xd> booms;       // one curve each
  std::vector<Eigen::Matrix3Xd> deflection;  // elastic displacement at the same points, inertial axes
};
Pose pose_at(const Scene&, const System&, const Eigen::VectorXd& y);

}  // namespace flexboom
