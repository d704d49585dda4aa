#include "apps/sweep/sweep_report.hpp"

#include "apps/base/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace flexboom {

using nlohmann::ordered_json;

namespace {

constexpr const char* sweep_style =
    R"(<style>body{font:15px sans-serif;max-width:900px;margin:2em auto;color:#222}table{border-collapse:collapse;margin:1em 0}
td,th{border:1px solid #ccc;padding:3px 9px;text-align:left;font-variant-numeric:tabular-nums}th{background:#f4f4f4;font-weight:600}
svg{max-width:100%;height:auto}</style>)";

std::string table_cell(const ordered_json& value) {
  return value.is_null() ? "<td>none</td>"
         : value.is_number_float()
             ? fmt::format("<td>{:.6g}</td>", value.get<double>())
             : fmt::format("<td>{}</td>", escaped(value.is_string() ? value.get<std::string>() : value.dump()));
}

/// The outline of the bars: as many as Freedman and Diaconis advise, 5 to 60.
Curve histogram(const std::string& name, const std::vector<double>& sorted) {
  const double low = sorted.front(), high = sorted.back(), n = static_cast<double>(sorted.size());
  const double width = 2 * (quantile(sorted, 0.75) - quantile(sorted, 0.25)) / std::cbrt(n);
  const double bars = width > 0 ? std::ceil((high - low) / width) : 5;
  const auto count = static_cast<size_t>(std::clamp(bars, 5.0, 60.0));
  std::vector<double> heights(count, 0);
  for (const double v : sorted)
    ++heights[std::min(static_cast<size_t>((v - low) / (high - low) * static_cast<double>(count)), count - 1)];
  Curve outline{name, {low}, {0}};
  for (size_t i = 0; i < count; ++i) {
    const double step = (high - low) / static_cast<double>(count);
    for (const double x : {low + step * static_cast<double>(i), low + step * static_cast<double>(i + 1)})
      outline.x.push_back(x), outline.y.push_back(heights[i]);
  }
  outline.x.push_back(high), outline.y.push_back(0);
  return outline;
}

std::string histograms(const SweepTable& table) {
  std::string h;
  for (size_t i = 0; i < table.quantities().size(); ++i) {
    const std::vector<double> sorted = sorted_values(table.quantity(i));
    const std::string& name = table.quantities()[i];
    if (sorted.empty()) {
      h += fmt::format("<p>{}: no run has a value.</p>\n", escaped(name));
    } else if (!(sorted.back() - sorted.front() > 1e-12 * std::abs(sorted.back()))) {
      h += fmt::format("<p>{}: {:.6g} in every run.</p>\n", escaped(name), sorted.back());
    } else {
      Plot plot{name, name, "runs", {}};
      plot.height = 220;
      plot.curves.push_back(histogram("runs", sorted));
      h += svg(plot);
    }
  }
  return h;
}

std::string quantile_table(const ordered_json& quantities) {
  std::string h = "<table><tr><th>quantity</th><th>runs</th><th>mean</th><th>standard deviation</th>";
  for (const double share : reported_quantiles) h += fmt::format("<th>{:g} %</th>", 100 * share);
  h += "</tr>\n";
  for (const auto& [name, q] : quantities.items()) {
    h += fmt::format("<tr><th>{}</th>", escaped(name));
    for (const char* key : {"count", "mean", "standard_deviation"}) h += table_cell(q.at(key));
    for (const auto& [share, value] : q.at("quantiles").items()) h += table_cell(value);
    h += "</tr>\n";
  }
  return h + "</table>\n";
}

/// First order / total, a column for each varied key.
std::string index_table(const SweepTable& table, const ordered_json& quantities) {
  std::string h = "<table><tr><th>quantity</th>";
  for (const size_t i : table.values().varying()) h += fmt::format("<th>{}</th>", escaped(table.variations()[i].name));
  h += "</tr>\n";
  const auto share = [](const ordered_json& v) {
    return v.is_null() ? "none" : fmt::format("{:.3f}", v.get<double>());
  };
  for (const auto& [name, q] : quantities.items()) {
    if (!q.contains("indices") || q["indices"].is_null()) continue;
    h += fmt::format("<tr><th>{}</th>", escaped(name));
    for (const size_t i : table.values().varying()) {
      const std::string& key = table.variations()[i].name;
      h += fmt::format("<td>{} / {}</td>", share(q["indices"]["first"][key]), share(q["indices"]["total"][key]));
    }
    h += "</tr>\n";
  }
  return h + "</table>\n";
}

/// Values of one column of the scatter matrix, and its range.
struct ScatterColumn {
  std::string name;
  std::vector<double> values;
  double low = 0, high = 1;
  std::string range;  // in words
};

ScatterColumn scatter_column(std::string name, std::vector<double> values) {
  ScatterColumn c;
  c.name = std::move(name), c.values = std::move(values);
  const std::vector<double> sorted = sorted_values(c.values);
  if (sorted.empty()) return c;
  c.range = fmt::format("{:.4g} to {:.4g}", sorted.front(), sorted.back());
  c.low = sorted.front(), c.high = sorted.back();
  if (!(c.high > c.low)) c.low -= 0.5 * std::abs(c.low) + 1e-12, c.high += 0.5 * std::abs(c.high) + 1e-12;
  return c;
}

/// Words stand by their place in the list.
std::vector<double> as_numbers(const Variation& variation, const std::vector<KeyVariant>& column, bool numeric) {
  std::vector<double> numbers;
  for (const KeyVariant& v : column) {
    const auto place = std::find(variation.list.begin(), variation.list.end(), v) - variation.list.begin();
    numbers.push_back(numeric ? v.number : static_cast<double>(place));
  }
  return numbers;
}

constexpr double scatter_cell = 118, scatter_left = 190, scatter_top = 8, scatter_gap = 8;

/// Dots of one pair; of many runs every so many-th.
std::string scatter_dots(const ScatterColumn& x, const ScatterColumn& y, double left, double top) {
  constexpr size_t most = 500;
  const double size = scatter_cell - scatter_gap;
  std::string s = fmt::format(
      "<rect x=\"{:.0f}\" y=\"{:.0f}\" width=\"{:.0f}\" height=\"{:.0f}\" fill=\"none\" stroke=\"#888\"/>\n", left, top,
      size, size);
  for (size_t i = 0; i < x.values.size(); i += x.values.size() / most + 1) {
    if (!std::isfinite(x.values[i]) || !std::isfinite(y.values[i])) continue;
    s += fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="1.3" fill="#0072b2"/>)",
                     left + size * (0.04 + 0.92 * (x.values[i] - x.low) / (x.high - x.low)),
                     top + size * (0.96 - 0.92 * (y.values[i] - y.low) / (y.high - y.low)));
  }
  return s + "\n";
}

/// Quantities against what was varied.
std::string scatter_matrix(const SweepTable& table) {
  constexpr size_t most_columns = 6, most_rows = 12;
  std::vector<ScatterColumn> across, down;
  for (const size_t i : table.values().varying()) {
    if (across.size() == most_columns) break;
    const Variation& v = table.variations()[i];
    across.push_back(scatter_column(v.name, as_numbers(v, table.varied(i), table.is_numeric(i))));
    if (!table.is_numeric(i))
      across.back().range = fmt::format("{} to {}", text_of(v.list.front()), text_of(v.list.back()));
  }
  for (size_t i = 0; i < std::min(most_rows, table.quantities().size()); ++i)
    down.push_back(scatter_column(table.quantities()[i], table.quantity(i)));
  if (across.empty()) return "<p>No key takes more than one value.</p>\n";
  const double width = scatter_left + scatter_cell * static_cast<double>(across.size());
  const double height = scatter_top + scatter_cell * static_cast<double>(down.size()) + 40;
  std::string s = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" "
      "height=\"{1:.0f}\" font-family=\"sans-serif\" font-size=\"10\"><rect width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "fill=\"white\"/>\n",
      width, height);
  for (size_t row = 0; row < down.size(); ++row) {
    const double top = scatter_top + scatter_cell * static_cast<double>(row);
    s += fmt::format(
        "<text x=\"{0:.0f}\" y=\"{1:.0f}\" text-anchor=\"end\">{2}</text><text x=\"{0:.0f}\" y=\"{3:.0f}\" "
        "text-anchor=\"end\">{4}</text>\n",
        scatter_left - 6, top + scatter_cell / 2 - 6, escaped(down[row].name), top + scatter_cell / 2 + 8,
        escaped(down[row].range));
    for (size_t column = 0; column < across.size(); ++column)
      s += scatter_dots(across[column], down[row], scatter_left + scatter_cell * static_cast<double>(column), top);
  }
  for (size_t column = 0; column < across.size(); ++column) {
    const double middle = scatter_left + scatter_cell * (static_cast<double>(column) + 0.5) - scatter_gap / 2;
    constexpr size_t fits = 22;  // letters under a cell
    const std::string& name = across[column].name;
    const std::string shown = name.size() > fits ? fmt::format("...{}", name.substr(name.size() - fits + 3)) : name;
    s += fmt::format(
        "<text x=\"{0:.0f}\" y=\"{1:.0f}\" text-anchor=\"middle\">{2}</text><text x=\"{0:.0f}\" y=\"{3:.0f}\" "
        "text-anchor=\"middle\">{4}</text>\n",
        middle, height - 24, escaped(shown), height - 10, escaped(across[column].range));
  }
  return s + "</svg>\n";
}

std::string failures_list(const ordered_json& failures) {
  std::string h;
  for (const ordered_json& f : failures)
    h += fmt::format("<li>run {}, {}: {}</li>\n", f.at("run").dump(), escaped(f.at("status").get<std::string>()),
                     escaped(f.at("message").get<std::string>()));
  return h.empty() ? "" : "<h2>Runs that failed</h2>\n<ul>\n" + h + "</ul>\n";
}

}  // namespace

std::string sweep_report_html(const SweepTable& table, const ordered_json& summary) {
  const std::string title = escaped(table.identity().scene);
  std::string h = fmt::format(
      "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>flexboom: sweep of {0}</title>{1}</head>"
      "<body>\n<h1>Sweep of {0}</h1>\n",
      title, sweep_style);
  h += fmt::format("<p>{} of {} runs are done, {} of them failed. Values were drawn by {}, seed {}.</p>\n",
                   table.rows().size(), table.planned(), table.failed(),
                   sampling_names[static_cast<size_t>(table.values().sampling())], table.identity().design.seed);
  h += "<ul>\n";
  for (const std::string& vary : table.identity().design.vary) h += fmt::format("<li>{}</li>\n", escaped(vary));
  h += "</ul>\n<h2>Quantities</h2>\n" + quantile_table(summary.at("quantities"));
  if (table.values().base_points() > 0)
    h += "<h2>Sobol indices: first order / total</h2>\n" + index_table(table, summary.at("quantities"));
  h += "<h2>Histograms</h2>\n" + histograms(table);
  h += "<h2>Quantities against what was varied</h2>\n" + scatter_matrix(table);
  return h + failures_list(summary.at("failures")) + "</body></html>\n";
}

}  // namespace flexboom
