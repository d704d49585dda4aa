#include "apps/sweep/sweep.hpp"
#include "apps/base/usage.hpp"
#include "apps/commands/commands.hpp"
#include "apps/commands/terminal_line.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <sched.h>

#include <algorithm>
#include <charconv>

namespace flexboom {

namespace {

/// Cores that this process may use.
size_t cores() {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0) return 1;
  return static_cast<size_t>(std::max(1, CPU_COUNT(&allowed)));
}

Shard shard_of(const std::string& text) {
  Shard shard;
  if (text.empty()) return shard;
  const char* const last = text.data() + text.size();
  const auto first_read = std::from_chars(text.data(), last, shard.part);
  const bool has_slash = first_read.ec == std::errc() && first_read.ptr != last && *first_read.ptr == '/';
  const auto second_read = std::from_chars(has_slash ? first_read.ptr + 1 : last, last, shard.of);
  require_usage(has_slash && second_read.ec == std::errc() && second_read.ptr == last && shard.part >= 1 &&
                    shard.part <= shard.of,
                fmt::format("--shard {}: is written i/n, i from 1 to n", text));
  return shard;
}

/// Runs done and time left.
class SweepProgress {
 public:
  explicit SweepProgress(bool wanted) : line_(wanted) {}

  void operator()(size_t done, size_t of) {
    if (told_++ == 0) before_ = done - 1;
    if (!line_.is_due()) return;
    const double rate = static_cast<double>(done - before_) / line_.seconds();
    line_.show(fmt::format("{:.0f} %  {} of {} runs, {:.3g} runs/s, {:.0f} s left",
                           100.0 * static_cast<double>(done) / static_cast<double>(of), done, of, rate,
                           static_cast<double>(of - done) / rate));
  }

 private:
  TerminalLine line_;
  size_t told_ = 0, before_ = 0;  // done by an earlier process
};

SweepRequest request_of(const SweepArguments& a, const CommonOptions& common) {
  require_usage(!a.scene.empty(), "sweep needs a SCENE, or --merge DIR...");
  SweepRequest r;
  r.scene = a.scene;
  r.design = {a.vary, a.runs, a.sample, a.seed, a.indices};
  r.quantities = a.quantities, r.loads = a.loads, r.trajectories = a.trajectories;
  r.shard = shard_of(a.shard);
  r.jobs = a.jobs > 0 ? a.jobs : cores();
  r.resume = a.resume, r.report = a.report;
  r.out = common.out.empty() ? default_sweep_folder(r) : common.out;
  return r;
}

std::string short_number(const nlohmann::ordered_json& v) {
  return v.is_null() ? "none" : fmt::format("{:.6g}", v.get<double>());
}

void print_sweep(const SweepEnd& end, const std::filesystem::path& folder) {
  const nlohmann::ordered_json& s = end.summary;
  fmt::print("{:<32} {:>12} {:>12} {:>12} {:>12}\n", "quantity", "mean", "1 %", "50 %", "99 %");
  for (const auto& [name, q] : s["quantities"].items())
    fmt::print("{:<32} {:>12} {:>12} {:>12} {:>12}\n", name, short_number(q["mean"]),
               short_number(q["quantiles"]["0.01"]), short_number(q["quantiles"]["0.5"]),
               short_number(q["quantiles"]["0.99"]));
  fmt::print("\n{} of {} runs, {} failed, in {:.1f} s\nresults: {}\n", s["runs"]["done"].dump(),
             s["runs"]["planned"].dump(), end.failed, s["seconds"].get<double>(), folder.string());
}

SweepEnd swept(const SweepRequest& r, bool progress_wanted) {
  SweepProgress progress(progress_wanted);
  return run_sweep(r, [&progress](size_t done, size_t of) { progress(done, of); });
}

}  // namespace

int sweep_command(const SweepArguments& a, const CommonOptions& common) {
  SweepEnd end;
  std::filesystem::path folder = common.out;
  if (!a.merge.empty()) {
    require_usage(!folder.empty(), "--merge needs --out DIR");
    require_usage(a.scene.empty() && a.vary.empty(), "--merge takes folders of shards, no SCENE and no --vary");
    end = merge_sweeps(a.merge, folder, a.report);
  } else {
    const SweepRequest request = request_of(a, common);
    folder = request.out;
    end = swept(request, !common.quiet && !common.json);
  }
  if (common.json) {
    fmt::print("{}\n", end.summary.dump(2));
  } else if (!common.quiet) {
    print_sweep(end, folder);
  }
  if (end.interrupted) {
    if (!common.quiet) print_note(fmt::format("interrupted; --resume goes on in {}", folder.string()));
    return exit_interrupted;
  }
  if (end.failed == 0) return exit_ok;
  print_note(fmt::format("error: {} of {} runs failed; their messages are in {}", end.failed,
                         end.summary["runs"]["done"].dump(), (folder / "sweep.csv").string()));
  return exit_numerical;
}

}  // namespace flexboom
