#include "apps/results/results.hpp"

#include "apps/base/version.hpp"
#include "apps/model/body_text.hpp"
#include "apps/model/picture.hpp"
#include "apps/simulate/tree_flight.hpp"
#include "fem/base/check.hpp"
#include "fem/formats/vtk/vtk.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <iterator>
#include <utility>

namespace flexboom {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

void prepare_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  require(!error, fmt::format("cannot make the output folder {}: {}", folder.string(), error.message()));
  const fs::path probe = folder / ".flexboom-probe";
  write_file(probe, std::string_view());
  fs::remove(probe, error);
}

void print_rows(std::ostream& out, const OutputTable& table, size_t first) {
  fmt::memory_buffer line;
  for (auto row = static_cast<Eigen::Index>(first); row < table.values.rows() && out; ++row) {
    for (Eigen::Index c = 0; c < table.values.cols(); ++c)
      fmt::format_to(std::back_inserter(line), "{:.17g}{}", table.values(row, c),
                     c + 1 < table.values.cols() ? ',' : '\n');
    out.write(line.data(), static_cast<std::streamsize>(line.size()));
    line.clear();
  }
}

std::string event_rows(const RunResult& r, size_t first) {
  const std::vector<std::string> hinges = joint_names(with_joints(r.scene));
  std::string out;
  for (size_t i = first; i < r.motion.events.size(); ++i) {
    const StopEvent& e = r.motion.events[i];
    out += fmt::format("{:.17g},{},{}\n", e.time, hinges[static_cast<size_t>(e.joint)], event_name(e));
  }
  return out;
}

namespace {

/// Errors of an output, or of all; null where they were not measured.
ordered_json parts_json(const ErrorParts& e, double total, bool measured = true) {
  ordered_json j;
  for (const auto& [name, part] : error_parts) j[std::string(name)] = e.*part;
  j["total"] = total;
  if (!measured)
    for (ordered_json& error : j) error = nullptr;
  return j;
}

ordered_json budget_json(const ErrorBudget& b) {
  ordered_json j = parts_json(b, b.total(), b.measured);
  ordered_json outputs = ordered_json::object();
  for (const OutputErrors& o : b.outputs) {
    outputs[o.name] = parts_json(o, o.total());
    if (o.is_of_its_basis()) outputs[o.name]["discretisation"] = outputs[o.name]["truncation"] = nullptr;
    outputs[o.name]["scale"] = o.scale;
    outputs[o.name]["worst_at"] = o.when;
  }
  j["worst"] = b.measured && b.worst() != nullptr ? ordered_json(b.worst()->name) : ordered_json(nullptr);
  j["outputs"] = b.measured ? outputs : ordered_json(nullptr);
  return j;
}

ordered_json checks_of_references_json(const std::vector<ReferenceCheck>& checks) {
  ordered_json all = ordered_json::array();
  for (const ReferenceCheck& c : checks) {
    ordered_json outputs = ordered_json::object();
    for (const OutputDifference& d : c.differences)
      outputs[d.name] = {{"difference", d.error}, {"scale", d.scale}, {"worst_at", d.time}};
    ordered_json check = {{"what", c.what}, {"method", c.method}, {"outputs", outputs}};
    check["missing"] = c.missing.empty() ? ordered_json(nullptr) : ordered_json(c.missing);
    all.push_back(check);
  }
  return all;
}

/// null: of a run without rows.
ordered_json energy_json(const std::optional<EnergyOfRun>& energy) {
  if (!energy) return nullptr;
  const EnergyLedger& e = energy->ledger;
  ordered_json lost = {{"damper", e.dampers}, {"structure", e.elsewhere}};
  for (size_t i = 0; i < law_losses.size(); ++i) lost[std::string(law_losses[i])] = e.laws[i];
  return {{"kinetic", energy->kinetic},
          {"potential", energy->potential},
          {"stored", {{"spring", e.springs}, {"stop", e.stops}, {"structure", e.structures}}},
          {"lost", lost},
          {"work", energy->work}};
}

ordered_json bodies_json(const RunResult& r) {
  ordered_json bodies = ordered_json::array();
  for (const PreparedBody& p : r.bodies) {
    std::vector<double> hz;
    for (const Coordinate& c : p.body.coordinates) hz.push_back(c.frequency_hz);
    bodies.push_back({{"name", p.body.name},
                      {"structure", p.body.structure},
                      {"dofs", p.dofs},
                      {"modes", p.body.n()},
                      {"frequencies_hz", hz},
                      {"mass", p.body.m}});
    if (!p.kept.empty()) bodies.back()["kept"] = fs::absolute(p.kept).string();
  }
  return bodies;
}

ordered_json checks_of_bodies(const RunResult& r) {
  ordered_json checks = ordered_json::array();
  for (const PreparedBody& p : r.bodies)
    for (ordered_json c : flexboom::checks_json(p.checks)) {
      c["name"] = p.body.name + "." + c["name"].get<std::string>();
      checks.push_back(std::move(c));
    }
  return checks;
}

}  // namespace

ordered_json summary_json(const RunResult& r, double write_seconds) {
  const IntegrationSummary& s = r.motion.summary;
  ordered_json j;
  j["scene"] = r.scene.name;
  j["version"] = version;
  j["status"] = s.interrupted ? "interrupted" : "finished";
  j["seconds"] = {{"prepare", r.prepare_seconds},
                  {"integrate", r.integrate_seconds},
                  {"write", write_seconds},
                  {"budget", r.budget_seconds},
                  {"total", r.prepare_seconds + r.integrate_seconds + write_seconds + r.budget_seconds}};
  j["steps"] = s.steps;
  j["rhs_evaluations"] = s.rhs_evaluations;
  j["jacobian_evaluations"] = s.jacobian_evaluations;
  j["factorisations"] = s.factorisations;
  j["events"] = r.motion.events.size();
  j["restarts"] = s.restarts;
  const double simulated = r.end.time - (r.scene.from ? r.scene.from->time() : 0);
  j["real_time_factor"] = simulated / std::max(r.integrate_seconds, 1e-9);
  j["interrupted"] = s.interrupted;
  j["simulated_seconds"] = simulated;
  j["integrator"] = s.method;
  if (!s.why_method.empty()) j["integrator_chosen"] = s.why_method;
  j["tolerance"] = r.scene.tolerance;
  j["energy_balance"] = s.energy_balance;
  j["energy"] = energy_json(r.ledger);
  j["momentum_drift"] = s.momentum_drift;  // unknown is null
  j["constraint_drift"] = s.constraint_drift;
  j["error_budget"] = budget_json(r.budget);
  if (!r.checks.empty()) j["reference_runs"] = checks_of_references_json(r.checks);
  j["accuracy_met"] = r.budget.measured && r.budget.within(r.scene.tolerance);
  j["plan"] = r.plan;
  j["warnings"] = r.warnings;
  j["bodies"] = bodies_json(r);
  j["invariant_checks"] = checks_of_bodies(r);
  return j;
}

void MotionFrames::add(std::pair<double, std::string> frame, double vtu_step) {
  const double t = frame.first;
  if (vtu_step > 0) next += vtu_step * std::max(1.0, std::ceil((t - next) / vtu_step + 1e-9));
  files.push_back(std::move(frame));
}

bool is_motion_frame(const std::string& name) {
  constexpr std::string_view stem = "motion_", end = ".vtu";
  return name.starts_with(stem) && name.ends_with(end) && name.size() > stem.size() + end.size() &&
         name.find_first_not_of("0123456789", stem.size()) == name.size() - end.size();
}

void write_motion(const RunResult& r, const fs::path& folder, MotionFrames& frames) {
  for (size_t i = 0; i < r.motion.time.size(); ++i) {
    const double t = r.motion.time[i];
    if (t < frames.next - 1e-9 * r.scene.vtu_step) continue;
    const std::string name = fmt::format("motion_{:05d}.vtu", frames.files.size());
    write_vtu(folder / name, picture(*r.tree, t, r.motion.y[i]));
    frames.add({t, name}, r.scene.vtu_step);
  }
  write_pvd(folder / "motion.pvd", frames.files);
}

}  // namespace flexboom
