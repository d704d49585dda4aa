#pragma once

#include "reduction/basis/interface_nodes.hpp"
#include "reduction/basis/modal_basis.hpp"
#include "reduction/body/steady_motion.hpp"

#include <Eigen/Core>

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom {

inline constexpr std::array<std::string_view, 5> basis_names = {"clamped", "hinge", "mean-axis", "craig-bampton",
                                                                "prestressed"};

/// Which shapes a body gets.
struct BasisOptions {
  std::string name = "clamped";         // one of basis_names
  int modes = 10;                       // of "hinge": of each stiffness; of "craig-bampton": with the interfaces held
  bool in_plane = false;                // those that bend along y alone, of "hinge" those that turn about its axis; of
                                        // "craig-bampton" interfaces keep uy and rz
  std::vector<std::string> interfaces;  // of "craig-bampton": node sets, "SET" or "SET:distributing"
  std::string reference;     // of "craig-bampton": interface that carries the BRF; empty: none, and the frame is "free"
  bool orthonormal = false;  // of "craig-bampton": modes of the reduced body
  std::vector<double> hinge_stiffness;                    // of "hinge": of each regime [N m/rad]
  Eigen::Vector3d hinge_axis = Eigen::Vector3d::UnitZ();  // of "hinge": through the BRF origin
  std::optional<SteadyMotion> motion;                     // of "prestressed"
  std::vector<std::string> corrections;                   // static shapes of unit loads, "SET.Fx" ... "SET.Mz"
  std::string backend = "auto";                           // eigen-solver
  bool keep_factor = false;                               // as EigenOptions
};

/// What a basis is made of.
struct BasisModel {
  std::vector<InterfaceNode> interfaces;
  Assembly assembly;
  Clamp clamp;  // what the basis is made with
  Clamp held;   // what holds the body when it is loaded: the clamp, and the interface that carries its frame
};

/// Interfaces change the mesh, so they come before the assembly. Interfaces and mean axes hold the body themselves:
/// `clamp` is then left out, or with `beside` held beside the interfaces.
/// @throws InputError for options that belong to another basis, and as place_interfaces.
BasisModel basis_model(Mesh&, const BasisOptions&, const Clamp& clamp, bool beside = false, int threads = 1);

/// The shapes. Without modes there are none (but those of interfaces and corrections). Of "prestressed" it makes the
/// clamped modes that prestressed_modes combines.
/// @throws InputError, NumericalError as the function of each basis.
ModalBasis make_basis(const Mesh&, const BasisModel&, const BasisOptions&, int threads = 1);

/// A basis with the static shapes of `options.corrections`. @throws InputError, NumericalError as
/// with_attachment_modes.
ModalBasis with_corrections(ModalBasis, const Mesh&, const BasisModel&, const BasisOptions&, int threads = 1);

/// "SET.Fy" -> ("SET", "Fy"). `of` is named in the error. @throws InputError.
std::pair<std::string, std::string> place_and_direction(const std::string& of, const std::string& text);

}  // namespace flexboom
