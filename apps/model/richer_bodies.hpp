#pragma once

#include "apps/model/reduction.hpp"
#include "reduction/body_file/body_file.hpp"

#include <string>
#include <vector>

namespace flexboom {

/// Bodies beside `kept` that leave less out; pictures are left out of them. `model` and the options are what `kept` is
/// made of, `errors` is one of kept_for_errors. The notes grow by what there is not.
/// @throws InputError, NumericalError as make_reduced_body.
RicherBodies richer_bodies(const Model& model, const ReductionOptions&, const ReducedBody& kept,
                           const std::string& errors, int threads, std::vector<std::string>& notes);

}  // namespace flexboom
