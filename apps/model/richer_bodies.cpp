// Bodies of one model that leave less out than the one that is kept, for error estimates.

#include "apps/model/richer_bodies.hpp"

#include "apps/model/bounded_modes.hpp"
#include "apps/model/static_shapes.hpp"
#include "fem/base/check.hpp"
#include "fem/base/text_reader.hpp"
#include "reduction/basis/mode_selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace flexboom {
namespace {

/// Without what a flight in comparison does not look at.
ReducedBody for_comparison(Model model, const ReductionOptions& o, int threads) {
  ReductionSeconds seconds;
  ReducedBody body = make_reduced_body(model, o, threads, seconds);
  body.display = {};
  return body;
}

/// Static shapes of the loads at every marker that moves and is no interface; of more than a few markers none, for each
/// takes six shapes.
std::vector<std::string> static_shapes_of_markers(const Model& model, const ReductionOptions& o,
                                                  const ReducedBody& kept) {
  constexpr size_t few = 4;
  std::vector<std::string> places;
  const auto is_wanted = [&](const std::string& name) {
    return o.loads_at.empty() ||
           std::ranges::any_of(o.loads_at, [&](const std::string& set) { return same_but_case(set, name); });
  };
  for (const Marker& m : kept.markers)
    if (model.mesh.node_sets.contains(m.name) && can_load(kept, m.name) && is_wanted(m.name)) places.push_back(m.name);
  return places.size() > few ? std::vector<std::string>{} : static_shapes_at(places);
}

/// Interfaces hold the static shapes of their loads, and of what stretches a body between them no more. `richer`: with
/// more modes, here with those that stretch and twist it. Empty where there are none among many.
std::optional<ReducedBody> with_stretching(const Model& model, ReductionOptions o, const ReducedBody& richer,
                                           const ReducedBody& kept, int threads) {
  const auto attachments = std::ranges::count(richer.coordinates, "attachment", &Coordinate::kind);
  const int first = richer.n() - static_cast<int>(attachments), given = o.basis.modes;
  try {
    for (const int beside : modes_searched) {
      o.basis.modes = given + beside;
      const ReducedBody all = beside == 0 ? richer : for_comparison(model, o, threads);
      std::vector<int> list = first_and_stretching(all, first, kept);
      if (list.empty()) continue;
      for (int& k : list) --k;
      for (int k = all.n() - static_cast<int>(attachments); k < all.n(); ++k) list.push_back(k);
      return selected(all, list);
    }
  } catch (const std::runtime_error&) {  // it has not so many
  }
  return {};
}

/// With as many more modes as the elements have, eight at most. Where the hinge lets them be told apart, modes of all
/// directions stand beside those of a plane.
std::optional<ReducedBody> with_more_modes(const Model& model, ReductionOptions o, const ReducedBody& kept,
                                           int threads) {
  o.select.reset();
  const int given = o.basis.modes;
  const auto richer = [&](bool in_plane) -> std::optional<ReducedBody> {
    o.basis.in_plane = in_plane;
    for (int more = 8; more >= 0; more -= 2) {
      o.basis.modes = given + (o.basis.name == "hinge" ? more / 2 : more);
      try {
        ReducedBody body = for_comparison(model, o, threads);
        if (body.n() <= kept.n()) return {};
        if (o.basis.name == "craig-bampton") return with_stretching(model, o, body, kept, threads);
        return body;
      } catch (const std::runtime_error&) {  // it has not so many
      }
    }
    return {};
  };
  const bool in_plane = o.basis.in_plane;
  const std::vector<std::string> shapes = static_shapes_of_markers(model, o, kept), own = o.basis.corrections;
  add_static_shapes(o.basis.corrections, shapes);
  if (std::optional<ReducedBody> all = richer(false)) return all;
  o.basis.corrections = own;  // a node set of one node of a solid bears no torque
  if (!shapes.empty())
    if (std::optional<ReducedBody> all = richer(false)) return all;
  return in_plane ? richer(true) : std::nullopt;
}

}  // namespace

RicherBodies richer_bodies(const Model& model, const ReductionOptions& options, const ReducedBody& kept,
                           const std::string& errors, int threads, std::vector<std::string>& notes) {
  RicherBodies r;
  if (errors == "none") return r;
  ReductionOptions o = options;
  o.certified = false;
  r.more_modes = with_more_modes(model, o, kept, threads);
  if (!r.more_modes)
    notes.emplace_back("no more modes are kept for error estimates: the elements have no more that show it");
  if (errors != "all") return r;
  try {
    if (const std::optional<Model> finer = refined_if_bearable(model, 1)) {
      r.finer_elements = for_comparison(*finer, o, threads);
      r.error_per_change = 1 / (1 - slowest_fall(*model.body));
    } else {
      notes.emplace_back("no finer elements are kept for error estimates: they would be too many");
    }
  } catch (const std::runtime_error& e) {
    notes.push_back(fmt::format("no finer elements are kept for error estimates: {}", e.what()));
  }
  return r;
}

}  // namespace flexboom
