#pragma once

#include "apps/sweep/indices.hpp"
#include "apps/sweep/journal.hpp"

#include <nlohmann/json.hpp>

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace flexboom {

/// The runs of a sweep that are done: what was varied, how it ended, what came out.
class SweepTable {
 public:
  SweepTable(SweepIdentity, SweepValues, std::vector<RunOutcome>);

  const SweepIdentity& identity() const { return identity_; }
  const std::vector<RunOutcome>& rows() const { return rows_; }
  const std::vector<Variation>& variations() const { return values_.variations(); }
  const std::vector<std::string>& quantities() const { return identity_.quantities; }
  const SweepValues& values() const { return values_; }

  /// How many runs this shard has when it is whole.
  size_t planned() const;
  size_t failed() const;

  /// One per row.
  std::vector<KeyVariant> varied(size_t variation) const;
  bool is_numeric(size_t variation) const;
  /// One per row, NaN where it could not be computed.
  std::vector<double> quantity(size_t number) const;

  /// Where the sweep is one for indices, and whole.
  std::optional<SobolIndices> indices(size_t quantity) const;

 private:
  SweepIdentity identity_;
  SweepValues values_;
  std::vector<RunOutcome> rows_;
};

inline constexpr std::array<double, 5> reported_quantiles = {0.01, 0.05, 0.5, 0.95, 0.99};

/// Quantile of sorted values, linear between their order statistics (type 7 of Hyndman and Fan, 1996).
double quantile(const std::vector<double>& sorted, double share);

/// The values that are numbers, ascending.
std::vector<double> sorted_values(std::vector<double>);

std::string csv_of(const SweepTable&);
std::string hdf5_of(const SweepTable&, const std::function<std::optional<OutputTable>(size_t run)>& trajectory);
nlohmann::ordered_json summary_of(const SweepTable&);

}  // namespace flexboom
