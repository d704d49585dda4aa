#pragma once

#include "apps/model/prepared_body.hpp"
#include "apps/scene/scene.hpp"

#include <vector>

namespace flexboom {

/// What the gravity of a planet within a body leaves out: the field there is linear (dynamics/README.md, Gravity and
/// orbit).
///
/// The next term pulls a body of unequal inertias by 3/2 n^2 (I_max - I_min) / r, and turns it by the gradient times
/// the size of the body over r. So small a torque shifts the phase of a libration, and more so with every orbit. Size
/// is the radius of gyration, or half of the way to the farthest marker where that is more, for masses far out weigh
/// most. Measured on a body of 80 m that is split in two, 6000 s: attitudes in the orbital frame differ by 7 times that
/// over r.
struct FieldError {
  double share = 0;     // of the gradient, and of any output at the least
  double position = 0;  // drift at the end of the run [m]
  double velocity = 0;  // [m/s]
  double turns = 0;     // of the orbit at its perigee's rate, during the run [rad]
};

/// Nothing without an orbit, or where the scene leaves gravity out.
FieldError field_error(const Scene&, const std::vector<PreparedBody>&);

}  // namespace flexboom
