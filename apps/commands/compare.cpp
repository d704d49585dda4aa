#include "apps/accuracy/compare.hpp"
#include "apps/base/toml_reader.hpp"
#include "apps/commands/commands.hpp"
#include "apps/commands/terminal_line.hpp"
#include "apps/scene/scene_keys.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <optional>

namespace flexboom {

using nlohmann::ordered_json;

bool is_body_file(const std::string& path) {
  std::error_code ignored;  // of the name of a built-in scene
  return std::filesystem::is_regular_file(path, ignored) &&
         toml_reader::format_of(toml_reader::read_text(path)) == scene_keys::body_format;
}

namespace {

void print_orders(const BodyComparison& c, int count, int elements) {
  fmt::print("{}: Euler-Bernoulli elements without rotary inertia against eq. 14, modes 1-{}, {} elements\n", c.name,
             count, elements);
  fmt::print("  {:>5} {:>9} {:>9} {:>11} {:>11} {:>11} {:>11}\n", "order", "unknowns", "time [s]", "frequency",
             "subspace", "Ct", "Cr");
  for (const OrderComparison& o : c.orders)
    fmt::print("  {:5} {:9} {:9.4f} {:11.2e} {:11.2e} {:11.2e} {:11.2e}\n", o.order, o.dofs, o.seconds, o.frequency,
               o.subspace, o.Ct, o.Cr);
}

void print_theory(const BodyComparison& c) {
  fmt::print("{}: what eq. 14 leaves out, share of the frequency\n", c.name);
  fmt::print("  {:>4} {:>16} {:>16} {:>13} {:>16} {:>13}\n", "mode", "eq. 14 [Hz]", "+ rotary [Hz]", "by rotary",
             "+ shear [Hz]", "by shear");
  for (size_t k = 0; k < c.modes.size(); ++k) {
    const TheoryComparison& t = c.modes[k];
    fmt::print("  {:4} {:16.8f} {:16.8f} {:13.3e} {:16.8f} {:13.3e}\n", k + 1, t.eq14, t.rotary, t.rotary / t.eq14 - 1,
               t.shear, (t.shear - t.rotary) / t.eq14);
  }
}

void print_transients(const std::vector<TransientComparison>& all) {
  fmt::print("transient against eq. 14, largest difference over time / largest value:\n  {:22}", "output");
  for (const TransientComparison& c : all) fmt::print(" {:>36}", c.model);
  for (size_t i = 0; i < all.front().differences.size(); ++i) {
    fmt::print("\n  {:22}", all.front().differences[i].name);
    for (const TransientComparison& c : all) fmt::print(" {:36.3e}", c.differences[i].error);
  }
  fmt::print("\n");
}

ordered_json to_json(const std::vector<BodyComparison>& bodies, const std::vector<TransientComparison>& transients,
                     bool passed) {
  ordered_json j = {{"passed", passed}, {"bodies", ordered_json::array()}, {"transients", ordered_json::array()}};
  for (const BodyComparison& c : bodies) {
    ordered_json b = {{"name", c.name}, {"orders", ordered_json::array()}, {"modes", ordered_json::array()}};
    for (const OrderComparison& o : c.orders)
      b["orders"].push_back({{"order", o.order},
                             {"dofs", o.dofs},
                             {"seconds", o.seconds},
                             {"frequency", o.frequency},
                             {"subspace", o.subspace},
                             {"Ct", o.Ct},
                             {"Cr", o.Cr}});
    for (const TheoryComparison& t : c.modes)
      b["modes"].push_back({{"eq14_hz", t.eq14}, {"rotary_hz", t.rotary}, {"shear_hz", t.shear}});
    j["bodies"].push_back(b);
  }
  for (const TransientComparison& c : transients) {
    ordered_json t = {{"model", c.model}};
    for (const OutputDifference& d : c.differences) t["differences"][d.name] = d.error;
    j["transients"].push_back(t);
  }
  return j;
}

}  // namespace

int compare_command(const CompareArguments& a, const CommonOptions& common) {
  std::vector<BodyScene> bodies;
  std::vector<TransientComparison> transients;
  std::optional<WorkLine> progress(std::in_place, !common.quiet && !common.json, "compare");
  if (is_body_file(a.body)) {
    bodies.push_back(read_body(a.body));
  } else {
    const Scene scene = load_scene(a.body);
    std::string without;
    for (const BodyScene& b : scene.bodies) {
      const std::string why = not_comparable(b);
      if (why.empty())
        bodies.push_back(b);
      else
        without += "\n  " + why;
    }
    require(!bodies.empty(), fmt::format("{}: no body can be compared with eq. 14:{}", a.body, without));
    if (!a.no_transient) transients = compare_transients(scene);
  }
  std::vector<BodyComparison> compared;
  compared.reserve(bodies.size());
  for (const BodyScene& b : bodies) compared.push_back(compare_with_eq14(b, a.count, a.elements));
  progress.reset();
  // The finest row is judged: the coarser ones show how the error falls.
  const bool passed = std::all_of(compared.begin(), compared.end(),
                                  [&](const BodyComparison& c) { return c.orders.back().largest() <= a.tolerance; });
  if (common.json) {
    fmt::print("{}\n", to_json(compared, transients, passed).dump(2));
  } else if (!common.quiet) {
    for (const BodyComparison& c : compared) print_orders(c, a.count, a.elements);
    for (const BodyComparison& c : compared) print_theory(c);
    if (!transients.empty()) print_transients(transients);
  }
  if (passed) return exit_ok;
  if (!common.quiet) print_note(fmt::format("the highest order is outside the tolerance {:g}", a.tolerance));
  return exit_check_failed;
}

}  // namespace flexboom
