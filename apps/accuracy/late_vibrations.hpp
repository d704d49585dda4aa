#pragma once

#include "apps/accuracy/output_errors.hpp"
#include "apps/scene/scene.hpp"
#include "apps/simulate/simulate.hpp"

#include <string>
#include <vector>

namespace flexboom {

/// The outputs of a run as they may be where frequencies depend on the amplitude, which linear elasticity leaves out.
///
/// A body that bends by d of its length L vibrates slower or faster by about (d / L)^2. So its outputs, and those of
/// its joints, are late by the integral of (d / L)^2 over time. What belongs to no body alone is late by the largest of
/// these times. This was measured against chains of up to 12 bodies, which turn by large angles. A strip on a
/// free hub had deflections of 1.3 % to 26 %, in 4 s to 160 s. A panel had 0.36 %, in 60 s. The true difference is 0.5
/// to 0.7 of this, in the outputs that differ most.
OutputTable with_late_vibrations(const Run&, const Scene&);

/// Outputs that no theory changes: what joints of prescribed motion do.
std::vector<std::string> prescribed_outputs(const Scene&);

}  // namespace flexboom
