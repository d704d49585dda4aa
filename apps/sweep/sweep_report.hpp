#pragma once

#include "apps/sweep/sweep_table.hpp"

#include <nlohmann/json.hpp>

#include <string>

namespace flexboom {

/// One self-contained HTML page: histogram and quantiles of every quantity, Sobol indices, a scatter matrix.
std::string sweep_report_html(const SweepTable&, const nlohmann::ordered_json& summary);

}  // namespace flexboom
