#pragma once

#include "apps/simulate/simulate.hpp"

#include <string>

namespace flexboom {

/// The moving picture of a flight: bodies as lines, deformed, for a page of HTML. Of a flight that nothing holds the
/// mass centre stays in the middle. Returns a canvas, its words, data and program.
/// `rows`: trajectory.csv of the scene. `kept`: where bodies are kept that take long.
/// @throws InputError, NumericalError as the bodies' making.
std::string animation_html(const Scene&, const OutputTable& table, const std::filesystem::path& kept);

}  // namespace flexboom
