#pragma once

#include "apps/model/reduction.hpp"
#include "reduction/body_file/body_file.hpp"

#include <string>
#include <vector>

namespace flexboom {

/// Corrections of a basis that stretch and twist a boom at its free end, where `body` has no mode that does: those of a
/// slender boom are beyond many that bend. `clamped`: the node set that is held.
std::vector<std::string> static_shapes_beside(const ReducedBody& body, const std::string& clamped);

/// Bodies beside `kept` that leave less out; pictures are left out of them. `model` and the options are what `kept` is
/// made of, `errors` is one of kept_for_errors. The notes grow by what there is not.
/// @throws InputError, NumericalError as make_reduced_body.
RicherBodies richer_bodies(const Model& model, const ReductionOptions&, const ReducedBody& kept,
                           const std::string& errors, int threads, std::vector<std::string>& notes);

}  // namespace flexboom
