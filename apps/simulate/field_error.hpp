#pragma once

#include "apps/model/prepared_body.hpp"
#include "apps/scene/scene.hpp"

#include <vector>

namespace flexboom {

/// What the gravity of a planet within a body leaves out: the field there is linear (dynamics/README.md, Gravity and
/// orbit).
///
/// The next term pulls a body of unequal inertias by 3/2 n^2 (I_max - I_min) / r, and turns it by the gradient times
/// the size of the body over r. Measured on bodies of 4e6 kg m^2 that are split in two, 6000 s: attitudes in the
/// orbital frame differ by 4.4 times their size over r.
struct FieldError {
  double share = 0;     // of any output
  double position = 0;  // drift at the end of the run [m]
  double velocity = 0;  // [m/s]
};

/// Nothing without an orbit, or where the scene leaves gravity out.
FieldError field_error(const Scene&, const std::vector<PreparedBody>&);

}  // namespace flexboom
