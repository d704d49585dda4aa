#include "apps/commands/commands.hpp"
#include "apps/model/body_text.hpp"
#include "reduction/body_file/body_file.hpp"
#include "reduction/invariants/certificate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace flexboom {
namespace {

/// The certificate in the file, with what can be asked of the body itself asked again.
std::vector<BodyCheck> checks_of(const ReducedBody& body) {
  std::vector<BodyCheck> checks = body.certificate;
  for (BodyCheck& now : body_checks(body)) {
    const auto kept = std::ranges::find(checks, now.name, &BodyCheck::name);
    kept == checks.end() ? checks.push_back(std::move(now)) : void(*kept = std::move(now));
  }
  return checks;
}

/// The largest relative change of a frequency by finer elements: of modes, as they come. Empty: there are none.
std::optional<double> change_by_finer_elements(const BodyFile& file) {
  if (!file.richer.finer_elements) return {};
  const std::vector<Coordinate>&kept = file.body.coordinates, &finer = file.richer.finer_elements->coordinates;
  double change = 0;
  for (size_t k = 0; k < std::min(kept.size(), finer.size()); ++k)
    if (kept[k].frequency_hz > 0) change = std::max(change, std::abs(finer[k].frequency_hz / kept[k].frequency_hz - 1));
  return change;
}

std::string richer_text(const BodyFile& file) {
  const RicherBodies& r = file.richer;
  return fmt::format("for error estimates: {}; {}\n",
                     r.more_modes ? fmt::format("a body of {} coordinates", r.more_modes->n()) : "no more modes",
                     r.finer_elements ? fmt::format("elements of {} freedoms, which change the frequencies by {:.1e}",
                                                    r.finer_elements->full_freedoms, *change_by_finer_elements(file))
                                      : "no finer elements");
}

nlohmann::ordered_json richer_json(const BodyFile& file) {
  nlohmann::ordered_json r = {{"more_modes", nullptr}, {"finer_elements", nullptr}, {"frequency_change", nullptr}};
  if (file.richer.more_modes) r["more_modes"] = file.richer.more_modes->n();
  if (file.richer.finer_elements) r["finer_elements"] = file.richer.finer_elements->full_freedoms;
  if (const std::optional<double> change = change_by_finer_elements(file)) r["frequency_change"] = *change;
  return r;
}

}  // namespace

int inspect_command(const std::filesystem::path& path, const CommonOptions& common) {
  const BodyFile file = read_whole_body_file(path);
  const ReducedBody& body = file.body;
  const std::vector<BodyCheck> checks = checks_of(body);
  if (common.json) {
    nlohmann::ordered_json document = body_json(body, checks, {});
    document["errors"] = richer_json(file);
    fmt::print("{}\n", document.dump(2));
  } else if (!common.quiet) {
    fmt::print("{}{}", description(body, checks), richer_text(file));
    const Provenance& p = body.provenance;
    if (!p.doubts.empty()) print_note("warning: " + p.doubts);
    fmt::print("made by {} ({}) from {}\noptions: {}\nmesh: {}\n", p.program, p.libraries, p.source, p.options,
               p.mesh_hash);
  }
  return std::ranges::all_of(checks, &BodyCheck::passed) ? exit_ok : exit_check_failed;
}

}  // namespace flexboom
