#pragma once

#include "apps/model/model.hpp"
#include "reduction/basis/basis.hpp"
#include "reduction/body/reduced_body.hpp"

#include <optional>
#include <string>
#include <vector>

namespace flexboom {

/// Wall time of the stages of a reduction [s].
struct ReductionSeconds {
  double mesh = 0, assemble = 0, modes = 0, invariants = 0, stiffening = 0, certificate = 0, richer = 0, total = 0;
};

/// How a model becomes a reduced body, by `flexboom reduce` and for a flight.
struct ReductionOptions {
  BasisOptions basis;
  bool clamp_beside = false;  // the model's clamp holds beside interfaces
  std::optional<std::string> select;
  DampingRule damping;
  bool stiffening = true;
  std::vector<std::string> loads_at;  // node sets; empty: every marker that moves
  bool certified = true;              // false: the certificate has the invariants alone
  std::string source;                 // of the model, for the provenance
};

/// The reduced body with its certificate and provenance. The mesh of `model` may get reference nodes of interfaces; its
/// notes grow by what the basis has to say. Adds the time of its stages to `seconds`.
/// @throws InputError for a place that the model lacks, NumericalError as the bases.
ReducedBody make_reduced_body(Model& model, const ReductionOptions&, int threads, ReductionSeconds& seconds);

/// Where a body of beams has modes at whose frequencies its section itself vibrates, in words; empty: nowhere.
std::string doubt_of_modes(const BeamGeometry&, const ReducedBody&);

}  // namespace flexboom
