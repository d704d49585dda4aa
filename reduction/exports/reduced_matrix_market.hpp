#pragma once

#include "reduction/exports/exports.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace flexboom {

/// The matrices of a reduced body: Me.mtx, Ke.mtx, De.mtx (n x n) and gram.mtx, the sum of dm z z^T with
/// z = (1, u0, S_1, ..., S_n), which holds every mass integral (README 4). @throws InputError for a body without gram.
void write_reduced_matrices(const ReducedBody&, const ExportOptions&, const std::filesystem::path& folder);
std::vector<std::string> reduced_matrices_cannot_hold(const ReducedBody&);

/// The invariants, Ke and De of such a folder. @throws InputError as read_mtx_array, and for sizes that do not fit.
ReducedBody read_reduced_matrices(const std::filesystem::path& folder);
ReadBack reduced_matrices_read_back(const ExportOptions&, const std::filesystem::path& folder);

}  // namespace flexboom
