#include "apps/results/report.hpp"

#include "apps/base/plot.hpp"
#include "apps/results/animation.hpp"
#include "apps/scene/scene.hpp"
#include "fem/base/check.hpp"
#include "fem/base/files.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <map>
#include <numbers>
#include <sstream>
#include <string_view>
#include <utility>

namespace flexboom {

namespace fs = std::filesystem;
using json = nlohmann::ordered_json;  // tables in the order of the file

namespace {

constexpr double degrees = 180 / std::numbers::pi;

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> parts;
  std::istringstream in(line);
  for (std::string part; std::getline(in, part, ',');) parts.push_back(part);
  return parts;
}

/// Of a run that was killed the last line may be a part of one: that is left out.
OutputTable read_table(const fs::path& path, bool whole) {
  std::string text = file_bytes(path);
  if (!whole) text.resize(text.rfind('\n') + 1);
  std::istringstream in(text);
  std::string line;
  std::getline(in, line);
  OutputTable table{split(line), {}};
  std::vector<double> values;
  for (size_t number = 2; std::getline(in, line); ++number) {
    const std::vector<std::string> parts = split(line);
    require(parts.size() == table.names.size(), fmt::format("{}:{}: {} values, the header names {}", path.string(),
                                                            number, parts.size(), table.names.size()));
    for (const std::string& part : parts) {
      const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), values.emplace_back());
      require(error == std::errc() && end == part.data() + part.size(),
              fmt::format("{}:{}: '{}' is not a number", path.string(), number, part));
    }
  }
  require(!values.empty(), path.string() + ": no rows");
  const auto columns = static_cast<Eigen::Index>(table.names.size());
  table.values = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      values.data(), std::ssize(values) / columns, columns);
  return table;
}

struct Folder {
  Scene scene;
  OutputTable table;
  json summary;
};

Folder read_folder(const fs::path& folder) {
  Folder f{read_scene(folder / "scene.toml"), {}, {}};
  const fs::path summary = folder / "summary.json";
  try {
    f.summary = json::parse(file_bytes(summary));
    const json& status = f.summary.at("status");
    require(f.summary.contains("simulated_seconds"),
            fmt::format("{}: this run has no rows: {}", summary.string(),
                        f.summary.contains("error") ? f.summary["error"].dump() : status.dump()));
    f.table = read_table(folder / "trajectory.csv", status != "running" && status != "failed");
  } catch (const json::exception& e) {
    throw InputError(fmt::format("{}: {}", summary.string(), e.what()));
  }
  return f;
}

/// What a reader must know before anything else.
std::string status_line(const json& summary) {
  const std::string status = summary.at("status").get<std::string>();
  if (status == "finished") return "";
  if (status == "running") return "<p><b>This run is under way, or was killed. Its last checkpoint is shown.</b></p>\n";
  return fmt::format("<p><b>This run {}{}.</b></p>\n", status == "failed" ? "failed" : "was interrupted",
                     summary.contains("error") ? ": " + escaped(summary["error"].get<std::string>()) : "");
}

/// A plot of the columns whose names end, or begin, so.
struct PlotOf {
  const char *title, *y_label;
  double factor;
  std::vector<std::string_view> parts;
};

const std::vector<PlotOf>& plots_of_columns() {
  static const std::vector<PlotOf> all = {
      {"Joint angles, from the stop where there is one", "angle [deg]", degrees, {".angle", ".angle1", ".angle2"}},
      {"Sliders", "length [m]", 1, {".length"}},
      {"Rotation of bodies from the start", "rotation vector [deg]", degrees, {".rotation."}},
      {"Attitude in the orbit's frame", "angle [deg]", degrees, {"lvlh."}},
      {"Pointing: rotation from the attitude that turns command", "rotation vector [deg]", degrees, {".pointing."}},
      {"Spin of wheels", "spin [rad/s]", 1, {".spin"}},
      {"Elastic tip displacement, axes of the body", "displacement [mm]", 1e3, {".tip."}},
      {"Forces of joints, axes of body b", "force [N]", 1, {".force."}},
      {"Torques of joints, axes of body b", "torque [N m]", 1, {".torque."}},
      {"Drives of prescribed motions", "[N m], [N]", 1, {".drive", ".drive1", ".drive2"}},
      {"Energy", "energy [J]", 1, {"energy."}}};
  return all;
}

bool is_part(std::string_view column, std::string_view part) {
  return part.ends_with('.') ? column.find(part) != std::string_view::npos : column.ends_with(part);
}

/// Curves that would be a line on the axis beside the largest.
void leave_out_flat_ones(Plot& plot) {
  constexpr double flat = 1e-3;
  const auto size = [](const Curve& c) {
    double largest = 0;
    for (const double v : c.y) largest = std::max(largest, std::abs(v));
    return largest;
  };
  double largest = 0;
  for (const Curve& c : plot.curves) largest = std::max(largest, size(c));
  const size_t count = std::erase_if(plot.curves, [&](const Curve& c) { return size(c) < flat * largest; });
  if (count > 0) plot.title += fmt::format(" ({} flat {} left out)", count, count == 1 ? "curve" : "curves");
}

/// Columns that stay zero are left out.
std::vector<Plot> plots(const Folder& f) {
  std::map<std::string, double> stops;  // angles [rad], by column
  for (const JointScene& j : with_joints(f.scene).joints)
    if (j.kind == JointKind::hinge && j.mechanism.stop_stiffness > 0) stops[j.name + ".angle"] = j.mechanism.threshold;
  const auto column = [&f](size_t i) { return f.table.values.col(static_cast<Eigen::Index>(i)); };
  const std::vector<double> t(column(0).begin(), column(0).end());
  std::vector<Plot> all;
  for (const PlotOf& p : plots_of_columns()) {
    Plot plot{p.title, "t [s]", p.y_label, {}};
    for (size_t i = 1; i < f.table.names.size(); ++i) {
      const std::string& name = f.table.names[i];
      if (std::ranges::none_of(p.parts, [&](auto part) { return is_part(name, part); }) || column(i).isZero(0))
        continue;
      const double zero = stops.contains(name) ? stops[name] : 0;
      Curve& curve = plot.curves.emplace_back(Curve{name, t, {}});
      for (const double v : column(i)) curve.y.push_back(p.factor * (v - zero));
    }
    leave_out_flat_ones(plot);
    if (!plot.curves.empty()) all.push_back(std::move(plot));
  }
  return all;
}

std::string cell(const json& v) {
  if (v.is_number_float()) return fmt::format("{:.4g}", v.get<double>());
  if (v.is_null()) return "not measured";
  return v.is_string() ? escaped(v.get<std::string>()) : v.dump();
}

std::string rows(const json& object, const std::string& prefix = "") {
  std::string r;
  for (const auto& [key, value] : object.items())
    if (!value.is_structured())
      r += fmt::format("<tr><th>{}{}</th><td>{}</td></tr>\n", prefix, escaped(key), cell(value));
  return r;
}

/// Errors of each output, the worst first.
std::string outputs_table(const json& outputs) {
  std::vector<std::pair<std::string, json>> all;
  for (const auto& [name, errors] : outputs.items()) all.emplace_back(name, errors);
  std::ranges::stable_sort(all, [](const auto& a, const auto& b) {
    const auto size = [](const json& e) { return e.at("total").is_null() ? 1e300 : e.at("total").get<double>(); };
    return size(a.second) > size(b.second);
  });
  std::string r = "<table><tr><th>output</th>";
  const std::array<const char*, 7> keys = {"total",         "discretisation", "truncation", "time",
                                           "linearisation", "scale",          "worst_at"};
  for (const char* key : keys)
    r += fmt::format("<th>{}</th>", std::string_view(key) == "worst_at" ? "worst at [s]" : key);
  r += "</tr>\n";
  for (const auto& [name, errors] : all) {
    r += fmt::format("<tr><th>{}</th>", escaped(name));
    for (const char* key : keys) r += fmt::format("<td>{}</td>", cell(errors.at(key)));
    r += "</tr>\n";
  }
  return r + "</table>\n";
}

std::string bodies_table(const json& bodies) {
  std::string r =
      "<table><tr><th>body</th><th>structure</th><th>unknowns</th><th>modes</th><th>frequencies "
      "[Hz]</th></tr>\n";
  for (const json& b : bodies) {
    std::string hz;
    for (const json& f : b.at("frequencies_hz")) hz += fmt::format("{}{:.6g}", hz.empty() ? "" : ", ", f.get<double>());
    r += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n", cell(b.at("name")),
                     cell(b.at("structure")), cell(b.at("dofs")), cell(b.at("modes")), hz);
  }
  return r + "</table>\n";
}

constexpr const char* style =
    R"(<style>body{font:15px sans-serif;max-width:820px;margin:2em auto;color:#222}table{border-collapse:collapse;margin:1em 0}
td,th{border:1px solid #ccc;padding:3px 9px;text-align:left;font-variant-numeric:tabular-nums}th{background:#f4f4f4;font-weight:600}
canvas{border:1px solid #ccc;width:100%;touch-action:none}input[type=range]{width:100%}li{margin:.2em 0}</style>)";

/// Where bodies that take long are kept, if they are.
fs::path kept_in(const json& summary) {
  for (const json& body : summary.at("bodies"))
    if (body.contains("kept")) return fs::path(body["kept"].get<std::string>()).parent_path();
  return {};
}

/// @throws json::exception when the summary lacks something.
std::string page(const Folder& f) {
  const json& s = f.summary;
  std::string h = fmt::format(
      "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>flexboom: "
      "{0}</title>{1}</head><body>\n<h1>{0}</h1>\n",
      escaped(f.scene.name), style);
  h += status_line(s);
  h += fmt::format("<p>{} s simulated in {} s ({} times real time), {} steps, {} events.</p>\n",
                   cell(s.at("simulated_seconds")), cell(s.at("seconds").at("integrate")),
                   cell(s.at("real_time_factor")), cell(s.at("steps")), cell(s.at("events")));
  h += animation_html(f.scene, f.table, kept_in(s));
  for (const Plot& p : plots(f)) h += svg(p);
  h += "<h2>How wrong is it?</h2>\n<table>" + rows(s.at("error_budget")) +
       fmt::format("<tr><th>energy balance</th><td>{}</td></tr><tr><th>momentum drift</th><td>{}</td></tr></table>\n",
                   cell(s.at("energy_balance")), cell(s.at("momentum_drift")));
  if (const json& outputs = s.at("error_budget").at("outputs"); !outputs.empty()) h += outputs_table(outputs);
  h += "<h2>What was simulated</h2>\n" + bodies_table(s.at("bodies")) + "<ul>\n";
  for (const json& line : s.at("plan")) h += "<li>" + escaped(line.get<std::string>()) + "</li>\n";
  for (const json& line : s.at("warnings")) h += "<li><b>warning:</b> " + escaped(line.get<std::string>()) + "</li>\n";
  h += "</ul><h2>The run</h2><table>" + rows(s) + rows(s.at("seconds"), "wall seconds: ") + "</table>\n";
  return h + "</body></html>\n";
}

}  // namespace

std::string report_html(const fs::path& folder) {
  const Folder f = read_folder(folder);
  try {
    return page(f);
  } catch (const json::exception& e) {
    throw InputError(fmt::format("{}: {}", (folder / "summary.json").string(), e.what()));
  }
}

std::string overview_svg(const fs::path& folder) { return stacked(plots(read_folder(folder))); }

}  // namespace flexboom
