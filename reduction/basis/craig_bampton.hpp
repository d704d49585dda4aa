#pragma once

#include "reduction/basis/interface_nodes.hpp"
#include "reduction/basis/modal_basis.hpp"

#include <string>
#include <vector>

namespace flexboom {

struct CraigBamptonOptions {
  EigenOptions modes;  // of the fixed-interface normal modes; num_modes = 0: static condensation
  std::string
      reference;  // interface that carries the BRF: it has no coordinates and the body flies; empty: frame "free"
  bool orthonormal = false;          // the modes of the reduced body as coordinates: Me and Ke are diagonal
  std::vector<ModeKind> kinds = {};  // of the normal modes; empty: all
};

/// Craig-Bampton basis (Craig, Bampton, AIAA Journal 6, 1968). First come the static shapes Psi_c of a unit motion of
/// each kept interface freedom with the others held, interface after interface. Then come the normal modes Phi_n with
/// all interfaces held, in the sizes and signs of clamped_modes. `clamp` is held beside the interfaces.
/// @throws InputError when the interfaces held leave the body free to move, or a kept freedom is supported or tied to
/// another. Also when the reference does not exist or does not hold the body. Else as clamped_modes.
ModalBasis craig_bampton(const Mesh&, const Assembly&, std::vector<InterfaceNode>, const CraigBamptonOptions&,
                         const Clamp& clamp = {}, int threads = 1);

}  // namespace flexboom
