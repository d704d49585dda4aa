#include "dynamics/model/multibody_check.hpp"

#include "dynamics/model/joint.hpp"
#include "dynamics/model/joint_law.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <Eigen/LU>

#include <cmath>

namespace flexboom {

using Eigen::Matrix3d;

namespace {

constexpr double axes_tolerance = 1e-12;  // of axes

void check_joint(const Multibody& scene, const Joint& joint) {
  check_place(scene, joint.a, fmt::format("joint {}, place a", joint.name));
  check_place(scene, joint.b, fmt::format("joint {}, place b", joint.name));
  check_mechanism(joint.mechanism, "joint " + joint.name);
  const HingeMechanism& m = joint.mechanism;
  const JointType& type = joint_type(joint.kind);
  const bool may = joint.kind == JointKind::hinge || joint.kind == JointKind::slider;
  require(may || (m.stiffness == 0 && m.damping == 0 && m.stop_stiffness == 0),
          fmt::format("joint {}: a {} joint has no mechanism; hinges and sliders have", joint.name, type.name));
  const auto scalars = static_cast<size_t>(type.scalars);
  require(joint.prescribed.empty() || (scalars > 0 && joint.prescribed.size() == scalars),
          fmt::format("joint {}: motion can be prescribed for a hinge, a slider (1 function) or a universal joint (2), "
                      "it is given for a {} joint with {}",
                      joint.name, type.name, joint.prescribed.size()));
  for (const TimeFunction& f : joint.prescribed)
    require(f.value && f.rate && f.acceleration,
            fmt::format("joint {}: a prescribed motion needs its value, rate and acceleration", joint.name));
  require(joint.prescribed.empty() || m.stop_stiffness == 0,
          fmt::format("joint {}: it has a stop beside a prescribed motion, which no stop can change", joint.name));
  for (const LawFault& fault : law_faults(joint))
    throw InputError(fmt::format("joint {}: {} {}", joint.name, fault.key, fault.text));
}

}  // namespace

void check_place(const Multibody& scene, const Place& place, const std::string& of) {
  require(place.body >= -1 && place.body < std::ssize(scene.bodies),
          fmt::format("{}: there is no body {}; there are 0 to {}, and -1 is the inertial frame", of, place.body,
                      std::ssize(scene.bodies) - 1));
  require((place.axes.transpose() * place.axes - Matrix3d::Identity()).norm() < axes_tolerance &&
              place.axes.determinant() > 0,
          fmt::format("{}: the columns of its axes must be a right-handed orthonormal triad", of));
  require(place.position.allFinite(), fmt::format("{}: its position is not finite", of));
  require(place.body >= 0 || place.marker.empty(),
          fmt::format("{}: the inertial frame has no marker '{}'; give a position", of, place.marker));
}

void check_mechanism(const HingeMechanism& m, const std::string& of) {
  for (const double value : {m.stiffness, m.damping, m.stop_stiffness})
    require(std::isfinite(value) && value >= 0,
            fmt::format("{}: stiffness, damping and stop stiffness must not be negative, got {:g}", of, value));
  require(std::isfinite(m.rest) && std::isfinite(m.threshold),
          fmt::format("{}: rest and threshold must be finite", of));
}

void check(const Multibody& scene) {
  require(scene.gravity.allFinite(), "the gravity is not finite");
  require(!scene.field || scene.gravity.isZero(0), "gravity: is either uniform or that of a planet");
  for (const ReducedBody& body : scene.bodies) body.validate();
  for (const Joint& joint : scene.joints) check_joint(scene, joint);
  for (const SpringDamper& s : scene.springs) {
    check_place(scene, s.a, fmt::format("spring {}, place a", s.name));
    check_place(scene, s.b, fmt::format("spring {}, place b", s.name));
    require(s.stiffness >= 0 && s.damping >= 0 && s.free_length >= 0,
            fmt::format("spring {}: stiffness, damping and free length must not be negative", s.name));
  }
  for (const Load& load : scene.loads) {
    check_place(scene, load.at, fmt::format("load {}", load.name));
    require(load.at.body >= 0, fmt::format("load {}: it acts on the inertial frame", load.name));
  }
  for (const ReactionWheel& w : scene.wheels) {
    require(w.body >= 0 && w.body < std::ssize(scene.bodies),
            fmt::format("wheel {}: there is no body {}", w.name, w.body));
    require(w.inertia > 0, fmt::format("wheel {}: its inertia {:g} must be positive", w.name, w.inertia));
    require(std::abs(w.axis.norm() - 1) < axes_tolerance,
            fmt::format("wheel {}: its axis must be a unit vector", w.name));
  }
}

}  // namespace flexboom
