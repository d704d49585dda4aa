#include "apps/base/usage.hpp"
#include "apps/commands/commands.hpp"
#include "apps/model/body_text.hpp"
#include "fem/base/check.hpp"
#include "reduction/body_file/body_file.hpp"
#include "reduction/exports/exports.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace flexboom {

int export_command(const ExportArguments& a, const CommonOptions& common) {
  ExportOptions options;
  for (const std::string& text : a.settings) {
    const size_t equals = text.find('=');
    require_usage(equals != std::string::npos, fmt::format("--set: '{}' must be NAME=VALUE", text));
    options.settings[text.substr(0, equals)] = text.substr(equals + 1);
  }
  require_not_replaced(a.body, a.path);
  const ReducedBody body = read_body_file(a.body);
  const ExportReport report = export_body(body, a.format, options, a.path);
  const bool passed = std::ranges::all_of(report.checks, &BodyCheck::passed);
  if (common.json) {
    const nlohmann::ordered_json j = {{"file", a.path.string()},
                                      {"format", a.format},
                                      {"cannot_hold", report.cannot_hold},
                                      {"doubts", body.provenance.doubts},
                                      {"checks", checks_json(report.checks)},
                                      {"passed", passed}};
    fmt::print("{}\n", j.dump(2));
  } else if (!common.quiet) {
    if (!body.provenance.doubts.empty()) print_note("warning: " + body.provenance.doubts);
    for (const std::string& sentence : report.cannot_hold) print_note("note: " + sentence);
    fmt::print("{}{}\n", checks_text(report.checks), a.path.string());
  }
  return passed ? exit_ok : exit_check_failed;
}

}  // namespace flexboom
