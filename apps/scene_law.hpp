#pragma once

#include "apps/toml_reader.hpp"
#include "apps/toml_writer.hpp"
#include "dynamics/hinge.hpp"
#include "dynamics/joint_law.hpp"
#include "dynamics/multibody.hpp"

#include <string>
#include <string_view>
#include <vector>

/// Keys of a JointLaw, which a joint and a hinge of the hub have alike. Internal to `apps`.
namespace flexboom {

/// Names of these keys.
bool is_law_key(std::string_view);

JointLaw read_law(toml_reader::TableReader&);

/// Only what is there.
void write_law(toml_writer::Writer&, const JointLaw&);

/// What is wrong with a law and its start, under the keys of the table at `path`.
void check_law(toml_reader::Faults&, const std::string& path, const Joint&, double start);

/// The part of a flight's state.toml that laws need: their discrete states as text, and back.
std::string law_state_text(const LawState&);
/// @throws InputError where it is no such text.
LawState law_state_of(const std::string&);

}  // namespace flexboom
