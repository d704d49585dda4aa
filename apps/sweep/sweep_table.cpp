#include "apps/sweep/sweep_table.hpp"

#include "apps/sweep/table_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexboom {

using nlohmann::ordered_json;

namespace {

/// RFC 4180: in quotes where it must be. What a spreadsheet would take for two rows becomes one.
std::string csv_text(std::string text) {
  for (char& c : text)
    if (c == '\n' || c == '\r') c = ' ';
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

std::string csv_number(double v) { return std::isnan(v) ? "" : fmt::format("{:.17g}", v); }

ordered_json number_or_null(double v) { return std::isfinite(v) ? ordered_json(v) : ordered_json(nullptr); }

ordered_json statistics_of(const std::vector<double>& sorted) {
  const auto n = static_cast<double>(sorted.size());
  double mean = 0, squares = 0;
  for (const double v : sorted) mean += v / n;
  for (const double v : sorted) squares += (v - mean) * (v - mean);
  const double none = std::nan("");
  ordered_json s = {{"count", sorted.size()},
                    {"mean", number_or_null(sorted.empty() ? none : mean)},
                    {"standard_deviation", number_or_null(sorted.size() < 2 ? none : std::sqrt(squares / (n - 1)))},
                    {"min", number_or_null(sorted.empty() ? none : sorted.front())},
                    {"max", number_or_null(sorted.empty() ? none : sorted.back())}};
  for (const double share : reported_quantiles)
    s["quantiles"][fmt::format("{:g}", share)] = number_or_null(quantile(sorted, share));
  return s;
}

ordered_json indices_json(const SweepTable& table, const SobolIndices& indices) {
  ordered_json j = {{"base_points", indices.points}};
  for (size_t k = 0; k < indices.first.size(); ++k) {
    const std::string& name = table.variations()[table.values().varying()[k]].name;
    j["first"][name] = number_or_null(indices.first[k]);
    j["total"][name] = number_or_null(indices.total[k]);
  }
  return j;
}

ordered_json failures_json(const SweepTable& table) {
  constexpr size_t most = 100;  // all of them are in the table
  ordered_json failures = ordered_json::array();
  for (const RunOutcome& row : table.rows())
    if (row.status != RunStatus::ok && failures.size() < most)
      failures.push_back(
          {{"run", row.run}, {"status", run_status_names[static_cast<size_t>(row.status)]}, {"message", row.message}});
  return failures;
}

}  // namespace

SweepTable::SweepTable(SweepIdentity identity, SweepValues values, std::vector<RunOutcome> rows)
    : identity_(std::move(identity)), values_(std::move(values)), rows_(std::move(rows)) {}

size_t SweepTable::planned() const {
  const Shard& s = identity_.shard;
  return values_.runs() < s.part ? 0 : (values_.runs() - s.part) / s.of + 1;
}

size_t SweepTable::failed() const {
  return static_cast<size_t>(
      std::count_if(rows_.begin(), rows_.end(), [](const RunOutcome& row) { return row.status != RunStatus::ok; }));
}

std::vector<KeyVariant> SweepTable::varied(size_t variation) const {
  std::vector<KeyVariant> column;
  for (const RunOutcome& row : rows_) column.push_back(values_.of_run(row.run)[variation]);
  return column;
}

bool SweepTable::is_numeric(size_t variation) const {
  const Variation& v = variations()[variation];
  return std::all_of(v.list.begin(), v.list.end(), [](const KeyVariant& value) { return value.word.empty(); });
}

std::vector<double> SweepTable::quantity(size_t number) const {
  std::vector<double> column;
  for (const RunOutcome& row : rows_) column.push_back(row.quantities[number]);
  return column;
}

std::optional<SobolIndices> SweepTable::indices(size_t quantity) const {
  if (values_.base_points() == 0 || rows_.size() < values_.runs()) return {};
  const size_t variables = values_.varying().size(), of_point = runs_per_base_point(variables);
  return sobol_indices(variables, values_.base_points(),
                       [&](size_t point, size_t k) { return rows_[point * of_point + k].quantities[quantity]; });
}

double quantile(const std::vector<double>& sorted, double share) {
  if (sorted.empty()) return std::nan("");
  const double place = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<size_t>(place);
  const size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (place - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

std::vector<double> sorted_values(std::vector<double> values) {
  std::erase_if(values, [](double v) { return std::isnan(v); });
  std::sort(values.begin(), values.end());
  return values;
}

std::string csv_of(const SweepTable& table) {
  std::vector<std::string> header = {"run"};
  for (const Variation& v : table.variations()) header.push_back(csv_text(v.name));
  header.emplace_back("status");
  for (const std::string& q : table.quantities()) header.push_back(csv_text(q));
  header.emplace_back("message");
  std::string text = fmt::format("{}\n", fmt::join(header, ","));
  for (const RunOutcome& row : table.rows()) {
    text += std::to_string(row.run);
    const auto add = [&](const std::string& cell) { text += ',', text += cell; };
    for (const KeyVariant& value : table.values().of_run(row.run)) add(csv_text(text_of(value)));
    add(std::string(run_status_names[static_cast<size_t>(row.status)]));
    for (const double q : row.quantities) add(csv_number(q));
    add(csv_text(row.message));
    text += '\n';
  }
  return text;
}

std::string hdf5_of(const SweepTable& table, const std::function<std::optional<OutputTable>(size_t run)>& trajectory) {
  TableFile file;
  std::vector<std::int32_t> runs;
  std::vector<std::string> status, messages;
  for (const RunOutcome& row : table.rows()) {
    runs.push_back(static_cast<std::int32_t>(row.run)), messages.push_back(row.message);
    status.emplace_back(run_status_names[static_cast<size_t>(row.status)]);
  }
  file.note("scene", table.identity().scene);
  file.note("version", table.identity().version);
  file.add("run", "number of the run", runs);
  for (size_t i = 0; i < table.variations().size(); ++i) {
    const std::string name = "varied/" + table.variations()[i].name;
    std::vector<std::string> words;
    std::vector<double> numbers;
    for (const KeyVariant& value : table.varied(i)) words.push_back(text_of(value)), numbers.push_back(value.number);
    constexpr const char* what = "what the run has under this key, or its factor";
    table.is_numeric(i) ? file.add(name, what, numbers) : file.add(name, what, words);
  }
  file.add("status", "how the run ended", status);
  file.add("message", "of a run that failed", messages);
  for (size_t i = 0; i < table.quantities().size(); ++i)
    file.add("quantities/" + table.quantities()[i], "NaN where it could not be computed", table.quantity(i));
  for (size_t i = 0; i < table.rows().size() && table.identity().trajectories; ++i) {
    const std::optional<OutputTable> t = trajectory(table.rows()[i].run);
    if (!t) continue;
    const std::string group = fmt::format("run_{:06}/", table.rows()[i].run);
    const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows = t->values;
    file.add_rows(group + "trajectory", "a row per output time",
                  std::vector<double>(rows.data(), rows.data() + rows.size()), t->names.size());
    file.add(group + "columns", "names of the columns of trajectory", t->names);
  }
  return file.bytes();
}

ordered_json summary_of(const SweepTable& table) {
  const SweepIdentity& id = table.identity();
  const SweepDesign& d = id.design;
  ordered_json s = {{"scene", id.scene},
                    {"version", id.version},
                    {"sha256", id.digest()},
                    {"status", table.rows().size() < table.planned() ? "interrupted" : "finished"},
                    {"shard", fmt::format("{}/{}", id.shard.part, id.shard.of)},
                    {"vary", d.vary},
                    {"sample", sampling_names[static_cast<size_t>(table.values().sampling())]},
                    {"n", d.n ? ordered_json(*d.n) : ordered_json(nullptr)},
                    {"seed", d.seed},
                    {"runs", {{"planned", table.planned()}, {"done", table.rows().size()}, {"failed", table.failed()}}},
                    {"failures", failures_json(table)}};
  s["quantities"] = ordered_json::object();
  for (size_t i = 0; i < table.quantities().size(); ++i) {
    ordered_json& q = s["quantities"][table.quantities()[i]] = statistics_of(sorted_values(table.quantity(i)));
    if (table.values().base_points() > 0) {
      const std::optional<SobolIndices> indices = table.indices(i);
      q["indices"] = indices ? indices_json(table, *indices) : ordered_json(nullptr);
    }
  }
  return s;
}

}  // namespace flexboom
