#include "dynamics/multibody_of.hpp"

#include <Eigen/Geometry>

namespace flexboom {

Multibody multibody_of(const System& system) {
  Multibody scene;
  scene.field = system.field();
  const bool free = !system.fixed_hub();
  if (free) {
    scene.bodies.push_back(system.hub());
    Joint flight;
    flight.name = "flight", flight.kind = JointKind::free, flight.b.body = 0;
    scene.joints.push_back(flight);
  }
  for (const Appendage& a : system.appendages()) {
    Joint joint;
    joint.name = a.hinge.name;
    joint.a.body = free ? 0 : -1;
    joint.a.position = a.hinge.point;
    joint.a.axes << a.hinge.stowed, a.hinge.outward, a.hinge.stowed.cross(a.hinge.outward);
    joint.b.body = static_cast<int>(scene.bodies.size());
    joint.mechanism = a.hinge.mechanism;
    scene.joints.push_back(joint);
    scene.bodies.push_back(a.body);
  }
  return scene;
}

}  // namespace flexboom
