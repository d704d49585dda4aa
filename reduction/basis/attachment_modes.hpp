#pragma once

#include "reduction/basis/modal_basis.hpp"

#include <string>
#include <vector>

namespace flexboom {

/// A unit force or torque at an interface or node set (on its mean motion).
struct AttachmentLoad {
  std::string marker;
  std::string direction;  // "Fx" .. "Mz", mesh axes
};

/// Residual attachment modes (MacNeal 1971; Rubin 1975): the basis with, for each load, the static shape less what is
/// in the span of the shapes before it, M-orthogonal to all others, Me_kk = m. The response to the loads is then exact
/// for slow motion. `clamp` is what the basis was made with. A body that it leaves free is loaded together with the
/// inertia forces of its rigid motion (inertia relief). A load that adds no shape of its own is left out and named in
/// `summary.note`.
/// @throws InputError for an unknown marker or direction, and a torque on a marker without rotation.
ModalBasis with_attachment_modes(ModalBasis, const Mesh&, const Assembly&, const Clamp&,
                                 const std::vector<AttachmentLoad>&, int threads = 1);

/// Nodal forces of unit loads (freedoms x loads); names are looked up among the interfaces, then the node sets.
Eigen::MatrixXd unit_loads(const ModalBasis&, const Mesh&, const DofMap&, const std::vector<AttachmentLoad>&);

}  // namespace flexboom
