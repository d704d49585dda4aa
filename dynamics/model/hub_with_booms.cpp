#include "dynamics/model/hub_with_booms.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <cmath>
#include <utility>

namespace flexboom {

namespace {

void check_directions(const Hinge& h) {
  constexpr double tolerance = 1e-12;  // directions come from a file or a formula: round-off of a normalisation
  require(std::abs(h.stowed.norm() - 1) < tolerance && std::abs(h.outward.norm() - 1) < tolerance &&
              std::abs(h.stowed.dot(h.outward)) < tolerance,
          fmt::format("hinge {}: 'stowed' and 'outward' must be unit vectors normal to each other", h.name));
}

}  // namespace

Multibody hub_with_booms(std::optional<ReducedBody> hub, std::vector<Appendage> booms,
                         std::optional<OrbitalField> field) {
  Multibody scene;
  scene.field = std::move(field);
  const bool floats = hub.has_value();
  if (floats) {
    Joint joint;
    joint.name = hub->name, joint.kind = JointKind::free, joint.b.body = 0;
    scene.joints.push_back(std::move(joint));
    scene.bodies.push_back(std::move(*hub));
  }
  for (Appendage& boom : booms) {
    check_directions(boom.hinge);
    Joint joint;
    joint.name = boom.hinge.name.empty() ? boom.body.name : boom.hinge.name;
    joint.a.body = floats ? 0 : -1;
    joint.a.position = boom.hinge.point;
    joint.a.axes << boom.hinge.stowed, boom.hinge.outward, boom.hinge.stowed.cross(boom.hinge.outward);
    joint.b.body = static_cast<int>(scene.bodies.size());
    joint.mechanism = boom.hinge.mechanism;
    scene.joints.push_back(std::move(joint));
    scene.bodies.push_back(std::move(boom.body));
  }
  return scene;
}

}  // namespace flexboom
