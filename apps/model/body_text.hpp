#pragma once

#include "apps/model/reduction.hpp"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace flexboom {

/// Mass, centre, inertia, coordinate table and checks of a body, as text.
std::string description(const ReducedBody&, const std::vector<BodyCheck>& checks);

/// The same as a document; `notes` beside it.
nlohmann::ordered_json body_json(const ReducedBody&, const std::vector<BodyCheck>& checks,
                                 const std::vector<std::string>& notes);
nlohmann::ordered_json seconds_json(const ReductionSeconds&);
std::string checks_text(const std::vector<BodyCheck>&);
nlohmann::ordered_json checks_json(const std::vector<BodyCheck>&);

}  // namespace flexboom
