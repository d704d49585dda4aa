#pragma once

#include <cholmod.h>

namespace flexboom {

/// Splits the supernodes of an analysed, not yet factorised, supernodal factor into panels of at most `width` columns.
/// A supernode keeps a square for its triangle; of wide ones the upper half was 15 % of all memory, and of what a solve
/// reads. The factor is the same, its largest update matrix is smaller.
/// @throws NumericalError when memory runs out; the factor can then only be freed.
void split_into_panels(cholmod_factor&, int width, cholmod_common&);

}  // namespace flexboom
