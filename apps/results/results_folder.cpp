#include "apps/results/results_folder.hpp"

#include "apps/base/version.hpp"
#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "fem/base/stopwatch.hpp"
#include "fem/formats/vtk/vtk.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <system_error>
#include <utility>

namespace flexboom {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace {

constexpr std::array result_files = {"summary.json", "trajectory.csv", "events.csv",  "state.toml",
                                     "scene.toml",   "motion.pvd",     "report.html", "overview.svg"};

constexpr size_t unlimited = std::numeric_limits<size_t>::max();  // rows of long runs are read line by line

bool same_file(const fs::path& a, const fs::path& b) {
  std::error_code error;
  return fs::equivalent(a, b, error);
}

/// A run may not replace what it was read from: neither the scene nor a body.
void check_inputs(const fs::path& folder, const Scene& scene, const fs::path& input) {
  std::vector<fs::path> inputs = {input};
  for (const BodyScene& b : scene.bodies) inputs.push_back(b.reduced_file);
  for (const fs::path& file : inputs)
    for (const char* result : result_files)
      require(file.empty() || !same_file(file, folder / result),
              fmt::format("{} would be overwritten by the results; give another folder by --out", file.string()));
}

/// What a run needs of the folder in which it goes on, before it computes anything. @throws InputError.
void check_earlier_run(const fs::path& folder) {
  for (const char* name : {"trajectory.csv", "events.csv"})
    require(fs::exists(folder / name), fmt::format("--continue: {} is missing, to which rows would be added; give "
                                                   "another folder by --out",
                                                   (folder / name).string()));
  for (const char* name : result_files)
    if (fs::exists(folder / name)) require_regular_file(folder / name, unlimited);
}

/// Adds to a file that is there. @throws InputError.
void append(const fs::path& path, const std::function<void(std::ostream&)>& write) {
  errno = 0;
  std::ofstream out(path, std::ios::binary | std::ios::app);
  write(out);
  out.close();
  require(static_cast<bool>(out),
          fmt::format("cannot write {}: {}", path.string(),
                      errno != 0 ? std::generic_category().message(errno) : "the stream failed"));
}

void copy_head(const fs::path& path, std::uintmax_t bytes, std::ostream& out) {
  std::ifstream in(path, std::ios::binary);
  std::array<char, 1 << 16> buffer;
  while (bytes > 0 && out) {
    in.read(buffer.data(), static_cast<std::streamsize>(std::min<std::uintmax_t>(bytes, buffer.size())));
    require(in.gcount() > 0, fmt::format("{} became shorter while it was read", path.string()));
    out.write(buffer.data(), in.gcount());
    bytes -= static_cast<std::uintmax_t>(in.gcount());
  }
}

/// The lines of a table that an earlier flight wrote: a header, then rows that begin with a time. `wanted` says which
/// times stay. A last line without an end was being written when that flight was killed.
struct Head {
  std::string header, rows;
  std::uintmax_t bytes = 0;  // of both
};
Head head_of(const fs::path& path, bool keep_text, const std::function<bool(double)>& wanted) {
  std::ifstream in(path, std::ios::binary);
  require(static_cast<bool>(in), fmt::format("--continue: cannot read {}, to which rows would be added; give another "
                                             "folder by --out",
                                             path.string()));
  Head head;
  std::string line;
  for (size_t number = 1; std::getline(in, line) && !in.eof(); ++number) {
    if (number == 1) {
      head.header = line;
    } else {
      double t = 0;
      const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), t);
      require(error == std::errc() && *end == ',',
              fmt::format("{}:{}: does not begin with a time", path.string(), number));
      if (!wanted(t)) break;
      if (keep_text) head.rows += line + '\n';
    }
    head.bytes += line.size() + 1;
  }
  return head;
}

constexpr const char* earlier = ".earlier";  // folder of the files that a run finds, until it has some of its own

/// Those of a run that are there, and those that a killed one left half written.
std::vector<fs::path> files_of_runs(const fs::path& folder) {
  std::error_code ignored;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const fs::path file = entry.path().filename();
    const std::string name = (file.extension() == ".part" ? file.stem() : file).string();
    if (std::ranges::find(result_files, name) != result_files.end() || is_motion_frame(name))
      files.push_back(entry.path());
  }
  return files;
}

bool on_grid(double t, double step) {
  const double k = t / step;
  return std::abs(k - std::round(k)) <= 1e-12 * std::max(1.0, k);
}

}  // namespace

ResultsFolder::ResultsFolder(fs::path path, const Scene& scene, const fs::path& input)
    : path_(std::move(path)), goes_on_(scene.from && same_file(scene.from->file(), path_ / "state.toml")) {
  if (scene.from) start_ = scene.from->time();
  if (goes_on_) kept_events_ = scene.from->events();
  goes_on_ ? check_earlier_run(path_) : check_inputs(path_, scene, input);
  std::error_code error;
  fs::create_directories(path_, error);
  require(!error, fmt::format("cannot make the output folder {}: {}", path_.string(), error.message()));
  lock_ = std::make_unique<FolderLock>(path_);
  summary_ = {{"scene", scene.name}, {"version", version}, {"status", "running"}, {"process", getpid()}};
  if (goes_on_) return;
  begun_ = true;
  // What a run that was killed before its first row had set aside is still there.
  if (fs::exists(path_ / "trajectory.csv")) set_aside();
  clear();
  write_file(path_ / "scene.toml", to_toml(scene));
  write_summary();
}

/// Nothing of an older run stays, nor what a killed one left half written.
void ResultsFolder::clear() {
  std::error_code ignored;
  for (const fs::path& file : files_of_runs(path_)) fs::remove(file, ignored);
}

void ResultsFolder::set_aside() {
  std::error_code error;
  fs::remove_all(path_ / earlier, error);
  fs::create_directory(path_ / earlier, error);
  for (const fs::path& file : files_of_runs(path_))
    if (!error) fs::rename(file, path_ / earlier / file.filename(), error);
}

void ResultsFolder::let_go() {
  std::error_code ignored;
  fs::remove_all(path_ / earlier, ignored);
  has_rows_ = true;
}

void ResultsFolder::refuse(const std::string& why) noexcept {
  std::error_code error;
  if (!begun_ || has_rows_ || !fs::exists(path_ / earlier, error)) return fail(why);
  try {
    clear();
    for (const fs::path& file : files_of_runs(path_ / earlier)) fs::rename(file, path_ / file.filename());
    fs::remove_all(path_ / earlier);
  } catch (const std::exception&) {  // they stay where they are
  }
}

/// What stays of the flight that this one goes on from: all that came before its start.
void ResultsFolder::begin(const RunResult& r) {
  const fs::path rows = path_ / "trajectory.csv";
  const double before = start_ * (1 - 1e-12);
  const Head head = head_of(rows, false, [before](double t) { return t < before; });
  const std::string header = fmt::format("{}", fmt::join(r.outputs.names, ","));
  require(head.header == header,
          fmt::format("--continue: {} has other columns than this run; give another folder by --out", rows.string()));
  rows_before_ = head.bytes;
  // Not by their times: two events may be at the time of the state. One may be in it, the other what a killed run saw
  // next.
  events_before_ =
      head_of(path_ / "events.csv", true, [left = kept_events_](double) mutable { return left-- > 0; }).rows;
  drop_events_seen_again(r);
  skips_first_ = start_ > 0 && !on_grid(start_, r.scene.output_step);
  const fs::path frames = path_ / "motion.pvd";
  if (fs::exists(frames)) {
    for (auto& frame : read_pvd(frames))
      if (frame.first < before) frames_before_.add(std::move(frame), r.scene.vtu_step);
    write_pvd(frames, frames_before_.files);
  }
  write_file(path_ / "scene.toml", to_toml(r.scene));
  begun_ = true;
}

/// A joint that slips as a run begins may do so again when a state of that instant goes on.
void ResultsFolder::drop_events_seen_again(const RunResult& r) {
  const std::string all = event_rows(r, 0);
  size_t end = 0;
  int count = 0;
  for (const StopEvent& e : r.motion.events) {
    if (e.time > start_) break;
    end = all.find('\n', end) + 1, ++count;
  }
  if (count == 0 || !events_before_.ends_with(all.substr(0, end))) return;
  events_before_.resize(events_before_.size() - end);
  kept_events_ -= count;
}

void ResultsFolder::write_rows(std::ostream& out, const OutputTable& table, size_t first) const {
  if (first == 0 && rows_before_ == 0) out << fmt::format("{}\n", fmt::join(table.names, ","));
  print_rows(out, table, first == 0 && skips_first_ ? 1 : 0);
}

void ResultsFolder::add(const RunResult& r, size_t first) {
  if (!begun_) begin(r);
  let_go();
  const fs::path rows = path_ / "trajectory.csv", events = path_ / "events.csv";
  const std::vector<StopEvent>& all = r.motion.events;
  if (first == 0) {
    write_file(rows, [&](std::ostream& out) {
      copy_head(rows, rows_before_, out);
      write_rows(out, r.outputs, 0);
    });
    write_file(events, events_header + events_before_);
    events_ = 0;
    frames_ = frames_before_;
  } else {
    append(rows, [&](std::ostream& out) { write_rows(out, r.outputs, first); });
  }
  append(events, [&](std::ostream& out) { out << event_rows(r, std::exchange(events_, all.size())); });
  if (r.scene.vtu_step > 0) write_motion(r, path_, frames_);
  write_state(r);
  summary_ = summary_json(r, 0);
  summary_["status"] = "running";
  summary_["process"] = getpid();
  write_summary();
}

void ResultsFolder::write(const RunResult& r) {
  const Stopwatch watch;
  let_go();
  const fs::path rows = path_ / "trajectory.csv";
  write_file(path_ / "scene.toml", to_toml(r.scene));
  write_file(rows, [&](std::ostream& out) {
    copy_head(rows, rows_before_, out);
    write_rows(out, r.outputs, 0);
  });
  write_file(path_ / "events.csv", events_header + events_before_ + event_rows(r, 0));
  frames_ = frames_before_;
  if (r.scene.vtu_step > 0) write_motion(r, path_, frames_);
  summary_ = summary_json(r, watch.seconds());
  write_summary();
  // Last: until everything is there, the state before says from where a run that is killed now can go on.
  write_state(r);
}

void ResultsFolder::write_state(const RunResult& r) {
  FlightState end = r.end;
  end.events = kept_events_ + static_cast<int>(r.motion.events.size());
  write_file(path_ / "state.toml", to_toml(end, r.scene.name));
}

void ResultsFolder::write_summary() { write_file(path_ / "summary.json", summary_.dump(2) + "\n"); }

void ResultsFolder::fail(const std::string& why) noexcept {
  if (!begun_) return;
  try {
    summary_["status"] = "failed";
    summary_["error"] = why;
    summary_.erase("process");
    write_summary();
  } catch (const std::exception&) {  // it says "running" still, of a process that is gone
  }
}

}  // namespace flexboom
