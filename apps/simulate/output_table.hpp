#pragma once

#include "reduction/body/reduced_body.hpp"

#include <Eigen/Core>

#include <string>
#include <vector>

namespace flexboom {

/// Names and values of the outputs of a run, one row per time: the columns of trajectory.csv.
struct OutputTable {
  std::vector<std::string> names;
  Eigen::MatrixXd values;  // rows: times
};

/// Is a column an elastic coordinate, "boom.q2"?
bool is_coordinate(const std::string& column);

/// The output of which a column is one value: "sip.q2" -> "sip.q", "hub.rotation.x" -> "hub.rotation".
std::string output_of_column(const std::string& column);

/// Is an output the force, the torque or the drive of a joint?
bool is_load(const std::string& output);

/// Is an output an attitude against a commanded one, or against the orbit's frame?
bool is_pointing(const std::string& output);

/// Deflections of a body are looked at in so many rows at most.
inline constexpr Eigen::Index most_deflections = 20000;

/// The elastic coordinates of a body, n per row.
Eigen::MatrixXd coordinates_of(const OutputTable&, const ReducedBody&);

/// Without the columns of elastic coordinates: those of another basis have other meanings.
OutputTable without_coordinates(const OutputTable&);

}  // namespace flexboom
