#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace flexboom {

/// One model of boom 4, solved by whole processes of one thread each.
struct ModesBench {
  std::string family;  // "hex, graded", "hex20", ...
  std::string model;   // what distinguishes it in its family
  int unknowns = 0;
  double error = 0;    // largest of modes 1 to 10 against the converged 3D reference
  double seconds = 0;  // flexboom, wall time from start to exit
  double memory_mb = 0;
  double ccx_seconds = 0;  // CalculiX on the same deck, 0 where it did not run
  double ccx_memory_mb = 0;
  double difference = 0;  // largest relative difference of the frequencies of both
};

/// The first ten frequencies of the clamped boom 4 of SPORT in 3D elasticity [Hz]. Bending and extension come from a
/// Ritz solution in harmonics that is converged to 4e-8. Torsion is exact: sqrt(G / rho) / (4 L).
std::vector<double> boom4_reference_hz();

/// Measures every family of elements on a ladder of meshes, smallest first; a ladder ends where its next rung would
/// take longer than `longest` seconds. Calls `seen` after each row.
std::vector<ModesBench> bench_modes(const std::filesystem::path& folder, double longest,
                                    const std::function<void(const ModesBench&)>& seen);

}  // namespace flexboom
