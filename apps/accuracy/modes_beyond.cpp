#include "apps/accuracy/modes_beyond.hpp"

#include "apps/model/prepared_body.hpp"
#include "apps/model/static_shapes.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace flexboom {

namespace {

constexpr int most_beyond = 64, most_for_tones = 128;  // modes of a body

/// Of the modes of a body, in their order [rad/s].
std::vector<double> frequencies(const PreparedBody& p) {
  std::vector<double> w;
  for (int k = 0; k < p.coordinates_of_modes(); ++k) w.push_back(p.body.frequency(k));
  return w;
}

/// The frequencies of the modes of a body: the lowest, and up to which it has all [rad/s].
struct Span {
  double lowest = 0, highest = 0;

  /// How far the modes must reach for the drives of their scene, where they do not show these [rad/s]; else 0.
  double wanted(const DriveSpectra& drives) const {
    return highest > 0 ? beyond_a_tone * drives.fastest_beyond(lowest, highest / beyond_a_tone) : 0;
  }
};

Span span_of(BodyScene b, const std::filesystem::path& keep, const RunHooks& hooks) {
  const std::vector<int> kept = std::exchange(b.shapes, {});
  const std::vector<double> w = frequencies(prepared(b, 0, keep, hooks));
  if (w.empty()) return {};
  Span span{std::ranges::min(w), std::ranges::max(w)};
  for (size_t k = 0; k < w.size() && !kept.empty(); ++k)
    if (std::ranges::find(kept, static_cast<int>(k) + 1) == kept.end()) span.highest = std::min(span.highest, w[k]);
  return span;
}

std::map<std::string, int> kinds_of(const PreparedBody& p) {
  std::map<std::string, int> kinds;
  for (int k = 0; k < p.coordinates_of_modes(); ++k) ++kinds[p.body.coordinates[static_cast<size_t>(k)].kind];
  return kinds;
}

/// Where the modes of a body are among all that bend in either plane, twist or stretch it. `whole` is the body with all
/// shapes of its directions, `all` with those of all directions. The n-th of a kind here is the n-th of it there.
std::vector<int> places_of(const BodyScene& b, const PreparedBody& whole, const PreparedBody& all) {
  std::map<std::string, std::vector<int>> of_kind;
  for (const Coordinate& c : all.body.coordinates)
    of_kind[c.kind].push_back(static_cast<int>(&c - all.body.coordinates.data()) + 1);
  std::map<std::string, size_t> count;
  std::vector<int> places;
  for (int k = 1; k <= whole.body.n(); ++k) {
    const std::string& kind = whole.body.coordinates[static_cast<size_t>(k) - 1].kind;
    const size_t n = count[kind]++;
    const bool is_own = b.shapes.empty() || std::ranges::find(b.shapes, k) != b.shapes.end();
    if (is_own && n < of_kind[kind].size()) places.push_back(of_kind[kind][n]);
  }
  return places;
}

/// So many modes at least go up to a frequency where the first `modes` go up to another. In no kind are there fewer
/// modes of higher frequencies than in bending, where these rise with the square of their number.
int modes_up_to(double reach, int modes, double highest) {
  return highest > 0 && highest < reach ? static_cast<int>(modes * std::sqrt(reach / highest)) : modes;
}

/// The lowest modes of all directions: the `highest` that is kept, and enough beyond those of each kind in `kinds`.
/// Those of beams go on until some stretch and some twist; where none do, static shapes stand for them. They go on to
/// the frequency `reach`, too. What lies beyond `resolved` the elements do not know.
BodyScene with_modes_beyond(BodyScene b, int highest, int resolved, const ModesBeyond& more,
                            const std::map<std::string, int>& kinds, double reach, const std::filesystem::path& keep,
                            const RunHooks& hooks) {
  b.shapes.clear();
  b.directions = "all";
  const int most = reach > 0 ? most_for_tones : most_beyond;
  for (int beside = 2 * more.of(0);;) {
    const int wanted = std::max(highest, std::min(highest + beside, resolved));
    b = with_modes(std::move(b), wanted, keep, hooks);
    const PreparedBody all = prepared(b, 0, keep, hooks);
    std::map<std::string, int> count = kinds_of(all);
    const std::vector<double> w = frequencies(all);
    const double last = w.empty() ? 0 : std::ranges::max(w);
    const bool enough = last >= reach && std::ranges::all_of(kinds, [&](const auto& k) {
                          return count[k.first] >= k.second + more.of(k.second);
                        });
    const std::vector<std::string> statics = static_shapes_beside(all.body, b.clamp);
    const bool has_more = b.modes == wanted && wanted < std::min(highest + most, resolved);
    if (!has_more || (enough && (b.structure != "beam" || statics.empty()))) return with_static_shapes(b, statics);
    beside = std::min(std::max(2 * beside, modes_up_to(reach, b.modes, last) - highest), most);
  }
}

/// Its own modes and the lowest beside them: half as many of kinds that it has not, and all up to the frequency
/// `reach`.
BodyScene with_more_of_each_kind(const BodyScene& b, const ModesBeyond& more, double reach,
                                 const std::filesystem::path& keep, const RunHooks& hooks) {
  const bool in_plane = b.directions != "all";
  BodyScene own = b;
  own.shapes.clear();
  const std::map<std::string, int> kinds = kinds_of(prepared(b, 0, keep, hooks));
  const PreparedBody whole = prepared(own, 0, keep, hooks);
  const int dofs = b.modes > 0 ? whole.dofs : prepared(with_modes(own, 2, keep, hooks), 0, keep, hooks).dofs;
  const int resolved = dofs > 0 ? dofs / 2 : std::numeric_limits<int>::max();  // a closed form has all
  BodyScene richer = with_modes_beyond(b, in_plane ? 2 * b.modes : b.modes, resolved, more, kinds, reach, keep, hooks);
  const PreparedBody all = prepared(richer, 0, keep, hooks);
  const std::vector<int> places = places_of(b, whole, all);
  std::map<std::string, int> beside;
  const std::vector<double> w = frequencies(all);
  for (int k = 1; k <= all.coordinates_of_modes(); ++k) {
    const std::string& kind = all.body.coordinates[static_cast<size_t>(k) - 1].kind;
    const auto own_kind = kinds.find(kind);
    const int of_kind = own_kind != kinds.end() ? more.of(own_kind->second)
                        : kinds.empty()         ? more.of(0)
                                                : more.of(0) / 2;
    const bool is_next = std::ranges::find(places, k) != places.end() || ++beside[kind] <= of_kind;
    if (is_next || w[static_cast<size_t>(k) - 1] <= reach) richer.shapes.push_back(k);
  }
  return richer;
}

}  // namespace

BodyScene with_modes(BodyScene b, int wanted, const std::filesystem::path& keep, const RunHooks& hooks) {
  b.shapes.clear();
  for (b.modes = wanted; b.modes > 2;) {
    try {
      prepared(b, 0, keep, hooks);
      break;
    } catch (const InputError&) {  // that is another fault where two modes have it, too
      b.modes -= 2;
    } catch (const NumericalError&) {  // nearly all modes of the elements: the last are beyond any solver
      b.modes -= std::max(2, b.modes / 4);
    }
  }
  b.modes = std::max(b.modes, std::min(wanted, 2));
  return b;
}

namespace {

/// The first modes of a basis that is whole, in all directions: up to the frequency `reach`, if there are so many.
BodyScene with_more_of_whole(const BodyScene& b, const ModesBeyond& more, double reach,
                             const std::filesystem::path& keep, const RunHooks& hooks) {
  const int per_plane = b.directions == "all" ? (b.modes + 1) / 2 : b.modes;
  BodyScene richer = b;
  richer.directions = "all";
  richer.shapes.clear();
  for (int beside = more.of(per_plane);; beside *= 2) {
    const int wanted = richer.modes = 2 * (per_plane + beside);
    if (reach == 0) return richer;
    richer = with_modes(std::move(richer), wanted, keep, hooks);
    const bool is_last = richer.modes < wanted || 2 * beside >= most_for_tones;
    if (is_last || std::ranges::max(frequencies(prepared(richer, 0, keep, hooks))) >= reach) return richer;
  }
}

/// That body with modes that stretch and twist it, which come late. Where there are none among many, static shapes of
/// loads at the free end stand for them. @throws InputError where these are coordinates of the basis itself, whose
/// error they do not show.
BodyScene with_stretching(const BodyScene& richer, const BodyScene& b, const std::filesystem::path& keep,
                          const RunHooks& hooks) {
  if (b.structure != "beam" && b.structure != "solid") return richer;
  const PreparedBody kept = prepared(b, 0, keep, hooks), base = prepared(richer, 0, keep, hooks);
  const bool is_nested = b.basis.name != "hinge";  // coordinates of fewer modes are among those of more
  for (const int beside : modes_searched) {
    const BodyScene longer = with_modes(richer, richer.modes + beside, keep, hooks);
    if (!is_nested || longer.modes < richer.modes + beside) break;
    BodyScene found = longer;
    found.shapes = first_and_stretching(prepared(longer, 0, keep, hooks).body, base.coordinates_of_modes(), kept.body);
    if (!found.shapes.empty()) return found;
  }
  const std::vector<std::string> statics = static_shapes_beside(base.body, b.clamp);
  for (const std::string& shape : statics)
    if (is_interface(b, shape.substr(0, shape.rfind('.'))))
      throw InputError(
          fmt::format("body {} of basis \"{}\" has no more modes that stretch or twist it among {} beyond its own",
                      b.name, b.basis.name, richer.modes - b.modes + modes_searched.back()));
  return with_static_shapes(richer, statics);
}

/// A boom with more modes, up to the frequency `reach` at least, if there are so many.
BodyScene with_more_modes(const BodyScene& b, const ModesBeyond& more, double reach, const std::filesystem::path& keep,
                          const RunHooks& hooks) {
  if (b.basis.name == "clamped") return with_more_of_each_kind(b, more, reach, keep, hooks);
  return with_stretching(with_more_of_whole(b, more, reach, keep, hooks), b, keep, hooks);
}

/// A body from a file has the modes beyond its own that are there.
BodyScene with_modes_of_its_file(BodyScene b) {
  if (!b.richer || !b.richer->more_modes) return b;
  b.reduced = {b.richer, &*b.richer->more_modes};
  b.richer = nullptr;  // of those modes there is nothing finer
  return b;
}

/// 0: it has none.
double reach_of(const BodyScene& b, const Reach& reach) {
  const auto of_body = reach.find(b.name);
  return of_body != reach.end() ? of_body->second : 0;
}

}  // namespace

Reach reach_of_drives(const Scene& scene, const ModesBeyond& more, const DriveSpectra& drives, const RunHooks& hooks) {
  Reach reach;
  if (drives.empty()) return reach;
  for (const BodyScene& b : scene.bodies) {
    if (!b.is_flexible() || !b.is_boom()) continue;
    const BodyScene shown = with_more_modes(b, more, 0, scene.bodies_kept_in, hooks);
    if (const double wanted = span_of(shown, scene.bodies_kept_in, hooks).wanted(drives); wanted > 0)
      reach[b.name] = wanted;
  }
  return reach;
}

ShakenModes shaken_modes(const Scene& flown, const SimulatedMotion& run, const ModesBeyond& more, const Reach& reach,
                         const RunHooks& hooks) {
  const double all = beyond_a_tone * fastest_motion(run);
  const auto richer = [&](const BodyScene& b, double to) {
    return b.is_boom() ? with_more_modes(b, more, to, flown.bodies_kept_in, hooks) : with_modes_of_its_file(b);
  };
  std::map<std::string, double> shown;  // up to which frequency, of bodies that have modes beyond [rad/s]
  double lowest = all;
  for (const BodyScene& b : flown.bodies) {
    if (!b.is_flexible()) continue;
    const double highest = span_of(richer(b, reach_of(b, reach)), flown.bodies_kept_in, hooks).highest;
    if (highest > 0 && highest < all) shown[b.name] = highest, lowest = std::min(lowest, highest);
  }
  if (shown.empty()) return {};
  const MotionSpectra motion(flown, run, lowest / beyond_a_tone, hooks);
  ShakenModes shaken;
  for (BodyScene b : flown.bodies) {
    const auto highest = shown.find(b.name);
    if (highest == shown.end()) continue;
    b.stiffening.clear();  // it is not flown
    shaken[b.name] =
        motion.shaken_beyond(prepared(richer(b, all), 0, flown.bodies_kept_in, hooks).body, highest->second);
  }
  return shaken;
}

bool any_counts(const ShakenModes& shaken, double least) { return !with_shaken({}, shaken, least).empty(); }

Reach with_shaken(Reach reach, const ShakenModes& shaken, double least) {
  constexpr double other_elements = 1.01;  // place the mode itself a little higher, if only by round-off
  for (const auto& [body, modes] : shaken)
    for (const ShakenMode& mode : modes)
      if (mode.effect > least) reach[body] = std::max(reach[body], other_elements * mode.frequency);
  return reach;
}

Scene with_more_modes(Scene scene, const ModesBeyond& more, const Reach& reach_of_bodies, const RunHooks& hooks) {
  for (BodyScene& b : scene.bodies) {
    b = with_modes_of_its_file(std::move(b));
    if (!b.is_flexible() || !b.is_boom()) continue;
    const double reach = reach_of(b, reach_of_bodies);
    if (reach > 0 && b.structure == "beam") b.geometry = refined(b.geometry, 2);  // a resonance needs its frequency
    b = with_more_modes(b, more, reach, scene.bodies_kept_in, hooks);
    b = with_static_shapes(b, static_shapes_of_loads(scene, b));
  }
  return scene;
}

void require_drives_shown(const Scene& scene, const DriveSpectra& drives, const RunHooks& hooks) {
  if (drives.empty()) return;
  for (const BodyScene& b : scene.bodies) {
    if (!b.is_flexible()) continue;
    const Span span = span_of(b, scene.bodies_kept_in, hooks);
    const double tone = span.wanted(drives) / beyond_a_tone;
    if (tone > 0)
      throw InputError(
          fmt::format("a function of time moves vibrations of body {} at up to {:.4g} rad/s, which takes modes up to "
                      "{:.4g} rad/s to show, and those that are tried end at {:.4g} rad/s",
                      b.name, tone, beyond_a_tone * tone, span.highest));
  }
}

void require_reached(const Scene& scene, const Reach& reach, const RunHooks& hooks) {
  constexpr double round_off = 1e-6;  // finer elements have lower frequencies
  for (const BodyScene& b : scene.bodies) {
    const double wanted = reach_of(b, reach);
    if (wanted == 0) continue;
    const Span span = span_of(b, scene.bodies_kept_in, hooks);
    if (wanted > (1 + round_off) * span.highest)
      throw InputError(
          fmt::format("the motion shakes vibrations of body {} that take modes up to {:.4g} rad/s to show, and those "
                      "that are tried end at {:.4g} rad/s",
                      b.name, wanted, span.highest));
  }
}

Scene without_kinds(Scene scene, const StillKinds& still, const RunHooks& hooks) {
  for (BodyScene& b : scene.bodies) {
    const auto kinds = still.find(b.name);
    if (kinds == still.end() || kinds->second.empty()) continue;
    const PreparedBody p = prepared(b, 0, scene.bodies_kept_in, hooks);
    std::vector<int> moving;
    const auto modes = static_cast<size_t>(p.coordinates_of_modes());
    for (size_t k = 0; k < modes; ++k)
      if (!kinds->second.contains(p.body.coordinates[k].kind))
        moving.push_back(p.shapes.empty() ? static_cast<int>(k) + 1 : p.shapes[k]);
    if (moving.size() == modes) continue;
    b.shapes = std::move(moving);
    if (b.shapes.empty()) b.modes = 0;
  }
  return scene;
}

}  // namespace flexboom
