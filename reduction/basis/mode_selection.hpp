#pragma once

#include "reduction/basis/modal_basis.hpp"
#include "reduction/body/rigid_motion.hpp"

#include <Eigen/Core>

#include <string>
#include <vector>

/// Which coordinates of a body to keep: indices, ascending, for `selected` (modal_basis.hpp). Bodies have diagonal Me,
/// as modes do.
namespace flexboom {

/// Coordinates from low to high [Hz], both ends included.
std::vector<int> modes_in_band(const ReducedBody&, double low_hz, double high_hz);

/// The list, sorted. @throws InputError for an index that does not exist or is given twice.
std::vector<int> listed_modes(const ReducedBody&, std::vector<int>);

/// The body in other coordinates: column k of T, n x m, is what the new one moves of the old ones. All its integrals,
/// markers and stiffnesses come with them; `coordinates`, m of them, say what the new ones are. It has no interfaces
/// and no certificate. @throws InputError for other sizes, and when the body has no `gram`.
ReducedBody combined(const ReducedBody&, const Eigen::MatrixXd& T, std::vector<Coordinate> coordinates);

/// The body with the listed coordinates alone, in that order; all its integrals, markers and stiffnesses come with
/// them. An interface that loses a coordinate has none any more. The certificate is dropped.
/// @throws InputError for an index that does not exist, and when the body has no `gram`.
ReducedBody selected(const ReducedBody&, const std::vector<int>& list);

/// Part of every coordinate in the rigid inertia of the body, 6 x n: L_k^2 / Me_kk with L = (Ct, Cr0): mass along x y z
/// [kg], inertia about x y z through the BRF origin [kg m^2]. Summed over all modes of a clamped body they are m and
/// the diagonal of J0 (Hughes, "Modal identities for elastic bodies", J. Appl. Mech. 47, 1980).
Eigen::MatrixXd effective_masses(const ReducedBody&);

/// The fewest coordinates whose effective masses reach a fraction of m or J0 in each of the directions (0 .. 5), the
/// largest first. @throws InputError when all of them do not reach it, saying what they reach.
std::vector<int> modes_by_effective_mass(const ReducedBody&, double fraction, const std::vector<int>& directions);

/// Share of every coordinate in the rigid mass matrix M_r as a whole, L_k^T M_r^-1 L_k / (6 Me_kk) (5 for a line mass).
/// It is independent of frame and origin. Its sum over all modes of a clamped body is 1.
Eigen::VectorXd completeness_indices(const ReducedBody&);

/// The fewest coordinates whose indices sum up to a fraction. @throws InputError as modes_by_effective_mass.
std::vector<int> modes_by_completeness(const ReducedBody&, double fraction);

/// Motion that is looked at.
struct ObservedOutput {
  std::string marker;
  std::string direction;  // "ux" .. "rz"
};

/// Share of every coordinate in the response at outputs to white noise with equal modal damping, outputs x n. The share
/// is the observability Gramian S_k^2 / (Me_kk omega_k^3) (Gawronski, Dynamics and Control of Structures, 1998). Each
/// row is divided by its largest entry. Coordinates without frequency count as the largest where they move the output.
Eigen::MatrixXd observabilities(const ReducedBody&, const std::vector<ObservedOutput>&);

/// Coordinates whose share is at least `threshold` at one of the outputs.
std::vector<int> modes_by_observability(const ReducedBody&, const std::vector<ObservedOutput>&, double threshold);

}  // namespace flexboom
