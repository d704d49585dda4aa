#pragma once

// What must hold of bodies, places, joints and forces whatever the formulation. Internal to `dynamics`.

#include "dynamics/model/multibody.hpp"

#include <string>

namespace flexboom {

/// @throws InputError naming what is not valid.
void check(const Multibody&);

/// `of` names the place in the error.
void check_place(const Multibody&, const Place&, const std::string& of);

/// Spring, damper and stop of the hinge or slider that is so called.
void check_mechanism(const HingeMechanism&, const std::string& of);

}  // namespace flexboom
