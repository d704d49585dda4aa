#pragma once

#include "apps/simulate/simulate.hpp"

#include <string>

namespace flexboom {

/// The moving picture of a run: bodies as lines, deformed, for a page of HTML. Where nothing holds the bodies, their
/// mass centre stays in the middle. Returns a canvas, its words, data and program.
/// `table`: trajectory.csv of the scene. `kept`: where bodies are kept that take long.
/// @throws InputError, NumericalError as the bodies' making.
std::string animation_html(const Scene&, const OutputTable& table, const std::filesystem::path& kept);

}  // namespace flexboom
