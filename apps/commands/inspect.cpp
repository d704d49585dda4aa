#include "apps/model/reduction.hpp"
#include "reduction/body_file/body_file.hpp"
#include "reduction/invariants/certificate.hpp"

#include <fmt/format.h>

#include <algorithm>

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

}  // namespace

int inspect_command(const std::filesystem::path& file, const CommonOptions& common) {
  const ReducedBody body = read_body_file(file);
  const std::vector<BodyCheck> checks = checks_of(body);
  if (common.json) {
    fmt::print("{}\n", body_json(body, checks, {}).dump(2));
  } else if (!common.quiet) {
    fmt::print("{}", description(body, checks));
    const Provenance& p = body.provenance;
    fmt::print("made by {} ({}) from {}\noptions: {}\nmesh: {}\n", p.program, p.libraries, p.source, p.options,
               p.mesh_hash);
  }
  return std::ranges::all_of(checks, &BodyCheck::passed) ? exit_ok : exit_check_failed;
}

}  // namespace flexboom
