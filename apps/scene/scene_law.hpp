#pragma once

#include "apps/base/toml_reader.hpp"
#include "dynamics/model/joint_law.hpp"
#include "dynamics/model/multibody.hpp"

#include <string>

/// Laws of joints in scenes and states. Internal to `apps`.
namespace flexboom {

/// What is wrong with a law and its start, under the keys of the table at `path`.
void check_law(toml_reader::Faults&, const std::string& path, const Joint&, double start);

/// The part of a flight's state.toml that laws need: their discrete states as text, and back.
std::string law_state_text(const LawState&);
/// @throws InputError where it is no such text.
LawState law_state_of(const std::string&);

}  // namespace flexboom
