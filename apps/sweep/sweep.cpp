#include "apps/sweep/sweep.hpp"

#include "apps/base/folder_lock.hpp"
#include "apps/base/version.hpp"
#include "apps/results/results.hpp"
#include "apps/sweep/sweep_report.hpp"
#include "apps/sweep/sweep_table.hpp"
#include "apps/sweep/worker_pool.hpp"
#include "fem/base/blas_threads.hpp"
#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "fem/base/stopwatch.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <utility>

namespace flexboom {

namespace fs = std::filesystem;

namespace {

/// What HDF5 files are made of is in the memory as a whole.
constexpr double most_trajectory_bytes = 2e9;

void check_trajectories(const SweepRunner& runner, size_t runs) {
  const Scene& scene = runner.scene();
  const double bytes = static_cast<double>(sizeof(double)) * static_cast<double>(runs) *
                       static_cast<double>(runner.columns().size()) * (scene.duration / scene.output_step + 1);
  require(bytes <= most_trajectory_bytes,
          fmt::format("--trajectories: {} runs make {:.3g} GB; {:.3g} GB are allowed: choose a larger output_step, or "
                      "fewer runs",
                      runs, bytes / 1e9, most_trajectory_bytes / 1e9));
}

std::vector<Quantity> quantities_wanted(const SweepRequest& r, SweepRunner& runner) {
  constexpr size_t looked_at = 16;  // runs whose outputs may be others than those of the scene as it stands
  runner.look_for_columns(r.quantities.empty() ? 1 : looked_at);
  if (r.quantities.empty()) return default_quantities(runner.columns());
  std::vector<Quantity> quantities;
  for (const std::string& text : r.quantities)
    if (std::ranges::none_of(quantities, [&](const Quantity& q) { return q.name == text; }))
      quantities.push_back(quantity_of(text));
  check_quantities(quantities, runner.columns());
  return quantities;
}

SweepIdentity identity_of_request(const SweepRequest& r, const SceneSource& source, const SweepRunner& runner,
                                  const SweepValues& values, const std::vector<Quantity>& quantities) {
  SweepIdentity id{
      std::string(version), runner.scene().name, source.digest(), r.design, r.loads, r.trajectories, {}, r.shard};
  id.design.sample = sampling_names[static_cast<size_t>(values.sampling())];  // by default or asked for
  for (const Quantity& q : quantities) id.quantities.push_back(q.name);
  return id;
}

std::vector<size_t> runs_of_shard(const Shard& shard, size_t runs) {
  std::vector<size_t> numbers;
  for (size_t run = shard.part - 1; run < runs; run += shard.of) numbers.push_back(run);
  return numbers;
}

std::vector<size_t> lacking(const std::vector<size_t>& wanted, const std::vector<size_t>& there) {
  std::vector<size_t> missing;
  std::set_difference(wanted.begin(), wanted.end(), there.begin(), there.end(), std::back_inserter(missing));
  return missing;
}

std::string listed_runs(const std::vector<size_t>& runs) {
  constexpr size_t most = 20;
  const std::vector<size_t> first(runs.begin(),
                                  runs.begin() + static_cast<std::ptrdiff_t>(std::min(most, runs.size())));
  return fmt::format("{}{}", fmt::join(first, ", "),
                     runs.size() > most ? fmt::format(" and {} more", runs.size() - most) : "");
}

SweepEnd write_results(const fs::path& folder, const Journal& journal, SweepValues values, double seconds,
                       size_t simulated, bool report) {
  const SweepTable table(journal.identity(), std::move(values), journal.outcomes());
  SweepEnd end;
  end.summary = summary_of(table);
  end.summary["seconds"] = seconds;
  end.summary["runs_per_second"] = simulated > 0 ? nlohmann::ordered_json(static_cast<double>(simulated) / seconds)
                                                 : nlohmann::ordered_json(nullptr);
  end.failed = table.failed();
  end.interrupted = table.rows().size() < table.planned();
  write_file(folder / "sweep.csv", csv_of(table));
  const auto trajectory = [&](size_t run) { return journal.trajectory(run); };
  write_file(folder / "sweep.h5", hdf5_of(table, trajectory));
  write_file(folder / "summary.json", end.summary.dump(2) + "\n");
  if (report) write_file(folder / "report.html", sweep_report_html(table, end.summary));
  return end;
}

bool is_journal_there(const fs::path& folder) {
  std::error_code error;
  return fs::exists(folder / "sweep.sqlite", error);
}

}  // namespace

fs::path default_sweep_folder(const SweepRequest& r) {
  return fs::path("results") / (load_scene(r.scene).name + "-sweep");
}

SweepEnd run_sweep(const SweepRequest& r, const SweepProgress& progress) {
  const Stopwatch start;
  SceneSource source(r.scene);
  source.read();  // its own faults come first
  SweepValues values(r.design);
  check_variations(source, values);
  require(r.shard.part >= 1 && r.shard.part <= r.shard.of,
          fmt::format("--shard {}/{}: the first number counts from 1 to the second", r.shard.part, r.shard.of));
  require(r.resume || !is_journal_there(r.out),
          fmt::format("{} is the journal of a sweep: --resume goes on with it; or give another folder by --out",
                      (r.out / "sweep.sqlite").string()));
  // OpenMP's threads of a parent do not exist in its forked children, who would wait for them.
  const WithoutOpenMP one_thread;
  SweepRunner runner(source, values, r.loads, r.trajectories);
  const std::vector<Quantity> quantities = quantities_wanted(r, runner);
  if (r.trajectories) check_trajectories(runner, values.runs());
  prepare_folder(r.out);
  const FolderLock lock(r.out);
  Journal journal(r.out / "sweep.sqlite", identity_of_request(r, source, runner, values, quantities), r.resume);
  runner.measure(quantities);
  const std::vector<size_t> all = runs_of_shard(r.shard, values.runs()), missing = lacking(all, journal.runs());
  const size_t before = all.size() - missing.size();
  size_t simulated = 0;
  run_in_processes(
      missing, r.jobs, [&](size_t run) { return runner.run(run); },
      [&](const RunOutcome& outcome) {
        journal.add(outcome);
        progress(before + ++simulated, all.size());
      });
  return write_results(r.out, journal, std::move(values), start.seconds(), simulated, r.report);
}

SweepEnd merge_sweeps(const std::vector<fs::path>& folders, const fs::path& out, bool report) {
  const Stopwatch start;
  std::vector<std::unique_ptr<Journal>> parts;
  std::vector<size_t> all, doubled;
  for (const fs::path& folder : folders) {
    parts.push_back(std::make_unique<Journal>(folder / "sweep.sqlite"));
    require(parts.back()->identity().digest() == parts.front()->identity().digest(),
            fmt::format("--merge: {} and {} are of different sweeps", folders.front().string(), folder.string()));
    const std::vector<size_t> runs = parts.back()->runs();
    all.insert(all.end(), runs.begin(), runs.end());
  }
  std::sort(all.begin(), all.end());
  for (size_t i = 1; i < all.size(); ++i)
    if (all[i] == all[i - 1] && (doubled.empty() || doubled.back() != all[i])) doubled.push_back(all[i]);
  require(doubled.empty(), fmt::format("--merge: these runs are there more than once: {}", listed_runs(doubled)));
  SweepIdentity identity = parts.front()->identity();
  identity.shard = {};
  SweepValues values(identity.design);
  const std::vector<size_t> missing = lacking(runs_of_shard({}, values.runs()), all);
  require(missing.empty(),
          fmt::format("--merge: of {} runs these are missing: {}", values.runs(), listed_runs(missing)));
  require(!is_journal_there(out), fmt::format("{} has a sweep already; give another folder by --out", out.string()));
  prepare_folder(out);
  const FolderLock lock(out);
  Journal merged(out / "sweep.sqlite", identity, false);
  merged.add_all([&] {
    for (const auto& part : parts)
      for (RunOutcome& outcome : part->outcomes()) {
        outcome.trajectory = part->trajectory(outcome.run);
        merged.add(outcome);
      }
  });
  return write_results(out, merged, std::move(values), start.seconds(), 0, report);
}

}  // namespace flexboom
