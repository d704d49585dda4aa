#include "apps/simulate/flight_state.hpp"

#include "apps/base/toml_reader.hpp"
#include "apps/base/toml_writer.hpp"
#include "apps/base/version.hpp"
#include "apps/scene/scene_law.hpp"
#include "fem/base/check.hpp"
#include "reduction/body_file/sha256.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

namespace flexboom {

namespace fs = std::filesystem;
using Eigen::Index;
using Eigen::VectorXd;
using toml_reader::Faults;
using toml_reader::TableReader;
using toml_reader::Value;
using toml_writer::toml;

namespace {

constexpr std::string_view state_format = "flexboom-state-7";
constexpr std::string_view checksum_key = "sha256";

/// The line that holds the checksum of all others, or an empty one behind the end.
std::string_view checksum_line(std::string_view text) {
  const std::string begin = fmt::format("\n{} = ", checksum_key);
  const size_t at = text.find(begin);
  if (at == std::string_view::npos) return text.substr(text.size());
  return text.substr(at + 1, text.find('\n', at + 1) - at);
}

std::string checksum_of(std::string_view text) {
  const std::string_view line = checksum_line(text);
  Sha256 sum;
  sum.add(text.substr(0, static_cast<size_t>(line.data() - text.data())));
  sum.add(text.substr(static_cast<size_t>(line.data() + line.size() - text.data())));
  return fmt::format("{} = \"{}\"\n", checksum_key, sum.digest());
}

/// Names by place.
class Names {
 public:
  explicit Names(int size) : names_(static_cast<size_t>(size)) {}

  void set(int place, std::string name) { names_[static_cast<size_t>(place)] = std::move(name); }
  void set_vector(int first, const std::string& stem) {
    if (first < 0) return;
    for (const char* axis : {".x", ".y", ".z"}) set(first++, stem + axis);
  }
  void set_quaternion(int first, const std::string& stem) {
    if (first < 0) return;
    set(first, stem + ".w");
    set_vector(first + 1, stem);
  }
  /// Coordinates of a body and, from `rate` on, their rates.
  void set_modes(int place, int rate, int n, const std::string& body) {
    for (int k = 0; k < n; ++k) {
      set(place + k, fmt::format("{}.q{}", body, k + 1));
      set(rate + k, fmt::format("{}.q{}.rate", body, k + 1));
    }
  }
  std::vector<std::string> take() { return std::move(names_); }

 private:
  std::vector<std::string> names_;
};

}  // namespace

std::vector<std::string> state_names(const Tree& tree) {
  const TreeLayout& l = tree.layout();
  Names names(l.size);
  for (size_t i = 0; i < l.joints.size(); ++i) {
    const TreeLayout::Joint& at = l.joints[i];
    const Joint& joint = tree.scene().joints[i];
    const int scalars = joint_type(joint.kind).scalars;
    for (int k = 0; k < scalars; ++k) {
      const std::string number = scalars > 1 ? std::to_string(k + 1) : "";
      names.set(at.scalar + k, joint.name + ".gap" + number);
      names.set(l.rate(at.scalar + k), joint.name + ".rate" + number);
    }
    names.set_vector(at.omega, joint.name + ".rate");
    names.set_vector(at.position, joint.name + ".position");
    names.set_quaternion(at.attitude, joint.name + ".attitude");
    names.set_vector(at.velocity, joint.name + ".velocity");
    names.set(at.dissipated, joint.name + ".dissipated");
    for (size_t k = 0; at.losses >= 0 && k < law_losses.size(); ++k)
      names.set(at.losses + static_cast<int>(k), fmt::format("{}.lost.{}", joint.name, law_losses[k]));
  }
  for (size_t b = 0; b < l.q.size(); ++b) {
    const ReducedBody& body = tree.scene().bodies[b];
    names.set_modes(l.q[b], l.rate(l.q[b]), body.n(), body.name);
  }
  for (size_t i = 0; i < tree.scene().wheels.size(); ++i)
    names.set(l.spin + static_cast<int>(i), tree.scene().wheels[i].name + ".spin");
  names.set(l.dissipated_elsewhere, "energy.dissipated_elsewhere");
  names.set(l.work, "energy.work");
  return names.take();
}

std::string to_toml(const FlightState& state, const std::string& scene) {
  toml_writer::Writer out;
  out.key("format", state_format);
  out.key("scene", scene);
  out.key("version", std::string_view(version));
  out.key(checksum_key, std::string_view());
  out.key("time", state.time, "[s]");
  out.key("events", state.events, "in events.csv, until then");
  out.table("[modes]");
  for (const auto& [body, n] : state.modes) out.key(toml(body), n);
  if (!state.shapes.empty()) out.table("[shapes]");
  for (const auto& [body, list] : state.shapes) out.key(toml(body), list);
  if (!state.corrections.empty()) out.table("[corrections]");
  for (const auto& [body, list] : state.corrections) out.key(toml(body), list);
  out.table("[largest]");
  out.key("energy", state.largest.energy, "[J], of the whole run: what its balances are relative to");
  out.key("shaking", state.largest.shaking, "[J], without the spin of wheels: what errors are weighed against");
  out.key("momentum", state.largest.momentum, "[N s]");
  out.key("angular_momentum", state.largest.angular_momentum, "[N m s]");
  out.table("[state]");
  for (size_t i = 0; i < state.names.size(); ++i) out.key(toml(state.names[i]), state.y[static_cast<Index>(i)]);
  out.table("[stops.largest_rate]");
  for (const auto& [name, stop] : state.stops) out.key(toml(name), stop.largest_rate);
  out.table("[stops.largest_gap]");
  for (const auto& [name, stop] : state.stops) out.key(toml(name), stop.largest_gap);
  out.table("[stops.sides]");
  for (const auto& [name, stop] : state.stops)
    out.key(toml(name), std::vector<double>(stop.sides.begin(), stop.sides.end()));
  out.table("[stops.closed]");
  for (const auto& [name, stop] : state.stops)
    if (stop.closed) out.key(toml(name), *stop.closed);
  out.table("[stops.settled]");
  for (const auto& [name, stop] : state.stops)
    if (stop.settled >= 0) out.key(toml(name), stop.settled);
  out.table("[stops.law]");
  for (const auto& [name, stop] : state.stops)
    if (stop.law) out.key(toml(name), law_state_text(*stop.law));
  out.table("[loops]");
  for (const auto& [joint, angle] : state.loops) out.key(toml(joint), angle);
  std::string text = std::move(out).text();
  const std::string_view line = checksum_line(text);
  return text.replace(static_cast<size_t>(line.data() - text.data()), line.size(), checksum_of(text));
}

struct SavedState::Content {
  fs::path file;
  Value root;
  double time = 0;
  int events = 0;
  std::map<std::string, int> modes;
  std::map<std::string, std::vector<int>> shapes;
  std::map<std::string, std::vector<std::string>> corrections;
  std::map<std::string, StopHistory> stops;
  MotionScales largest;
  std::map<std::string, double> loops;
};

namespace {

double finite(TableReader& table, const std::string& name) {
  const double value = table.number(name);
  if (!std::isfinite(value)) table.fault(name, "must be a finite number");
  return value;
}

/// Of StopHistory.
std::array<double, 3> read_sides(TableReader& table, const std::string& name) {
  std::array<double, 3> sides{};
  const std::vector<double> values = table.numbers(name);
  if (values.size() == sides.size() && std::ranges::all_of(values, [](double v) { return v >= 0 && std::isfinite(v); }))
    std::ranges::copy(values, sides.begin());
  else
    table.fault(name, "must be three rates, none negative");
  return sides;
}

/// All numbers of a table, by name.
std::map<std::string, double> numbers_of(TableReader& table) {
  std::map<std::string, double> numbers;
  for (const auto& [name, value] : table.value().entries) numbers[name] = finite(table, name);
  return numbers;
}

std::optional<LawState> read_law_state(TableReader& laws, const std::string& joint) {
  try {
    return law_state_of(laws.text(joint));
  } catch (const InputError& error) {
    laws.fault(joint, error.what());
    return {};
  }
}

std::string first_few(const std::vector<std::string>& names) {
  constexpr size_t few = 4;
  std::string text;
  for (size_t i = 0; i < std::min(few, names.size()); ++i) text += (i > 0 ? ", " : "") + names[i];
  return names.size() > few ? text + fmt::format(" and {} more", names.size() - few) : text;
}

/// A state of another scene is one fault, not one for each number.
void check_names(TableReader& table, const std::vector<std::string>& names) {
  const std::set<std::string> wanted(names.begin(), names.end());
  std::vector<std::string> missing, others;
  for (const std::string& name : names)
    if (!table.has(name)) missing.push_back(name);
  for (const auto& [name, value] : table.value().entries)
    if (!wanted.contains(name)) others.push_back(name);
  if (missing.empty() && others.empty()) return;
  const toml_reader::Place at = table.value().place;
  std::string text =
      fmt::format("{}:{}:{}: state: is of another scene, or of other numbers of modes", at.file, at.line, at.column);
  if (!missing.empty()) text += "; not here: " + first_few(missing);
  if (!others.empty()) text += "; not of this scene: " + first_few(others);
  throw InputError(text);
}

std::map<std::string, double> numbers_of(TableReader& table, std::string_view key) {
  std::optional<TableReader> below = table.table(key, true);
  return below ? numbers_of(*below) : std::map<std::string, double>();
}

}  // namespace

SavedState SavedState::read(const fs::path& path, bool changed_too) {
  std::error_code error;
  auto content = std::make_unique<Content>();
  content->file = fs::is_directory(path, error) ? path / "state.toml" : path;
  const std::string file = content->file.string();
  const std::string text = toml_reader::read_text(file);
  content->root = toml_reader::parse_format(text, file, state_format);
  Faults faults;
  TableReader table(content->root, "", faults);
  read_format(table, state_format);
  table.text("scene");
  table.text("version");
  table.text(checksum_key, "");
  content->time = table.number("time");
  if (!(content->time >= 0 && std::isfinite(content->time))) table.fault("time", "must be a time after the start [s]");
  content->events = table.integer("events");
  if (content->events < 0) table.fault("events", "must be a number of rows");
  if (std::optional<TableReader> modes = table.table("modes", true))
    for (const auto& [body, value] : modes->value().entries) {
      content->modes[body] = modes->integer(body);
      if (content->modes[body] < 0) modes->fault(body, "must be a number of modes");
    }
  if (std::optional<TableReader> shapes = table.table("shapes"))
    for (const auto& [body, value] : shapes->value().entries)
      for (const double k : shapes->numbers(body)) {
        content->shapes[body].push_back(static_cast<int>(k));
        if (!(k >= 1 && k <= content->modes[body] && k == std::floor(k)))
          shapes->fault(body, "must be numbers of modes");
      }
  if (std::optional<TableReader> corrections = table.table("corrections"))
    for (const auto& [body, value] : corrections->value().entries)
      content->corrections[body] = corrections->texts(body, {});
  table.table("state", true);
  if (std::optional<TableReader> largest = table.table("largest", true)) {
    MotionScales& l = content->largest;
    for (const auto& [name, value] :
         {std::pair{"energy", &l.energy}, std::pair{"shaking", &l.shaking}, std::pair{"momentum", &l.momentum},
          std::pair{"angular_momentum", &l.angular_momentum}}) {
      *value = finite(*largest, name);
      if (*value < 0) largest->fault(name, "must not be negative");
    }
    largest->reject_unknown();
  }
  if (std::optional<TableReader> stops = table.table("stops", true)) {
    for (const auto& [name, rate] : numbers_of(*stops, "largest_rate")) content->stops[name].largest_rate = rate;
    for (const auto& [name, gap] : numbers_of(*stops, "largest_gap")) content->stops[name].largest_gap = gap;
    if (std::optional<TableReader> sides = stops->table("sides"))
      for (const auto& [name, value] : sides->value().entries) content->stops[name].sides = read_sides(*sides, name);
    if (std::optional<TableReader> closed = stops->table("closed"))
      for (const auto& [name, value] : closed->value().entries) content->stops[name].closed = closed->boolean(name);
    if (std::optional<TableReader> laws = stops->table("law"))
      for (const auto& [name, value] : laws->value().entries) content->stops[name].law = read_law_state(*laws, name);
    for (const auto& [name, time] : numbers_of(*stops, "settled")) content->stops[name].settled = time;
    stops->reject_unknown();
  }
  content->loops = numbers_of(table, "loops");
  table.reject_unknown();
  faults.throw_if_any();
  const std::string_view line = checksum_line(text);
  require(changed_too || line == checksum_of(text),
          fmt::format("{}:{}:1: {}: the file was changed after it was written; --force goes on from it all the same",
                      file, 1 + std::count(text.data(), line.data(), '\n'), checksum_key));
  return SavedState(std::move(content));
}

SavedState::SavedState(std::unique_ptr<const Content> content) : content_(std::move(content)) {}
SavedState::~SavedState() = default;
SavedState::SavedState(SavedState&&) noexcept = default;

const fs::path& SavedState::file() const { return content_->file; }
double SavedState::time() const { return content_->time; }
const std::map<std::string, int>& SavedState::modes() const { return content_->modes; }
const std::map<std::string, std::vector<int>>& SavedState::shapes() const { return content_->shapes; }
const std::map<std::string, std::vector<std::string>>& SavedState::corrections() const { return content_->corrections; }
int SavedState::events() const { return content_->events; }

const MotionScales& SavedState::largest() const { return content_->largest; }

VectorXd SavedState::values(const std::vector<std::string>& names) const {
  Faults faults;
  TableReader root(content_->root, "", faults);
  TableReader table = *root.table("state", true);
  check_names(table, names);
  VectorXd y(static_cast<Index>(names.size()));
  for (size_t i = 0; i < names.size(); ++i) y[static_cast<Index>(i)] = finite(table, names[i]);
  for (size_t i = 0; i < names.size(); ++i)
    if (names[i].ends_with(".attitude.w") && !(std::abs(y.segment<4>(static_cast<Index>(i)).norm() - 1) < 1e-9))
      table.fault(names[i], "begins a quaternion (w, x, y, z) that is not of length 1");
  faults.throw_if_any();
  return y;
}

std::vector<StopHistory> SavedState::stops(const std::vector<std::string>& names) const {
  std::vector<StopHistory> histories;
  for (const std::string& name : names) {
    const auto found = content_->stops.find(name);
    histories.push_back(found == content_->stops.end() ? StopHistory() : found->second);
  }
  return histories;
}

double SavedState::loop_angle(const std::string& joint, double otherwise) const {
  const auto found = content_->loops.find(joint);
  return found == content_->loops.end() ? otherwise : found->second;
}

}  // namespace flexboom
