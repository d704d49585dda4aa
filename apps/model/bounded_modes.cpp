// Bounds of discretisation errors: the mesh of a model beside finer ones of the same boom.

#include "apps/model/bounded_modes.hpp"
#include "apps/model/mesh_tuning.hpp"

#include "dynamics/events/flight.hpp"
#include "fem/base/check.hpp"
#include "fem/base/stopwatch.hpp"
#include "fem/booms/solid_boom.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <variant>

namespace flexboom {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double unresolved = 0.1;                       // change of a frequency
constexpr double round_off = 1e-12;                      // of a frequency by any mesh
constexpr int most_steps = 3;                            // to finer meshes
constexpr double usual_fall = 0.5, singular_fall = 0.7;  // of errors, to the next mesh
constexpr double taper_fall = 0.95;                      // of beams whose stiffness changes much within one of them
constexpr double coarse_fall = 0.8;  // of elements that are too few for the edges of the clamp, where errors gather

bool is_solid(const Model& model) { return model.body && model.body->structure == "solid"; }

/// Has the file any say in the sizes of elements?
bool has_given_sizes(const SolidGrading& g) {
  return g.sectors != 0 || g.rings != 0 || g.long_elements != 0 || g.end_layers >= 0 || g.first_layer != 0 ||
         g.growth != 0 || g.corner_levels >= 0 || g.factor != 0 || g.edge_levels >= 0;
}

/// Is the mesh of a solid boom left to the program? It is where only the accuracy of hexahedra is given.
bool follows_accuracy(const BodyScene& body) {
  const SolidOptions& s = body.solid;
  return body.structure == "solid" && s.element == "hex" && s.order == 0 && !has_given_sizes(s.grading);
}

/// Of errors of one section's meshes; `own`: of the program's choice. Re-entrant edges along the boom are singular, and
/// a step makes no more cuts toward them.
double slowest_fall(const SectionShape& section, bool own) {
  constexpr double round_bar = 0.25, tube = 0.4, rectangle = 0.35;
  if (std::holds_alternative<RectangularTube>(section)) return singular_fall;
  if (own && std::holds_alternative<RoundBar>(section)) return round_bar;
  if (own && std::holds_alternative<Tube>(section)) return tube;
  constexpr double strip = 4;  // width by height
  const auto* r = std::get_if<Rectangle>(&section);
  const bool is_compact = r != nullptr && std::max(r->height, r->width) < strip * std::min(r->height, r->width);
  return own && is_compact ? rectangle : usual_fall;
}

/// Where the material changes, the rim of the surface between the two is singular.
bool changes_material(const BeamGeometry& g) {
  return std::ranges::adjacent_find(g.segments, [](const BeamSegment& a, const BeamSegment& b) {
           return a.material.E != b.material.E || a.material.nu != b.material.nu;
         }) != g.segments.end();
}

/// Is an element of beams much stiffer at one end? Errors gather at the thin end, and fall slowly until elements are
/// short beside the distance to where there would be nothing left.
bool is_steep(const BeamProperty& p) {
  constexpr double steep = 27;  // for depths that change to a third
  const Section a = section_of(p.start, p.material.nu, p.shear), b = section_of(p.end, p.material.nu, p.shear);
  return std::ranges::any_of(std::array{&Section::Iy, &Section::Iz, &Section::J}, [&](double Section::*stiffness) {
    return std::max(a.*stiffness, b.*stiffness) > steep * std::min(a.*stiffness, b.*stiffness);
  });
}

BoundedModes modes_of(Model model, const EigenOptions& options, int threads) {
  BoundedModes r;
  Stopwatch clock;
  r.assembly = assemble(model.mesh, threads);
  r.assemble_seconds = clock.lap();
  r.basis = clamped_modes_releasing(model.mesh, r.assembly, model.clamp, options, threads);
  r.modes_seconds = clock.lap();
  if (is_solid(model)) r.accuracy = model.body->solid.accuracy;
  r.model = std::move(model);
  return r;
}

double seconds_of(const BoundedModes& m) { return m.mesh_seconds + m.assemble_seconds + m.modes_seconds; }

/// The same boom on a mesh that is `steps` finer. Empty: there is none, or it is too large.
std::optional<BoundedModes> finer(const Model& model, int steps, const EigenOptions& options, int threads) {
  Stopwatch clock;
  try {
    std::optional<Model> next = refined_if_bearable(model, steps);
    if (!next) return {};
    const double mesh_seconds = clock.seconds();
    BoundedModes r = modes_of(*std::move(next), options, threads);
    r.mesh_seconds = mesh_seconds;
    return r;
  } catch (const InputError&) {
    return {};
  }
}

/// Bounds of `m` where `share` of its error, or more, is its change to the other mesh. The k-th frequency of one mesh
/// and the k-th of another, in ascending order, approach the same limit. Behind a frequency that is not resolved they
/// may not. A change of a solid that is fifty times smaller than the largest of its kind, or a thousand times smaller
/// than that of any, is small by accident.
FrequencyBounds bounds_of(const BoundedModes& of, const ModalBasis& other, double share) {
  const ModalBasis& m = of.basis;
  FrequencyBounds r{VectorXd::Constant(m.omega.size(), unknown), "from the next finer mesh"};
  const Index first = m.rigid_freedoms, n = std::min(m.omega.size(), other.omega.size()) - first;
  if (n <= 0) return r;
  const Eigen::ArrayXd change = (m.omega.segment(first, n).array() / other.omega.segment(first, n).array() - 1).abs();
  Index resolved = 0;
  while (resolved < n && change[resolved] < unresolved && m.round_off[first + resolved] < unresolved) ++resolved;
  if (resolved == 0) return r;
  const auto kind = [&](Index k) { return m.kind[static_cast<size_t>(first + k)]; };
  for (Index k = 0; k < resolved; ++k) {
    double least = 0;
    for (Index of_other = 0; is_solid(of.model) && of_other < resolved; ++of_other)
      least = std::max(least, change[of_other] / (kind(of_other) == kind(k) ? 50 : 1000));
    r.relative[first + k] =
        std::max(change[k], least) / share + m.summary.residual_max + m.round_off[first + k] + round_off;
  }
  return r;
}

double worst(const BoundedModes& m) { return m.bounds.worst(m.basis.rigid_freedoms); }

/// Of a mesh and the finer one that it is compared with. Three steps of beams cost little, and leave their errors next
/// to nothing: the bound is the error itself, though their modes come in another order, or errors fall slowly at first.
int steps_between(const Model& model) {
  if (is_solid(model)) return 1;
  return std::clamp((highest_beam_order - model.body->geometry.order) / 2, 1, 3);
}

/// How far to go on to finer meshes.
struct Steps {
  int most = 0;
  std::optional<double>
      hope{};  // largest bound from which to go on, in accuracies; none: from any, and from an unknown
};

/// Goes on to finer meshes until the accuracy is met. Where there is not one, or no hope in it, the bounds are from the
/// mesh one step coarser.
BoundedModes climb(BoundedModes here, Steps allowed, double fall, const EigenOptions& options, int threads) {
  const Model start = here.model;
  const int between = steps_between(start);
  const auto bound_by_coarser = [fall](BoundedModes& m, const BoundedModes& coarser, double seconds) {
    m.bounds = bounds_of(m, coarser.basis, (1 - fall) / fall);
    m.bounds.how = "from the mesh one step coarser";
    m.bound_seconds += seconds + seconds_of(coarser);
  };
  for (int steps = 0;; ++steps) {
    std::optional<BoundedModes> next = finer(start, steps + between, options, threads);
    if (!next) {
      const std::optional<BoundedModes> coarser = steps == 0 ? finer(start, -1, options, threads) : std::nullopt;
      if (coarser) bound_by_coarser(here, *coarser, 0);
      return here;
    }
    here.bounds = bounds_of(here, next->basis, 1 - std::pow(fall, between));
    if (here.met() == true || steps == allowed.most) {
      here.bound_seconds += seconds_of(*next);
      return here;
    }
    bound_by_coarser(*next, here, here.bound_seconds);
    here = *std::move(next);
    const bool is_hopeless = allowed.hope && !(worst(here) <= *allowed.hope * *here.accuracy);
    if (here.met() == true || is_hopeless) return here;
  }
}

}  // namespace

bool tapers_steeply(const BeamGeometry& boom) { return std::ranges::any_of(make_mesh(boom).beam_properties, is_steep); }

double slowest_fall(const BodyScene& body) {
  if (body.structure != "solid") return tapers_steeply(body.geometry) ? taper_fall : usual_fall;
  if (body.solid.slit > 0) return singular_fall;
  const bool own = follows_accuracy(body);
  double slowest = 0;
  for (const BeamSegment& s : body.geometry.segments)
    slowest = std::max({slowest, slowest_fall(s.start, own), slowest_fall(s.end, own)});
  if (changes_material(body.geometry)) slowest = std::max(slowest, usual_fall);
  return has_given_sizes(body.solid.grading) ? std::max(slowest, coarse_fall) : slowest;
}

double FrequencyBounds::worst(int rigid_freedoms) const {
  double r = 0;
  for (Index k = rigid_freedoms; k < relative.size(); ++k) {
    if (std::isnan(relative[k])) return unknown;
    r = std::max(relative[k], r);
  }
  return r;
}

std::optional<bool> BoundedModes::met() const {
  if (!accuracy) return {};
  return bounds.worst(basis.rigid_freedoms) <= *accuracy;
}

BoundedModes bounded_modes(Model model, const EigenOptions& options, int threads) {
  const bool refine = model.body && follows_accuracy(*model.body);
  BoundedModes first = modes_of(std::move(model), options, threads);
  first.bounds.relative = VectorXd::Constant(first.basis.omega.size(), unknown);
  first.bounds.how = "a mesh file has no finer mesh to be compared with";
  if (!first.model.body) return first;
  first.bounds.how = "there is no other mesh that is small enough to be compared with";
  const double fall = slowest_fall(*first.model.body);
  if (!refine) return climb(std::move(first), Steps{}, fall, options, threads);
  constexpr Steps few = {.most = 1, .hope = 3};
  Model start = first.model;
  VectorXd omega = first.basis.omega;
  const auto order_of = [](const Model& m) { return chosen(m.body->geometry, m.body->solid).order; };
  BoundedModes best = climb(std::move(first), few, fall, options, threads);
  const auto attempt = [&](BoundedModes from, Steps steps) {
    BoundedModes other = climb(std::move(from), steps, fall, options, threads);
    if (other.met() == true || std::isnan(worst(best)) || worst(other) < worst(best)) std::swap(best, other);
    best.bound_seconds += other.bound_seconds + seconds_of(other);
  };
  if (best.met() != true && order_of(start) < least_order_of_tuning) {
    start = with_order(std::move(start), least_order_of_tuning);
    BoundedModes higher = modes_of(start, options, threads);
    omega = higher.basis.omega;
    attempt(std::move(higher), few);
  }
  if (best.met() == true) return best;
  Stopwatch clock;
  std::optional<Model> better =
      tuned(std::move(start), std::move(omega), best.basis.rigid_freedoms, *best.accuracy, options, threads);
  best.bound_seconds += clock.seconds();
  if (better) attempt(modes_of(*std::move(better), options, threads), Steps{.most = most_steps});
  return best;
}

}  // namespace flexboom
