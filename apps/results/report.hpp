#pragma once

#include <filesystem>
#include <string>

namespace flexboom {

/// One self-contained HTML page of a results folder, from its files alone: moving picture, plots, tables.
/// @throws InputError when a file is missing or damaged.
std::string report_html(const std::filesystem::path& folder);

/// The plots of the page as one SVG picture.
std::string overview_svg(const std::filesystem::path& folder);

}  // namespace flexboom
