#pragma once

#include "reduction/body/reduced_body.hpp"

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom {

/// A choice that a format leaves to the user.
struct ExportSetting {
  std::string_view name;         // "invariants"
  std::string_view values;       // "no|yes"; the first is the default. "number:0.01": any number, default 0.01
  std::string_view description;  // one line
};

/// Settings of one export by name; those not given have their defaults.
struct ExportOptions {
  std::map<std::string, std::string> settings;
};

/// What a file holds of a body, rebuilt from the file alone by the formulas of the program it is for: BRF axes, about
/// the BRF origin. Its coordinates may be others (mode shapes of unit modal mass), the body is the same.
struct ReadBack {
  double m = 0;
  Eigen::Vector3d mc0 = Eigen::Vector3d::Zero();
  Eigen::Matrix3d J0 = Eigen::Matrix3d::Zero();
  Eigen::Matrix3Xd Ct;   // 3 x n, or 3 x 0 where the file has none
  Eigen::Matrix3Xd Cr0;  // the same
  Eigen::MatrixXd Me;
  Eigen::MatrixXd Ke;
  std::vector<Marker> markers;  // those that the file has; names may be shortened
};

/// Another program's form of a reduced body. `path` is the file, or the folder (made by export_body) of formats that
/// are several files.
struct Exporter {
  std::string_view name;         // of --to
  std::string_view extension;    // ".fem"; "/" when it is a folder
  std::string_view description;  // one line
  std::span<const ExportSetting> settings;

  /// Writes the files, each whole or not at all. @throws InputError of a body that this format cannot hold at all.
  void (*write)(const ReducedBody&, const ExportOptions&, const std::filesystem::path&);

  /// What of this body the target cannot carry, one sentence each.
  std::vector<std::string> (*cannot_hold)(const ReducedBody&);

  /// Reads the files that `write` made with the same options. Null: this format is not read back here.
  ReadBack (*read_back)(const ExportOptions&, const std::filesystem::path&);
};

/// The table of formats. A new one: a file `<name>.cpp` and a row in `exports.cpp`.
std::span<const Exporter> exporters();

/// Row of that name. @throws InputError listing those that exist.
const Exporter& exporter(std::string_view name);

/// Value of a setting of a format, its default when not given.
/// @throws InputError for a value that is not among those of the setting.
std::string setting(std::span<const ExportSetting>, const ExportOptions&, std::string_view name);
double number_setting(std::span<const ExportSetting>, const ExportOptions&, std::string_view name);

/// NAME of an export to `path`: the stem of its file or folder. @throws InputError when there is none.
std::string export_name(const std::filesystem::path&);

/// What an export did.
struct ExportReport {
  std::vector<std::string> cannot_hold;
  std::vector<BodyCheck> checks;  // of the files, read back; empty where the format has no reader
};

/// Writes the body in that format and the coordinate table beside it, and makes the folder. The table is
/// NAME.coordinates.csv, NAME the stem of `path`, inside the folder for formats that are one. Reads the files back and
/// checks them against the body.
/// @throws InputError for an unknown format or setting, and as `Exporter::write`.
ExportReport export_body(const ReducedBody&, std::string_view format, const ExportOptions&,
                         const std::filesystem::path&);

/// A file against the body it was made of, whatever its coordinates: m, centre, J0, frequencies, the effective masses
/// C Me^-1 C^T of C = (Ct; Cr0), and the displacements S Ke^-1 S^T that unit forces at a marker give there (where Ke is
/// not singular).
std::vector<BodyCheck> check_read_back(const ReducedBody&, const ReadBack&, double tolerance = 1e-10);

/// Which coordinate is what: `index,kind,frequency_hz,interface,direction,Ct_x,Ct_y,Ct_z,Cr0_x,Cr0_y,Cr0_z`, index
/// from 0, SI, body axes, about the BRF origin.
void write_coordinate_table(const ReducedBody&, const std::filesystem::path&);

}  // namespace flexboom
