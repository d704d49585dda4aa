#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

/// Points in the unit cube that the runs of a sweep are drawn from. Each number follows from the seed, the dimension
/// and the run alone.
namespace flexboom {

/// A number in (0, 1) that looks random: SplitMix64 as a hash of its arguments.
double uniform_draw(std::uint64_t seed, std::uint64_t dimension, std::uint64_t run);

/// Inverse of the standard normal distribution, relative error 1e-16 (Wichura, algorithm AS 241, PPND16, Applied
/// Statistics 37, 1988). Minus infinity at 0, infinity at 1.
double normal_quantile(double probability);

/// The low-discrepancy sequence of Sobol with the direction numbers of Joe and Kuo.
class SobolSequence {
 public:
  static constexpr size_t most_dimensions = 64;

  /// @throws InputError for more dimensions than that.
  explicit SobolSequence(size_t dimensions);

  /// Coordinate of a point as a fraction of 2^32. Point 0 is the origin; the points are in natural order: bit k of the
  /// number of a point adds direction number k.
  std::uint32_t at(std::uint64_t point, size_t dimension) const;

 private:
  std::vector<std::array<std::uint32_t, 32>> directions_;
};

enum class Sampling { random, lhs, sobol, grid };
inline constexpr std::array<std::string_view, 4> sampling_names = {"random", "lhs", "sobol", "grid"};

/// Points of any sampling but the grid, coordinates in (0, 1).
class UnitPoints {
 public:
  /// @throws InputError as SobolSequence.
  UnitPoints(Sampling, std::uint64_t seed, size_t dimensions, size_t points);

  double at(size_t point, size_t dimension) const;

 private:
  Sampling sampling_;
  std::uint64_t seed_;
  std::vector<std::vector<std::uint32_t>> strata_;  // of lhs: per dimension, the stratum of each point
  std::unique_ptr<SobolSequence> sobol_;
};

}  // namespace flexboom
